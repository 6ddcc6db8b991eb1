#include "client/cli/parameter_options.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <numbers>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "client/cli/length.h"
#include "client/cli/options.h"
#include "client/cli/size_field_options.h"
#include "client/error_details.h"
#include "client/formats/cloud.h"
#include "client/formats/io/number.h"
#include "client/json/json.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

// Those that can be asked for.
constexpr std::array kCriteria = {client::Criterion::kRadiusEdge, client::Criterion::kWellSpaced};
constexpr char kPeriodic[] = "--periodic";
constexpr std::string_view kPeriodicAxes = "periodic_axes";
constexpr std::string_view kAxes = "xyz";
constexpr char kTolerance[] = "--tolerance";
constexpr char kFacetLength[] = "--facet-length";
constexpr char kMinFacetAngle[] = "--min-facet-angle";
constexpr char kMinSize[] = "--min-size";
constexpr char kPerCircle[] = "--per-circle";
constexpr char kLayers[] = "--layers";

bool IsDimension(size_t dimension) {
  return dimension >= formats::kMinDimension && dimension <= formats::kMaxDimension;
}

// Numbers as they might have been written.
std::string Text(const std::vector<double>& numbers) { return absl::StrJoin(numbers, ","); }

}  // namespace

CLI::Option* AddCriterion(CLI::App& command, client::Criterion& criterion) {
  std::vector<std::string> names;
  std::ranges::transform(kCriteria, std::back_inserter(names), client::CriterionName);
  return command
      .add_option_function<std::string>(
          "--criterion",
          [&criterion](const std::string& name) {
            criterion = *std::ranges::find(kCriteria, name, client::CriterionName);  // which ->check() has found
          },
          "What --rho bounds: radius-edge, circumradius / shortest edge of every simplex; or well-spaced, for every "
          "vertex the farthest node of its Voronoi cell / its nearest neighbour, which is stronger; default: "
          "radius-edge")
      ->check(CLI::IsMember(names));
}

void AddSizes(CLI::App& command, std::optional<double>& max_circumradius,
              std::vector<std::vector<double>>& size_boxes) {
  AddNumber(command, "--size", max_circumradius, "Bound on the circumradius of every simplex, or none; default: none");
  AddNumberLists(command, "--size-box", size_boxes,
                 "Low corner, high corner and a bound on the circumradius of every simplex whose circumball meets this "
                 "box; may be given more than once");
}

absl::StatusOr<std::vector<client::SizeBox>> SizeBoxesOf(const std::vector<std::vector<double>>& size_boxes,
                                                         int dimension) {
  std::vector<client::SizeBox> boxes;
  for (const std::vector<double>& numbers : size_boxes) {
    const size_t corner = numbers.size() / 2;
    const bool is_expected = dimension == 0 ? IsDimension(corner) : corner == static_cast<size_t>(dimension);
    if (!is_expected || numbers.size() % 2 == 0) {
      return absl::InvalidArgumentError(absl::StrCat(
          "--size-box ", Text(numbers), ": expected low corner, high corner and size, ",
          dimension == 0 ? absl::StrCat(2 * formats::kMinDimension + 1, " numbers in ", formats::kMinDimension,
                                        "-D to ", 2 * formats::kMaxDimension + 1, " in ", formats::kMaxDimension, "-D")
                         : absl::StrCat(2 * dimension + 1, " numbers in ", dimension, "-D"),
          ", got ", numbers.size()));
    }
    boxes.push_back({.low = {numbers.begin(), numbers.begin() + corner},
                     .high = {numbers.begin() + corner, numbers.end() - 1},
                     .max_circumradius = numbers.back()});
  }
  return boxes;
}

void AddPeriodic(CLI::App& command, std::vector<int>& axes, const std::string& description) {
  const auto parse = [&axes](const std::string& text) {
    axes.clear();
    for (const std::string& name : std::vector<std::string>(absl::StrSplit(text, ','))) {
      const size_t axis = kAxes.find(name);
      if (name.size() != 1 || axis == std::string_view::npos) {
        throw CLI::ValidationError(kPeriodic, absl::StrCat("expected axes out of x, y and z with commas between, as "
                                                           "x,y, got ",
                                                           formats::Quote(text)));
      }
      axes.push_back(static_cast<int>(axis));
    }
    std::sort(axes.begin(), axes.end());
  };
  command.add_option_function<std::string>(kPeriodic, parse, description)->type_name("AXES");
}

void ParameterOptions::AddSpaceTo(CLI::App& command) {
  command.add_option("--dimension", dimension_, "Dimension; default: as many as the points have coordinates")
      ->check(CLI::Range(formats::kMinDimension, formats::kMaxDimension));
  CLI::Option* domain =
      AddNumbers(command, "--domain", domain_, "Box to be meshed, low corner then high corner; default: by --margin");
  AddNumber(command, "--margin", options_.margin,
            "Grow the bounding box of the points on every side by this times its longest side; default: 0.25")
      ->excludes(domain);
  AddLength(command, "--merge", merge_,
            "Points no farther than this from another one become that one's vertex, and ends of segments with them: a "
            "length, or a share of the longest side of the points' bounding box, as 0.01%; default: equal ones, and "
            "corners of polygons that doubles cannot tell apart");
  AddPeriodic(
      command, options_.periodic_axes,
      "Axes along which the box is periodic, as x or x,y: for each vertex on one of two opposite sides there is "
      "one on the other, and the facets on both match; in 2-D and 3-D, for points without triangles; with segments "
      "the sides of their bounding rectangle have the same segments; default: none");
}

void ParameterOptions::AddQualityTo(CLI::App& command) {
  AddCriterion(command, options_.criterion);
  AddNumber(command, "--rho", options_.rho,
            "Bound of the criterion; default: that of the dimension, sqrt(2) in 2-D, 2 in 3-D");
  AddNumber(
      command, "--min-angle", min_angle_,
      "2-D: in the place of --rho, 1 / (2 sin) of this: no angle of a triangle is smaller, in degrees, up to 33.7; "
      "above 20.7 refinement need not end")
      ->excludes(command.get_option("--rho"))
      ->check(CLI::Range(0.001, 33.7));
  AddSizes(command, options_.max_circumradius, size_boxes_);
  AddNumber(command, "--edge-length", options_.edge_length,
            "Length that edges have on average where the points ask for no shorter ones, or none; default: none");
  AddGradation(command, options_.gradation);
  AddNumber(command, "--min-dihedral", options_.min_dihedral,
            "3-D: move and add vertices until no dihedral angle is smaller, in degrees, up to 18; 0: leave slivers as "
            "they are; default: 12");
  AddSurfaceTo(command);
  command.add_flag("--pump-weights", options_.pump_weights,
                   "From 3-D on: give vertices weights that make the worst simplices better; the mesh is then their "
                   "regular triangulation, not Delaunay. After --min-dihedral only if that has left slivers");
  command.add_flag(
      "--keep-vertices", options_.keep_vertices,
      "In a session: leave the vertices of its last mesh where they are; the repair of slivers, which is on by "
      "default in 3-D, then adds vertices, and moves only new ones");
  AddCount(
      command, "--max-vertices", [this](uint64_t count) { options_.max_vertices = count; },
      "Fail before the mesh has more vertices than this; 50 million by default", 1);
  AddCount(
      command, "--threads", [this](uint64_t count) { options_.threads = static_cast<int>(count); },
      "Threads that mesh; default: as many as help, up to all cores; of a session 1", 1, 1024);
  for (const char* name : {"--criterion", "--rho", "--size", "--size-box", "--min-dihedral", "--pump-weights",
                           "--max-vertices", "--threads", "--keep-vertices", "--min-angle", "--edge-length",
                           "--gradation", kTolerance, kFacetLength, kMinFacetAngle, kMinSize, kPerCircle, kLayers}) {
    quality_.push_back(command.get_option(name));
  }
}

void ParameterOptions::AddSurfaceTo(CLI::App& command) {
  const std::string share = "; with %, a share of the diagonal of the surface's bounding box, as 0.1%";
  AddLength(
      command, kTolerance, tolerance_,
      "Of a surface: it and the facets of the mesh on it are nowhere farther apart, in either direction: a length" +
          share + "; default: 0.1%, with --solids winding --resolution",
      Length::Whole::kDiagonal);
  AddLength(command, kFacetLength, facet_length_,
            "Of a surface: length that edges on it have on average, where nothing asks for shorter ones" + share +
                "; default: none",
            Length::Whole::kDiagonal);
  AddNumber(command, kMinFacetAngle, options_.surface_parameters.min_facet_angle,
            "Of a surface: no facet has a smaller angle, but where the surface itself has, in degrees, up to 30; 0: "
            "whatever comes; default: 25");
  AddLength(command, kMinSize, min_size_,
            "Of a surface: nothing is added to it for its shape, or for --tolerance, nearer to another vertex than "
            "this" +
                share + "; default: half of --tolerance",
            Length::Whole::kDiagonal);
  AddNumber(command, kPerCircle, options_.surface_parameters.curvature_elements,
            "Of a surface: where it is curved, edges are so short that this many would go round a circle of its radius "
            "of curvature, and grow from there by --gradation; not for scans, whose noise is curvature; default: none");
  AddNumber(command, kLayers, options_.surface_parameters.thickness_layers,
            "Of a surface: where a solid is thin, edges are so short that this many go across it, and grow from there "
            "by --gradation; default: none");
}

const char* ParameterOptions::GivenOfSurface() const {
  const client::SurfaceParameters& surface = options_.surface_parameters;
  for (const auto& [is_given, name] : {std::pair<bool, const char*>(tolerance_.has_value(), kTolerance),
                                       {facet_length_.has_value(), kFacetLength},
                                       {surface.min_facet_angle.has_value(), kMinFacetAngle},
                                       {min_size_.has_value(), kMinSize},
                                       {surface.curvature_elements.has_value(), kPerCircle},
                                       {surface.thickness_layers.has_value(), kLayers}}) {
    if (is_given) {
      return name;
    }
  }
  return nullptr;
}

int ParameterOptions::dimension() const {
  if (dimension_ != 0 || !domain_.empty()) {
    return dimension_ != 0 ? dimension_ : static_cast<int>(domain_.size() / 2);
  }
  return size_boxes_.empty() ? 0 : static_cast<int>(size_boxes_.front().size() / 2);
}

absl::Status ParameterOptions::Check() const {
  if (!domain_.empty() && (domain_.size() % 2 != 0 || !IsDimension(domain_.size() / 2))) {
    return absl::InvalidArgumentError(
        absl::StrCat("--domain ", Text(domain_), ": expected low corner and high corner, ", 2 * formats::kMinDimension,
                     " numbers in ", formats::kMinDimension, "-D to ", 2 * formats::kMaxDimension, " in ",
                     formats::kMaxDimension, "-D, got ", domain_.size()));
  }
  if (!domain_.empty() && domain_.size() != 2u * dimension()) {
    return absl::InvalidArgumentError(absl::StrCat("--domain ", Text(domain_), ": expected ", 2 * dimension(),
                                                   " numbers with --dimension ", dimension(), ", got ",
                                                   domain_.size()));
  }
  return SizeBoxesOf(size_boxes_, IsDimension(dimension()) ? dimension() : 0).status();
}

absl::StatusOr<client::MeshOptions> ParameterOptions::For(int dimension, std::span<const double> points) const {
  WELLSPACE_ASSIGN_OR_RETURN(std::vector<client::SizeBox> boxes, SizeBoxesOf(size_boxes_, dimension));
  client::MeshOptions options = options_;
  options.dimension = dimension;
  options.size_boxes = std::move(boxes);
  for (const auto& [name, length, value] : {std::tuple("--merge", &merge_, &options.merge_distance),
                                            {kTolerance, &tolerance_, &options.surface_parameters.tolerance},
                                            {kFacetLength, &facet_length_, &options.surface_parameters.edge_length},
                                            {kMinSize, &min_size_, &options.surface_parameters.min_size}}) {
    if (length->has_value() && (*length)->is_share && points.empty()) {
      return absl::InvalidArgumentError(
          absl::StrCat(name, ": a share is one of the points, which are not known here; give a length"));
    }
    if (length->has_value()) {
      *value = (*length)->Of(points, dimension);
    }
  }
  if (min_angle_ > 0) {
    if (dimension != 2) {
      return absl::InvalidArgumentError(
          absl::StrCat("--min-angle: it is for 2-D, and the points are in ", dimension, "-D; use --rho"));
    }
    options.rho = 0.5 / std::sin(min_angle_ * std::numbers::pi / 180);
  }
  options.domain_low.assign(domain_.begin(), domain_.begin() + domain_.size() / 2);
  options.domain_high.assign(domain_.begin() + domain_.size() / 2, domain_.end());
  return options;
}

bool ParameterOptions::has_quality() const {
  return std::any_of(quality_.begin(), quality_.end(), [](const CLI::Option* option) { return option->count() > 0; });
}

absl::StatusOr<client::MeshOptions> ParameterOptions::Replace(client::MeshOptions parameters) const {
  absl::StatusOr<client::MeshOptions> given = For(parameters.dimension);
  if (!given.ok()) {
    return given;
  }
  const auto replace = [this](size_t option, auto& old_value, auto&& value) {
    if (quality_[option]->count() > 0) {
      old_value = std::forward<decltype(value)>(value);
    }
  };
  replace(0, parameters.criterion, given->criterion);
  replace(1, parameters.rho, given->rho);
  replace(2, parameters.max_circumradius, given->max_circumradius);
  replace(3, parameters.size_boxes, std::move(given->size_boxes));
  replace(4, parameters.min_dihedral, given->min_dihedral);
  replace(5, parameters.pump_weights, given->pump_weights);
  replace(6, parameters.max_vertices, given->max_vertices);
  replace(7, parameters.threads, given->threads);
  replace(8, parameters.keep_vertices, given->keep_vertices);
  replace(9, parameters.rho, given->rho);
  replace(10, parameters.edge_length, given->edge_length);
  replace(11, parameters.gradation, given->gradation);
  replace(12, parameters.surface_parameters.tolerance, given->surface_parameters.tolerance);
  replace(13, parameters.surface_parameters.edge_length, given->surface_parameters.edge_length);
  replace(14, parameters.surface_parameters.min_facet_angle, given->surface_parameters.min_facet_angle);
  replace(15, parameters.surface_parameters.min_size, given->surface_parameters.min_size);
  replace(16, parameters.surface_parameters.curvature_elements, given->surface_parameters.curvature_elements);
  replace(17, parameters.surface_parameters.thickness_layers, given->surface_parameters.thickness_layers);
  return parameters;
}

std::string ParameterOptions::OptionOf(const std::string& field) const {
  constexpr std::string_view kParameters = "parameters.";
  if (field.compare(0, kParameters.size(), kParameters) != 0) {
    return "";
  }
  const std::string name = field.substr(kParameters.size());
  constexpr std::string_view kSizeBoxes = "size_boxes[";
  size_t index = 0;
  if (name.compare(0, kSizeBoxes.size(), kSizeBoxes) == 0 &&
      std::from_chars(name.data() + kSizeBoxes.size(), name.data() + name.size(), index).ec == std::errc() &&
      index < size_boxes_.size()) {
    return absl::StrCat("--size-box ", Text(size_boxes_[index]));
  }
  if (name == "max_circumradius") {
    return "--size";
  }
  if (name == "merge_distance") {
    return "--merge";
  }
  if (name.compare(0, kPeriodicAxes.size(), kPeriodicAxes) == 0) {
    return kPeriodic;
  }
  for (const auto& [of_surface, option] : {std::pair<const char*, const char*>("surface.tolerance", kTolerance),
                                           {"surface.edge_length", kFacetLength},
                                           {"surface.min_facet_angle", kMinFacetAngle},
                                           {"surface.min_size", kMinSize},
                                           {"surface.curvature_elements", kPerCircle},
                                           {"surface.thickness_layers", kLayers}}) {
    if (name == of_surface) {
      return option;
    }
  }
  if (const char* const given = GivenOfSurface(); name == "surface" && given != nullptr) {
    return given;
  }
  std::string option = "--" + name;
  std::replace(option.begin(), option.end(), '_', '-');
  return option;
}

absl::Status ParameterOptions::Explain(const absl::Status& status) const {
  const std::string option = OptionOf(client::BlamedField(status));
  return option.empty() ? status : client::WithMessage(status, absl::StrCat(option, ": ", status.message()));
}

}  // namespace wellspace::cli
