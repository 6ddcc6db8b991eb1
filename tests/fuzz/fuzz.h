// Helpers of the fuzzing entries: the function that they define, a check, and a way to take inputs apart.
#ifndef WELLSPACE_TESTS_FUZZ_FUZZ_H_
#define WELLSPACE_TESTS_FUZZ_FUZZ_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <span>
#include <string_view>

// Runs the code under test on one input. Whatever is wrong with that code ends the process.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace wellspace::fuzz {

// Aborts, naming the law, unless `holds`.
inline void Require(bool holds, std::string_view expected, std::string_view detail = {}) {
  if (!holds) {
    std::cerr << "violated: " << expected << ' ' << detail << std::endl;
    std::abort();
  }
}

// An input, from its start to its end.
//
// Thread safety: thread-compatible.
class ByteReader {
 public:
  ByteReader(const uint8_t* data, size_t size) : rest_(data, size) {}

  bool empty() const { return rest_.empty(); }
  size_t size() const { return rest_.size(); }

  // The next byte; 0 at the end.
  uint8_t Next() {
    const std::span<const uint8_t> bytes = Take(1);
    return bytes.empty() ? uint8_t{0} : bytes[0];
  }

  // The next `size` bytes, or as many as are left.
  std::span<const uint8_t> Take(size_t size) {
    const std::span<const uint8_t> taken = rest_.first(std::min(size, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }

  // The bytes after a length of two bytes, low one first; or as many as are left.
  std::string_view TakeBlock() {
    const size_t low = Next();
    return Text(Take(low | size_t{Next()} << 8));
  }

  // All that is left, as text.
  std::string_view TakeText() { return Text(Take(rest_.size())); }

 private:
  static std::string_view Text(std::span<const uint8_t> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }

  std::span<const uint8_t> rest_;
};

}  // namespace wellspace::fuzz

#endif  // WELLSPACE_TESTS_FUZZ_FUZZ_H_
