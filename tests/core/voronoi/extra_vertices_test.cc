// Runs of vertices near a point, against all of them.
#include "core/voronoi/extra_vertices.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/geometry/point.h"
#include "core/tree/leaf_tree.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

constexpr VertexId kFirst{1000};

class ExtraVerticesTest : public test::SeededTest {
 protected:
  ExtraVerticesTest() : SeededTest(20261126) {}

  // In the unit cube.
  Point<3> Draw() { return {random_.Unit(), random_.Unit(), random_.Unit()}; }

  // Expects runs to tell of all within that distance of `p`, each once, in order, with their names.
  static void ExpectRuns(const ExtraVertices<3>& vertices, const Point<3>& p, double distance_sq) {
    std::vector<bool> is_told(vertices.size(), false);
    size_t end = 0;
    vertices.ForEachRunNear(p, distance_sq, [&](std::span<const Point<3>> run, VertexId first) {
      const size_t begin = Index(first) - Index(kFirst);
      EXPECT_GE(begin, end);
      end = begin + run.size();
      ASSERT_LE(end, vertices.size());
      EXPECT_LE(run.size(), size_t{LeafTree<3>::kLeafCapacity});
      EXPECT_EQ(run.data(), vertices.positions().data() + begin);
      for (size_t i = begin; i < end; ++i) {
        is_told[i] = true;
      }
    });
    for (size_t i = 0; i < vertices.size(); ++i) {
      EXPECT_TRUE(is_told[i] || DistanceSq<3>(vertices.positions()[i], p) > distance_sq) << "vertex " << i;
    }
  }
};

TEST_F(ExtraVerticesTest, RunsHoldAllThatAreNear) {
  for (const size_t count : {0, 1, 7, 8, 9, 63, 200}) {
    ExtraVertices<3> vertices;
    vertices.Clear(kFirst);
    for (size_t i = 0; i < count; ++i) {
      EXPECT_EQ(vertices.Append(Draw()), VertexId{static_cast<uint32_t>(Index(kFirst) + i)});
    }
    ASSERT_EQ(vertices.size(), count);
    for (const double distance_sq : {0.0, 0.01, 0.1, 10.0}) {
      ExpectRuns(vertices, Draw(), distance_sq);
    }
  }
}

TEST_F(ExtraVerticesTest, WhatIsFarIsPassedOver) {
  ExtraVertices<3> vertices;
  vertices.Clear(kFirst);
  for (int cluster = 0; cluster < 4; ++cluster) {
    for (int i = 0; i < 64; ++i) {
      Point<3> p = Draw();
      p[0] += 10 * cluster;
      vertices.Append(p);
    }
  }
  size_t told = 0;
  vertices.ForEachRunNear({20.5, 0.5, 0.5}, 1, [&](std::span<const Point<3>> run, VertexId) { told += run.size(); });
  EXPECT_EQ(told, 64u);
}

TEST_F(ExtraVerticesTest, OthersTakeThePlaceOfThoseForgotten) {
  ExtraVertices<3> vertices;
  vertices.Clear(kFirst);
  for (int i = 0; i < 100; ++i) {
    vertices.Append(Draw());
  }
  for (const size_t left : {99, 90, 17, 16, 3, 0}) {
    vertices.CutTo(left);
    EXPECT_EQ(vertices.Append({5, 5, 5}), VertexId{static_cast<uint32_t>(Index(kFirst) + left)});
    ExpectRuns(vertices, {5, 5, 5}, 0);
    ExpectRuns(vertices, Draw(), 0.1);
  }
  vertices.Clear(VertexId{7});
  EXPECT_EQ(vertices.Append(Draw()), VertexId{7});
}

}  // namespace
}  // namespace wellspace::core
