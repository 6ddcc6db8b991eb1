#include "core/domain_cloud.h"

#include <numeric>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/features/planar_faces.h"
#include "core/features/planar_graph.h"

namespace wellspace::core {
namespace {

// The box of the tree is wider on every side than that of the points by so many of their longest side: no face of it is
// as near to a cell in the domain as a segment.
constexpr double kRoom = 0.5;

}  // namespace

absl::StatusOr<DomainCloud> MakeDomainCloud(std::span<const double> points, const Features& features, const Box<2>& box,
                                            int threads, const RunContext& context) {
  const bool is_in_box = features.faces == FaceRule::kBox;
  if (is_in_box) {
    WELLSPACE_ASSIGN_OR_RETURN(const Domain<2> given, Domain<2>::Of(box));
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
  WELLSPACE_ASSIGN_OR_RETURN(const Domain<2> domain, Domain<2>::Of(around));
  WELLSPACE_RETURN_IF_ERROR(CheckPoints<2>(domain, points, context));
  WELLSPACE_ASSIGN_OR_RETURN(PlanarGraph graph,
                             MakePlanarGraph(points, features, is_in_box ? &box : nullptr,
                                             domain.MinSeparation() / domain.scale, threads, context));
  WELLSPACE_ASSIGN_OR_RETURN(PlanarFaces faces, FindFaces(graph, features.faces, features.seeds, context));

  const std::vector<bool> is_meshed = FindMeshedPoints(graph, faces);
  std::vector<double> kept;
  std::vector<uint32_t> names;
  for (size_t p = 0; p < graph.points.size(); ++p) {
    if (is_meshed[p]) {
      kept.insert(kept.end(), graph.points[p].begin(), graph.points[p].end());
      names.push_back(graph.input_of_point[p]);
    }
  }
  uint64_t dropped_points = 0;
  for (const uint32_t point : graph.point_of_input) {
    dropped_points += is_meshed[point] ? 0 : 1;
  }
  WELLSPACE_ASSIGN_OR_RETURN(SortedCloud<2> cloud, SortCloud<2>(domain, kept, threads, context, names));
  const HugeVector<uint32_t> sorted_of = cloud.SortedOfInputs();
  for (Point<2>& p : graph.points) {
    p = domain.Scaled(p);
  }
  for (Face& face : faces.faces) {
    face.max_area *= domain.scale * domain.scale;
  }
  KeepMeshed(sorted_of, graph, faces);
  return DomainCloud{domain, std::move(cloud), std::make_unique<PlanarDomain>(std::move(graph), std::move(faces)),
                     dropped_points};
}

}  // namespace wellspace::core
