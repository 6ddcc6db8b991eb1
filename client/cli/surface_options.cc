#include "client/cli/surface_options.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "client/formats/io/number.h"
#include "client/formats/surface/read_surface.h"

namespace wellspace::cli {
namespace {

constexpr char kEvenOdd[] = "even-odd";
constexpr char kHoles[] = "holes";
constexpr double kPercent = 0.01;

double DiagonalOf(const formats::Surface& surface) {
  std::array<double, 3> low{};
  std::array<double, 3> high{};
  for (size_t i = 0; i < surface.points.size(); ++i) {
    const double x = surface.points[i];
    low[i % 3] = i < 3 ? x : std::min(low[i % 3], x);
    high[i % 3] = i < 3 ? x : std::max(high[i % 3], x);
  }
  return std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
}

}  // namespace

void SurfaceOptions::AddTo(CLI::App& command, const std::string& what) {
  CLI::Option* const triangles = command.add_flag(
      "--triangles", has_triangles_,
      absl::StrCat(what,
                   " is a surface in 3-D: faces of .obj, .ply and .off are its triangles. Files of .stl, .smesh and "
                   "3-D .poly always have a surface"));
  command.add_flag("--as-points", as_points_, absl::StrCat(what, " is a cloud: of .stl, its corners"))
      ->excludes(triangles);
  command
      .add_option("--solids", solids_,
                  "Which solids, into which triangles cut space, are meant: even-odd, those that an odd number of "
                  "triangles separates from outside; holes, all bounded ones but holes, so that materials may share "
                  "facets; default: holes for .smesh and .poly, otherwise even-odd")
      ->check(CLI::IsMember({kEvenOdd, kHoles}));
  command
      .add_option("--crease-angle", crease_angle_,
                  "Edges with more than this angle between the normals of their triangles are creases; 180: none; "
                  "default 30")
      ->type_name("DEGREES")
      ->check(CLI::Range(0.0, 180.0));
  const auto parse = [this](const std::string& text) {
    Length length{.is_share = !text.empty() && text.back() == '%'};
    const std::string number = text.substr(0, text.size() - (length.is_share ? 1 : 0));
    if (!formats::ParseFinite(number, length.value).ok() || length.value < 0) {
      throw CLI::ValidationError(
          "--weld", absl::StrCat("expected a length, 0 or more, or a share of the diagonal as 0.001%, got ",
                                 formats::Quote(text)));
    }
    length.value *= length.is_share ? kPercent : 1;
    weld_ = length;
  };
  command
      .add_option_function<std::string>("--weld", parse,
                                        "Corners no farther than this from each other become one: a length, or with % "
                                        "a share of the diagonal; default: 0.0001% for .stl, otherwise 0")
      ->type_name("LENGTH");
}

bool SurfaceOptions::IsSurface(const std::string& path, const formats::CloudOptions& options) const {
  if (as_points_) {
    return false;
  }
  if (has_triangles_ || options.format == "smesh" || options.format == "poly") {
    return true;
  }
  const bool asks_for_points = !options.columns.empty() || options.skip_invalid;
  return !asks_for_points && (options.format.empty() ? formats::IsSurfacePath(path) : options.format == "stl");
}

absl::Status SurfaceOptions::CheckOther(const std::string& what) const {
  const char* const option = !solids_.empty()            ? "--solids"
                             : crease_angle_.has_value() ? "--crease-angle"
                             : weld_.has_value()         ? "--weld"
                                                         : nullptr;
  return option == nullptr ? absl::OkStatus()
                           : absl::InvalidArgumentError(absl::StrCat(
                                 option, ": ", what,
                                 " is read as a mesh or as points; give a .stl, .smesh or 3-D .poly, or --triangles"));
}

absl::StatusOr<formats::Surface> SurfaceOptions::Read(const std::string& path,
                                                      const formats::CloudOptions& options) const {
  const char* const option = !options.columns.empty() ? "--columns" : options.skip_invalid ? "--skip-invalid" : nullptr;
  if (option != nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat(option, ": ", path,
                     " is a surface, all of whose points are needed; leave it out, or give "
                     "--as-points"));
  }
  return formats::ReadSurface(path, options.format);
}

core::SurfaceFeatures SurfaceOptions::FeaturesOf(const formats::Surface& surface) const {
  core::SurfaceFeatures features;
  features.corners = surface.corners;
  features.markers = surface.markers;
  const bool holes = solids_.empty() ? surface.solids == formats::Surface::SolidRule::kHoles : solids_ == kHoles;
  features.solids = holes ? core::SolidRule::kHoles : core::SolidRule::kEvenOdd;
  features.crease_angle = crease_angle_.value_or(features.crease_angle);
  const Length weld = weld_.value_or(Length{.value = surface.names_points ? 0 : kWeldShare, .is_share = true});
  features.weld = weld.value * (weld.is_share ? DiagonalOf(surface) : 1);
  return features;
}

}  // namespace wellspace::cli
