#include "core/meshers/point_adder.h"

#include <cmath>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/status_macros.h"
#include "core/input/mesh_parameters.h"
#include "core/input/point_images.h"
#include "core/input/refused_points.h"
#include "core/input/separation.h"

namespace wellspace::core {
template <int D>
absl::StatusOr<std::vector<uint32_t>> PointAdder<D>::AddPoints(std::span<const double> points,
                                                               std::span<const uint32_t> near,
                                                               const RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(CheckShape(points, D));
  WELLSPACE_RETURN_IF_ERROR(CheckNear(near, points.size() / D));
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<PlanePlace> places, FindPlaces(points, near, context));
  WELLSPACE_ASSIGN_OR_RETURN(const Merged merged, Merge(points, near, context));
  const bool merges = merge_distance_ > 0;
  const std::span<const double> given = merges ? merged.others.points : points;
  WELLSPACE_ASSIGN_OR_RETURN(const PointsWithImages imaged, WithImages<D>(periodic_, given, context));
  const std::vector<uint32_t> inputs = imaged.HasImages() ? imaged.Names(merged.others.inputs) : merged.others.inputs;
  const std::span<const double> others = imaged.HasImages() ? imaged.points : given;
  const auto explain = [&](const absl::Status& found) {
    if (!IsTooClose(found)) {
      return found;
    }
    const absl::Status error = TooClosePairsError<D>(frame_, others, inputs, true, 0, found, context);
    return imaged.HasImages() ? ExplainImages(error) : error;
  };
  absl::StatusOr<SortedCloud<D>> sorted = SortCloud<D>(frame_, others, 1, context, inputs);
  WELLSPACE_RETURN_IF_ERROR(explain(sorted.status()));
  SortedCloud<D> cloud = *std::move(sorted);
  const HugeVector<uint32_t> sorted_of = cloud.SortedOfInputs();
  std::vector<bool> is_image(cloud.points.size(), false);
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    uint32_t& input = cloud.first_input[i];
    is_image[i] = input >= given.size() / D;
    input = inputs.empty() ? input : inputs[input];
  }
  WELLSPACE_RETURN_IF_ERROR(explain(CheckApart<D>(frame_, cloud, context)));
  WELLSPACE_ASSIGN_OR_RETURN(std::vector<VertexId> vertex_of, FindAll(cloud, is_image, near, context));
  if (structure_.vertex_count() + cloud.points.size() > kMaxVertices) {
    return absl::ResourceExhaustedError(absl::StrCat("points: ", cloud.points.size(), " beside ",
                                                     structure_.vertex_count(),
                                                     " vertices are more than can be numbered, ", kMaxVertices));
  }
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    if (vertex_of[i] != kNoVertex) {
      continue;
    }
    const uint32_t input = cloud.first_input[i];
    if (is_image[i]) {
      AddImage(cloud.points[i], input, places);
    } else {
      vertex_of[i] = Add(Start(near, input), cloud.points[i], points, input, places);
    }
  }
  std::vector<uint32_t> vertices;
  for (size_t i = 0, other = 0; i < points.size() / D; ++i) {
    VertexId v = merges ? merged.vertex_of[i] : kNoVertex;
    if (v == kNoVertex) {
      v = vertex_of[sorted_of[merges ? merged.others.place_of[other] : other]];
      ++other;
    }
    NoteGiven(v);
    vertices.push_back(numbering_.OutputIndex(v));
  }
  numbering_.CountMerged(merged.others.merged);
  numbering_.AppendInputs(vertices);
  return vertices;
}

template <int D>
absl::StatusOr<uint32_t> PointAdder<D>::AddVertex(uint32_t near, std::span<const double> point) {
  WELLSPACE_RETURN_IF_ERROR(CheckVertices({&near, 1}, structure_.vertex_count()));
  if (point.size() != D) {
    return absl::InvalidArgumentError(absl::StrCat("point: it has ", point.size(), " coordinates; ", D, " are needed"));
  }
  if (structure_.vertex_count() >= kMaxVertices) {
    return absl::ResourceExhaustedError(absl::StrCat("no more than ", kMaxVertices, " vertices can be numbered"));
  }
  const RunContext context;
  if (periodic_.HasAxes()) {
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<uint32_t> vertices, AddPoints(point, {&near, 1}, context));
    return vertices[0];
  }
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<PlanePlace> places, FindPlaces(point, {&near, 1}, context));
  WELLSPACE_RETURN_IF_ERROR(CheckPoints<D>(frame_, point, context));
  const VertexId start = numbering_.VertexOf(near);
  uint64_t merged = 0;
  VertexId v = FindMerged(frame_.Scaled(PointAt<D>(point, 0)), start, merged);
  if (v == kNoVertex) {
    WELLSPACE_ASSIGN_OR_RETURN(const SortedCloud<D> cloud, SortCloud<D>(frame_, point, 1, context));
    WELLSPACE_ASSIGN_OR_RETURN(v, Find(cloud.points[0], 0, start));
    if (v == kNoVertex) {
      v = Add(start, cloud.points[0], point, 0, places);
    }
  }
  NoteGiven(v);
  const uint32_t vertex = numbering_.OutputIndex(v);
  numbering_.CountMerged(merged);
  numbering_.AppendInputs({&vertex, 1});
  return vertex;
}

template <int D>
absl::Status PointAdder<D>::CheckNear(std::span<const uint32_t> near, size_t points) const {
  if (!near.empty() && near.size() != points) {
    return absl::InvalidArgumentError(absl::StrCat("near: it has ", near.size(), " vertices for ", points, " points"));
  }
  return CheckVertices(near, structure_.vertex_count());
}

// Where points lie in a domain of the plane; none where all of the box is meshed.
template <int D>
absl::StatusOr<std::vector<PlanePlace>> PointAdder<D>::FindPlaces(std::span<const double> points,
                                                                  std::span<const uint32_t> near,
                                                                  const RunContext& context) {
  if (D != 2 || placer_ == nullptr) {
    return std::vector<PlanePlace>();
  }
  return placer_->FindAll(
      points, [&](size_t index) { return Start(near, index); }, context);
}

// Merges points with vertices that are near, and the others among themselves; nothing if points are not merged.
template <int D>
absl::StatusOr<typename PointAdder<D>::Merged> PointAdder<D>::Merge(std::span<const double> points,
                                                                    std::span<const uint32_t> near,
                                                                    const RunContext& context) {
  Merged merged;
  if (merge_distance_ == 0) {
    return merged;
  }
  WELLSPACE_RETURN_IF_ERROR(CheckPoints<D>(frame_, points, context));
  uint64_t count = 0;
  std::vector<double> others;
  std::vector<uint32_t> inputs;
  for (uint32_t i = 0; i < points.size() / D; ++i) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const Point<D> p = PointAt<D>(points, i);
    merged.vertex_of.push_back(FindMerged(frame_.Scaled(p), Start(near, i), count));
    if (merged.vertex_of.back() == kNoVertex) {
      others.insert(others.end(), p.begin(), p.end());
      inputs.push_back(i);
    }
  }
  WELLSPACE_ASSIGN_OR_RETURN(merged.others, MergeNear<D>(frame_, others, merge_distance_, context));
  merged.others.merged += count;
  for (uint32_t& input : merged.others.inputs) {
    input = inputs[input];
  }
  return merged;
}

// The nearest vertex, if points this near are merged: a Steiner vertex too, as it stands where the point is. Counts it
// in `merged` unless it is at `p`.
template <int D>
VertexId PointAdder<D>::FindMerged(const Point<D>& p, VertexId near, uint64_t& merged) {
  if (merge_distance_ == 0) {
    return kNoVertex;
  }
  const auto [nearest, distance_sq] = structure_.NearestTo(p, near, workspace_);
  const double reach = merge_distance_ * frame_.scale;
  if (distance_sq > reach * reach) {
    return kNoVertex;
  }
  merged += distance_sq > 0 ? 1 : 0;
  return nearest;
}

// Find for each of a cloud. Where images are is_image is true: the vertices of `near` are not near those.
template <int D>
absl::StatusOr<std::vector<VertexId>> PointAdder<D>::FindAll(const SortedCloud<D>& cloud,
                                                             const std::vector<bool>& is_image,
                                                             std::span<const uint32_t> near,
                                                             const RunContext& context) {
  std::vector<VertexId> found(cloud.points.size(), kNoVertex);
  RefusedPoints refused;
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const uint32_t input = cloud.first_input[i];
    const VertexId start = is_image[i] ? kNoVertex : Start(near, input);
    const absl::StatusOr<VertexId> vertex = Find(cloud.points[i], input, start);
    if (vertex.ok()) {
      found[i] = *vertex;
    } else {
      refused.Add(input, is_image[i] ? ExplainImages(vertex.status()) : vertex.status());
    }
  }
  if (!refused.IsEmpty()) {
    return refused.InAll("so are");
  }
  return found;
}

// The vertex at `p`, which is input `index`; kNoVertex if there is none, and none too close.
template <int D>
absl::StatusOr<VertexId> PointAdder<D>::Find(const Point<D>& p, size_t index, VertexId near) {
  const auto [nearest, distance_sq] = structure_.NearestTo(p, near, workspace_);
  if (distance_sq == 0) {
    return nearest;
  }
  if (distance_sq < frame_.MinSeparation() * frame_.MinSeparation()) {
    return TooCloseError<D>(frame_, p, index, std::sqrt(distance_sq),
                            absl::StrCat("vertex ", numbering_.OutputIndex(nearest)));
  }
  return kNoVertex;
}

// Adds a vertex at `p`, which is input `index` of `points`, and has its place in `places` if all have one. No neighbour
// is notified here: the next Refine does that when it first looks at the cell of the vertex, as with every vertex that
// is inserted (PendingVertices::Notify).
template <int D>
VertexId PointAdder<D>::Add(VertexId near, const Point<D>& p, std::span<const double> points, size_t index,
                            const std::vector<PlanePlace>& places) {
  const VertexId v = structure_.AddVertex(near, p);
  if (!places.empty()) {
    placer_->Add(places[index]);
  }
  vertex_added_(v);
  numbering_.AddInputVertex(v, points, index);
  return v;
}

// Adds the image of input `index` at `p`.
template <int D>
void PointAdder<D>::AddImage(const Point<D>& p, size_t index, const std::vector<PlanePlace>& places) {
  const VertexId image = structure_.AddVertex(kNoVertex, p);
  if (!places.empty()) {
    placer_->Add(placer_->ImageOf(places[index]));
  }
  vertex_added_(image);
}

template <int D>
void PointAdder<D>::NoteGiven(VertexId v) {
  if (is_given_ != nullptr) {
    is_given_->resize(structure_.vertex_count(), false);
    (*is_given_)[Index(v)] = true;
  }
}

#define WELLSPACE_INSTANTIATE(D) template class PointAdder<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
