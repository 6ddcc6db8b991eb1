// Files that appear complete or not at all.
#ifndef WELLSPACE_CLIENT_FORMATS_IO_OUTPUT_FILE_H_
#define WELLSPACE_CLIENT_FORMATS_IO_OUTPUT_FILE_H_

#include <cstdint>
#include <stop_token>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace wellspace::formats {

// Writes beside the wanted file under a temporary name and renames on Commit; without Commit the temporary file goes
// and the wanted one stays as it was. "-" is standard output; that, and what is no regular file (a pipe, a device), is
// written directly.
//
// Errors are kept: after the first one, writes do nothing and Commit returns it. RESOURCE_EXHAUSTED: it could not be
// written; see WriteError. Of Create, those of OpenOrReadError. A process that ignores SIGPIPE and SIGXFSZ gets errors
// in their place.
//
// Thread safety: thread-compatible.
class OutputFile {
 public:
  // The file will be `path`. Writing ends with CANCELLED once `stop` asks for it.
  static absl::StatusOr<OutputFile> Create(const std::string& path, std::stop_token stop = {});
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  ~OutputFile();

  void Write(std::string_view bytes);
  // Replaces bytes that were written before, from `offset` on. REQUIRES: offset + bytes.size() <= size(); IsSeekable().
  void Overwrite(uint64_t offset, std::string_view bytes);
  // How many bytes were written.
  uint64_t size() const { return size_; }
  // Whether Overwrite can be used: not on standard output, a pipe or a device.
  bool IsSeekable() const { return !temporary_.empty(); }
  // The name that the file has until Commit, for a library that writes it; empty unless IsSeekable().
  const std::string& temporary_path() const { return temporary_; }
  // Sends the buffer to the system. Returns the first error so far.
  absl::Status Flush();
  // Flushes and gives the file its name.
  absl::Status Commit();

  const absl::Status& status() const { return status_; }

 private:
  OutputFile(int descriptor, std::string path, std::string temporary, std::stop_token stop);
  void Send(std::string_view bytes);
  absl::Status CannotWrite(int error) const;

  int descriptor_;
  std::string path_;
  std::string temporary_;  // empty: the descriptor is the wanted file itself
  std::stop_token stop_;
  std::string buffer_;
  uint64_t size_ = 0;
  absl::Status status_;
};

// Unlinks the temporary files of this process, and lets none come or get its name any more: a thread that tries waits
// for ever. To be called before a signal ends the process, by a thread, not by a handler of signals.
void RemoveTemporaryFilesForGood();

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_IO_OUTPUT_FILE_H_
