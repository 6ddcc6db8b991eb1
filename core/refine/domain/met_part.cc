#include "core/refine/domain/met_part.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/geometry/point.h"
#include "core/geometry/segment.h"
#include "core/refine/rounding.h"

namespace wellspace::core {
namespace {

// A part of a segment that is shorter than this, relative to its distance from the site, is what was rounded.
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

// The part of `segment` that `cell` meets: cut by all planes of the cell.
MetPart MeetSegment(const PlanarDomain& domain, const Polytope<2>& cell, uint32_t segment) {
  const Point<2>& a = domain.EndOf(segment, false);
  const double length = domain.LengthOf(segment);
  const Point<2> from = Difference<2>(a, cell.site());
  Point<2> along = Difference<2>(domain.EndOf(segment, true), a);
  const double away = Cross(along, from) / length;  // of the line
  MetPart part;
  if (away * away > kBeyond * cell.reach_sq()) {
    return part;
  }
  along = {along[0] / length, along[1] / length};
  const double foot = std::clamp(-Dot<2>(from, along), 0.0, length);
  const Point<2> nearest = {from[0] + foot * along[0], from[1] + foot * along[1]};
  if (NormSq<2>(nearest) > cell.reach_sq()) {
    return part;
  }
  if (AreBeside(cell, from, along)) {
    return part;
  }
  double low = 0;
  double high = length;
  for (const CellNode<2>& node : cell.nodes()) {
    for (const uint16_t index : node.planes) {
      const Plane<2>& plane = cell.plane(index);
      const double outward = plane.kind == PlaneKind::kBisector || plane.face % 2 == 1 ? 1 : -1;
      const double slope = outward * Dot<2>(plane.normal, along);
      const double gap = outward * (plane.offset - Dot<2>(plane.normal, from));
      if (slope > 0) {
        high = std::min(high, gap / slope);
      } else if (slope < 0) {
        low = std::max(low, gap / slope);
      } else if (gap < 0) {
        return part;
      }
    }
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

MetPart NearestMet(const PlanarDomain& domain, VertexId v, const Polytope<2>& cell,
                   std::span<const uint32_t> segments) {
  MetPart nearest;
  for (const uint32_t segment : segments) {
    if (segment == nearest.segment || domain.IsOn(v, segment)) {
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
