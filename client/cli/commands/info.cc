// wellspace info: the content of a file.
#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/cloud_options.h"
#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/helpful_threads.h"
#include "client/cli/interrupt.h"
#include "client/cli/labelled_lines.h"
#include "client/cli/meshing_options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/remote_command.h"
#include "client/cli/surface_info.h"
#include "client/cli/surface_options.h"
#include "client/formats/mesh_or_cloud.h"
#include "client/json/json.h"
#include "core/base/status_macros.h"
#include "core/input/surface_report.h"
#include "core/validate/validate.h"

namespace wellspace::cli {
namespace {

constexpr char kInfoExamples[] =
    "Examples:\n"
    "  wellspace info land.msh\n"
    "  wellspace info scan.las --json\n"
    "  wellspace info part.stl\n"
    "  wellspace info part.obj --triangles\n";

struct InfoCommand {
  std::string path;
  formats::CloudOptions cloud_options;
  SurfaceOptions surface_options;
  bool is_json = false;
  OutputFormat format = OutputFormat::kText;

  absl::Status Run(int& exit_code);
  absl::Status RunOnSurface(int& exit_code);
};

// The least or largest number of each axis; null without points.
client::Json BoundOf(const formats::Mesh& mesh, bool is_low) {
  if (mesh.points.empty()) {
    return nullptr;
  }
  std::vector<double> bound(mesh.points.begin(), mesh.points.begin() + mesh.dimension);
  for (size_t i = 0; i < mesh.points.size(); ++i) {
    double& x = bound[i % mesh.dimension];
    x = is_low ? std::min(x, mesh.points[i]) : std::max(x, mesh.points[i]);
  }
  return bound;
}

// name, min, max (null if all are missing) and how many values are missing.
client::Json AttributeJson(const formats::Attribute& attribute) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  uint64_t missing = 0;
  for (const double value : attribute.values) {
    missing += std::isnan(value) ? 1 : 0;
    low = std::min(low, std::isnan(value) ? low : value);
    high = std::max(high, std::isnan(value) ? high : value);
  }
  const bool has_values = missing < attribute.values.size();
  return {{"name", attribute.name},
          {"min", has_values ? client::Json(low) : client::Json(nullptr)},
          {"max", has_values ? client::Json(high) : client::Json(nullptr)},
          {"missing", missing}};
}

using Vector = std::array<double, 3>;

// From the first of `vertices` to number k of them; in 2-D the third coordinate is 0.
Vector WayTo(size_t k, std::span<const uint32_t> vertices, const formats::Mesh& mesh) {
  const auto d = static_cast<size_t>(mesh.dimension);
  Vector way{};
  for (size_t axis = 0; axis < d; ++axis) {
    way[axis] = mesh.points[d * vertices[k] + axis] - mesh.points[d * vertices[0] + axis];
  }
  return way;
}

Vector CrossOf(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// The length, area or volume of the simplex of 2, 3 or 4 vertices, in 2-D or 3-D.
double MeasureOf(std::span<const uint32_t> vertices, const formats::Mesh& mesh) {
  const Vector a = WayTo(1, vertices, mesh);
  if (vertices.size() == 2) {
    return std::hypot(a[0], a[1], a[2]);
  }
  const Vector normal = CrossOf(a, WayTo(2, vertices, mesh));
  if (vertices.size() == 3) {
    return std::hypot(normal[0], normal[1], normal[2]) / 2;
  }
  const Vector c = WayTo(3, vertices, mesh);
  return std::abs(normal[0] * c[0] + normal[1] * c[1] + normal[2] * c[2]) / 6;
}

// The measure of each row of vertices, added up by label(row).
template <typename LabelOf>
std::map<int32_t, double> MeasuresBy(const LabelOf& label_of, std::span<const uint32_t> rows, size_t row,
                                     const formats::Mesh& mesh) {
  std::map<int32_t, double> measures;
  for (size_t i = 0; i < rows.size() / row; ++i) {
    measures[label_of(i)] += MeasureOf(rows.subspan(row * i, row), mesh);
  }
  return measures;
}

// Whether sizes can be told: in 2-D and 3-D, of vertices that there are.
bool IsMeasurable(const formats::Mesh& mesh) {
  const uint64_t vertices = mesh.View().vertex_count();
  const auto is_one = [&](uint32_t v) { return v < vertices; };
  return (mesh.dimension == 2 || mesh.dimension == 3) &&
         std::all_of(mesh.simplices.begin(), mesh.simplices.end(), is_one) &&
         std::all_of(mesh.facets.begin(), mesh.facets.end(), is_one);
}

// The word for the measure of a simplex, or a facet.
const char* MeasureName(int dimension) { return dimension == 3 ? "volume" : dimension == 2 ? "area" : "length"; }

client::Json BoundaryJson(const formats::Mesh& mesh) {
  std::vector<int32_t> tags;
  client::Json boundary = client::Json::array();
  for (const formats::BoundaryPart& part : mesh.boundary) {
    boundary.push_back({{"tag", part.tag}, {"name", part.name}, {"facets", part.facets}});
    tags.insert(tags.end(), part.facets, part.tag);
  }
  const auto d = static_cast<size_t>(mesh.dimension);
  if (!boundary.empty() && IsMeasurable(mesh) && mesh.facets.size() == d * tags.size()) {
    std::map<int32_t, double> sizes = MeasuresBy([&](size_t f) { return tags[f]; }, mesh.facets, d, mesh);
    for (client::Json& part : boundary) {
      part[MeasureName(mesh.dimension - 1)] = sizes[part["tag"]];
    }
  }
  return boundary;
}

client::Json RegionsJson(const formats::Mesh& mesh) {
  std::map<int32_t, uint64_t> sizes;
  for (const int32_t region : mesh.simplex_regions) {
    ++sizes[region];
  }
  if (mesh.simplex_regions.empty() && mesh.regions.size() == 1) {
    sizes[mesh.regions[0].id] = mesh.View().simplex_count();  // all are of the only one
  }
  client::Json regions = client::Json::array();
  for (const formats::Region& region : mesh.regions) {
    regions.push_back({{"id", region.id}, {"name", region.name}, {"simplices", sizes[region.id]}});
  }
  if (!regions.empty() && IsMeasurable(mesh)) {
    const auto region_of = [&](size_t s) {
      return mesh.simplex_regions.empty() ? mesh.regions[0].id : mesh.simplex_regions[s];
    };
    std::map<int32_t, double> measures =
        MeasuresBy(region_of, mesh.simplices, static_cast<size_t>(mesh.dimension) + 1, mesh);
    for (client::Json& region : regions) {
      region[MeasureName(mesh.dimension)] = measures[region["id"]];
    }
  }
  return regions;
}

// Of the simplices; null without any, or if indices are wrong, which `check` tells more of.
client::Json QualityJson(const formats::Mesh& mesh) {
  const core::MeshView view = {
      .dimension = mesh.dimension, .points = mesh.points, .simplices = mesh.simplices, .weights = mesh.weights};
  if (mesh.simplices.empty() || !core::ValidateIndices(view).ok()) {
    return nullptr;
  }
  const core::QualityReport report = core::MeasureQuality(view);
  return {{"max_radius_edge", report.max_radius_edge},
          {"min_angle_deg", report.min_angle_deg},
          {"max_angle_deg", report.max_angle_deg}};
}

client::Json InfoJson(const std::string& path, const formats::MeshOrCloud& read) {
  const formats::MeshView view = read.View();
  client::Json json;
  json["file"] = path;
  json["kind"] = read.is_mesh ? "mesh" : "cloud";
  json["format"] = read.format;
  json["dimension"] = view.dimension;
  json[read.is_mesh ? "vertices" : "points"] = view.vertex_count();
  json["low"] = BoundOf(read.mesh, /*is_low=*/true);
  json["high"] = BoundOf(read.mesh, /*is_low=*/false);
  json["attributes"] = client::Json::array();
  for (const formats::Attribute& attribute : read.attributes) {
    json["attributes"].push_back(AttributeJson(attribute));
  }
  if (!read.is_mesh) {
    return json;
  }
  json["simplices"] = view.simplex_count();
  json["weights"] = !view.weights.empty();
  json["boundary"] = BoundaryJson(read.mesh);
  json["regions"] = RegionsJson(read.mesh);
  json["quality"] = QualityJson(read.mesh);
  return json;
}

// "3 north", or the number alone.
std::string Numbered(const client::Json& row, const char* number) {
  const std::string name = row["name"];
  return absl::StrCat(row[number].get<int32_t>(), name.empty() ? "" : " ", name);
}

// ", area 0.5", or nothing where it is not known.
std::string MeasureText(const client::Json& row, int dimension) {
  const char* const name = MeasureName(dimension);
  return row.contains(name) ? absl::StrFormat(", %s %.9g", name, row[name].get<double>()) : "";
}

void PrintInfo(const client::Json& json) {
  PrintLine("file", json["file"]);
  PrintLine("kind", absl::StrCat(std::string(json["kind"]), ", ", std::string(json["format"]), ", ",
                                 json["dimension"].get<int>(), "-D"));
  const bool is_mesh = json["kind"] == "mesh";
  const char* points = is_mesh ? "vertices" : "points";
  PrintLine(points, WithThousands(json[points]));
  if (is_mesh) {
    PrintLine(formats::SimplexName(json["dimension"]), WithThousands(json["simplices"]));
  }
  if (!json["low"].is_null()) {
    PrintLine("from", Numbers(json["low"]));
    PrintLine("to", Numbers(json["high"]));
  }
  for (const client::Json& attribute : json["attributes"]) {
    const uint64_t missing = attribute["missing"];
    PrintLine(
        absl::StrCat("attribute"),
        absl::StrCat(std::string(attribute["name"]),
                     attribute["min"].is_null() ? ""
                                                : absl::StrFormat(": %.9g to %.9g", attribute["min"].get<double>(),
                                                                  attribute["max"].get<double>()),
                     missing == 0 ? "" : absl::StrCat(", ", WithThousands(missing), " missing")));
  }
  if (!is_mesh) {
    return;
  }
  for (const client::Json& part : json["boundary"]) {
    PrintLine("boundary", absl::StrCat(Numbered(part, "tag"), ": ", WithThousands(part["facets"]), " facets",
                                       MeasureText(part, json["dimension"].get<int>() - 1)));
  }
  for (const client::Json& region : json["regions"]) {
    PrintLine("region", absl::StrCat(Numbered(region, "id"), ": ", WithThousands(region["simplices"]), " simplices",
                                     MeasureText(region, json["dimension"])));
  }
  if (const client::Json& quality = json["quality"]; !quality.is_null()) {
    const char* angle = json["dimension"] == 2 ? "angles" : "dihedral angles";
    PrintLine(angle, absl::StrFormat("%.6g\u00b0 to %.6g\u00b0", quality["min_angle_deg"].get<double>(),
                                     quality["max_angle_deg"].get<double>()));
    PrintLine("largest radius-edge", absl::StrFormat("%.9g", quality["max_radius_edge"].get<double>()));
  }
}

absl::Status InfoCommand::RunOnSurface(int& exit_code) {
  WELLSPACE_ASSIGN_OR_RETURN(const formats::Surface surface, surface_options.Read(path, cloud_options));
  const core::SurfaceFeatures features = surface_options.FeaturesOf(surface);
  const core::RunContext context;
  absl::StatusOr<core::SurfaceReport> report = core::InspectSurface(surface.points, features, kMostThreads, context);
  if (!report.ok()) {
    return absl::Status(report.status().code(), absl::StrCat(surface.name, ": ", report.status().message()));
  }
  const CloudReport notes = ReportOf(cloud_options, surface.notes, 0);
  PrintNotes(notes, format, /*quiet=*/false);
  client::Json json = SurfaceJson(surface_options.FilesFrom(path), surface, features, *report);
  if (format == OutputFormat::kJson) {
    AddNotes(notes, json);
    PrintJson(json);
  } else {
    PrintSurface(json);
  }
  exit_code = report->faults.empty() ? kExitOk : kExitFailed;
  return absl::OkStatus();
}

absl::Status InfoCommand::Run(int& exit_code) {
  exit_code = kExitOk;
  if (surface_options.IsSurface(path, cloud_options)) {
    return RunOnSurface(exit_code);
  }
  WELLSPACE_RETURN_IF_ERROR(surface_options.CheckOther(path));
  cloud_options.keep_attributes = true;
  WELLSPACE_ASSIGN_OR_RETURN(const formats::MeshOrCloud read, formats::ReadMeshOrCloud(path, cloud_options));
  const CloudReport report = ReportOf(cloud_options, read.notes, read.skipped);
  PrintNotes(report, format, /*quiet=*/false);
  client::Json json = InfoJson(path, read);
  if (format == OutputFormat::kJson) {
    AddNotes(report, json);
    PrintJson(json);
  } else {
    PrintInfo(json);
  }
  return absl::OkStatus();
}

}  // namespace

void AddInfoCommand(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<InfoCommand>();
  CLI::App* info = app.add_subcommand(
      "info",
      "Tell what is in a file of a mesh, of a surface or of points: format, dimension, counts, bounds, attributes, of "
      "a "
      "mesh its boundary and regions with their sizes, the quality of its simplices, and of a surface its volume, "
      "creases, and every "
      "fault that keeps it from bounding a solid, with its place");
  info->footer(absl::StrCat(kCloudsHelp, kInfoExamples, "\n", kExitCodesHelp));
  info->add_option("FILE", command->path,
                   "File of a mesh, of a surface or of points, or - for points on standard input")
      ->required()
      ->type_name("FILE");
  command->surface_options.AddMoreTo(*info, "FILE");
  AddCloudOptions(*info, command->cloud_options, "FILE", {"smesh", "poly"});
  command->surface_options.AddTo(*info, "FILE");
  AddOutput(*info, command->format);
  info->add_flag("--json", command->is_json, "The same as --output json");
  info->callback([command, &exit_code] {
    const Interrupt interrupt(Interrupt::First::kEnd);
    command->format = command->is_json ? OutputFormat::kJson : command->format;
    if (const absl::Status status = command->Run(exit_code); !status.ok()) {
      exit_code = ReportError(status, command->format);
    }
  });
}

}  // namespace wellspace::cli
