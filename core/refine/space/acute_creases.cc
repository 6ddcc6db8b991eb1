#include "core/refine/space/acute_creases.h"

#include <cmath>
#include <utility>

#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/geometry/triangle.h"

namespace wellspace::core {
namespace {

// A point is in a diametral ball only if it is nearer to its centre by more than this, relatively.
constexpr double kBallTolerance = 1e-9;

// All diametral balls of a strand's subsegments lie within so many times the distance of its ends from their middle,
// however it is bent.
constexpr double kReachOfStrand = 0.75;

}  // namespace

void AcuteCreases::AddBall(const Point<3>& centre, double radius) {
  shields_.push_back({centre, centre, {radius, radius}, false});
}

void AcuteCreases::AddFrozen(const Point<3>& a, const Point<3>& b) { shields_.push_back({a, b, {}, true}); }

void AcuteCreases::AddTube(const Point<3>& a, const Point<3>& b, const std::array<double, 2>& radii) {
  shields_.push_back({a, b, radii, false});
}

absl::Status AcuteCreases::Finish(const RunContext& context) {
  std::vector<Box<3>> boxes;
  for (size_t i = 0; i < shields_.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
    const Shield& shield = shields_[i];
    Box<3> box{shield.a, shield.a};
    box.Include({shield.b, shield.b});
    const double room = shield.is_diametral ? 0.5 * Distance<3>(shield.a, shield.b)
                                            : kOutside * std::max(shield.radii[0], shield.radii[1]);
    boxes.push_back(Widened<3>(box, room));
  }
  WELLSPACE_RETURN_IF_ERROR(shield_tree_.Build(std::exchange(boxes, {}), context));
  for (size_t i = 0; i < strands.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
    const Point<3>& a = strands[i].ends[0].at;
    const Point<3>& b = strands[i].ends[1].at;
    const Point<3> middle = Between(a, b, 0.5);
    boxes.push_back(Widened<3>({middle, middle}, kReachOfStrand * Distance<3>(a, b)));
  }
  return strand_tree_.Build(std::move(boxes), context);
}

bool AcuteCreases::Covers(const Point<3>& p, double share_of_radii, bool with_frozen) const {
  bool is_covered = false;
  shield_tree_.ForEach(WithinReachOf<3>(p, 0), [&](uint32_t i) {
    const Shield& shield = shields_[i];
    const Point<3> along = Difference<3>(shield.b, shield.a);
    const double length_sq = NormSq<3>(along);
    if (shield.is_diametral) {
      is_covered =
          with_frozen && DistanceSq<3>(p, Between(shield.a, shield.b, 0.5)) < 0.25 * length_sq * (1 - kBallTolerance);
    } else {
      const double foot = length_sq > 0 ? Dot<3>(Difference<3>(p, shield.a), along) / length_sq : 0;
      const double at = std::clamp(foot, 0.0, 1.0);
      const double radius = share_of_radii * (shield.radii[0] + at * (shield.radii[1] - shield.radii[0]));
      is_covered = DistanceSq<3>(p, Between(shield.a, shield.b, at)) < radius * radius;
    }
    return !is_covered;
  });
  return is_covered;
}

uint64_t AcuteCreases::MemoryBytes() const {
  uint64_t bytes = is_acute.size() / 8 + balls.size() * sizeof(balls[0]) + first_arcs.size() * sizeof(first_arcs[0]) +
                   collars.size() * sizeof(Collar) + strands.size() * sizeof(Strand) +
                   shields_.size() * sizeof(Shield) + BoxTree<3>::Bytes(shields_.size()) +
                   BoxTree<3>::Bytes(strands.size());
  for (const std::vector<double>& arcs : first_arcs) {
    bytes += arcs.size() * sizeof(double);
  }
  return bytes;
}

}  // namespace wellspace::core
