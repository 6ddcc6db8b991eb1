// The arguments and results of the client library: meshes, sessions, operations, answers of the query structure.
#ifndef WELLSPACE_CLIENT_TYPES_H_
#define WELLSPACE_CLIENT_TYPES_H_

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"

namespace wellspace::client {

// The quantity that `rho` bounds; see the proto's Criterion.
// kUnknown: one of a newer server, which no server takes from this client.
enum class Criterion { kUnknown, kRadiusEdge, kWellSpaced };

// A box in which simplices are small; see the proto's SizeBox.
struct SizeBox {
  std::vector<double> low;
  std::vector<double> high;
  double max_circumradius = 0;
};

// The length that a size bounds; see the proto's SizeMeasure.
enum class SizeMeasure { kCircumradius, kEdgeLength };

// Sizes at points; see the proto's SizeSamples.
struct SizeSamples {
  std::vector<double> points;  // n x dimension, row-major
  std::vector<double> sizes;   // n
  SizeMeasure measure = SizeMeasure::kCircumradius;
};

// One size for each vertex of a session's mesh; see the proto's VertexSizes.
struct VertexSizes {
  std::vector<double> sizes;
  SizeMeasure measure = SizeMeasure::kCircumradius;
  std::optional<uint64_t> mesh_revision{};  // of the mesh whose vertices they are; none: the last one
};

// The faces, into which segments cut the plane, that are meshed; see the proto's FaceRule.
enum class FaceRule { kBox, kHoles, kEvenOdd, kUnion };

// The treatment of segments that cross, and of points too near to a segment; see the proto's CrossingRule.
enum class CrossingRule { kRefuse, kSnap, kSplit };

// See the proto's FaceSeed.
struct FaceSeed {
  double x = 0;
  double y = 0;
  bool is_hole = false;
  int32_t region = 0;
  std::optional<double> max_area{};  // none: no bound
  // The rings of a polygon: its segments from the first on. It stands for all faces inside of them. 0: the seed is
  // the point, as it is to a server that is too old to know of polygons.
  uint64_t first_segment = 0;
  uint64_t segment_count = 0;
};

// Names of parts of a mesh, in the place of the default ones; see the proto's PartNames.
struct PartNames {
  std::map<int32_t, std::string> markers;  // of parts of the boundary, by marker
  std::map<int32_t, std::string> regions;  // by the region of seeds

  bool IsEmpty() const { return markers.empty() && regions.empty(); }
  bool operator==(const PartNames&) const = default;
};

// Segments between points in 2-D, and the faces that they bound; see the proto's SegmentChunk and FaceOptions.
struct Features {
  std::vector<uint32_t> ends;    // m x 2, row-major: indices of points
  std::vector<int32_t> markers;  // m, or none: then all are 0
  std::vector<uint8_t> is_open;  // m, or none: 1 for a segment that is part of no ring
  std::vector<uint32_t> groups;  // m, or none: the group of each, for kUnion
  std::vector<FaceSeed> seeds;
  FaceRule faces = FaceRule::kBox;
  CrossingRule crossings = CrossingRule::kRefuse;
  std::optional<double> snap_distance{};  // of kSnap and kSplit; none: distances that doubles cannot resolve
  PartNames names;
};

// The solids, into which triangles cut space, that are meshed; see the proto's SolidRule.
enum class SolidRule { kEvenOdd, kHoles, kWinding, kBox };

// See the proto's SolidSeed.
struct SolidSeed {
  double x = 0;
  double y = 0;
  double z = 0;
  bool is_hole = false;
  int32_t region = 0;
  std::optional<double> max_volume{};  // none: no bound
};

// Triangles between points in 3-D, and the solids that they bound; see the proto's TriangleChunk and SurfaceOptions.
struct SurfaceFeatures {
  std::vector<uint32_t> corners;  // m x 3, row-major: indices of points
  std::vector<int32_t> markers;   // m, or none: then all are 0
  std::vector<SolidSeed> seeds;
  SolidRule solids = SolidRule::kEvenOdd;
  std::optional<double> crease_angle{};  // degrees
  std::optional<double> weld{};
  std::optional<double> min_patch{};
  std::optional<double> resolution{};          // of kWinding
  std::optional<std::array<double, 6>> box{};  // of kBox: the low corner, then the high one
  bool keeps_points = false;
  PartNames names;
};

// The fidelity of a mesh to its surface; see the proto's SurfaceParameters.
struct SurfaceParameters {
  std::optional<double> tolerance{};
  std::optional<double> min_facet_angle{};  // degrees; 0: off
  std::optional<double> edge_length{};
  std::optional<double> min_size{};
  std::optional<double> outside_rho{};
  std::optional<double> curvature_elements{};
  std::optional<double> thickness_layers{};

  bool operator==(const SurfaceParameters&) const = default;
};

// The parameters of a mesh. An empty field is the server's default, as the comments of the proto's MeshParameters say.
// A 0 is sent as it is, and refused where it can be no value.
struct MeshOptions {
  int dimension = 3;
  std::optional<double> rho;
  Criterion criterion = Criterion::kRadiusEdge;
  std::optional<double> max_circumradius;
  std::optional<double> edge_length;
  std::vector<SizeBox> size_boxes;
  std::optional<double> gradation;     // from boxes and samples
  std::optional<double> min_dihedral;  // degrees; 0: slivers are left as they are
  bool pump_weights = false;
  std::optional<double> merge_distance;  // points this near to each other become one vertex
  bool keep_vertices = false;            // of the session's last mesh: where they are
  std::vector<double> domain_low;
  std::vector<double> domain_high;
  double margin = 0.25;
  std::vector<int> periodic_axes;  // along which opposite faces of the box match, each once
  std::optional<uint64_t> max_vertices;
  std::optional<int> threads;
  std::shared_ptr<const Features>
      features;  // of MeshPoints and EstimateMesh, in 2-D; null: none. Those of a session: AddSegments
  std::shared_ptr<const SurfaceFeatures>
      surface;  // the same in 3-D, of which a mesh has one of the two at most. Of a session: AddTriangles
  SurfaceParameters surface_parameters;
  std::shared_ptr<const SizeSamples>
      size_samples;  // of MeshPoints and EstimateMesh; null: none. Those of a session: SetSizes
};

// The vertex of an input point that lies in no face which is meshed.
inline constexpr uint32_t kNoVertex = 0xffff'ffff;

struct Progress {
  std::string phase;
  uint64_t vertices = 0;
  uint64_t estimated_vertices = 0;  // 0 while unknown
  uint64_t simplices = 0;
  double fraction = 0;    // in [0, 1], never decreasing
  uint64_t sequence = 0;  // number of the event
};

// The kind of triangulation that a mesh is; see the proto's Triangulation.
enum class Triangulation { kUnknown, kDelaunay, kRegular };

// Why a sliver is left; see the proto's SliverReason.
enum class SliverReason { kUnknown, kDemands, kAngle, kWork };

// A sliver that could not be repaired; see the proto's LeftSliver.
struct LeftSliver {
  std::vector<uint32_t> vertices;
  double min_dihedral_deg = 0;
  SliverReason reason = SliverReason::kUnknown;
};

// Counts of the points and segments of a domain; see the proto's DomainStatistics.
struct DomainStatistics {
  uint64_t unmeshed_points = 0;
  uint64_t segments = 0;
  uint64_t subsegments = 0;
  uint64_t dropped_segments = 0;
  uint64_t touching_points = 0;
  uint64_t crossings = 0;
  uint64_t near_points = 0;
  uint64_t exempt_simplices = 0;
  double min_input_angle_deg = 0;
  uint64_t unused_seeds = 0;
  uint64_t first_unused_seed = 0;
};

// Counts of the triangles that bound a domain; see the proto's SurfaceStatistics.
struct SurfaceStatistics {
  uint64_t triangles = 0;
  uint64_t welded_points = 0;
  uint64_t dropped_triangles = 0;
  uint64_t flipped_triangles = 0;
  uint64_t unmeshed_points = 0;
  uint64_t patches = 0;
  uint64_t curves = 0;
  uint64_t corners = 0;
  uint64_t solids = 0;
  uint64_t facets = 0;
  uint64_t ridges = 0;
  uint64_t lost_ridges = 0;
  uint64_t exempt_simplices = 0;
  uint64_t acute_curves = 0;
  uint64_t tube_simplices = 0;
  double min_angle_outside_deg = 0;
  uint64_t unused_seeds = 0;
  uint64_t first_unused_seed = 0;
  double min_facet_angle_deg = 0;
  double deviation_of_facets = 0;
  double deviation_of_surface = 0;
  double lost_area = 0;
  uint64_t cut_triangles = 0;
  uint64_t outside_triangles = 0;
  std::vector<double> volumes;  // by region
};

// The repair of slivers, in figures; see the proto's SliverStatistics.
struct SliverStatistics {
  uint64_t found = 0;
  uint64_t left = 0;
  uint64_t moves = 0;
  uint64_t added_vertices = 0;
  uint64_t weighted_vertices = 0;
  double min_angle_before_deg = 0;
  uint64_t operations = 0;
  uint64_t left_by_demands = 0;
  uint64_t left_by_angle = 0;
  uint64_t left_by_work = 0;
  std::vector<LeftSliver> flattest_left;
};

struct MeshStatistics {
  uint64_t input_points = 0;
  uint64_t duplicates = 0;
  std::optional<DomainStatistics> domain;    // of a domain with segments
  std::optional<SurfaceStatistics> surface;  // of a domain that triangles bound
  uint64_t merged_points = 0;                // whose vertex has other coordinates
  uint64_t vertices = 0;
  uint64_t simplices = 0;
  double max_radius_edge = 0;
  double min_angle_deg = 0;  // above 2-D: smallest dihedral angle
  Triangulation triangulation = Triangulation::kUnknown;
  std::optional<SliverStatistics> slivers;  // none: nothing was asked for
  std::map<std::string, double> seconds;    // by phase, and "total"
  uint64_t peak_memory_bytes = 0;
  std::map<std::string, uint64_t> counters;
};

// Where a vertex comes from, if it is no input point; see the proto's MeshChunk.vertex_origins.
inline constexpr uint32_t kSteinerOrigin = 0xffff'ffff;  // the refinement
inline constexpr uint32_t kRepairOrigin = 0xffff'fffe;   // the repair of slivers
inline constexpr uint32_t kCornerOrigin = 0xffff'fffd;   // it is a corner of the box

// Facets of the boundary with a tag in common; see the proto's BoundaryPart.
struct BoundaryPart {
  int32_t tag = 0;
  std::string name;
  uint64_t facet_count = 0;

  bool operator==(const BoundaryPart&) const = default;
};

// Simplices of one material; see the proto's Region.
struct Region {
  int32_t id = 0;
  std::string name;

  bool operator==(const Region&) const = default;
};

// The part of a mesh that is asked for, for solvers on many ranks; see the proto's MeshPartition.
struct PartOptions {
  uint32_t parts = 1;
  uint32_t part = 0;  // from 0 to parts - 1
  uint32_t ghost_layers = 1;
  bool contiguous = false;

  bool operator==(const PartOptions&) const = default;
};

// The part that a mesh is, and the whole that it is cut from; see the proto's MeshPartInfo.
struct PartHeader {
  uint32_t parts = 1;
  uint32_t part = 0;
  uint64_t own_vertex_count = 0;   // the first; others are ghosts' alone
  uint64_t own_simplex_count = 0;  // the first; others are ghosts
  uint64_t whole_vertex_count = 0;
  uint64_t whole_simplex_count = 0;
  uint64_t whole_facet_count = 0;

  bool operator==(const PartHeader&) const = default;
};

// The arrays of numbers that a part has beside those of a mesh; see the proto's MeshChunk.
enum class PartNumbers { kVertexIds, kVertexOwners, kVertexRows, kSimplexIds, kSimplexOwners, kFacetIds };

// A part's place in its mesh.
struct MeshPart : PartHeader {
  std::vector<uint32_t> vertex_ids;     // by vertex: its number in the whole mesh
  std::vector<uint32_t> vertex_owners;  // the part that owns it
  std::vector<uint32_t> vertex_rows;    // its number where part after part is numbered, as solvers have rows
  std::vector<uint32_t> simplex_ids;    // by simplex
  std::vector<uint32_t> simplex_owners;
  std::vector<uint32_t> facet_ids;  // by facet; the part owns all of them
};

// The properties of a mesh that come before its arrays.
struct MeshHeader {
  int dimension = 0;
  std::vector<double> domain_low;
  std::vector<double> domain_high;
  uint64_t vertex_count = 0;
  uint64_t simplex_count = 0;
  uint64_t input_point_count = 0;
  uint64_t chunk_count = 0;
  uint64_t revision = 0;  // of the session's mesh; 0 in the answer of MeshPoints
  bool has_weights = false;
  uint64_t moved_vertex_count = 0;  // see the proto's MeshChunk.moved_vertices
  // Nothing of the following where the sink does not want the boundary, or the server is too old to know of it.
  std::vector<BoundaryPart> boundary;
  uint64_t facet_count = 0;  // of all parts
  uint64_t ridge_count = 0;  // edges on creases of a surface
  std::vector<Region> regions;
  bool has_simplex_regions = false;  // if not, all are of the only region
  bool has_vertex_marks = false;
  MeshStatistics statistics;       // of the whole mesh
  std::optional<PartHeader> part;  // none: it is whole
};

struct Mesh {
  int dimension = 0;
  std::vector<double> domain_low;
  std::vector<double> domain_high;
  std::vector<double> points;          // vertex_count x dimension, row-major; the distinct input points first
  std::vector<double> weights;         // vertex_count squared lengths, of a regular triangulation; else empty
  std::vector<uint32_t> simplices;     // simplex_count x (dimension + 1), row-major
  std::vector<uint32_t> input_vertex;  // per input point: the vertex it became
  // The vertices that the session's mesh before had at another place, ascending.
  std::vector<uint32_t> moved_vertices;
  // As the proto's MeshChunk and MeshMetadata have them; empty where the server is too old for them.
  std::vector<uint32_t> vertex_origins;  // the number of an input point, or an origin as above
  std::vector<int32_t> vertex_tags;      // 0: inside
  std::vector<uint32_t> facets;          // facet_count x dimension, part after part
  std::vector<uint32_t> ridges;          // ridge_count x 2, of a surface: the edges on its creases
  std::vector<BoundaryPart> boundary;
  std::vector<int32_t> simplex_regions;  // empty: all are of the only region
  std::vector<Region> regions;
  MeshStatistics statistics;
  uint64_t revision = 0;         // of the session's mesh; 0: of no session
  std::optional<MeshPart> part;  // none: it is whole
};

// The size that a mesh would have.
struct MeshEstimate {
  uint64_t vertices = 0;
  uint64_t simplices = 0;
  uint64_t memory_bytes = 0;  // most that the server would take at once
  uint64_t tree_leaves = 0;
};

using Labels = std::map<std::string, std::string>;

// The settings of a new session. See the proto's CreateSessionRequest.
struct SessionOptions {
  MeshOptions parameters;
  Labels labels;
  std::optional<absl::Duration> ttl;  // absent: the server's default
};

// The settings of a session that UpdateSession changes; absent ones stay.
struct SessionUpdate {
  std::optional<Labels> labels;
  std::optional<absl::Duration> ttl;
};

enum class SessionState { kUnknown, kOpen, kRefining, kReady };

// See the proto's Session.
struct Session {
  std::string name;
  SessionState state = SessionState::kUnknown;
  MeshOptions parameters;
  Labels labels;
  absl::Duration ttl;
  absl::Time create_time;
  absl::Time expire_time;
  uint64_t revision = 0;
  uint64_t committed_points = 0;
  uint64_t vertex_count = 0;
  uint64_t simplex_count = 0;
  std::string last_operation;  // empty before the first
  uint64_t segment_count = 0;
  uint64_t seed_count = 0;
  std::optional<FaceRule> faces;  // none: a cloud, without segments and faces
  CrossingRule crossings = CrossingRule::kRefuse;
  std::optional<double> snap_distance{};
  uint64_t triangle_count = 0;
  std::optional<SurfaceFeatures>
      surface{};              // without triangles and seeds; none: there are neither triangles nor options
  PartNames names;            // of parts of its mesh
  uint64_t size_count = 0;    // samples of sizes, see SetSizes
  uint64_t stored_bytes = 0;  // of its points, features, sizes and mesh
};

// The page of a list that is asked for.
struct PageOptions {
  std::optional<int> page_size{};  // none: as many as the server likes
  std::string page_token;          // `next_page_token` of the page before; empty: the first
};

struct SessionPage {
  std::vector<Session> sessions;
  std::string next_page_token;  // empty: this was the last
};

enum class OperationState { kUnknown, kQueued, kRunning, kSucceeded, kFailed, kCancelled };

// See the proto's Operation.
struct Operation {
  std::string name;
  OperationState state = OperationState::kUnknown;
  MeshOptions parameters;
  Progress progress;
  absl::Status error;  // OK unless kFailed or kCancelled
  absl::Time create_time;
  std::optional<absl::Time> start_time;
  std::optional<absl::Time> end_time;
  uint64_t mesh_revision = 0;
  bool restart = false;
};

struct OperationPage {
  std::vector<Operation> operations;
  std::string next_page_token;  // empty: this was the last
};

// Which operations of all tenants are listed. See the proto's ListAllOperationsRequest.
struct OperationFilter {
  std::string tenant{};                   // empty: all
  std::optional<OperationState> state{};  // none: any
};

// An operation, and whose it is. See the proto's OwnedOperation.
struct OwnedOperation {
  Operation operation;
  std::string tenant;
  std::string replica;  // empty: servers share no database
  std::string address;  // of that; empty: not known
};

struct OwnedOperationPage {
  std::vector<OwnedOperation> operations;
  std::string next_page_token;  // empty: this was the last
};

// Which usage is told. See the proto's GetUsageRequest.
struct UsageFilter {
  std::string tenant{};     // empty: all
  std::string first_day{};  // "YYYY-MM-DD" in UTC; empty: from the beginning
  std::string last_day{};   // empty: until now
};

// See the proto's TenantUsage.
struct TenantUsage {
  std::string tenant;
  uint64_t meshes = 0;
  uint64_t vertices = 0;
  absl::Duration processor_time;
  uint64_t sessions = 0;
  uint64_t stored_bytes = 0;
};

struct UsagePage {
  std::vector<TenantUsage> usage;
  std::string next_page_token;  // empty: this was the last
};

// Points and revision of a session after an upload.
struct Uploaded {
  uint64_t committed_points = 0;
  uint64_t revision = 0;
};

// Of a session's segments and seeds, the number before the first that is added.
struct FeatureOffset {
  uint64_t segments = 0;
  uint64_t seeds = 0;

  bool operator==(const FeatureOffset&) const = default;
};

// The same of triangles and the seeds of solids.
struct SurfaceOffset {
  uint64_t triangles = 0;
  uint64_t seeds = 0;

  bool operator==(const SurfaceOffset&) const = default;
};

// How many points a session has after some were removed, and its revision.
struct PointsLeft {
  uint64_t point_count = 0;
  uint64_t revision = 0;
};

// How many sizes at points a session has, and its revision.
struct SizesSet {
  uint64_t size_count = 0;
  uint64_t revision = 0;
};

// The options of StartRefinement; see the proto's StartRefinementRequest.
struct RefinementOptions {
  std::optional<MeshOptions> parameters{};  // absent: the session's
  bool restart = false;                     // the mesh is made anew, from the session's points alone
};

// Segments, seeds and revision of a session after segments were added.
struct AddedSegments {
  uint64_t segment_count = 0;
  uint64_t seed_count = 0;
  uint64_t revision = 0;
};

// The same after triangles were added.
struct AddedTriangles {
  uint64_t triangle_count = 0;
  uint64_t seed_count = 0;
  uint64_t revision = 0;
};

// The places of n points in a mesh; see the proto's LocateResponse.
struct Located {
  std::vector<uint32_t> simplices;  // n; kNoSimplex for a point in none
  std::vector<uint32_t> vertices;   // n x (dimension + 1), row-major
  std::vector<double> coordinates;  // n x (dimension + 1), row-major: barycentric
  uint64_t revision = 0;            // of the mesh
  uint64_t vertex_count = 0;        // of the mesh
};
inline constexpr uint32_t kNoSimplex = 0xffff'ffff;

// The options of Locate.
struct LocateOptions {
  std::optional<uint64_t> revision{};  // of the mesh; none: the last one
  bool allow_outside = false;          // points in no simplex are no error
};

// Where the values of a field are.
enum class FieldPlace { kVertices, kSimplices };

// The options of TransferValues.
struct TransferOptions {
  uint64_t from_revision = 0;          // of the mesh that the values belong to: Mesh.revision
  std::optional<uint64_t> revision{};  // of the last mesh; none: any
  FieldPlace place = FieldPlace::kVertices;
  size_t components = 1;      // numbers of each vertex or simplex, 1 to 64
  bool conservative = false;  // of simplices, in 2-D and 3-D: means by exact intersection, which keep the integral
};

// A field on the last mesh of a session; see the proto's TransferValuesResponse.
struct TransferredValues {
  std::vector<double> values;  // rows x components, row-major
  uint64_t revision = 0;       // of the mesh
  uint64_t outside_count = 0;  // rows whose place is outside of the earlier mesh
};

struct AddedVertices {
  std::vector<uint32_t> vertices;  // that each point became, or was already
  uint64_t revision = 0;
};

// Voronoi cells of c vertices; see the proto's VoronoiCellBatch. The counts add up to the lengths of the arrays.
struct CellBatch {
  int dimension = 0;
  std::vector<uint32_t> vertices;          // c
  std::vector<double> clip_radii;          // c; infinity: not clipped
  std::vector<bool> is_clipped;            // c
  std::vector<uint32_t> node_counts;       // c
  std::vector<double> nodes;               // sum(node_counts) x dimension, row-major
  std::vector<uint32_t> neighbour_counts;  // c
  std::vector<uint32_t> neighbours;        // sum(neighbour_counts)
};

// See the proto's GetServerInfoResponse.
struct ServerInfo {
  std::string version;
  std::vector<int> dimensions;
  uint64_t max_points = 0;
  uint64_t max_vertices = 0;
  uint64_t max_request_bytes = 0;
  int workers = 0;
  int max_queued_jobs = 0;
  int running_jobs = 0;
  int queued_jobs = 0;
  uint64_t max_sessions = 0;
  uint64_t max_sessions_per_tenant = 0;
  absl::Duration default_ttl;
  absl::Duration max_ttl;
  absl::Duration stall_limit;
  uint64_t max_memory_bytes = 0;             // 0: no limit
  uint64_t max_stored_bytes_per_tenant = 0;  // 0: no limit
  uint64_t stored_bytes = 0;                 // of these, the bytes of the caller's sessions
};

// The health of a server, or of one of its services.
enum class Health { kUnknown, kServing, kNotServing };

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_TYPES_H_
