// Whether the system still has memory somewhere.
#ifndef WELLSPACE_TESTS_CORE_BASE_MEMORY_IS_MAPPED_H_
#define WELLSPACE_TESTS_CORE_BASE_MEMORY_IS_MAPPED_H_

#include <sys/mman.h>

#include <cerrno>

namespace wellspace::test {

// Whether the page that begins at `memory` is mapped.
inline bool IsMapped(void* memory) {
  unsigned char residency = 0;
  return mincore(memory, 1, &residency) == 0 || errno != ENOMEM;
}

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_CORE_BASE_MEMORY_IS_MAPPED_H_
