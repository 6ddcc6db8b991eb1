// wellspace cells, add: the query structure over the vertices of a session.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/cloud_options.h"
#include "client/cli/commands/commands.h"
#include "client/cli/interrupt.h"
#include "client/cli/meshing_options.h"
#include "client/cli/options.h"
#include "client/cli/remote_command.h"
#include "client/cli/session_options.h"
#include "client/error_details.h"
#include "client/formats/file_plan.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"
#include "client/formats/io/output_file.h"
#include "client/formats/read_cloud.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

constexpr char kCellsFooter[] =
    "As text: a line for each cell, VERTEX CLIP_RADIUS IS_CLIPPED NODES NEIGHBOURS, the nodes as x,y,... and both\n"
    "lists separated by semicolons; inf where the cell is not clipped. As JSON: an object in a line for each cell, "
    "with\n"
    "vertex, clip_radius (null: not clipped), is_clipped, nodes, neighbours. With --nearest: VERTEX DISTANCE, or an "
    "object\n"
    "with vertex and distance.\n";

struct CellsCommand {
  RemoteCommand remote;
  std::string session;
  std::vector<uint32_t> vertices;
  std::string vertices_path;
  std::string path = std::string(formats::kStandardStream);
  double beta = 0;  // 0: whole cells
  bool nearest = false;

  int Run();
  absl::Status Query(client::Client& client, const client::CallOptions& call);
};

// The cells of one batch, one line each.
std::string LinesOf(const client::CellBatch& cells, bool json) {
  std::string lines;
  size_t node = 0;
  size_t neighbour = 0;
  for (size_t i = 0; i < cells.vertices.size(); ++i) {
    client::Json nodes = client::Json::array();
    std::vector<std::string> node_texts;
    for (uint32_t k = 0; k < cells.node_counts[i]; ++k, node += cells.dimension) {
      const std::vector<double> coordinates(cells.nodes.begin() + node, cells.nodes.begin() + node + cells.dimension);
      if (json) {
        nodes.push_back(coordinates);
        continue;
      }
      std::string text;
      for (const double coordinate : coordinates) {
        if (!text.empty()) {
          text += ',';
        }
        formats::AppendNumber(coordinate, text);
      }
      node_texts.push_back(std::move(text));
    }
    const std::vector<uint32_t> neighbours(cells.neighbours.begin() + neighbour,
                                           cells.neighbours.begin() + neighbour + cells.neighbour_counts[i]);
    neighbour += cells.neighbour_counts[i];
    const bool is_whole = std::isinf(cells.clip_radii[i]);
    if (json) {
      client::Json cell;
      cell["vertex"] = cells.vertices[i];
      cell["clip_radius"] = is_whole ? client::Json(nullptr) : client::Json(cells.clip_radii[i]);
      cell["is_clipped"] = static_cast<bool>(cells.is_clipped[i]);
      cell["nodes"] = std::move(nodes);
      cell["neighbours"] = neighbours;
      absl::StrAppend(&lines, cell.dump(), "\n");
      continue;
    }
    absl::StrAppend(&lines, cells.vertices[i], " ");
    if (is_whole) {
      lines += "inf";
    } else {
      formats::AppendNumber(cells.clip_radii[i], lines);
    }
    absl::StrAppend(&lines, cells.is_clipped[i] ? " 1 " : " 0 ", absl::StrJoin(node_texts, ";"), " ",
                    absl::StrJoin(neighbours, ";"), "\n");
  }
  return lines;
}

absl::Status CellsCommand::Query(client::Client& client, const client::CallOptions& call) {
  WELLSPACE_ASSIGN_OR_RETURN(formats::OutputFile output, formats::OutputFile::Create(path, call.stop));
  const auto take_cells = [&](const client::CellBatch& cells) {
    output.Write(LinesOf(cells, remote.json()));
    return output.status();
  };
  absl::Status status;
  if (nearest) {
    size_t answered = 0;
    status = client.ApproximateNearestNeighbors(
        session, vertices,
        [&](std::span<const double> distances) {
          for (const double distance : distances) {
            const uint64_t vertex = vertices.empty() ? answered : vertices[answered];
            ++answered;
            std::string line;
            if (remote.json()) {
              line = client::Json{{"vertex", vertex}, {"distance", distance}}.dump();
            } else {
              absl::StrAppend(&line, vertex, " ");
              formats::AppendNumber(distance, line);
            }
            output.Write(line + "\n");
          }
          return output.status();
        },
        call);
  } else if (beta != 0) {
    status = client.ClippedVoronoiCells(session, vertices, beta, take_cells, call);
  } else {
    status = client.VoronoiCells(session, vertices, take_cells, call);
  }
  if (!status.ok()) {
    return client::BlamedField(status) == "beta"
               ? absl::InvalidArgumentError(absl::StrCat("--beta: ", status.message()))
               : status;
  }
  return output.Commit();
}

int CellsCommand::Run() {
  formats::FilePlan files;
  remote.AddFilesTo(files);
  files.Reads("--vertices", vertices_path);
  files.Writes("--out", path);
  if (const absl::Status status = files.Check(); !status.ok()) {
    return ReportError(status, remote.format());
  }
  if (!vertices_path.empty()) {
    absl::StatusOr<std::vector<uint32_t>> read = ReadVertices(vertices_path);
    if (read.ok() && read->empty()) {
      return kExitOk;  // none is not all
    }
    if (!read.ok()) {
      return ReportError(read.status(), remote.format());
    }
    vertices = *std::move(read);
  }
  return remote.Run([this](client::Client& client, const client::CallOptions& call, const Interrupt&) {
    return Query(client, call);
  });
}

struct AddCommand {
  RemoteCommand remote;
  std::string session;
  std::string input;
  formats::CloudOptions cloud_options;
  std::string near_path;
  std::optional<uint64_t> expected_revision;

  absl::Status CheckFiles() const;
  absl::StatusOr<formats::PointCloud> Read(const formats::CloudOptions& options, std::vector<uint32_t>* near) const;
  absl::Status Add(client::Client& client, client::CallOptions call, const Interrupt& interrupt) const;
};

absl::Status AddCommand::CheckFiles() const {
  formats::FilePlan files;
  remote.AddFilesTo(files);
  files.Reads("IN", input);
  files.Reads("--near", near_path);
  files.Writes("the list of vertices", std::string(formats::kStandardStream));
  return files.Check();
}

// Reads the points, and a vertex near each if there is a file of them.
absl::StatusOr<formats::PointCloud> AddCommand::Read(const formats::CloudOptions& options,
                                                     std::vector<uint32_t>* near) const {
  WELLSPACE_ASSIGN_OR_RETURN(formats::PointCloud cloud, formats::ReadCloud(input, options));
  if (!near_path.empty()) {
    WELLSPACE_ASSIGN_OR_RETURN(*near, ReadVertices(near_path));
    if (near->size() != cloud.size()) {
      return absl::InvalidArgumentError(absl::StrCat("--near ", near_path, ": expected a vertex for each of ",
                                                     cloud.size(), " points, got ", near->size()));
    }
  }
  return cloud;
}

absl::Status AddCommand::Add(client::Client& client, client::CallOptions call, const Interrupt& interrupt) const {
  WELLSPACE_ASSIGN_OR_RETURN(const client::Session found, client.GetSession(session, call));
  formats::CloudOptions options = cloud_options;
  options.dimension = found.parameters.dimension;
  std::vector<uint32_t> near;
  std::optional<Interrupt::AtOnce> reading(interrupt);
  WELLSPACE_ASSIGN_OR_RETURN(const formats::PointCloud cloud, Read(options, &near));
  reading.reset();
  const CloudReport report = ReportOf(options, cloud.notes, cloud.skipped);
  PrintNotes(report, remote.format(), remote.quiet());
  call.expected_revision = expected_revision;
  std::vector<uint32_t> vertices;
  const absl::StatusOr<client::AddedVertices> added = client.AddVertices(
      session, cloud.points, near,
      [&](const client::AddedVertices& some) {
        vertices.insert(vertices.end(), some.vertices.begin(), some.vertices.end());
      },
      call);
  // Added vertices stay: their numbers are told, whatever became of the rest.
  if (remote.json() && added.ok()) {
    client::Json json = {{"vertices", vertices}, {"revision", added->revision}};
    AddNotes(report, json);
    PrintJson(json);
  } else {
    for (const uint32_t vertex : vertices) {
      std::cout << vertex << "\n";
    }
  }
  return added.ok() ? absl::OkStatus() : WithOrigins(added.status(), cloud);
}

}  // namespace

void AddQueryCommands(CLI::App& app, int& exit_code) {
  const auto cells = std::make_shared<CellsCommand>();
  CLI::App* cells_app = app.add_subcommand("cells", "Print Voronoi cells of vertices of a session");
  cells_app->footer(absl::StrCat(kCellsFooter, "\n", kExitCodesHelp));
  AddSession(*cells_app, cells->session);
  const auto parse_vertices = [cells](const std::vector<std::string>& texts) {
    for (const std::string& text : texts) {
      cells->vertices.push_back(
          static_cast<uint32_t>(ParseCount("VERTEX", text, 0, std::numeric_limits<uint32_t>::max())));
    }
  };
  CLI::Option* vertices =
      cells_app
          ->add_option_function<std::vector<std::string>>("VERTEX", parse_vertices, "Numbers of vertices; default: all")
          ->type_name("COUNT ...");
  cells_app->add_option("--vertices", cells->vertices_path, "File with numbers of vertices, or - for standard input")
      ->type_name("FILE")
      ->excludes(vertices);
  CLI::Option* beta =
      AddNumber(*cells_app, "--beta", cells->beta,
                "Clip each cell by a cube of this times the distance to the nearest neighbour; at least "
                "1; default: whole cells")
          ->check(AboveZero());
  cells_app->add_flag("--nearest", cells->nearest, "Print the distance to the nearest neighbour only")->excludes(beta);
  cells_app->add_option("-o,--out", cells->path, "File of the answer, or - for standard output")
      ->capture_default_str()
      ->type_name("FILE");
  cells->remote.AddTo(*cells_app, RemoteCommand::Needs::kLastingServer);
  cells_app->callback([cells, &exit_code] { exit_code = cells->Run(); });

  const auto add = std::make_shared<AddCommand>();
  CLI::App* add_app = app.add_subcommand("add",
                                         "Add vertices at the points of a file, and print their numbers; refine makes "
                                         "a mesh of them. All are added or none, "
                                         "of more than 3 MiB of coordinates those of each 3 MiB");
  add_app->footer(absl::StrCat(kCloudsHelp, "\n", kExitCodesHelp));
  AddSession(*add_app, add->session);
  add_app->add_option("IN", add->input, "File of points, or - for standard input")->required()->type_name("FILE");
  AddCloudOptions(*add_app, add->cloud_options);
  add_app
      ->add_option("--near", add->near_path, "File with the number of a vertex near each point, which finds it sooner")
      ->type_name("FILE");
  AddExpectedRevision(*add_app, add->expected_revision);
  add->remote.AddTo(*add_app, RemoteCommand::Needs::kLastingServer);
  add_app->callback([add, &exit_code] {
    if (const absl::Status status = add->CheckFiles(); !status.ok()) {
      exit_code = ReportError(status, add->remote.format());
      return;
    }
    exit_code = add->remote.Run([&add](client::Client& client, const client::CallOptions& call,
                                       const Interrupt& interrupt) { return add->Add(client, call, interrupt); });
  });
}

}  // namespace wellspace::cli
