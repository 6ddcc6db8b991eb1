// Data that gzip has compressed, piece by piece in bounded memory.
#ifndef WELLSPACE_CLIENT_FORMATS_IO_GZIP_INFLATER_H_
#define WELLSPACE_CLIENT_FORMATS_IO_GZIP_INFLATER_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace wellspace::formats {

// The first bytes of a file of gzip: its mark, and deflate, the only method there is.
inline constexpr std::string_view kGzipMagic = "\x1f\x8b\x08";

// Thread safety: thread-compatible.
class GzipInflater {
 public:
  // `name` is that of the file, for messages.
  explicit GzipInflater(std::string name);
  ~GzipInflater();

  // Up to `size` bytes, of one member of the file after the other; 0 at the end of the last one, whose checksum was
  // right. `source` is where the compressed bytes come from: up to as many as are asked for, 0 at their end.
  //
  // Errors:     of the source; INVALID_ARGUMENT "NAME: …" for data that end early, are damaged or followed by something
  //             else, and for those that inflate to very much more than a cloud can.
  absl::StatusOr<size_t> Read(const std::function<absl::StatusOr<size_t>(char*, size_t)>& source, char* buffer,
                              size_t size);

 private:
  struct Stream;

  absl::Status Error(std::string_view message) const;
  // More compressed bytes for the stream; none at their end.
  absl::Status Refill(const std::function<absl::StatusOr<size_t>(char*, size_t)>& source);

  std::string name_;
  std::unique_ptr<Stream> stream_;
  uint64_t taken_ = 0;  // compressed bytes
  uint64_t given_ = 0;  // bytes that they were
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_IO_GZIP_INFLATER_H_
