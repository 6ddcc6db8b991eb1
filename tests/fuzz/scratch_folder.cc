#include "tests/fuzz/scratch_folder.h"

#include <stdlib.h>

#include <algorithm>
#include <fstream>
#include <system_error>

#include "tests/fuzz/fuzz.h"

namespace wellspace::fuzz {

const ScratchFolder& ScratchFolder::Get() {
  static const ScratchFolder folder;
  return folder;
}

ScratchFolder::ScratchFolder() {
  const std::filesystem::path memory = "/dev/shm";
  std::error_code error;
  const bool has_memory = std::filesystem::is_directory(memory, error);
  std::string pattern = (has_memory ? memory : std::filesystem::temp_directory_path()) / "wellspace-fuzz-XXXXXX";
  Require(mkdtemp(pattern.data()) != nullptr, "a folder can be made like", pattern);
  path_ = pattern;
}

ScratchFolder::~ScratchFolder() {
  std::error_code error;
  std::filesystem::remove_all(path_, error);
}

std::string ScratchFolder::Write(std::string_view name, std::string_view content) const {
  std::string path = Path(name);
  std::ofstream file(path, std::ios::binary);
  file.write(content.data(), static_cast<std::streamsize>(content.size()));
  file.close();
  Require(file.good(), "a file can be written at", path);
  return path;
}

void RequireClearMessage(std::string_view message) {
  Require(message.find(ScratchFolder::Get().Path("")) != std::string_view::npos, "an error names the file:", message);
  Require(std::all_of(message.begin(), message.end(), [](char c) { return c >= ' ' && c <= '~'; }),
          "an error is one line of printable characters:", message);
}

}  // namespace wellspace::fuzz
