// The facets of simplices, those with the same vertices side by side.
#ifndef WELLSPACE_CORE_PARTITION_FACETS_OF_H_
#define WELLSPACE_CORE_PARTITION_FACETS_OF_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/base/dimensions.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/base/sort_few.h"
#include "core/base/status_macros.h"

namespace wellspace::core {

// The vertices of a facet, ascending; behind them kNoVertexOfFacet.
using FacetVertices = std::array<uint32_t, kMaxDimension>;
inline constexpr uint32_t kNoVertexOfFacet = std::numeric_limits<uint32_t>::max();

// A facet, and the row that has it: the number of a simplex, or one of the caller's.
struct FacetOfRow {
  FacetVertices vertices;
  uint32_t row = 0;

  auto operator<=>(const FacetOfRow&) const = default;
};

// The vertices `corners` in order.
inline FacetVertices InOrder(std::span<const uint32_t> corners) {
  FacetVertices vertices;
  vertices.fill(kNoVertexOfFacet);
  std::copy(corners.begin(), corners.end(), vertices.begin());
  SortFew(vertices);  // the greatest number is behind the others
  return vertices;
}

// The facet of a simplex that lies opposite to its corner `slot`.
inline FacetVertices FacetOpposite(std::span<const uint32_t> corners, size_t slot) {
  std::array<uint32_t, kMaxDimension> others;
  std::copy(corners.begin(), corners.begin() + slot, others.begin());
  std::copy(corners.begin() + slot + 1, corners.end(), others.begin() + slot);
  return InOrder(std::span(others).first(corners.size() - 1));
}

// Rows of simplices, and rows of facets behind them.
struct FacetRows {
  int dimension = 0;
  std::span<const uint32_t> simplices;  // m x (dimension + 1), row-major
  std::span<const uint32_t> facets;     // f x dimension, row-major

  size_t corners() const { return dimension + 1; }
  uint64_t simplex_count() const { return simplices.size() / corners(); }
  uint64_t facet_count() const { return facets.size() / dimension; }
  // The facet opposite to corner `slot` of a simplex; of a facet itself, whatever the slot.
  FacetVertices VerticesOf(uint64_t row, size_t slot) const {
    return row < simplex_count() ? FacetOpposite(simplices.subspan(row * corners(), corners()), slot)
                                 : InOrder(facets.subspan((row - simplex_count()) * dimension, dimension));
  }
};

// Calls found(lowest vertex, row, slot) for each facet of each row.
//
// Complexity: O(m + f).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
template <typename Found>
absl::Status ForLowestVertices(const FacetRows& rows, const RunContext& context, const Found& found) {
  const size_t corners = rows.corners();
  const uint64_t count = rows.simplex_count() + rows.facet_count();
  for (uint64_t i = 0; i < count; ++i) {
    if (i % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    if (i >= rows.simplex_count()) {
      found(rows.VerticesOf(i, 0)[0], i, size_t{0});
      continue;
    }
    const std::span<const uint32_t> row = rows.simplices.subspan(i * corners, corners);
    const size_t lowest = std::min_element(row.begin(), row.end()) - row.begin();
    uint32_t second = kNoVertexOfFacet;
    for (size_t slot = 0; slot < corners; ++slot) {
      second = slot == lowest ? second : std::min(second, row[slot]);
    }
    for (size_t slot = 0; slot < corners; ++slot) {
      found(slot == lowest ? second : row[lowest], i, slot);
    }
  }
  return absl::OkStatus();
}

// Calls visit(facets) for the facets of every lowest vertex, sorted by their vertices and then by their rows. visit
// returns a status, whose error ends it.
//
// REQUIRES:   fewer than 2^32 rows; all vertices are below vertex_count.
// Complexity: O(vertex_count + m + f), and a sort of the facets of each lowest vertex; memory of
//             FacetsOfEachVertexBytes.
// Errors:     those of visit; CANCELLED, DEADLINE_EXCEEDED.
template <typename Visit>
absl::Status ForFacetsOfEachVertex(const FacetRows& all, uint64_t vertex_count, const RunContext& context,
                                   const Visit& visit) {
  // Counted by lowest vertex, then put in place. An entry is a row and a slot.
  HugeVector<uint64_t> first(vertex_count + 1, 0);
  WELLSPACE_RETURN_IF_ERROR(
      ForLowestVertices(all, context, [&](uint32_t lowest, uint64_t, size_t) { ++first[lowest + 1]; }));
  for (uint64_t v = 0; v < vertex_count; ++v) {
    first[v + 1] += first[v];
  }
  HugeVector<uint32_t> rows(first[vertex_count]);
  HugeVector<uint8_t> slots(first[vertex_count]);
  WELLSPACE_RETURN_IF_ERROR(ForLowestVertices(all, context, [&](uint32_t lowest, uint64_t row, size_t slot) {
    const uint64_t at = first[lowest]++;
    rows[at] = static_cast<uint32_t>(row);
    slots[at] = static_cast<uint8_t>(slot);
  }));
  std::vector<FacetOfRow> bucket;
  uint64_t since_check = 0;
  for (uint64_t v = 0; v < vertex_count; ++v) {
    const uint64_t begin = v == 0 ? 0 : first[v - 1];
    bucket.resize(first[v] - begin);
    for (size_t i = 0; i < bucket.size(); ++i) {
      bucket[i] = {all.VerticesOf(rows[begin + i], slots[begin + i]), rows[begin + i]};
    }
    std::sort(bucket.begin(), bucket.end());
    WELLSPACE_RETURN_IF_ERROR(visit(std::span<const FacetOfRow>(bucket)));
    since_check += bucket.size() + 1;
    if (since_check >= kStepsBetweenChecks) {
      since_check = 0;
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
  }
  return absl::OkStatus();
}

// The memory of that. Unit: bytes.
constexpr uint64_t FacetsOfEachVertexBytes(uint64_t vertices, uint64_t facets) {
  return 8 * (vertices + 1) + 5 * facets;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_PARTITION_FACETS_OF_H_
