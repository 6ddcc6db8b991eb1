// Grids of programs for rivers and coasts: triangles whose nodes have a height each, and strings of nodes along the
// boundary. The common part of their writers. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_HYDRO_HYDRO_WRITER_H_
#define WELLSPACE_CLIENT_FORMATS_HYDRO_HYDRO_WRITER_H_

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/io/output_file.h"
#include "client/formats/mesh.h"
#include "client/formats/regions.h"
#include "client/formats/write_mesh.h"

namespace wellspace::formats {

// Nodes along a part of the boundary.
struct NodeString {
  const BoundaryPart* part;
  std::vector<uint32_t> nodes;  // the first one again at the end of a ring
};

// Keeps the points until their heights are known, writes nodes and triangles, and makes strings of the boundary.
//
// Memory: the points, a height each, the facets; of kOutside three edges of each triangle at the boundary; 16 bytes for
//         each run of simplices of one region.
// Thread safety: thread-compatible.
class HydroWriter : public MeshWriter {
 public:
  absl::Status AddPoints(std::span<const double> points) final;
  absl::Status AddWeights(std::span<const double> weights) final;
  absl::Status AddVertexTags(std::span<const int32_t> tags) final;
  absl::Status AddAttribute(size_t index, std::span<const double> values) final;
  absl::Status AddSimplexRegions(std::span<const int32_t> regions) final;
  absl::Status AddSimplices(std::span<const uint32_t> simplices) final;
  absl::Status AddFacets(std::span<const uint32_t> facets) final;
  absl::Status Commit() final;

 protected:
  // The height of a node: the attribute `name` or, of the other sign, `opposite`; `missing` where there is none.
  struct Height {
    const char* name;
    const char* opposite;
    const char* missing;
  };

  // The edges that the strings are of: `kOutside`, those with a triangle on one side alone.
  enum class Strings { kOutside, kAny };

  HydroWriter(OutputFile output, const MeshShape& shape, const Height& height, Strings strings);

  const MeshShape& shape() const { return shape_; }
  // A node's two coordinates.
  std::span<const double> PointOf(uint32_t node) const { return std::span(points_).subspan(2 * size_t{node}, 2); }
  OutputFile& output() { return output_; }

 private:
  virtual std::string Start() = 0;
  // A line for a node, numbered from 1 on, or a triangle; `height` is text, `nodes` are counted from 0.
  virtual void AppendNode(uint64_t number, std::span<const double> point, const std::string& height,
                          std::string& line) = 0;
  virtual void AppendTriangle(uint64_t number, std::span<const uint32_t> nodes, int32_t region, std::string& line) = 0;
  // Writes the strings, and all that is left.
  virtual void End(const std::vector<NodeString>& strings) = 0;

  void WriteNodes();
  // `facets` without those inside of the mesh, which it counts.
  std::vector<uint32_t> TakeFacets(std::span<const uint32_t> facets);
  std::string HeightOf(uint64_t node);

  const MeshShape shape_;
  const Height height_;
  const Strings strings_;
  OutputFile output_;
  size_t height_index_;  // of the attribute; its number if there is none
  bool is_opposite_ = false;
  std::vector<double> points_;
  std::vector<double> heights_;
  std::vector<uint32_t> facets_;
  std::vector<uint8_t> is_tagged_;                    // vertices; empty: not known
  std::vector<std::pair<uint32_t, uint32_t>> edges_;  // of triangles that may have a facet, in ascending order
  uint64_t inner_edges_ = 0;                          // facets inside, which are left out
  RegionQueue regions_;
  bool has_nodes_ = false;  // they are written
  uint64_t missing_heights_ = 0;
  uint64_t attribute_values_ = 0;
  uint64_t simplices_ = 0;
  std::string line_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_HYDRO_HYDRO_WRITER_H_
