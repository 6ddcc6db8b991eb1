// wellspace render: a picture of a mesh.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/interrupt.h"
#include "client/cli/mesh_paths.h"
#include "client/cli/options.h"
#include "client/cli/remote_command.h"
#include "client/formats/file_plan.h"
#include "client/formats/io/input_file.h"
#include "client/formats/mesh_or_cloud.h"
#include "client/render/painter.h"
#include "client/render/scene.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

struct RenderCommand {
  std::string mesh_path;
  std::string picture_path;
  int width = 1600;
  std::vector<double> plane;   // empty, or normal and offset
  std::vector<double> camera;  // empty, or the direction to it
  std::string only;
  std::string up = "z";
  std::string colour = "auto";
  std::string field;
  bool draws_points = false;
  OutputFormat format = OutputFormat::kText;

  absl::Status Render() const;
  absl::StatusOr<formats::MeshOrCloud> Read() const;
  absl::Status SetField(const formats::MeshOrCloud& read, render::View& view) const;
  absl::StatusOr<std::vector<bool>> DotsOf(const formats::MeshOrCloud& read) const;
};

// The mesh, with the data of its vertices and simplices if a field is asked for.
absl::StatusOr<formats::MeshOrCloud> RenderCommand::Read() const {
  if ((!field.empty() || draws_points) && mesh_path != formats::kStandardStream) {
    absl::StatusOr<formats::MeshOrCloud> with_data = formats::ReadMeshOrCloud(mesh_path, {.keep_attributes = true});
    if (with_data.ok() && with_data->is_mesh) {
      return with_data;
    }
  }
  formats::MeshOrCloud read;
  WELLSPACE_ASSIGN_OR_RETURN(read.mesh, ReadMeshInput(mesh_path));  // the error names another kind of file
  return read;
}

// Has colours mean the data with the name that is asked for: of vertices or, if these have none, of simplices.
absl::Status RenderCommand::SetField(const formats::MeshOrCloud& read, render::View& view) const {
  view.colouring = render::Colouring::kField;
  std::vector<std::string> names;
  for (const bool are_of_simplices : {false, true}) {
    for (const formats::Attribute& attribute : are_of_simplices ? read.mesh.simplex_attributes : read.attributes) {
      if (attribute.name == field) {
        view.field = &attribute;
        view.is_field_of_simplices = are_of_simplices;
        return absl::OkStatus();
      }
      names.push_back(attribute.name);
    }
  }
  return absl::InvalidArgumentError(absl::StrCat("--field ", field, ": ", mesh_path, " has no such data; ",
                                                 names.empty()
                                                     ? "expected a .vtu, .vtk, .vtp, .14 or .2dm with some"
                                                     : absl::StrCat("expected one of ", absl::StrJoin(names, ", "))));
}

// Which vertices are input points.
absl::StatusOr<std::vector<bool>> RenderCommand::DotsOf(const formats::MeshOrCloud& read) const {
  const std::vector<uint32_t>& origins = read.mesh.vertex_origins;
  std::vector<bool> dots(read.mesh.View().vertex_count());
  for (size_t v = 0; v < dots.size(); ++v) {
    dots[v] = origins.size() == dots.size() ? origins[v] < formats::kMiddleOrigin : v < read.input_vertices;
  }
  if (std::find(dots.begin(), dots.end(), true) == dots.end()) {
    return absl::InvalidArgumentError(
        absl::StrCat("--points: ", mesh_path,
                     " does not tell which vertices are input points; expected a .vtu, .vtk or .npz of wellspace"));
  }
  return dots;
}

absl::Status RenderCommand::Render() const {
  if (!plane.empty() && plane.size() != 4) {
    return absl::InvalidArgumentError(absl::StrCat("--plane: expected 4 numbers nx,ny,nz,d, got ", plane.size()));
  }
  if (!camera.empty() && camera.size() != 3) {
    return absl::InvalidArgumentError(absl::StrCat("--camera: expected 3 numbers x,y,z, got ", camera.size()));
  }
  WELLSPACE_ASSIGN_OR_RETURN(const render::PictureFormat picture_format, render::PictureFormatOf(picture_path));
  formats::FilePlan files;
  files.ReadsMesh("MESH", mesh_path);
  files.Writes("--out", picture_path);
  WELLSPACE_RETURN_IF_ERROR(files.Check());
  WELLSPACE_ASSIGN_OR_RETURN(const formats::MeshOrCloud read, Read());
  render::View view;
  if (!field.empty()) {
    WELLSPACE_RETURN_IF_ERROR(SetField(read, view));
  }
  if (draws_points) {
    WELLSPACE_ASSIGN_OR_RETURN(view.dots, DotsOf(read));
  }
  view.up = up[0] - 'x';
  view.only_boundary = !only.empty();
  if (colour != "auto") {
    view.colouring = colour == "region"     ? render::Colouring::kRegion
                     : colour == "boundary" ? render::Colouring::kBoundary
                                            : render::Colouring::kAngle;
  }
  if (!camera.empty()) {
    view.camera = {camera[0], camera[1], camera[2]};
  }
  if (!plane.empty()) {
    view.plane = {.normal = {plane[0], plane[1], plane[2]}, .offset = plane[3]};
  }
  const absl::StatusOr<render::Scene> scene = render::MakeScene(read.mesh.View(), view);
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
      "Draw a 2-D or 3-D mesh, coloured by region, by parts of the boundary, or by the smallest angle of each simplex; "
      "the boundary of a 2-D mesh is drawn, and 3-D meshes are cut open by a plane");
  render->footer(kExitCodesHelp);
  AddMeshInput(*render, command->mesh_path);
  render->add_option("-o,--out", command->picture_path, "File of the picture, .png, .svg or .pdf")
      ->required()
      ->type_name("FILE");
  render->add_option("--width", command->width, "Width in pixels")
      ->capture_default_str()
      ->check(CLI::Range(render::kMinWidth, render::kMaxWidth));
  CLI::Option* const plane = AddNumbers(*render, "--plane", command->plane,
                                        "nx,ny,nz,d: cut off what lies at n·x > d; default: half of the box, across x");
  AddNumbers(*render, "--camera", command->camera,
             "x,y,z: direction of a 3-D mesh from which it is seen; default: a little beside the normal of the plane");
  render->add_option("--only", command->only, "boundary: a 3-D mesh as it is from outside, and nothing is cut off")
      ->check(CLI::IsMember({"boundary"}))
      ->excludes(plane);
  render->add_option("--up", command->up, "Axis that points upwards in the picture of a 3-D mesh")
      ->capture_default_str()
      ->check(CLI::IsMember({"x", "y", "z"}));
  render
      ->add_option("--colour", command->colour,
                   "What colours mean; auto: with --only boundary its parts if there are several, else region if the "
                   "mesh has several, else angle")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "angle", "boundary", "region"}));
  render
      ->add_option(
          "--field", command->field,
          "Colours mean these data of vertices, such as a solution; of .vtu, .vtk, .vtp, .14 and .2dm; or of cells, of "
          "the first three. A vector is NAME:0, NAME:1, ...")
      ->type_name("NAME")
      ->excludes("--colour");
  render->add_flag("--points", command->draws_points,
                   "Draw a dot at each vertex that is an input point, as the mesh's file tells");
  AddOutput(*render, command->format);
  render->callback([command, &exit_code] {
    const Interrupt interrupt(Interrupt::First::kEnd);
    const absl::Status status = command->Render();
    exit_code = status.ok() ? kExitOk : ReportError(status, command->format);
  });
}

}  // namespace wellspace::cli
