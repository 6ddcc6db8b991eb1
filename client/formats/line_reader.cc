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

namespace wellspace::formats {
namespace {

constexpr size_t kChunkBytes = 1 << 18;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

}  // namespace

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
    : descriptor_(std::exchange(other.descriptor_, -1)), name_(std::move(other.name_)) {}

InputFile::~InputFile() {
  if (descriptor_ > STDERR_FILENO) {
    close(descriptor_);
  }
}

absl::StatusOr<size_t> InputFile::Read(char* buffer, size_t size) {
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
    const absl::StatusOr<size_t> got = Read(text.data() + used, text.size() - used);
    if (!got.ok()) {
      return got.status();
    }
    used += *got;
    if (*got == 0) {
      text.resize(used);
      return text;
    }
  }
}

std::optional<uint64_t> InputFile::size() const {
  struct stat attributes;
  if (fstat(descriptor_, &attributes) != 0 || !S_ISREG(attributes.st_mode)) {
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
  return !at_end_;
}

bool LineReader::Next(std::string_view& line) {
  if (!status_.ok()) {
    return false;
  }
  size_t searched = 0;
  const char* newline = nullptr;
  while (true) {
    const size_t size = end_ - begin_;
    newline = searched == size
                  ? nullptr
                  : static_cast<const char*>(std::memchr(buffer_.data() + begin_ + searched, '\n', size - searched));
    if (newline != nullptr) {
      break;
    }
    searched = size;
    if (size > kMaxLineBytes) {
      status_ = LineError(name(), line_number_ + 1,
                          absl::StrCat("the line is longer than ", kMaxLineBytes, " bytes; expected a text file"));
      return false;
    }
    if (!Fill()) {
      break;
    }
  }
  if (!status_.ok() || begin_ == end_) {
    return false;
  }
  const char* first = buffer_.data() + begin_;
  const char* last = newline != nullptr ? newline : buffer_.data() + end_;
  line = std::string_view(first, last - first);
  begin_ = newline != nullptr ? newline + 1 - buffer_.data() : end_;
  if (!line.empty() && line.back() == '\r') {
    line.remove_suffix(1);
  }
  if (line_number_ == 0 && line.substr(0, kByteOrderMark.size()) == kByteOrderMark) {
    line.remove_prefix(kByteOrderMark.size());
  }
  ++line_number_;
  return true;
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
  while (Next(line)) {
    if (const size_t comment = line.find('#'); comment != std::string_view::npos) {
      comment_ = TrimBlanks(line.substr(comment + 1));
      line = line.substr(0, comment);
    }
    line = TrimBlanks(line);
    if (!line.empty()) {
      return true;
    }
  }
  return false;
}

}  // namespace wellspace::formats
