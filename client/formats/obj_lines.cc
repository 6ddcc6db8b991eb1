#include "client/formats/obj_lines.h"

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

namespace wellspace::formats {

bool ObjLines::Next(std::string_view& line, uint64_t& number) {
  while (NextPart(line)) {
    number = reader_.line_number();
    if (!is_continued_) {
      line = TrimBlanks(line);
    } else if (!Join(line)) {
      return false;
    }
    if (!line.empty()) {
      return true;
    }
  }
  status_ = reader_.status();
  return false;
}

bool ObjLines::NextWord(std::string_view& word, FieldSplitter& fields, uint64_t& number) {
  std::string_view line;
  if (!Next(line, number)) {
    return false;
  }
  fields = FieldSplitter(line, ' ');
  fields.Next(word);
  const auto error = [&](std::string_view expected) {
    status_ =
        LineError(reader_.name(), number, absl::StrCat("expected ", std::string(expected), ", got ", Quote(word)));
    return false;
  };
  if (word.empty() || !absl::ascii_isalpha(static_cast<unsigned char>(word[0]))) {
    return error("a word such as \"v\" or \"f\"");
  }
  return word == "V" || word == "vertex" ? error("\"v\" for a vertex") : true;
}

bool ObjLines::NextPart(std::string_view& part) {
  if (!reader_.Next(part)) {
    return false;
  }
  part = TrimBlanks(part.substr(0, CommentStart(part)));
  is_continued_ = !part.empty() && part.back() == '\\';
  if (is_continued_) {
    part.remove_suffix(1);
  }
  return true;
}

bool ObjLines::Join(std::string_view& line) {
  joined_.assign(line);
  while (is_continued_) {
    is_continued_ = false;
    if (!NextPart(line)) {
      break;
    }
    if (joined_.size() + line.size() > kMaxLineBytes) {
      status_ = reader_.Error(absl::StrCat("the line and those that it continues are longer than ", kMaxLineBytes,
                                           " bytes; expected a shorter one"));
      return false;
    }
    joined_.append(" ").append(line);
  }
  status_ = reader_.status();
  line = TrimBlanks(joined_);
  return status_.ok();
}

absl::Status TakeObjVertex(std::string_view field, uint64_t count, std::string_view what, uint32_t& vertex) {
  const std::string_view text = field.substr(0, field.find('/'));
  const bool is_from_end = !text.empty() && text[0] == '-';
  uint64_t index = 0;
  if (!ParseUnsigned(text.substr(is_from_end ? 1 : 0), kMaxCount, index) || index < 1 || index > count) {
    return absl::InvalidArgumentError(count == 0 ? absl::StrCat("expected vertices before the ", std::string(what),
                                                                ", got none; and the ", std::string(what),
                                                                " has vertex ", Quote(field))
                                                 : absl::StrCat("expected a vertex from 1 to ", count, " or from -",
                                                                count, " to -1, of those above, got ", Quote(field)));
  }
  vertex = static_cast<uint32_t>(is_from_end ? count - index : index - 1);
  return absl::OkStatus();
}

}  // namespace wellspace::formats
