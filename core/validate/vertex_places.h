// Vertices of a mesh of the plane, by their places.
#ifndef WELLSPACE_CORE_VALIDATE_VERTEX_PLACES_H_
#define WELLSPACE_CORE_VALIDATE_VERTEX_PLACES_H_

#include <algorithm>
#include <cstdint>
#include <map>
#include <numeric>
#include <tuple>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/cancellable_sort.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// Vertices that are found by their place.
//
// Thread safety: thread-compatible.
class VertexPlaces {
 public:
  // REQUIRES:   `vertices` outlives it.
  // Complexity: O(n log n).
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  static absl::StatusOr<VertexPlaces> Of(std::vector<Point<2>>& vertices, const RunContext& context) {
    VertexPlaces places(vertices);
    const auto is_before = [&](uint32_t u, uint32_t v) { return std::tie(vertices[u], u) < std::tie(vertices[v], v); };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(places.order_, is_before, context));
    return places;
  }

  // The vertex at `p`, which is made if there is none.
  uint32_t At(const Point<2>& p) {
    const auto known = std::lower_bound(order_.begin(), order_.end(), p,
                                        [&](uint32_t v, const Point<2>& at) { return vertices_[v] < at; });
    if (known != order_.end() && vertices_[*known] == p) {
      return *known;
    }
    const auto [made, is_new] = made_.emplace(p, static_cast<uint32_t>(vertices_.size()));
    if (is_new) {
      vertices_.push_back(p);
    }
    return made->second;
  }

 private:
  explicit VertexPlaces(std::vector<Point<2>>& vertices) : vertices_(vertices), order_(vertices.size()) {
    std::iota(order_.begin(), order_.end(), 0);
  }

  std::vector<Point<2>>& vertices_;
  std::vector<uint32_t> order_;  // of the vertices that were there at first, by place
  std::map<Point<2>, uint32_t> made_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_VERTEX_PLACES_H_
