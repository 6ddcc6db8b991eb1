#include "client/grpc/convert.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/error_details.h"
#include "client/grpc/feature_messages.h"
#include "client/grpc/mesh_values.h"
#include "client/printable.h"
#include "google/protobuf/descriptor.h"
#include "google/protobuf/message.h"

namespace wellspace::client {
namespace {

const char* PhaseName(v1::Phase phase) {
  switch (phase) {
    case v1::PHASE_WAITING:
      return "waiting";
    case v1::PHASE_TREE:
      return "tree";
    case v1::PHASE_REFINEMENT:
      return "refinement";
    case v1::PHASE_SIMPLICES:
      return "simplices";
    case v1::PHASE_SLIVERS:
      return "slivers";
    case v1::PHASE_DONE:
      return "done";
    default:
      return "unknown";  // of a newer server
  }
}

SessionState StateFromProto(v1::Session::State state) {
  switch (state) {
    case v1::Session::STATE_OPEN:
      return SessionState::kOpen;
    case v1::Session::STATE_REFINING:
      return SessionState::kRefining;
    case v1::Session::STATE_READY:
      return SessionState::kReady;
    default:
      return SessionState::kUnknown;
  }
}

PartNames NamesFromProto(const v1::PartNames& message) {
  return {.markers = {message.markers().begin(), message.markers().end()},
          .regions = {message.regions().begin(), message.regions().end()}};
}

// Without triangles and seeds.
SurfaceFeatures SurfaceFromProto(const v1::SurfaceOptions& message) {
  const auto get = [](bool is_given, double value) { return is_given ? std::optional(value) : std::nullopt; };
  SurfaceFeatures surface;
  surface.solids = message.solids() == v1::SOLID_RULE_BOX       ? SolidRule::kBox
                   : message.solids() == v1::SOLID_RULE_HOLES   ? SolidRule::kHoles
                   : message.solids() == v1::SOLID_RULE_WINDING ? SolidRule::kWinding
                                                                : SolidRule::kEvenOdd;
  surface.crease_angle = get(message.has_crease_angle(), message.crease_angle());
  surface.weld = get(message.has_weld(), message.weld());
  surface.min_patch = get(message.has_min_patch(), message.min_patch());
  surface.resolution = get(message.has_resolution(), message.resolution());
  surface.keeps_points = message.keep_points();
  if (message.box().low_size() == 3 && message.box().high_size() == 3) {
    surface.box.emplace();
    std::copy(message.box().low().begin(), message.box().low().end(), surface.box->begin());
    std::copy(message.box().high().begin(), message.box().high().end(), surface.box->begin() + 3);
  }
  return surface;
}

constexpr std::pair<OperationState, v1::Operation::State> kStates[] = {
    {OperationState::kUnknown, v1::Operation::STATE_UNSPECIFIED},
    {OperationState::kQueued, v1::Operation::STATE_QUEUED},
    {OperationState::kRunning, v1::Operation::STATE_RUNNING},
    {OperationState::kSucceeded, v1::Operation::STATE_SUCCEEDED},
    {OperationState::kFailed, v1::Operation::STATE_FAILED},
    {OperationState::kCancelled, v1::Operation::STATE_CANCELLED}};

OperationState StateFromProto(v1::Operation::State state) {
  const auto* const found = std::ranges::find(kStates, state, [](const auto& pair) { return pair.second; });
  return found == std::end(kStates) ? OperationState::kUnknown : found->first;
}

absl::Time TimeFromProto(const google::protobuf::Timestamp& message) {
  return absl::FromUnixSeconds(message.seconds()) + absl::Nanoseconds(message.nanos());
}

template <typename T>
std::vector<T> VectorOf(const google::protobuf::RepeatedField<T>& values) {
  return std::vector<T>(values.begin(), values.end());
}

// The values of a message whose fields are all numbers of type T, by the names of the fields: a client shows counters
// that it does not know by name.
std::map<std::string, uint64_t> CountersByName(const v1::OperationCounters& counters) {
  std::map<std::string, uint64_t> by_name;
  const google::protobuf::Descriptor* descriptor = counters.GetDescriptor();
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const google::protobuf::FieldDescriptor* field = descriptor->field(i);
    by_name[field->name()] = counters.GetReflection()->GetUInt64(counters, field);
  }
  return by_name;
}

Triangulation TriangulationFromProto(v1::Triangulation triangulation) {
  switch (triangulation) {
    case v1::TRIANGULATION_DELAUNAY:
      return Triangulation::kDelaunay;
    case v1::TRIANGULATION_REGULAR:
      return Triangulation::kRegular;
    default:
      return Triangulation::kUnknown;
  }
}

SliverReason ReasonFromProto(v1::SliverReason reason) {
  switch (reason) {
    case v1::SLIVER_REASON_DEMANDS:
      return SliverReason::kDemands;
    case v1::SLIVER_REASON_ANGLE:
      return SliverReason::kAngle;
    case v1::SLIVER_REASON_WORK:
      return SliverReason::kWork;
    default:
      return SliverReason::kUnknown;  // of a newer server
  }
}

SurfaceStatistics SurfaceFromProto(const v1::SurfaceStatistics& surface) {
  return {.triangles = surface.triangles(),
          .welded_points = surface.welded_points(),
          .dropped_triangles = surface.dropped_triangles(),
          .flipped_triangles = surface.flipped_triangles(),
          .unmeshed_points = surface.unmeshed_points(),
          .patches = surface.patches(),
          .curves = surface.curves(),
          .corners = surface.corners(),
          .solids = surface.solids(),
          .facets = surface.facets(),
          .ridges = surface.ridges(),
          .lost_ridges = surface.lost_ridges(),
          .exempt_simplices = surface.exempt_simplices(),
          .acute_curves = surface.acute_curves(),
          .tube_simplices = surface.tube_simplices(),
          .min_angle_outside_deg = surface.min_angle_outside_deg(),
          .unused_seeds = surface.unused_seeds(),
          .first_unused_seed = surface.first_unused_seed(),
          .min_facet_angle_deg = surface.min_facet_angle_deg(),
          .deviation_of_facets = surface.deviation_of_facets(),
          .deviation_of_surface = surface.deviation_of_surface(),
          .lost_area = surface.lost_area(),
          .cut_triangles = surface.cut_triangles(),
          .outside_triangles = surface.outside_triangles(),
          .volumes = VectorOf(surface.volumes())};
}

MeshStatistics StatisticsFromProto(const v1::MeshStatistics& message) {
  MeshStatistics statistics;
  statistics.input_points = message.input_points();
  statistics.duplicates = message.duplicates();
  statistics.merged_points = message.merged_points();
  if (message.has_domain()) {
    const v1::DomainStatistics& domain = message.domain();
    statistics.domain = {.unmeshed_points = domain.unmeshed_points(),
                         .segments = domain.segments(),
                         .subsegments = domain.subsegments(),
                         .dropped_segments = domain.dropped_segments(),
                         .touching_points = domain.touching_points(),
                         .crossings = domain.crossings(),
                         .near_points = domain.near_points(),
                         .exempt_simplices = domain.exempt_simplices(),
                         .min_input_angle_deg = domain.min_input_angle_deg(),
                         .unused_seeds = domain.unused_seeds(),
                         .first_unused_seed = domain.first_unused_seed()};
  }
  if (message.has_surface()) {
    statistics.surface = SurfaceFromProto(message.surface());
  }
  statistics.vertices = message.vertices();
  statistics.simplices = message.simplices();
  statistics.max_radius_edge = message.max_radius_edge();
  statistics.min_angle_deg = message.min_angle_deg();
  statistics.seconds["tree"] = message.seconds().tree();
  statistics.seconds["refinement"] = message.seconds().refinement();
  statistics.seconds["simplices"] = message.seconds().simplices();
  statistics.seconds["slivers"] = message.seconds().slivers();
  statistics.seconds["total"] = message.seconds().total();
  statistics.triangulation = TriangulationFromProto(message.triangulation());
  if (message.has_slivers()) {
    const v1::SliverStatistics& slivers = message.slivers();
    statistics.slivers = {.found = slivers.found(),
                          .left = slivers.left(),
                          .moves = slivers.moves(),
                          .added_vertices = slivers.added_vertices(),
                          .weighted_vertices = slivers.weighted_vertices(),
                          .min_angle_before_deg = slivers.min_angle_before_deg(),
                          .operations = slivers.operations(),
                          .left_by_demands = slivers.left_by_demands(),
                          .left_by_angle = slivers.left_by_angle(),
                          .left_by_work = slivers.left_by_work(),
                          .flattest_left = {}};
    for (const v1::LeftSliver& left : slivers.flattest_left()) {
      statistics.slivers->flattest_left.push_back({.vertices = {left.vertices().begin(), left.vertices().end()},
                                                   .min_dihedral_deg = left.min_dihedral_deg(),
                                                   .reason = ReasonFromProto(left.reason())});
    }
  }
  statistics.peak_memory_bytes = message.peak_memory_bytes();
  statistics.counters = CountersByName(message.counters());
  return statistics;
}

void SetSurface(const SurfaceParameters& surface, v1::MeshParameters* parameters) {
  if (surface == SurfaceParameters()) {
    return;
  }
  v1::SurfaceParameters& message = *parameters->mutable_surface();
  const auto set = [&message](const std::optional<double>& value, auto setter) {
    if (value.has_value()) {
      (message.*setter)(*value);
    }
  };
  set(surface.tolerance, &v1::SurfaceParameters::set_tolerance);
  set(surface.min_facet_angle, &v1::SurfaceParameters::set_min_facet_angle);
  set(surface.edge_length, &v1::SurfaceParameters::set_edge_length);
  set(surface.min_size, &v1::SurfaceParameters::set_min_size);
  set(surface.outside_rho, &v1::SurfaceParameters::set_outside_rho);
  set(surface.curvature_elements, &v1::SurfaceParameters::set_curvature_elements);
  set(surface.thickness_layers, &v1::SurfaceParameters::set_thickness_layers);
}

v1::Criterion CriterionToProto(Criterion criterion) {
  switch (criterion) {
    case Criterion::kRadiusEdge:
      return v1::CRITERION_RADIUS_EDGE;
    case Criterion::kWellSpaced:
      return v1::CRITERION_WELL_SPACED;
    case Criterion::kUnknown:
      break;
  }
  return static_cast<v1::Criterion>(-1);  // refused, rather than taken for the default
}

Criterion CriterionFromProto(v1::Criterion criterion) {
  switch (criterion) {
    case v1::CRITERION_UNSPECIFIED:
    case v1::CRITERION_RADIUS_EDGE:
      return Criterion::kRadiusEdge;
    case v1::CRITERION_WELL_SPACED:
      return Criterion::kWellSpaced;
    default:
      return Criterion::kUnknown;  // of a newer server
  }
}

}  // namespace

void SetDuration(absl::Duration duration, google::protobuf::Duration* message) {
  absl::Duration rest;
  message->set_seconds(absl::IDivDuration(duration, absl::Seconds(1), &rest));
  message->set_nanos(static_cast<int32_t>(absl::ToInt64Nanoseconds(rest)));
}

void SetParameters(const MeshOptions& options, v1::MeshParameters* parameters) {
  const auto set = [parameters](const auto& value, auto setter) {
    if (value.has_value()) {
      (parameters->*setter)(*value);
    }
  };
  parameters->set_dimension(options.dimension);
  set(options.rho, &v1::MeshParameters::set_rho);
  parameters->set_criterion(CriterionToProto(options.criterion));
  set(options.max_circumradius, &v1::MeshParameters::set_max_circumradius);
  set(options.edge_length, &v1::MeshParameters::set_edge_length);
  set(options.gradation, &v1::MeshParameters::set_gradation);
  for (const SizeBox& box : options.size_boxes) {
    v1::SizeBox* message = parameters->add_size_boxes();
    message->mutable_low()->Assign(box.low.begin(), box.low.end());
    message->mutable_high()->Assign(box.high.begin(), box.high.end());
    message->set_max_circumradius(box.max_circumradius);
  }
  if (!options.domain_low.empty() || !options.domain_high.empty()) {
    parameters->mutable_domain()->mutable_low()->Assign(options.domain_low.begin(), options.domain_low.end());
    parameters->mutable_domain()->mutable_high()->Assign(options.domain_high.begin(), options.domain_high.end());
  }
  set(options.min_dihedral, &v1::MeshParameters::set_min_dihedral);
  parameters->set_pump_weights(options.pump_weights);
  set(options.merge_distance, &v1::MeshParameters::set_merge_distance);
  parameters->set_keep_vertices(options.keep_vertices);
  parameters->mutable_periodic_axes()->Assign(options.periodic_axes.begin(), options.periodic_axes.end());
  SetSurface(options.surface_parameters, parameters);
  parameters->set_margin(options.margin);
  set(options.max_vertices, &v1::MeshParameters::set_max_vertices);
  set(options.threads, &v1::MeshParameters::set_threads);
}

MeshOptions OptionsFromProto(const v1::MeshParameters& parameters) {
  const auto get = [](bool is_given, auto value) { return is_given ? std::optional(value) : std::nullopt; };
  MeshOptions options;
  options.dimension = parameters.dimension();
  options.rho = get(parameters.has_rho(), parameters.rho());
  options.criterion = CriterionFromProto(parameters.criterion());
  options.max_circumradius = get(parameters.has_max_circumradius(), parameters.max_circumradius());
  options.edge_length = get(parameters.has_edge_length(), parameters.edge_length());
  options.gradation = get(parameters.has_gradation(), parameters.gradation());
  for (const v1::SizeBox& box : parameters.size_boxes()) {
    options.size_boxes.push_back(
        {.low = VectorOf(box.low()), .high = VectorOf(box.high()), .max_circumradius = box.max_circumradius()});
  }
  options.min_dihedral = get(parameters.has_min_dihedral(), parameters.min_dihedral());
  options.pump_weights = parameters.pump_weights();
  options.merge_distance = get(parameters.has_merge_distance(), parameters.merge_distance());
  options.keep_vertices = parameters.keep_vertices();
  options.periodic_axes.assign(parameters.periodic_axes().begin(), parameters.periodic_axes().end());
  const v1::SurfaceParameters& surface = parameters.surface();
  options.surface_parameters = {
      .tolerance = get(surface.has_tolerance(), surface.tolerance()),
      .min_facet_angle = get(surface.has_min_facet_angle(), surface.min_facet_angle()),
      .edge_length = get(surface.has_edge_length(), surface.edge_length()),
      .min_size = get(surface.has_min_size(), surface.min_size()),
      .outside_rho = get(surface.has_outside_rho(), surface.outside_rho()),
      .curvature_elements = get(surface.has_curvature_elements(), surface.curvature_elements()),
      .thickness_layers = get(surface.has_thickness_layers(), surface.thickness_layers())};
  options.domain_low = VectorOf(parameters.domain().low());
  options.domain_high = VectorOf(parameters.domain().high());
  if (parameters.has_margin()) {
    options.margin = parameters.margin();
  }
  options.max_vertices = get(parameters.has_max_vertices(), parameters.max_vertices());
  options.threads = get(parameters.has_threads(), static_cast<int>(parameters.threads()));
  return options;
}

Progress ProgressFromProto(const v1::ProgressEvent& event) {
  return Progress{.phase = PhaseName(event.phase()),
                  .vertices = event.vertices(),
                  .estimated_vertices = event.estimated_vertices(),
                  .simplices = event.simplices(),
                  .fraction = event.fraction() > 0 ? std::min(event.fraction(), 1.0) : 0,  // also for NaN
                  .sequence = event.sequence()};
}

MeshHeader HeaderFromProto(const v1::MeshMetadata& metadata) {
  MeshHeader header{.dimension = metadata.dimension(),
                    .domain_low = VectorOf(metadata.domain().low()),
                    .domain_high = VectorOf(metadata.domain().high()),
                    .vertex_count = metadata.vertex_count(),
                    .simplex_count = metadata.simplex_count(),
                    .input_point_count = metadata.input_point_count(),
                    .chunk_count = metadata.chunk_count(),
                    .revision = metadata.revision(),
                    .has_weights = metadata.has_weights(),
                    .moved_vertex_count = metadata.moved_vertex_count(),
                    .boundary = {},
                    .facet_count = metadata.facet_count(),
                    .ridge_count = metadata.ridge_count(),
                    .regions = {},
                    .has_simplex_regions = metadata.has_simplex_regions(),
                    .has_vertex_marks = metadata.has_vertex_marks(),
                    .statistics = StatisticsFromProto(metadata.statistics()),
                    .part = std::nullopt};
  for (const v1::BoundaryPart& part : metadata.boundary()) {
    header.boundary.push_back({part.tag(), part.name(), part.facet_count()});
  }
  if (metadata.has_part()) {
    const v1::MeshPartInfo& part = metadata.part();
    header.part = {.parts = part.parts(),
                   .part = part.part(),
                   .own_vertex_count = part.own_vertex_count(),
                   .own_simplex_count = part.own_simplex_count(),
                   .whole_vertex_count = part.whole_vertex_count(),
                   .whole_simplex_count = part.whole_simplex_count(),
                   .whole_facet_count = part.whole_facet_count()};
  }
  for (const v1::Region& region : metadata.regions()) {
    header.regions.push_back({region.id(), region.name()});
  }
  return header;
}

ServerInfo InfoFromProto(const v1::GetServerInfoResponse& response) {
  return ServerInfo{.version = response.version(),
                    .dimensions = VectorOf(response.dimensions()),
                    .max_points = response.max_points(),
                    .max_vertices = response.max_vertices(),
                    .max_request_bytes = response.max_request_bytes(),
                    .workers = response.workers(),
                    .max_queued_jobs = response.max_queued_jobs(),
                    .running_jobs = response.running_jobs(),
                    .queued_jobs = response.queued_jobs(),
                    .max_sessions = response.max_sessions(),
                    .max_sessions_per_tenant = response.max_sessions_per_tenant(),
                    .default_ttl = DurationFromProto(response.default_ttl()),
                    .max_ttl = DurationFromProto(response.max_ttl()),
                    .stall_limit = DurationFromProto(response.stall_limit()),
                    .max_memory_bytes = response.max_memory_bytes(),
                    .max_stored_bytes_per_tenant = response.max_stored_bytes_per_tenant(),
                    .stored_bytes = response.stored_bytes()};
}

absl::StatusOr<Session> SessionFromProto(const v1::Session& message) {
  // The sizes by which a client reads files, and sends arrays. 0: not told.
  if (message.parameters().dimension() < 0 || message.parameters().dimension() > kMaxDimension) {
    return Contradiction("a session in ", message.parameters().dimension(), "-D");
  }
  return Session{.name = message.name(),
                 .state = StateFromProto(message.state()),
                 .parameters = OptionsFromProto(message.parameters()),
                 .labels = Labels(message.labels().begin(), message.labels().end()),
                 .ttl = DurationFromProto(message.ttl()),
                 .create_time = TimeFromProto(message.create_time()),
                 .expire_time = TimeFromProto(message.expire_time()),
                 .revision = message.revision(),
                 .committed_points = message.committed_points(),
                 .vertex_count = message.vertex_count(),
                 .simplex_count = message.simplex_count(),
                 .last_operation = message.last_operation(),
                 .segment_count = message.segment_count(),
                 .seed_count = message.seed_count(),
                 .faces = FaceRuleFromProto(message.faces()),
                 .crossings = CrossingRuleFromProto(message.crossings()),
                 .snap_distance = message.has_snap_distance() ? std::optional(message.snap_distance()) : std::nullopt,
                 .triangle_count = message.triangle_count(),
                 .surface = message.has_surface() ? std::optional(SurfaceFromProto(message.surface())) : std::nullopt,
                 .names = NamesFromProto(message.names()),
                 .size_count = message.size_count(),
                 .stored_bytes = message.stored_bytes()};
}

absl::Duration DurationFromProto(const google::protobuf::Duration& message) {
  return absl::Seconds(message.seconds()) + absl::Nanoseconds(message.nanos());
}

v1::Operation::State StateToProto(OperationState state) {
  return std::ranges::find(kStates, state, [](const auto& pair) { return pair.first; })->second;
}

Operation OperationFromProto(const v1::Operation& message) {
  Operation operation;
  operation.name = message.name();
  operation.state = StateFromProto(message.state());
  operation.parameters = OptionsFromProto(message.parameters());
  operation.progress = ProgressFromProto(message.progress());
  operation.error =
      absl::Status(static_cast<absl::StatusCode>(message.error().code()), Printable(message.error().message()));
  if (!operation.error.ok()) {
    AddDetails(message.error(), operation.error);
  }
  operation.create_time = TimeFromProto(message.create_time());
  if (message.has_start_time()) {
    operation.start_time = TimeFromProto(message.start_time());
  }
  if (message.has_end_time()) {
    operation.end_time = TimeFromProto(message.end_time());
  }
  operation.mesh_revision = message.mesh_revision();
  operation.restart = message.restart();
  return operation;
}

absl::Status CheckNextPage(const std::string& token, const std::string& next) {
  return next.empty() || next != token ? absl::OkStatus() : Contradiction("after a page comes the same page again");
}

absl::StatusOr<CellBatch> CellsFromProto(const v1::VoronoiCellBatch& message) {
  const int cells = message.vertices_size();
  if (message.clip_radii_size() != cells || message.is_clipped_size() != cells || message.node_counts_size() != cells ||
      message.neighbour_counts_size() != cells) {
    return Contradiction(cells, " cells with ", message.clip_radii_size(), " radii, ", message.is_clipped_size(),
                         " flags, ", message.node_counts_size(), " counts of nodes and ",
                         message.neighbour_counts_size(), " counts of neighbours");
  }
  const uint64_t nodes = std::accumulate(message.node_counts().begin(), message.node_counts().end(), uint64_t{0});
  const uint64_t neighbours =
      std::accumulate(message.neighbour_counts().begin(), message.neighbour_counts().end(), uint64_t{0});
  const uint64_t coordinates = message.nodes_size();
  if (neighbours != static_cast<uint64_t>(message.neighbours_size()) ||
      (nodes == 0 ? coordinates != 0 : coordinates % nodes != 0 || coordinates == 0)) {
    return Contradiction(coordinates, " coordinates of ", nodes, " nodes, ", message.neighbours_size(), " of ",
                         neighbours, " neighbours");
  }
  const auto is_nan = [](double value) { return std::isnan(value); };
  if (std::ranges::any_of(message.nodes(), is_nan) || std::ranges::any_of(message.clip_radii(), is_nan)) {
    return Contradiction("a node or a radius of a cell is not a number");
  }
  return CellBatch{.dimension = nodes == 0 ? 0 : static_cast<int>(coordinates / nodes),
                   .vertices = VectorOf(message.vertices()),
                   .clip_radii = VectorOf(message.clip_radii()),
                   .is_clipped = VectorOf(message.is_clipped()),
                   .node_counts = VectorOf(message.node_counts()),
                   .nodes = VectorOf(message.nodes()),
                   .neighbour_counts = VectorOf(message.neighbour_counts()),
                   .neighbours = VectorOf(message.neighbours())};
}

}  // namespace wellspace::client
