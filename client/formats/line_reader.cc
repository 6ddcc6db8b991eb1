#include "client/formats/line_reader.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/file_error.h"
#include "client/formats/number.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kChunkBytes = 1 << 18;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

}  // namespace

size_t CommentStart(std::string_view line) {
  size_t comment = line.find('#');
  while (comment != std::string_view::npos && comment != 0 && line[comment - 1] != ' ' && line[comment - 1] != '\t') {
    comment = line.find('#', comment + 1);
  }
  return comment;
}

absl::StatusOr<InputFile> InputFile::Open(const std::string& path) {
  if (path == kStandardStream) {
    return InputFile(STDIN_FILENO, "<stdin>");
  }
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    return OpenOrReadError(errno, absl::StrCat("cannot open ", path));
  }
  InputFile file(descriptor, path);
  struct stat attributes;
  if (fstat(descriptor, &attributes) != 0) {
    return OpenOrReadError(errno, absl::StrCat("cannot open ", path));
  }
  if (S_ISDIR(attributes.st_mode)) {
    return absl::InvalidArgumentError(absl::StrCat("cannot read ", path, ": it is a folder; expected a file"));
  }
  return file;
}

InputFile::InputFile(InputFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      name_(std::move(other.name_)),
      start_(std::move(other.start_)),
      inflater_(std::move(other.inflater_)),
      peeked_(std::move(other.peeked_)) {}

InputFile::~InputFile() {
  if (descriptor_ > STDERR_FILENO) {
    close(descriptor_);
  }
}

absl::Status InputFile::InflateGzip(bool is_expected) {
  std::string start(kGzipMagic.size(), '\0');
  size_t taken = 0;
  while (taken < start.size()) {
    WELLSPACE_ASSIGN_OR_RETURN(const size_t got, ReadDescriptor(start.data() + taken, start.size() - taken));
    if (got == 0) {
      break;
    }
    taken += got;
  }
  start.resize(taken);
  start_ = start;
  if (start == kGzipMagic) {
    inflater_ = std::make_unique<GzipInflater>(name_);
    return absl::OkStatus();
  }
  return is_expected
             ? absl::InvalidArgumentError(absl::StrCat(name_, ": expected a file of gzip, which starts with ",
                                                       Quote(kGzipMagic), ", as its name says, got ", Quote(start)))
             : absl::OkStatus();
}

absl::StatusOr<size_t> InputFile::Read(char* buffer, size_t size) {
  if (peeked_.empty()) {
    return ReadBehindPeeked(buffer, size);
  }
  const size_t part = std::min(size, peeked_.size());
  std::memcpy(buffer, peeked_.data(), part);
  peeked_.erase(0, part);
  return part;
}

absl::StatusOr<std::string_view> InputFile::Peek(size_t size) {
  while (peeked_.size() < size) {
    const size_t had = peeked_.size();
    peeked_.resize(size);
    const absl::StatusOr<size_t> got = ReadBehindPeeked(peeked_.data() + had, size - had);
    peeked_.resize(had + got.value_or(0));
    WELLSPACE_RETURN_IF_ERROR(got.status());
    if (*got == 0) {
      break;
    }
  }
  return std::string_view(peeked_).substr(0, size);
}

absl::StatusOr<size_t> InputFile::ReadBehindPeeked(char* buffer, size_t size) {
  const auto read = [this](char* to, size_t bytes) -> absl::StatusOr<size_t> {
    if (start_.empty()) {
      return ReadDescriptor(to, bytes);
    }
    const size_t part = std::min(bytes, start_.size());
    std::memcpy(to, start_.data(), part);
    start_.erase(0, part);
    return part;
  };
  return inflater_ != nullptr ? inflater_->Read(read, buffer, size) : read(buffer, size);
}

absl::StatusOr<size_t> InputFile::ReadDescriptor(char* buffer, size_t size) {
  while (true) {
    const ssize_t got = read(descriptor_, buffer, size);
    if (got >= 0) {
      return static_cast<size_t>(got);
    }
    if (errno != EINTR) {
      return OpenOrReadError(errno, absl::StrCat("cannot read ", name_));
    }
  }
}

absl::StatusOr<std::string> InputFile::ReadAll() {
  std::string text;
  size_t used = 0;
  while (true) {
    text.resize(used + kChunkBytes + used / 2);
    WELLSPACE_ASSIGN_OR_RETURN(const size_t got, Read(text.data() + used, text.size() - used));
    used += got;
    if (got == 0) {
      text.resize(used);
      return text;
    }
  }
}

std::optional<uint64_t> InputFile::size() const {
  struct stat attributes;
  if (is_compressed() || fstat(descriptor_, &attributes) != 0 || !S_ISREG(attributes.st_mode)) {
    return std::nullopt;
  }
  return static_cast<uint64_t>(attributes.st_size);
}

absl::StatusOr<size_t> InputFile::ReadAt(uint64_t offset, char* buffer, size_t size) const {
  while (true) {
    const ssize_t got = pread(descriptor_, buffer, size, static_cast<off_t>(offset));
    if (got >= 0) {
      return static_cast<size_t>(got);
    }
    if (errno != EINTR) {
      return OpenOrReadError(errno, absl::StrCat("cannot read ", name_));
    }
  }
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
  if (buffer_.size() < end_ + kChunkBytes) {
    buffer_.resize(end_ + kChunkBytes);
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
