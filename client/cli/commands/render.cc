// wellspace render: a picture of a mesh.
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/interrupt.h"
#include "client/cli/mesh_paths.h"
#include "client/cli/options.h"
#include "client/cli/remote_command.h"
#include "client/cli/render/painter.h"
#include "client/cli/render/scene.h"
#include "client/formats/file_plan.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

struct RenderCommand {
  std::string mesh_path;
  std::string picture_path;
  int width = 1600;
  std::vector<double> plane;  // empty, or normal and offset
  std::string up = "z";
  std::string colour = "auto";
  OutputFormat format = OutputFormat::kText;

  absl::Status Render() const;
};

absl::Status RenderCommand::Render() const {
  if (!plane.empty() && plane.size() != 4) {
    return absl::InvalidArgumentError(absl::StrCat("--plane: expected 4 numbers nx,ny,nz,d, got ", plane.size()));
  }
  WELLSPACE_ASSIGN_OR_RETURN(const render::PictureFormat picture_format, render::PictureFormatOf(picture_path));
  formats::FilePlan files;
  files.ReadsMesh("MESH", mesh_path);
  files.Writes("--out", picture_path);
  WELLSPACE_RETURN_IF_ERROR(files.Check());
  WELLSPACE_ASSIGN_OR_RETURN(const formats::Mesh mesh, ReadMeshInput(mesh_path));
  render::View view;
  view.up = up[0] - 'x';
  if (colour != "auto") {
    view.colouring = colour == "region" ? render::Colouring::kRegion : render::Colouring::kAngle;
  }
  if (!plane.empty()) {
    view.plane = {.normal = {plane[0], plane[1], plane[2]}, .offset = plane[3]};
  }
  const absl::StatusOr<render::Scene> scene = render::MakeScene(mesh.View(), view);
  if (!scene.ok()) {
    return absl::Status(scene.status().code(), absl::StrCat(mesh_path, ": ", scene.status().message()));
  }
  WELLSPACE_RETURN_IF_ERROR(render::WritePicture(*scene, width, picture_format, picture_path));
  if (format == OutputFormat::kJson) {
    PrintJson({{"mesh", mesh_path}, {"picture", picture_path}, {"width", width}});
  }
  return absl::OkStatus();
}

}  // namespace

void AddRenderCommand(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<RenderCommand>();
  CLI::App* render = app.add_subcommand(
      "render",
      "Draw a 2-D or 3-D mesh, coloured by region or by the smallest angle of each simplex; the boundary of a 2-D mesh "
      "is drawn, and 3-D meshes are cut open by a plane");
  render->footer(kExitCodesHelp);
  AddMeshInput(*render, command->mesh_path);
  render->add_option("-o,--out", command->picture_path, "File of the picture, .png or .svg")
      ->required()
      ->type_name("FILE");
  render->add_option("--width", command->width, "Width in pixels")
      ->capture_default_str()
      ->check(CLI::Range(render::kMinWidth, render::kMaxWidth));
  AddNumbers(*render, "--plane", command->plane,
             "nx,ny,nz,d: cut off what lies at n·x > d; default: half of the box, across x");
  render->add_option("--up", command->up, "Axis that points upwards in the picture of a 3-D mesh")
      ->capture_default_str()
      ->check(CLI::IsMember({"x", "y", "z"}));
  render->add_option("--colour", command->colour, "What colours mean; auto: region if the mesh has several, else angle")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "angle", "region"}));
  AddOutput(*render, command->format);
  render->callback([command, &exit_code] {
    const Interrupt interrupt(Interrupt::First::kEnd);
    const absl::Status status = command->Render();
    exit_code = status.ok() ? kExitOk : ReportError(status, command->format);
  });
}

}  // namespace wellspace::cli
