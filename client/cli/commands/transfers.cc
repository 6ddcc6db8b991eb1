// wellspace upload, download: points, segments or triangles to a session, and its mesh to a file.
#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/cloud_options.h"
#include "client/cli/commands/commands.h"
#include "client/cli/domain_options.h"
#include "client/cli/meshing_options.h"
#include "client/cli/options.h"
#include "client/cli/part_files.h"
#include "client/cli/part_name_options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/remote_command.h"
#include "client/cli/session_options.h"
#include "client/cli/statistics.h"
#include "client/cli/surface_options.h"
#include "client/files/cloud_file.h"
#include "client/files/mesh_file.h"
#include "client/formats/file_plan.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/registry.h"
#include "client/formats/write_mesh.h"
#include "client/json/statistics.h"
#include "client/mesh_sink.h"
#include "client/point_source.h"
#include "core/base/status_macros.h"
#include "core/partition/partition.h"

namespace wellspace::cli {
namespace {

// What servers take; more would be nearly the whole mesh.
constexpr uint32_t kMostDownloadedLayers = 16;

struct UploadCommand {
  RemoteCommand remote;
  std::string session;
  std::string input;
  formats::CloudOptions cloud_options;
  DomainOptions domain;
  SurfaceOptions surface;
  PartNameOptions part_names;
  std::optional<uint64_t> offset;
  std::optional<uint64_t> segment_offset;
  std::optional<uint64_t> triangle_offset;
  std::optional<uint64_t> seed_offset;
  std::optional<uint64_t> expected_revision;

  absl::Status CheckOptions() const;
  absl::Status Upload(client::Client& client, client::CallOptions call, const Interrupt& interrupt);
  absl::Status UploadCloud(client::Client& client, const client::Session& found, const client::CallOptions& call,
                           const Interrupt& interrupt);
  absl::Status UploadDomain(client::Client& client, const client::Session& found, const client::CallOptions& call,
                            const Interrupt& interrupt);
  absl::Status UploadSurface(client::Client& client, const client::Session& found, const client::CallOptions& call,
                             const Interrupt& interrupt);
  bool IsSurface() const { return surface.IsSurface(input, cloud_options, SurfaceOptions::Poly::kByPath); }
  // How many features were added, in a word, and where the upload stands.
  void Print(const client::Uploaded& uploaded, const char* what, const char* field, uint64_t count, uint64_t seeds,
             uint64_t revision, const CloudReport& report) const;
  // Sends `total` points from number `first` of the session on, and shows how far that is.
  absl::StatusOr<client::Uploaded> Send(client::Client& client, client::PointSource& source, uint64_t first,
                                        uint64_t total, const client::CallOptions& call) const;
};

// Refuses `points` points after `first` others where no feature could name the last of them.
absl::Status CheckNumbers(uint64_t first, uint64_t points) {
  return first <= client::kNoVertex - std::min<uint64_t>(points, client::kNoVertex)
             ? absl::OkStatus()
             : absl::InvalidArgumentError(absl::StrCat("--offset: after ", first,
                                                       " points no segment or triangle can name those of IN; 2^32 - 1 "
                                                       "points have numbers"));
}

void Shift(std::vector<uint32_t>& numbers, uint64_t by) {
  for (uint32_t& number : numbers) {
    number += static_cast<uint32_t>(by);
  }
}

// Segments whose ends are numbers of points of the session, of which the first is `first`, and seeds whose polygons are
// numbers of its segments, after `segments` others.
client::Features Shifted(client::Features features, uint64_t first, uint64_t segments) {
  Shift(features.ends, first);
  for (client::FaceSeed& seed : features.seeds) {
    seed.first_segment += segments;
  }
  Shift(features.groups, segments);  // those of another file are others
  return features;
}

// The server would take the points before it refuses their features.
absl::Status CheckNotRefined(const client::Session& session, bool has_more) {
  return session.vertex_count == 0 || !has_more
             ? absl::OkStatus()
             : absl::FailedPreconditionError(absl::StrCat(
                   session.name, " has been refined; what bounds it can be added only before the first refinement"));
}

// The options of the call after an upload, whose revision the next one expects if one was expected before it.
client::CallOptions After(const client::Uploaded& uploaded, client::CallOptions call) {
  if (call.expected_revision.has_value()) {
    call.expected_revision = uploaded.revision;
  }
  return call;
}

absl::Status UploadCommand::CheckOptions() const {
  const bool is_surface = IsSurface();
  const bool is_domain = !is_surface && domain.IsDomain(input, cloud_options.format);
  const auto refuse = [](const char* option, const char* what) {
    return absl::InvalidArgumentError(absl::StrCat(option, ": ", what));
  };
  constexpr char kNoSegments[] = "IN has no segments; give a domain, such as a .poly or .geojson, or --segments";
  constexpr char kNoTriangles[] =
      "IN has no triangles; give a .stl, .smesh or 3-D .poly, or --triangles with .obj, .ply or .off";
  if (segment_offset.has_value() && !is_domain) {
    return refuse("--segment-offset", kNoSegments);
  }
  if (triangle_offset.has_value() && !is_surface) {
    return refuse("--triangle-offset", kNoTriangles);
  }
  if (seed_offset.has_value() && !is_domain && !is_surface) {
    return refuse("--seed-offset", kNoSegments);
  }
  if (const char* const option = part_names.given(); option != nullptr && !is_domain && !is_surface) {
    return refuse(option, "IN has points alone, and no markers; give a domain or a surface");
  }
  WELLSPACE_RETURN_IF_ERROR(part_names.Check());
  if (!is_surface) {
    WELLSPACE_RETURN_IF_ERROR(surface.CheckOther("IN"));
  }
  return is_domain ? absl::OkStatus() : domain.CheckOther(kNoSegments);
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
  surface.SetNames(part_names.names());
  domain.SetNames(part_names.names());
  return IsSurface()                                    ? UploadSurface(client, found, call, interrupt)
         : domain.IsDomain(input, cloud_options.format) ? UploadDomain(client, found, call, interrupt)
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
    client::Json json = {
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
  WELLSPACE_RETURN_IF_ERROR(CheckNumbers(first, cloud->size()));
  const client::Features features = Shifted(*domain.features(), first, before.segments);
  WELLSPACE_RETURN_IF_ERROR(CheckNotRefined(found, before.segments + features.ends.size() / 2 > found.segment_count ||
                                                       before.seeds + features.seeds.size() > found.seed_count));
  client::SpanSource source(cloud->dimension, cloud->points);
  const absl::StatusOr<client::Uploaded> uploaded = Send(client, source, first, cloud->size(), call);
  if (!uploaded.ok()) {
    return domain.WithOrigins(uploaded.status(), {first, before});
  }
  const absl::StatusOr<client::AddedSegments> added =
      client.AddSegments(session, features, before, After(*uploaded, call));
  if (!added.ok()) {
    return domain.WithOrigins(added.status(), {first, before});
  }
  Print(*uploaded, "segments", "segment_count", added->segment_count, added->seed_count, added->revision, report);
  return absl::OkStatus();
}

absl::Status UploadCommand::UploadSurface(client::Client& client, const client::Session& found,
                                          const client::CallOptions& call, const Interrupt& interrupt) {
  std::optional<Interrupt::AtOnce> reading(interrupt);
  WELLSPACE_ASSIGN_OR_RETURN(const formats::PointCloud cloud, surface.ReadInput(input, cloud_options));
  reading.reset();
  const CloudReport report = ReportOf(cloud_options, cloud.notes, cloud.skipped);
  PrintNotes(report, remote.format(), remote.quiet());
  const bool is_first = offset == 0;
  const uint64_t first = offset.value_or(found.committed_points);
  const client::SurfaceOffset before = {.triangles = triangle_offset.value_or(is_first ? 0 : found.triangle_count),
                                        .seeds = seed_offset.value_or(is_first ? 0 : found.seed_count)};
  WELLSPACE_RETURN_IF_ERROR(CheckNumbers(first, cloud.size()));
  client::SurfaceFeatures features = *surface.features();
  Shift(features.corners, first);
  WELLSPACE_RETURN_IF_ERROR(
      CheckNotRefined(found, before.triangles + features.corners.size() / 3 > found.triangle_count ||
                                 before.seeds + features.seeds.size() > found.seed_count));
  client::SpanSource source(cloud.dimension, cloud.points);
  const absl::StatusOr<client::Uploaded> uploaded = Send(client, source, first, cloud.size(), call);
  if (!uploaded.ok()) {
    return surface.WithOrigins(uploaded.status(), {first, before});
  }
  const absl::StatusOr<client::AddedTriangles> added =
      client.AddTriangles(session, features, before, After(*uploaded, call));
  if (!added.ok()) {
    return surface.WithOrigins(added.status(), {first, before});
  }
  Print(*uploaded, "triangles", "triangle_count", added->triangle_count, added->seed_count, added->revision, report);
  return absl::OkStatus();
}

void UploadCommand::Print(const client::Uploaded& uploaded, const char* what, const char* field, uint64_t count,
                          uint64_t seeds, uint64_t revision, const CloudReport& report) const {
  if (remote.json()) {
    client::Json json = {{"session", session},
                         {"committed_points", uploaded.committed_points},
                         {field, count},
                         {"seed_count", seeds},
                         {"revision", revision}};
    AddNotes(report, json);
    PrintJson(json);
  } else if (!remote.quiet()) {
    std::cout << session << ": " << WithThousands(uploaded.committed_points) << " points, " << WithThousands(count)
              << " " << what << ", revision " << revision << "\n";
  }
}

struct DownloadCommand {
  RemoteCommand remote;
  std::string session;
  MeshOutput output;
  std::optional<uint64_t> revision;
  PartitionOptions partition;
  std::optional<uint32_t> part;  // of partition.parts; none: the whole mesh

  absl::Status Check() const;
  absl::Status CheckPart() const;
  absl::Status Download(client::Client& client, const client::CallOptions& call) const;
  absl::Status DownloadPart(client::Client& client, const client::CallOptions& call) const;
  // Shows how far the download is.
  client::OnChunks Showing(ProgressBar& bar) const;
};

absl::Status DownloadCommand::CheckPart() const {
  if (partition.ghost_layers > kMostDownloadedLayers) {
    return absl::InvalidArgumentError(
        absl::StrCat("--ghost-layers ", partition.ghost_layers, ": a server has 0 to ", kMostDownloadedLayers));
  }
  if (*part >= partition.parts) {
    return absl::InvalidArgumentError(absl::StrCat("--part ", *part, ": of --parts ", partition.parts,
                                                   ", which are numbered from 0, the last is ", partition.parts - 1));
  }
  const std::string extension =
      output.format.empty() ? formats::ExtensionOf(output.path) : formats::ExtensionOfMesh(output.format);
  if (extension != ".vtu" && extension != ".npz") {
    return absl::InvalidArgumentError(
        absl::StrCat("--out ", output.path, ": a part is written to .vtu or .npz, which have its numbers"));
  }
  return output.order == formats::MeshOrder::kFirst && !output.no_boundary
             ? absl::OkStatus()
             : absl::InvalidArgumentError("--order or --no-boundary, and --part: a part is whole, of the first order");
}

absl::Status DownloadCommand::Check() const {
  if (remote.json() && output.path == formats::kStandardStream) {
    return absl::InvalidArgumentError("--output json and --out: only one of them can be standard output");
  }
  WELLSPACE_RETURN_IF_ERROR(output.Check());
  if (part.has_value()) {
    WELLSPACE_RETURN_IF_ERROR(CheckPart());
  }
  formats::FilePlan files;
  remote.AddFilesTo(files);
  files.WritesMesh("--out", output.path, output.format);
  if (remote.json()) {
    files.Writes("--output json", std::string(formats::kStandardStream));
  }
  return files.Check();
}

client::OnChunks DownloadCommand::Showing(ProgressBar& bar) const {
  return [&bar](uint64_t done, uint64_t total) {
    bar.Update("download", total == 0 ? 1 : static_cast<double>(done) / total,
               absl::StrCat(done, " of ", total, " chunks"));
  };
}

absl::Status DownloadCommand::DownloadPart(client::Client& client, const client::CallOptions& call) const {
  client::MeshCollector collector;
  {
    ProgressBar bar(!remote.quiet() && !remote.json());
    const client::PartOptions wanted{.parts = partition.parts,
                                     .part = *part,
                                     .ghost_layers = partition.ghost_layers,
                                     .contiguous = partition.contiguous};
    WELLSPACE_RETURN_IF_ERROR(client.DownloadPart(session, wanted, collector, revision, Showing(bar), call));
  }
  std::vector<std::string> notes;
  WELLSPACE_RETURN_IF_ERROR(
      client::WritePart(std::move(collector.mesh()), output.path, output.format, call.stop, &notes));
  const client::MeshHeader& header = collector.header();
  const client::PartHeader& of_whole = *header.part;
  if (remote.json()) {
    client::Json json = {{"session", session},
                         {"revision", header.revision},
                         {"parts", of_whole.parts},
                         {"part", of_whole.part},
                         {"vertices", header.vertex_count},
                         {"own_vertices", of_whole.own_vertex_count},
                         {"simplices", header.simplex_count},
                         {"own_simplices", of_whole.own_simplex_count},
                         {"facets", header.facet_count},
                         {"whole_vertices", of_whole.whole_vertex_count},
                         {"whole_simplices", of_whole.whole_simplex_count},
                         {"whole_facets", of_whole.whole_facet_count},
                         {"notes", notes}};
    PrintJson(json);
    return absl::OkStatus();
  }
  if (!remote.quiet()) {
    std::cerr << "part " << of_whole.part << " of " << of_whole.parts << ": "
              << WithThousands(of_whole.own_vertex_count) << " of " << WithThousands(of_whole.whole_vertex_count)
              << " vertices, " << WithThousands(of_whole.own_simplex_count) << " of "
              << WithThousands(of_whole.whole_simplex_count) << " " << formats::SimplexName(header.dimension) << ", "
              << WithThousands(header.simplex_count - of_whole.own_simplex_count) << " ghosts -> " << output.path
              << "\n";
  }
  PrintNotes({.notes = notes}, remote.format(), remote.quiet());
  return absl::OkStatus();
}

absl::Status DownloadCommand::Download(client::Client& client, const client::CallOptions& call) const {
  client::MeshFile file(output.path, output.format, call.stop);
  file.SetOrder(output.order);
  if (remote.json()) {
    file.KeepInputVertices();
  }
  if (output.no_boundary) {
    file.LeaveOutBoundary();
  }
  if (formats::HasPlaceForPairs(output.path, output.format)) {
    WELLSPACE_ASSIGN_OR_RETURN(const client::Session found, client.GetSession(session, call));
    file.SetPeriodicAxes(found.parameters.periodic_axes);
  }
  {
    ProgressBar bar(!remote.quiet() && !remote.json());
    WELLSPACE_RETURN_IF_ERROR(client.DownloadMesh(session, file, revision, Showing(bar), call));
  }
  if (remote.json()) {
    std::cout << WithNotes(
                     {.notes = file.notes()},
                     client::StatisticsJson(file.header(), file.input_vertex(), file.moved_vertices()).dump(2) + "\n")
              << std::flush;
  } else if (!remote.quiet()) {
    std::cerr << Summary(file.header()) << (output.path == formats::kStandardStream ? "" : " -> " + output.path)
              << "\n";
  }
  PrintNotes({.notes = file.notes()}, remote.format(), remote.quiet());
  if (!remote.json()) {
    std::cerr << SliverWarning(file.header())
              << (output.no_boundary || remote.quiet() ? "" : BoundaryWarning(file.header()));
  }
  return absl::OkStatus();
}

void AddUpload(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<UploadCommand>();
  CLI::App* upload = app.add_subcommand("upload", "Add the points of a file, a domain or a surface to a session");
  upload->footer(absl::StrCat(kCloudsHelp, "\n", kExitCodesHelp));
  AddSession(*upload, command->session);
  upload->add_option("IN", command->input, "File of points, of a domain or of a surface, or - for standard input")
      ->required()
      ->type_name("FILE");
  command->surface.AddMoreTo(*upload, "IN");
  AddCloudOptions(*upload, command->cloud_options, "IN", InputFormats());
  command->domain.AddTo(*upload);
  command->surface.AddMeshingTo(*upload, "IN");
  command->part_names.AddTo(*upload);
  AddCount(
      *upload, "--offset", [command](uint64_t offset) { command->offset = offset; },
      "Number of the session's points before the first of IN. What is there from it on has to be the same as in IN, "
      "and is not sent again, so that an upload that broke off is repeated with the same offset; default: after the "
      "session's points");
  AddCount(
      *upload, "--segment-offset", [command](uint64_t offset) { command->segment_offset = offset; },
      "Of a domain: the same of the session's segments; default: 0 with --offset 0, else after them");
  AddCount(
      *upload, "--triangle-offset", [command](uint64_t offset) { command->triangle_offset = offset; },
      "Of a surface: the same of the session's triangles; default: 0 with --offset 0, else after them");
  AddCount(
      *upload, "--seed-offset", [command](uint64_t offset) { command->seed_offset = offset; },
      "Of a domain or a surface: the same of the session's holes and regions; default: 0 with --offset 0, else after "
      "them");
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
  AddMeshOutput(*download, command->output);
  AddCount(
      *download, "--revision", [command](uint64_t revision) { command->revision = revision; },
      "Fail unless the mesh is of this revision; default: the last", 1);
  CLI::Option* const parts = AddCount(
      *download, "--parts", [command](uint64_t count) { command->partition.parts = static_cast<uint32_t>(count); },
      "Of a solver on so many ranks: the server cuts the mesh into as many parts, once for all", 1, core::kMaxParts);
  CLI::Option* const part = AddCount(
      *download, "--part", [command](uint64_t number) { command->part = static_cast<uint32_t>(number); },
      "The part that is written, from 0 on, to a .vtu or .npz, with its numbers in the whole mesh, who owns them, and "
      "the rows of a solver",
      0, core::kMaxParts - 1);
  parts->needs(part);
  part->needs(parts);
  command->partition.AddTo(*download);
  for (const char* const option : {"--ghost-layers", "--contiguous"}) {
    download->get_option(option)->needs(part);
  }
  command->remote.AddTo(*download, RemoteCommand::Needs::kLastingServer);
  download->callback([command, &exit_code] {
    if (const absl::Status status = command->Check(); !status.ok()) {
      exit_code = ReportError(status, command->remote.format());
      return;
    }
    exit_code =
        command->remote.Run([&command](client::Client& client, const client::CallOptions& call, const Interrupt&) {
          return command->part.has_value() ? command->DownloadPart(client, call) : command->Download(client, call);
        });
  });
}

}  // namespace

void AddTransferCommands(CLI::App& app, int& exit_code) {
  AddUpload(app, exit_code);
  AddDownload(app, exit_code);
}

}  // namespace wellspace::cli
