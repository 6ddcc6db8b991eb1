// What the checking build asserts of the refinement at each step.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/refine/checks.h"
#include "core/refine/refine.h"
#include "core/refine/rounding.h"

namespace wellspace::core {
namespace {

// All vertices are looked at once for every so many that are taken from the schedule, relative to their number.
constexpr uint64_t kCheckShare = 16;

}  // namespace

// That nobody waits below `bucket`, from which `v` was taken: the neighbours in the cell each time, all now and then.
template <int D>
void Refinement<D>::CheckOrder(VertexId v, const Polytope<D>& cell, int bucket) {
  for (const CellNode<D>& node : cell.nodes()) {
    for (const uint16_t index : node.planes) {
      if (cell.plane(index).kind == PlaneKind::kBisector) {
        CheckWaits(v, cell.plane(index).vertex, bucket);
      }
    }
  }
  if (++unchecked_ * kCheckShare > structure_.vertex_count()) {
    unchecked_ = 0;
    for (uint32_t u = 0; u < structure_.vertex_count(); ++u) {
      CheckWaits(v, VertexId{u}, bucket);
    }
  }
}

template <int D>
void Refinement<D>::CheckWaits(VertexId v, VertexId u, int bucket) const {
  Require(!pending_.schedule().IsPendingBelow(u, bucket), "vertex ", Index(v), " is looked at for edges up to ",
          std::sqrt(pending_.schedule().UpperLengthSq(bucket)), " while vertex ", Index(u), " waits for a shorter one");
}

// [HT08] Definition 1 at an insertion, before it is made: (1), that the edge is the bucket's, the place, and the empty ball.
template <int D>
void Refinement<D>::CheckInsertion(const Request& request) {
  const auto& [insertion, candidate, point] = request;
  const Box<D>& box = structure_.box();
  const double edge = std::sqrt(insertion.edge_sq);
  const double limit = std::sqrt(insertion.edge_limit_sq);
  const double distance = std::sqrt(candidate.empty_radius_sq);
  const double radius = std::sqrt(point.empty_radius_sq);
  const bool encroaches = insertion.reason == Reason::kEncroachment;
  const auto which = [&] {
    return absl::StrCat(encroaches ? "the face" : "the edge", " of length ", edge, " at vertex ", Index(insertion.near),
                        ", in the bucket up to ", limit, ", asks for a point at distance ", distance, " and radius ",
                        radius, ": ");
  };
  const double rounding = RoundingIn<D>(box);
  const double least = (encroaches ? 1 : rules_->criteria().rho) * edge * (1 - kLengthRounding);
  const double most = std::sqrt(D) * rules_->clip_factor() * limit * (1 + kLengthRounding) + rounding;
  if (!(distance >= least && distance <= most)) {
    Require(false, which(), "it has to be from ", least, " to ", most);
  }
  if (!encroaches && !(edge <= limit * (1 + kLengthRounding))) {
    Require(false, which(), "the edge is for a later bucket");
  }
  // A projection takes at most half of the squared radius; where the box is thin, what it takes is also less than that.
  const double kept = std::ldexp(1.0, 1 - D) * candidate.empty_radius_sq;
  const double thin = std::ldexp(box.ShortestSide() * box.ShortestSide(), 2 - D);
  if (!(point.empty_radius_sq >= std::min(kept, thin) * (1 - kLengthRounding))) {
    Require(false, which(), "projections shortened the radius too much");
  }
  const Neighbor nearest = structure_.NearestTo(point.position, insertion.near, check_);
  const double allowed = radius * (1 - kLengthRounding) - rounding;
  if (!(box.Contains(point.position) && std::sqrt(nearest.distance_sq) >= allowed)) {
    Require(false, which(), "vertex ", Index(nearest.vertex), " is at distance ", std::sqrt(nearest.distance_sq));
  }
}

#define WELLSPACE_INSTANTIATE(D)                                              \
  template void Refinement<D>::CheckOrder(VertexId, const Polytope<D>&, int); \
  template void Refinement<D>::CheckInsertion(const InsertionRequest<D>&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
