#include "core/meshers/box_mesher.h"

#include <algorithm>
#include <bit>

#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/input/frame.h"
#include "core/input/point_images.h"
#include "core/input/separation.h"
#include "core/mesh/mesh_statistics.h"
#include "core/meshers/feasibility.h"
#include "core/meshers/mesh_estimate.h"
#include "core/meshers/mesher_checks.h"
#include "core/simplex/boundary.h"
#include "core/simplex/simplices.h"

namespace wellspace::core {
namespace {

template <int D>
Box<D> BoxOf(const std::vector<double>& low, const std::vector<double>& high) {
  Box<D> box;
  std::copy_n(low.begin(), D, box.low.begin());
  std::copy_n(high.begin(), D, box.high.begin());
  return box;
}

// Adds the images to the points that stayed, as further inputs.
void AppendImages(PointsWithImages& imaged, MergedPoints& merged) {
  if (!imaged.HasImages()) {
    return;
  }
  merged.points = std::move(imaged.points);
  for (size_t i = 0; i < imaged.sources.size(); ++i) {
    merged.place_of.push_back(static_cast<uint32_t>(merged.inputs.size()));
    merged.inputs.push_back(static_cast<uint32_t>(merged.place_of.size() - 1));
  }
}

}  // namespace

template <int D>
uint64_t BoxMesher<D>::BuildingBytes(const MeshParameters& parameters, const Input& input) const {
  const uint64_t points = input.points.size() / D;
  uint64_t bytes = parameters.merge_distance > 0 ? points * kMergeBytes<D> : 0;
  if (!parameters.periodic_axes.empty()) {
    const absl::StatusOr<Box<D>> box = parameters.domain_low.empty()
                                           ? BoxAround<D>(input.points, parameters.margin, RunContext())
                                           : BoxOf<D>(parameters.domain_low, parameters.domain_high);
    const size_t images = box.ok() ? CountImages(PeriodicBox<D>(*box, parameters.periodic_axes), input.points) : 0;
    // A copy of all, and what each more takes as a point.
    bytes += images == 0 ? 0 : (points + images) * sizeof(Point<D>) + images * (kTreeBytes<D> + sizeof(Point<D>));
  }
  return bytes;
}

template <int D>
absl::Status BoxMesher<D>::Build(const MeshParameters& parameters, const Input& input, RunContext& context) {
  const std::span<const double> points = input.points;
  merge_distance_ = parameters.merge_distance;
  periodic_axes_ = parameters.periodic_axes;
  WELLSPACE_ASSIGN_OR_RETURN(MergedPoints merged, SetBox(parameters, points, context));
  meshed_box_ = frame_.box;
  WELLSPACE_RETURN_IF_ERROR(samples_.Take(frame_, parameters, context));
  WELLSPACE_RETURN_IF_ERROR(CheckShapeFeasible<D>(frame_, parameters, points.size() / D));
  const size_t stayed = merged.inputs.size();
  WELLSPACE_ASSIGN_OR_RETURN(
      PointsWithImages imaged,
      WithImages<D>(PeriodicIn(frame_.box), merge_distance_ > 0 ? merged.points : points, context));
  const std::span<const double> all = imaged.HasImages() ? imaged.points : points;
  if (merge_distance_ > 0) {
    AppendImages(imaged, merged);
  }
  absl::StatusOr<SortedCloud<D>> cloud = SortAndBuild(parameters, all, merged, context);
  if (IsTooClose(cloud.status())) {
    const std::span<const uint32_t> inputs = std::span(merged.inputs).first(stayed);
    const std::vector<uint32_t> names = imaged.HasImages() ? imaged.Names(inputs) : merged.inputs;
    const absl::Status error =
        TooClosePairsError<D>(frame_, merge_distance_ > 0 ? merged.points : all, names, !parameters.domain_low.empty(),
                              parameters.margin, cloud.status(), context);
    return imaged.HasImages() ? ExplainImages(error) : error;
  }
  WELLSPACE_RETURN_IF_ERROR(cloud.status());
  const auto corners = static_cast<uint32_t>(structure_.built_count() - cloud->first_input.size());
  WELLSPACE_ASSIGN_OR_RETURN(PointNames names, NamePoints<D>(*std::move(cloud), context));
  numbering_.Begin(std::move(names), points, std::span(merged.inputs).first(stayed), {imaged.sources.size(), corners});
  numbering_.CountMerged(merged.merged);
  repairs_.is_given().assign(structure_.built_count(), true);
  return absl::OkStatus();
}

// Sets the box, and merges the points that are near each other if that is asked for.
template <int D>
absl::StatusOr<MergedPoints> BoxMesher<D>::SetBox(const MeshParameters& parameters, std::span<const double> points,
                                                  const RunContext& context) {
  const bool is_given = !parameters.domain_low.empty();
  Box<D> box;
  if (is_given) {
    box = BoxOf<D>(parameters.domain_low, parameters.domain_high);
  } else {
    WELLSPACE_ASSIGN_OR_RETURN(box, BoxAround<D>(points, parameters.margin, context));
  }
  WELLSPACE_ASSIGN_OR_RETURN(frame_, Frame<D>::Of(box));
  MergedPoints merged;
  if (merge_distance_ == 0) {
    return merged;
  }
  // A point outside the box may become one inside: the box of a session is that of the points that stayed.
  Frame<D> wide = frame_;
  const double reach = std::min(merge_distance_, box.LongestSide());
  wide.box = {CubeAround<D>(box.low, reach).low, CubeAround<D>(box.high, reach).high};
  WELLSPACE_RETURN_IF_ERROR(CheckPoints<D>(wide, points, context));
  WELLSPACE_ASSIGN_OR_RETURN(merged, MergeNear<D>(frame_, points, merge_distance_, context));
  if (!is_given) {
    WELLSPACE_ASSIGN_OR_RETURN(box, BoxAround<D>(merged.points, parameters.margin, context));
    WELLSPACE_ASSIGN_OR_RETURN(frame_, Frame<D>::Of(box));
  }
  return merged;
}

// Sorts the points, or the result `merged` if points are merged, and builds the tree. Returns the cloud without its
// points, which the structure has then.
template <int D>
absl::StatusOr<SortedCloud<D>> BoxMesher<D>::SortAndBuild(const MeshParameters& parameters,
                                                          std::span<const double> points, const MergedPoints& merged,
                                                          const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(SortedCloud<D> cloud, merge_distance_ > 0
                                                       ? SortMerged<D>(frame_, merged, parameters.threads, context)
                                                       : SortCloud<D>(frame_, points, parameters.threads, context));
  WELLSPACE_RETURN_IF_ERROR(
      Base::BuildTree(parameters, "distinct points and the domain's corners", cloud, {}, context));
  return cloud;
}

template <int D>
uint64_t BoxMesher<D>::OtherBytes() const {
  uint64_t bytes = repairs_.MemoryBytes() + facet_simplices_.size() * sizeof(uint32_t) +
                   (star_rows_.has_value() ? star_rows_->MemoryBytes() : 0);
  if constexpr (D >= 3) {
    bytes += slivers_.MemoryBytes();
  }
  return bytes;
}

template <int D>
absl::Status BoxMesher<D>::CheckDemands(const MeshParameters& parameters) const {
  if (periodic_axes_.empty()) {
    return absl::OkStatus();
  }
  MeshParameters here = parameters;
  here.periodic_axes = periodic_axes_;
  return ValidateParameters(here);
}

template <int D>
BoxDomain<D> BoxMesher<D>::ToRefine() {
  if constexpr (BoxDomain<D>::kMayHaveImages) {
    return BoxDomain<D>(PeriodicIn(frame_.scaled_box));
  } else {
    return {};
  }
}

template <int D>
absl::Status BoxMesher<D>::CheckFeasibleHere(const MeshParameters& parameters) const {
  return CheckFeasible<D>(frame_, parameters, samples_, numbering_.distinct_inputs());
}

template <int D>
absl::Status BoxMesher<D>::AddToEstimate(const MeshParameters& parameters, const MeshCriteria<D>& /*criteria*/,
                                         const RunContext& context, MeshEstimate& estimate) const {
  if (!periodic_axes_.empty()) {
    WELLSPACE_RETURN_IF_ERROR(AddImages<D>(structure_, PeriodicIn(frame_.scaled_box), context, estimate));
  }
  if constexpr (D >= 3) {
    if (MinDihedralOf(parameters) > 0 || parameters.pump_weights) {
      AddSliverStage<D>(estimate);
    }
  }
  return absl::OkStatus();
}

// Repairs slivers if that is asked for, else drops the triangulation kept for it. Decides whether the mesh is pumped:
// a mesh without slivers stays Delaunay.
template <int D>
absl::Status BoxMesher<D>::Improve(const MeshParameters& parameters, RunContext& context) {
  if constexpr (D == 3) {
    if (const double min_dihedral = MinDihedralOf(parameters); min_dihedral > 0) {
      const RepairCriteria criteria{Base::CriteriaOf(parameters), min_dihedral, frame_.MinEdge(),
                                    VertexBudget(parameters)};
      BoxCarrier carrier(structure_, PeriodicIn(frame_.scaled_box).faces());
      const absl::Status status = repairs_.Repair(slivers_, structure_, *refinement_, carrier, criteria, parameters,
                                                  figures_.extracted_vertices, context);
      pumps_ = parameters.pump_weights && slivers_.statistics().slivers_left > 0;
      return status;
    }
  }
  if constexpr (D >= 3) {
    slivers_.Forget();
  }
  pumps_ = parameters.pump_weights;
  return absl::OkStatus();
}

template <int D>
double BoxMesher<D>::MinDihedralOf(const MeshParameters& parameters) {
  return parameters.min_dihedral.value_or(DefaultMinDihedral(D));
}

// Whether the mesh is that of the sliver stage, and not made of stars.
template <int D>
bool BoxMesher<D>::MakesByStage() const {
  if constexpr (D >= 3) {
    return pumps_ || slivers_.HasTriangulation();
  }
  return false;
}

template <int D>
absl::StatusOr<typename BoxMesher<D>::Made> BoxMesher<D>::MakeSimplices(int threads, RunContext& context) {
  followed_ = Followed::kNot;
  star_rows_.reset();
  if constexpr (D >= 3) {
    if (MakesByStage()) {
      WELLSPACE_ASSIGN_OR_RETURN(
          WeightedSimplices weighted,
          slivers_.ToSimplices(structure_, refinement_->stars(), numbering_.output_index(), pumps_, threads, context));
      return Made{std::move(weighted.simplices), std::move(weighted.weights)};
    }
  }
  WELLSPACE_ASSIGN_OR_RETURN(Simplices simplices, ComputeSimplices<D>(structure_, refinement_->stars(),
                                                                      numbering_.output_index(), threads, context));
  return Made{std::move(simplices)};
}

template <int D>
absl::Status BoxMesher<D>::Describe(Mesh& mesh, std::span<const uint32_t> /*faces*/, int threads,
                                    const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(
      BoxBoundary boundary,
      FindBoxBoundary({mesh.domain_low, mesh.domain_high, mesh.points, mesh.simplices}, threads, context));
  mesh.vertex_tags = std::move(boundary.vertex_tags);
  mesh.facets = std::move(boundary.facets);
  mesh.boundary = std::move(boundary.parts);
  facet_simplices_ = std::move(boundary.simplices);
  mesh.regions = {WholeBox()};
  mesh.vertex_origins.assign(structure_.vertex_count(), kSteinerOrigin);
  const auto origins = mesh.vertex_origins.begin();
  std::fill(origins, origins + structure_.built_count(), kCornerOrigin);
  numbering_.ForEachImage([&](VertexId v, uint32_t number) {
    origins[number] = std::popcount(structure_.faces(v)) < D ? kSteinerOrigin : kCornerOrigin;
  });
  repairs_.ForEachAdded(0, [&](VertexId v) { origins[Index(v)] = kRepairOrigin; });
  const auto& input_vertex = numbering_.input_vertex();
  for (size_t i = input_vertex.size(); i > 0; --i) {
    origins[input_vertex[i - 1]] = static_cast<uint32_t>(i - 1);
  }
  known_inputs_ = input_vertex.size();
  return absl::OkStatus();
}

template <int D>
void BoxMesher<D>::NoteMade(Mesh& mesh) {
  for (const VertexId v : repairs_.TakeMoved()) {
    mesh.moved_vertices.push_back(numbering_.OutputIndex(v));  // ascending: it is the same number
  }
  followed_ = pumps_ ? Followed::kNot : MakesByStage() ? Followed::kByStage : Followed::kByStars;
}

template <int D>
void BoxMesher<D>::AddStatistics(const Mesh& /*mesh*/, MeshStatistics& statistics, QueryCounters& stars) const {
  statistics.merged_points = numbering_.merged_inputs();
  statistics.duplicates = statistics.input_points - numbering_.distinct_inputs() - statistics.merged_points;
  if constexpr (D >= 3) {
    stars.Add(slivers_.statistics().star_queries);
    SetSliverFigures(slivers_.statistics(), statistics);
    for (LeftSliver& sliver : statistics.flattest_left) {
      for (uint32_t& v : sliver.vertices) {
        v = numbering_.OutputIndex(VertexId{v});
      }
    }
  }
}

#define WELLSPACE_INSTANTIATE(D) template class BoxMesher<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
