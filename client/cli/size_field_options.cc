#include "client/cli/size_field_options.h"

#include <charconv>
#include <cstdint>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/options.h"
#include "client/error_details.h"
#include "client/formats/read_sizes.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

constexpr char kRadius[] = "radius";
constexpr char kEdge[] = "edge";
constexpr char kGrow[] = "grow";
constexpr char kInterpolate[] = "interpolate";

// Of sizes at points: MeshParameters.gradation. The circumradius that stands for an edge of length 1, at least, in any
// dimension: MeshParameters.edge_length.
constexpr double kDefaultGradation = 0.3;
constexpr double kLeastRadiusOfEdge = 0.733;

}  // namespace

CLI::Option* AddGradation(CLI::App& command, std::optional<double>& gradation) {
  return AddNumber(command, "--gradation", gradation,
                   "How fast sizes, as circumradii, grow with the distance from boxes and points that have one, above "
                   "0 and up to 1; default: 1 from boxes, 0.3 from points");
}

CLI::Option* SizeFieldOptions::AddTo(CLI::App& command) {
  CLI::Option* field =
      command
          .add_option("--size-field", path_,
                      "File of points with a size each, from which sizes grow by --gradation: .csv and the like with "
                      "columns x, y, (z,) h; or .vtu, .msh, .npz with h at their points; or in 2-D a raster, .asc "
                      "(ESRI) or .tif (GeoTIFF), of sizes at the centres of its cells. A size holds at its point, "
                      "wherever that is, and grows from there")
          ->type_name("FILE");
  command
      .add_option_function<std::string>(
          "--size-unit",
          [this](const std::string& name) {
            measure_ = name == kEdge ? client::SizeMeasure::kEdgeLength : client::SizeMeasure::kCircumradius;
          },
          "What the sizes of --size-field are: radius, bounds on circumradii; or edge, lengths of edges as of "
          "--edge-length; default: radius")
      ->check(CLI::IsMember({kRadius, kEdge}))
      ->needs(field);
  command
      .add_option_function<std::string>(
          "--size-field-between", [this](const std::string& name) { interpolates_ = name == kInterpolate; },
          "What holds between the points of --size-field: grow, sizes grow from each, so that they are larger between "
          "two; or interpolate, of .vtu, .msh and .npz with simplices: sizes are interpolated linearly between the "
          "vertices of a simplex, as Gmsh and MMG have it, within 10 %, and grow no faster than --gradation; default: "
          "grow")
      ->check(CLI::IsMember({kGrow, kInterpolate}))
      ->needs(field);
  return field;
}

void SizeFieldOptions::AddFilesTo(formats::FilePlan& files) const { files.Reads("--size-field", path_); }

absl::StatusOr<std::shared_ptr<const client::SizeSamples>> SizeFieldOptions::Read(int dimension, bool skip_invalid,
                                                                                  std::optional<double> gradation) {
  if (path_.empty()) {
    return nullptr;
  }
  formats::SizeOptions options{.skip_invalid = skip_invalid};
  if (interpolates_) {
    options.growth_to_interpolate = gradation.value_or(kDefaultGradation);
    options.radius_of_size = measure_ == client::SizeMeasure::kEdgeLength ? kLeastRadiusOfEdge : 1;
  }
  WELLSPACE_ASSIGN_OR_RETURN(formats::SizedPoints read, formats::ReadSizes(path_, dimension, options));
  auto samples = std::make_shared<client::SizeSamples>();
  samples->points = std::exchange(read.cloud.points, {});
  samples->sizes = std::move(read.sizes);
  samples->measure = measure_;
  origins_ = std::move(read.cloud);
  return samples;
}

absl::Status SizeFieldOptions::WithOrigins(const absl::Status& status) const {
  const std::string_view message(status.message().data(), status.message().size());
  for (const std::string_view prefix :
       {"size_samples.points[", "size_samples.sizes[", "samples.points[", "samples.sizes["}) {
    uint64_t index = 0;
    if (message.substr(0, prefix.size()) == prefix &&
        std::from_chars(message.data() + prefix.size(), message.data() + message.size(), index).ec == std::errc()) {
      return client::WithMessage(status, absl::StrCat("--size-field ", origins_.Origin(index), ": ", status.message()));
    }
  }
  return status;
}

void NoteSizes(const SizeFieldOptions& field, const formats::CloudOptions& options, OutputFormat format, bool quiet,
               CloudReport& report) {
  if (!field.IsGiven()) {
    return;
  }
  PrintNotes(ReportOf(options, field.notes(), field.skipped()), format, quiet);
  report.notes.insert(report.notes.end(), field.notes().begin(), field.notes().end());
  if (options.skip_invalid) {
    report.skipped_sizes = field.skipped();
  }
}

}  // namespace wellspace::cli
