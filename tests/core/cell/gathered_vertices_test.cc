// Vertices gathered around sites, against all vertices.
#include "core/cell/gathered_vertices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/voronoi/query_structure.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/structures.h"

namespace wellspace::core {
namespace {

// Gathers around sites of one structure.
template <int D>
class Gathering {
 public:
  explicit Gathering(const QueryStructure<D>& structure) : structure_(structure) {}

  size_t Around(std::span<const VertexId> sites) {
    seen_.resize(structure_.tree().node_count(), 0);
    return gathered_.Gather(structure_.tree(), structure_.points(), sites, seen_, ++mark_);
  }
  const GatheredVertices<D>& gathered() const { return gathered_; }

 private:
  const QueryStructure<D>& structure_;
  GatheredVertices<D> gathered_;
  std::vector<uint32_t> seen_;
  uint32_t mark_ = 0;
};

template <int D>
QueryStructure<D> StructureOf(std::string_view kind, uint32_t count) {
  return test::MakeStructure<D>(test::SortedCloud<D>(kind, count));
}

template <int D>
std::vector<VertexId> AllOf(const QueryStructure<D>& structure) {
  std::vector<VertexId> all;
  for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
    all.push_back(VertexId{v});
  }
  return all;
}

template <typename T>
class GatheredVerticesTest : public testing::Test {};
TYPED_TEST_SUITE(GatheredVerticesTest, test::UpTo3);

TYPED_TEST(GatheredVerticesTest, AreAllThatAreNear) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : {"uniform", "clusters", "lines", "grid", "boundary"}) {
    SCOPED_TRACE(std::string(kind));
    const QueryStructure<D> structure = StructureOf<D>(kind, 2000);
    const std::vector<VertexId> all = AllOf<D>(structure);
    Gathering<D> gathering(structure);
    const GatheredVertices<D>& gathered = gathering.gathered();
    size_t surrounded = 0;
    for (std::span<const VertexId> sites = all; !sites.empty();) {
      const size_t count = gathering.Around(sites);
      ASSERT_GE(count, 1u);
      ASSERT_LE(count, sites.size());
      std::set<VertexId> names;
      for (size_t i = 0; i < gathered.count(); ++i) {
        ASSERT_TRUE(names.insert(gathered.name(i)).second) << "twice";
        ASSERT_EQ(gathered.position(i), structure.point(gathered.name(i)));
      }
      if (gathered.count() > 0) {
        for (const VertexId v : all) {
          ASSERT_EQ(names.count(v) == 1, gathered.Holds(structure.point(v)));
        }
      }
      for (const VertexId v : sites.first(count)) {
        const Point<D>& site = structure.point(v);
        ASSERT_EQ(gathered.Surrounds(site), gathered.count() > 0);
        if (!gathered.Surrounds(site)) {
          continue;
        }
        ++surrounded;
        double nearest_sq = std::numeric_limits<double>::infinity();
        for (const VertexId u : all) {
          const double distance_sq = DistanceSq<D>(structure.point(u), site);
          if (distance_sq <= gathered.ReachSq(site)) {
            ASSERT_EQ(names.count(u), 1u);
          }
          if (u != v && names.count(u) == 1) {
            nearest_sq = std::min(nearest_sq, distance_sq);
          }
        }
        for (const VectorUnit unit : {VectorUnit::kBaseline, BestVectorUnit()}) {
          ASSERT_EQ(gathered.NearestSq(v, site, unit), nearest_sq);
        }
      }
      sites = sites.subspan(count);
    }
    if (kind == "uniform") {
      EXPECT_GT(2 * surrounded, all.size());
    }
  }
}

TYPED_TEST(GatheredVerticesTest, AreNoneForFewSites) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> structure = StructureOf<D>("uniform", 500);
  Gathering<D> gathering(structure);
  const auto* inside = structure.tree().VerticesIn(structure.tree().leaf_of(VertexId{200}));
  const std::vector<VertexId> sites(7, inside->ids[0]);
  EXPECT_EQ(gathering.Around(sites), 7u);
  EXPECT_EQ(gathering.gathered().count(), 0u);
  EXPECT_FALSE(gathering.gathered().Surrounds(structure.point(sites[0])));
}

TYPED_TEST(GatheredVerticesTest, AreNoneAmidTooMany) {
  constexpr int D = TypeParam::kValue;
  // Eight far from each other, and very many in a strip as far away as leaves allow that are twice as large from one to
  // the next.
  std::vector<Point<D>> points;
  for (int i = 0; i < 8; ++i) {
    Point<D> p;
    p.fill(0.03 + 0.028 * i);
    points.push_back(p);
  }
  for (int i = 0; i < 1200; ++i) {
    Point<D> p;
    p.fill(0.1);
    p[0] = 0.4925 + 0.0012 * (i % 6);
    p[1] = 0.00125 * (i / 6 + 0.5);
    points.push_back(p);
  }
  const QueryStructure<D> structure = test::MakeStructure<D>(test::MortonSorted<D>(test::UnitBox<D>(), points));
  const std::vector<VertexId> all = AllOf<D>(structure);
  Gathering<D> gathering(structure);
  EXPECT_GE(gathering.Around(all), 8u);
  EXPECT_EQ(gathering.gathered().count(), 0u);
  EXPECT_FALSE(gathering.gathered().Surrounds(points[0]));
}

}  // namespace
}  // namespace wellspace::core
