// wellspace partition: parts of a mesh for the ranks of a solver.
#include "core/partition/partition.h"

#include <algorithm>
#include <cstddef>
#include <iostream>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/interrupt.h"
#include "client/cli/json.h"
#include "client/cli/mesh_paths.h"
#include "client/cli/options.h"
#include "client/cli/remote_command.h"
#include "client/formats/file_plan.h"
#include "client/formats/registry.h"
#include "client/formats/write_mesh.h"
#include "client/formats/write_parts.h"
#include "core/base/status_macros.h"
#include "core/partition/mesh_part.h"

namespace wellspace::cli {
namespace {

constexpr char kPartitionExamples[] =
    "Files: OUT.pvtu is VTK's list of the pieces OUT_0.vtu, OUT_1.vtu, ...; OUT.vtu and OUT.npz are a file for each\n"
    "part, OUT_0.npz, OUT_1.npz, ...; OUT.msh is one file of Gmsh's MSH 4.1 with all parts and their ghosts.\n"
    "Each part has the numbers of its vertices and simplices in the whole mesh, who owns them, and the rows that a\n"
    "solver gives to vertices when it numbers part after part.\n\n"
    "Examples:\n"
    "  wellspace partition mesh.vtu -n 8 -o parts.pvtu\n"
    "  wellspace partition mesh.msh -n 4 --ghost-layers 2 -o part.npz\n";

constexpr uint32_t kMostGhostLayers = 1000;

struct PartitionCommand {
  std::string mesh_path;
  std::string output;
  uint32_t parts = 1;
  uint32_t ghost_layers = 1;
  bool contiguous = false;
  OutputFormat format = OutputFormat::kText;

  absl::Status Run();

 private:
  // One file for all parts, or one each.
  bool is_one_file() const { return extension_ == ".msh"; }
  std::string PieceOf(uint32_t part) const {
    return formats::PartFileOf(output, extension_ == ".pvtu" ? ".vtu" : extension_, part);
  }

  absl::Status CheckFiles();
  absl::Status WritePieces(const formats::Mesh& mesh, const core::PartitionedMesh& partitioned,
                           const core::PartOwners& owners);
  absl::Status WriteOne(const formats::Mesh& mesh, const core::PartitionedMesh& partitioned,
                        const core::PartOwners& owners);
  absl::Status WritePiece(const formats::Mesh& mesh, const core::PartOwners& owners, const core::MeshPart& part,
                          uint32_t number, std::span<const uint32_t> part_of);
  void Print(const formats::MeshView& mesh, const core::DualGraph& graph, std::span<const uint32_t> part_of) const;

  std::string extension_;
  core::RunContext context_;
  std::vector<std::string> notes_;
  std::vector<uint64_t> ghosts_;  // by part: simplices
  formats::MeshShape piece_shape_;
};

absl::Status PartitionCommand::CheckFiles() {
  extension_ = formats::ExtensionOf(output);
  if (extension_ != ".pvtu" && extension_ != ".vtu" && extension_ != ".npz" && extension_ != ".msh") {
    return absl::InvalidArgumentError(
        absl::StrCat("--out ", output, ": parts are written to .pvtu, .vtu, .npz or .msh"));
  }
  // Pieces are different files; so each is held against the mesh alone.
  for (uint32_t part = 0; part < (is_one_file() ? 1 : parts); ++part) {
    formats::FilePlan files;
    files.ReadsMesh("MESH", mesh_path);
    if (is_one_file() || extension_ == ".pvtu") {
      files.Writes("--out", output);
    }
    if (!is_one_file()) {
      files.Writes("--out", PieceOf(part));
    }
    WELLSPACE_RETURN_IF_ERROR(files.Check());
  }
  return formats::CheckMeshOutput(is_one_file() ? output : PieceOf(0), "");
}

// The rows of `values`, of `width` numbers each, that `rows` name; none if there are no values.
template <typename T>
std::vector<T> RowsOf(std::span<const T> values, std::span<const uint32_t> rows, size_t width) {
  std::vector<T> taken;
  if (values.empty()) {
    return taken;
  }
  taken.reserve(rows.size() * width);
  for (const uint32_t row : rows) {
    taken.insert(taken.end(), values.begin() + row * width, values.begin() + (row + 1) * width);
  }
  return taken;
}

// The parts of the boundary, with the counts of those facets alone that a part owns; facets ascend.
std::vector<formats::BoundaryPart> CountedIn(std::span<const formats::BoundaryPart> boundary,
                                             std::span<const uint32_t> facets) {
  std::vector<formats::BoundaryPart> counted;
  uint64_t end = 0;
  size_t at = 0;
  for (const formats::BoundaryPart& part : boundary) {
    end += part.facets;
    const size_t begin = at;
    while (at < facets.size() && facets[at] < end) {
      ++at;
    }
    counted.push_back({.tag = part.tag, .name = part.name, .facets = at - begin});
  }
  return counted;
}

absl::Status PartitionCommand::WritePiece(const formats::Mesh& mesh, const core::PartOwners& owners,
                                          const core::MeshPart& part, uint32_t number,
                                          std::span<const uint32_t> part_of) {
  const std::vector<uint32_t> vertex_owners = RowsOf<uint32_t>(owners.of_vertices, part.vertices, 1);
  const std::vector<uint32_t> vertex_rows = RowsOf<uint32_t>(owners.rows, part.vertices, 1);
  const std::vector<uint32_t> simplex_owners = RowsOf<uint32_t>(part_of, part.simplices, 1);
  const formats::PartNumbers numbers{.part = number,
                                     .parts = parts,
                                     .own_vertices = part.own_vertices,
                                     .own_simplices = part.own_simplices,
                                     .whole_simplices = part_of.size(),
                                     .vertex_ids = part.vertices,
                                     .vertex_owners = vertex_owners,
                                     .vertex_rows = vertex_rows,
                                     .simplex_ids = part.simplices,
                                     .simplex_owners = simplex_owners,
                                     .facet_ids = part.facets};
  const std::vector<double> points = RowsOf<double>(mesh.points, part.vertices, mesh.dimension);
  const std::vector<int32_t> regions = RowsOf<int32_t>(mesh.simplex_regions, part.simplices, 1);
  const std::vector<double> weights = RowsOf<double>(mesh.weights, part.vertices, 1);
  const std::vector<uint32_t> origins = RowsOf<uint32_t>(mesh.vertex_origins, part.vertices, 1);
  const std::vector<int32_t> tags = RowsOf<int32_t>(mesh.vertex_tags, part.vertices, 1);
  const std::vector<formats::BoundaryPart> boundary = CountedIn(mesh.boundary, part.facets);
  const formats::MeshView view{.dimension = mesh.dimension,
                               .points = points,
                               .simplices = part.simplex_corners,
                               .weights = weights,
                               .vertex_origins = origins,
                               .vertex_tags = tags,
                               .facets = part.facet_corners,
                               .boundary = boundary,
                               .simplex_regions = regions,
                               .regions = mesh.regions,
                               .part = &numbers};
  piece_shape_ = view.Shape();
  return formats::WriteMesh(PieceOf(number), "", view, /*stop=*/{}, &notes_);
}

absl::Status PartitionCommand::WritePieces(const formats::Mesh& mesh, const core::PartitionedMesh& partitioned,
                                           const core::PartOwners& owners) {
  std::vector<std::string> pieces;
  for (uint32_t number = 0; number < parts; ++number) {
    WELLSPACE_ASSIGN_OR_RETURN(const core::MeshPart part,
                               core::TakePart(partitioned, owners, number, ghost_layers, context_));
    ghosts_.push_back(part.simplices.size() - part.own_simplices);
    WELLSPACE_RETURN_IF_ERROR(WritePiece(mesh, owners, part, number, partitioned.part_of));
    pieces.push_back(PieceOf(number));
  }
  return extension_ == ".pvtu" ? formats::WritePvtu(output, piece_shape_, pieces, /*stop=*/{}) : absl::OkStatus();
}

absl::Status PartitionCommand::WriteOne(const formats::Mesh& mesh, const core::PartitionedMesh& partitioned,
                                        const core::PartOwners& owners) {
  std::vector<uint32_t> ghosts;
  std::vector<uint64_t> first = {0};
  for (uint32_t number = 0; number < parts; ++number) {
    WELLSPACE_ASSIGN_OR_RETURN(const core::MeshPart part,
                               core::TakePart(partitioned, owners, number, ghost_layers, context_));
    ghosts.insert(ghosts.end(), part.simplices.begin() + static_cast<ptrdiff_t>(part.own_simplices),
                  part.simplices.end());
    first.push_back(ghosts.size());
    ghosts_.push_back(first[number + 1] - first[number]);
  }
  const formats::PartitionView view{.parts = parts,
                                    .part_of = partitioned.part_of,
                                    .facet_owners = owners.of_facets,
                                    .ghosts = ghosts,
                                    .first_ghost = first};
  return formats::WritePartitionedMsh(output, mesh.View(), view, /*stop=*/{}, &notes_);
}

void PartitionCommand::Print(const formats::MeshView& mesh, const core::DualGraph& graph,
                             std::span<const uint32_t> part_of) const {
  std::vector<uint64_t> sizes(parts, 0);
  for (const uint32_t part : part_of) {
    ++sizes[part];
  }
  const uint64_t cut = core::CountCut(graph, part_of);
  const auto [least, most] = std::minmax_element(sizes.begin(), sizes.end());
  const double imbalance = static_cast<double>(*most) * parts / static_cast<double>(part_of.size()) - 1;
  if (format == OutputFormat::kJson) {
    Json figures = {{"mesh", mesh_path},
                    {"output", output},
                    {"dimension", mesh.dimension},
                    {"vertices", mesh.vertex_count()},
                    {"simplices", mesh.simplex_count()},
                    {"parts", sizes},
                    {"ghosts", ghosts_},
                    {"cut_facets", cut},
                    {"imbalance", imbalance},
                    {"notes", notes_}};
    PrintJson(figures);
    return;
  }
  for (const std::string& note : notes_) {
    std::cerr << "wellspace: note: " << note << "\n";
  }
  std::cout << absl::StreamFormat("%d parts of %d to %d %s, %.1f %% above the mean; %d facets between parts\n", parts,
                                  *least, *most, formats::SimplexName(mesh.dimension), 100 * imbalance, cut);
}

absl::Status PartitionCommand::Run() {
  WELLSPACE_RETURN_IF_ERROR(CheckFiles());
  WELLSPACE_ASSIGN_OR_RETURN(formats::Mesh mesh, ReadMeshInput(mesh_path));
  MarkVertices(/*always=*/true, mesh);
  const auto named = [this](const absl::Status& status) {
    return absl::Status(status.code(), absl::StrCat(mesh_path, ": ", status.message()));
  };
  const absl::StatusOr<core::DualGraph> graph = core::FindDualGraph(mesh.dimension, mesh.simplices, context_);
  if (!graph.ok()) {
    return named(graph.status());
  }
  const auto part_of = core::Partition(*graph, {.parts = parts, .contiguous = contiguous}, context_);
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
  WELLSPACE_RETURN_IF_ERROR(is_one_file() ? WriteOne(mesh, partitioned, *owners)
                                          : WritePieces(mesh, partitioned, *owners));
  Print(mesh.View(), *graph, *part_of);
  return absl::OkStatus();
}

}  // namespace

void AddPartitionCommand(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<PartitionCommand>();
  CLI::App* partition = app.add_subcommand("partition",
                                           "Cut a mesh into parts for the ranks of a solver: even ones with few facets "
                                           "between them, each with the simplices around it");
  partition->footer(absl::StrCat(kPartitionExamples, "\n", kExitCodesHelp));
  AddMeshInput(*partition, command->mesh_path);
  partition->add_option("-n,--parts", command->parts, "Number of parts")
      ->required()
      ->check(CLI::Range(uint32_t{1}, core::kMaxParts));
  partition->add_option("-o,--out", command->output, "File of the parts: .pvtu, .vtu, .npz or .msh")
      ->required()
      ->type_name("FILE");
  partition
      ->add_option("--ghost-layers", command->ghost_layers,
                   "Layers of simplices of other parts around each: those with a vertex in common")
      ->capture_default_str()
      ->check(CLI::Range(uint32_t{0}, kMostGhostLayers));
  partition->add_flag("--contiguous", command->contiguous,
                      "Each part hangs together by facets; parts may be less even then");
  AddOutput(*partition, command->format);
  partition->callback([command, &exit_code] {
    const Interrupt interrupt(Interrupt::First::kEnd);
    const absl::Status status = command->Run();
    exit_code = status.ok() ? kExitOk : ReportError(status, command->format);
  });
}

}  // namespace wellspace::cli
