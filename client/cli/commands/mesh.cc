// wellspace mesh: a mesh of a cloud.
#include <charconv>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/interrupt.h"
#include "client/cli/options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/server_link.h"
#include "client/cli/statistics.h"
#include "client/formats/line_reader.h"
#include "client/formats/output_file.h"
#include "client/formats/read_cloud.h"
#include "client/formats/write_mesh.h"

namespace wellspace::cli {
namespace {

constexpr char kFooter[] =
    "Clouds:  .csv .tsv .txt .dat (columns separated by commas, semicolons or blanks; a header may name x, y, z),\n"
    "         .xyz, .node; \"-\" is standard input (csv, or --input-format)\n"
    "Meshes:  .vtu, .node and .ele (a pair); \"-\" is standard output (vtu)\n"
    "Examples:\n"
    "  wellspace mesh coast.csv -o coast.vtu --rho 1.5 --stats -\n"
    "  wellspace mesh cow.csv -o cow.node --domain -1,-1,-1,1,1,1 --server mesher:7233\n";

struct MeshCommand {
  std::string input;
  std::string output;
  std::string input_format;
  std::string format;
  std::string statistics;
  std::string server;
  int dimension = 0;
  std::vector<double> domain;
  double timeout_seconds = 0;  // 0: none
  bool quiet = false;
  client::MeshOptions options;

  absl::Status CheckOptions() const;
  absl::StatusOr<formats::PointCloud> Read();
  absl::Status Explain(const absl::Status& status, const formats::PointCloud& cloud) const;
  absl::Status Finish(const client::Mesh& mesh, const Interrupt& interrupt) const;
  int Run();
};

// What can be known to be wrong before anything is read.
absl::Status MeshCommand::CheckOptions() const {
  if (!domain.empty() && domain.size() != 4 && domain.size() != 6) {
    return absl::InvalidArgumentError(
        absl::StrCat("--domain: expected 4 numbers in 2-D, 6 in 3-D (low corner, high corner), got ", domain.size()));
  }
  if (!domain.empty() && dimension != 0 && domain.size() != 2u * dimension) {
    return absl::InvalidArgumentError(absl::StrCat("--domain: expected ", 2 * dimension, " numbers with --dimension ",
                                                   dimension, ", got ", domain.size()));
  }
  if (statistics == formats::kStandardStream && output == formats::kStandardStream) {
    return absl::InvalidArgumentError("--stats and --output: only one of them can be standard output");
  }
  return formats::CheckMeshOutput(output, format);
}

absl::StatusOr<formats::PointCloud> MeshCommand::Read() {
  const int known_dimension = dimension != 0 ? dimension : static_cast<int>(domain.size() / 2);
  absl::StatusOr<formats::PointCloud> cloud =
      formats::ReadCloud(input, {.format = input_format, .dimension = known_dimension});
  if (!cloud.ok()) {
    return cloud;
  }
  options.dimension = cloud->dimension;
  options.domain_low.assign(domain.begin(), domain.begin() + domain.size() / 2);
  options.domain_high.assign(domain.begin() + domain.size() / 2, domain.end());
  if (timeout_seconds > 0) {
    options.timeout = absl::Seconds(timeout_seconds);
  }
  return cloud;
}

// The server knows points by their index; who wrote the file knows them by their line.
absl::Status WithOrigins(const absl::Status& status, const formats::PointCloud& cloud) {
  constexpr std::string_view kPoint = "points[";
  std::string message(status.message());
  std::string first_origin;
  for (size_t at = message.find(kPoint); at != std::string::npos; at = message.find(kPoint, at)) {
    at += kPoint.size();
    uint64_t point = 0;
    const char* end = message.data() + message.size();
    const std::from_chars_result result = std::from_chars(message.data() + at, end, point);
    if (result.ec != std::errc() || result.ptr == end || *result.ptr != ']' || point >= cloud.size()) {
      continue;
    }
    if (first_origin.empty()) {
      first_origin = cloud.Origin(point);
    } else {
      message.insert(result.ptr + 1 - message.data(), absl::StrCat(" (", cloud.Origin(point), ")"));
    }
  }
  return absl::Status(status.code(), first_origin.empty() ? message : absl::StrCat(first_origin, ": ", message));
}

absl::Status MeshCommand::Explain(const absl::Status& status, const formats::PointCloud& cloud) const {
  if (status.code() == absl::StatusCode::kInvalidArgument) {
    return WithOrigins(status, cloud);
  }
  if (status.code() == absl::StatusCode::kDeadlineExceeded && timeout_seconds > 0) {
    return absl::DeadlineExceededError(absl::StrCat("--timeout: ", timeout_seconds, " seconds passed"));
  }
  return status;
}

absl::Status MeshCommand::Finish(const client::Mesh& mesh, const Interrupt& interrupt) const {
  const formats::MeshView view = {.dimension = mesh.dimension,
                                  .points = mesh.points,
                                  .simplices = mesh.simplices,
                                  .input_vertices = mesh.statistics.input_points - mesh.statistics.duplicates};
  if (absl::Status status = formats::WriteMesh(output, format, view, interrupt.token()); !status.ok()) {
    return status;
  }
  if (!statistics.empty()) {
    absl::StatusOr<formats::OutputFile> file = formats::OutputFile::Create(statistics);
    if (!file.ok()) {
      return file.status();
    }
    file->Write(StatisticsJson(mesh));
    if (absl::Status status = file->Commit(); !status.ok()) {
      return status;
    }
  }
  if (!quiet) {
    std::cerr << Summary(mesh) << (output == formats::kStandardStream ? "" : " -> " + output) << "\n";
  }
  return absl::OkStatus();
}

int MeshCommand::Run() {
  if (const absl::Status status = CheckOptions(); !status.ok()) {
    return ReportError(status);
  }
  const absl::StatusOr<formats::PointCloud> cloud = Read();
  if (!cloud.ok()) {
    return ReportError(cloud.status());
  }
  Interrupt interrupt;
  absl::StatusOr<std::unique_ptr<ServerLink>> link = ServerLink::Open(server);
  if (!link.ok()) {
    return ReportError(link.status());
  }
  ProgressBar bar(!quiet);
  const absl::StatusOr<client::Mesh> mesh = (*link)->client().MeshPoints(
      options, cloud->points, [&bar](const client::Progress& progress) { bar.Update(progress); }, interrupt.token());
  bar.Clear();
  const absl::Status status = mesh.ok() ? Finish(*mesh, interrupt) : (*link)->Explain(Explain(mesh.status(), *cloud));
  if (status.ok()) {
    return kExitOk;
  }
  const int exit_code = ReportError(status);
  return interrupt.signal() != 0 ? kExitSignal + interrupt.signal() : exit_code;
}

}  // namespace

void AddMeshCommand(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<MeshCommand>();
  CLI::App* mesh = app.add_subcommand("mesh", "Mesh a point cloud");
  mesh->footer(std::string(kFooter) + "\n" + kExitCodesHelp);
  mesh->add_option("IN", command->input, "File of points, or - for standard input")->required();
  mesh->add_option("-o,--output", command->output, "File of the mesh, or - for standard output")->required();
  mesh->add_option("--dimension", command->dimension, "Dimension; default: as many as the points have coordinates")
      ->check(CLI::IsMember({2, 3}));
  AddNumber(*mesh, "--rho", command->options.rho,
            "Bound on circumradius / shortest edge of every simplex; default: sqrt(2) in 2-D, 2 in 3-D");
  CLI::Option* domain = AddNumbers(*mesh, "--domain", command->domain,
                                   "Box to be meshed, low corner then high corner; default: by --margin");
  AddNumber(*mesh, "--margin", command->options.margin,
            "Grow the bounding box of the points on every side by this times its longest side; default: 0.25")
      ->excludes(domain);
  mesh->add_option("--max-vertices", command->options.max_vertices,
                   "Fail before the mesh has more vertices than this; 50 million by default");
  mesh->add_option("--threads", command->options.threads, "Threads that mesh; default: the server's choice")
      ->check(CLI::Range(1, 1024));
  AddServer(*mesh, command->server);
  mesh->add_option("--stats", command->statistics, "Write statistics as JSON to this file, or - for standard output");
  AddNumber(*mesh, "--timeout", command->timeout_seconds, "Give up after so many seconds; default: never")
      ->check(CLI::PositiveNumber);
  mesh->add_option("--input-format", command->input_format, "Format of IN; default: by its extension")
      ->check(CLI::IsMember(formats::CloudFormats()));
  mesh->add_option("--format", command->format, "Format of the mesh; default: by the extension of its file")
      ->check(CLI::IsMember(formats::MeshFormats()));
  mesh->add_flag("-q,--quiet", command->quiet, "Print errors only");
  mesh->callback([command, &exit_code] { exit_code = command->Run(); });
}

}  // namespace wellspace::cli
