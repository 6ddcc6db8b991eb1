// wellspace upload, download: points to a session, and its mesh to a file.
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/cli/cloud_options.h"
#include "client/cli/commands/commands.h"
#include "client/cli/meshing_options.h"
#include "client/cli/options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/remote_command.h"
#include "client/cli/session_options.h"
#include "client/cli/statistics.h"
#include "client/files/cloud_file.h"
#include "client/files/mesh_file.h"
#include "client/formats/file_plan.h"
#include "client/formats/line_reader.h"
#include "client/formats/write_mesh.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

struct UploadCommand {
  RemoteCommand remote;
  std::string session;
  std::string input;
  formats::CloudOptions cloud_options;
  std::optional<uint64_t> offset;
  uint64_t expected_revision = 0;

  absl::Status Upload(client::Client& client, client::CallOptions call) const;
};

absl::Status UploadCommand::Upload(client::Client& client, client::CallOptions call) const {
  WELLSPACE_ASSIGN_OR_RETURN(const client::Session found, client.GetSession(session, call));
  formats::CloudOptions options = cloud_options;
  options.dimension = found.parameters.dimension;
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<client::CloudFile> opened, client::CloudFile::Open(input, options));
  client::CloudFile& cloud = *opened;
  const CloudReport report = ReportOf(options, cloud.notes(), cloud.skipped());
  PrintNotes(report, remote.format(), remote.quiet());
  const uint64_t first = offset.value_or(found.committed_points);
  call.expected_revision = expected_revision;
  absl::StatusOr<client::Uploaded> uploaded = absl::InternalError("no upload");
  {
    ProgressBar bar(!remote.quiet() && !remote.json());
    const double total = std::max<double>(1, cloud.size());
    uploaded = client.UploadPoints(
        session, cloud, first,
        [&](uint64_t points) { bar.Update("upload", points / total, absl::StrCat(WithThousands(points), " points")); },
        call);
  }
  if (!uploaded.ok()) {
    return WithOrigins(uploaded.status(), first, cloud.size(),
                       [&cloud](uint64_t point) { return cloud.Origin(point); });
  }
  if (remote.json()) {
    Json json = {
        {"session", session}, {"committed_points", uploaded->committed_points}, {"revision", uploaded->revision}};
    AddNotes(report, json);
    PrintJson(json);
  } else if (!remote.quiet()) {
    std::cout << session << ": " << WithThousands(uploaded->committed_points) << " points, revision "
              << uploaded->revision << "\n";
  }
  return absl::OkStatus();
}

struct DownloadCommand {
  RemoteCommand remote;
  std::string session;
  std::string path;
  std::string format;
  bool no_boundary = false;
  uint64_t revision = 0;

  absl::Status Check() const;
  absl::Status Download(client::Client& client, const client::CallOptions& call) const;
};

absl::Status DownloadCommand::Check() const {
  if (remote.json() && path == formats::kStandardStream) {
    return absl::InvalidArgumentError("--output json and --out: only one of them can be standard output");
  }
  WELLSPACE_RETURN_IF_ERROR(formats::CheckMeshOutput(path, format));
  formats::FilePlan files;
  remote.AddFilesTo(files);
  files.WritesMesh("--out", path, format);
  if (remote.json()) {
    files.Writes("--output json", std::string(formats::kStandardStream));
  }
  return files.Check();
}

absl::Status DownloadCommand::Download(client::Client& client, const client::CallOptions& call) const {
  client::MeshFile file(path, format, call.stop);
  if (remote.json()) {
    file.KeepInputVertices();
  }
  if (no_boundary) {
    file.LeaveOutBoundary();
  }
  {
    ProgressBar bar(!remote.quiet() && !remote.json());
    const absl::Status status = client.DownloadMesh(
        session, file, revision,
        [&bar](uint64_t done, uint64_t total) {
          bar.Update("download", total == 0 ? 1 : static_cast<double>(done) / total,
                     absl::StrCat(done, " of ", total, " chunks"));
        },
        call);
    if (!status.ok()) {
      return status;
    }
  }
  if (remote.json()) {
    std::cout << StatisticsJson(file.header(), file.input_vertex(), file.moved_vertices()) << std::flush;
  } else if (!remote.quiet()) {
    std::cerr << Summary(file.header()) << (path == formats::kStandardStream ? "" : " -> " + path) << "\n";
  }
  if (!remote.json()) {
    std::cerr << SliverWarning(file.header()) << (no_boundary || remote.quiet() ? "" : BoundaryWarning(file.header()));
  }
  return absl::OkStatus();
}

void AddUpload(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<UploadCommand>();
  CLI::App* upload = app.add_subcommand("upload", "Add the points of a file to a session");
  upload->footer(absl::StrCat(kCloudsHelp, "\n", kExitCodesHelp));
  AddSession(*upload, command->session);
  upload->add_option("IN", command->input, "File of points, or - for standard input")->required()->type_name("FILE");
  AddCloudOptions(*upload, command->cloud_options);
  AddCount(
      *upload, "--offset", [command](uint64_t offset) { command->offset = offset; },
      "Number of the session's points before the first of IN. What is there from it on has to be the same as in IN, "
      "and is not sent again, so that an upload that broke off is repeated with the same offset; default: after the "
      "session's points");
  AddExpectedRevision(*upload, command->expected_revision);
  command->remote.AddTo(*upload, RemoteCommand::Needs::kLastingServer);
  upload->callback([command, &exit_code] {
    exit_code = command->remote.Run([&command](client::Client& client, const client::CallOptions& call,
                                               const Interrupt&) { return command->Upload(client, call); });
  });
}

void AddDownload(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<DownloadCommand>();
  CLI::App* download = app.add_subcommand("download", "Write the mesh of a session to a file, while it arrives");
  download->footer(absl::StrCat(kMeshesHelp, "\n", kExitCodesHelp));
  AddSession(*download, command->session);
  AddMeshOutput(*download, command->path, command->format, command->no_boundary);
  AddCount(
      *download, "--revision", [command](uint64_t revision) { command->revision = revision; },
      "Fail unless the mesh is of this revision; default: the last", 1);
  command->remote.AddTo(*download, RemoteCommand::Needs::kLastingServer);
  download->callback([command, &exit_code] {
    if (const absl::Status status = command->Check(); !status.ok()) {
      exit_code = ReportError(status, command->remote.format());
      return;
    }
    exit_code = command->remote.Run([&command](client::Client& client, const client::CallOptions& call,
                                               const Interrupt&) { return command->Download(client, call); });
  });
}

}  // namespace

void AddTransferCommands(CLI::App& app, int& exit_code) {
  AddUpload(app, exit_code);
  AddDownload(app, exit_code);
}

}  // namespace wellspace::cli
