// wellspace check: is it a mesh, and how good is it?
#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/cloud_options.h"
#include "client/cli/commands/commands.h"
#include "client/cli/domain_options.h"
#include "client/cli/exit_codes.h"
#include "client/cli/face_rules.h"
#include "client/cli/interrupt.h"
#include "client/cli/mesh_paths.h"
#include "client/cli/options.h"
#include "client/cli/parameter_options.h"
#include "client/cli/progress_bar.h"
#include "client/cli/remote_command.h"
#include "client/cli/size_field_options.h"
#include "client/cli/surface_check.h"
#include "client/formats/domain/read_planar_domain.h"
#include "client/formats/file_plan.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/read_cloud.h"
#include "client/render/histograms.h"
#include "client/render/picture_format.h"
#include "core/base/status_macros.h"
#include "core/validate/validate.h"
#include "core/validate/validate_boundary.h"
#include "core/validate/validate_domain.h"
#include "core/validate/validate_periodic.h"

namespace wellspace::cli {
namespace {

// The dihedral angles below which a report counts slivers. Unit: degrees.
constexpr int kFlat = 5;
constexpr int kSliver = 12;

core::Criterion CriterionToCore(client::Criterion criterion) {
  switch (criterion) {
    case client::Criterion::kWellSpaced:
      return core::Criterion::kWellSpaced;
    case client::Criterion::kRadiusEdge:
    case client::Criterion::kUnknown:  // which AddCriterion does not offer
      break;
  }
  return core::Criterion::kRadiusEdge;
}

client::Json ReportJson(const core::QualityReport& report, int dimension, bool has_weights,
                        const std::vector<formats::BoundaryPart>& boundary) {
  client::Json json;
  json["boundary"] = client::Json::array();
  for (const formats::BoundaryPart& part : boundary) {
    json["boundary"].push_back({{"tag", part.tag}, {"name", part.name}, {"facets", part.facets}});
  }
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

// The part of the counts from the first to the last that is not 0, but at least up to `least`.
void Trim(render::Histogram& histogram, double least) {
  size_t first = 0;
  while (first + 1 < histogram.counts.size() && histogram.counts[first] == 0) {
    ++first;
  }
  size_t last = histogram.counts.size();
  while (last > first + 1 && histogram.counts[last - 1] == 0 &&
         histogram.low + histogram.width * static_cast<double>(last) > least) {
    --last;
  }
  histogram.counts.resize(last);
  histogram.counts.erase(histogram.counts.begin(), histogram.counts.begin() + static_cast<ptrdiff_t>(first));
  histogram.low += histogram.width * static_cast<double>(first);
}

absl::Status Plot(const core::QualityReport& report, int dimension, const std::string& mesh_path,
                  render::PictureFormat format, const std::string& path) {
  const std::string angle = dimension == 2 ? "angle" : "dihedral angle";
  const std::string unit = "\u00b0";
  const auto best = static_cast<size_t>(std::ceil(core::LargestSmallestAngle(dimension)));
  std::vector<render::Histogram> histograms = {
      {.title = "smallest " + angle,
       .unit = unit,
       .counts = {report.min_angles.begin(), report.min_angles.begin() + best}},
      {.title = "largest " + angle,
       .unit = unit,
       .tick = 20,
       .counts = {report.max_angles.begin(), report.max_angles.end()}},
      {.title = "radius-edge ratio",
       .width = core::kRatioWidth,
       .tick = 0.5,
       .counts = {report.radius_edge_ratios.begin(), report.radius_edge_ratios.end()}}};
  Trim(histograms[1], core::kDegrees);
  Trim(histograms[2], 2);
  if (report.radius_edge_ratios.back() > 0) {
    histograms[2].title += absl::StrFormat(" (last bar: above %g)", (core::kRatioBins - 1) * core::kRatioWidth);
  }
  const std::string caption = absl::StrFormat(
      "%s: %s %s, %ss %.4g\u00b0 to %.4g\u00b0, radius-edge at most %.4g", mesh_path, WithThousands(report.simplices),
      formats::SimplexName(dimension), angle, report.min_angle_deg, report.max_angle_deg, report.max_radius_edge);
  return render::WriteHistograms(histograms, caption, format, path);
}

// Splitting bends a segment by so much of the largest coordinate at most: a rounded crossing, a point that was near.
constexpr double kBentBy = 0x1p-40;

// Sizes that the mesh is held to.
struct WantedSizes {
  std::vector<core::SizeBox> boxes;
  core::SizeSamples samples;
};

struct CheckCommand {
  std::string mesh_path;
  std::string cloud_path;
  DomainOptions domain_options;
  SurfaceCheck surface;
  std::vector<double> domain_box;
  std::optional<Length> merge;
  formats::CloudOptions cloud_options;
  double rho = 0;
  client::Criterion criterion = client::Criterion::kRadiusEdge;
  std::optional<double> max_circumradius;
  std::vector<std::vector<double>> size_boxes;
  SizeFieldOptions size_field;
  std::optional<double> gradation;
  double min_dihedral = 0;
  std::vector<int> periodic_axes;
  std::string plot_path;
  OutputFormat format = OutputFormat::kText;

  absl::StatusOr<WantedSizes> Sizes(int dimension);
  absl::Status CheckFiles() const;
  // The points of --cloud, none without it; `report` says how they were read.
  absl::StatusOr<std::vector<double>> ReadCloudOf(int dimension, CloudReport& report);
  // Of --merge, about `cloud`; 0 without it.
  double MergeDistance(std::span<const double> cloud, int dimension) const {
    return merge.has_value() ? merge->Of(cloud, dimension) : 0;
  }
  bool IsCloudADomain() const {
    return !cloud_path.empty() && domain_options.IsDomain(cloud_path, cloud_options.format);
  }
  // The demands on the mesh. REQUIRES: `sizes` and `cloud` outlive the result.
  core::ValidationOptions ValidationFor(const WantedSizes& sizes, std::span<const double> cloud, int dimension) const;
  // Refuses options for a box that a domain with segments does not have.
  absl::Status CheckOptionsOfDomain() const;
  // Checks the mesh of a domain: by its own rules, and against the domain of --cloud, whose points are `points`.
  absl::Status ValidateDomain(const formats::Mesh& mesh, const core::MeshView& view,
                              std::span<const double> points) const;
  // Holds the mesh to its demands, its boundary too. `cloud`: the points of --cloud. `json`: the report.
  absl::Status Validate(const formats::Mesh& mesh, const core::MeshView& view, const WantedSizes& sizes,
                        std::span<const double> cloud, client::Json& json) const;
  // The part of that about sizes and angles alone.
  absl::Status ValidateShapes(const core::MeshView& view, const WantedSizes& sizes,
                              std::span<const double> cloud) const;
  // Prints the end of the report, and returns the exit code. `json`: the report so far.
  int Conclude(const absl::Status& violation, const CloudReport& cloud, const formats::Mesh& mesh,
               client::Json json) const;
  int Run();
};

absl::StatusOr<WantedSizes> CheckCommand::Sizes(int dimension) {
  WELLSPACE_ASSIGN_OR_RETURN(std::vector<client::SizeBox> read, SizeBoxesOf(size_boxes, dimension));
  WantedSizes sizes;
  for (client::SizeBox& box : read) {
    sizes.boxes.push_back({std::move(box.low), std::move(box.high), box.max_circumradius});
  }
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<const client::SizeSamples> samples,
                             size_field.Read(dimension, cloud_options.skip_invalid, gradation));
  if (samples != nullptr) {
    sizes.samples = {samples->points, samples->sizes,
                     samples->measure == client::SizeMeasure::kEdgeLength ? core::SizeMeasure::kEdgeLength
                                                                          : core::SizeMeasure::kCircumradius};
  }
  return sizes;
}

// Whether a part of the boundary has a name that it has in a domain with features alone, or a facet lies on no face of
// the mesh's bounding box: then it is such a domain.
bool HasFeatures(const formats::Mesh& mesh) {
  if ((mesh.dimension != 2 && mesh.dimension != 3) || mesh.facets.empty()) {
    return false;
  }
  for (const formats::BoundaryPart& part : mesh.boundary) {
    if (part.name == "unmarked" || part.name.rfind("marker_", 0) == 0) {
      return true;
    }
  }
  const formats::MeshShape shape = mesh.View().Shape();
  const uint64_t vertices = mesh.View().vertex_count();
  const auto d = static_cast<size_t>(mesh.dimension);
  for (size_t f = 0; f < mesh.facets.size(); f += d) {
    const auto corners = std::span(mesh.facets).subspan(f, d);
    if (std::any_of(corners.begin(), corners.end(), [&](uint32_t v) { return v >= vertices; })) {
      return true;  // the validator tells which
    }
    bool is_on_face = false;
    for (size_t axis = 0; axis < d; ++axis) {
      for (const double face : {shape.low[axis], shape.high[axis]}) {
        is_on_face = is_on_face || std::all_of(corners.begin(), corners.end(),
                                               [&](uint32_t v) { return mesh.points[d * v + axis] == face; });
      }
    }
    if (!is_on_face) {
      return true;
    }
  }
  return false;
}

// The tag of each facet.
std::vector<int32_t> TagsOf(const formats::Mesh& mesh) {
  std::vector<int32_t> tags;
  for (const formats::BoundaryPart& part : mesh.boundary) {
    tags.insert(tags.end(), part.facets, part.tag);
  }
  return tags;
}

core::BoundaryView BoundaryOf(const formats::Mesh& mesh, std::span<const int32_t> tags) {
  core::BoundaryView boundary{.facets = mesh.facets, .tags = tags};
  for (const formats::BoundaryPart& part : mesh.boundary) {
    boundary.names.emplace(part.tag, part.name);
  }
  return boundary;
}

// The seeds as the checks take them.
std::vector<core::FaceSeed> SeedsOf(const client::Features& features) {
  std::vector<core::FaceSeed> seeds;
  for (const client::FaceSeed& seed : features.seeds) {
    seeds.push_back({.at = {seed.x, seed.y},
                     .is_hole = seed.is_hole,
                     .region = seed.region,
                     .max_area = seed.max_area.value_or(std::numeric_limits<double>::infinity()),
                     .first_segment = static_cast<uint32_t>(seed.first_segment),
                     .segment_count = static_cast<uint32_t>(seed.segment_count)});
  }
  return seeds;
}

absl::Status CheckCommand::ValidateDomain(const formats::Mesh& mesh, const core::MeshView& view,
                                          std::span<const double> points) const {
  const core::RunContext context;
  if (const absl::Status status = core::ValidateDomainMesh(view, mesh.facets, rho, context).status();
      !status.ok() || !IsCloudADomain()) {
    return status;
  }
  const client::Features& given = *domain_options.features();
  const std::vector<core::FaceSeed> seeds = SeedsOf(given);
  core::DomainView domain{.points = points};
  domain.features.ends = given.ends;
  domain.features.markers = given.markers;
  domain.features.is_open = given.is_open;
  domain.features.seeds = seeds;
  domain.features.groups = given.groups;
  domain.features.faces = CoreFaceRuleOf(given.faces);
  domain.merge_distance = MergeDistance(points, 2);
  domain.has_markers = domain_options.KnowsMarkers();
  domain.has_regions = domain_options.KnowsRegions();
  if (!domain_box.empty()) {
    domain.box = core::Box<2>{{domain_box[0], domain_box[1]}, {domain_box[2], domain_box[3]}};
  }
  const std::vector<int32_t> tags = TagsOf(mesh);
  core::DomainParts parts{.boundary = BoundaryOf(mesh, tags), .regions = mesh.simplex_regions};
  for (const formats::Region& region : mesh.regions) {
    parts.region_names.emplace(region.id, region.name);
  }
  double size = 0;
  for (const double x : points) {
    size = std::max(size, std::abs(x));
  }
  // A segment that is led through a point may come near to another one by that.
  const double tolerance = std::max(kBentBy * size, 2 * given.snap_distance.value_or(0));
  return domain_options.WithOrigins(core::ValidateConformity(view, parts, domain, tolerance, context));
}

absl::Status CheckCommand::CheckFiles() const {
  formats::FilePlan files;
  files.ReadsMesh("MESH", mesh_path);
  files.Reads("--cloud", cloud_path);
  surface.AddFilesTo(files);
  size_field.AddFilesTo(files);
  files.Writes("--plot", plot_path);
  files.Writes("the figures", std::string(formats::kStandardStream));
  return files.Check();
}

absl::StatusOr<std::vector<double>> CheckCommand::ReadCloudOf(int dimension, CloudReport& report) {
  if (cloud_path.empty()) {
    return std::vector<double>();
  }
  formats::CloudOptions options = cloud_options;
  options.dimension = dimension;
  if (!IsCloudADomain()) {
    WELLSPACE_RETURN_IF_ERROR(domain_options.CheckCloud(absl::StrCat("--cloud ", cloud_path)));
  }
  WELLSPACE_ASSIGN_OR_RETURN(formats::PointCloud read, IsCloudADomain() ? domain_options.Read(cloud_path, options)
                                                                        : formats::ReadCloud(cloud_path, options));
  report = ReportOf(options, read.notes, read.skipped);
  PrintNotes(report, format, /*quiet=*/false);
  return std::move(read.points);
}

core::ValidationOptions CheckCommand::ValidationFor(const WantedSizes& sizes, std::span<const double> cloud,
                                                    int dimension) const {
  return {.rho = rho,
          .criterion = CriterionToCore(criterion),
          .max_circumradius = max_circumradius.value_or(0),
          .size_boxes = sizes.boxes,
          .size_samples = &sizes.samples,
          .gradation = gradation.value_or(0),
          .cloud = cloud,
          .merge_distance = MergeDistance(cloud, dimension),
          .min_angle_deg = min_dihedral};
}

absl::Status CheckCommand::CheckOptionsOfDomain() const {
  if (criterion == client::Criterion::kWellSpaced) {
    return absl::InvalidArgumentError(
        "--criterion well-spaced: a domain with segments or triangles has the radius-edge one alone");
  }
  if (!cloud_path.empty() && surface.IsAsked()) {
    return absl::InvalidArgumentError(
        "--cloud: the points of a surface need not be vertices; give --keep-points where they are to be");
  }
  if (!cloud_path.empty() && !IsCloudADomain()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--cloud ", cloud_path,
        ": the mesh is one of a domain with segments; give the domain, such as a .poly or .geojson, or --segments"));
  }
  if (!domain_box.empty() &&
      (domain_box.size() != 4 || !(domain_box[0] < domain_box[2]) || !(domain_box[1] < domain_box[3]))) {
    return absl::InvalidArgumentError("--domain: expected the low corner and then the high one of a box in the plane");
  }
  return absl::OkStatus();
}

absl::Status CheckCommand::ValidateShapes(const core::MeshView& view, const WantedSizes& sizes,
                                          std::span<const double> cloud) const {
  const core::ValidationOptions options = ValidationFor(sizes, cloud, view.dimension);
  WELLSPACE_RETURN_IF_ERROR(core::ValidateSizing(
      view, {options.max_circumradius, options.size_boxes, options.size_samples, options.gradation}));
  const double least = core::MeasureQuality(view).min_angle_deg;
  return least >= options.min_angle_deg
             ? absl::OkStatus()
             : absl::FailedPreconditionError(
                   absl::StrFormat("the smallest angle is %.6g\u00b0, less than %.6g", least, options.min_angle_deg));
}

absl::Status CheckCommand::Validate(const formats::Mesh& mesh, const core::MeshView& view, const WantedSizes& sizes,
                                    std::span<const double> cloud, client::Json& json) const {
  if (surface.IsAsked() || (mesh.dimension == 3 && HasFeatures(mesh))) {
    if (!periodic_axes.empty()) {
      return absl::InvalidArgumentError(
          "--periodic: it is for boxes and for domains in the plane, and the mesh is one of a surface");
    }
    WELLSPACE_RETURN_IF_ERROR(CheckOptionsOfDomain());
    WELLSPACE_RETURN_IF_ERROR(surface.Check(mesh, rho, format, json));
    return ValidateShapes(view, sizes, {});
  }
  if (HasFeatures(mesh) || IsCloudADomain()) {
    WELLSPACE_RETURN_IF_ERROR(CheckOptionsOfDomain());
    WELLSPACE_RETURN_IF_ERROR(ValidateDomain(mesh, view, cloud));
    WELLSPACE_RETURN_IF_ERROR(core::ValidatePeriodic(view, periodic_axes));
    return ValidateShapes(view, sizes, cloud);
  }
  WELLSPACE_RETURN_IF_ERROR(core::ValidateMesh(view, ValidationFor(sizes, cloud, mesh.dimension)));
  WELLSPACE_RETURN_IF_ERROR(core::ValidatePeriodic(view, periodic_axes));
  if (mesh.boundary.empty()) {
    return absl::OkStatus();
  }
  const std::vector<int32_t> tags = TagsOf(mesh);
  return core::ValidateBoundary(view, BoundaryOf(mesh, tags));
}

int CheckCommand::Conclude(const absl::Status& violation, const CloudReport& cloud, const formats::Mesh& mesh,
                           client::Json json) const {
  if (format == OutputFormat::kJson) {
    AddNotes(cloud, json);
    json["valid"] = violation.ok();
    json["violation"] = violation.ok() ? client::Json(nullptr) : client::Json(std::string(violation.message()));
    PrintJson(json);
  } else if (!violation.ok()) {
    std::cout << "violation: " << std::string(violation.message()) << "\n";
  } else {
    if (!mesh.boundary.empty()) {
      std::cout << "boundary: " << WithThousands(mesh.View().Shape().facet_count()) << " facets, "
                << mesh.boundary.size() << " tags\n";
    }
    std::cout << (mesh.weights.empty() ? "" : "the regular triangulation of its weights\n") << "valid\n";
  }
  return violation.ok() ? kExitOk : kExitFailed;
}

int CheckCommand::Run() {
  const absl::StatusOr<render::PictureFormat> plot_format =
      plot_path.empty() ? render::PictureFormat::kPng : render::PictureFormatOf(plot_path);
  if (!plot_format.ok()) {
    return ReportError(plot_format.status(), format);
  }
  if (const absl::Status status = CheckFiles(); !status.ok()) {
    return ReportError(status, format);
  }
  const absl::StatusOr<formats::Mesh> mesh = ReadMeshInput(mesh_path);
  if (!mesh.ok()) {
    return ReportError(mesh.status(), format);
  }
  const absl::StatusOr<WantedSizes> sizes = Sizes(mesh->dimension);
  if (!sizes.ok()) {
    return ReportError(sizes.status(), format);
  }
  if (!mesh->weights.empty() &&
      (rho != 0 || max_circumradius.has_value() || !size_boxes.empty() || size_field.IsGiven())) {
    return ReportError(absl::InvalidArgumentError(absl::StrCat(
                           mesh_path,
                           ": --rho, --size, --size-box and --size-field are about Delaunay simplices, and this "
                           "mesh has weights; expected a mesh without, or --min-dihedral")),
                       format);
  }
  CloudReport cloud_report;
  const absl::StatusOr<std::vector<double>> cloud = ReadCloudOf(mesh->dimension, cloud_report);
  if (!cloud.ok()) {
    return ReportError(cloud.status(), format);
  }
  NoteSizes(size_field, cloud_options, format, /*quiet=*/false, cloud_report);
  const core::MeshView view = {
      .dimension = mesh->dimension, .points = mesh->points, .simplices = mesh->simplices, .weights = mesh->weights};
  absl::Status status = core::ValidateIndices(view);
  client::Json json = client::Json::object();
  if (status.ok()) {
    const core::QualityReport report = core::MeasureQuality(view);
    if (format == OutputFormat::kJson) {
      json = ReportJson(report, mesh->dimension, !mesh->weights.empty(), mesh->boundary);
    } else {
      PrintReport(report, mesh->dimension);
    }
    if (!plot_path.empty()) {
      if (absl::Status plotted = Plot(report, mesh->dimension, mesh_path, *plot_format, plot_path); !plotted.ok()) {
        return ReportError(plotted, format);
      }
    }
    status = Validate(*mesh, view, *sizes, *cloud, json);
  }
  if (absl::IsInvalidArgument(status)) {  // the request cannot be met
    return ReportError(size_field.WithOrigins(status), format);
  }
  return Conclude(status, cloud_report, *mesh, std::move(json));
}

}  // namespace

void AddCheckCommand(CLI::App& app, int& exit_code) {
  const auto command = std::make_shared<CheckCommand>();
  CLI::App* check = app.add_subcommand("check",
                                       "Check a mesh: indices, orientation, topology, exact total volume, the Delaunay "
                                       "property or, with weights, that of their regular triangulation, "
                                       "circumcentres, that tagged facets are the boundary, of a domain with "
                                       "segments or triangles that these bound it, and what the options ask "
                                       "for; print its figures and `valid` or the first violation");
  check->footer(kExitCodesHelp);
  AddMeshInput(*check, command->mesh_path);
  check
      ->add_option(
          "--cloud", command->cloud_path,
          "File of points that must be the first vertices, to the bit; or a domain, such as a .poly or .geojson or "
          "with --segments, that the mesh must be of, with its faces, regions, largest areas and tags")
      ->type_name("FILE");
  AddLength(*check, "--merge", command->merge,
            "Points of --cloud no farther than this from a vertex that is one of them need not be vertices; as mesh "
            "takes it")
      ->needs("--cloud");
  AddCloudOptions(*check, command->cloud_options, "the cloud", formats::DomainOnlyFormats());
  command->surface.AddTo(*check);
  command->domain_options.AddReadingTo(*check, "The cloud");
  command->domain_options.AddSnapTo(*check,
                                    "Segments may be as far from their places as mesh --snap LENGTH leads them");
  AddNumbers(*check, "--domain", command->domain_box,
             "Box that lines are in, low corner then high corner; default: that of the mesh")
      ->needs("--cloud");
  CLI::Option* rho =
      AddNumber(*check, "--rho", command->rho, "Bound that the criterion must obey; default: not checked")
          ->check(AboveZero());
  AddCriterion(*check, command->criterion)->needs(rho);
  AddSizes(*check, command->max_circumradius, command->size_boxes);
  command->size_field.AddTo(*check);
  AddGradation(*check, command->gradation);
  for (const char* name : {"--size", "--gradation"}) {
    check->get_option(name)->check(AboveZero());
  }
  AddNumber(*check, "--min-dihedral", command->min_dihedral,
            "Bound on the dihedral angles, in 2-D on the angles, in degrees; default: not checked")
      ->check(AboveZero());
  AddPeriodic(*check, command->periodic_axes,
              "Axes along which opposite sides of the box, or of a domain's bounding rectangle, must match, vertex by "
              "vertex and facet by facet, as x,y; "
              "default: none");
  check
      ->add_option("--plot", command->plot_path, "Draw histograms of angles and radius-edge ratios, .png, .svg or .pdf")
      ->type_name("FILE");
  AddOutput(*check, command->format);
  check->callback([command, &exit_code] {
    const Interrupt interrupt(Interrupt::First::kEnd);
    exit_code = command->Run();
  });
}

}  // namespace wellspace::cli
