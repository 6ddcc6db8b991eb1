#include "core/input/domain_cloud.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/features/periodic_sides.h"
#include "core/features/planar_faces.h"
#include "core/features/planar_graph.h"
#include "core/input/near_points.h"

namespace wellspace::core {
namespace {

// The box of the tree is wider on every side than that of the points by so many of their longest side: no face of it is
// as near to a cell in the domain as a segment.
constexpr double kRoom = 0.5;

// Bytes of a graph, its copy of the meshed part, its faces, the sweep that finds them, and the sorted points.
constexpr uint64_t kPointBytes = 120;
constexpr uint64_t kSegmentBytes = 215;
constexpr uint64_t kSeedBytes = 16;

// The numbers that the points which are meshed have in the graph, and their coordinates.
struct MeshedPoints {
  std::vector<double> coordinates;
  std::vector<uint32_t> names;
  uint64_t dropped = 0;  // given points that are not among them
};

absl::StatusOr<MeshedPoints> TakeMeshedPoints(const PlanarGraph& graph, const PlanarFaces& faces,
                                              const RunContext& context) {
  const std::vector<bool> is_meshed = FindMeshedPoints(graph, faces);
  const auto count = static_cast<size_t>(std::count(is_meshed.begin(), is_meshed.end(), true));
  MeshedPoints taken;
  taken.coordinates.reserve(2 * count);
  taken.names.reserve(count);
  for (size_t p = 0; p < graph.points.size(); ++p) {
    if (p % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    if (is_meshed[p]) {
      taken.coordinates.insert(taken.coordinates.end(), graph.points[p].begin(), graph.points[p].end());
      taken.names.push_back(graph.input_of_point[p]);
    }
  }
  for (const uint32_t point : graph.point_of_input) {
    taken.dropped += is_meshed[point] ? 0 : 1;
  }
  return taken;
}

absl::StatusOr<PointMerge> MergePoints(const Frame<2>& frame, std::span<const double> points, double distance,
                                       const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(MergedPoints merged, MergeNear<2>(frame, points, distance, context));
  for (uint32_t& place : merged.place_of) {
    place = merged.inputs[place];
  }
  return PointMergeOf(points, merged.place_of, context);
}

// Refuses points that have stayed, and that the box cannot have: others may have lain outside of it.
absl::Status CheckMerged(const Box<2>& box, std::span<const double> points, const PointMerge& merge,
                         const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(const Frame<2> frame, Frame<2>::Of(box));
  for (size_t k = 0; k < merge.inputs.size(); ++k) {
    if (k % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Point<2> p = PointAt<2>(points, merge.inputs[k]);
    if (!IsRepresentable<2>(frame.box, p, frame.Scaled(p), 1 / frame.scale)) {
      return PointError<2>(frame, p, merge.inputs[k]);
    }
  }
  return absl::OkStatus();
}

}  // namespace

uint64_t DomainCloudBytes(uint64_t points, uint64_t segments, uint64_t seeds) {
  return points * kPointBytes + segments * kSegmentBytes + seeds * kSeedBytes;
}

absl::StatusOr<DomainCloud> MakeDomainCloud(std::span<const double> points, const Features& features, const Box<2>& box,
                                            double merge_distance, uint64_t max_vertices, int threads,
                                            const RunContext& context, std::span<const int> periodic_axes) {
  const bool is_in_box = features.faces == FaceRule::kBox;
  if (is_in_box && merge_distance == 0) {
    WELLSPACE_ASSIGN_OR_RETURN(const Frame<2> given, Frame<2>::Of(box));
    WELLSPACE_RETURN_IF_ERROR(CheckPoints<2>(given, points, context));
  }
  Box<2> around = box;
  if (!is_in_box) {
    WELLSPACE_ASSIGN_OR_RETURN(around, BoxAround<2>(points, 0, context));
  }
  const double room = kRoom * around.LongestSide();
  for (int axis = 0; axis < 2; ++axis) {
    around.low[axis] -= room;
    around.high[axis] += room;
  }
  WELLSPACE_ASSIGN_OR_RETURN(const Frame<2> frame, Frame<2>::Of(around));
  WELLSPACE_RETURN_IF_ERROR(CheckPoints<2>(frame, points, context));
  const double least_separation = frame.MinSeparation() / frame.scale;
  std::optional<PointMerge> merge;
  if (merge_distance > 0) {
    WELLSPACE_ASSIGN_OR_RETURN(merge, MergePoints(frame, points, std::max(merge_distance, least_separation), context));
    if (is_in_box) {
      WELLSPACE_RETURN_IF_ERROR(CheckMerged(box, points, *merge, context));
    }
  }
  WELLSPACE_ASSIGN_OR_RETURN(
      PlanarGraph graph, MakePlanarGraph(points, features, is_in_box ? &box : nullptr, least_separation, max_vertices,
                                         threads, context, std::move(merge)));
  // Crossings may have made many more of them.
  WELLSPACE_RETURN_IF_ERROR(
      context.AllowMemory(DomainCloudBytes(graph.points.size(), graph.segments.size(), features.seeds.size())));
  WELLSPACE_ASSIGN_OR_RETURN(PlanarFaces faces, FindFaces(graph, features.faces, features.seeds, context));
  WELLSPACE_ASSIGN_OR_RETURN(MeshedPoints meshed, TakeMeshedPoints(graph, faces, context));
  WELLSPACE_ASSIGN_OR_RETURN(SortedCloud<2> cloud,
                             SortCloud<2>(frame, meshed.coordinates, threads, context, meshed.names));
  meshed.coordinates = {};  // the cloud has them
  meshed.names = {};
  const HugeVector<uint32_t> sorted_of = cloud.SortedOfInputs();
  WELLSPACE_RETURN_IF_ERROR(KeepMeshed(sorted_of, graph, faces, context));
  WELLSPACE_ASSIGN_OR_RETURN(PeriodicSides sides, PeriodicSides::Find(graph, periodic_axes, context));
  for (Point<2>& p : graph.points) {
    p = frame.Scaled(p);
  }
  for (Face& face : faces.faces) {
    face.max_area *= frame.scale * frame.scale;
  }
  return DomainCloud{frame, std::move(cloud),
                     std::make_unique<PlanarDomain>(std::move(graph), std::move(faces), std::move(sides)),
                     meshed.dropped};
}

}  // namespace wellspace::core
