// The protection of acute curves and corners: collar points, strands, tubes and balls around curves at which patches
// meet at small angles, and around corners where curves do. CreaseSampler makes it; SpatialDomain keeps it.
#ifndef WELLSPACE_CORE_REFINE_SPACE_ACUTE_CREASES_H_
#define WELLSPACE_CORE_REFINE_SPACE_ACUTE_CREASES_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/geometry/box.h"
#include "core/geometry/box_tree.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// The end of a strand: a vertex on a curve, or a collar point.
struct StrandEnd {
  static constexpr uint32_t kNoCollar = std::numeric_limits<uint32_t>::max();

  Point<3> at{};
  uint32_t collar = kNoCollar;
  uint32_t curve = 0;  // where it is no collar point
  double arc = 0;
};

// A chain of subsegments on a patch: beside an acute curve, between points at the same distances from it as on its
// other patches; or around an acute corner, on a sphere. Its points have a parameter, 0 at the first end and 1 at the
// other one.
struct Strand {
  static constexpr uint32_t kNoCurve = std::numeric_limits<uint32_t>::max();

  uint32_t patch = 0;
  uint32_t group = 0;               // strands of a group are split together
  uint32_t curve = kNoCurve;        // that it goes beside; else it goes around a corner
  std::array<double, 2> arcs{};     // of the curve, by end
  Point<3> centre{};                // the corner
  std::array<double, 2> radii{};    // the distances of the ends from the curve, or from the corner
  std::array<StrandEnd, 2> ends{};  // whose vertices are known once they are added
};

// A curve is acute where two patches meet at less than kAcuteAngle somewhere along it. A corner is where an acute curve
// ends in it, two curves leave it at less than kAcuteCorner, or it is the tip of a cone that opens at less. Vertices on
// acute curves stay where they are put at first, and so do those that are nearest to an acute corner on each of its
// curves. These are all at the same distance, the radius of its ball. On each patch beside every vertex of an acute
// curve there is a collar point, at equal distances from it. Between these, and around the ball of a corner, strands
// lead from each to the next. Inside of what they enclose, tubes and balls, no vertex is added.
//
// Points of patches beside a curve lie symmetrically to it, and so are in none of each other's balls.
//
// Thread safety: thread-compatible; const functions may run at once.
struct AcuteCreases {
  // A point on a patch that stays.
  struct Collar {
    Point<3> at{};
    uint32_t patch = 0;
  };

  std::vector<bool> is_acute;                   // by curve
  std::vector<std::array<double, 2>> balls;     // by curve: the radii of the balls at its ends; 0: there is none
  std::vector<std::vector<double>> first_arcs;  // by curve: where its first vertices are; empty: it is a plain curve
  std::vector<Collar> collars;
  std::vector<Strand> strands;
  std::vector<uint32_t> first_of_group;  // by group, and one more: its strands follow each other

  // Whether there is no acute curve and corner.
  bool IsEmpty() const { return shields_.empty(); }

  // For tests.
  std::span<const Strand> StrandsOfGroup(uint32_t group) const {
    return std::span(strands).subspan(first_of_group[group], first_of_group[group + 1] - first_of_group[group]);
  }

  // Adds the ball about a corner to the shields.
  void AddBall(const Point<3>& centre, double radius);
  // Adds a subsegment that is never split; and a straight piece of a tube of these radii at its ends.
  void AddFrozen(const Point<3>& a, const Point<3>& b);
  void AddTube(const Point<3>& a, const Point<3>& b, const std::array<double, 2>& radii);
  // Builds the trees by which shields and strands are found, once all are added.
  //
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Finish(const RunContext& context);

  // Whether no vertex may be added at `p`: it is in a tube, in the ball of a corner, or in the diametral ball of a
  // subsegment that is never split.
  //
  // Complexity: O(log shields) for most points.
  bool Shields(const Point<3>& p) const { return Covers(p, kShieldedShare, /*with_frozen=*/true); }

  // Whether `p` is in a closed tube or ball, on the outside of which are collar points and strands.
  //
  // Complexity: as Shields.
  bool Encloses(const Point<3>& p) const { return Covers(p, kOutside, /*with_frozen=*/false); }

  // Calls f(strand) for those whose subsegments may have `p` in their diametral balls.
  //
  // Complexity: O(log strands) for most points, and f.
  template <typename F>
  void ForEachStrandNear(const Point<3>& p, F f) const {
    strand_tree_.ForEach(WithinReachOf<3>(p, 0), [&](uint32_t strand) { f(strand); });
  }

  uint64_t MemoryBytes() const;

 private:
  // Tubes and balls are shielded up to this share of their radii: what is on their outside splits strands instead. And
  // what is on their outside is no farther than this: points of strands are at their distances from points of the
  // curve, which are not the nearest where radii grow and where a curve leaves a ball.
  static constexpr double kShieldedShare = 0.96;
  static constexpr double kOutside = 1.05;

  // All points that are nearer to the segment than radii say, which vary along it; with `is_diametral` those in the
  // ball over it.
  struct Shield {
    Point<3> a{};
    Point<3> b{};
    std::array<double, 2> radii{};
    bool is_diametral = false;
  };

  bool Covers(const Point<3>& p, double share_of_radii, bool with_frozen) const;

  std::vector<Shield> shields_;
  BoxTree<3> shield_tree_;
  BoxTree<3> strand_tree_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_ACUTE_CREASES_H_
