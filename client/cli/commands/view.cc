// wellspace view: a page that shows a mesh.
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/browser.h"
#include "client/cli/cloud_options.h"
#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/interrupt.h"
#include "client/cli/options.h"
#include "client/cli/remote_command.h"
#include "client/formats/file_plan.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/output_file.h"
#include "client/formats/io/temporary_folder.h"
#include "client/formats/mesh_or_cloud.h"
#include "client/formats/read_mesh.h"
#include "client/viewer/page.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

constexpr char kViewExamples[] =
    "Examples:\n"
    "  wellspace view spot.vtu                   # opens a browser\n"
    "  wellspace view spot.vtu -o spot.html      # needs no network, and nothing beside it\n";

struct ViewCommand {
  std::string mesh_path;
  std::string page_path;  // empty: in a new folder for temporary files, for the browser
  std::string up = "z";
  OutputFormat format = OutputFormat::kText;

  absl::Status View() const;
};

// The name of the file, without its folders.
std::string NameOf(const std::string& path) {
  return path == formats::kStandardStream ? "mesh" : path.substr(path.find_last_of('/') + 1);
}

// Of VTK's formats with the data of its points and cells.
absl::StatusOr<formats::MeshOrCloud> ReadMeshWithData(const std::string& path) {
  if (path != formats::kStandardStream && !formats::MeshFormatOf(path).empty()) {
    WELLSPACE_ASSIGN_OR_RETURN(formats::MeshOrCloud read, formats::ReadMeshOrCloud(path, {.keep_attributes = true}));
    if (read.is_mesh) {
      return read;
    }
  }
  WELLSPACE_ASSIGN_OR_RETURN(formats::Mesh mesh, formats::ReadMesh(path));
  formats::MeshOrCloud read;
  read.is_mesh = true;
  read.notes = mesh.notes;
  read.mesh = std::move(mesh);
  return read;
}

absl::Status WritePageTo(const std::string& path, const formats::MeshView& mesh, const viewer::PageOptions& options) {
  WELLSPACE_ASSIGN_OR_RETURN(formats::OutputFile file, formats::OutputFile::Create(path));
  viewer::WritePage(mesh, options, file);
  return file.Commit();
}

absl::Status ViewCommand::View() const {
  const bool to_standard_output = page_path == formats::kStandardStream;
  if (to_standard_output && format == OutputFormat::kJson) {
    return absl::InvalidArgumentError("--output json, and --out: only one of them can be standard output");
  }
  formats::FilePlan files;
  files.ReadsMesh("MESH", mesh_path);
  files.Writes("--out", page_path);
  WELLSPACE_RETURN_IF_ERROR(files.Check());
  WELLSPACE_ASSIGN_OR_RETURN(const formats::MeshOrCloud read, ReadMeshWithData(mesh_path));
  const formats::MeshView mesh = read.View();
  if (const absl::Status status = viewer::CheckMesh(mesh); !status.ok()) {
    return absl::Status(status.code(), absl::StrCat(mesh_path, ": ", status.message()));
  }
  const CloudReport report = {.notes = read.notes};
  PrintNotes(report, format, /*quiet=*/false);
  const std::string name = NameOf(mesh_path);
  std::string path = page_path;
  std::optional<formats::TemporaryFolder> folder;
  if (path.empty()) {
    WELLSPACE_ASSIGN_OR_RETURN(formats::TemporaryFolder made, formats::TemporaryFolder::Make());
    path = absl::StrCat(folder.emplace(std::move(made)).path(), "/", name, ".html");
  }
  WELLSPACE_RETURN_IF_ERROR(WritePageTo(path, mesh, {.name = name, .up = up[0] - 'x'}));
  if (folder.has_value()) {
    folder->Keep();  // a browser reads it after the end of this process
  }
  const bool is_open = page_path.empty() && OpenInBrowser(path);
  if (format == OutputFormat::kJson) {
    client::Json figures = {{"mesh", mesh_path}, {"page", path}, {"opened", is_open}};
    AddNotes(report, figures);
    PrintJson(figures);
  } else if (page_path.empty()) {
    std::cout << path << (is_open ? "" : "\nNo browser was found: open this file in one.") << "\n";
  }
  return absl::OkStatus();
}

}  // namespace

void AddViewCommand(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<ViewCommand>();
  CLI::App* view = app.add_subcommand(
      "view",
      "Make a page that shows a 2-D or 3-D mesh in a browser, without any network: boundary by name, cuts, quality, "
      "sizes, regions and data in colours, histograms that select, the worst elements");
  view->footer(absl::StrCat(kViewExamples, "\n", kExitCodesHelp));
  AddMeshInput(*view, command->mesh_path);
  view->add_option("-o,--out", command->page_path,
                   "File of the page, or - for standard output; default: a temporary file, which a browser is to open")
      ->type_name("FILE");
  view->add_option("--up", command->up, "Axis of a 3-D mesh that points upwards at first")
      ->capture_default_str()
      ->check(CLI::IsMember({"x", "y", "z"}));
  AddOutput(*view, command->format);
  view->callback([command, &exit_code] {
    const Interrupt interrupt(Interrupt::First::kEnd);
    const absl::Status status = command->View();
    exit_code = status.ok() ? kExitOk : ReportError(status, command->format);
  });
}

}  // namespace wellspace::cli
