// Zip archives, member by member, by minizip: zip64, stored or deflated members.
#ifndef WELLSPACE_CLIENT_FORMATS_IO_ZIP_FILE_H_
#define WELLSPACE_CLIENT_FORMATS_IO_ZIP_FILE_H_

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/output_file.h"

namespace wellspace::formats {

// Writes members one after the other. The same members give the same bytes: none has a date.
//
// Thread safety: thread-compatible.
class ZipWriter {
 public:
  // REQUIRES:   `output` is empty, IsSeekable() and outlives this.
  explicit ZipWriter(OutputFile& output);
  ~ZipWriter();
  ZipWriter(const ZipWriter&) = delete;
  ZipWriter& operator=(const ZipWriter&) = delete;

  // Starts the member `name`, which will have `size` bytes.
  void Begin(const std::string& name, uint64_t size);
  // The next bytes of the member.
  void Write(std::string_view bytes);
  // Ends the archive. Returns the first error of all so far; `output` is to be committed next.
  absl::Status Finish();
  const absl::Status& status() const { return status_; }

 private:
  struct Archive;

  void EndMember();
  void Note(int result, const char* what);

  std::unique_ptr<Archive> archive_;
  bool in_member_ = false;
  absl::Status status_;
};

// Reads members of an archive, by name.
//
// Thread safety: thread-compatible.
class ZipReader {
 public:
  // Errors:     INVALID_ARGUMENT "FILE: …" for a file that is no archive, or no regular file.
  static absl::StatusOr<std::unique_ptr<ZipReader>> Open(InputFile file);
  ~ZipReader();
  ZipReader(const ZipReader&) = delete;
  ZipReader& operator=(const ZipReader&) = delete;

  // Whether there is a member `name`.
  bool Has(const std::string& name) const;

  // Goes to the start of member `name`; returns its size, which is at most about a thousand times that of the file.
  //
  // Errors:     of reading; INVALID_ARGUMENT "FILE: NAME: …" for a member that is not there or cannot be read.
  absl::StatusOr<uint64_t> Begin(const std::string& name);
  // Up to `size` bytes of the member; 0 at its end, when its checksum was right.
  absl::StatusOr<size_t> Read(char* buffer, size_t size);

 private:
  struct Archive;

  explicit ZipReader(InputFile file);
  absl::Status Error(std::string_view message) const;

  std::unique_ptr<Archive> archive_;
  std::string member_;  // empty: none is open
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_IO_ZIP_FILE_H_
