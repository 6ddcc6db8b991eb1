#include "client/cli/part_files.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/formats/registry.h"
#include "client/formats/write_mesh.h"
#include "client/formats/write_parts.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

constexpr uint32_t kMostGhostLayers = 1000;

// The parts of the boundary, with the counts of those facets alone that a part owns; facets ascend.
std::vector<formats::BoundaryPart> CountedIn(std::span<const formats::BoundaryPart> boundary,
                                             std::span<const uint32_t> facets) {
  std::vector<uint64_t> counts;
  for (const formats::BoundaryPart& part : boundary) {
    counts.push_back(part.facets);
  }
  counts = core::CountInRuns(counts, facets);
  std::vector<formats::BoundaryPart> counted(boundary.begin(), boundary.end());
  for (size_t i = 0; i < counted.size(); ++i) {
    counted[i].facets = counts[i];
  }
  return counted;
}

}  // namespace

const char kPartsHelp[] =
    "Parts: OUT.pvtu is VTK's list of the pieces OUT_0.vtu, OUT_1.vtu, ...; OUT.vtu and OUT.npz are a file for each\n"
    "part, OUT_0.npz, OUT_1.npz, ...; OUT.msh is one file of Gmsh's MSH 4.1 with all parts and their ghosts.\n"
    "Each part has the numbers of its vertices and simplices in the whole mesh, who owns them, and the rows that a\n"
    "solver gives to vertices when it numbers part after part.\n\n";

void PartitionOptions::AddTo(CLI::App& command) {
  command
      .add_option("--ghost-layers", ghost_layers,
                  "Layers of simplices of other parts around each: those with a vertex in common")
      ->capture_default_str()
      ->check(CLI::Range(uint32_t{0}, kMostGhostLayers));
  command.add_flag("--contiguous", contiguous, "Each part hangs together by facets; parts may be less even then");
}

std::string PartsSummary(const PartFigures& figures, int dimension) {
  const auto [least, most] = std::minmax_element(figures.sizes.begin(), figures.sizes.end());
  return absl::StrFormat("%d parts of %d to %d %s, %.1f %% above the mean; %d facets between parts\n",
                         figures.sizes.size(), *least, *most, formats::SimplexName(dimension), 100 * figures.imbalance,
                         figures.cut_facets);
}

PartFiles::PartFiles(std::string output, const PartitionOptions& options)
    : output_(std::move(output)), extension_(formats::ExtensionOf(output_)), options_(options) {}

std::string PartFiles::PieceOf(uint32_t part) const {
  return formats::PartFileOf(output_, extension_ == ".pvtu" ? ".vtu" : extension_, part);
}

absl::Status PartFiles::Check(const std::function<void(formats::FilePlan&)>& add_files) const {
  if (extension_ != ".pvtu" && extension_ != ".vtu" && extension_ != ".npz" && extension_ != ".msh") {
    return absl::InvalidArgumentError(
        absl::StrCat("--out ", output_, ": parts are written to .pvtu, .vtu, .npz or .msh"));
  }
  // Pieces are different files; so each is held against the others alone.
  for (uint32_t part = 0; part < (is_one_file() ? 1 : options_.parts); ++part) {
    formats::FilePlan files;
    add_files(files);
    if (is_one_file() || extension_ == ".pvtu") {
      files.Writes("--out", output_);
    }
    if (!is_one_file()) {
      files.Writes("--out", PieceOf(part));
    }
    WELLSPACE_RETURN_IF_ERROR(files.Check());
  }
  return formats::CheckMeshOutput(is_one_file() ? output_ : PieceOf(0), "");
}

absl::Status PartFiles::WritePiece(const formats::Mesh& mesh, const core::PartOwners& owners,
                                   const core::MeshPart& part, uint32_t number, std::span<const uint32_t> part_of) {
  const auto take = [&](const auto& values, const auto& rows, size_t width, auto& taken) {
    return core::TakeRows(values, rows, width, context_, taken);
  };
  std::vector<uint32_t> vertex_owners;
  std::vector<uint32_t> vertex_rows;
  std::vector<uint32_t> simplex_owners;
  WELLSPACE_RETURN_IF_ERROR(take(owners.of_vertices, part.vertices, 1, vertex_owners));
  WELLSPACE_RETURN_IF_ERROR(take(owners.rows, part.vertices, 1, vertex_rows));
  WELLSPACE_RETURN_IF_ERROR(take(part_of, part.simplices, 1, simplex_owners));
  const formats::PartNumbers numbers{.part = number,
                                     .parts = options_.parts,
                                     .own_vertices = part.own_vertices,
                                     .own_simplices = part.own_simplices,
                                     .whole_simplices = part_of.size(),
                                     .vertex_ids = part.vertices,
                                     .vertex_owners = vertex_owners,
                                     .vertex_rows = vertex_rows,
                                     .simplex_ids = part.simplices,
                                     .simplex_owners = simplex_owners,
                                     .facet_ids = part.facets};
  formats::Mesh piece;
  WELLSPACE_RETURN_IF_ERROR(take(mesh.points, part.vertices, mesh.dimension, piece.points));
  WELLSPACE_RETURN_IF_ERROR(take(mesh.simplex_regions, part.simplices, 1, piece.simplex_regions));
  WELLSPACE_RETURN_IF_ERROR(take(mesh.weights, part.vertices, 1, piece.weights));
  WELLSPACE_RETURN_IF_ERROR(take(mesh.vertex_origins, part.vertices, 1, piece.vertex_origins));
  WELLSPACE_RETURN_IF_ERROR(take(mesh.vertex_tags, part.vertices, 1, piece.vertex_tags));
  const std::vector<formats::BoundaryPart> boundary = CountedIn(mesh.boundary, part.facets);
  formats::MeshView view = piece.View();
  view.dimension = mesh.dimension;
  view.simplices = part.simplex_corners;
  view.facets = part.facet_corners;
  view.boundary = boundary;
  view.regions = mesh.regions;
  view.part = &numbers;
  piece_shape_ = view.Shape();
  return formats::WriteMesh(PieceOf(number), "", view, /*stop=*/{}, &figures_.notes);
}

absl::Status PartFiles::WritePieces(const formats::Mesh& mesh, const core::PartitionedMesh& partitioned,
                                    const core::PartOwners& owners) {
  std::vector<std::string> pieces;
  for (uint32_t number = 0; number < options_.parts; ++number) {
    WELLSPACE_ASSIGN_OR_RETURN(const core::MeshPart part,
                               core::TakePart(partitioned, owners, number, options_.ghost_layers, context_));
    figures_.ghosts.push_back(part.simplices.size() - part.own_simplices);
    WELLSPACE_RETURN_IF_ERROR(WritePiece(mesh, owners, part, number, partitioned.part_of));
    pieces.push_back(PieceOf(number));
  }
  return extension_ == ".pvtu" ? formats::WritePvtu(output_, piece_shape_, pieces, /*stop=*/{}) : absl::OkStatus();
}

absl::Status PartFiles::WriteOne(const formats::Mesh& mesh, const core::PartitionedMesh& partitioned,
                                 const core::PartOwners& owners) {
  std::vector<uint32_t> ghosts;
  std::vector<uint64_t> first = {0};
  for (uint32_t number = 0; number < options_.parts; ++number) {
    WELLSPACE_ASSIGN_OR_RETURN(const core::MeshPart part,
                               core::TakePart(partitioned, owners, number, options_.ghost_layers, context_));
    ghosts.insert(ghosts.end(), part.simplices.begin() + static_cast<ptrdiff_t>(part.own_simplices),
                  part.simplices.end());
    first.push_back(ghosts.size());
    figures_.ghosts.push_back(first[number + 1] - first[number]);
  }
  const formats::PartitionView view{.parts = options_.parts,
                                    .part_of = partitioned.part_of,
                                    .facet_owners = owners.of_facets,
                                    .ghosts = ghosts,
                                    .first_ghost = first};
  return formats::WritePartitionedMsh(output_, mesh.View(), view, /*stop=*/{}, &figures_.notes);
}

void PartFiles::CountParts(const core::DualGraph& graph, std::span<const uint32_t> part_of) {
  figures_.sizes.assign(options_.parts, 0);
  for (const uint32_t part : part_of) {
    ++figures_.sizes[part];
  }
  figures_.cut_facets = core::CountCut(graph, part_of);
  const uint64_t most = *std::max_element(figures_.sizes.begin(), figures_.sizes.end());
  figures_.imbalance = static_cast<double>(most) * options_.parts / static_cast<double>(part_of.size()) - 1;
}

absl::StatusOr<core::HugeVector<uint32_t>> PartFiles::Cut(const formats::Mesh& mesh) {
  WELLSPACE_ASSIGN_OR_RETURN(const core::DualGraph graph,
                             core::FindDualGraph(mesh.dimension, mesh.simplices, context_));
  WELLSPACE_ASSIGN_OR_RETURN(
      core::HugeVector<uint32_t> part_of,
      core::Partition(graph, {.parts = options_.parts, .contiguous = options_.contiguous}, context_));
  CountParts(graph, part_of);
  return part_of;
}

absl::Status PartFiles::Write(const formats::Mesh& mesh, const std::string& name) {
  figures_ = {};
  const auto named = [&name](const absl::Status& status) {
    return absl::Status(status.code(), absl::StrCat(name, ": ", status.message()));
  };
  const auto part_of = Cut(mesh);
  if (!part_of.ok()) {
    return named(part_of.status());
  }
  const core::PartitionedMesh partitioned{.dimension = mesh.dimension,
                                          .vertex_count = mesh.View().vertex_count(),
                                          .simplices = mesh.simplices,
                                          .facets = mesh.facets,
                                          .part_of = *part_of};
  const absl::StatusOr<core::PartOwners> owners = core::FindOwners(partitioned, context_);
  if (!owners.ok()) {
    return named(owners.status());
  }
  return is_one_file() ? WriteOne(mesh, partitioned, *owners) : WritePieces(mesh, partitioned, *owners);
}

}  // namespace wellspace::cli
