#include "client/formats/io/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/io/file_error.h"
#include "client/formats/io/number.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kChunkBytes = 1 << 18;

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

}  // namespace wellspace::formats
