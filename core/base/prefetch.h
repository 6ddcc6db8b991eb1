// Asking the memory for what will soon be read.
#ifndef WELLSPACE_CORE_BASE_PREFETCH_H_
#define WELLSPACE_CORE_BASE_PREFETCH_H_

namespace wellspace::core {

// Asks for the line of the cache that `address` is in, which need not be anybody's.
inline void PrefetchLine(const void* address) {
  __builtin_prefetch(address);
  asm volatile("");  // a function that did nothing else would have no effect for g++, which drops calls of such
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_PREFETCH_H_
