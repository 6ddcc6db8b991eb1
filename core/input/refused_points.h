// The points that AddPoints refuses at once, told in one error. PointAdder and PointPlacer collect them.
#ifndef WELLSPACE_CORE_INPUT_REFUSED_POINTS_H_
#define WELLSPACE_CORE_INPUT_REFUSED_POINTS_H_

#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"

namespace wellspace::core {

// Thread safety: thread-compatible.
class RefusedPoints {
 public:
  // Adds point `index`; `status` is its error, and names it.
  void Add(uint32_t index, absl::Status status) { refused_.emplace_back(index, std::move(status)); }

  bool IsEmpty() const { return refused_.empty(); }

  // One error for all: that of the lowest index, then `so`, as "so are", the next few of them and how many there are.
  //
  // REQUIRES:   not IsEmpty().
  // Complexity: O(n log n).
  // Errors:     INVALID_ARGUMENT always.
  absl::Status InAll(const char* so);

 private:
  std::vector<std::pair<uint32_t, absl::Status>> refused_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_REFUSED_POINTS_H_
