// Meshes from a server to disk while they arrive.
#ifndef WELLSPACE_CLIENT_FILES_MESH_FILE_H_
#define WELLSPACE_CLIENT_FILES_MESH_FILE_H_

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/mesh.h"
#include "client/formats/write_mesh.h"
#include "client/mesh_sink.h"
#include "client/types.h"

namespace wellspace::client {

// A mesh as files hold it, without which vertex each input point became, and what is told of the run.
formats::Mesh ToFormats(Mesh mesh);

// Writes a part of a mesh, as MeshCollector has it, to a .vtu or .npz.
//
// REQUIRES:   `part` has Mesh::part.
// Errors:     as of formats::WriteMesh.
absl::Status WritePart(Mesh part, const std::string& path, const std::string& format, std::stop_token stop,
                       std::vector<std::string>* notes);

// Gives parts of the boundary that have tags of markers, but no names, these names.
void NameParts(const std::map<int32_t, std::string>& names, std::vector<BoundaryPart>& boundary);

// Writes a mesh to a file, in the memory of formats::MeshWriter. The file appears complete or not at all. A part of a
// mesh is collected, and written by WritePart.
//
// Errors:     as of formats::CreateMesh and formats::MeshWriter.
// Thread safety: thread-compatible.
class MeshFile final : public MeshSink {
 public:
  // See formats::CreateMesh.
  MeshFile(std::string path, std::string format = "", std::stop_token stop = {})
      : path_(std::move(path)), format_(std::move(format)), stop_(std::move(stop)) {}

  bool WantsBoundary() const override { return has_boundary_; }

  absl::Status Begin(const MeshHeader& header) override;
  absl::Status AddPoints(std::span<const double> points) override { return writer_->AddPoints(points); }
  absl::Status AddMovedVertices(std::span<const uint32_t> vertices) override {
    moved_vertices_.insert(moved_vertices_.end(), vertices.begin(), vertices.end());
    return absl::OkStatus();
  }
  absl::Status AddWeights(std::span<const double> weights) override { return writer_->AddWeights(weights); }
  absl::Status AddVertexOrigins(std::span<const uint32_t> origins) override;
  absl::Status AddVertexTags(std::span<const int32_t> tags) override;
  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override {
    return writer_->AddSimplexRegions(regions);
  }
  absl::Status AddSimplices(std::span<const uint32_t> simplices) override { return writer_->AddSimplices(simplices); }
  absl::Status AddInputVertices(std::span<const uint32_t> vertices) override;
  absl::Status AddFacets(std::span<const uint32_t> facets) override { return writer_->AddFacets(facets); }
  absl::Status AddRidges(std::span<const uint32_t> ridges) override { return writer_->AddRidges(ridges); }
  absl::Status Finish() override { return writer_->Commit(); }

  // The file gets elements of this order; of the second the mesh is kept until its end. To be called before Begin.
  void SetOrder(formats::MeshOrder order) { order_ = order; }

  // The file gets neither boundary nor regions nor origins of vertices. To be called before Begin.
  void LeaveOutBoundary() { has_boundary_ = false; }

  // No format holds which vertex each input point became: this keeps it in memory. To be called before Begin.
  void KeepInputVertices() { keeps_input_vertices_ = true; }

  // Gives vertices those of their input points: `attributes` of all points that were sent, NaN for others. That takes
  // the origins of vertices: a file that leaves out the boundary has none. To be called before Begin.
  //
  // Memory:     4 bytes a vertex, if there are attributes and the format has a place for them.
  // REQUIRES:   `attributes` outlive this.
  void AddAttributes(std::span<const formats::Attribute> attributes) { attributes_ = attributes; }

  // The mesh is periodic along these axes: the file gets the pairs of vertices, if the format has a place for them. To
  // be called before Begin.
  void SetPeriodicAxes(std::vector<int> axes) { periodic_axes_ = std::move(axes); }

  // Gives parts of the boundary that have these tags, of markers, these names in the place of the server's. To be
  // called before Begin.
  void NameParts(std::map<int32_t, std::string> names) { part_names_ = std::move(names); }

  // The header of the mesh, and the arrays that were kept.
  const MeshHeader& header() const { return header_; }
  const std::vector<uint32_t>& input_vertex() const { return input_vertex_; }
  const std::vector<uint32_t>& moved_vertices() const { return moved_vertices_; }
  // See formats::MeshWriter; none before Begin.
  std::vector<std::string> notes() const { return writer_ == nullptr ? std::vector<std::string>() : writer_->notes(); }

 private:
  // The attributes of all vertices, whose origins have come.
  absl::Status WriteAttributes();

  const std::string path_;
  const std::string format_;
  const std::stop_token stop_;
  MeshHeader header_;
  std::unique_ptr<formats::MeshWriter> writer_;
  formats::MeshOrder order_ = formats::MeshOrder::kFirst;
  bool has_boundary_ = true;
  std::map<int32_t, std::string> part_names_;
  std::vector<int> periodic_axes_;
  std::span<const formats::Attribute> attributes_;
  std::vector<uint32_t> origins_;  // of vertices, if the file gets attributes
  bool has_attributes_ = false;    // the file
  uint64_t tagged_vertices_ = 0;   // that have come
  bool keeps_input_vertices_ = false;
  std::vector<uint32_t> input_vertex_;
  std::vector<uint32_t> moved_vertices_;
};

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_FILES_MESH_FILE_H_
