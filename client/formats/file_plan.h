// The files that a command is going to read and to write.
#ifndef WELLSPACE_CLIENT_FORMATS_FILE_PLAN_H_
#define WELLSPACE_CLIENT_FORMATS_FILE_PLAN_H_

#include <string>
#include <vector>

#include "absl/status/status.h"

namespace wellspace::formats {

// Tells before any work whether a command would overwrite its input, or write one file twice. Files are the same if
// device and inode are, whatever links lead there; files that are not there yet, if folder and name are. Only regular
// files count: pipes, terminals and other devices may be used more than once.
//
// Thread safety: thread-compatible.
class FilePlan {
 public:
  // `argument` names what `path` was given to, for messages: "IN" or "--stats". An empty path is no file; "-" is
  // standard input or output.
  void Reads(const std::string& argument, const std::string& path);
  void Writes(const std::string& argument, const std::string& path);
  // The same for meshes, which may be pairs of files. `format` as of CreateMesh.
  void ReadsMesh(const std::string& argument, const std::string& path);
  void WritesMesh(const std::string& argument, const std::string& path, const std::string& format);

  // Errors:     INVALID_ARGUMENT, naming both arguments and their files.
  absl::Status Check() const;

 private:
  struct File {
    std::string argument;  // with its path, as it was given
    std::string path;
    bool is_written = false;
  };

  std::vector<File> files_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_FILE_PLAN_H_
