// Files for readers that want a path, in memory where the system has such a place.
#ifndef WELLSPACE_TESTS_FUZZ_SCRATCH_FOLDER_H_
#define WELLSPACE_TESTS_FUZZ_SCRATCH_FOLDER_H_

#include <filesystem>
#include <string>
#include <string_view>

namespace wellspace::fuzz {

// A folder of this process alone; it goes when the process ends in order.
//
// Thread safety: thread-compatible.
class ScratchFolder {
 public:
  static const ScratchFolder& Get();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder();

  std::string Path(std::string_view name) const { return path_ / name; }
  // Makes or replaces a file and returns its path.
  std::string Write(std::string_view name, std::string_view content) const;

 private:
  ScratchFolder();

  std::filesystem::path path_;
};

// Requires that `message` is one line of printable characters that names a file in the folder.
void RequireClearMessage(std::string_view message);

}  // namespace wellspace::fuzz

#endif  // WELLSPACE_TESTS_FUZZ_SCRATCH_FOLDER_H_
