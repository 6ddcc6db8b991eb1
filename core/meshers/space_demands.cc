// The demands on the mesh of a surface: those that can never be met, and those that take too many vertices.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/cord.h"
#include "absl/strings/str_format.h"
#include "core/base/check_at.h"
#include "core/base/saturate.h"
#include "core/base/status_macros.h"
#include "core/input/space_parameters.h"
#include "core/input/surface_sizes.h"
#include "core/meshers/feasibility.h"
#include "core/meshers/mesh_estimate.h"
#include "core/meshers/space_mesher.h"
#include "core/refine/space/crease_sampler.h"

namespace wellspace::core {
namespace {

// More is estimated than models say.
constexpr double kEstimateRoom = 2;

// Beside acute creases facets may be so many times the tolerance from the surface: vertices stay where they are put.
constexpr double kMostOverTolerance = 2;

// Demands that differ by less, relatively, are the same.
constexpr double kRoundingOfDemands = 1e-12;

absl::Status TooFineError(const std::string& message) {
  absl::Status status = absl::ResourceExhaustedError(message);
  status.SetPayload(std::string(kDemandsTooFine), absl::Cord());
  return status;
}

}  // namespace

absl::Status SpaceMesher::CheckDemands(const MeshParameters& parameters) const {
  if (parameters.criterion != Criterion::kRadiusEdge) {
    return absl::InvalidArgumentError("criterion: a domain with a surface has the radius-edge criterion alone");
  }
  return spatial_ == nullptr || spatial_->creases().IsEmpty() ? absl::OkStatus() : CheckCreases(parameters);
}

// Refuses demands that vertices on acute curves, which stay where they were put at first, do not keep to.
absl::Status SpaceMesher::CheckCreases(const MeshParameters& parameters) const {
  const double edge = CurveEdgeOf(parameters);
  const double first_edge = CurveEdgeOf(first_parameters_);
  if (edge < first_edge * (1 - kRoundingOfDemands)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "surface.edge_length: the surface has creases below %g degrees, whose vertices stay where the first refinement "
        "has put them, and edges of %g are asked for; expected at least %g, or a mesh of its own",
        kAcuteAngle, edge, first_edge));
  }
  const double tolerance = SurfaceCriteriaOf(parameters, default_tolerance_, 1).tolerance;
  const double first_tolerance = SurfaceCriteriaOf(first_parameters_, default_tolerance_, 1).tolerance;
  if (tolerance < first_tolerance * (1 - kRoundingOfDemands)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "surface.tolerance: the surface has creases below %g degrees, whose vertices stay where the first refinement "
        "has put them, and the tolerance is %g; expected at least %g, or a mesh of its own",
        kAcuteAngle, tolerance, first_tolerance));
  }
  return absl::OkStatus();
}

// Refuses a surface at which a part of an acute crease is no edge of the mesh, since it cannot be split; or which is
// far from facets where no vertex may be added. `lost`: such parts of all curves; `far`: such places on all patches.
absl::Status SpaceMesher::CheckAcuteCreases(std::span<const Subsegment> lost, std::span<const Missing> far) const {
  const double most = kMostOverTolerance * spatial_->criteria().tolerance;
  const auto too_far = std::find_if(far.begin(), far.end(), [&](const Missing& missing) {
    return missing.distance > most && spatial_->creases().Shields(missing.at);
  });
  if (too_far != far.end()) {
    const Point<3> place = frame_.Unscaled(too_far->at);
    return absl::InvalidArgumentError(absl::StrFormat(
        "surface.tolerance: beside a crease below %g degrees, at (%.6g, %.6g, %.6g), facets are %.3g from the surface, "
        "and none can be added there; expected a tolerance of at least half of that, or a shorter surface.edge_length",
        kAcuteAngle, place[0], place[1], place[2], too_far->distance / frame_.scale));
  }
  const auto frozen =
      std::find_if(lost.begin(), lost.end(), [this](const Subsegment& s) { return spatial_->IsFrozen(s); });
  if (frozen == lost.end()) {
    return absl::OkStatus();
  }
  const Point<3> at = frame_.Unscaled(spatial_->PointAt(frozen->curve, 0.5 * (frozen->from_arc + frozen->to_arc)));
  return absl::InvalidArgumentError(
      absl::StrFormat("triangles: a crease near an angle below %g degrees is lost at (%.6g, %.6g, %.6g); expected a "
                      "shorter surface.edge_length, or an edge that is rounded off",
                      kAcuteAngle, at[0], at[1], at[2]));
}

absl::Status SpaceMesher::CheckFeasibleHere(const MeshParameters& parameters) const {
  WELLSPACE_RETURN_IF_ERROR(CheckVolumeFeasible(parameters));
  return CheckAreaFeasible(parameters);
}

// Every point of a tetrahedron is within its circumradius of a vertex: balls of the largest one cover the domain.
absl::Status SpaceMesher::CheckVolumeFeasible(const MeshParameters& parameters) const {
  const double radius = CriteriaOf(parameters).sizes.max_circumradius() / frame_.scale;
  const double volume = figures_of_input_.report.volume.value_or(0);
  const double least = volume / (4 * std::numbers::pi / 3 * radius * radius * radius);
  const uint64_t most = VertexBudget(parameters);
  if (least <= static_cast<double>(most)) {
    return absl::OkStatus();
  }
  return TooFineError(absl::StrFormat(
      "a circumradius of at most %g takes at least %.3g vertices in a volume of %g, and max_vertices is %d; expected "
      "%.3g or more",
      radius, least, volume, most, std::cbrt(volume / (4 * std::numbers::pi / 3 * static_cast<double>(most)))));
}

// Along each axis the surface lies over at least the volume through the extent of it. Each of its points is within the
// tolerance of a facet, whose points are within its circumradius of a vertex, unless they are nearer than the least
// size: discs of the sum cover that area.
absl::Status SpaceMesher::CheckAreaFeasible(const MeshParameters& parameters) const {
  const SurfaceReport& report = figures_of_input_.report;
  double area = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double extent = meshed_box_.high[axis] - meshed_box_.low[axis];
    area = extent > 0 ? std::max(area, report.volume.value_or(0) / extent) : area;
  }
  const SurfaceCriteria criteria = SurfaceCriteriaOf(parameters, default_tolerance_, 1);
  if (std::isinf(criteria.facet_radius)) {
    return absl::OkStatus();
  }
  const double slack = criteria.tolerance + criteria.min_size;
  const double radius = std::max(criteria.facet_radius, criteria.min_size) + slack;
  const double least = area / (std::numbers::pi * radius * radius);
  const uint64_t most = VertexBudget(parameters);
  if (least <= static_cast<double>(most)) {
    return absl::OkStatus();
  }
  const double per_radius = CurveEdgeOf(parameters) / criteria.facet_radius;
  const double expected = std::sqrt(area / (std::numbers::pi * static_cast<double>(most))) - slack;
  return TooFineError(absl::StrFormat(
      "edges of facets of at most %g take at least %.3g vertices on a surface over an area of %g, and max_vertices is "
      "%d; expected an edge_length, surface.edge_length and max_circumradius of at least %.3g",
      CurveEdgeOf(parameters), least, area, most, per_radius * expected));
}

// The box is far larger than the solids that are meshed, and sizes count in these alone: of the vertices that were
// predicted for the box the share of their volume counts, and beside it those that facets of their length take on the
// area. Where nothing says how long, the prediction for the box is the least.
absl::Status SpaceMesher::FitToSurface(const MeshParameters& parameters, const SizeField<3>& sizes,
                                       const RunContext& context, MeshEstimate& estimate) const {
  const SurfaceReport& report = figures_of_input_.report;
  double box = 1;
  for (int axis = 0; axis < 3; ++axis) {
    box *= frame_.box.high[axis] - frame_.box.low[axis];
  }
  const SurfaceCriteria surface = SurfaceCriteriaOf(parameters, default_tolerance_, frame_.scale);
  const double radius = surface.facet_radius / surface.facet_share;
  const bool is_open = std::isinf(radius) && sizes.IsUnbounded();
  double on_area = 0;
  if (!is_open) {
    WELLSPACE_ASSIGN_OR_RETURN(on_area, FacetVertices(*spatial_, sizes, radius, context));
    on_area /= surface.facet_share * surface.facet_share;
  }
  const double in_volume = static_cast<double>(estimate.vertices) * report.volume.value_or(box) / box;
  const double vertices = kEstimateRoom * (in_volume + on_area) + structure_.vertex_count();
  const double predicted = std::max(1.0, static_cast<double>(estimate.vertices));
  const double share = std::max(vertices / predicted, is_open ? 1.0 : 0.0);
  estimate.simplices = SaturatedCount(share * static_cast<double>(estimate.simplices));
  estimate.memory_bytes =
      SaturatedCount(share * static_cast<double>(estimate.memory_bytes) + static_cast<double>(spatial_->MemoryBytes()));
  estimate.vertices = SaturatedCount(share * predicted);
  return absl::OkStatus();
}

absl::Status SpaceMesher::AddToEstimate(const MeshParameters& parameters, const MeshCriteria<3>& criteria,
                                        const RunContext& context, MeshEstimate& estimate) const {
  WELLSPACE_RETURN_IF_ERROR(FitToSurface(parameters, criteria.sizes, context, estimate));
  if (parameters.min_dihedral.value_or(DefaultMinDihedral(3)) > 0) {
    AddSliverStage<3>(estimate);
  }
  return absl::OkStatus();
}

// Adds the samples that curvature and thickness ask for.
absl::StatusOr<MeshParameters> SpaceMesher::WithSizesOfDomain(const MeshParameters& parameters,
                                                              const RunContext& context) const {
  const SurfaceCriteria criteria = SurfaceCriteriaOf(parameters, default_tolerance_, frame_.scale);
  const SurfaceSizeDemands demands{
      .curvature_elements = parameters.surface.curvature_elements,
      .thickness_layers = parameters.surface.thickness_layers,
      .min_size = std::max(criteria.min_size, frame_.MinEdge()),
      .most_edge = criteria.facet_radius / kRadiusPerEdge,
      .gradation = parameters.gradation > 0 ? parameters.gradation : kDefaultSampleGradation,
      .max_vertices = VertexBudget(parameters),
  };
  MeshParameters asked = parameters;
  if (demands.IsNone()) {
    return asked;
  }
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<SizedPlace<Point<3>>> found,
                             FindSurfaceSizes(*spatial_, demands, memory_bytes(), context));
  const size_t given = parameters.size_samples == nullptr ? 0 : parameters.size_samples->sizes.size();
  WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(memory_bytes() + found.size() * sizeof(found[0]) +
                                                (given + found.size()) * 4 * sizeof(double)));
  auto samples = std::make_shared<SizeSamples>();
  samples->points.reserve(3 * (given + found.size()));
  samples->sizes.reserve(given + found.size());
  if (parameters.size_samples != nullptr) {
    samples->points.assign(parameters.size_samples->points.begin(), parameters.size_samples->points.end());
    samples->sizes.assign(parameters.size_samples->sizes.begin(), parameters.size_samples->sizes.end());
    samples->measure = parameters.size_samples->measure;
    if (samples->measure == SizeMeasure::kEdgeLength) {
      samples->measure = SizeMeasure::kCircumradius;
      for (double& size : samples->sizes) {
        size = CircumradiusOf(size, 3);
      }
    }
  }
  for (size_t i = 0; i < found.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
    const Point<3> at = frame_.Unscaled(found[i].place);
    samples->points.insert(samples->points.end(), at.begin(), at.end());
    samples->sizes.push_back(found[i].size / frame_.scale);
  }
  asked.size_samples = samples->sizes.empty() ? nullptr : std::move(samples);
  return asked;
}

}  // namespace wellspace::core
