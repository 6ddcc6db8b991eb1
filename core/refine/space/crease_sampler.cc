#include "core/refine/space/crease_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <span>
#include <utility>

#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/geometry/box_tree.h"
#include "core/geometry/directions.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"
#include "core/refine/space/collar_points.h"
#include "core/refine/space/corner_sectors.h"
#include "core/refine/space/crease_spacing.h"

namespace wellspace::core {
namespace {

// Every other collar point is nearer by this: of four points on a patch, two on the curve and two beside it, no more
// than three are on a circle then.
constexpr double kOddShare = 0.95;

// And no collar point is nearer than this of the greater one: in the middle of a strand, too, vertices are to be out of
// the balls over subsegments.
constexpr double kLeastShare = 0.54;

// Collar points of a vertex on two patches are shifted against each other by no more than this share of what would
// bring them into each other's balls.
constexpr double kShareOfReach = 0.25;

// They are not where the curve turns at one point by more than this share of the angle between two patches.
constexpr double kShareOfKink = 0.3;

// The ball about the tip of a cone has no larger share of the diagonal.
constexpr double kShareOfSize = 0.125;

class CreaseSampler {
 public:
  CreaseSampler(const SpatialDomain& domain, const CreaseAngles& angles, const CurveDemands& demands,
                const RunContext& context)
      : domain_(domain),
        angles_(angles),
        demands_(demands),
        context_(context),
        spacing_(domain, demands, context),
        bytes_before_(domain.MemoryBytes()) {}

  absl::StatusOr<AcuteCreases> Make() {
    FindAcute();
    if (std::find(is_acute_corner_.begin(), is_acute_corner_.end(), true) == is_acute_corner_.end() &&
        std::find(made_.is_acute.begin(), made_.is_acute.end(), true) == made_.is_acute.end()) {
      return AcuteCreases();
    }
    WELLSPACE_RETURN_IF_ERROR(spacing_.Begin(made_.is_acute));
    WELLSPACE_ASSIGN_OR_RETURN(sectors_, FindCornerSectors(domain_, is_acute_corner_, context_));
    WELLSPACE_RETURN_IF_ERROR(FindBalls());
    made_.first_arcs.resize(domain_.curve_count());
    rings_.resize(domain_.curve_count());
    for (uint32_t curve = 0; curve < domain_.curve_count(); ++curve) {
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
      if (made_.is_acute[curve]) {
        WELLSPACE_ASSIGN_OR_RETURN(made_.first_arcs[curve],
                                   spacing_.ArcsAlong(curve, BallArc(curve, 0), BallArc(curve, 1)));
        WELLSPACE_RETURN_IF_ERROR(CountVertices(made_.first_arcs[curve].size()));
        WELLSPACE_RETURN_IF_ERROR(AddCollars(curve));
      } else if (made_.balls[curve][0] > 0 || made_.balls[curve][1] > 0) {
        WELLSPACE_RETURN_IF_ERROR(DividePlain(curve));
      }
    }
    WELLSPACE_RETURN_IF_ERROR(AddArcs());
    made_.first_of_group.push_back(static_cast<uint32_t>(made_.strands.size()));
    WELLSPACE_RETURN_IF_ERROR(AddFrozen());
    WELLSPACE_RETURN_IF_ERROR(made_.Finish(context_));
    return std::move(made_);
  }

 private:
  using CurveEnd = SpatialDomain::CurveEnd;

  // The collar points of a vertex on an acute curve, in an order that is the same all along it.
  struct Ring {
    double radius = 0;
    std::vector<Point<3>> ways;
    std::vector<uint32_t> collars;
  };

  const SurfaceComplex& complex() const { return domain_.complex(); }
  const SurfaceCurves& curves() const { return domain_.curves(); }
  const Point<3>& PointOf(uint32_t corner) const { return complex().points[curves().corners[corner]]; }

  void FindAcute() {
    const auto count = domain_.curve_count();
    made_.is_acute.resize(count);
    made_.balls.resize(count);
    for (uint32_t curve = 0; curve < count; ++curve) {
      made_.is_acute[curve] = angles_.of_curves[curve].angle < kAcuteAngle - kAngleTolerance;
    }
    for (uint32_t corner = 0; corner < curves().corners.size(); ++corner) {
      const std::span<const CurveEnd> ends = domain_.EndsAt(corner);
      is_acute_corner_.push_back(
          angles_.of_corners[corner].angle < kAcuteCorner - kAngleTolerance ||
          std::any_of(ends.begin(), ends.end(), [&](const CurveEnd& end) { return made_.is_acute[end.curve]; }));
    }
  }

  absl::Status CountVertices(size_t more) {
    vertices_ += more;
    if (vertices_ > demands_.max_vertices) {
      return spacing_.TooManyVertices();
    }
    return context_.AllowMemory(bytes_before_ + vertices_ * kBytesOfVertex);
  }

  // Finds the radii of the balls of acute corners.
  absl::Status FindBalls() {
    radii_.resize(is_acute_corner_.size());
    const Box<3>& box = domain_.index().hull();
    for (uint32_t corner = 0; corner < is_acute_corner_.size(); ++corner) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(64 * size_t{corner}, context_));
      if (!is_acute_corner_[corner]) {
        continue;
      }
      double most = demands_.edge;
      std::set<uint32_t> own;
      for (const CurveEnd& end : domain_.EndsAt(corner)) {
        most = std::min(most, domain_.LengthOf(end.curve) / (domain_.IsLoop(end.curve) ? 6 : 3));
        own.insert(end.curve);
      }
      const Point<3>& at = PointOf(corner);
      if (own.empty()) {
        most = std::min(most, kShareOfSize * Distance<3>(box.low, box.high));
      }
      most = 0.5 * spacing_.DistanceToCurves(at, 2 * most, [&](uint32_t curve) { return !own.contains(curve); });
      most = 0.5 * spacing_.DistanceToPatches(at, 2 * most, domain_.PatchesAtCorner(corner));
      double radius = std::exp2(std::floor(std::log2(most)));
      while (StaysInBall(corner, radius)) {
        radius *= 0.5;
      }
      radius = spacing_.RadiusForBends(corner, SectorsAt(corner), radius);
      made_.AddBall(at, radius);
      radii_[corner] = radius;
      for (const CurveEnd& end : domain_.EndsAt(corner)) {
        made_.balls[end.curve][end.is_last ? 1 : 0] = radius;
      }
    }
    return absl::OkStatus();
  }

  std::span<const CornerSector> SectorsAt(uint32_t corner) const {
    const auto first = std::partition_point(sectors_.begin(), sectors_.end(),
                                            [&](const CornerSector& sector) { return sector.corner < corner; });
    const auto end = std::partition_point(first, sectors_.end(),
                                          [&](const CornerSector& sector) { return sector.corner == corner; });
    return {first, end};
  }

  // Whether a curve of the corner, which may wind around it, is in such a ball for half of its length. No curve is in
  // a ball that its first segment leaves.
  bool StaysInBall(uint32_t corner, double radius) const {
    const std::span<const CurveEnd> ends = domain_.EndsAt(corner);
    return std::any_of(ends.begin(), ends.end(), [&](const CurveEnd& end) {
      const double length = domain_.LengthOf(end.curve);
      const double arc = domain_.ArcAtDistance(end, radius);
      return !((end.is_last ? length - arc : arc) < 0.5 * length);
    });
  }

  // The length of arc at which a curve leaves the ball at its first or last end; that of the end, if there is none.
  double BallArc(uint32_t curve, int end) const {
    return domain_.ArcAtDistance({curve, end == 1}, made_.balls[curve][end]);
  }

  // Divides a curve that is not acute into equal parts between its balls.
  absl::Status DividePlain(uint32_t curve) {
    const double from = BallArc(curve, 0);
    const double to = BallArc(curve, 1);
    const double parts = std::max(1.0, std::ceil((to - from) / demands_.edge * (1 - 1e-12)));
    WELLSPACE_RETURN_IF_ERROR(CountVertices(static_cast<size_t>(std::min(parts, 1e9))));
    std::vector<double>& arcs = made_.first_arcs[curve];
    for (double i = made_.balls[curve][0] > 0 ? 0 : 1; i < parts; ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(arcs.size(), context_));
      arcs.push_back(from + (to - from) * (i / parts));
    }
    if (made_.balls[curve][1] > 0) {
      arcs.push_back(to);
    }
    return absl::OkStatus();
  }

  // Of the sides at a point the order in which they go on from `before`.
  static std::vector<size_t> OrderAfter(const SidesAtPoint& sides, const std::vector<uint32_t>& patches,
                                        const std::vector<Point<3>>& before) {
    std::vector<size_t> order;
    std::vector<bool> is_taken(sides.patches.size());
    for (size_t k = 0; k < before.size(); ++k) {
      size_t nearest = sides.patches.size();
      for (size_t i = 0; i < sides.patches.size(); ++i) {
        if (!is_taken[i] && sides.patches[i] == patches[k] &&
            (nearest == sides.patches.size() ||
             Dot<3>(sides.ways[i], before[k]) > Dot<3>(sides.ways[nearest], before[k]))) {
          nearest = i;
        }
      }
      if (nearest < sides.patches.size()) {
        is_taken[nearest] = true;
        order.push_back(nearest);
      }
    }
    return order;
  }

  // Puts collar points at all vertices of an acute curve, and strands between them.
  absl::Status AddCollars(uint32_t curve) {
    const std::vector<double>& arcs = made_.first_arcs[curve];
    const size_t count = arcs.size();
    std::vector<Ring>& rings = rings_[curve];
    const bool is_loop = made_.balls[curve][0] == 0;
    const double length = domain_.LengthOf(curve);
    std::vector<uint32_t> patches;
    for (size_t j = 0; j < count; ++j) {
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
      const Point<3> at = domain_.PointAt(curve, arcs[j]);
      const double before = j > 0 ? arcs[j - 1] : is_loop ? arcs[count - 1] : 0;
      const double beyond = j + 1 < count ? arcs[j + 1] : is_loop ? arcs[0] : length;
      const double to_last = Distance<3>(at, domain_.PointAt(curve, before));
      const double to_next = Distance<3>(at, domain_.PointAt(curve, beyond));
      // Beside what leads to a corner there are no strands.
      const double greater = std::max(j > 0 || is_loop ? to_last : 0, j + 1 < count || is_loop ? to_next : 0);
      const double radius =
          (j % 2 == 0 ? 1 : kOddShare) * std::max(kCollarShare * std::min(to_last, to_next), kLeastShare * greater);
      const SidesAtPoint sides = SidesAt(domain_, curve, arcs[j]);
      std::vector<size_t> order(sides.patches.size());
      std::iota(order.begin(), order.end(), size_t{0});
      if (j == 0) {
        patches = sides.patches;
      } else {
        order = OrderAfter(sides, patches, rings.back().ways);
      }
      WELLSPACE_RETURN_IF_ERROR(CountVertices(order.size()));
      Ring& ring = rings.emplace_back();
      ring.radius = radius;
      const double shift =
          ShiftOf(sides, radius, std::min(to_last, to_next), greater, LargestTurn(curve, before, beyond));
      const std::vector<double> shares = ShiftShares(sides);
      for (const size_t i : order) {
        ring.ways.push_back(sides.ways[i]);
        ring.collars.push_back(
            AddCollar(CollarPoint(curve, j, at, radius, shares[i] * shift, sides, i), sides.patches[i]));
      }
    }
    for (size_t j = 0; j + 1 < count; ++j) {
      AddStrandsBeside(curve, {arcs[j], arcs[j + 1]}, rings[j], rings[j + 1]);
    }
    if (is_loop) {
      Ring first = rings.front();  // as it goes on from the last
      const SidesAtPoint sides = SidesAt(domain_, curve, arcs[0]);
      const std::vector<size_t> order = OrderAfter(sides, patches, rings.back().ways);
      for (size_t k = 0; k < order.size(); ++k) {
        first.collars[k] = rings.front().collars[order[k]];
      }
      AddStrandsBeside(curve, {arcs[count - 1], length}, rings[count - 1], first);
    }
    return absl::OkStatus();
  }

  // The largest turn of a curve at one of its points between two lengths of arc; `from` may be beyond `to` in a loop.
  // Unit: degrees.
  double LargestTurn(uint32_t curve, double from, double to) const {
    if (from > to) {
      return std::max(LargestTurn(curve, from, domain_.LengthOf(curve)), LargestTurn(curve, 0, to));
    }
    const std::span<const double> arcs = domain_.ArcsOf(curve);
    const std::span<const uint32_t> points = curves().PointsOf(curve);
    const auto point = [&](size_t i) { return complex().points[points[i]]; };
    double most = 0;
    const auto first = static_cast<size_t>(std::lower_bound(arcs.begin(), arcs.end(), from) - arcs.begin());
    for (size_t i = first; i < arcs.size() && arcs[i] <= to; ++i) {
      const bool is_inside = i > 0 && i + 1 < arcs.size();
      if (is_inside || domain_.IsLoop(curve)) {
        const Point<3> before = point(i > 0 ? i - 1 : arcs.size() - 2);
        const Point<3> beyond = point(i + 1 < arcs.size() ? i + 1 : 1);
        most = std::max(most, AngleBetween(Difference<3>(point(i), before), Difference<3>(beyond, point(i))));
      }
    }
    return most;
  }

  // How far the collar points of a vertex are shifted along the curve against each other, at most. What two patches
  // have so is out of the diametral balls of each other's strands, also where they are near each other; and the
  // circumcentres between them stay between them, which they might not where the curve has a kink: there is no shift.
  static double ShiftOf(const SidesAtPoint& sides, double radius, double lesser, double greater, double turn) {
    double apart_sq = 4;
    double angle = 180;
    for (size_t i = 0; i < sides.ways.size(); ++i) {
      for (size_t k = 0; k < i; ++k) {
        apart_sq = std::min(apart_sq, DistanceSq<3>(sides.ways[i], sides.ways[k]));
        angle = std::min(angle, AngleBetween(sides.ways[i], sides.ways[k]));
      }
    }
    if (!(greater > 0) || turn > kShareOfKink * angle) {
      return 0;
    }
    return std::min(kShiftShare * lesser, kShareOfReach * apart_sq * radius * radius / greater);
  }

  // The shares of that by side, from 0 to 1: flat patches have the smaller ones, as what is shifted
  // brings circumcentres nearer to the other patch.
  std::vector<double> ShiftShares(const SidesAtPoint& sides) const {
    const size_t count = sides.patches.size();
    std::vector<size_t> order(count);
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_partition(order.begin(), order.end(), [&](size_t i) { return spacing_.IsFlat(sides.patches[i]); });
    std::vector<double> shares(count);
    for (size_t k = 1; k < count; ++k) {
      shares[order[k]] = static_cast<double>(k) / static_cast<double>(count - 1);
    }
    return shares;
  }

  // The collar point on side `i` of vertex `j` of an acute curve, at that distance from it: across the curve and
  // shifted along it by so much, but where the curve leaves the ball of a corner on the sphere of that, as all else is
  // that is put around the corner.
  Point<3> CollarPoint(uint32_t curve, size_t j, const Point<3>& at, double radius, double shift,
                       const SidesAtPoint& sides, size_t i) const {
    const bool is_first = j == 0;
    const double ball = is_first                                  ? made_.balls[curve][0]
                        : j + 1 == made_.first_arcs[curve].size() ? made_.balls[curve][1]
                                                                  : 0;
    if (ball == 0) {
      const Point<3>& along = sides.along;
      const Point<3> beside = {at[0] + shift * along[0], at[1] + shift * along[1], at[2] + shift * along[2]};
      return PointAcross(domain_, sides, i, beside, radius);
    }
    const Point<3>& way = sides.ways[i];
    const Point<3> centre = domain_.PointAt(curve, is_first ? 0 : domain_.LengthOf(curve));
    const Point<3> out = Unit(Difference<3>(at, centre));
    const double turn = 2 * std::asin(0.5 * radius / ball);
    Point<3> target;
    for (int axis = 0; axis < 3; ++axis) {
      target[axis] = centre[axis] + ball * (std::cos(turn) * out[axis] + std::sin(turn) * way[axis]);
    }
    return PointAround(domain_, sides.patches[i], target, centre, ball, {});
  }

  uint32_t AddCollar(const Point<3>& at, uint32_t patch) {
    made_.collars.push_back({at, patch});
    return static_cast<uint32_t>(made_.collars.size() - 1);
  }
  StrandEnd EndAt(uint32_t collar) const { return {made_.collars[collar].at, collar, 0, 0}; }

  uint32_t NextGroup() {
    made_.first_of_group.push_back(static_cast<uint32_t>(made_.strands.size()));
    return static_cast<uint32_t>(made_.first_of_group.size() - 1);
  }

  void AddStrandsBeside(uint32_t curve, const std::array<double, 2>& arcs, const Ring& from, const Ring& to) {
    const uint32_t group = NextGroup();
    for (size_t k = 0; k < std::min(from.collars.size(), to.collars.size()); ++k) {
      Strand& strand = made_.strands.emplace_back();
      strand.patch = made_.collars[from.collars[k]].patch;
      strand.group = group;
      strand.curve = curve;
      strand.arcs = arcs;
      strand.radii = {from.radius, to.radius};
      strand.ends = {EndAt(from.collars[k]), EndAt(to.collars[k])};
    }
    // The tube follows the points of the curve between.
    double last = arcs[0];
    const auto radius_at = [&](double arc) {
      return from.radius + (to.radius - from.radius) * ((arc - arcs[0]) / (arcs[1] - arcs[0]));
    };
    const auto add = [&](double arc) {
      made_.AddTube(domain_.PointAt(curve, last), domain_.PointAt(curve, arc), {radius_at(last), radius_at(arc)});
      last = arc;
    };
    const std::span<const double> points = domain_.ArcsOf(curve);
    for (auto at = std::upper_bound(points.begin(), points.end(), arcs[0]); at != points.end() && *at < arcs[1]; ++at) {
      add(*at);
    }
    add(arcs[1]);
  }

  // Puts points around acute corners, and strands between them and the vertices or collar points of their curves.
  absl::Status AddArcs() {
    for (const CornerSector& sector : sectors_) {
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
      const double radius = radii_[sector.corner];
      const Point<3>& centre = PointOf(sector.corner);
      std::array<StrandEnd, 2> ends;
      std::array<double, 2> turns{};  // of collar points from their curves
      if (sector.is_closed) {
        ends[0] = ends[1] = PointOnSphere(sector, 0, centre, radius);
      } else {
        ends = {EndOf(sector, 0), EndOf(sector, 1)};
      }
      for (int k = 0; k < 2 && !sector.is_closed; ++k) {
        if (ends[k].collar != StrandEnd::kNoCollar) {
          turns[k] =
              AngleBetween(Difference<3>(FirstVertexOf(sector.ends[k]).at, centre), Difference<3>(ends[k].at, centre));
        }
      }
      const double between = sector.turns.back() - turns[0] - turns[1];
      const int parts = sector.PartsOf(between);
      WELLSPACE_RETURN_IF_ERROR(CountVertices(parts));
      StrandEnd last = ends[0];
      for (int i = 1; i <= parts; ++i) {
        const StrandEnd next =
            i < parts ? PointOnSphere(sector, turns[0] + between * i / parts, centre, radius) : ends[1];
        AddStrandAround(sector, last, next, centre);
        last = next;
      }
    }
    return absl::OkStatus();
  }

  StrandEnd PointOnSphere(const CornerSector& sector, double turn, const Point<3>& centre, double radius) {
    const Point<3> way = sector.WayAt(turn);
    const Point<3> target = {centre[0] + radius * way[0], centre[1] + radius * way[1], centre[2] + radius * way[2]};
    return EndAt(AddCollar(PointAround(domain_, sector.patch, target, centre, radius, {}), sector.patch));
  }

  void AddStrandAround(const CornerSector& sector, const StrandEnd& from, const StrandEnd& to, const Point<3>& centre) {
    Strand strand;
    strand.patch = sector.patch;
    strand.group = NextGroup();
    strand.centre = centre;
    strand.radii = {Distance<3>(from.at, centre), Distance<3>(to.at, centre)};
    strand.ends = {from, to};
    made_.strands.push_back(strand);
  }

  // The vertex on a curve that is nearest to one of its ends.
  StrandEnd FirstVertexOf(const CurveEnd& end) const {
    const std::vector<double>& arcs = made_.first_arcs[end.curve];
    const double arc = end.is_last ? arcs.back() : arcs.front();
    return {domain_.PointAt(end.curve, arc), StrandEnd::kNoCollar, end.curve, arc};
  }

  // The end of a strand of a sector: the first vertex of a curve, or if the curve is acute the collar point there.
  StrandEnd EndOf(const CornerSector& sector, int k) const {
    const CurveEnd& end = sector.ends[k];
    if (!made_.is_acute[end.curve]) {
      return FirstVertexOf(end);
    }
    const Ring& ring = end.is_last ? rings_[end.curve].back() : rings_[end.curve].front();
    const Point<3> way = sector.WayInto(k);
    size_t nearest = ring.collars.size();
    for (size_t i = 0; i < ring.collars.size(); ++i) {
      if (made_.collars[ring.collars[i]].patch == sector.patch &&
          (nearest == ring.collars.size() || Dot<3>(ring.ways[i], way) > Dot<3>(ring.ways[nearest], way))) {
        nearest = i;
      }
    }
    return nearest < ring.collars.size() ? EndAt(ring.collars[nearest]) : FirstVertexOf(end);
  }

  // Shields the balls over subsegments that are never split.
  absl::Status AddFrozen() {
    for (uint32_t curve = 0; curve < domain_.curve_count(); ++curve) {
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
      const std::vector<double>& arcs = made_.first_arcs[curve];
      const double length = domain_.LengthOf(curve);
      const auto add = [&](double from, double to) {
        made_.AddFrozen(domain_.PointAt(curve, from), domain_.PointAt(curve, to));
      };
      if (made_.balls[curve][0] > 0) {
        add(0, arcs.front());
      }
      for (size_t j = 0; made_.is_acute[curve] && j + 1 < arcs.size(); ++j) {
        add(arcs[j], arcs[j + 1]);
      }
      if (made_.balls[curve][1] > 0 || made_.is_acute[curve]) {
        add(arcs.back(), length);
      }
    }
    return absl::OkStatus();
  }

  // An angle that is smaller by no more than this has been rounded. Unit: degrees.
  static constexpr double kAngleTolerance = 1e-6;

  // The bytes of a vertex around a crease, with its strand, the shields there, and their places in trees.
  static constexpr uint64_t kBytesOfVertex = 640;

  const SpatialDomain& domain_;
  const CreaseAngles& angles_;
  const CurveDemands& demands_;
  const RunContext& context_;
  CreaseSpacing spacing_;
  AcuteCreases made_;
  std::vector<bool> is_acute_corner_;
  std::vector<CornerSector> sectors_;     // by corner
  std::vector<double> radii_;             // by corner: of its ball, or 0
  std::vector<std::vector<Ring>> rings_;  // by curve: of its vertices
  uint64_t vertices_ = 0;
  const uint64_t bytes_before_;
};

}  // namespace

absl::StatusOr<AcuteCreases> SampleCreases(const SpatialDomain& domain, const CreaseAngles& angles,
                                           const CurveDemands& demands, const RunContext& context) {
  return CreaseSampler(domain, angles, demands, context).Make();
}

}  // namespace wellspace::core
