// wellspace check: is it a mesh, and how good is it?
#include <algorithm>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/options.h"
#include "client/cli/parameter_options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/remote_command.h"
#include "client/formats/read_cloud.h"
#include "client/formats/read_mesh.h"
#include "core/simplex/validate.h"

namespace wellspace::cli {
namespace {

// How flat a sliver is, for what is reported of a mesh. Unit: degrees.
constexpr int kFlat = 5;
constexpr int kSliver = 12;

Json ReportJson(const core::QualityReport& report, int dimension, bool has_weights) {
  Json json;
  json["dimension"] = dimension;
  json["vertices"] = report.vertices;
  json["simplices"] = report.simplices;
  json["max_radius_edge"] = report.max_radius_edge;
  json["min_angle_deg"] = report.min_angle_deg;
  json["max_angle_deg"] = report.max_angle_deg;
  json["below_5_deg"] = report.CountBelow(kFlat);
  json["below_12_deg"] = report.CountBelow(kSliver);
  json["angle_histogram"] = report.angle_histogram;
  json["triangulation"] = has_weights ? "regular" : "delaunay";
  return json;
}

// "below 5°   12 (0.0034 %)".
std::string Slivers(int degrees, const core::QualityReport& report) {
  const uint64_t count = report.CountBelow(degrees);
  return absl::StrFormat("%-25s %s (%.4f %%)\n", absl::StrFormat("below %d\u00b0", degrees), WithThousands(count),
                         100.0 * static_cast<double>(count) / static_cast<double>(report.simplices));
}

void PrintReport(const core::QualityReport& report, int dimension) {
  const char* angle = dimension == 2 ? "angle" : "dihedral angle";
  std::cout << absl::StrFormat("%-24s %s\n", "vertices", WithThousands(report.vertices))
            << absl::StrFormat("%-24s %s\n", formats::SimplexName(dimension), WithThousands(report.simplices));
  if (report.simplices == 0) {
    return;
  }
  std::cout << absl::StrFormat("%-24s %.9g\n", "largest radius-edge", report.max_radius_edge)
            << absl::StrFormat("%-24s %.6g\u00b0\n", std::string("smallest ") + angle, report.min_angle_deg)
            << absl::StrFormat("%-24s %.6g\u00b0\n", std::string("largest ") + angle, report.max_angle_deg)
            << Slivers(kFlat, report) << Slivers(kSliver, report) << "simplices by their smallest " << angle << ":\n";
  constexpr int kBarColumns = 40;
  const uint64_t tallest = *std::max_element(report.angle_histogram.begin(), report.angle_histogram.end());
  const double width = core::LargestSmallestAngle(dimension) / core::kHistogramBins;
  for (int bin = 0; bin < core::kHistogramBins; ++bin) {
    const uint64_t count = report.angle_histogram[bin];
    // Rounded up, so that a single bad simplex shows.
    const int columns = static_cast<int>((count * kBarColumns + tallest - 1) / std::max<uint64_t>(tallest, 1));
    std::cout << absl::StrFormat("  %5.1f - %4.1f\u00b0 %14s %s\n", bin * width, (bin + 1) * width,
                                 WithThousands(count), std::string(columns, '#'));
  }
}

struct CheckCommand {
  std::string mesh_path;
  std::string cloud_path;
  std::string cloud_format;
  double rho = 0;
  client::Criterion criterion = client::Criterion::kRadiusEdge;
  double max_circumradius = 0;
  std::vector<std::vector<double>> size_boxes;
  double min_dihedral = 0;
  OutputFormat format = OutputFormat::kText;

  absl::StatusOr<std::vector<core::SizeBox>> SizeBoxes(int dimension) const;
  int Run() const;
};

absl::StatusOr<std::vector<core::SizeBox>> CheckCommand::SizeBoxes(int dimension) const {
  absl::StatusOr<std::vector<client::SizeBox>> read = SizeBoxesOf(size_boxes, dimension);
  if (!read.ok()) {
    return read.status();
  }
  std::vector<core::SizeBox> boxes;
  for (client::SizeBox& box : *read) {
    boxes.push_back({std::move(box.low), std::move(box.high), box.max_circumradius});
  }
  return boxes;
}

int CheckCommand::Run() const {
  const absl::StatusOr<formats::Mesh> mesh = formats::ReadMesh(mesh_path);
  if (!mesh.ok()) {
    return ReportError(mesh.status(), format);
  }
  const absl::StatusOr<std::vector<core::SizeBox>> boxes = SizeBoxes(mesh->dimension);
  if (!boxes.ok()) {
    return ReportError(boxes.status(), format);
  }
  if (!mesh->weights.empty() && (rho != 0 || max_circumradius != 0 || !size_boxes.empty())) {
    return ReportError(absl::InvalidArgumentError(absl::StrCat(
                           mesh_path,
                           ": --rho, --size and --size-box are about Delaunay simplices, and this mesh has "
                           "weights; expected a mesh without, or --min-dihedral")),
                       format);
  }
  std::vector<double> cloud;
  if (!cloud_path.empty()) {
    absl::StatusOr<formats::PointCloud> read =
        formats::ReadCloud(cloud_path, {.format = cloud_format, .dimension = mesh->dimension});
    if (!read.ok()) {
      return ReportError(read.status(), format);
    }
    cloud = std::move(read->points);
  }
  const core::MeshView view = {
      .dimension = mesh->dimension, .points = mesh->points, .simplices = mesh->simplices, .weights = mesh->weights};
  absl::Status status = core::ValidateIndices(view);
  Json json = Json::object();
  if (status.ok()) {
    const core::QualityReport report = core::MeasureQuality(view);
    if (format == OutputFormat::kJson) {
      json = ReportJson(report, mesh->dimension, !mesh->weights.empty());
    } else {
      PrintReport(report, mesh->dimension);
    }
    const bool is_well_spaced = criterion == client::Criterion::kWellSpaced;
    status = core::ValidateMesh(
        view, {.rho = rho,
               .criterion = is_well_spaced ? core::Criterion::kWellSpaced : core::Criterion::kRadiusEdge,
               .max_circumradius = max_circumradius,
               .size_boxes = *boxes,
               .cloud = cloud,
               .min_angle_deg = min_dihedral});
  }
  if (absl::IsInvalidArgument(status)) {  // what was asked for cannot be
    return ReportError(status, format);
  }
  if (format == OutputFormat::kJson) {
    json["valid"] = status.ok();
    json["violation"] = status.ok() ? Json(nullptr) : Json(std::string(status.message()));
    PrintJson(json);
    return status.ok() ? kExitOk : kExitFailed;
  }
  if (!status.ok()) {
    std::cout << "violation: " << std::string(status.message()) << "\n";
    return kExitFailed;
  }
  if (!mesh->weights.empty()) {
    std::cout << "the regular triangulation of its weights\n";
  }
  std::cout << "valid\n";
  return kExitOk;
}

}  // namespace

void AddCheckCommand(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<CheckCommand>();
  CLI::App* check = app.add_subcommand(
      "check",
      "Check a mesh: indices, orientation, topology, exact total volume, the Delaunay "
      "property or, with weights, that of their regular triangulation, "
      "circumcentres, and what the options ask for; print its figures and `valid` or the first violation");
  check->footer(kExitCodesHelp);
  check
      ->add_option("MESH", command->mesh_path,
                   "File of the mesh (.vtu, .npz, or .node with .ele), or - for standard input (vtu)")
      ->required()
      ->type_name("FILE");
  check->add_option("--cloud", command->cloud_path, "File of points that must be the first vertices, to the bit")
      ->type_name("FILE");
  check->add_option("--input-format", command->cloud_format, "Format of the cloud; default: by its extension")
      ->check(CLI::IsMember(formats::CloudFormats()));
  CLI::Option* rho =
      AddNumber(*check, "--rho", command->rho, "Bound that the criterion must obey; default: not checked")
          ->check(CLI::PositiveNumber);
  AddCriterion(*check, command->criterion)->needs(rho);
  AddSizes(*check, command->max_circumradius, command->size_boxes);
  AddNumber(*check, "--min-dihedral", command->min_dihedral,
            "Bound on the dihedral angles, in 2-D on the angles, in degrees; default: not checked")
      ->check(CLI::PositiveNumber);
  AddOutput(*check, command->format);
  check->callback([command, &exit_code] { exit_code = command->Run(); });
}

}  // namespace wellspace::cli
