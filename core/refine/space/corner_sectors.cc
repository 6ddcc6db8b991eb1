#include "core/refine/space/corner_sectors.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <span>

#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/geometry/directions.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {
namespace {

// The least number of points around the tip of a cone.
constexpr int kPartsOfTip = 3;

// The sectors around one corner.
class SectorWalk {
 public:
  SectorWalk(const SpatialDomain& domain, uint32_t corner, std::vector<CornerSector>& sectors)
      : domain_(domain), corner_(corner), point_(domain.curves().corners[corner]), sectors_(sectors) {}

  void Run() {
    for (const SpatialDomain::CurveEnd& end : domain_.EndsAt(corner_)) {
      const std::span<const uint32_t> points = domain_.curves().PointsOf(end.curve);
      ends_.emplace(end.is_last ? points[points.size() - 2] : points[1], end);
    }
    for (const auto& [next, end] : ends_) {
      for (const TriangleSide side : complex().SidesAt(domain_.EdgeOf(point_, next))) {
        if (!is_visited_.contains(TriangleOf(side))) {
          Walk(next, end, TriangleOf(side));
        }
      }
    }
  }

  // Goes around the tip of a cone with these triangles, or of several that touch there.
  void RunAroundTip(std::span<const uint32_t> triangles) {
    for (const uint32_t triangle : triangles) {
      if (!is_visited_.contains(triangle)) {
        const std::array<uint32_t, 3>& corners = complex().triangles[triangle];
        Walk(corners[0] == point_ ? corners[1] : corners[0], {}, triangle);
        sectors_.back().is_closed = true;
      }
    }
  }

 private:
  const SurfaceComplex& complex() const { return domain_.complex(); }

  void Walk(uint32_t from, const SpatialDomain::CurveEnd& first, uint32_t triangle) {
    CornerSector sector;
    sector.corner = corner_;
    sector.patch = domain_.curves().patch_of[triangle];
    sector.ends = {first, first};
    Add(from, sector);
    while (is_visited_.insert(triangle).second) {
      const std::array<uint32_t, 3>& corners = complex().triangles[triangle];
      const uint32_t beyond = *std::find_if(corners.begin(), corners.end(),
                                            [&](uint32_t point) { return point != point_ && point != from; });
      Add(beyond, sector);
      if (const auto end = ends_.find(beyond); end != ends_.end()) {
        sector.ends[1] = end->second;
        break;
      }
      for (const TriangleSide side : complex().SidesAt(domain_.EdgeOf(point_, beyond))) {
        if (TriangleOf(side) != triangle) {
          triangle = TriangleOf(side);
          break;
        }
      }
      from = beyond;
    }
    sectors_.push_back(std::move(sector));
  }

  void Add(uint32_t point, CornerSector& sector) const {
    const Point<3> ray = Unit(Difference<3>(complex().points[point], complex().points[point_]));
    sector.turns.push_back(sector.rays.empty() ? 0 : sector.turns.back() + AngleBetween(sector.rays.back(), ray));
    sector.rays.push_back(ray);
  }

  const SpatialDomain& domain_;
  const uint32_t corner_;
  const uint32_t point_;
  std::vector<CornerSector>& sectors_;
  std::map<uint32_t, SpatialDomain::CurveEnd> ends_;  // by the next point of the curve
  std::set<uint32_t> is_visited_;
};

}  // namespace

int CornerSector::PartsOf(double turn) const {
  return std::max(is_closed ? kPartsOfTip : 1, static_cast<int>(std::ceil(turn / kMostTurn * (1 - 1e-12))));
}

Point<3> CornerSector::WayAt(double turn) const {
  const auto beyond = std::upper_bound(turns.begin(), turns.end() - 1, turn);
  const auto i = std::max<std::ptrdiff_t>(beyond - turns.begin(), 1);
  const Point<3>& a = rays[i - 1];
  const Point<3> across = Unit(Across(rays[i], a));
  const double angle = (turn - turns[i - 1]) * (std::numbers::pi / 180);
  const double cosine = std::cos(angle);
  const double sine = std::sin(angle);
  return {cosine * a[0] + sine * across[0], cosine * a[1] + sine * across[1], cosine * a[2] + sine * across[2]};
}

Point<3> CornerSector::WayInto(int end) const {
  return end == 0 ? Across(rays[1], rays[0]) : Across(rays[rays.size() - 2], rays.back());
}

absl::StatusOr<std::map<uint32_t, std::vector<uint32_t>>> FindTips(const SpatialDomain& domain,
                                                                   const RunContext& context) {
  std::map<uint32_t, std::vector<uint32_t>> tips;
  for (uint32_t corner = 0; corner < domain.curves().corners.size(); ++corner) {
    if (domain.EndsAt(corner).empty()) {
      tips.try_emplace(domain.curves().corners[corner]);
    }
  }
  for (uint32_t t = 0; !tips.empty() && t < domain.complex().triangles.size(); ++t) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context));
    for (const uint32_t point : domain.complex().triangles[t]) {
      if (const auto tip = tips.find(point); tip != tips.end()) {
        tip->second.push_back(t);
      }
    }
  }
  return tips;
}

absl::StatusOr<std::vector<CornerSector>> FindCornerSectors(const SpatialDomain& domain,
                                                            const std::vector<bool>& is_wanted,
                                                            const RunContext& context) {
  using Tips = std::map<uint32_t, std::vector<uint32_t>>;
  WELLSPACE_ASSIGN_OR_RETURN(const Tips tips, FindTips(domain, context));
  std::vector<CornerSector> sectors;
  for (uint32_t corner = 0; corner < is_wanted.size(); ++corner) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(corner, context));
    if (!is_wanted[corner]) {
      continue;
    }
    SectorWalk walk(domain, corner, sectors);
    if (const auto tip = tips.find(domain.curves().corners[corner]); tip != tips.end()) {
      walk.RunAroundTip(tip->second);
    } else {
      walk.Run();
    }
  }
  return sectors;
}

}  // namespace wellspace::core
