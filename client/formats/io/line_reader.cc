#include "client/formats/io/line_reader.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/io/file_error.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"

namespace wellspace::formats {
namespace {

constexpr size_t kLineChunkBytes = 1 << 18;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

}  // namespace

size_t CommentStart(std::string_view line) {
  size_t comment = line.find('#');
  while (comment != std::string_view::npos && comment != 0 && line[comment - 1] != ' ' && line[comment - 1] != '\t') {
    comment = line.find('#', comment + 1);
  }
  return comment;
}

LineReader::LineReader(InputFile file) : file_(std::move(file)) {}

absl::Status LineReader::Error(std::string_view message) const {
  return LineError(name(), std::max<uint64_t>(line_number_, 1), message);
}

// Reads more behind the bytes not yet returned. False when nothing came.
bool LineReader::Fill() {
  if (at_end_) {
    return false;
  }
  std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  if (buffer_.size() < end_ + kLineChunkBytes) {
    buffer_.resize(end_ + kLineChunkBytes);
  }
  const absl::StatusOr<size_t> got = file_.Read(buffer_.data() + end_, buffer_.size() - end_);
  if (!got.ok()) {
    status_ = got.status();
    at_end_ = true;
    return false;
  }
  end_ += *got;
  offset_ += *got;
  at_end_ = *got == 0;
  has_returns_ = std::memchr(buffer_.data(), '\r', end_) != nullptr;
  return !at_end_;
}

bool LineReader::FindEnd(size_t& size, size_t& terminator) {
  const auto find = [this](char end, size_t from, size_t to) -> size_t {
    const void* found = from == to ? nullptr : std::memchr(buffer_.data() + begin_ + from, end, to - from);
    return found == nullptr ? std::string::npos : static_cast<const char*>(found) - buffer_.data() - begin_;
  };
  size_t searched = 0;
  size_t end = std::string::npos;
  while (true) {
    const size_t there = end_ - begin_;
    end = find(usual_end_, searched, there);
    if (end == std::string::npos) {
      // Not searched for again and again by lines that all end in the other one.
      const char other = usual_end_ == '\n' ? '\r' : '\n';
      end = find(other, searched, there);
      usual_end_ = end == std::string::npos ? usual_end_ : other;
    }
    // LF may follow a CR that is the last byte.
    const bool is_known = usual_end_ == '\n' || has_lone_returns_ || end + 1 < there || at_end_;
    if (end != std::string::npos && is_known) {
      break;
    }
    searched = end == std::string::npos ? there : end;
    if (there > kMaxLineBytes && end == std::string::npos) {
      status_ = LineError(name(), line_number_ + 1,
                          absl::StrCat("the line is longer than ", kMaxLineBytes, " bytes; expected a text file"));
      return false;
    }
    if (!Fill() && end == std::string::npos) {
      size = end_ - begin_;
      terminator = 0;
      return status_.ok() && size > 0;
    }
    if (!status_.ok()) {
      return false;
    }
  }
  if (const size_t first = find(usual_end_ == '\n' ? '\r' : '\n', 0, end); first != std::string::npos) {
    end = first;
  }
  size = end;
  const bool is_return = buffer_[begin_ + end] == '\r';
  const bool is_pair = is_return && begin_ + end + 1 < end_ && buffer_[begin_ + end + 1] == '\n' && !has_lone_returns_;
  has_lone_returns_ |= line_number_ == 0 && is_return && !is_pair;
  terminator = is_pair ? 2 : 1;
  return true;
}

bool LineReader::Next(std::string_view& line) {
  size_t size = 0;
  size_t terminator = 1;
  if (!status_.ok()) {
    return false;
  }
  const char* first = buffer_.data() + begin_;
  const void* newline = has_returns_ || begin_ == end_ ? nullptr : std::memchr(first, '\n', end_ - begin_);
  if (newline != nullptr) {
    size = static_cast<const char*>(newline) - first;
  } else if (!FindEnd(size, terminator)) {
    return false;
  }
  line = std::string_view(buffer_.data() + begin_, size);
  begin_ += size + terminator;
  if (line_number_ == 0) {
    if (line.substr(0, kByteOrderMark.size()) == kByteOrderMark) {
      line.remove_prefix(kByteOrderMark.size());
    } else if (line.substr(0, 2) == "\xFF\xFE" || line.substr(0, 2) == "\xFE\xFF") {
      status_ = LineError(name(), 1, "the file is in UTF-16; expected ASCII or UTF-8");
      return false;
    }
  }
  ++line_number_;
  return true;
}

absl::Status LineReader::Finish() {
  while (file_.is_compressed() && status_.ok() && !at_end_) {
    begin_ = end_;
    Fill();
  }
  return status_;
}

bool LineReader::NextStartsWith(std::string_view text) {
  while (end_ - begin_ < text.size() && status_.ok() && Fill()) {
  }
  return std::string_view(buffer_.data() + begin_, end_ - begin_).substr(0, text.size()) == text;
}

size_t LineReader::Take(char* bytes, size_t size) {
  size_t taken = 0;
  while (taken < size && status_.ok() && (begin_ < end_ || Fill())) {
    const size_t part = std::min(size - taken, end_ - begin_);
    std::memcpy(bytes + taken, buffer_.data() + begin_, part);
    begin_ += part;
    taken += part;
  }
  return taken;
}

bool LineReader::NextContent(std::string_view& line) {
  comment_.clear();
  is_comment_behind_ = false;
  while (Next(line)) {
    const size_t comment = CommentStart(line);
    if (comment != std::string_view::npos) {
      comment_ = TrimBlanks(line.substr(comment + 1));
      if (on_comment_) {
        on_comment_(comment_);
      }
      line = line.substr(0, comment);
    }
    whole_line_ = line;
    line = TrimBlanks(line);
    if (!line.empty()) {
      is_comment_behind_ = comment != std::string_view::npos;
      return true;
    }
  }
  return false;
}

}  // namespace wellspace::formats
