#include "core/input/surface_report.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/status_macros.h"
#include "core/input/prepared_surface.h"

namespace wellspace::core {

const char* NameOf(SurfaceFault::Kind kind) {
  switch (kind) {
    case SurfaceFault::Kind::kMarkersDiffer:
      return "markers_differ";
    case SurfaceFault::Kind::kSelfIntersections:
      return "self_intersections";
    case SurfaceFault::Kind::kNearPoints:
      return "near_points";
    case SurfaceFault::Kind::kOddEdges:
      return "odd_edges";
    case SurfaceFault::Kind::kOpenEdges:
      break;
  }
  return "open_edges";
}

std::string WordsOf(SurfaceFault::Kind kind) {
  std::string words = NameOf(kind);
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

absl::Status ErrorOf(const SurfaceFault& fault) {
  std::string text = absl::StrCat("triangles: ", fault.count, fault.has_more ? " or more " : " ", WordsOf(fault.kind));
  if (!fault.places.empty()) {
    const FaultPlace& first = fault.places.front();
    absl::StrAppend(&text, absl::StrFormat(", the first at (%.6g, %.6g, %.6g)", first.at[0], first.at[1], first.at[2]));
    for (size_t i = 0; i < first.triangles.size(); ++i) {
      absl::StrAppend(&text, i == 0 ? ", of triangles " : ", ", first.triangles[i]);
    }
  }
  return absl::InvalidArgumentError(absl::StrCat(text, "; expected ", fault.accepted));
}

absl::StatusOr<SurfaceReport> InspectSurface(std::span<const double> points, const SurfaceFeatures& features,
                                             int threads, const RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(CheckSurfaceFeatures(points, features));
  WELLSPACE_RETURN_IF_ERROR(
      context.ReserveMemory(InspectSurfaceBytes(points.size() / 3, features.triangle_count(), features.weld > 0)));
  WELLSPACE_ASSIGN_OR_RETURN(PreparedSurface prepared, PrepareSurface(points, features, threads, context));
  return std::move(prepared.report);
}

uint64_t InspectSurfaceBytes(uint64_t points, uint64_t triangles, bool welds) {
  return PrepareSurfaceBytes(points, triangles, welds);
}

}  // namespace wellspace::core
