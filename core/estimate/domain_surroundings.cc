#include "core/estimate/domain_surroundings.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/geometry/box.h"

namespace wellspace::core {
namespace {

// A foot counts as the end of a segment within this part of its length.
constexpr double kAtEnd = 1e-9;

// Finds the nearest two segments without a common end, and the nearest that does not end at a point, of segments that
// come by their distance.
class NearestPair {
 public:
  NearestPair(const PlanarDomain& domain, VertexId point, DomainSurroundings::Found& found)
      : domain_(domain), point_(point), found_(found) {}

  // Adds the next. Says whether more are wanted.
  //
  // All before it have an end in common with each other, or nothing more would be wanted. Three of them tell whether it
  // has one with each: more than three end at one vertex, and it cannot end at the other ends of three.
  bool Add(uint32_t segment, double distance) {
    if (!has_with_point_ && !EndsAt(segment, point_)) {
      found_.with_point = distance;
      has_with_point_ = true;
    }
    if (!has_pair_) {
      if (std::any_of(kept_.begin(), kept_.begin() + count_,
                      [&](uint32_t other) { return AreApart(segment, other); })) {
        found_.two_segments = distance;
        has_pair_ = true;
      } else if (count_ < kept_.size()) {
        kept_[count_++] = segment;
        centre_ = count_ == kept_.size() ? CommonEnd() : kNoVertex;
      }
    }
    return !has_with_point_ || !has_pair_;
  }

  // Whether segments that end at `v` would change nothing.
  bool CanSkip(VertexId v) const {
    return (has_with_point_ || v == point_) && (has_pair_ || (centre_ != kNoVertex && v == centre_));
  }

 private:
  bool EndsAt(uint32_t segment, VertexId v) const {
    return domain_.EndVertex(segment, false) == v || domain_.EndVertex(segment, true) == v;
  }
  bool AreApart(uint32_t segment, uint32_t other) const {
    return !EndsAt(segment, domain_.EndVertex(other, false)) && !EndsAt(segment, domain_.EndVertex(other, true));
  }
  VertexId CommonEnd() const {
    for (const bool is_b : {false, true}) {
      const VertexId end = domain_.EndVertex(kept_[0], is_b);
      if (EndsAt(kept_[1], end) && EndsAt(kept_[2], end)) {
        return end;
      }
    }
    return kNoVertex;  // a triangle
  }

  const PlanarDomain& domain_;
  const VertexId point_;
  DomainSurroundings::Found& found_;
  bool has_with_point_ = false;
  bool has_pair_ = false;
  std::array<uint32_t, 3> kept_{};
  size_t count_ = 0;             // of kept_
  VertexId centre_ = kNoVertex;  // where three of them end
};

}  // namespace

absl::Status DomainSurroundings::Prepare(const RunContext& context) {
  face_of_leaf_.assign(tree_.node_count(), kNoFace);
  return FindFacesOfLeaves(context);
}

absl::Status DomainSurroundings::MoveTo(NodeId leaf, const RunContext& context) {
  compared_ = compared();
  leaf_ = leaf;
  segments_ = tree_.segments().Of(leaf);
  near_.reset();
  near_in_face_.clear();
  by_face_.clear();
  beside_faces_.clear();
  if (segments_.size() <= NearSegments::kTogether) {
    return absl::OkStatus();
  }
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  near_.emplace(domain_, segments_, tree_.BoxOf(leaf));
  for (const uint32_t segment : segments_) {
    const uint32_t left = domain_.faces().left_face[HalfEdgeOf(segment, false)];
    const uint32_t right = domain_.faces().left_face[HalfEdgeOf(segment, true)];
    by_face_.emplace_back(left, segment);
    if (right != left) {
      by_face_.emplace_back(right, segment);
    }
  }
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(by_face_, std::less<>(), context));
  beside_faces_.reserve(by_face_.size());
  for (const auto& [face, segment] : by_face_) {
    beside_faces_.push_back(segment);
  }
  return absl::OkStatus();
}

uint64_t DomainSurroundings::compared() const {
  uint64_t compared = compared_ + (near_.has_value() ? near_->compared() : 0);
  for (const auto& [face, near] : near_in_face_) {
    compared += near->compared();
  }
  return compared;
}

uint32_t DomainSurroundings::FaceBesideNearest(const Point<2>& x, uint32_t segment,
                                               const SegmentDistance& distance) const {
  const double length = domain_.LengthOf(segment);
  const bool is_at_a = distance.from_a <= kAtEnd * length;
  if (!is_at_a && distance.from_a < (1 - kAtEnd) * length) {
    return FaceBeside(segment, distance);
  }
  // Nothing is nearer than the end: the place is in the sector there that it is seen in.
  const VertexId end = domain_.EndVertex(segment, !is_at_a);
  return domain_.FaceOfSector(end, domain_.SectorToward(end, Difference<2>(x, domain_.EndOf(segment, !is_at_a))));
}

uint32_t DomainSurroundings::FaceAt(const Point<2>& x, std::span<const uint32_t> segments) {
  uint32_t nearest = segments[0];
  SegmentDistance least{std::numeric_limits<double>::infinity(), 0, 0};
  compared_ += segments.size();
  for (const uint32_t segment : segments) {
    if (const SegmentDistance own = DistanceTo(domain_, x, segment); own.distance < least.distance) {
      least = own;
      nearest = segment;
    }
  }
  return FaceBesideNearest(x, nearest, least);
}

absl::Status DomainSurroundings::FindFacesOfLeaves(const RunContext& context) {
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
    if (!tree_.segments().Of(leaf).empty() && !context.IsCancelled()) {
      tell_all(leaf);
    }
  });
  while (!found.empty() && !context.IsCancelled()) {
    const NodeId leaf = found.back();
    found.pop_back();
    tell_all(leaf);
  }
  return context.Check();
}

DomainSurroundings::Group DomainSurroundings::GroupOf(uint32_t face) {
  if (!near_.has_value()) {
    return {segments_};
  }
  const auto [first, end] =
      std::ranges::equal_range(by_face_, face, {}, [](const auto& with_face) { return with_face.first; });
  Group group;
  group.segments =
      std::span(beside_faces_).subspan(static_cast<size_t>(first - by_face_.begin()), static_cast<size_t>(end - first));
  if (group.segments.size() > NearSegments::kTogether) {
    std::unique_ptr<NearSegments>& near = near_in_face_[face];
    if (near == nullptr) {
      near = std::make_unique<NearSegments>(domain_, group.segments, tree_.BoxOf(leaf_));
    }
    group.near = near.get();
  }
  return group;
}

DomainSurroundings::Found DomainSurroundings::LookAt(const Point<2>& x, VertexId point) {
  Found found;
  if (segments_.empty()) {
    found.face = face_of_leaf_[Index(leaf_)];
    return found;
  }
  if (near_.has_value()) {
    const auto take_nearest = [&](uint32_t segment, const SegmentDistance& own) {
      found.face = FaceBesideNearest(x, segment, own);
      return false;
    };
    near_->ForEachFrom(x, take_nearest, [](VertexId) { return false; });
  } else {
    found.face = FaceAt(x, segments_);
  }
  NearestPair pair(domain_, point, found);
  const auto add = [&](uint32_t segment, const SegmentDistance& own) {
    return FaceBeside(segment, own) != found.face  // another segment hides it
           || pair.Add(segment, own.distance);
  };
  const Group group = GroupOf(found.face);
  if (group.near != nullptr) {
    group.near->ForEachFrom(x, add, [&](VertexId v) { return pair.CanSkip(v); });
    return found;
  }
  few_.clear();
  compared_ += group.segments.size();
  for (const uint32_t segment : group.segments) {
    few_.emplace_back(DistanceTo(domain_, x, segment), segment);
  }
  std::ranges::sort(few_, {}, [](const auto& one) { return std::pair(one.first.distance, one.second); });
  for (const auto& [own, segment] : few_) {
    if (!add(segment, own)) {
      break;
    }
  }
  return found;
}

}  // namespace wellspace::core
