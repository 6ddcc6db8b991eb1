// A cloud with segments, on its way into the query structure.
#ifndef WELLSPACE_CORE_INPUT_DOMAIN_CLOUD_H_
#define WELLSPACE_CORE_INPUT_DOMAIN_CLOUD_H_

#include <cstdint>
#include <memory>
#include <span>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/features.h"
#include "core/geometry/box.h"
#include "core/input/frame.h"
#include "core/input/sorted_cloud.h"
#include "core/refine/plane/planar_domain.h"

namespace wellspace::core {

// Points and segments in the order of the query structure, without those that touch no face which is meshed.
struct DomainCloud {
  Frame<2> frame;        // its box holds the segments with room around them, and bounds nothing
  SortedCloud<2> cloud;  // of the points of the graph
  std::unique_ptr<PlanarDomain> planar;
  uint64_t dropped_points = 0;  // given ones that touch no face which is meshed
};

// Peak memory of MakeDomainCloud for so many points, segments and seeds; and memory of building the tree over them, but
// for the tree itself; as measured. Unit: bytes.
//
// Complexity: O(1).
uint64_t DomainCloudBytes(uint64_t points, uint64_t segments, uint64_t seeds);

// Cleans points and segments, finds faces, and sorts meshed points. With FaceRule::kBox the sides of `box` bound the
// domain; with the others it is not used. With a merge distance above 0 points that near are merged first, as MergeNear
// does it, and those nearer than doubles serve in any case. Along `periodic_axes` the sides of what is meshed match.
//
// Shapes:     points: n x 2, row-major.
// Complexity: O((n + m) log (n + m)) for most inputs.
// Errors:     those of CheckPoints, MakePlanarGraph, FindFaces, SortCloud and PeriodicSides; RESOURCE_EXHAUSTED, or
//             another of the context's lender, when crossings make more of them than there is memory for.
absl::StatusOr<DomainCloud> MakeDomainCloud(std::span<const double> points, const Features& features, const Box<2>& box,
                                            double merge_distance, uint64_t max_vertices, int threads,
                                            const RunContext& context, std::span<const int> periodic_axes = {});

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_DOMAIN_CLOUD_H_
