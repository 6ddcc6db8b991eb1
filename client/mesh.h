// Meshes as the client library has them, and where they go while they arrive.
#ifndef WELLSPACE_CLIENT_MESH_H_
#define WELLSPACE_CLIENT_MESH_H_

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace wellspace::client {

// What `rho` bounds; see the proto's Criterion.
enum class Criterion { kRadiusEdge, kWellSpaced };

// A box in which simplices are small; see the proto's SizeBox.
struct SizeBox {
  std::vector<double> low;
  std::vector<double> high;
  double max_circumradius = 0;
};

// What to mesh and how. Zero or empty means the server's default, as the comments of the proto's MeshParameters say.
// Which faces, into which segments cut the plane, are meshed; see the proto's FaceRule.
enum class FaceRule { kBox, kHoles, kEvenOdd };

// See the proto's FaceSeed.
struct FaceSeed {
  double x = 0;
  double y = 0;
  bool is_hole = false;
  int32_t region = 0;
  double max_area = 0;  // 0: no bound
};

// Segments between points in 2-D, and the faces that they bound; see the proto's SegmentChunk and FaceOptions.
struct Features {
  std::vector<uint32_t> ends;    // m x 2, row-major: indices of points
  std::vector<int32_t> markers;  // m, or none: then all are 0
  std::vector<uint8_t> is_open;  // m, or none: 1 for a segment that is part of no ring
  std::vector<FaceSeed> seeds;
  FaceRule faces = FaceRule::kBox;
  bool split_crossings = false;
};

struct MeshOptions {
  int dimension = 3;
  double rho = 0;
  Criterion criterion = Criterion::kRadiusEdge;
  double max_circumradius = 0;
  std::vector<SizeBox> size_boxes;
  std::optional<double> min_dihedral;  // degrees; 0: slivers are left as they are
  bool pump_weights = false;
  double merge_distance = 0;   // points this near to each other become one vertex
  bool keep_vertices = false;  // of the session's last mesh: where they are
  std::vector<double> domain_low;
  std::vector<double> domain_high;
  double margin = 0.25;
  uint64_t max_vertices = 0;
  int threads = 0;
  std::shared_ptr<const Features> features;  // of MeshPoints and EstimateMesh, in 2-D; null: none
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

// Which triangulation of its vertices a mesh is; see the proto's Triangulation.
enum class Triangulation { kUnknown, kDelaunay, kRegular };

// Why a sliver is left; see the proto's SliverReason.
enum class SliverReason { kUnknown, kDemands, kAngle, kWork };

// A sliver that could not be repaired; see the proto's LeftSliver.
struct LeftSliver {
  std::vector<uint32_t> vertices;
  double min_dihedral_deg = 0;
  SliverReason reason = SliverReason::kUnknown;
};

// What became of the points and segments of a domain; see the proto's DomainStatistics.
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
};

// What was done against slivers; see the proto's SliverStatistics.
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
  std::optional<DomainStatistics> domain;  // of a domain with segments
  uint64_t merged_points = 0;              // whose vertex has other coordinates
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

// What is known of a mesh before its arrays.
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
  std::vector<Region> regions;
  bool has_simplex_regions = false;  // if not, all are of the only region
  bool has_vertex_marks = false;
  MeshStatistics statistics;
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
  std::vector<BoundaryPart> boundary;
  std::vector<int32_t> simplex_regions;  // empty: all are of the only region
  std::vector<Region> regions;
  MeshStatistics statistics;
};

// Takes a mesh piece by piece, so that it need not fit into memory.
//
// Calls come in the order of the functions below, from one thread, those for the arrays as often as there are pieces of
// them. Pieces are whole rows; those of one array follow one another, and add up to what the header says; every number
// of a vertex is below vertex_count. Each piece comes once, however often the connection broke meanwhile. After an
// error no further call comes, and the error is what the client's call returns.
class MeshSink {
 public:
  MeshSink() = default;
  virtual ~MeshSink() = default;
  MeshSink(const MeshSink&) = delete;
  MeshSink& operator=(const MeshSink&) = delete;

  // Whether the server is asked for the boundary, the regions and the origins of vertices, too.
  virtual bool WantsBoundary() const { return false; }

  virtual absl::Status Begin(const MeshHeader& header) = 0;
  // Rows of `dimension` coordinates.
  virtual absl::Status AddPoints(std::span<const double> points) = 0;
  // Vertices of the last piece of points that have moved since the session's mesh before. Called only if there are any.
  virtual absl::Status AddMovedVertices(std::span<const uint32_t> /*vertices*/) { return absl::OkStatus(); }
  // The next vertices' weights, if the header has_weights.
  virtual absl::Status AddWeights(std::span<const double> weights) = 0;
  // The next vertices' origins, then the next vertices' tags, if the header has_vertex_marks.
  virtual absl::Status AddVertexOrigins(std::span<const uint32_t> /*origins*/) { return absl::OkStatus(); }
  virtual absl::Status AddVertexTags(std::span<const int32_t> /*tags*/) { return absl::OkStatus(); }
  // The next simplices' regions, if the header has_simplex_regions.
  virtual absl::Status AddSimplexRegions(std::span<const int32_t> /*regions*/) { return absl::OkStatus(); }
  // Rows of dimension + 1 vertices.
  virtual absl::Status AddSimplices(std::span<const uint32_t> simplices) = 0;
  // For the next input points the vertices that they became.
  virtual absl::Status AddInputVertices(std::span<const uint32_t> vertices) = 0;
  // Rows of `dimension` vertices: the facets of the header's first part of the boundary, then those of its second, …
  virtual absl::Status AddFacets(std::span<const uint32_t> /*facets*/) { return absl::OkStatus(); }
  // The mesh is complete.
  virtual absl::Status Finish() = 0;
};

// Keeps the whole mesh in memory, which grows with what arrives, not with what was announced.
//
// Thread safety: thread-compatible.
class MeshCollector final : public MeshSink {
 public:
  bool WantsBoundary() const override { return true; }
  absl::Status Begin(const MeshHeader& header) override;
  absl::Status AddPoints(std::span<const double> points) override;
  absl::Status AddMovedVertices(std::span<const uint32_t> vertices) override;
  absl::Status AddWeights(std::span<const double> weights) override;
  absl::Status AddVertexOrigins(std::span<const uint32_t> origins) override;
  absl::Status AddVertexTags(std::span<const int32_t> tags) override;
  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override;
  absl::Status AddSimplices(std::span<const uint32_t> simplices) override;
  absl::Status AddInputVertices(std::span<const uint32_t> vertices) override;
  absl::Status AddFacets(std::span<const uint32_t> facets) override;
  absl::Status Finish() override { return absl::OkStatus(); }

  // What has been collected; to be moved from when the mesh is complete.
  Mesh& mesh() { return mesh_; }

 private:
  Mesh mesh_;
};

// How large a mesh would be.
struct MeshEstimate {
  uint64_t vertices = 0;
  uint64_t simplices = 0;
  uint64_t memory_bytes = 0;  // most that the server would take at once
  uint64_t tree_leaves = 0;
};

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_MESH_H_
