#include "client/cli/surface_check.h"

#include <iostream>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/helpful_threads.h"
#include "client/cli/progress_bar.h"
#include "client/files/region_numbers.h"
#include "client/formats/surface/surface.h"
#include "core/base/status_macros.h"
#include "core/input/surface_report.h"
#include "core/validate/validate_fidelity.h"

namespace wellspace::cli {
namespace {

// Twice the default tolerance of a mesh. Unit: % of the diagonal.
constexpr double kDefaultTolerance = 0.2;

// With the regions that `mesh` gives them.
std::vector<core::SolidSeed> SeedsOf(const formats::Surface& surface) {
  std::vector<std::string> notes;  // `mesh` has told them
  const std::vector<int32_t> regions = client::NumberRegions(surface.name, surface.seeds, notes);
  std::vector<core::SolidSeed> seeds;
  for (size_t i = 0; i < surface.seeds.size(); ++i) {
    const formats::Surface::Seed& seed = surface.seeds[i];
    seeds.push_back({.at = {seed.x, seed.y, seed.z}, .is_hole = seed.is_hole, .region = regions[i]});
  }
  return seeds;
}

std::vector<double> CornersOf(const core::Box<3>& box) {
  std::vector<double> corners(box.low.begin(), box.low.end());
  corners.insert(corners.end(), box.high.begin(), box.high.end());
  return corners;
}

// Tags are told by the numbers of the surface's markers.
core::SolidParts PartsOf(const formats::Mesh& mesh, const std::vector<int32_t>& tags) {
  core::SolidParts parts;
  parts.domain.boundary = {.facets = mesh.facets, .tags = tags};
  parts.domain.regions = mesh.simplex_regions;
  parts.ridges = mesh.ridges;
  for (const formats::BoundaryPart& part : mesh.boundary) {
    parts.domain.boundary.names.emplace(part.tag, part.name);
  }
  for (const formats::Region& region : mesh.regions) {
    parts.domain.region_names.emplace(region.id, region.name);
  }
  return parts;
}

Json ReportJson(const core::SolidMeshReport& report) {
  Json volumes = Json::array();
  for (const auto& [region, volume] : report.volumes) {
    volumes.push_back({{"id", region}, {"volume", volume}});
  }
  Json areas = Json::array();
  for (const auto& [tag, area] : report.areas) {
    areas.push_back({{"tag", tag}, {"area", area}});
  }
  return {{"pieces", report.pieces},         {"volumes", std::move(volumes)},
          {"areas", std::move(areas)},       {"branching_edges", report.branching_edges},
          {"open_edges", report.open_edges}, {"over_rho", report.over_rho}};
}

Json DeviationJson(const core::Deviation& deviation, double diagonal) {
  return {{"found", deviation.found},
          {"share", deviation.found / diagonal},
          {"at_most", deviation.at_most},
          {"at", deviation.at}};
}

void PrintLength(const std::string& label, const core::Deviation& deviation, double diagonal) {
  std::cout << absl::StrFormat("%-24s %.4g, %.4f %% of the diagonal, at (%.6g, %.6g, %.6g); nowhere above %.4g\n",
                               label, deviation.found, 100 * deviation.found / diagonal, deviation.at[0],
                               deviation.at[1], deviation.at[2], deviation.at_most);
}

void Print(const core::FidelityReport& report) {
  std::cout << absl::StrFormat("%-24s %s around %s, %s points tested\n", "surface",
                               absl::StrCat(WithThousands(report.triangles), " triangles"),
                               absl::StrCat(WithThousands(report.solids), report.solids == 1 ? " solid" : " solids"),
                               WithThousands(report.tested_points));
  PrintLength("facets from surface", report.of_facets, report.diagonal);
  PrintLength("surface from facets", report.of_surface, report.diagonal);
  std::cout << absl::StrFormat("%-24s %.6g of %.6g kept\n", "curves", report.curves - report.lost_curves,
                               report.curves);
}

}  // namespace

void SurfaceCheck::AddTo(CLI::App& command) {
  command
      .add_option_function<std::vector<std::string>>(
          "--surface",
          [this](const std::vector<std::string>& paths) {
            path_ = paths.front();
            options_.SetMore({paths.begin() + 1, paths.end()});
          },
          "Surface that the mesh must be of, in a file or several: solids are meshed as a whole, facets and triangles "
          "are nowhere "
          "farther from each other than --tolerance, tags are those of triangles, and edges run along creases")
      ->type_name("FILE");
  options_.AddTo(command, "The surface");
  // A file of any content is a surface here.
  command.remove_option(command.get_option("--as-points"));
  command.remove_option(command.get_option("--triangles"));
  for (const char* name : {"--solids", "--box", "--crease-angle", "--weld", "--resolution", "--keep-points"}) {
    command.get_option(name)->needs("--surface");
  }
  AddLength(command, "--tolerance", tolerance_,
            absl::StrCat("How far facets may be from the surface, and it from them: a length, or with % a share of the "
                         "diagonal; default ",
                         kDefaultTolerance, "%"),
            Length::Whole::kDiagonal)
      ->needs("--surface");
}

void SurfaceCheck::AddFilesTo(formats::FilePlan& files) const {
  files.Reads("--surface", path_);
  options_.AddFilesTo(files);
}

absl::Status SurfaceCheck::Check(const formats::Mesh& mesh, double rho, OutputFormat format, Json& json) const {
  if (mesh.dimension != 3) {
    return absl::InvalidArgumentError(
        absl::StrCat("--surface: the mesh has dimension ", mesh.dimension, "; expected tetrahedra"));
  }
  std::vector<int32_t> tags;
  for (const formats::BoundaryPart& part : mesh.boundary) {
    tags.insert(tags.end(), part.facets, part.tag);
  }
  const core::MeshView view = {.dimension = 3, .points = mesh.points, .simplices = mesh.simplices};
  core::SolidParts parts = PartsOf(mesh, tags);
  std::vector<uint32_t> facets;
  if (mesh.facets.empty()) {  // its format has none
    WELLSPACE_ASSIGN_OR_RETURN(facets, core::FacetsOfRegions(view, mesh.simplex_regions, core::RunContext()));
    parts.domain.boundary.facets = facets;
  }
  WELLSPACE_ASSIGN_OR_RETURN(const core::SolidMeshReport report,
                             core::ValidateSolidMesh(view, parts, rho, core::RunContext()));
  json["solid"] = ReportJson(report);
  if (format != OutputFormat::kJson) {
    std::cout << absl::StrFormat("%-24s %s, closed\n", "pieces", WithThousands(report.pieces));
  }
  return IsAsked() ? Compare(view, parts, format, json) : absl::OkStatus();
}

absl::Status SurfaceCheck::Compare(const core::MeshView& view, const core::SolidParts& parts, OutputFormat format,
                                   Json& json) const {
  WELLSPACE_ASSIGN_OR_RETURN(const formats::Surface surface, options_.Read(path_, {}));
  core::SurfaceFeatures features = options_.FeaturesOf(surface);
  const std::vector<core::SolidSeed> seeds = SeedsOf(surface);
  features.seeds = seeds;
  const core::RunContext context;
  WELLSPACE_ASSIGN_OR_RETURN(const core::SurfaceReport inspected,
                             core::InspectSurface(surface.points, features, kMostThreads, context));
  if (!inspected.faults.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(surface.name, ": ", core::WordsOf(inspected.faults[0].kind),
                                                   "; what it bounds cannot be told. `wellspace info ",
                                                   options_.FilesFrom(path_), "` tells all faults"));
  }
  core::FidelityOptions wanted;
  wanted.tolerance =
      tolerance_.value_or(Length{.value = kDefaultTolerance, .is_share = true, .whole = Length::Whole::kDiagonal})
          .Of(features.box.has_value() ? CornersOf(*features.box) : surface.points, 3);
  WELLSPACE_ASSIGN_OR_RETURN(
      const core::FidelityReport report,
      core::CompareWithSurface(view, parts, {.points = surface.points, .features = features}, wanted, context));
  json["surface"] = {{"file", options_.FilesFrom(path_)},
                     {"triangles", report.triangles},
                     {"solids", report.solids},
                     {"diagonal", report.diagonal},
                     {"tolerance", wanted.tolerance},
                     {"deviation_of_facets", DeviationJson(report.of_facets, report.diagonal)},
                     {"deviation_of_surface", DeviationJson(report.of_surface, report.diagonal)},
                     {"worst_volume", report.worst_volume},
                     {"curves", report.curves},
                     {"lost_curves", report.lost_curves},
                     {"tested_points", report.tested_points}};
  if (format != OutputFormat::kJson) {
    Print(report);
  }
  return report.verdict;
}

}  // namespace wellspace::cli
