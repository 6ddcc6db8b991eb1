// wellspace mesh: a mesh of a cloud, or of the features that bound a domain.
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/meshing_options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/statistics.h"
#include "client/files/mesh_file.h"
#include "client/formats/file_plan.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/json/statistics.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

constexpr char kMeshExamples[] =
    "Examples:\n"
    "  wellspace mesh coast.csv -o coast.vtu --rho 1.5 --stats -\n"
    "  wellspace mesh lake.geojson -o lake.msh --size 0.01\n"
    "  wellspace mesh part.stl -o part.vtu --facet-length 2%\n"
    "  wellspace mesh cow.csv -o cow.node --domain -1,-1,-1,1,1,1 --server mesher:7233\n"
    "  wellspace mesh cow.csv -o cow.vtu --size 0.2 --size-box -0.5,0,0,0,0.5,0.5,0.05\n"
    "  wellspace mesh cow.csv -o cow.vtu --size-field sizes.csv --gradation 0.2\n";

struct MeshCommand {
  MeshOutput output;
  bool no_attributes = false;
  MeshingOptions options;

  absl::Status CheckOptions() const;
  absl::Status Mesh(client::Client& client, const client::MeshOptions& mesh_options, const formats::PointCloud& cloud,
                    const client::CallOptions& call) const;
  int Run();
};

absl::Status MeshCommand::CheckOptions() const {
  WELLSPACE_RETURN_IF_ERROR(options.Check());
  if (options.has_figures_on_stdout() && output.path == formats::kStandardStream) {
    return absl::InvalidArgumentError("--stats or --output json, and --out: only one of them can be standard output");
  }
  WELLSPACE_RETURN_IF_ERROR(output.Check(options.dimension()));
  formats::FilePlan files;
  options.AddFilesTo(files);
  files.WritesMesh("--out", output.path, output.format);
  return files.Check();
}

absl::Status MeshCommand::Mesh(client::Client& client, const client::MeshOptions& mesh_options,
                               const formats::PointCloud& cloud, const client::CallOptions& call) const {
  // Now that the dimension is known for sure, and before hours of work.
  WELLSPACE_RETURN_IF_ERROR(output.Check(cloud.dimension, mesh_options.pump_weights));
  client::MeshFile file(output.path, output.format, call.stop);
  file.SetOrder(output.order);
  file.KeepInputVertices();
  file.AddAttributes(cloud.attributes);
  file.NameParts(options.PartNames());
  file.SetPeriodicAxes(mesh_options.periodic_axes);
  if (output.no_boundary) {
    file.LeaveOutBoundary();
  }
  {
    ProgressBar bar(!options.remote().quiet());
    const absl::Status status = client.MeshPoints(
        mesh_options, cloud.points, file, [&bar](const client::Progress& progress) { bar.Update(progress); }, call);
    if (!status.ok()) {
      return status;
    }
  }
  std::vector<std::string> notes = options.NotesOf(file.header().statistics);
  const std::vector<std::string> of_file = file.notes();
  notes.insert(notes.end(), of_file.begin(), of_file.end());
  WELLSPACE_RETURN_IF_ERROR(
      options.WriteStatistics(client::StatisticsJson(file.header(), file.input_vertex()).dump(2) + "\n", notes));
  PrintNotes({.notes = notes}, options.remote().format(), options.remote().quiet());
  if (!options.remote().quiet()) {
    std::cerr << Summary(file.header()) << (output.path == formats::kStandardStream ? "" : " -> " + output.path)
              << "\n";
  }
  // A demand that is not met is told of without --quiet or with it; in JSON the statistics have it.
  if (!options.remote().json()) {
    std::cerr << SliverWarning(file.header())
              << (output.no_boundary || options.remote().quiet() ? "" : BoundaryWarning(file.header()));
  }
  return absl::OkStatus();
}

int MeshCommand::Run() {
  if (const absl::Status status = CheckOptions(); !status.ok()) {
    return ReportError(status, options.remote().format());
  }
  if (!no_attributes && !output.no_boundary && formats::HasPlaceForAttributes(output.path, output.format)) {
    options.KeepAttributes();
  }
  return options.Run([this](client::Client& client, const client::MeshOptions& mesh_options,
                            const formats::PointCloud& cloud,
                            const client::CallOptions& call) { return Mesh(client, mesh_options, cloud, call); });
}

}  // namespace

void AddMeshCommand(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<MeshCommand>();
  CLI::App* mesh = app.add_subcommand("mesh", "Mesh a point cloud, a domain in the plane, or the inside of a surface");
  mesh->footer(absl::StrCat(kCloudsHelp, kMeshesHelp, kMeshExamples, "\n", kExitCodesHelp));
  command->options.AddTo(*mesh);
  AddMeshOutput(*mesh, command->output);
  AddNoAttributes(*mesh, command->no_attributes);
  mesh->callback([command, &exit_code] { exit_code = command->Run(); });
}

}  // namespace wellspace::cli
