// The resources that the machine and its control groups let this process have.
#ifndef WELLSPACE_SERVER_BASE_RESOURCES_H_
#define WELLSPACE_SERVER_BASE_RESOURCES_H_

#include <cstdint>
#include <string>

namespace wellspace::server {

struct Resources {
  uint64_t memory_bytes = 0;  // 0: not known
  int processors = 1;         // at least 1
};

// The machine's memory and processors, or less where a control group of this process, or one above it, has a limit: of
// memory (memory.max), or of processor time (cpu.max), rounded up to whole processors. Both versions of control groups
// are read, and processors that this process may not run on do not count. A file that cannot be read sets no limit.
//
// `root` stands before /proc and /sys; tests have files there.
Resources ReadResources(const std::string& root = "");

// The limit of memory for a server that is told none: three quarters of `resources`, and at least kMinMemoryBytes; 0,
// no limit, when that is not known.
uint64_t DefaultMaxMemory(const Resources& resources);

// The name by which other machines know this one, as far as the system knows.
std::string NameOfMachine();

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_BASE_RESOURCES_H_
