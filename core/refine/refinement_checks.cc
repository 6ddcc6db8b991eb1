#include "core/refine/refinement_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/refine/checks.h"
#include "core/refine/rounding.h"

namespace wellspace::core {
namespace {

// All vertices are looked at once for every so many that are taken from the schedule, relative to their number.
constexpr uint64_t kCheckShare = 16;

void CheckIsNotBelow(const Schedule& schedule, VertexId v, VertexId u, int bucket) {
  Require(!schedule.IsPendingBelow(u, bucket), "vertex ", Index(v), " is looked at for edges up to ",
          std::sqrt(schedule.UpperLengthSq(bucket)), " while vertex ", Index(u), " is pending for a shorter one");
}

}  // namespace

template <int D>
void RefinementChecks<D>::CheckOrder(const Schedule& schedule, VertexId v, const Polytope<D>& cell, int bucket) {
  for (const CellNode<D>& node : cell.nodes()) {
    for (const uint16_t index : node.planes) {
      if (cell.plane(index).kind == PlaneKind::kBisector) {
        CheckIsNotBelow(schedule, v, cell.plane(index).vertex, bucket);
      }
    }
  }
  if (++unchecked_ * kCheckShare > structure_.vertex_count()) {
    unchecked_ = 0;
    for (uint32_t u = 0; u < structure_.vertex_count(); ++u) {
      CheckIsNotBelow(schedule, v, VertexId{u}, bucket);
    }
  }
}

template <int D>
void RefinementChecks<D>::CheckInsertion(const StepRules<D>& rules, const Insertion& insertion,
                                         const SteinerPoint<D>& candidate, const SteinerPoint<D>& point,
                                         bool is_on_feature) {
  const Box<D>& box = structure_.box();
  const double edge = std::sqrt(insertion.edge_sq);
  const double limit = std::sqrt(insertion.edge_limit_sq);
  const double distance = std::sqrt(candidate.empty_radius_sq);
  const double radius = std::sqrt(point.empty_radius_sq);
  const bool encroaches = insertion.reason == Reason::kEncroachment;
  const auto which = [&, near = insertion.near] {
    return absl::StrCat(encroaches ? "the face" : "the edge", " of length ", edge, " at vertex ", Index(near),
                        ", in the bucket up to ", limit, ", asks for a point at distance ", distance, " and radius ",
                        radius, ": ");
  };
  const double rounding = RoundingIn<D>(box);
  const double least = (encroaches ? 1 : rules.criteria().rho) * edge * (1 - kLengthRounding);
  const double most = std::sqrt(D) * rules.clip_factor() * limit * (1 + kLengthRounding) + rounding;
  if (!(distance >= least && (distance <= most || is_on_feature))) {
    Require(false, which(), "it has to be from ", least, " to ", most);
  }
  if (!encroaches && !(edge <= limit * (1 + kLengthRounding))) {
    Require(false, which(), "the edge is for a later bucket");
  }
  // A projection takes at most half of the squared radius; where the box is thin, the loss is also less than that.
  const double kept = std::ldexp(1.0, 1 - D) * candidate.empty_radius_sq;
  const double thin = std::ldexp(box.ShortestSide() * box.ShortestSide(), 2 - D);
  if (!(point.empty_radius_sq >= std::min(kept, thin) * (1 - kLengthRounding))) {
    Require(false, which(), "projections shortened the radius too much");
  }
  const Neighbor nearest = structure_.NearestTo(point.position, insertion.near, workspace_);
  const double allowed = radius * (1 - kLengthRounding) - rounding;
  if (!(box.Contains(point.position) && std::sqrt(nearest.distance_sq) >= allowed)) {
    Require(false, which(), "vertex ", Index(nearest.vertex), " is at distance ", std::sqrt(nearest.distance_sq));
  }
}

#define WELLSPACE_INSTANTIATE(D) template class RefinementChecks<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
