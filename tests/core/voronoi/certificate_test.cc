// Certificates: every cell of the query structure has one.
#include "core/voronoi/certificate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "core/refine/refine.h"
#include "core/voronoi/reference_scan.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"
#include "tests/support/structures.h"

namespace wellspace::core {
namespace {

using test::ByDimension;
using test::MakeStructure;

template <typename T>
class CertificateTest : public test::SeededTest {
 protected:
  CertificateTest() : SeededTest(1995) {}
};
TYPED_TEST_SUITE(CertificateTest, test::AllDimensions);

TYPED_TEST(CertificateTest, EveryCellOfEveryKindOfCloudHasOne) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : test::SomeKinds(D)) {
    SCOPED_TRACE(std::string(kind));
    const QueryStructure<D> structure =
        MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({150, 60, 20, 4, 1})));
    Workspace<D> workspace;
    for (uint32_t i = 0; i < structure.vertex_count(); i += ByDimension<D>({1, 3, 9, 31, 43})) {
      const VertexId v{i};
      const double nearest = std::sqrt(test::NearestDistanceSq<D>(structure, v));
      for (const double radius : {0.4 * nearest, (1 + 3 * this->random_.Unit()) * nearest, 10.0}) {
        structure.ClippedVoronoi(v, radius, workspace);
        const absl::Status certified = CertifyCell<D>(structure, v, radius, workspace.cell);
        ASSERT_TRUE(certified.ok()) << certified << ", vertex " << i << " clipped at " << radius;
      }
      structure.Voronoi(v, workspace);
      const absl::Status certified = CertifyWholeCell<D>(structure, v, workspace.cell);
      ASSERT_TRUE(certified.ok()) << certified << ", vertex " << i;
    }
  }
}

TYPED_TEST(CertificateTest, CellsOfTheReferenceHaveOne) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : {"uniform", "cospherical", "grid", "skew"}) {
    const QueryStructure<D> structure =
        MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({60, 60, 20, 4, 1})));
    for (int i = 0; i < ByDimension<D>({6, 6, 3, 1}); ++i) {
      const VertexId v = VertexId(this->random_.Below(structure.vertex_count()));
      const double radius = 3 * std::sqrt(test::NearestDistanceSq<D>(structure, v));
      const absl::Status certified =
          CertifyCell<D>(structure, v, radius, ReferenceClippedVoronoi<D>(structure, v, radius).cell);
      ASSERT_TRUE(certified.ok()) << certified << ", " << kind;
    }
  }
}

TYPED_TEST(CertificateTest, CellsHaveOneInElongatedAndOffsetBoxes) {
  constexpr int D = TypeParam::kValue;
  for (const double low : {0.0, -0.3, 1e5}) {
    Box<D> box;
    for (int k = 0; k < D; ++k) {
      box.low[k] = low;
      box.high[k] = low + (k == 0 ? 30 : 0.9);
    }
    std::vector<Point<D>> points =
        test::ToPoints<D>(test::MakeCloud("boundary", D, ByDimension<D>({40, 40, 20, 4, 1})));
    for (Point<D>& p : points) {
      for (int k = 0; k < D; ++k) {
        p[k] = p[k] == 1 ? box.high[k] : box.low[k] + p[k] * (box.high[k] - box.low[k]);
      }
    }
    const QueryStructure<D> structure = MakeStructure<D>(box, test::MortonSorted<D>(box, points));
    Workspace<D> workspace;
    for (uint32_t i = 0; i < structure.vertex_count(); i += ByDimension<D>({1, 1, 4, 11, 31})) {
      structure.ClippedVoronoi(VertexId{i}, 0.7, workspace);
      const absl::Status certified = CertifyCell<D>(structure, VertexId{i}, 0.7, workspace.cell);
      ASSERT_TRUE(certified.ok()) << certified;
    }
  }
}

// Vertices mirrored about the centre planes of the box, with its corners: many bisectors are one plane, or nearly so,
// or one with a side of the clip.
TYPED_TEST(CertificateTest, CellsOfMirroredVerticesHaveOne) {
  constexpr int D = TypeParam::kValue;
  for (int round = 0; round < 3; ++round) {
    // Exactly mirrored; a few units in the last place off; off by as much as makes the bisectors independent.
    const double gap = round == 0 ? 0 : round == 1 ? 0x1p-52 : 0x1p-20;
    std::vector<Point<D>> points;
    for (int i = 0; i < ByDimension<D>({8, 6, 3, 1}); ++i) {
      Point<D> p;
      for (double& x : p) {
        x = std::round(0x1p10 * (0.1 + 0.3 * this->random_.Unit())) * 0x1p-10;
      }
      for (int image = 0; image < ByDimension<D>({4, 8, 6, 4, 2}); ++image) {
        Point<D> mirrored = p;
        for (double& x : mirrored) {
          x = this->random_.Below(2) == 0 ? x : 1 - x;
          x += gap * static_cast<double>(this->random_.Below(4));
        }
        points.push_back(mirrored);
      }
    }
    const QueryStructure<D> structure = MakeStructure<D>(test::MortonSorted<D>(test::UnitBox<D>(), points));
    Workspace<D> workspace;
    for (int i = 0; i < ByDimension<D>({60, 60, 20, 5, 1}); ++i) {
      const VertexId v = VertexId(this->random_.Below(structure.vertex_count()));
      const double to_centre = std::abs(0.5 - structure.point(v)[this->random_.Below(D)]);
      for (const double radius : {to_centre, std::nextafter(to_centre, 1), 2 * to_centre, 10.0}) {
        structure.ClippedVoronoi(v, radius, workspace);
        const absl::Status certified = CertifyCell<D>(structure, v, radius, workspace.cell);
        ASSERT_TRUE(certified.ok()) << certified << ", vertex " << Index(v) << " clipped at " << radius;
      }
      structure.Voronoi(v, workspace);
      const absl::Status certified = CertifyWholeCell<D>(structure, v, workspace.cell);
      ASSERT_TRUE(certified.ok()) << certified << ", vertex " << Index(v);
    }
  }
}

// During refinement, where cells are cut by new vertices without a scan.
TYPED_TEST(CertificateTest, CellsHaveOneAtEveryStageOfRefinement) {
  constexpr int D = TypeParam::kValue;
  // In 5-D and 6-D the beginning has to do.
  constexpr uint64_t kMaxVertices = ByDimension<D>({100'000, 100'000, 100'000, 100, 70});
  for (const std::string_view kind : {"uniform", "clusters", "grid", "cospherical", "skew"}) {
    SCOPED_TRACE(std::string(kind));
    QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({60, 20, 6, 1})));
    Workspace<D> workspace;
    RunContext context;
    uint32_t steps = 0;
    double radius = 0;
    VertexId v{};
    bool is_begun = false;
    absl::Status certified;
    const RefinementObserver<D> observer = [&](const QueryStructure<D>& at, const Insertion&) {
      if (!certified.ok()) {
        return;
      }
      const VertexId last{at.vertex_count() - 1};
      constexpr uint32_t kStride = ByDimension<D>({1, 1, 3, 8, 6});
      if (is_begun) {
        // The cell of some steps ago, cut by all vertices since.
        workspace.cell.Cut(last, at.point(last));
        if (steps % kStride == 0) {
          certified = CertifyCell<D>(at, v, radius, workspace.cell);
        }
      }
      if (steps++ % (8 * kStride) == 0 && certified.ok()) {
        v = steps % (16 * kStride) == 1 ? last : VertexId(this->random_.Below(at.vertex_count()));
        radius = 4 * std::sqrt(test::NearestDistanceSq<D>(at, v));
        at.ClippedVoronoi(v, radius, workspace);
        is_begun = true;
        certified = CertifyCell<D>(at, v, radius, workspace.cell);
      }
    };
    BoxRefinement<D> refinement(structure, 0x1p-48);
    const absl::Status refined = refinement.Run({.rho = ByDimension<D>({std::sqrt(2.0), 2.0, 2.9, 4.1, 5.8})},
                                                kMaxVertices, 2, context, observer);
    ASSERT_TRUE(refined.ok() || (D >= 5 && structure.vertex_count() == kMaxVertices)) << refined;
    ASSERT_TRUE(certified.ok()) << certified;
    EXPECT_GT(steps, ByDimension<D>({20u, 20u, 20u, 20u, 3u}));
    for (uint32_t i = 0; i < structure.vertex_count();
         i += structure.vertex_count() / ByDimension<D>({50, 50, 20, 2, 1}) + 1) {
      structure.ClippedVoronoi(VertexId{i}, 10, workspace);
      certified = CertifyCell<D>(structure, VertexId{i}, 10, workspace.cell);
      ASSERT_TRUE(certified.ok()) << certified;
    }
  }
}

}  // namespace
}  // namespace wellspace::core
