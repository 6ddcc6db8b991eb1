#include "core/input/mesh_parameters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace wellspace::core {
namespace {

absl::Status CheckSizeBox(const SizeBox& size, size_t index, int dimension) {
  const auto refuse = [index](const auto&... text) {
    return absl::InvalidArgumentError(absl::StrCat("size_boxes[", index, "]", text...));
  };
  if (size.low.size() != static_cast<size_t>(dimension)) {
    return refuse(".low: ", size.low.size(), " coordinates; ", dimension, " are needed");
  }
  if (size.high.size() != static_cast<size_t>(dimension)) {
    return refuse(".high: ", size.high.size(), " coordinates; ", dimension, " are needed");
  }
  for (int i = 0; i < dimension; ++i) {
    if (!std::isfinite(size.low[i])) {
      return refuse(".low[", i, "]: ", size.low[i], " is not allowed; a finite number is");
    }
    if (!(std::isfinite(size.high[i]) && size.low[i] <= size.high[i])) {
      return refuse(".high[", i, "]: ", size.high[i], " is not allowed; a finite number not below the low one, ",
                    size.low[i], ", is");
    }
  }
  if (!(size.max_circumradius > 0 && std::isfinite(size.max_circumradius))) {
    return refuse(".max_circumradius: ", size.max_circumradius, " is not allowed; a number above 0 is");
  }
  return absl::OkStatus();
}

absl::Status CheckSizeSamples(const SizeSamples& samples, int dimension) {
  const auto refuse = [](const auto&... text) {
    return absl::InvalidArgumentError(absl::StrCat("size_samples.", text...));
  };
  if (samples.points.size() != samples.sizes.size() * dimension) {
    return refuse("points: ", samples.points.size(), " coordinates for ", samples.sizes.size(), " sizes; ", dimension,
                  " for each are needed");
  }
  for (size_t i = 0; i < samples.points.size(); ++i) {
    if (!std::isfinite(samples.points[i])) {
      return refuse("points[", i / dimension, "]: coordinate ", i % dimension, " is ", samples.points[i],
                    "; a finite number is needed");
    }
  }
  for (size_t i = 0; i < samples.sizes.size(); ++i) {
    if (!(samples.sizes[i] > 0 && std::isfinite(samples.sizes[i]))) {
      return refuse("sizes[", i, "]: ", samples.sizes[i], " is not allowed; a number above 0 is");
    }
  }
  return absl::OkStatus();
}

absl::Status CheckSizes(const MeshParameters& parameters) {
  const auto check_bound = [](const char* name, double bound) {
    return bound >= 0 && std::isfinite(bound)
               ? absl::OkStatus()
               : absl::InvalidArgumentError(absl::StrCat(name, ": ", bound, " is not allowed; a number above 0 is"));
  };
  WELLSPACE_RETURN_IF_ERROR(check_bound("max_circumradius", parameters.max_circumradius));
  WELLSPACE_RETURN_IF_ERROR(check_bound("edge_length", parameters.edge_length));
  for (size_t i = 0; i < parameters.size_boxes.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckSizeBox(parameters.size_boxes[i], i, parameters.dimension));
  }
  if (parameters.size_samples != nullptr) {
    WELLSPACE_RETURN_IF_ERROR(CheckSizeSamples(*parameters.size_samples, parameters.dimension));
  }
  if (!(parameters.gradation >= 0 && parameters.gradation <= 1)) {
    return absl::InvalidArgumentError(
        absl::StrCat("gradation: ", parameters.gradation, " is not allowed; a number above 0 and at most 1 is"));
  }
  return absl::OkStatus();
}

absl::Status CheckSurface(const SurfaceParameters& surface, int dimension) {
  const auto refuse = [](const auto&... text) { return absl::InvalidArgumentError(absl::StrCat("surface", text...)); };
  if (dimension != 3 && surface != SurfaceParameters()) {
    return refuse(": it is not allowed in ", dimension, "-D; triangles bound domains in 3-D alone");
  }
  for (const auto& [name, number] : {std::pair(".tolerance", surface.tolerance),
                                     {".edge_length", surface.edge_length},
                                     {".min_size", surface.min_size},
                                     {".curvature_elements", surface.curvature_elements},
                                     {".thickness_layers", surface.thickness_layers}}) {
    if (!(number >= 0 && std::isfinite(number))) {
      return refuse(name, ": ", number, " is not allowed; a number above 0 is");
    }
  }
  if (const double angle = surface.min_facet_angle.value_or(0); !(angle >= 0 && angle <= kMostFacetAngle)) {
    return refuse(".min_facet_angle: ", angle, " is not allowed; 0 to ", kMostFacetAngle, " degrees are");
  }
  if (surface.outside_rho != 0 && !(surface.outside_rho >= MinimumRho(3) && std::isfinite(surface.outside_rho))) {
    return refuse(".outside_rho: ", surface.outside_rho, " is not allowed; ", MinimumRho(3),
                  " or more is, and the default is ", kDefaultOutsideRho);
  }
  return absl::OkStatus();
}

absl::Status CheckPeriodicAxes(const MeshParameters& parameters) {
  const std::vector<int>& axes = parameters.periodic_axes;
  const int dimension = parameters.dimension;
  if (axes.empty()) {
    return absl::OkStatus();
  }
  if (dimension > kMostPeriodicDimension) {
    return absl::InvalidArgumentError(absl::StrCat("periodic_axes: they are not allowed in ", dimension,
                                                   "-D; boxes are periodic in 2-D and ", kMostPeriodicDimension, "-D"));
  }
  for (size_t i = 0; i < axes.size(); ++i) {
    if (axes[i] < 0 || axes[i] >= dimension) {
      return absl::InvalidArgumentError(absl::StrCat("periodic_axes[", i, "]: ", axes[i], " is no axis in ", dimension,
                                                     "-D; 0 to ", dimension - 1, " are"));
    }
    const auto first = std::find(axes.begin(), axes.begin() + static_cast<std::ptrdiff_t>(i), axes[i]);
    if (first != axes.begin() + static_cast<std::ptrdiff_t>(i)) {
      return absl::InvalidArgumentError(absl::StrCat("periodic_axes[", i, "]: axis ", axes[i],
                                                     " is there already, as periodic_axes[", first - axes.begin(),
                                                     "]; give each axis once"));
    }
  }
  if (parameters.pump_weights) {
    return absl::InvalidArgumentError(
        "pump_weights: true is not allowed with periodic_axes, since weights would differ across the box; leave one of "
        "the two out");
  }
  return absl::OkStatus();
}

}  // namespace

double DefaultRho(int dimension) {
  constexpr std::array<double, kMaxDimension + 1> kDefaults = {0, 0, std::numbers::sqrt2, 2, 2.9, 4.1, 5.8};
  return kDefaults[dimension];
}

double MinimumRho(int dimension) {
  constexpr std::array<double, kMaxDimension + 1> kMinimums = {0, 0, 0.9, 1.1, 1.5, 2, 3};
  return kMinimums[dimension];
}

uint64_t VertexBudget(const MeshParameters& parameters) {
  return std::min(parameters.max_vertices == 0 ? kDefaultMaxVertices : parameters.max_vertices, kMaxVertices);
}

double DefaultMinDihedral(int dimension) { return dimension == 3 ? 12 : 0; }

absl::Status ValidateParameters(const MeshParameters& parameters) {
  const int dimension = parameters.dimension;
  if (dimension < kMinDimension || dimension > kMaxDimension) {
    return absl::InvalidArgumentError(
        absl::StrCat("dimension: ", dimension, " is not supported; ", kMinDimension, " to ", kMaxDimension, " are"));
  }
  if (parameters.rho != 0 && !(parameters.rho >= MinimumRho(dimension) && std::isfinite(parameters.rho))) {
    return absl::InvalidArgumentError(absl::StrCat("rho: ", parameters.rho, " is not allowed in ", dimension,
                                                   "-D; refinement ends for ", MinimumRho(dimension),
                                                   " or more, and the default is ", DefaultRho(dimension)));
  }
  if (parameters.domain_low.size() != parameters.domain_high.size() ||
      (!parameters.domain_low.empty() && parameters.domain_low.size() != static_cast<size_t>(dimension))) {
    return absl::InvalidArgumentError(absl::StrCat("domain: ", parameters.domain_low.size(), " low and ",
                                                   parameters.domain_high.size(), " high coordinates; ", dimension,
                                                   " of each are needed, or none"));
  }
  for (size_t i = 0; i < parameters.domain_low.size(); ++i) {
    const double low = parameters.domain_low[i];
    const double high = parameters.domain_high[i];
    if (!std::isfinite(low) || !std::isfinite(high) || !(low < high)) {
      return absl::InvalidArgumentError(
          absl::StrCat("domain: along axis ", i, " it goes from ", low, " to ", high,
                       "; finite numbers are needed, the low one less than the high one"));
    }
  }
  if (!(parameters.margin >= 0 && parameters.margin <= 1e6)) {
    return absl::InvalidArgumentError(
        absl::StrCat("margin: ", parameters.margin, " is not allowed; 0 to 1e6 times the longest side is"));
  }
  if (!(parameters.merge_distance >= 0 && std::isfinite(parameters.merge_distance))) {
    return absl::InvalidArgumentError(absl::StrCat("merge_distance: ", parameters.merge_distance,
                                                   " is not allowed; a number above 0 is, or 0 for equal points only"));
  }
  WELLSPACE_RETURN_IF_ERROR(CheckSizes(parameters));
  if (parameters.min_dihedral.has_value()) {
    const double most = dimension == 3 ? kMostMinDihedral : 0;
    if (!(*parameters.min_dihedral >= 0 && *parameters.min_dihedral <= most)) {
      return absl::InvalidArgumentError(absl::StrCat("min_dihedral: ", *parameters.min_dihedral, " is not allowed in ",
                                                     dimension, "-D; ", dimension == 3 ? "0 to " : "", most,
                                                     dimension == 3 ? " degrees are" : " is, for none of that"));
    }
  }
  if (parameters.pump_weights && dimension < 3) {
    return absl::InvalidArgumentError(
        absl::StrCat("pump_weights: true is not allowed in ", dimension, "-D, where there are no slivers; false is"));
  }
  WELLSPACE_RETURN_IF_ERROR(CheckPeriodicAxes(parameters));
  WELLSPACE_RETURN_IF_ERROR(CheckSurface(parameters.surface, dimension));
  return CheckThreads(parameters.threads);
}

absl::Status CheckThreads(int threads) {
  if (threads < 1 || threads > 1024) {
    return absl::InvalidArgumentError(absl::StrCat("threads: ", threads, " is not allowed; 1 to 1024 is"));
  }
  return absl::OkStatus();
}

}  // namespace wellspace::core
