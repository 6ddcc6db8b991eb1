// A surface as it is prepared for meshing and for reports: on the scale of the computation, clean, with its solids and
// curves.
#ifndef WELLSPACE_CORE_INPUT_PREPARED_SURFACE_H_
#define WELLSPACE_CORE_INPUT_PREPARED_SURFACE_H_

#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/solids.h"
#include "core/features/surface_complex.h"
#include "core/features/surface_curves.h"
#include "core/features/surface_features.h"
#include "core/geometry/box.h"
#include "core/input/frame.h"
#include "core/input/surface_report.h"

namespace wellspace::core {

// All is on the scale of the frame but for the report.
struct PreparedSurface {
  Frame<3> frame;  // its box holds all points with room around them
  SurfaceComplex complex;
  Box<3> box{};   // of the triangles' corners
  Solids solids;  // found where the report has no faults
  SurfaceCurves curves;
  SurfaceReport report;
};

// Refuses shapes of arrays and lengths that no surface can have.
//
// Errors:     INVALID_ARGUMENT, naming the field.
absl::Status CheckSurfaceFeatures(std::span<const double> points, const SurfaceFeatures& features);

// As InspectSurface, but keeps the complex, solids and curves that it makes. Faults are in the report, and no errors.
//
// Errors:     as InspectSurface; but no memory is asked for.
absl::StatusOr<PreparedSurface> PrepareSurface(std::span<const double> points, const SurfaceFeatures& features,
                                               int threads, const RunContext& context);

// Peak memory of PrepareSurface beside its arguments; `welds`: a length for welding is given. Unit: bytes.
uint64_t PrepareSurfaceBytes(uint64_t points, uint64_t triangles, bool welds);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_PREPARED_SURFACE_H_
