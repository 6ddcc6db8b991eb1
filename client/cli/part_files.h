// Parts of a mesh for the ranks of a solver, and the files that they go to.
#ifndef WELLSPACE_CLIENT_CLI_PART_FILES_H_
#define WELLSPACE_CLIENT_CLI_PART_FILES_H_

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/file_plan.h"
#include "client/formats/mesh.h"
#include "core/partition/mesh_part.h"
#include "core/partition/partition.h"

namespace wellspace::cli {

// The help text on the files of parts.
extern const char kPartsHelp[];

// How a mesh is cut: --ghost-layers and --contiguous.
struct PartitionOptions {
  uint32_t parts = 1;
  uint32_t ghost_layers = 1;
  bool contiguous = false;

  void AddTo(CLI::App& command);
};

// The figures of parts that were written.
struct PartFigures {
  std::vector<uint64_t> sizes;   // by part: simplices
  std::vector<uint64_t> ghosts;  // the same
  uint64_t cut_facets = 0;
  double imbalance = 0;            // of the largest part, above the mean
  std::vector<std::string> notes;  // of the files, a sentence each
};

// "8 parts of 100 to 103 tetrahedra, 2.1 % above the mean; 70 facets between parts", a line.
std::string PartsSummary(const PartFigures& figures, int dimension);

// Cuts a mesh, and writes all of its parts to `output`: .pvtu, .vtu, .npz or .msh.
//
// Thread safety: thread-compatible.
class PartFiles {
 public:
  PartFiles(std::string output, const PartitionOptions& options);

  // Refuses an output of another format, and one that would overwrite what `add_files` adds to a plan.
  absl::Status Check(const std::function<void(formats::FilePlan&)>& add_files) const;

  // Writes the parts of `mesh`, whose vertices are marked. `name`: what errors about the mesh call it.
  //
  // Errors:     INVALID_ARGUMENT: it has no such parts; of writing.
  absl::Status Write(const formats::Mesh& mesh, const std::string& name);

  // After Write.
  const PartFigures& figures() const { return figures_; }

 private:
  // One file for all parts, or one each.
  bool is_one_file() const { return extension_ == ".msh"; }
  std::string PieceOf(uint32_t part) const;
  absl::StatusOr<core::HugeVector<uint32_t>> Cut(const formats::Mesh& mesh);
  absl::Status WritePieces(const formats::Mesh& mesh, const core::PartitionedMesh& partitioned,
                           const core::PartOwners& owners);
  absl::Status WriteOne(const formats::Mesh& mesh, const core::PartitionedMesh& partitioned,
                        const core::PartOwners& owners);
  absl::Status WritePiece(const formats::Mesh& mesh, const core::PartOwners& owners, const core::MeshPart& part,
                          uint32_t number, std::span<const uint32_t> part_of);
  void CountParts(const core::DualGraph& graph, std::span<const uint32_t> part_of);

  const std::string output_;
  const std::string extension_;
  const PartitionOptions options_;
  const core::RunContext context_;
  PartFigures figures_;
  formats::MeshShape piece_shape_;
};

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_PART_FILES_H_
