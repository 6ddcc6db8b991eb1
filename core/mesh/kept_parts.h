// The vertices and simplices that two meshes of one session have in common.
#ifndef WELLSPACE_CORE_MESH_KEPT_PARTS_H_
#define WELLSPACE_CORE_MESH_KEPT_PARTS_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/cancellable_sort.h"
#include "core/base/check_at.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"
#include "core/mesh/carry_field.h"
#include "core/simplex/locator.h"

namespace wellspace::core {

// Whether vertex `v` is in both meshes, under this number and with the same bits.
template <int D>
bool IsKept(std::span<const double> from, std::span<const double> onto, size_t v) {
  const size_t end = (v + 1) * D;
  return end <= from.size() && end <= onto.size() && std::memcmp(&from[v * D], &onto[v * D], D * sizeof(double)) == 0;
}

// The simplices that two meshes have in common.
struct Twins {
  HugeVector<uint32_t> of_onto;  // for each simplex of `onto` that of `from`; kNoSimplex: it has none
  std::vector<bool> has_twin;    // by simplex of `from`
};

// Finds them.
template <int D>
class TwinSearch {
 public:
  TwinSearch(const MeshView& from, const MeshView& onto, const RunContext& context)
      : from_(from), onto_(onto), context_(context) {}

  // Twins have the same vertices, all of them kept.
  //
  // Complexity: O(n log k) for vertices of at most k simplices.
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::StatusOr<Twins> Run() {
    WELLSPACE_RETURN_IF_ERROR(FindKept());
    WELLSPACE_RETURN_IF_ERROR(MatchInOrder());
    WELLSPACE_RETURN_IF_ERROR(MatchOthers());
    return Twins{.of_onto = std::move(twins_), .has_twin = std::move(has_twin_)};
  }

 private:
  using Corners = std::array<uint32_t, D + 1>;

  static Corners RowOf(const MeshView& mesh, size_t i) {
    Corners corners;
    std::copy_n(&mesh.simplices[i * (D + 1)], D + 1, corners.begin());
    return corners;
  }
  static Corners SortedRowOf(const MeshView& mesh, size_t i) {
    Corners corners = RowOf(mesh, i);
    std::ranges::sort(corners);
    return corners;
  }
  bool AreKept(const Corners& corners) const {
    return std::ranges::all_of(corners, [&](uint32_t v) { return v < is_kept_.size() && is_kept_[v] != 0; });
  }
  size_t from_count() const { return from_.simplices.size() / (D + 1); }

  absl::Status FindKept();
  // A mesh that was updated has the simplices that it keeps in their order, with those that are gone left out.
  absl::Status MatchInOrder();
  // Those that are left, by their lowest vertex.
  absl::Status MatchOthers();
  absl::Status SortByVertex();
  absl::Status SortEachVertex();

  const MeshView& from_;
  const MeshView& onto_;
  const RunContext& context_;
  HugeVector<uint8_t> is_kept_;     // of the vertices of both
  HugeVector<uint32_t> twins_;      // Twins::of_onto
  std::vector<bool> has_twin_;      // Twins::has_twin
  HugeVector<uint32_t> by_vertex_;  // simplices of `from` that are not matched, by their lowest vertex
  HugeVector<uint32_t> ends_;       // of each vertex in by_vertex_
};

template <int D>
absl::Status TwinSearch<D>::FindKept() {
  is_kept_.resize(std::min(from_.points.size(), onto_.points.size()) / D);
  for (size_t v = 0; v < is_kept_.size(); ++v) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(v, context_));
    is_kept_[v] = IsKept<D>(from_.points, onto_.points, v) ? 1 : 0;
  }
  return absl::OkStatus();
}

template <int D>
absl::Status TwinSearch<D>::MatchInOrder() {
  twins_.assign(onto_.simplices.size() / (D + 1), kNoSimplex);
  has_twin_.assign(from_count(), false);
  size_t next = 0;
  size_t steps = 0;  // over simplices that are gone: in meshes that were made anew there is no end of them
  for (size_t i = 0; i < twins_.size() && next < from_count() && steps <= 2 * from_count(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
    const Corners corners = RowOf(onto_, i);
    if (!AreKept(corners)) {
      continue;
    }
    size_t found = next;
    while (found < from_count() && steps <= 2 * from_count() && RowOf(from_, found) != corners) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(steps, context_));
      ++found;
      ++steps;
    }
    if (found < from_count() && RowOf(from_, found) == corners) {
      twins_[i] = static_cast<uint32_t>(found);
      has_twin_[found] = true;
      next = found + 1;
    }
  }
  return absl::OkStatus();
}

template <int D>
absl::Status TwinSearch<D>::SortByVertex() {
  ends_.assign(is_kept_.size() + 1, 0);
  by_vertex_.resize(from_count());
  for (const bool is_counting : {true, false}) {
    for (size_t i = 0; i < from_count(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      if (has_twin_[i] || !AreKept(RowOf(from_, i))) {
        continue;
      }
      const uint32_t lowest = SortedRowOf(from_, i)[0];
      if (is_counting) {
        ++ends_[lowest + 1];
      } else {
        by_vertex_[ends_[lowest]++] = static_cast<uint32_t>(i);
      }
    }
    for (size_t v = 1; is_counting && v < ends_.size(); ++v) {
      ends_[v] += ends_[v - 1];
    }
  }
  return SortEachVertex();
}

// Sorts the simplices of each lowest vertex by their others: of a fan all have the same one.
template <int D>
absl::Status TwinSearch<D>::SortEachVertex() {
  constexpr size_t kFew = size_t{1} << 12;
  const auto is_before = [&](uint32_t a, uint32_t b) { return SortedRowOf(from_, a) < SortedRowOf(from_, b); };
  size_t sorted = 0;
  for (size_t v = 0, begin = 0; v + 1 < ends_.size(); begin = ends_[v], ++v) {
    const auto first = by_vertex_.begin() + begin;
    const auto last = by_vertex_.begin() + ends_[v];
    if (last - first <= static_cast<std::ptrdiff_t>(kFew)) {
      std::sort(first, last, is_before);
    } else {
      std::vector<uint32_t> many(first, last);
      WELLSPACE_RETURN_IF_ERROR(CancellableSort(many, is_before, context_));
      std::copy(many.begin(), many.end(), first);
    }
    sorted += last - first + 1;
    if (sorted >= kFew) {
      sorted = 0;
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
    }
  }
  return absl::OkStatus();
}

template <int D>
absl::Status TwinSearch<D>::MatchOthers() {
  WELLSPACE_RETURN_IF_ERROR(SortByVertex());
  for (size_t i = 0; i < twins_.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
    if (twins_[i] != kNoSimplex || !AreKept(RowOf(onto_, i))) {
      continue;
    }
    const Corners corners = SortedRowOf(onto_, i);
    const auto begin = by_vertex_.begin() + (corners[0] == 0 ? 0 : ends_[corners[0] - 1]);
    const auto end = by_vertex_.begin() + ends_[corners[0]];
    const auto found = std::lower_bound(
        begin, end, corners, [&](uint32_t k, const Corners& wanted) { return SortedRowOf(from_, k) < wanted; });
    if (found != end && SortedRowOf(from_, *found) == corners) {
      twins_[i] = *found;
      has_twin_[*found] = true;
    }
  }
  return absl::OkStatus();
}

// The simplices of a mesh that the other one has not, and a locator over them. Whatever is new in the other mesh lies
// in these: a simplex that both meshes have is itself there.
template <int D>
struct ChangedSimplices {
  HugeVector<uint32_t> numbers{};    // in the mesh, ascending
  HugeVector<uint32_t> simplices{};  // their vertices
  Locator<D> locator{};              // over them; refers to `simplices` and to the points of the mesh

  // `is_changed(i)`: whether the simplex `i` is one.
  template <typename IsChanged>
  absl::Status Find(const MeshView& mesh, const IsChanged& is_changed, const RunContext& context) {
    const size_t count = mesh.simplices.size() / (D + 1);
    for (size_t i = 0; i < count; ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
      if (is_changed(i)) {
        numbers.push_back(static_cast<uint32_t>(i));
        simplices.insert(simplices.end(), &mesh.simplices[i * (D + 1)], &mesh.simplices[i * (D + 1)] + D + 1);
      }
    }
    WELLSPACE_ASSIGN_OR_RETURN(locator, Locator<D>::Create(mesh.points, simplices, context));
    return absl::OkStatus();
  }

  // The memory that it takes for this number of simplices, and vertices of the mesh. Unit: bytes. Vectors grow by
  // doubling.
  static uint64_t BytesFor(uint64_t simplices, uint64_t vertices) {
    return simplices * 2 * (D + 2) * sizeof(uint32_t) + Locator<D>::BytesFor(simplices) + vertices * sizeof(uint64_t);
  }
};

// The memory that TwinSearch takes, its result included. Unit: bytes.
inline uint64_t TwinBytes(uint64_t from_simplices, uint64_t onto_simplices, uint64_t vertices) {
  return (from_simplices + onto_simplices) * sizeof(uint32_t) + from_simplices / 8 + vertices * (sizeof(uint32_t) + 1);
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESH_KEPT_PARTS_H_
