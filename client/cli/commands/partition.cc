// wellspace partition: parts of a mesh for the ranks of a solver.
#include "core/partition/partition.h"

#include <iostream>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/interrupt.h"
#include "client/cli/mesh_paths.h"
#include "client/cli/options.h"
#include "client/cli/part_files.h"
#include "client/cli/remote_command.h"
#include "client/json/json.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

constexpr char kPartitionExamples[] =
    "Examples:\n"
    "  wellspace partition mesh.vtu -n 8 -o parts.pvtu\n"
    "  wellspace partition mesh.msh -n 4 --ghost-layers 2 -o part.npz\n";

struct PartitionCommand {
  std::string mesh_path;
  std::string output;
  PartitionOptions options;
  OutputFormat format = OutputFormat::kText;

  absl::Status Run();

 private:
  void Print(const formats::MeshView& mesh, const PartFigures& figures) const;
};

void PartitionCommand::Print(const formats::MeshView& mesh, const PartFigures& figures) const {
  if (format == OutputFormat::kJson) {
    PrintJson({{"mesh", mesh_path},
               {"output", output},
               {"dimension", mesh.dimension},
               {"vertices", mesh.vertex_count()},
               {"simplices", mesh.simplex_count()},
               {"parts", figures.sizes},
               {"ghosts", figures.ghosts},
               {"cut_facets", figures.cut_facets},
               {"imbalance", figures.imbalance},
               {"notes", figures.notes}});
    return;
  }
  for (const std::string& note : figures.notes) {
    std::cerr << "wellspace: note: " << note << "\n";
  }
  std::cout << PartsSummary(figures, mesh.dimension);
}

absl::Status PartitionCommand::Run() {
  PartFiles files(output, options);
  WELLSPACE_RETURN_IF_ERROR(files.Check([this](formats::FilePlan& plan) { plan.ReadsMesh("MESH", mesh_path); }));
  WELLSPACE_ASSIGN_OR_RETURN(formats::Mesh mesh, ReadMeshInput(mesh_path));
  MarkVertices(/*always=*/true, mesh);
  WELLSPACE_RETURN_IF_ERROR(files.Write(mesh, mesh_path));
  Print(mesh.View(), files.figures());
  return absl::OkStatus();
}

}  // namespace

void AddPartitionCommand(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<PartitionCommand>();
  CLI::App* partition = app.add_subcommand("partition",
                                           "Cut a mesh into parts for the ranks of a solver: even ones with few facets "
                                           "between them, each with the simplices around it");
  partition->footer(absl::StrCat(kPartsHelp, kPartitionExamples, "\n", kExitCodesHelp));
  AddMeshInput(*partition, command->mesh_path);
  partition->add_option("-n,--parts", command->options.parts, "Number of parts")
      ->required()
      ->check(CLI::Range(uint32_t{1}, core::kMaxParts));
  partition->add_option("-o,--out", command->output, "File of the parts: .pvtu, .vtu, .npz or .msh")
      ->required()
      ->type_name("FILE");
  command->options.AddTo(*partition);
  AddOutput(*partition, command->format);
  partition->callback([command, &exit_code] {
    const Interrupt interrupt(Interrupt::First::kEnd);
    const absl::Status status = command->Run();
    exit_code = status.ok() ? kExitOk : ReportError(status, command->format);
  });
}

}  // namespace wellspace::cli
