#include "core/estimate/domain_surroundings.h"

#include <algorithm>
#include <cmath>

#include "core/geometry/box.h"

namespace wellspace::core {
namespace {

// Distances to segments with a common end count as equal within this.
constexpr double kSameDistance = 1e-9;

}  // namespace

DomainSurroundings::DomainSurroundings(const LeafTree<2>& tree, const PlanarDomain& domain)
    : tree_(tree), domain_(domain), face_of_leaf_(tree.node_count(), kNoFace) {
  FindFacesOfLeaves();
}

DomainSurroundings::Distance DomainSurroundings::DistanceTo(const Point<2>& x, uint32_t segment) const {
  const auto [foot, away] = domain_.FootOf(x, segment);
  const double beyond = foot - std::clamp(foot, 0.0, domain_.LengthOf(segment));  // an end
  return {std::hypot(away, beyond), away};
}

// Where two segments with a common end are as near, the one across the way to `x` tells the side.
uint32_t DomainSurroundings::FaceAt(const Point<2>& x, std::span<const uint32_t> segments) const {
  Distance nearest{std::numeric_limits<double>::infinity(), 0};
  uint32_t face = kNoFace;
  for (const uint32_t segment : segments) {
    const Distance own = DistanceTo(x, segment);
    const bool is_same = std::abs(own.distance - nearest.distance) <= kSameDistance * own.distance;
    if (is_same ? std::abs(own.away) > std::abs(nearest.away) : own.distance < nearest.distance) {
      nearest = own;
      face = FaceBeside(segment, own);
    }
  }
  return face;
}

void DomainSurroundings::FindFacesOfLeaves() {
  std::vector<NodeId> found;
  const auto tell = [&](NodeId leaf, NodeId neighbour) {
    uint32_t& face = face_of_leaf_[Index(neighbour)];
    if (face != kNoFace || !tree_.segments().Of(neighbour).empty()) {
      return;
    }
    const std::span<const uint32_t> segments = tree_.segments().Of(leaf);
    if (segments.empty()) {
      face = face_of_leaf_[Index(leaf)];
    } else {
      const Box<2> own = tree_.BoxOf(leaf);
      const Box<2> other = tree_.BoxOf(neighbour);
      Point<2> between;
      for (int i = 0; i < 2; ++i) {
        between[i] = std::clamp(0.5 * (other.low[i] + other.high[i]), own.low[i], own.high[i]);
      }
      face = FaceAt(between, segments);
    }
    found.push_back(neighbour);
  };
  const auto tell_all = [&](NodeId leaf) {
    tree_.ForEachFaceNeighbour(leaf, [&](NodeId neighbour) { tell(leaf, neighbour); });
  };
  tree_.ForEachLeaf([&](NodeId leaf) {
    if (!tree_.segments().Of(leaf).empty()) {
      tell_all(leaf);
    }
  });
  while (!found.empty()) {
    const NodeId leaf = found.back();
    found.pop_back();
    tell_all(leaf);
  }
}

DomainSurroundings::Found DomainSurroundings::LookAt(const Point<2>& x, VertexId point) const {
  Found found;
  found.face = segments_.empty() ? face_of_leaf_[Index(leaf_)] : FaceAt(x, segments_);
  for (size_t i = 0; i < segments_.size(); ++i) {
    const uint32_t segment = segments_[i];
    const Distance own = DistanceTo(x, segment);
    if (FaceBeside(segment, own) != found.face) {
      continue;  // another segment hides it
    }
    if (!EndsAt(segment, point)) {
      found.with_point = std::min(found.with_point, own.distance);
    }
    for (const uint32_t other : segments_.first(i)) {
      if (!EndsAt(segment, domain_.EndVertex(other, false)) && !EndsAt(segment, domain_.EndVertex(other, true))) {
        const Distance others = DistanceTo(x, other);
        if (FaceBeside(other, others) == found.face) {
          found.two_segments = std::min(found.two_segments, std::max(own.distance, others.distance));
        }
      }
    }
  }
  return found;
}

}  // namespace wellspace::core
