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
#include "client/cli/domain_options.h"
#include "client/cli/exit_codes.h"
#include "client/cli/interrupt.h"
#include "client/cli/mesh_paths.h"
#include "client/cli/meshing_options.h"
#include "client/cli/parameter_options.h"
#include "client/cli/part_name_options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/remote_command.h"
#include "client/files/feature_arrays.h"
#include "client/files/surface_features.h"
#include "client/formats/file_plan.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/open_input.h"
#include "client/formats/mesh_or_cloud.h"
#include "client/formats/registry.h"
#include "client/formats/surface/read_surface.h"
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
  DomainOptions domain;
  bool has_triangles = false;
  bool no_attributes = false;
  std::vector<int> periodic_axes;
  OutputFormat format = OutputFormat::kText;

  absl::Status Convert();
  bool IsSurface() const;
  absl::Status CheckArrays(const char* what) const;
  absl::Status ConvertMesh();
  absl::Status ConvertDomain();
  absl::Status ConvertSurface();
  void Report(const client::Json& figures, CloudReport report, const std::vector<std::string>& losses) const;
};

// Corners of .stl have always been points here.
bool ConvertCommand::IsSurface() const {
  return has_triangles || cloud_options.format == "smesh" ||
         (cloud_options.format.empty() && formats::IsSurfacePath(input) &&
          formats::ExtensionOf(formats::WithoutGzip(input)) != ".stl");
}

absl::Status ConvertCommand::CheckArrays(const char* what) const {
  if (output.order != formats::MeshOrder::kFirst) {
    return absl::InvalidArgumentError(absl::StrCat("--order is for meshes, and IN is a ", what));
  }
  if (!periodic_axes.empty()) {
    return absl::InvalidArgumentError(absl::StrCat("--periodic is for meshes, and IN is a ", what));
  }
  const bool is_npz = output.format.empty() ? formats::ExtensionOf(output.path) == ".npz" : output.format == "npz";
  return is_npz ? absl::OkStatus()
                : absl::InvalidArgumentError(absl::StrCat(
                      "cannot write ", output.path, ": IN is a ", what,
                      ", which .npz has as arrays; expected a file of npz, or `wellspace mesh` for a mesh of it"));
}

absl::Status ConvertCommand::Convert() {
  formats::FilePlan files;
  files.ReadsMesh("IN", input);
  files.WritesMesh("OUT", output.path, output.format);
  WELLSPACE_RETURN_IF_ERROR(files.Check());
  WELLSPACE_RETURN_IF_ERROR(output.Check());
  if (IsSurface()) {
    return ConvertSurface();
  }
  return domain.IsDomain(input, cloud_options.format) ? ConvertDomain() : ConvertMesh();
}

absl::Status ConvertCommand::ConvertDomain() {
  WELLSPACE_RETURN_IF_ERROR(CheckArrays("domain"));
  WELLSPACE_ASSIGN_OR_RETURN(const formats::PointCloud points, domain.Read(input, cloud_options));
  const CloudReport report = ReportOf(cloud_options, points.notes, points.skipped);
  PrintNotes(report, format, /*quiet=*/false);
  const client::Features& features = *domain.features();
  WELLSPACE_RETURN_IF_ERROR(client::WriteFeatureArrays(output.path, points, features, /*stop=*/{}));
  Report({{"kind", "domain"}, {"dimension", 2}, {"points", points.size()}, {"segments", features.ends.size() / 2}},
         report, {});
  return absl::OkStatus();
}

absl::Status ConvertCommand::ConvertSurface() {
  WELLSPACE_RETURN_IF_ERROR(CheckArrays("surface"));
  WELLSPACE_RETURN_IF_ERROR(domain.CheckOther("IN has triangles, which bound solids; give a file of segments"));
  if (!cloud_options.columns.empty() || cloud_options.skip_invalid) {
    return absl::InvalidArgumentError("--columns and --skip-invalid are for points, and IN is a surface");
  }
  WELLSPACE_ASSIGN_OR_RETURN(formats::Surface surface, formats::ReadSurface(input, cloud_options.format));
  client::SurfaceFeatures features = client::FeaturesOf(surface, {}, surface.notes);
  std::map<int32_t, std::string> names;
  for (const formats::Surface::Part& part : surface.parts) {
    names.emplace(part.marker, part.name);
  }
  AddPartNames(names, features.names.markers);
  const CloudReport report = {.notes = surface.notes};
  PrintNotes(report, format, /*quiet=*/false);
  formats::PointCloud points;
  points.dimension = 3;
  points.points = std::move(surface.points);
  WELLSPACE_RETURN_IF_ERROR(client::WriteFeatureArrays(output.path, points, features, /*stop=*/{}));
  Report({{"kind", "surface"}, {"dimension", 3}, {"points", points.size()}, {"triangles", features.corners.size() / 3}},
         report, {});
  return absl::OkStatus();
}

void ConvertCommand::Report(const client::Json& figures, CloudReport report,
                            const std::vector<std::string>& losses) const {
  PrintNotes({.notes = losses}, format, /*quiet=*/false);
  if (format == OutputFormat::kJson) {
    client::Json all = {{"input", input}, {"output", output.path}};
    all.update(figures);
    report.notes.insert(report.notes.end(), losses.begin(), losses.end());
    AddNotes(report, all);
    PrintJson(all);
  }
}

absl::Status ConvertCommand::ConvertMesh() {
  WELLSPACE_RETURN_IF_ERROR(domain.CheckCloud());
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
  view.periodic_axes = periodic_axes;
  const CloudReport report = ReportOf(cloud_options, read.notes, read.skipped);
  PrintNotes(report, format, /*quiet=*/false);
  std::vector<std::string> losses;
  WELLSPACE_RETURN_IF_ERROR(formats::WriteMesh(output.path, output.format, view, /*stop=*/{}, &losses));
  Report({{"kind", read.is_mesh ? "mesh" : "cloud"},
          {"dimension", view.dimension},
          {"vertices", view.vertex_count()},
          {"simplices", view.simplex_count()},
          {"order", static_cast<int>(output.order)}},
         report, losses);
  return absl::OkStatus();
}

}  // namespace

void AddConvertCommand(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<ConvertCommand>();
  CLI::App* convert = app.add_subcommand(
      "convert",
      "Write a mesh, or points, in another format: with boundary, regions, names and attributes as far as both formats "
      "have them; points become vertices of a mesh without simplices; a domain or a surface becomes arrays of .npz, "
      "which wellspace.mesh of Python takes");
  convert->footer(absl::StrCat(kCloudsHelp, kMeshesHelp, kConvertExamples, "\n", kExitCodesHelp));
  convert->add_option("IN", command->input, "File of a mesh, of points, of a domain or of a surface")
      ->required()
      ->type_name("FILE");
  convert->add_option("OUT", command->output.path, "File of the mesh, or - for standard output")
      ->required()
      ->type_name("FILE");
  convert->add_option("--format", command->output.format, "Format of OUT; default: by its extension")
      ->check(CLI::IsMember(formats::MeshFormats()));
  AddMeshOrder(*convert, command->output.order);
  AddCloudOptions(*convert, command->cloud_options, "IN", InputFormats());
  command->domain.AddReadingTo(*convert, "IN");
  convert->add_flag("--triangles", command->has_triangles,
                    "IN is a surface: faces of .stl, .obj, .ply and .off; .smesh and 3-D .poly always are");
  convert->add_flag("--no-attributes", command->no_attributes, "Leave out what points have beside coordinates");
  AddPeriodic(*convert, command->periodic_axes,
              "Axes along which the mesh of IN is periodic, as x,y: OUT gets the pairs of vertices; default: none");
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
