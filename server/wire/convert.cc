#include "server/wire/convert.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/input/domain_parameters.h"
#include "core/input/space_parameters.h"
#include "google/protobuf/descriptor.h"
#include "google/protobuf/message.h"
#include "google/protobuf/unknown_field_set.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

absl::Status InvalidParameter(const std::string& message, const std::string& field) {
  return MakeError(v1::ERROR_REASON_INVALID_PARAMETERS, message, absl::StrCat("parameters.", field));
}

// The path that the core's `message` begins with, up to its colon, if it leads deeper into `field`; otherwise `field`.
std::string DeepestField(const std::string& message, const std::string& field) {
  const std::string path = message.substr(0, message.find(':'));
  const bool is_deeper = path.size() > field.size() && path.compare(0, field.size(), field) == 0 &&
                         (path[field.size()] == '[' || path[field.size()] == '.');
  return is_deeper ? path : field;
}

// Validates the fields set in `parameters` so far, blaming `field`, or a part of it, as the one that was set last.
absl::Status Validate(const core::MeshParameters& parameters, const std::string& field) {
  const absl::Status status = core::ValidateParameters(parameters);
  if (status.ok()) {
    return absl::OkStatus();
  }
  const std::string message(status.message());
  return InvalidParameter(message, DeepestField(message, field));
}

// Refuses a 0 that was sent for a field that cannot be 0: in the core it would stand for the default.
template <typename Number>
absl::Status RefuseZero(bool is_sent, Number value, const char* field, const char* accepted) {
  return is_sent && value == 0 ? InvalidParameter(absl::StrCat(field, ": 0 is not allowed; expected ", accepted,
                                                               ", or nothing for ", "the default"),
                                                  field)
                               : absl::OkStatus();
}

absl::Status RefuseZeros(const v1::MeshParameters& message) {
  constexpr char kLength[] = "a number above 0";
  constexpr char kCount[] = "at least 1";
  WELLSPACE_RETURN_IF_ERROR(RefuseZero(message.has_rho(), message.rho(), "rho", kLength));
  WELLSPACE_RETURN_IF_ERROR(
      RefuseZero(message.has_max_circumradius(), message.max_circumradius(), "max_circumradius", kLength));
  WELLSPACE_RETURN_IF_ERROR(RefuseZero(message.has_edge_length(), message.edge_length(), "edge_length", kLength));
  WELLSPACE_RETURN_IF_ERROR(
      RefuseZero(message.has_gradation(), message.gradation(), "gradation", "a number above 0 and at most 1"));
  WELLSPACE_RETURN_IF_ERROR(RefuseZero(message.has_max_vertices(), message.max_vertices(), "max_vertices", kCount));
  return RefuseZero(message.has_threads(), message.threads(), "threads", kCount);
}

// Nothing for one of a newer client.
std::optional<core::Criterion> CriterionFromProto(v1::Criterion criterion) {
  switch (criterion) {
    case v1::CRITERION_UNSPECIFIED:
    case v1::CRITERION_RADIUS_EDGE:
      return core::Criterion::kRadiusEdge;
    case v1::CRITERION_WELL_SPACED:
      return core::Criterion::kWellSpaced;
    default:
      return std::nullopt;
  }
}

core::SizeBox SizeBoxFromProto(const v1::SizeBox& message) {
  return core::SizeBox{.low = {message.low().begin(), message.low().end()},
                       .high = {message.high().begin(), message.high().end()},
                       .max_circumradius = message.max_circumradius()};
}

v1::SliverReason ReasonToProto(core::SliverReason reason) {
  switch (reason) {
    case core::SliverReason::kDemands:
      return v1::SLIVER_REASON_DEMANDS;
    case core::SliverReason::kAngle:
      return v1::SLIVER_REASON_ANGLE;
    case core::SliverReason::kWork:
      return v1::SLIVER_REASON_WORK;
  }
  return v1::SLIVER_REASON_UNSPECIFIED;
}

void SetLeftSlivers(const core::MeshStatistics& statistics, v1::SliverStatistics& message) {
  const auto left_by = [&](core::SliverReason reason) {
    return statistics.slivers_left_by[static_cast<size_t>(reason)];
  };
  message.set_operations(statistics.sliver_operations);
  message.set_left_by_demands(left_by(core::SliverReason::kDemands));
  message.set_left_by_angle(left_by(core::SliverReason::kAngle));
  message.set_left_by_work(left_by(core::SliverReason::kWork));
  for (const core::LeftSliver& sliver : statistics.flattest_left) {
    v1::LeftSliver* left = message.add_flattest_left();
    left->mutable_vertices()->Add(sliver.vertices.begin(), sliver.vertices.end());
    left->set_min_dihedral_deg(sliver.min_angle_deg);
    left->set_reason(ReasonToProto(sliver.reason));
  }
}

void SetDomain(const core::DomainStatistics& domain, v1::DomainStatistics& message) {
  message.set_unmeshed_points(domain.unmeshed_points);
  message.set_segments(domain.segments);
  message.set_subsegments(domain.subsegments);
  message.set_dropped_segments(domain.dropped_segments);
  message.set_touching_points(domain.touching_points);
  message.set_crossings(domain.crossings);
  message.set_near_points(domain.near_points);
  message.set_exempt_simplices(domain.exempt_simplices);
  message.set_min_input_angle_deg(domain.min_input_angle_deg);
  message.set_unused_seeds(domain.unused_seeds);
  message.set_first_unused_seed(domain.first_unused_seed);
}

void SetSurface(const core::SurfaceStatistics& surface, v1::SurfaceStatistics& message) {
  message.set_triangles(surface.triangles);
  message.set_welded_points(surface.welded_points);
  message.set_dropped_triangles(surface.dropped_triangles);
  message.set_flipped_triangles(surface.flipped_triangles);
  message.set_unmeshed_points(surface.unmeshed_points);
  message.set_patches(surface.patches);
  message.set_curves(surface.curves);
  message.set_corners(surface.corners);
  message.set_solids(surface.solids);
  message.set_facets(surface.facets);
  message.set_ridges(surface.ridges);
  message.set_lost_ridges(surface.lost_ridges);
  message.set_exempt_simplices(surface.exempt_simplices);
  message.set_acute_curves(surface.acute_curves);
  message.set_tube_simplices(surface.tube_simplices);
  message.set_min_angle_outside_deg(surface.min_angle_outside_deg);
  message.set_unused_seeds(surface.unused_seeds);
  message.set_first_unused_seed(surface.first_unused_seed);
  message.set_min_facet_angle_deg(surface.min_facet_angle_deg);
  message.set_deviation_of_facets(surface.deviation_of_facets);
  message.set_deviation_of_surface(surface.deviation_of_surface);
  message.set_lost_area(surface.lost_area);
  message.set_cut_triangles(surface.cut_triangles);
  message.set_outside_triangles(surface.outside_triangles);
  message.mutable_volumes()->Assign(surface.volumes.begin(), surface.volumes.end());
}

v1::MeshStatistics StatisticsToProto(const core::MeshStatistics& statistics) {
  v1::MeshStatistics message;
  message.set_input_points(statistics.input_points);
  message.set_duplicates(statistics.duplicates);
  message.set_merged_points(statistics.merged_points);
  if (statistics.domain.has_value()) {
    SetDomain(*statistics.domain, *message.mutable_domain());
  }
  if (statistics.surface.has_value()) {
    SetSurface(*statistics.surface, *message.mutable_surface());
  }
  message.set_vertices(statistics.vertices);
  message.set_simplices(statistics.simplices);
  message.set_max_radius_edge(statistics.max_radius_edge);
  message.set_min_angle_deg(statistics.min_angle_deg);
  message.set_peak_memory_bytes(statistics.peak_memory_bytes);
  message.set_triangulation(statistics.weighted_vertices > 0 ? v1::TRIANGULATION_REGULAR : v1::TRIANGULATION_DELAUNAY);

  v1::PhaseSeconds* seconds = message.mutable_seconds();
  seconds->set_tree(statistics.tree_seconds);
  seconds->set_refinement(statistics.refinement_seconds);
  seconds->set_simplices(statistics.simplices_seconds);
  seconds->set_slivers(statistics.sliver_seconds);
  seconds->set_total(statistics.total_seconds);

  if (statistics.slivers_wanted) {
    v1::SliverStatistics* slivers = message.mutable_slivers();
    slivers->set_found(statistics.slivers);
    slivers->set_left(statistics.slivers_left);
    slivers->set_moves(statistics.sliver_moves);
    slivers->set_added_vertices(statistics.sliver_vertices);
    slivers->set_weighted_vertices(statistics.weighted_vertices);
    slivers->set_min_angle_before_deg(statistics.min_angle_before_deg);
    SetLeftSlivers(statistics, *slivers);
  }

  v1::OperationCounters* counters = message.mutable_counters();
  counters->set_tree_leaves(statistics.tree_leaves);
  counters->set_cells_computed(statistics.cells_computed);
  counters->set_leaves_visited(statistics.leaves_visited);
  counters->set_vertices_visited(statistics.vertices_visited);
  counters->set_cuts(statistics.cuts);
  counters->set_max_leaves_visited(statistics.max_leaves_visited);
  counters->set_stars_computed(statistics.stars_computed);
  counters->set_star_leaves_visited(statistics.star_leaves_visited);
  counters->set_star_vertices_visited(statistics.star_vertices_visited);
  counters->set_star_cuts(statistics.star_cuts);
  counters->set_max_star_leaves_visited(statistics.max_star_leaves_visited);
  counters->set_exact_predicates(statistics.exact_predicates);
  counters->set_perturbed_predicates(statistics.perturbed_predicates);
  return message;
}

// Translates and validates the demands on the surface.
absl::Status TakeSurface(const v1::SurfaceParameters& message, core::MeshParameters& parameters) {
  core::SurfaceParameters& surface = parameters.surface;
  const auto take = [&parameters](bool is_sent, double value, const char* field, double& into) -> absl::Status {
    WELLSPACE_RETURN_IF_ERROR(RefuseZero(is_sent, value, field, "a number above 0"));
    into = value;
    return Validate(parameters, field);
  };
  WELLSPACE_RETURN_IF_ERROR(take(message.has_tolerance(), message.tolerance(), "surface.tolerance", surface.tolerance));
  if (message.has_min_facet_angle()) {
    surface.min_facet_angle = message.min_facet_angle();
    WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "surface.min_facet_angle"));
  }
  WELLSPACE_RETURN_IF_ERROR(
      take(message.has_edge_length(), message.edge_length(), "surface.edge_length", surface.edge_length));
  WELLSPACE_RETURN_IF_ERROR(take(message.has_min_size(), message.min_size(), "surface.min_size", surface.min_size));
  WELLSPACE_RETURN_IF_ERROR(
      take(message.has_outside_rho(), message.outside_rho(), "surface.outside_rho", surface.outside_rho));
  WELLSPACE_RETURN_IF_ERROR(take(message.has_curvature_elements(), message.curvature_elements(),
                                 "surface.curvature_elements", surface.curvature_elements));
  return take(message.has_thickness_layers(), message.thickness_layers(), "surface.thickness_layers",
              surface.thickness_layers);
}

void SetSurface(const core::SurfaceParameters& surface, v1::MeshParameters& message) {
  if (surface == core::SurfaceParameters()) {
    return;
  }
  v1::SurfaceParameters& part = *message.mutable_surface();
  const auto set = [&part](double value, auto setter) {
    if (value != 0) {
      (part.*setter)(value);
    }
  };
  set(surface.tolerance, &v1::SurfaceParameters::set_tolerance);
  if (surface.min_facet_angle.has_value()) {
    part.set_min_facet_angle(*surface.min_facet_angle);
  }
  set(surface.edge_length, &v1::SurfaceParameters::set_edge_length);
  set(surface.min_size, &v1::SurfaceParameters::set_min_size);
  set(surface.outside_rho, &v1::SurfaceParameters::set_outside_rho);
  set(surface.curvature_elements, &v1::SurfaceParameters::set_curvature_elements);
  set(surface.thickness_layers, &v1::SurfaceParameters::set_thickness_layers);
}

// Whether a message, or one in it, has fields that this program's definition of it has not.
bool HasUnknownFields(const google::protobuf::Message& message) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  if (!reflection.GetUnknownFields(message).empty()) {
    return true;
  }
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  return std::ranges::any_of(fields, [&](const google::protobuf::FieldDescriptor* field) {
    if (field->cpp_type() != google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE) {
      return false;
    }
    if (!field->is_repeated()) {
      return HasUnknownFields(reflection.GetMessage(message, field));
    }
    for (int i = 0; i < reflection.FieldSize(message, field); ++i) {
      if (HasUnknownFields(reflection.GetRepeatedMessage(message, field, i))) {
        return true;
      }
    }
    return false;
  });
}

}  // namespace

absl::StatusOr<core::MeshParameters> ParametersFromProto(const v1::MeshParameters& message,
                                                         const ServiceOptions& options) {
  // The fields are set one by one, the others still at their defaults, so that the core's validation, the only one
  // there is, shows which of them it refuses.
  core::MeshParameters parameters;
  parameters.dimension = message.dimension();
  WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "dimension"));
  WELLSPACE_RETURN_IF_ERROR(RefuseZeros(message));
  const std::optional<core::Criterion> criterion = CriterionFromProto(message.criterion());
  if (!criterion.has_value()) {
    return InvalidParameter(
        absl::StrCat("criterion: ", static_cast<int>(message.criterion()), " is not known; ",
                     static_cast<int>(v1::CRITERION_RADIUS_EDGE), " (radius-edge) and ",
                     static_cast<int>(v1::CRITERION_WELL_SPACED), " (well-spaced) are, and 0 for the default"),
        "criterion");
  }
  parameters.criterion = *criterion;
  parameters.rho = message.rho();
  WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "rho"));
  if (message.has_margin()) {
    parameters.margin = message.margin();
    WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "margin"));
  }
  if (message.has_domain()) {
    // An empty domain would pass for an absent one in the core.
    if (message.domain().low().empty() || message.domain().high().empty()) {
      return InvalidParameter(
          absl::StrCat("the domain has ", message.domain().low_size(), " low and ", message.domain().high_size(),
                       " high coordinates; expected ", message.dimension(), " of each, or no domain"),
          "domain");
    }
    parameters.domain_low.assign(message.domain().low().begin(), message.domain().low().end());
    parameters.domain_high.assign(message.domain().high().begin(), message.domain().high().end());
    WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "domain"));
  }
  parameters.max_circumradius = message.max_circumradius();
  WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "max_circumradius"));
  parameters.edge_length = message.edge_length();
  WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "edge_length"));
  parameters.gradation = message.gradation();
  WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "gradation"));
  // At once: one by one would look at many boxes many times.
  for (const v1::SizeBox& box : message.size_boxes()) {
    parameters.size_boxes.push_back(SizeBoxFromProto(box));
  }
  WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "size_boxes"));
  if (message.has_min_dihedral()) {
    parameters.min_dihedral = message.min_dihedral();
    WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "min_dihedral"));
  }
  parameters.periodic_axes.assign(message.periodic_axes().begin(), message.periodic_axes().end());
  WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "periodic_axes"));
  std::sort(parameters.periodic_axes.begin(), parameters.periodic_axes.end());
  parameters.pump_weights = message.pump_weights();
  parameters.keep_vertices = message.keep_vertices();
  WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "pump_weights"));
  parameters.merge_distance = message.merge_distance();
  WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "merge_distance"));
  WELLSPACE_RETURN_IF_ERROR(TakeSurface(message.surface(), parameters));
  if (message.has_threads()) {
    parameters.threads = message.threads();
    WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "threads"));
  }
  parameters.threads = std::min(parameters.threads, options.max_threads);
  if (message.max_vertices() > options.max_vertices) {
    return InvalidParameter(absl::StrCat("max_vertices is ", message.max_vertices(), "; this server accepts at most ",
                                         options.max_vertices, ", or nothing for the default"),
                            "max_vertices");
  }
  parameters.max_vertices =
      !message.has_max_vertices() ? std::min(options.max_vertices, core::kDefaultMaxVertices) : message.max_vertices();
  WELLSPACE_RETURN_IF_ERROR(Validate(parameters, "max_vertices"));
  return parameters;
}

absl::Status ValidateFor(const core::Input& input, const core::MeshParameters& parameters) {
  if (!input.surface.has_value() && parameters.surface != core::SurfaceParameters()) {
    return InvalidParameter("surface: there are no triangles that it could be about; send some, or leave it out",
                            "surface");
  }
  const absl::Status status = input.features.has_value()  ? core::ValidateDomainParameters(parameters, *input.features)
                              : input.surface.has_value() ? core::ValidateSpaceParameters(parameters, *input.surface)
                                                          : absl::OkStatus();
  if (status.ok()) {
    return status;
  }
  const std::string message(status.message());
  return InvalidParameter(message, message.substr(0, message.find(':')));
}

absl::StatusOr<core::MeshParameters> ParametersFromRecord(const v1::MeshParameters& message) {
  if (HasUnknownFields(message)) {
    return InvalidParameter("they have a field of a later version of Wellspace", "parameters");
  }
  ServiceOptions unlimited;
  unlimited.max_threads = std::numeric_limits<int>::max();
  unlimited.max_vertices = core::kMaxVertices;
  return ParametersFromProto(message, unlimited);
}

v1::MeshParameters ParametersToProto(const core::MeshParameters& parameters) {
  v1::MeshParameters message;
  message.set_dimension(parameters.dimension);
  message.set_rho(parameters.rho == 0 ? core::DefaultRho(parameters.dimension) : parameters.rho);
  switch (parameters.criterion) {
    case core::Criterion::kRadiusEdge:
      message.set_criterion(v1::CRITERION_RADIUS_EDGE);
      break;
    case core::Criterion::kWellSpaced:
      message.set_criterion(v1::CRITERION_WELL_SPACED);
      break;
  }
  if (parameters.domain_low.empty()) {
    message.set_margin(parameters.margin);
  } else {
    message.mutable_domain()->mutable_low()->Assign(parameters.domain_low.begin(), parameters.domain_low.end());
    message.mutable_domain()->mutable_high()->Assign(parameters.domain_high.begin(), parameters.domain_high.end());
  }
  if (parameters.max_circumradius != 0) {
    message.set_max_circumradius(parameters.max_circumradius);
  }
  if (parameters.edge_length != 0) {
    message.set_edge_length(parameters.edge_length);
  }
  if (parameters.gradation != 0) {
    message.set_gradation(parameters.gradation);
  }
  for (const core::SizeBox& box : parameters.size_boxes) {
    v1::SizeBox* size_box = message.add_size_boxes();
    size_box->mutable_low()->Assign(box.low.begin(), box.low.end());
    size_box->mutable_high()->Assign(box.high.begin(), box.high.end());
    size_box->set_max_circumradius(box.max_circumradius);
  }
  message.set_min_dihedral(parameters.min_dihedral.value_or(core::DefaultMinDihedral(parameters.dimension)));
  message.set_pump_weights(parameters.pump_weights);
  if (parameters.merge_distance != 0) {
    message.set_merge_distance(parameters.merge_distance);
  }
  message.mutable_periodic_axes()->Assign(parameters.periodic_axes.begin(), parameters.periodic_axes.end());
  message.set_keep_vertices(parameters.keep_vertices);
  SetSurface(parameters.surface, message);
  if (parameters.max_vertices != 0) {
    message.set_max_vertices(parameters.max_vertices);
  }
  message.set_threads(parameters.threads);
  return message;
}

google::protobuf::Timestamp TimeToProto(absl::Time time) {
  google::protobuf::Timestamp message;
  const int64_t seconds = absl::ToUnixSeconds(time);
  message.set_seconds(seconds);
  message.set_nanos(static_cast<int32_t>(absl::ToInt64Nanoseconds(time - absl::FromUnixSeconds(seconds))));
  return message;
}

v1::MeshMetadata MetadataToProto(const core::Mesh& mesh, uint64_t chunk_count, bool with_boundary) {
  v1::MeshMetadata metadata;
  metadata.set_dimension(mesh.dimension);
  metadata.mutable_domain()->mutable_low()->Assign(mesh.domain_low.begin(), mesh.domain_low.end());
  metadata.mutable_domain()->mutable_high()->Assign(mesh.domain_high.begin(), mesh.domain_high.end());
  metadata.set_vertex_count(mesh.vertex_count());
  metadata.set_simplex_count(mesh.simplex_count());
  metadata.set_input_point_count(mesh.input_vertex.size());
  metadata.set_chunk_count(chunk_count);
  metadata.set_has_weights(!mesh.weights.empty());
  metadata.set_moved_vertex_count(mesh.moved_vertices.size());
  *metadata.mutable_statistics() = StatisticsToProto(mesh.statistics);
  for (const core::BoundaryPart& part : mesh.boundary) {
    v1::BoundaryPart& message = *metadata.add_boundary();
    message.set_tag(part.tag);
    message.set_name(part.name);
    message.set_facet_count(part.facets);
  }
  metadata.set_facet_count(mesh.facet_count());
  for (const core::Region& region : mesh.regions) {
    v1::Region& message = *metadata.add_regions();
    message.set_id(region.id);
    message.set_name(region.name);
  }
  metadata.set_has_simplex_regions(!mesh.simplex_regions.empty());
  metadata.set_has_vertex_marks(!mesh.vertex_tags.empty());
  metadata.set_ridge_count(mesh.ridges.size() / 2);
  if (!with_boundary) {
    ClearBoundary(metadata);
  }
  return metadata;
}

void ClearBoundary(v1::MeshMetadata& metadata) {
  metadata.clear_boundary();
  metadata.clear_facet_count();
  metadata.clear_regions();
  metadata.clear_has_simplex_regions();
  metadata.clear_has_vertex_marks();
  metadata.clear_ridge_count();
}

v1::EstimateMeshResponse EstimateToProto(const core::MeshEstimate& estimate) {
  v1::EstimateMeshResponse message;
  message.set_vertices(estimate.vertices);
  message.set_simplices(estimate.simplices);
  message.set_memory_bytes(estimate.memory_bytes);
  message.set_tree_leaves(estimate.tree_leaves);
  return message;
}

google::protobuf::Duration DurationToProto(absl::Duration duration) {
  google::protobuf::Duration message;
  message.set_seconds(absl::IDivDuration(duration, absl::Seconds(1), &duration));
  message.set_nanos(static_cast<int32_t>(absl::ToInt64Nanoseconds(duration)));
  return message;
}

v1::Phase PhaseToProto(core::Phase phase) {
  switch (phase) {
    case core::Phase::kWaiting:
      return v1::PHASE_WAITING;
    case core::Phase::kTree:
      return v1::PHASE_TREE;
    case core::Phase::kRefinement:
      return v1::PHASE_REFINEMENT;
    case core::Phase::kSimplices:
      return v1::PHASE_SIMPLICES;
    case core::Phase::kSlivers:
      return v1::PHASE_SLIVERS;
    case core::Phase::kDone:
      return v1::PHASE_DONE;
  }
  return v1::PHASE_UNSPECIFIED;
}

}  // namespace wellspace::server
