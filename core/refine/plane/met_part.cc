#include "core/refine/plane/met_part.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/geometry/point.h"
#include "core/geometry/segment.h"
#include "core/refine/rounding.h"

namespace wellspace::core {
namespace {

// A part of a segment that is shorter than this, relative to its distance from the site, may come from rounding.
constexpr double kLeastPart = 1e-9;

// Whether all nodes of `cell` lie on one side of a line, surely: the one through `from`, relative to the site, in the
// direction `along`, which has length 1.
bool AreBeside(const Polytope<2>& cell, const Point<2>& from, const Point<2>& along) {
  double least = std::numeric_limits<double>::infinity();
  double most = -least;
  for (const CellNode<2>& node : cell.nodes()) {
    const double away = Cross(along, Difference<2>(node.x, from));
    least = std::min(least, away);
    most = std::max(most, away);
  }
  const double rounding = kLeastPart * (std::abs(from[0]) + std::abs(from[1]) + std::sqrt(cell.reach_sq()));
  return least > rounding || most < -rounding;
}

// A segment, seen from the site of a cell.
struct SeenSegment {
  Point<2> from;   // its end a
  Point<2> along;  // from there, of length 1
  double length = 0;
  double away = 0;  // of the line from the site, with a sign
  double foot = 0;  // how far along the point nearest to the site is

  // Looks at `segment`; false if it is beyond the reach of `cell`, and then the members are not valid.
  bool LookAt(const PlanarDomain& domain, const Polytope<2>& cell, uint32_t segment) {
    const Point<2>& a = domain.EndOf(segment, false);
    length = domain.LengthOf(segment);
    from = Difference<2>(a, cell.site());
    along = Difference<2>(domain.EndOf(segment, true), a);
    away = Cross(along, from) / length;
    const double reach_sq = cell.reach_sq();
    if (away * away > kBeyond * reach_sq) {
      return false;
    }
    along = {along[0] / length, along[1] / length};
    foot = std::clamp(-Dot<2>(from, along), 0.0, length);
    return NormSq<2>({from[0] + foot * along[0], from[1] + foot * along[1]}) <= reach_sq;
  }

  // The rounding of places on the segment beside a cell of that reach, and more.
  double RoundingIn(const Polytope<2>& cell) const {
    return kLeastPart * (std::abs(from[0]) + std::abs(from[1]) + std::sqrt(cell.reach_sq()));
  }

  // Whether the cell, whose nodes need not be placed, may reach the line so far that AreBeside says no.
  bool MayCross(const Polytope<2>& cell) const {
    const double share = 1 - 2 * RoundingIn(cell) / std::abs(away);
    return !(share > 0 && cell.IsSurelyBefore({-share * away * along[1], share * away * along[0]}));
  }
};

// The part of `segment` that `cell` meets: cut by all planes of the cell.
MetPart MeetSegment(const PlanarDomain& domain, const Polytope<2>& cell, uint32_t segment) {
  MetPart part;
  SeenSegment seen;
  if (!seen.LookAt(domain, cell, segment) || !seen.MayCross(cell)) {
    return part;
  }
  const auto& [from, along, length, away, foot] = seen;
  if (AreBeside(cell, from, along)) {
    return part;
  }
  double low = 0;
  double high = length;
  bool is_beyond = false;
  cell.ForEachEdge([&](const Plane<2>& plane) {
    const double outward = plane.kind == PlaneKind::kBisector || plane.face % 2 == 1 ? 1 : -1;
    const double slope = outward * Dot<2>(plane.normal, seen.along);
    const double gap = outward * (plane.offset - Dot<2>(plane.normal, seen.from));
    if (slope > 0) {
      high = std::min(high, gap / slope);
    } else if (slope < 0) {
      low = std::max(low, gap / slope);
    } else {
      is_beyond = is_beyond || gap < 0;
    }
  });
  if (is_beyond) {
    return part;
  }
  const double at = std::clamp(foot, low, std::max(low, high));
  const double distance = std::sqrt(NormSq<2>({from[0] + at * along[0], from[1] + at * along[1]}));
  const double rounding = kPlaceRounding * (std::abs(cell.site()[0]) + std::abs(cell.site()[1]));
  if (high - low > kLeastPart * distance + rounding) {
    part = {segment, low, high, distance};
  }
  return part;
}

}  // namespace

bool MayMeetAny(const PlanarDomain& domain, VertexId v, const Polytope<2>& cell, std::span<const uint32_t> segments) {
  SeenSegment seen;
  return std::any_of(segments.begin(), segments.end(), [&](uint32_t segment) {
    return !domain.IsOn(v, segment) && seen.LookAt(domain, cell, segment) && seen.MayCross(cell);
  });
}

MetPart NearestMet(const PlanarDomain& domain, VertexId v, const Polytope<2>& cell, std::span<const uint32_t> segments,
                   std::span<const uint32_t> passed_over) {
  MetPart nearest;
  for (const uint32_t segment : segments) {
    if (segment == nearest.segment || domain.IsOn(v, segment) ||
        std::find(passed_over.begin(), passed_over.end(), segment) != passed_over.end()) {
      continue;
    }
    const MetPart part = MeetSegment(domain, cell, segment);
    if (part.IsThere() &&
        (!nearest.IsThere() || std::tie(part.distance, part.segment) < std::tie(nearest.distance, nearest.segment))) {
      nearest = part;
    }
  }
  return nearest;
}

}  // namespace wellspace::core
