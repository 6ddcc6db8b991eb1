// The edges of facets in space, each with the facets that it has.
#ifndef WELLSPACE_CORE_VALIDATE_FACET_EDGES_H_
#define WELLSPACE_CORE_VALIDATE_FACET_EDGES_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/cancellable_sort.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"

namespace wellspace::core {

// A side of a facet.
struct FacetSide {
  std::array<uint32_t, 2> ends{};  // ascending
  uint32_t facet = 0;
  uint32_t apex = 0;  // the vertex across from it
};

// The sides of facets, sorted, so that those of one edge come one after the other.
//
// Thread safety: thread-compatible; const functions may run at once.
class FacetEdges {
 public:
  // Shapes:     facets: rows of 3 vertices.
  // Complexity: O(m log m).
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  static absl::StatusOr<FacetEdges> Of(std::span<const uint32_t> facets, const RunContext& context) {
    FacetEdges edges;
    edges.sides_.reserve(facets.size());
    for (size_t i = 0; i < facets.size(); ++i) {
      const size_t first = i - i % 3;
      const uint32_t u = facets[i];
      const uint32_t v = facets[first + (i + 1) % 3];
      edges.sides_.push_back({.ends = {std::min(u, v), std::max(u, v)},
                              .facet = static_cast<uint32_t>(i / 3),
                              .apex = facets[first + (i + 2) % 3]});
    }
    const auto before = [](const FacetSide& a, const FacetSide& b) {
      return std::tie(a.ends, a.facet) < std::tie(b.ends, b.facet);
    };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(edges.sides_, before, context));
    return edges;
  }

  // Calls f(sides) for each edge, by ascending ends, with the sides that are it.
  template <typename F>
  void ForEach(const F& f) const {
    for (size_t begin = 0, end = 0; begin < sides_.size(); begin = end) {
      while (end < sides_.size() && sides_[end].ends == sides_[begin].ends) {
        ++end;
      }
      f(std::span<const FacetSide>(sides_).subspan(begin, end - begin));
    }
  }

  bool Has(const std::array<uint32_t, 2>& ends) const {
    const auto at = std::lower_bound(sides_.begin(), sides_.end(), ends,
                                     [](const FacetSide& side, const auto& wanted) { return side.ends < wanted; });
    return at != sides_.end() && at->ends == ends;
  }

 private:
  std::vector<FacetSide> sides_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_FACET_EDGES_H_
