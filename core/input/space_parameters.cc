#include "core/input/space_parameters.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/geometry/triangle.h"

namespace wellspace::core {

absl::Status ValidateSpaceParameters(const MeshParameters& parameters, const SurfaceFeatures& features) {
  WELLSPACE_RETURN_IF_ERROR(ValidateParameters(parameters));
  if (parameters.dimension != 3) {
    return absl::InvalidArgumentError(
        absl::StrCat("dimension: triangles bound domains in 3-D alone, and it is ", parameters.dimension));
  }
  if (!parameters.periodic_axes.empty()) {
    return absl::InvalidArgumentError(
        "periodic_axes: a domain with a surface is not periodic; a box of points, and a domain in the plane, can be; "
        "leave them out, in a session of its own");
  }
  if (parameters.criterion != Criterion::kRadiusEdge) {
    return absl::InvalidArgumentError("criterion: a domain with a surface has the radius-edge criterion alone");
  }
  if (parameters.pump_weights) {
    return absl::InvalidArgumentError("pump_weights: a domain with a surface has no weights; leave it out");
  }
  if (!parameters.domain_low.empty()) {
    return absl::InvalidArgumentError(
        "domain: a surface bounds what is meshed, or surface.box does with solids by box; leave it out");
  }
  if (parameters.merge_distance > 0) {
    return absl::InvalidArgumentError(absl::StrCat("merge_distance: points of a surface are welded, and it is ",
                                                   parameters.merge_distance, "; leave it out, and take weld"));
  }
  if (features.solids == SolidRule::kWinding && parameters.surface.curvature_elements > 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        "surface.curvature_elements: what is made of triangles by winding has the curvature of its cells, and it is ",
        parameters.surface.curvature_elements, "; leave it out, or give solids by even-odd or holes"));
  }
  for (size_t i = 0; i < features.seeds.size(); ++i) {
    const SolidSeed& seed = features.seeds[i];
    for (const double x : seed.at) {
      if (!std::isfinite(x)) {
        return absl::InvalidArgumentError(absl::StrCat("seeds[", i, "]: coordinate ", x, " is not finite"));
      }
    }
    if (!(seed.max_volume > 0)) {
      return absl::InvalidArgumentError(
          absl::StrCat("seeds[", i, "].max_volume: ", seed.max_volume, " is not allowed; a number above 0 is"));
    }
  }
  return absl::OkStatus();
}

double CurveEdgeOf(const MeshParameters& parameters) {
  double edge = std::numeric_limits<double>::infinity();
  for (const double length : {parameters.edge_length, parameters.surface.edge_length}) {
    edge = length > 0 ? std::min(edge, length) : edge;
  }
  return parameters.max_circumradius > 0 ? std::min(edge, parameters.max_circumradius / kRadiusPerEdge) : edge;
}

double DefaultToleranceOf(const SurfaceFeatures& features, double diagonal) {
  if (features.solids != SolidRule::kWinding) {
    return kDefaultTolerance * diagonal;
  }
  return features.resolution > 0 ? features.resolution : kWrapResolution * diagonal;
}

SurfaceCriteria SurfaceCriteriaOf(const MeshParameters& parameters, double default_tolerance, double scale) {
  const SurfaceParameters& surface = parameters.surface;
  SurfaceCriteria criteria;
  criteria.tolerance = (surface.tolerance > 0 ? surface.tolerance : default_tolerance) * scale;
  criteria.least_sine = std::sin(surface.min_facet_angle.value_or(kDefaultFacetAngle) * std::numbers::pi / 180);
  criteria.facet_radius = CurveEdgeOf(parameters) * kRadiusPerEdge * scale;
  if (surface.curvature_elements > 0 || surface.thickness_layers > 0) {
    criteria.facet_share = kRadiusPerEdge / CircumradiusOf(1, 3);
  }
  criteria.min_size = surface.min_size > 0 ? surface.min_size * scale : 0.5 * criteria.tolerance;
  criteria.outside_rho = surface.outside_rho > 0 ? surface.outside_rho : kDefaultOutsideRho;
  return criteria;
}

}  // namespace wellspace::core
