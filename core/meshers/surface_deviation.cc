#include "core/meshers/surface_deviation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/base/status_macros.h"
#include "core/features/solids.h"
#include "core/features/surface_complex.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"
#include "core/tree/surface_index.h"

namespace wellspace::core {
namespace {

// Triangles of the surface are cut into so many parts along a side at most, so that all of them together have about
// kTriangleSamples samples, unless there are more triangles.
constexpr int kMostParts = 64;
constexpr double kTriangleSamples = 20'000;
// Samples, of about a microsecond each, between two looks at the context.
constexpr size_t kSamplesBetweenChecks = 1024;

// The point at these shares of the ways from the first corner of a triangle to the others.
Point<3> At(const Triangle& triangle, double u, double w) {
  Point<3> p;
  for (int axis = 0; axis < 3; ++axis) {
    p[axis] =
        triangle[0][axis] + u * (triangle[1][axis] - triangle[0][axis]) + w * (triangle[2][axis] - triangle[0][axis]);
  }
  return p;
}

// Calls f(p) for the middle of a triangle, and if it is to be cut into parts for the points between these.
template <typename F>
void ForEachSample(const Triangle& triangle, int parts, F f) {
  f(At(triangle, 1.0 / 3, 1.0 / 3));
  for (int i = 0; i <= parts && parts > 1; ++i) {
    for (int j = 0; i + j <= parts; ++j) {
      f(At(triangle, static_cast<double>(i) / parts, static_cast<double>(j) / parts));
    }
  }
}

// Looks at the context now and then.
class SamplesSeen {
 public:
  explicit SamplesSeen(const RunContext& context) : context_(context) {}

  // False once the run is to end.
  bool Next() {
    if (++count_ % kSamplesBetweenChecks == 0) {
      status_.Update(context_.Check());
    }
    return status_.ok();
  }
  const absl::Status& status() const { return status_; }

 private:
  const RunContext& context_;
  absl::Status status_;
  size_t count_ = 0;
};

double LongestSideOf(const Triangle& triangle) {
  return std::sqrt(std::max({DistanceSq<3>(triangle[0], triangle[1]), DistanceSq<3>(triangle[1], triangle[2]),
                             DistanceSq<3>(triangle[2], triangle[0])}));
}

bool BoundsMeshed(const SpatialDomain& domain, uint32_t t) {
  return domain.IsMeshed(domain.solids().solid_of[HalfFacetOf(t, false)]) ||
         domain.IsMeshed(domain.solids().solid_of[HalfFacetOf(t, true)]);
}

// How far samples of triangles are from each other, so that there are about kTriangleSamples.
double SpacingOn(const SpatialDomain& domain) {
  double area = 0;
  for (uint32_t t = 0; t < domain.complex().triangles.size(); ++t) {
    const Triangle triangle = domain.complex().TriangleAt(t);
    area += AreaOf(triangle);
  }
  return std::sqrt(2 * area / kTriangleSamples);
}

}  // namespace

absl::StatusOr<double> DeviationOfFacets(const SpatialDomain& domain, std::span<const double> points,
                                         std::span<const uint32_t> facets, const RunContext& context) {
  SamplesSeen seen(context);
  double most_sq = 0;
  uint32_t near = 0;
  for (size_t f = 0; f < facets.size(); f += 3) {
    const Triangle facet =
        InOrder({PointAt<3>(points, facets[f]), PointAt<3>(points, facets[f + 1]), PointAt<3>(points, facets[f + 2])});
    ForEachSample(facet, 2, [&](const Point<3>& p) {
      if (seen.Next() && !domain.index().IsWithin(p, most_sq, near)) {
        most_sq = std::max(most_sq, domain.index().Nearest(p)->distance_sq);
      }
    });
    WELLSPACE_RETURN_IF_ERROR(seen.status());
  }
  return std::sqrt(most_sq);
}

absl::StatusOr<SurfaceDeviation> DeviationOfSurface(const SpatialDomain& domain, std::span<const double> points,
                                                    std::span<const uint32_t> facets, double limit,
                                                    const MortonGrid<3>& grid, const RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(SurfaceComplexBytes(points.size() / 3, facets.size() / 3) +
                                                SurfaceIndex::Bytes(facets.size() / 3)));
  SurfaceFeatures features;
  features.corners = facets;
  WELLSPACE_ASSIGN_OR_RETURN(const SurfaceComplex complex, MakeSurfaceComplex(points, {}, features, context));
  SurfaceIndex index;
  WELLSPACE_RETURN_IF_ERROR(index.BuildForDistances(complex, grid, context));
  SurfaceDeviation deviation;
  SamplesSeen seen(context);
  uint32_t near = 0;
  const double spacing = SpacingOn(domain);
  for (uint32_t t = 0; t < domain.complex().triangles.size(); ++t) {
    if (!BoundsMeshed(domain, t)) {
      continue;
    }
    const Triangle triangle = InOrder(domain.complex().TriangleAt(t));
    const int parts =
        static_cast<int>(std::clamp(std::ceil(LongestSideOf(triangle) / spacing), 1.0, double{kMostParts}));
    FarSample farthest{.patch = domain.curves().patch_of[t]};
    ForEachSample(triangle, parts, [&](const Point<3>& p) {
      const double known = std::max(farthest.distance, std::min(limit, deviation.largest));
      if (!seen.Next() || index.IsWithin(p, known * known, near)) {
        return;
      }
      if (const double distance_sq = index.Nearest(p)->distance_sq;
          distance_sq > farthest.distance * farthest.distance) {
        farthest.at = p;
        farthest.distance = std::sqrt(distance_sq);
      }
    });
    WELLSPACE_RETURN_IF_ERROR(seen.status());
    deviation.largest = std::max(deviation.largest, farthest.distance);
    if (farthest.distance > limit) {
      deviation.far.push_back(farthest);
    }
  }
  return deviation;
}

}  // namespace wellspace::core
