// The common part of cells that are cut in floats, in the plane and in space.
#ifndef WELLSPACE_CORE_CELL_FLOAT_CELL_H_
#define WELLSPACE_CORE_CELL_FLOAT_CELL_H_

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/base/simd/lanes.h"
#include "core/cell/cell_parts.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/power_predicate.h"

namespace wellspace::core {

template <int D>
struct FloatBisector;
template <typename Cell, int D>
struct CellOnUnit;

// The part of Polygon and Polyhedron that does not depend on how nodes are joined. While cuts are made nodes are
// floats, in *the units of the nodes*: lengths times scale_. That is the power of two that brings the box that the cell
// began with to about 1: no square of a float overflows, and scaling rounds nothing. Planes stay in doubles, in the
// units of the input.
//
// Thread safety: thread-compatible.
template <int D>
class FloatCell {
 public:
  // The number of nodes that are worked on together: a Group's.
  static constexpr size_t kGroupSize = kFloatLanes;

  bool IsTooLarge() const { return count_ > kMostNodes<D> || plane_count_ > kMostPlanes; }
  FaceMask FacesOf(const CellNode<D>& node) const { return core::FacesOf<D>(planes_, node); }

  const Point<D>& site() const { return site_; }
  void Tighten() {}  // each cut does so
  double reach_sq() const {
    const double reach = std::min(radius_bound_ * unit_length_, placed_reach_);
    return reach * reach;
  }
  double CutLimitSq() const { return kCutLimit * reach_sq(); }
  std::span<const CellNode<D>> nodes() const { return nodes_; }
  const Plane<D>& plane(int index) const { return planes_[index]; }
  int plane_count() const { return static_cast<int>(plane_count_); }
  uint64_t cuts() const { return cuts_; }
  const DecisionCounters& counters() const { return counters_; }

 protected:
  explicit FloatCell(VectorUnit unit) : unit_(unit) {}

  // How many groups of kGroupSize hold `count` nodes.
  static constexpr size_t GroupsFor(size_t count) { return (count + kGroupSize - 1) / kGroupSize; }

  // Forgets the cell before, and takes the walls for planes.
  void BeginWalls(const Point<D>& site, const Box<D>& bounds, const std::array<PlaneKind, 2 * D>& kinds, TieRule rule) {
    site_ = site;
    rule_ = rule;
    cuts_ = 0;
    counters_ = {};
    planes_.resize(std::max<size_t>(planes_.size(), 64));
    plane_count_ = 2 * D;
    double longest = 0;
    for (int face = 0; face < 2 * D; ++face) {
      SetWall<D>(site, bounds, face, kinds[face], planes_[face]);
      longest = std::max(longest, planes_[face].distance);
    }
    // The power of two below the longest, and one over it.
    constexpr int kMantissaBits = std::numeric_limits<double>::digits - 1;
    constexpr uint64_t kMostExponent = 2046;
    const uint64_t exponent =
        std::clamp<uint64_t>(std::bit_cast<uint64_t>(longest) >> kMantissaBits, 1, kMostExponent - 1);
    unit_length_ = std::bit_cast<double>(exponent << kMantissaBits);
    scale_ = std::bit_cast<double>((kMostExponent - exponent) << kMantissaBits);
    is_placed_ = false;
    placed_reach_ = std::numeric_limits<double>::infinity();
    radius_bound_ = std::numeric_limits<float>::infinity();
  }

  // Appends the bisector of the site and `position`, and returns its index.
  WELLSPACE_INLINE size_t AddBisector(VertexId u, const Point<D>& position) {
    ++cuts_;
    is_placed_ = false;
    const size_t index = plane_count_++;
    if (planes_.size() < plane_count_) {
      planes_.resize(2 * plane_count_);
    }
    const Point<D> normal = Difference<D>(position, site_);
    SetBisector<D>(u, position, normal, NormSq<D>(normal), planes_[index]);
    return index;
  }

  // Whether the bisector of the site and `generator` cuts off the node of these planes, exactly.
  template <typename PlaneIndex>
  bool IsCutOff(const std::array<PlaneIndex, D>& planes, const Point<D>& generator) {
    return DecideNode<D>(site_, planes_, planes, generator, rule_, counters_);
  }

  // In the units of the nodes.
  Point<D> ScaledTo(const Point<D>& p) const {
    Point<D> w = Difference<D>(p, site_);
    for (double& x : w) {
      x *= scale_;
    }
    return w;
  }

  VectorUnit unit_;
  Point<D> site_{};
  TieRule rule_ = TieRule::kKeep;
  double scale_ = 1;              // from the units of the input to those of the nodes; a power of two
  double unit_length_ = 1;        // 1 / scale_
  float radius_bound_ = 0;        // at least the distance from the site to the farthest node, in the units of the nodes
  double placed_reach_ = 0;       // the same of the nodes that were placed last, in the units of the input
  size_t count_ = 0;              // of the nodes
  std::vector<Plane<D>> planes_;  // by plane, plane_count_ of them: walls by FaceIndex, then bisectors as they cut
  size_t plane_count_ = 0;
  bool is_placed_ = false;          // all nodes are
  std::vector<CellNode<D>> nodes_;  // by node: the result of nodes()
  uint64_t cuts_ = 0;
  DecisionCounters counters_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_FLOAT_CELL_H_
