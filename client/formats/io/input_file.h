// Files open for reading, as they are or inflated.
#ifndef WELLSPACE_CLIENT_FORMATS_IO_INPUT_FILE_H_
#define WELLSPACE_CLIENT_FORMATS_IO_INPUT_FILE_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/io/gzip_inflater.h"

namespace wellspace::formats {

// The name that stands for standard input or standard output.
inline constexpr std::string_view kStandardStream = "-";

// A file open for reading.
//
// Thread safety: thread-compatible.
class InputFile {
 public:
  // `path` "-" is standard input. Errors: NOT_FOUND, PERMISSION_DENIED…, naming the file; INVALID_ARGUMENT for a
  // folder.
  static absl::StatusOr<InputFile> Open(const std::string& path);
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&&) = delete;
  ~InputFile();

  // From here on Read gives the bytes that are compressed, if the file starts as one of gzip does; otherwise those of
  // the file.
  //
  // REQUIRES:   nothing has been read; once only.
  // Errors:     of reading; INVALID_ARGUMENT when the file `is_expected` to be compressed and is not.
  absl::Status InflateGzip(bool is_expected);
  bool is_compressed() const { return inflater_ != nullptr; }

  // "cloud.csv" or "<stdin>", for messages.
  const std::string& name() const { return name_; }
  // Up to `size` bytes; 0 at the end of the file. Errors: of reading; INVALID_ARGUMENT for compressed data that are
  // damaged.
  absl::StatusOr<size_t> Read(char* buffer, size_t size);
  // The next `size` bytes, or all that are left if there are fewer; Read gives them again. Valid until the next call.
  absl::StatusOr<std::string_view> Peek(size_t size);
  // All that is left.
  absl::StatusOr<std::string> ReadAll();
  // How many bytes Read gives from the start; none when it is not known (of a pipe, a device, a compressed file).
  std::optional<uint64_t> size() const;
  // Up to `size` bytes from `offset` on, wherever Read is; 0 at the end of the file. REQUIRES: the file is regular.
  absl::StatusOr<size_t> ReadAt(uint64_t offset, char* buffer, size_t size) const;

 private:
  InputFile(int descriptor, std::string name) : descriptor_(descriptor), name_(std::move(name)) {}
  absl::StatusOr<size_t> ReadDescriptor(char* buffer, size_t size);
  absl::StatusOr<size_t> ReadBehindPeeked(char* buffer, size_t size);

  int descriptor_;
  std::string name_;
  std::string start_;  // bytes that InflateGzip has read, and Read has not given yet
  std::unique_ptr<GzipInflater> inflater_;
  std::string peeked_;  // bytes that Peek has read, and Read has not given yet
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_IO_INPUT_FILE_H_
