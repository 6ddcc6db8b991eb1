// wellspace upload, download: points and segments to a session, and its mesh to a file.
#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/cli/cloud_options.h"
#include "client/cli/commands/commands.h"
#include "client/cli/domain_options.h"
#include "client/cli/mesh_paths.h"
#include "client/cli/meshing_options.h"
#include "client/cli/options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/remote_command.h"
#include "client/cli/session_options.h"
#include "client/cli/statistics.h"
#include "client/files/cloud_file.h"
#include "client/files/mesh_file.h"
#include "client/formats/domain/read_planar_domain.h"
#include "client/formats/file_plan.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/point_source.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

struct UploadCommand {
  RemoteCommand remote;
  std::string session;
  std::string input;
  formats::CloudOptions cloud_options;
  DomainOptions domain;
  std::optional<uint64_t> offset;
  std::optional<uint64_t> segment_offset;
  std::optional<uint64_t> seed_offset;
  std::optional<uint64_t> expected_revision;

  absl::Status CheckOptions() const;
  absl::Status Upload(client::Client& client, client::CallOptions call, const Interrupt& interrupt);
  absl::Status UploadCloud(client::Client& client, const client::Session& found, const client::CallOptions& call,
                           const Interrupt& interrupt);
  absl::Status UploadDomain(client::Client& client, const client::Session& found, const client::CallOptions& call,
                            const Interrupt& interrupt);
  // Sends `total` points from number `first` of the session on, and shows how far that is.
  absl::StatusOr<client::Uploaded> Send(client::Client& client, client::PointSource& source, uint64_t first,
                                        uint64_t total, const client::CallOptions& call) const;
};

// Segments whose ends are numbers of points of the session, of which the first is `first`, and seeds whose polygons are
// numbers of its segments, after `segments` others.
absl::StatusOr<client::Features> Shifted(client::Features features, uint64_t first, uint64_t points,
                                         uint64_t segments) {
  if (first > client::kNoVertex - std::min<uint64_t>(points, client::kNoVertex)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--offset: after ", first, " points no segment can name those of IN; 2^32 - 1 points have numbers"));
  }
  for (uint32_t& end : features.ends) {
    end += static_cast<uint32_t>(first);
  }
  for (client::FaceSeed& seed : features.seeds) {
    seed.first_segment += segments;
  }
  for (uint32_t& group : features.groups) {
    group += static_cast<uint32_t>(segments);  // those of another file are others
  }
  return features;
}

absl::Status UploadCommand::CheckOptions() const {
  if (domain.IsDomain(input, cloud_options.format)) {
    return absl::OkStatus();
  }
  if (segment_offset.has_value() || seed_offset.has_value()) {
    return absl::InvalidArgumentError(
        absl::StrCat(segment_offset.has_value() ? "--segment-offset" : "--seed-offset",
                     ": IN has points alone; give a domain, such as a .poly or .geojson, or --segments"));
  }
  return domain.CheckCloud();
}

absl::StatusOr<client::Uploaded> UploadCommand::Send(client::Client& client, client::PointSource& source,
                                                     uint64_t first, uint64_t total,
                                                     const client::CallOptions& call) const {
  ProgressBar bar(!remote.quiet() && !remote.json());
  const double all = std::max<double>(1, total);
  return client.UploadPoints(
      session, source, first,
      [&](uint64_t points) { bar.Update("upload", points / all, absl::StrCat(WithThousands(points), " points")); },
      call);
}

absl::Status UploadCommand::Upload(client::Client& client, client::CallOptions call, const Interrupt& interrupt) {
  WELLSPACE_ASSIGN_OR_RETURN(const client::Session found, client.GetSession(session, call));
  call.expected_revision = expected_revision;
  return domain.IsDomain(input, cloud_options.format) ? UploadDomain(client, found, call, interrupt)
                                                      : UploadCloud(client, found, call, interrupt);
}

absl::Status UploadCommand::UploadCloud(client::Client& client, const client::Session& found,
                                        const client::CallOptions& call, const Interrupt& interrupt) {
  formats::CloudOptions options = cloud_options;
  options.dimension = found.parameters.dimension;
  std::optional<Interrupt::AtOnce> reading(interrupt);
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<client::CloudFile> opened, client::CloudFile::Open(input, options));
  reading.reset();
  client::CloudFile& cloud = *opened;
  const CloudReport report = ReportOf(options, cloud.notes(), cloud.skipped());
  PrintNotes(report, remote.format(), remote.quiet());
  const uint64_t first = offset.value_or(found.committed_points);
  const absl::StatusOr<client::Uploaded> uploaded = Send(client, cloud, first, cloud.size(), call);
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

absl::Status UploadCommand::UploadDomain(client::Client& client, const client::Session& found,
                                         const client::CallOptions& call, const Interrupt& interrupt) {
  std::optional<Interrupt::AtOnce> reading(interrupt);
  const absl::StatusOr<formats::PointCloud> cloud = domain.Read(input, cloud_options);
  reading.reset();
  if (!cloud.ok()) {
    return cloud.status();
  }
  const CloudReport report = ReportOf(cloud_options, cloud->notes, cloud->skipped);
  PrintNotes(report, remote.format(), remote.quiet());
  const bool is_first = offset == 0;  // an upload before which there were no points, and so no segments
  const uint64_t first = offset.value_or(found.committed_points);
  const client::FeatureOffset before = {.segments = segment_offset.value_or(is_first ? 0 : found.segment_count),
                                        .seeds = seed_offset.value_or(is_first ? 0 : found.seed_count)};
  const absl::StatusOr<client::Features> features = Shifted(*domain.features(), first, cloud->size(), before.segments);
  if (!features.ok()) {
    return features.status();
  }
  if (found.vertex_count > 0 && (before.segments + features->ends.size() / 2 > found.segment_count ||
                                 before.seeds + features->seeds.size() > found.seed_count)) {
    // The server would take the points before it refuses the segments.
    return absl::FailedPreconditionError(
        absl::StrCat(session, " has been refined; segments can be added only before the first refinement"));
  }
  client::SpanSource source(cloud->dimension, cloud->points);
  const absl::StatusOr<client::Uploaded> uploaded = Send(client, source, first, cloud->size(), call);
  if (!uploaded.ok()) {
    return domain.WithOrigins(uploaded.status(), {first, before});
  }
  client::CallOptions next = call;
  if (expected_revision.has_value()) {
    next.expected_revision = uploaded->revision;
  }
  const absl::StatusOr<client::AddedSegments> added = client.AddSegments(session, *features, before, next);
  if (!added.ok()) {
    return domain.WithOrigins(added.status(), {first, before});
  }
  if (remote.json()) {
    Json json = {{"session", session},
                 {"committed_points", uploaded->committed_points},
                 {"segment_count", added->segment_count},
                 {"seed_count", added->seed_count},
                 {"revision", added->revision}};
    AddNotes(report, json);
    PrintJson(json);
  } else if (!remote.quiet()) {
    std::cout << session << ": " << WithThousands(uploaded->committed_points) << " points, "
              << WithThousands(added->segment_count) << " segments, revision " << added->revision << "\n";
  }
  return absl::OkStatus();
}

struct DownloadCommand {
  RemoteCommand remote;
  std::string session;
  std::string path;
  std::string format;
  bool no_boundary = false;
  std::optional<uint64_t> revision;

  absl::Status Check() const;
  absl::Status Download(client::Client& client, const client::CallOptions& call) const;
};

absl::Status DownloadCommand::Check() const {
  if (remote.json() && path == formats::kStandardStream) {
    return absl::InvalidArgumentError("--output json and --out: only one of them can be standard output");
  }
  WELLSPACE_RETURN_IF_ERROR(CheckMeshOutput(path, format));
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
    std::cout << WithNotes({.notes = file.notes()},
                           StatisticsJson(file.header(), file.input_vertex(), file.moved_vertices()))
              << std::flush;
  } else if (!remote.quiet()) {
    std::cerr << Summary(file.header()) << (path == formats::kStandardStream ? "" : " -> " + path) << "\n";
  }
  PrintNotes({.notes = file.notes()}, remote.format(), remote.quiet());
  if (!remote.json()) {
    std::cerr << SliverWarning(file.header()) << (no_boundary || remote.quiet() ? "" : BoundaryWarning(file.header()));
  }
  return absl::OkStatus();
}

void AddUpload(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<UploadCommand>();
  CLI::App* upload = app.add_subcommand("upload", "Add the points of a file, or a domain, to a session");
  upload->footer(absl::StrCat(kCloudsHelp, "\n", kExitCodesHelp));
  AddSession(*upload, command->session);
  upload->add_option("IN", command->input, "File of points or of a domain, or - for standard input")
      ->required()
      ->type_name("FILE");
  AddCloudOptions(*upload, command->cloud_options, "IN", formats::DomainOnlyFormats());
  command->domain.AddTo(*upload);
  AddCount(
      *upload, "--offset", [command](uint64_t offset) { command->offset = offset; },
      "Number of the session's points before the first of IN. What is there from it on has to be the same as in IN, "
      "and is not sent again, so that an upload that broke off is repeated with the same offset; default: after the "
      "session's points");
  AddCount(
      *upload, "--segment-offset", [command](uint64_t offset) { command->segment_offset = offset; },
      "Of a domain: the same of the session's segments; default: 0 with --offset 0, else after them");
  AddCount(
      *upload, "--seed-offset", [command](uint64_t offset) { command->seed_offset = offset; },
      "Of a domain: the same of the session's holes and regions; default: 0 with --offset 0, else after them");
  AddExpectedRevision(*upload, command->expected_revision);
  command->remote.AddTo(*upload, RemoteCommand::Needs::kLastingServer);
  upload->callback([command, &exit_code] {
    if (const absl::Status status = command->CheckOptions(); !status.ok()) {
      exit_code = ReportError(status, command->remote.format());
      return;
    }
    exit_code = command->remote.Run(
        [&command](client::Client& client, const client::CallOptions& call, const Interrupt& interrupt) {
          return command->Upload(client, call, interrupt);
        });
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
