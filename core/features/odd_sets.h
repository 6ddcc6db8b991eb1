// Sets of numbers that lie on segments: of polygons, or of groups, whose rings these are parts of.
#ifndef WELLSPACE_CORE_FEATURES_ODD_SETS_H_
#define WELLSPACE_CORE_FEATURES_ODD_SETS_H_

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace wellspace::core {

// Sets of numbers below a bound. A set is known by a number: one below the bound stands for itself alone, others for
// two sets joined. A number that is in an even number of the joined sets is in none.
//
// Thread safety: thread-compatible.
class OddSets {
 public:
  static constexpr uint32_t kEmpty = std::numeric_limits<uint32_t>::max();

  explicit OddSets(uint32_t bound = 0) : bound_(bound) {}

  // Complexity: O(1).
  uint32_t Join(uint32_t one, uint32_t other);
  // Ascending.
  //
  // Complexity: O(k log k), k of these numbers and of those that come up an even number of times.
  std::vector<uint32_t> MembersOf(uint32_t set) const;

 private:
  uint32_t bound_;
  std::vector<std::array<uint32_t, 2>> joined_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_ODD_SETS_H_
