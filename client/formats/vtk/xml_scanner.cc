#include "client/formats/vtk/xml_scanner.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/formats/io/number.h"

namespace wellspace::formats {
namespace {

bool StartsWith(std::string_view text, std::string_view prefix) { return text.substr(0, prefix.size()) == prefix; }

std::string_view SkipSpace(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(kXmlSpace), text.size()));
  return text;
}

}  // namespace

std::string XmlText(const std::string& text) {
  return absl::StrReplaceAll(text, {{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}, {"\"", "&quot;"}});
}

std::string_view XmlScanner::Attribute(std::string_view attribute) const {
  for (const auto& [key, value] : attributes_) {
    if (key == attribute) {
      return value;
    }
  }
  return {};
}

absl::Status XmlScanner::Error(std::string_view message) const {
  const uint64_t line = 1 + std::count(document_.begin(), document_.begin() + piece_begin_, '\n');
  return LineError(name_, line, message);
}

XmlScanner::Piece XmlScanner::Fail(std::string_view message) {
  status_ = Error(message);
  return Piece::kError;
}

XmlScanner::Piece XmlScanner::Next() {
  if (!status_.ok()) {
    return Piece::kError;
  }
  if (pending_end_tag_) {
    pending_end_tag_ = false;
    return Piece::kEndTag;
  }
  while (position_ < document_.size()) {
    piece_begin_ = position_;
    const std::string_view rest = document_.substr(position_);
    if (rest[0] != '<') {
      value_ = rest.substr(0, rest.find('<'));
      position_ += value_.size();
      return Piece::kText;
    }
    std::string_view terminator;
    if (StartsWith(rest, "<!--")) {
      terminator = "-->";
    } else if (StartsWith(rest, "<?")) {
      terminator = "?>";
    } else if (StartsWith(rest, "<!")) {
      terminator = ">";
    } else {
      return ReadTag();
    }
    const size_t end = rest.find(terminator);
    if (end == std::string_view::npos) {
      return Fail(absl::StrCat("the file ends inside ", Quote(rest.substr(0, 4))));
    }
    position_ += end + terminator.size();
  }
  piece_begin_ = document_.size();
  return Piece::kEnd;
}

XmlScanner::Piece XmlScanner::ReadTag() {
  std::string_view tag = document_.substr(position_ + 1);
  const size_t end = tag.find('>');
  if (end == std::string_view::npos) {
    return Fail(absl::StrCat("the file ends inside the tag ", Quote(tag)));
  }
  tag = tag.substr(0, end);
  position_ += end + 2;
  if (StartsWith(tag, "/")) {
    tag.remove_prefix(1);
    value_ = tag.substr(0, tag.find_first_of(kXmlSpace));
    return Piece::kEndTag;
  }
  if (!tag.empty() && tag.back() == '/') {
    pending_end_tag_ = true;
    tag.remove_suffix(1);
  }
  value_ = tag.substr(0, tag.find_first_of(kXmlSpace));
  if (value_.empty() || !ReadAttributes(tag.substr(value_.size()))) {
    return Fail(absl::StrCat("expected <name attribute=\"value\" ...>, got ", Quote(tag)));
  }
  return Piece::kStartTag;
}

bool XmlScanner::ReadAttributes(std::string_view text) {
  attributes_.clear();
  for (text = SkipSpace(text); !text.empty(); text = SkipSpace(text)) {
    const size_t equals = text.find('=');
    if (equals == std::string_view::npos) {
      return false;
    }
    std::string_view key = text.substr(0, equals);
    key = key.substr(0, key.find_first_of(kXmlSpace));
    text = SkipSpace(text.substr(equals + 1));
    if (text.empty() || (text[0] != '"' && text[0] != '\'')) {
      return false;
    }
    const size_t close = text.find(text[0], 1);
    if (close == std::string_view::npos) {
      return false;
    }
    attributes_.emplace_back(key, text.substr(1, close - 1));
    text.remove_prefix(close + 1);
  }
  return true;
}

}  // namespace wellspace::formats
