// Points that are added to a domain of the plane: on which segment, or in which face, they lie.
#ifndef WELLSPACE_CORE_MESHERS_POINT_PLACER_H_
#define WELLSPACE_CORE_MESHERS_POINT_PLACER_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/ids.h"
#include "core/base/run_context.h"
#include "core/geometry/periodic_box.h"
#include "core/geometry/point.h"
#include "core/input/frame.h"
#include "core/input/refused_points.h"
#include "core/refine/plane/planar_domain.h"
#include "core/refine/plane/plane_place.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// Finds the places of points in a domain. A point is on a segment if it is no farther away than a quarter of the least
// separation: vertices of a refined segment are rounded, so that hardly any point is on one exactly. It keeps its
// coordinates, and vertices on a segment keep their order. On a periodic side it has to be exactly.
//
// Thread safety: thread-compatible.
class PointPlacer {
 public:
  // REQUIRES:   all references outlive this; the box of cells of `structure` is that of the domain.
  PointPlacer(const Frame<2>& frame, const QueryStructure<2>& structure, PlanarDomain& planar, double merge_distance)
      : frame_(frame),
        structure_(structure),
        planar_(planar),
        own_(std::max(frame.MinSeparation(), merge_distance * frame.scale)) {}

  // The place of each of `points`, n x 2; start(i) is a vertex near the i-th, or kNoVertex. Points that are vertices,
  // nearer to one than the least separation or the merge distance, or not finite have none: that is for the caller to
  // see.
  //
  // Complexity: O(1) each in a refined mesh and near its start.
  // Errors:     INVALID_ARGUMENT, naming the points: not in the domain that is meshed, or nearer to a segment than the
  //             least separation and not on it; CANCELLED, DEADLINE_EXCEEDED.
  absl::StatusOr<std::vector<PlanePlace>> FindAll(std::span<const double> points,
                                                  const std::function<VertexId(size_t)>& start,
                                                  const RunContext& context);

  // Where the images of points on periodic sides are.
  const PeriodicBox<2>& images() const { return planar_.sides().box(); }
  // The place of the image of a point that is on such a side.
  PlanePlace ImageOf(const PlanePlace& place) const { return {.on = planar_.ImageOf(place.on)}; }

  // Tells the domain that the next vertex has been added there.
  void Add(const PlanePlace& place) { planar_.AddVertex(place.on, place.face); }

 private:
  // A segment beside a point, by its foot there.
  struct Beside {
    uint32_t segment = SegmentPoint::kNone;
    double away = 0;  // above 0 on the left

    bool IsThere() const { return segment != SegmentPoint::kNone; }
  };

  // Points without a place.
  struct Refused {
    RefusedPoints not_meshed;
    RefusedPoints too_close;
  };

  PlanePlace Find(const Point<2>& p, uint32_t index, const Neighbor& nearest, Refused& refused);
  absl::Status TooCloseError(const Point<2>& p, size_t index, const Beside& beside) const;
  std::string NameOf(uint32_t segment) const;
  static absl::Status NotMeshedError(const Point<2>& p, size_t index);

  const Frame<2>& frame_;
  const QueryStructure<2>& structure_;
  PlanarDomain& planar_;
  const double own_;  // a point nearer than this to a vertex, scaled, is none of its own
  Workspace<2> workspace_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_POINT_PLACER_H_
