#include "core/features/surface_curves.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/base/cancellable_sort.h"
#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/features/patch_merging.h"
#include "core/features/union_find.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {
namespace {

constexpr double kWeakAngle = 60;    // a crease across which small patches may join, below
constexpr double kEdgeAngle = 120;   // a crease within a patch that stays, if it is long
constexpr double kTurnAngle = 40;    // in a corner a curve turns by more
constexpr double kConeAngle = 300;   // around the tip of a cone is less
constexpr double kSharpAngle = 180;  // no crease is sharper

// So many times the side of a small patch is long.
constexpr double kLongEdge = 5;

// The memory of MergePatches.
constexpr uint64_t kPatchBytes = 96;
constexpr uint64_t kCreaseBytes = 2 * 48 + sizeof(CommonCrease);

// That of FindLongEdges, by point.
constexpr uint64_t kLongEdgeBytes = sizeof(double) + sizeof(uint32_t);

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

class CurveFinder {
 public:
  CurveFinder(const SurfaceComplex& complex, double crease_angle, double min_patch, const RunContext& context)
      : complex_(complex), crease_angle_(crease_angle), min_patch_(min_patch), context_(context) {}

  absl::StatusOr<SurfaceCurves> Find() {
    WELLSPACE_RETURN_IF_ERROR(FindCreases());
    WELLSPACE_RETURN_IF_ERROR(JoinSmallPatches());
    WELLSPACE_RETURN_IF_ERROR(DropFragments());
    WELLSPACE_RETURN_IF_ERROR(FindCorners());
    WELLSPACE_RETURN_IF_ERROR(FollowCurves());
    return std::move(out_);
  }

 private:
  enum class Kind : uint8_t { kPlain, kWeakCrease, kCrease, kBorder };  // a border stays whatever patches are beside it

  // Tells the edges that may be on curves, and the patches between them.
  absl::Status FindCreases() {
    const auto edges = static_cast<uint32_t>(complex_.edges.size());
    kinds_.resize(edges);
    UnionFind joined(complex_.triangles.size());
    for (uint32_t e = 0; e < edges; ++e) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(8 * size_t{e}, context_));
      const std::span<const TriangleSide> sides = complex_.SidesAt(e);
      if (sides.size() != 2 || MarkerAt(sides[0]) != MarkerAt(sides[1])) {
        kinds_[e] = Kind::kBorder;
        continue;
      }
      const double angle = crease_angle_ < kSharpAngle ? CreaseAngle(complex_, e) : 0;
      if (angle > crease_angle_) {
        kinds_[e] = angle < kWeakAngle ? Kind::kWeakCrease : Kind::kCrease;
      } else {
        joined.Join(TriangleOf(sides[0]), TriangleOf(sides[1]));
      }
    }
    const auto triangles = static_cast<uint32_t>(complex_.triangles.size());
    out_.patch_of.resize(triangles);
    for (uint32_t t = 0; t < triangles; ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      const uint32_t first = joined.Find(t);  // the least of them
      out_.patch_of[t] = first == t ? out_.patch_count++ : out_.patch_of[first];
    }
    return absl::OkStatus();
  }

  int32_t MarkerAt(TriangleSide side) const { return complex_.markers[TriangleOf(side)]; }
  uint32_t PatchAt(TriangleSide side) const { return out_.patch_of[TriangleOf(side)]; }

  absl::Status JoinSmallPatches() {
    std::vector<double> areas(out_.patch_count);
    for (uint32_t t = 0; t < complex_.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      areas[out_.patch_of[t]] += AreaOf(complex_.TriangleAt(t));
    }
    // Most surfaces have few patches; where every triangle is a patch of its own, they take much more than all else.
    const auto weak = static_cast<uint64_t>(std::count(kinds_.begin(), kinds_.end(), Kind::kWeakCrease));
    WELLSPACE_RETURN_IF_ERROR(
        context_.AllowMemory(SurfaceComplexBytes(complex_.points.size(), complex_.triangles.size()) +
                             areas.size() * kPatchBytes + weak * kCreaseBytes));
    std::vector<CommonCrease> creases;
    creases.reserve(weak);
    for (uint32_t e = 0; e < kinds_.size(); ++e) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(e, context_));
      if (kinds_[e] != Kind::kWeakCrease) {
        continue;
      }
      const uint32_t one = PatchAt(complex_.SidesAt(e)[0]);
      const uint32_t other = PatchAt(complex_.SidesAt(e)[1]);
      if (one != other) {
        const auto [a, b] = complex_.edges[e];
        creases.push_back(
            {std::min(one, other), std::max(one, other), Distance<3>(complex_.points[a], complex_.points[b])});
      }
    }
    if (creases.empty()) {
      return absl::OkStatus();
    }
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<uint32_t> become,
                               MergePatches(areas, creases, min_patch_ * min_patch_, context_));
    std::vector<uint32_t> number(out_.patch_count, kNone);
    out_.patch_count = 0;
    for (uint32_t& patch : out_.patch_of) {
      uint32_t& to = number[become[patch]];
      to = to == kNone ? out_.patch_count++ : to;
      patch = to;
    }
    return absl::OkStatus();
  }

  // Leaves the edges that part patches, borders, and long sharp edges of a patch that goes around, as at the back of a
  // wing: no facets would end there.
  absl::Status DropFragments() {
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<bool> is_long, FindLongEdges());
    for (uint32_t e = 0; e < kinds_.size(); ++e) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(e, context_));
      if (IsCrease(e)) {
        kinds_[e] = !IsWithinPatch(e) || (!is_long.empty() && is_long[e]) ? Kind::kCrease : Kind::kPlain;
      }
    }
    return absl::OkStatus();
  }

  bool IsCrease(uint32_t e) const { return kinds_[e] == Kind::kWeakCrease || kinds_[e] == Kind::kCrease; }
  bool IsWithinPatch(uint32_t e) const {
    const std::span<const TriangleSide> sides = complex_.SidesAt(e);
    return PatchAt(sides[0]) == PatchAt(sides[1]);
  }

  // Which edges are on a long sharp crease with one patch on both sides; nothing if there is no such edge.
  absl::StatusOr<std::vector<bool>> FindLongEdges() const {
    std::vector<uint32_t> sharp;
    for (uint32_t e = 0; e < kinds_.size(); ++e) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(e, context_));
      if (kinds_[e] == Kind::kCrease && IsWithinPatch(e) && CreaseAngle(complex_, e) > kEdgeAngle) {
        sharp.push_back(e);
      }
    }
    if (sharp.empty()) {
      return std::vector<bool>();
    }
    WELLSPACE_RETURN_IF_ERROR(
        context_.AllowMemory(SurfaceComplexBytes(complex_.points.size(), complex_.triangles.size()) +
                             complex_.points.size() * kLongEdgeBytes + kinds_.size()));
    UnionFind joined(complex_.points.size());
    for (const uint32_t e : sharp) {
      joined.Join(complex_.edges[e][0], complex_.edges[e][1]);
    }
    std::vector<double> lengths(complex_.points.size());
    for (const uint32_t e : sharp) {
      const auto [a, b] = complex_.edges[e];
      lengths[joined.Find(a)] += Distance<3>(complex_.points[a], complex_.points[b]);
    }
    std::vector<bool> is_long(kinds_.size());
    for (const uint32_t e : sharp) {
      is_long[e] = lengths[joined.Find(complex_.edges[e][0])] >= kLongEdge * min_patch_;
    }
    return is_long;
  }

  bool IsOnCurve(uint32_t e) const { return kinds_[e] != Kind::kPlain; }

  // The patches around an edge, ascending.
  std::vector<uint32_t> PatchesAt(uint32_t e) const {
    std::vector<uint32_t> patches;
    for (const TriangleSide side : complex_.SidesAt(e)) {
      patches.push_back(PatchAt(side));
    }
    std::sort(patches.begin(), patches.end());
    return patches;
  }

  uint32_t OtherEnd(uint32_t e, uint32_t point) const {
    const auto [a, b] = complex_.edges[e];
    return a == point ? b : a;
  }

  absl::Status FindCorners() {
    const auto points = static_cast<uint32_t>(complex_.points.size());
    first_around_.assign(points + 1, 0);
    for (uint32_t e = 0; e < kinds_.size(); ++e) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(e, context_));
      if (IsOnCurve(e)) {
        ++first_around_[complex_.edges[e][0] + 1];
        ++first_around_[complex_.edges[e][1] + 1];
      }
    }
    for (uint32_t p = 0; p < points; ++p) {
      first_around_[p + 1] += first_around_[p];
    }
    around_.resize(first_around_.back());
    std::vector<uint32_t> next(first_around_.begin(), first_around_.end() - 1);
    for (uint32_t e = 0; e < kinds_.size(); ++e) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(e, context_));
      if (IsOnCurve(e)) {
        for (const uint32_t end : complex_.edges[e]) {
          around_[next[end]++] = e;
        }
      }
    }
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> angles, AnglesAround());
    is_corner_.resize(points);
    for (uint32_t p = 0; p < points; ++p) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(8 * size_t{p}, context_));
      is_corner_[p] = Around(p).empty() ? angles[p] > 0 && angles[p] < kConeAngle : IsCornerOfCurves(p);
      if (is_corner_[p]) {
        out_.corners.push_back(p);
      }
    }
    return absl::OkStatus();
  }

  std::span<const uint32_t> Around(uint32_t point) const {
    return {around_.data() + first_around_[point], first_around_[point + 1] - first_around_[point]};
  }

  // The sum of the triangles' angles at each point; 0 where none is. Unit: degrees.
  absl::StatusOr<std::vector<double>> AnglesAround() const {
    std::vector<double> angles(complex_.points.size());
    for (uint32_t t = 0; t < complex_.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(16 * size_t{t}, context_));
      for (uint32_t k = 0; k < 3; ++k) {
        const Point<3>& p = complex_.Corner(t, k);
        angles[complex_.triangles[t][k]] += AngleBetween(Difference<3>(complex_.Corner(t, (k + 1) % 3), p),
                                                         Difference<3>(complex_.Corner(t, (k + 2) % 3), p));
      }
    }
    return angles;
  }

  bool IsCornerOfCurves(uint32_t p) const {
    const std::span<const uint32_t> edges = Around(p);
    if (edges.size() != 2) {
      return true;
    }
    const Point<3>& at = complex_.points[p];
    const Point<3> from = Difference<3>(at, complex_.points[OtherEnd(edges[0], p)]);
    const Point<3> to = Difference<3>(complex_.points[OtherEnd(edges[1], p)], at);
    return AngleBetween(from, to) > kTurnAngle || PatchesAt(edges[0]) != PatchesAt(edges[1]);
  }

  // Follows curves from their corners, and then loops.
  absl::Status FollowCurves() {
    std::vector<bool> is_followed(kinds_.size());
    std::vector<uint32_t> points;  // of curves, one after the other
    std::vector<uint32_t> begins;  // of each in `points`
    size_t steps = 0;
    const auto follow = [&](uint32_t e, uint32_t from) -> absl::Status {
      const auto begin = static_cast<std::ptrdiff_t>(points.size());
      begins.push_back(static_cast<uint32_t>(begin));
      points.push_back(from);
      for (uint32_t at = from;;) {
        WELLSPACE_RETURN_IF_ERROR(CheckAt(steps++, context_));
        is_followed[e] = true;
        at = OtherEnd(e, at);
        points.push_back(at);
        if (at == from || is_corner_[at]) {
          break;
        }
        const std::span<const uint32_t> two = Around(at);
        e = two[0] == e ? two[1] : two[0];
      }
      // From its lower corner; one from a corner to itself, and a loop, towards the lower neighbour.
      const auto first = points.begin() + begin;
      const bool is_loop = *first == points.back();
      if (is_loop ? *(points.end() - 2) < *(first + 1) : points.back() < *first) {
        std::reverse(first, points.end());
      }
      return absl::OkStatus();
    };
    for (const uint32_t corner : out_.corners) {
      for (const uint32_t e : Around(corner)) {
        if (!is_followed[e]) {
          WELLSPACE_RETURN_IF_ERROR(follow(e, corner));
        }
      }
    }
    // Edges ascend by their lower point: the first that is left of a loop begins in its lowest.
    for (uint32_t e = 0; e < kinds_.size(); ++e) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(e, context_));
      if (IsOnCurve(e) && !is_followed[e]) {
        WELLSPACE_RETURN_IF_ERROR(follow(e, complex_.edges[e][0]));
      }
    }
    begins.push_back(static_cast<uint32_t>(points.size()));
    return SortCurves(points, begins);
  }

  // Puts curves, of which those numbered i are the points from begins[i] to begins[i + 1], in their order.
  absl::Status SortCurves(const std::vector<uint32_t>& points, const std::vector<uint32_t>& begins) {
    std::vector<uint32_t> order(begins.size() - 1);
    std::iota(order.begin(), order.end(), 0);
    const auto curve = [&](uint32_t i) {
      return std::span<const uint32_t>(points.data() + begins[i], begins[i + 1] - begins[i]);
    };
    const auto is_before = [&](uint32_t i, uint32_t k) {
      const std::span<const uint32_t> one = curve(i);
      const std::span<const uint32_t> other = curve(k);
      return std::lexicographical_compare(one.begin(), one.end(), other.begin(), other.end());
    };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(order, is_before, context_));
    out_.points.reserve(points.size());
    out_.first_point.reserve(begins.size());
    out_.first_point.push_back(0);
    for (size_t i = 0; i < order.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      const std::span<const uint32_t> own = curve(order[i]);
      out_.points.insert(out_.points.end(), own.begin(), own.end());
      out_.first_point.push_back(static_cast<uint32_t>(out_.points.size()));
    }
    return absl::OkStatus();
  }

  const SurfaceComplex& complex_;
  const double crease_angle_;
  const double min_patch_;
  const RunContext& context_;
  SurfaceCurves out_;
  std::vector<Kind> kinds_;  // by edge
  // The edges on curves at point p: around_[first_around_[p]] to around_[first_around_[p + 1]].
  std::vector<uint32_t> first_around_;
  std::vector<uint32_t> around_;
  std::vector<bool> is_corner_;  // by point
};

}  // namespace

double CreaseAngle(const SurfaceComplex& complex, uint32_t edge) {
  const std::span<const TriangleSide> sides = complex.SidesAt(edge);
  const Point<3> one = NormalOf(complex.TriangleAt(TriangleOf(sides[0])));
  Point<3> other = NormalOf(complex.TriangleAt(TriangleOf(sides[1])));
  if (complex.RunsUp(sides[0]) == complex.RunsUp(sides[1])) {  // they go against each other
    other = {-other[0], -other[1], -other[2]};
  }
  return AngleBetween(one, other);
}

absl::StatusOr<SurfaceCurves> FindCurves(const SurfaceComplex& complex, double crease_angle, double min_patch,
                                         const RunContext& context) {
  return CurveFinder(complex, crease_angle, min_patch, context).Find();
}

uint64_t SurfaceCurvesBytes(uint64_t points, uint64_t triangles) {
  // Sets of triangles, kinds of edges, angles around points; and curves along every edge, each a triangle long, twice.
  constexpr uint64_t kOfPoint = sizeof(double) + 3 * sizeof(uint32_t);
  constexpr uint64_t kOfTriangle = 2 * sizeof(uint32_t) + 3 + 6 * sizeof(uint32_t) + 2 * 4 * sizeof(uint32_t);
  return points * kOfPoint + triangles * kOfTriangle;
}

}  // namespace wellspace::core
