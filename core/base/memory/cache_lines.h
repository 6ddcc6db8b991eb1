// The least distance in memory between data that different threads write.
#ifndef WELLSPACE_CORE_BASE_MEMORY_CACHE_LINES_H_
#define WELLSPACE_CORE_BASE_MEMORY_CACHE_LINES_H_

#include <cstddef>

namespace wellspace::core {

// Two lines of a cache, which are fetched together: bytes that one thread writes are then not taken from another that
// is near it in memory.
inline constexpr size_t kCacheLines = 128;

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_MEMORY_CACHE_LINES_H_
