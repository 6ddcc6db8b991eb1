// wellspace mesh: a mesh of a cloud, or of the features that bound a domain.
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/mesh_paths.h"
#include "client/cli/meshing_options.h"
#include "client/cli/options.h"
#include "client/cli/part_files.h"
#include "client/cli/progress_bar.h"
#include "client/cli/statistics.h"
#include "client/files/mesh_file.h"
#include "client/formats/file_plan.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/json/statistics.h"
#include "client/mesh_sink.h"
#include "core/base/status_macros.h"
#include "core/partition/partition.h"

namespace wellspace::cli {
namespace {

constexpr char kMeshExamples[] =
    "Examples:\n"
    "  wellspace mesh coast.csv -o coast.vtu --rho 1.5 --stats -\n"
    "  wellspace mesh lake.geojson -o lake.msh --size 0.01\n"
    "  wellspace mesh part.stl -o part.vtu --facet-length 2%\n"
    "  wellspace mesh part.stl -o part.pvtu --parts 8\n"
    "  wellspace mesh cow.csv -o cow.node --domain -1,-1,-1,1,1,1 --server mesher:7233\n"
    "  wellspace mesh cow.csv -o cow.vtu --size 0.2 --size-box -0.5,0,0,0,0.5,0.5,0.05\n"
    "  wellspace mesh cow.csv -o cow.vtu --size-field sizes.csv --gradation 0.2\n";

struct MeshCommand {
  MeshOutput output;
  bool no_attributes = false;
  PartitionOptions partition;
  bool has_parts = false;
  MeshingOptions options;

  absl::Status CheckOptions() const;
  absl::Status CheckPartsOptions() const;
  absl::Status Mesh(client::Client& client, const client::MeshOptions& mesh_options, const formats::PointCloud& cloud,
                    const client::CallOptions& call) const;
  // The same in parts.
  absl::Status MeshInParts(client::Client& client, const client::MeshOptions& mesh_options,
                           const formats::PointCloud& cloud, const client::CallOptions& call) const;
  absl::Status Receive(client::Client& client, const client::MeshOptions& mesh_options,
                       const formats::PointCloud& cloud, const client::CallOptions& call, client::MeshSink& sink) const;
  // Tells of a mesh that was written.
  absl::Status Report(const client::MeshHeader& header, const std::vector<uint32_t>& input_vertex,
                      const std::vector<std::string>& notes_of_file) const;
  int Run();
};

absl::Status MeshCommand::CheckPartsOptions() const {
  const auto refuse = [](const char* option) {
    return absl::InvalidArgumentError(
        absl::StrCat(option, " and --parts: parts are whole, of the first order, in the format of their file"));
  };
  if (!output.format.empty()) {
    return refuse("--format");
  }
  if (output.order != formats::MeshOrder::kFirst) {
    return refuse("--order");
  }
  if (output.no_boundary) {
    return refuse("--no-boundary");
  }
  return PartFiles(output.path, partition).Check([this](formats::FilePlan& files) { options.AddFilesTo(files); });
}

absl::Status MeshCommand::CheckOptions() const {
  WELLSPACE_RETURN_IF_ERROR(options.Check());
  if (options.has_figures_on_stdout() && output.path == formats::kStandardStream) {
    return absl::InvalidArgumentError("--stats or --output json, and --out: only one of them can be standard output");
  }
  if (has_parts) {
    return CheckPartsOptions();
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
  WELLSPACE_RETURN_IF_ERROR(Receive(client, mesh_options, cloud, call, file));
  return Report(file.header(), file.input_vertex(), file.notes());
}

absl::Status MeshCommand::MeshInParts(client::Client& client, const client::MeshOptions& mesh_options,
                                      const formats::PointCloud& cloud, const client::CallOptions& call) const {
  client::MeshCollector collector;
  WELLSPACE_RETURN_IF_ERROR(Receive(client, mesh_options, cloud, call, collector));
  const std::vector<uint32_t> input_vertex = std::move(collector.mesh().input_vertex);
  formats::Mesh mesh = [&] {
    client::NameParts(options.PartNames(), collector.mesh().boundary);
    return client::ToFormats(std::move(collector.mesh()));
  }();
  MarkVertices(/*always=*/true, mesh);  // those of a server that is too old to do so
  PartFiles files(output.path, partition);
  WELLSPACE_RETURN_IF_ERROR(files.Write(mesh, "--parts"));
  WELLSPACE_RETURN_IF_ERROR(Report(collector.header(), input_vertex, files.figures().notes));
  if (!options.remote().quiet()) {
    std::cerr << PartsSummary(files.figures(), mesh.dimension);
  }
  return absl::OkStatus();
}

absl::Status MeshCommand::Receive(client::Client& client, const client::MeshOptions& mesh_options,
                                  const formats::PointCloud& cloud, const client::CallOptions& call,
                                  client::MeshSink& sink) const {
  ProgressBar bar(!options.remote().quiet());
  return client.MeshPoints(
      mesh_options, cloud.points, sink, [&bar](const client::Progress& progress) { bar.Update(progress); }, call);
}

absl::Status MeshCommand::Report(const client::MeshHeader& header, const std::vector<uint32_t>& input_vertex,
                                 const std::vector<std::string>& notes_of_file) const {
  std::vector<std::string> notes = options.NotesOf(header.statistics);
  notes.insert(notes.end(), notes_of_file.begin(), notes_of_file.end());
  WELLSPACE_RETURN_IF_ERROR(
      options.WriteStatistics(client::StatisticsJson(header, input_vertex).dump(2) + "\n", notes));
  PrintNotes({.notes = notes}, options.remote().format(), options.remote().quiet());
  if (!options.remote().quiet()) {
    std::cerr << Summary(header) << (output.path == formats::kStandardStream ? "" : " -> " + output.path) << "\n";
  }
  // A demand that is not met is told of without --quiet or with it; in JSON the statistics have it.
  if (!options.remote().json()) {
    std::cerr << SliverWarning(header)
              << (output.no_boundary || options.remote().quiet() ? "" : BoundaryWarning(header));
  }
  return absl::OkStatus();
}

int MeshCommand::Run() {
  if (const absl::Status status = CheckOptions(); !status.ok()) {
    return ReportError(status, options.remote().format());
  }
  if (!has_parts && !no_attributes && !output.no_boundary &&
      formats::HasPlaceForAttributes(output.path, output.format)) {
    options.KeepAttributes();
  }
  return options.Run([this](client::Client& client, const client::MeshOptions& mesh_options,
                            const formats::PointCloud& cloud, const client::CallOptions& call) {
    return has_parts ? MeshInParts(client, mesh_options, cloud, call) : Mesh(client, mesh_options, cloud, call);
  });
}

}  // namespace

void AddMeshCommand(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<MeshCommand>();
  CLI::App* mesh = app.add_subcommand("mesh", "Mesh a point cloud, a domain in the plane, or the inside of a surface");
  mesh->footer(absl::StrCat(kCloudsHelp, kMeshesHelp, kMeshExamples, "\n", kExitCodesHelp));
  command->options.AddTo(*mesh);
  AddMeshOutput(*mesh, command->output);
  AddNoAttributes(*mesh, command->no_attributes);
  CLI::Option* const parts = AddCount(
      *mesh, "--parts",
      [command](uint64_t count) {
        command->partition.parts = static_cast<uint32_t>(count);
        command->has_parts = true;
      },
      "Cut the mesh into so many parts for the ranks of a solver, as wellspace partition does: --out is then a .pvtu, "
      ".vtu, .npz or .msh, and attributes of points are left out",
      1, core::kMaxParts);
  command->partition.AddTo(*mesh);
  for (const char* const option : {"--ghost-layers", "--contiguous"}) {
    mesh->get_option(option)->needs(parts);
  }
  mesh->callback([command, &exit_code] { exit_code = command->Run(); });
}

}  // namespace wellspace::cli
