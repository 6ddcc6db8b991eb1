#include "server/base/resources.h"

#include <limits.h>
#include <sys/sysinfo.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <string_view>
#include <thread>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "server/base/options.h"

namespace wellspace::server {
namespace {

// A version 1 group without a limit says a number near the largest there is.
constexpr uint64_t kNoLimit = uint64_t{1} << 60;

// The words of a file; none when it cannot be read.
std::vector<std::string> WordsOf(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::string> words;
  for (std::string word; file >> word;) {
    words.push_back(word);
  }
  return words;
}

// The number that is the `index`-th word of a file. None where the word is another, as "max", or -1.
std::optional<uint64_t> NumberIn(const std::string& path, size_t index = 0) {
  const std::vector<std::string> words = WordsOf(path);
  uint64_t number = 0;
  if (index >= words.size() || !absl::SimpleAtoi(words[index], &number)) {
    return std::nullopt;
  }
  return number;
}

// Folders of the control group of a controller and of those above it, the lowest first. Within a container the group's
// path may be one that only the host has; its root is there all the same.
struct Groups {
  std::vector<std::string> folders;
  bool is_version_2 = false;
};

void AddFolders(const std::string& mount, std::string path, Groups& groups) {
  while (true) {
    while (path.ends_with('/')) {
      path.pop_back();
    }
    groups.folders.push_back(mount + path);
    if (path.empty()) {
      return;
    }
    path.resize(path.rfind('/'));
  }
}

Groups GroupsOf(const std::string& root, std::string_view controller) {
  std::ifstream file(root + "/proc/self/cgroup");
  Groups groups;
  std::string path_of_version_2;
  for (std::string line; std::getline(file, line);) {
    // NUMBER:CONTROLLERS:PATH, the path absolute
    const std::vector<std::string> parts = absl::StrSplit(line, absl::MaxSplits(':', 2));
    if (parts.size() != 3 || !parts[2].starts_with('/')) {
      continue;
    }
    const std::vector<std::string> controllers = absl::StrSplit(parts[1], ',');
    if (parts[1].empty()) {
      path_of_version_2 = parts[2];
    } else if (std::find(controllers.begin(), controllers.end(), controller) != controllers.end()) {
      AddFolders(absl::StrCat(root, "/sys/fs/cgroup/", parts[1]), parts[2], groups);
      AddFolders(absl::StrCat(root, "/sys/fs/cgroup/", std::string(controller)), parts[2], groups);
    }
  }
  if (groups.folders.empty() && !path_of_version_2.empty()) {
    AddFolders(root + "/sys/fs/cgroup", path_of_version_2, groups);
    groups.is_version_2 = true;
  }
  return groups;
}

uint64_t MemoryBytes(const std::string& root) {
  constexpr uint64_t kKilobyte = 1024;
  // "MemTotal:       16384000 kB", the first line. A unit of systemd with ProcSubset=pid does not see it.
  uint64_t least = NumberIn(root + "/proc/meminfo", 1).value_or(0) * kKilobyte;
  if (struct sysinfo machine = {}; least == 0 && root.empty() && sysinfo(&machine) == 0) {
    least = uint64_t{machine.totalram} * machine.mem_unit;
  }
  const Groups groups = GroupsOf(root, "memory");
  for (const std::string& folder : groups.folders) {
    const std::optional<uint64_t> limit =
        NumberIn(folder + (groups.is_version_2 ? "/memory.max" : "/memory.limit_in_bytes"));
    if (limit.has_value() && *limit < kNoLimit && (least == 0 || *limit < least)) {
      least = *limit;
    }
  }
  return least;
}

int Processors(const std::string& root) {
  double least = std::max(1u, std::thread::hardware_concurrency());
  const Groups groups = GroupsOf(root, "cpu");
  for (const std::string& folder : groups.folders) {
    // "max 100000" or "150000 100000", microseconds in each period.
    const auto quota = groups.is_version_2 ? NumberIn(folder + "/cpu.max") : NumberIn(folder + "/cpu.cfs_quota_us");
    const auto period =
        groups.is_version_2 ? NumberIn(folder + "/cpu.max", 1) : NumberIn(folder + "/cpu.cfs_period_us");
    if (quota.has_value() && period.value_or(0) > 0) {
      least = std::min(least, std::ceil(static_cast<double>(*quota) / static_cast<double>(*period)));
    }
  }
  return std::max(1, static_cast<int>(least));
}

}  // namespace

Resources ReadResources(const std::string& root) {
  return {.memory_bytes = MemoryBytes(root), .processors = Processors(root)};
}

uint64_t DefaultMaxMemory(const Resources& resources) {
  return resources.memory_bytes == 0 ? 0 : std::max(resources.memory_bytes / 4 * 3, kMinMemoryBytes);
}

std::string NameOfMachine() {
  char name[HOST_NAME_MAX + 1] = {};
  return gethostname(name, sizeof(name)) == 0 ? name : "localhost";
}

}  // namespace wellspace::server
