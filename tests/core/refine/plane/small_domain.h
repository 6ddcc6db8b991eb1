// Small domains in the plane, made by hand, whose vertices are found by where they are.
#ifndef WELLSPACE_TESTS_CORE_REFINE_PLANE_SMALL_DOMAIN_H_
#define WELLSPACE_TESTS_CORE_REFINE_PLANE_SMALL_DOMAIN_H_

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/run_context.h"
#include "core/features/features.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/input/domain_cloud.h"
#include "core/refine/plane/planar_domain.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::test {

// The structure and the domain that Refinement works on, before the first insertion.
struct SmallDomain {
  // `ends` are pairs of numbers of points. With FaceRule::kBox the sides of `box` are segments, too.
  SmallDomain(const std::vector<core::Point<2>>& points, std::vector<uint32_t> ends, core::FaceRule faces,
              const core::Box<2>& box = {{-8, -8}, {8, 8}}) {
    std::vector<double> coordinates;
    for (const core::Point<2>& p : points) {
      coordinates.insert(coordinates.end(), p.begin(), p.end());
    }
    core::Features features;
    features.ends = std::move(ends);
    features.faces = faces;
    const core::RunContext context;
    absl::StatusOr<core::DomainCloud> made =
        core::MakeDomainCloud(coordinates, features, box, 0, 1'000'000, 1, context);
    EXPECT_TRUE(made.ok()) << made.status();
    EXPECT_EQ(made->frame.scale, 1);
    planar = std::move(made->planar);
    EXPECT_TRUE(
        structure.Initialize(made->cloud.grid, std::move(made->cloud.points), 100'000, 1, context, planar->Ends())
            .ok());
  }

  // The vertex at `p`.
  core::VertexId At(const core::Point<2>& p) const {
    for (uint32_t i = 0; i < planar->vertex_count(); ++i) {
      if (structure.point(core::VertexId{i}) == p) {
        return core::VertexId{i};
      }
    }
    ADD_FAILURE() << "no vertex at " << p[0] << ", " << p[1];
    return core::kNoVertex;
  }

  // The segment between two points, and whether the first of them is its end b.
  struct Found {
    uint32_t segment = core::SegmentPoint::kNone;
    bool is_from_b = false;
  };
  Found Between(const core::Point<2>& p, const core::Point<2>& q) const {
    for (uint32_t s = 0; s < planar->segment_count(); ++s) {
      for (const bool is_b : {false, true}) {
        if (planar->EndOf(s, is_b) == p && planar->EndOf(s, !is_b) == q) {
          return {s, is_b};
        }
      }
    }
    ADD_FAILURE() << "no such segment";
    return {};
  }

  // Adds a vertex on the segment from `p` to `q`, at a distance from p.
  core::VertexId Split(const core::Point<2>& p, const core::Point<2>& q, double distance) {
    const auto [segment, is_from_b] = Between(p, q);
    const core::SegmentPoint place{segment, is_from_b, distance};
    planar->AddVertex(place, 0);
    return structure.AddVertex(At(p), planar->PositionOf(place));
  }

  core::QueryStructure<2> structure;
  std::unique_ptr<core::PlanarDomain> planar;
};

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_CORE_REFINE_PLANE_SMALL_DOMAIN_H_
