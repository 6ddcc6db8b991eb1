// In which simplex of a mesh a point lies.
#ifndef WELLSPACE_CORE_SIMPLEX_LOCATOR_H_
#define WELLSPACE_CORE_SIMPLEX_LOCATOR_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/geometry/box.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// The place of a point in a mesh.
template <int D>
struct PlaceInSimplex {
  uint32_t simplex = 0;                     // kNoSimplex: the point is in none
  std::array<double, D + 1> coordinates{};  // barycentric: at least 0, with a sum of 1 but for rounding
};

inline constexpr uint32_t kNoSimplex = 0xffff'ffff;

// A tree of boxes over the simplices of a mesh, in the order of a space-filling curve. It needs nothing of the mesh but
// that simplices do not overlap: meshes with holes, and regular triangulations, will do.
//
// Thread safety: const functions are thread-safe.
template <int D>
class Locator {
 public:
  Locator() = default;  // of no simplices
  // Shapes:     points: vertices x D, simplices: n x (D + 1), row-major; they outlive this. Each simplex is positively
  //             oriented.
  // Complexity: O(n log n) time, O(n) memory.
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  static absl::StatusOr<Locator> Create(std::span<const double> points, std::span<const uint32_t> simplices,
                                        const RunContext& context);

  // The numbers of `points`, n x D, along the curve: each is near the one before.
  //
  // Complexity: O(n log n); 36 bytes a point.
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::StatusOr<std::vector<uint32_t>> CurveOrder(std::span<const double> points, const RunContext& context) const;

  // The simplex that has `x`; of several, as `x` is on a face of theirs, the one with the lowest number. A coordinate
  // is 0 if and only if `x` is on the facet opposite to its vertex: that is decided exactly.
  //
  // `hint`: any number of a simplex, or kNoSimplex. It is faster if `x` is near it.
  //
  // REQUIRES:   finite coordinates.
  // Complexity: O(1) near the hint; else O(log n) for most meshes.
  PlaceInSimplex<D> Locate(const Point<D>& x, uint32_t hint = kNoSimplex) const;

  // Calls f with each simplex whose bounding box meets `box`, and perhaps with some whose box is beside it by rounding
  // to floats; each once, always in the same order.
  //
  // Complexity: O(log n + the number of calls) for most meshes.
  void ForEachNear(const Box<D>& box, absl::FunctionRef<void(uint32_t)> f) const;

  // The point of the mesh that is nearest to `x`, which is in no simplex, and its simplex; of several, the one with the
  // lowest number. `*distance` is its distance, but for rounding; infinity, and kNoSimplex, if there is no simplex.
  //
  // REQUIRES:   finite coordinates.
  // Complexity: O(log n) near the mesh, for most meshes.
  PlaceInSimplex<D> Nearest(const Point<D>& x, double* distance) const;

  // The memory that a locator of this number of simplices takes. Unit: bytes.
  static uint64_t BytesFor(uint64_t simplices);

 private:
  static constexpr size_t kFan = 4;  // children of a node

  // A box, rounded outward: half the memory, of which looking at a node is most of the cost.
  struct RoundedBox {
    std::array<float, D> low;
    std::array<float, D> high;

    bool Contains(const Point<D>& x) const {
      bool contains = true;
      for (int i = 0; i < D; ++i) {
        contains &= x[i] >= low[i] && x[i] <= high[i];
      }
      return contains;
    }
    bool Meets(const Box<D>& box) const {
      bool meets = true;
      for (int i = 0; i < D; ++i) {
        meets &= box.high[i] >= low[i] && box.low[i] <= high[i];
      }
      return meets;
    }
    // The square of the distance to `x`, all scaled.
    double DistanceSq(const Point<D>& x, double scale) const {
      double sum = 0;
      for (int i = 0; i < D; ++i) {
        sum += PositivePartSq(std::max({low[i] * scale - x[i] * scale, x[i] * scale - high[i] * scale, 0.0}));
      }
      return sum;
    }
  };

  // A node of the tree: level and number.
  struct Node {
    size_t level;
    size_t number;
  };
  // Nodes to be looked at. On each level there are at most kFan that wait.
  class NodeStack {
   public:
    bool empty() const { return count_ == 0; }
    void Push(const Node& node) { PushIf(true, node); }
    // Without a branch.
    void PushIf(bool is_wanted, const Node& node) {
      nodes_[count_] = node;
      count_ += is_wanted ? 1 : 0;
    }
    Node Pop() { return nodes_[--count_]; }

   private:
    std::array<Node, kFan * 18 + 1> nodes_;
    size_t count_ = 0;
  };

  enum class Side { kOutside, kOnFace, kInside };

  using Volumes = std::array<double, D + 1>;

  Simplex<D> CornersOf(uint32_t simplex) const;
  // Where `x` is in `simplex`. Unless it is outside, `*volumes` are those of the simplices that it makes with the
  // facets, times D!, by the corners opposite to them: 0 if and only if it is on the facet.
  // If it is, `*beyond` is the number of a corner whose facet it is beyond.
  Side Test(uint32_t simplex, const Point<D>& x, Volumes* volumes, int* beyond) const;
  // Walks from `from` towards `x`, over facets. Of the simplex that has `x` inside, `*volumes` are as Test has them; or
  // kNoSimplex: x is on a face, or beyond a boundary that is in the way, or far away.
  uint32_t Walk(uint32_t from, const Point<D>& x, Volumes* volumes) const;
  PlaceInSimplex<D> PlaceOf(uint32_t simplex, const Volumes& volumes) const;

  Box<D> all_{};               // of the points
  Point<D> cells_per_unit_{};  // of the curve, in each direction
  std::span<const double> points_;
  std::span<const uint32_t> simplices_;
  HugeVector<uint32_t> across_;  // of each simplex, over the facet opposite to each of its corners
  HugeVector<uint32_t> order_;   // of the simplices, along the curve
  // Boxes around the simplices, in that order; then, level by level, around kFan of those below, up to one around all.
  std::vector<HugeVector<RoundedBox>> levels_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_LOCATOR_H_
