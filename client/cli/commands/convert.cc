// wellspace convert: a file of a mesh or of points in another format.
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/cloud_options.h"
#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/interrupt.h"
#include "client/cli/mesh_paths.h"
#include "client/cli/meshing_options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/remote_command.h"
#include "client/formats/file_plan.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/mesh_or_cloud.h"
#include "client/formats/write_mesh.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

constexpr char kConvertExamples[] =
    "Examples:\n"
    "  wellspace convert land.msh land.su2\n"
    "  wellspace convert part.vtu part.inp --order 2\n"
    "  wellspace convert scan.las scan.vtu\n";

struct ConvertCommand {
  std::string input;
  MeshOutput output;
  formats::CloudOptions cloud_options;
  bool no_attributes = false;
  OutputFormat format = OutputFormat::kText;

  absl::Status Convert();
};

absl::Status ConvertCommand::Convert() {
  formats::FilePlan files;
  files.ReadsMesh("IN", input);
  files.WritesMesh("OUT", output.path, output.format);
  WELLSPACE_RETURN_IF_ERROR(files.Check());
  WELLSPACE_RETURN_IF_ERROR(output.Check());
  cloud_options.keep_attributes = !no_attributes;
  WELLSPACE_ASSIGN_OR_RETURN(formats::MeshOrCloud read, formats::ReadMeshOrCloud(input, cloud_options));
  if (no_attributes) {
    read.attributes.clear();
  }
  // Formats that hold origins get them only if they are known; .node has markers of vertices without.
  const std::string by_name = output.format.empty() ? output.path : "." + output.format;
  MarkVertices(by_name.ends_with(".node") || by_name.ends_with(".ele"), read.mesh);
  formats::MeshView view = read.View();
  view.order = output.order;
  CloudReport report = ReportOf(cloud_options, read.notes, read.skipped);
  PrintNotes(report, format, /*quiet=*/false);
  std::vector<std::string> losses;
  WELLSPACE_RETURN_IF_ERROR(formats::WriteMesh(output.path, output.format, view, /*stop=*/{}, &losses));
  PrintNotes({.notes = losses}, format, /*quiet=*/false);
  if (format == OutputFormat::kJson) {
    Json figures = {{"input", input},
                    {"output", output.path},
                    {"kind", read.is_mesh ? "mesh" : "cloud"},
                    {"dimension", view.dimension},
                    {"vertices", view.vertex_count()},
                    {"simplices", view.simplex_count()},
                    {"order", static_cast<int>(output.order)}};
    report.notes.insert(report.notes.end(), losses.begin(), losses.end());
    AddNotes(report, figures);
    PrintJson(figures);
  }
  return absl::OkStatus();
}

}  // namespace

void AddConvertCommand(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<ConvertCommand>();
  CLI::App* convert = app.add_subcommand(
      "convert",
      "Write a mesh, or points, in another format: with boundary, regions, names and attributes as far as both formats "
      "have them; points become vertices of a mesh without simplices");
  convert->footer(absl::StrCat(kCloudsHelp, kMeshesHelp, kConvertExamples, "\n", kExitCodesHelp));
  convert->add_option("IN", command->input, "File of a mesh or of points")->required()->type_name("FILE");
  convert->add_option("OUT", command->output.path, "File of the mesh, or - for standard output")
      ->required()
      ->type_name("FILE");
  convert->add_option("--format", command->output.format, "Format of OUT; default: by its extension")
      ->check(CLI::IsMember(formats::MeshFormats()));
  AddMeshOrder(*convert, command->output.order);
  AddCloudOptions(*convert, command->cloud_options);
  convert->add_flag("--no-attributes", command->no_attributes, "Leave out what points have beside coordinates");
  AddOutput(*convert, command->format);
  convert->callback([command, &exit_code] {
    const Interrupt interrupt(Interrupt::First::kEnd);
    const absl::Status status =
        command->output.path == formats::kStandardStream && command->format == OutputFormat::kJson
            ? absl::InvalidArgumentError("--output json, and OUT: only one of them can be standard output")
            : command->Convert();
    exit_code = status.ok() ? kExitOk : ReportError(status, command->format);
  });
}

}  // namespace wellspace::cli
