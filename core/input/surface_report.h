// The report on a surface: its figures, and all faults that keep it from bounding a domain.
#ifndef WELLSPACE_CORE_INPUT_SURFACE_REPORT_H_
#define WELLSPACE_CORE_INPUT_SURFACE_REPORT_H_

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/surface_features.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// A place where something is wrong.
struct FaultPlace {
  Point<3> at{};
  double size = 0;                       // the length of a loop; the distance of a point that is too near; else 0
  std::vector<uint32_t> triangles = {};  // given ones that are concerned, a few

  bool operator==(const FaultPlace&) const = default;
};

// All faults of one kind.
struct SurfaceFault {
  enum class Kind : uint8_t {
    kMarkersDiffer,      // of triangles over the same corners
    kSelfIntersections,  // triangles that meet where they share nothing
    kNearPoints,         // corners too near to triangles
    kOddEdges,           // of three, five, … triangles, so that inside and outside cannot be told apart
    kOpenEdges,          // of one triangle
  };
  Kind kind = Kind::kOpenEdges;
  uint64_t count = 0;
  bool has_more = false;                // there may be more: the search has stopped
  uint64_t loops = 0;                   // of kOpenEdges
  std::vector<FaultPlace> places = {};  // the first of them, of kOpenEdges the longest loops; at most kNamedFaults
  std::string accepted;                 // a sentence: what would be accepted

  bool operator==(const SurfaceFault&) const = default;
};

inline constexpr size_t kNamedFaults = 10;

// "open_edges" and so on, for figures; "open edges" for text.
const char* NameOf(SurfaceFault::Kind kind);
std::string WordsOf(SurfaceFault::Kind kind);

// The error for a fault, where the surface is to bound a domain.
//
// Errors:     INVALID_ARGUMENT always: how many there are, the first place, what would be accepted.
absl::Status ErrorOf(const SurfaceFault& fault);

// With SolidRule::kWinding `components` and all below it are those of the wrap. With SolidRule::kBox `box`, `points`,
// `triangles`, `components` and all below it are those of the parts in the box and of its sides.
struct SurfaceReport {
  Box<3> box{};                    // of the triangles' corners
  uint64_t points = 0;             // that triangles have for corners, once they are clean
  uint64_t triangles = 0;          // once they are clean
  uint64_t loose_points = 0;       // given ones that no triangle has
  uint64_t equal_points = 0;       // given ones beyond the first at each place
  uint64_t welded_points = 0;      // that became another, which was near
  uint64_t flat_triangles = 0;     // dropped: without an area
  uint64_t equal_triangles = 0;    // dropped: beyond the first over the same corners
  uint64_t flipped_triangles = 0;  // that go against most of the others around them
  uint64_t moved_points = 0;       // onto sides of a box, by welding
  uint64_t cut_triangles = 0;      // at the sides of a box
  uint64_t outside_triangles = 0;  // dropped: without a part in the box
  double lost_area = 0;            // of solids by winding: of triangles around nothing that is meshed
  // The first of each of these three kinds, by its lowest corner; without triangles, if there is none.
  FaultPlace flat_at;
  FaultPlace equal_at;
  FaultPlace flipped_at;
  uint64_t one_sided = 0;      // parts of which no turning of triangles makes them go one way
  bool is_inside_out = false;  // most outer triangles are seen clockwise from outside
  uint64_t components = 0;
  double area = 0;
  std::optional<double> volume;  // of the meshed solids; none where faults leave it open
  std::vector<double> solids;    // the volumes of all bounded solids; empty where faults leave them open
  uint64_t membranes = 0;        // triangles with one solid on both sides; 0 where faults leave that open
  uint64_t patches = 0;
  uint64_t curves = 0;
  uint64_t corners = 0;
  std::optional<double> sharpest_angle_deg;  // between triangles at an edge; none where no edge has two
  Point<3> sharpest_at{};                    // the middle of that edge
  std::vector<SurfaceFault> faults;

  bool operator==(const SurfaceReport&) const = default;
};

// Prepares the surface that `features` are over `points`, n x 3, as a mesher would, and tells all that is wrong.
//
// Units:      lengths are those of the points.
// Guarantees: (1) neither threads, nor the order of triangles and points, change a bit of the result but for the
//             triangles that a place names.
// Complexity: O((n + m) log (n + m)), and the size of the report.
// Errors:     INVALID_ARGUMENT: points that doubles cannot serve, naming them; a corner that is no point; a surface
//             without any area; an angle or a length that is not in range; CANCELLED, DEADLINE_EXCEEDED; those of the
//             context's memory, which is asked for before the work.
// Threads:    uses `threads`, at most as many as the machine has cores.
absl::StatusOr<SurfaceReport> InspectSurface(std::span<const double> points, const SurfaceFeatures& features,
                                             int threads, const RunContext& context);

// Peak memory of InspectSurface beside its arguments; `welds`: a length for welding is given. Unit: bytes.
uint64_t InspectSurfaceBytes(uint64_t points, uint64_t triangles, bool welds);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_SURFACE_REPORT_H_
