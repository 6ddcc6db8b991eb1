// The triangulation that can be edited: after every edit it is that of its vertices, whatever the way there.
#include "core/sliver/triangulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/meshers/mesher.h"
#include "core/validate/validate.h"
#include "tests/support/clouds.h"
#include "tests/support/dimensions.h"

namespace wellspace::core {
namespace {

using test::SplitMix64;

template <int D>
using SimplexSet = std::set<std::array<uint32_t, D + 1>>;

template <int D>
class TriangulationOf {
 public:
  explicit TriangulationOf(std::string_view kind, size_t n) {
    MeshParameters parameters{.dimension = D};
    parameters.domain_low = test::UnitLow(D);
    parameters.domain_high = test::UnitHigh(D);
    parameters.min_dihedral = D == 3 ? std::optional<double>(0) : std::nullopt;
    RunContext context;
    const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, test::MakeCloud(kind, D, n), context);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    HugeVector<Point<D>> points;
    for (uint64_t v = 0; v < mesh->vertex_count(); ++v) {
      points.push_back(PointAt<D>(mesh->points, v));
    }
    Box<D> box;
    std::copy_n(mesh->domain_low.begin(), D, box.low.begin());
    std::copy_n(mesh->domain_high.begin(), D, box.high.begin());
    EXPECT_TRUE(triangulation.Build(box, points, mesh->simplices, 2, context).ok());
  }

  SimplexSet<D> Simplices() const {
    SimplexSet<D> all;
    for (uint32_t s = 0; s < triangulation.simplex_limit(); ++s) {
      if (triangulation.IsIn(SimplexId{s})) {
        std::array<uint32_t, D + 1> vertices;
        for (int i = 0; i <= D; ++i) {
          vertices[i] = Index(triangulation.item(SimplexId{s}).vertices[i]);
        }
        std::sort(vertices.begin(), vertices.end());
        EXPECT_TRUE(all.insert(vertices).second);
      }
    }
    return all;
  }

  // By the validators, and by invariant (2).
  absl::Status Check() const {
    std::vector<double> points;
    std::vector<double> weights;
    std::vector<uint32_t> simplices;
    for (uint32_t v = 0; v < triangulation.vertex_count(); ++v) {
      const Point<D>& p = triangulation.point(VertexId{v});
      points.insert(points.end(), p.begin(), p.end());
      weights.push_back(triangulation.weight(VertexId{v}));
    }
    for (uint32_t s = 0; s < triangulation.simplex_limit(); ++s) {
      if (!triangulation.IsIn(SimplexId{s})) {
        continue;
      }
      const auto& item = triangulation.item(SimplexId{s});
      for (int i = 0; i <= D; ++i) {
        simplices.push_back(Index(item.vertices[i]));
        if (item.neighbours[i] == kNoSimplex) {
          EXPECT_NE(triangulation.FacesOf(SimplexId{s}, i), 0);
          continue;
        }
        const auto& beyond = triangulation.item(item.neighbours[i]);
        const VertexId apex = beyond.vertices[beyond.SlotOf(SimplexId{s})];
        for (const VertexId u : beyond.vertices) {
          EXPECT_EQ(u == apex, std::count(item.vertices.begin(), item.vertices.end(), u) == 0);
        }
      }
    }
    return ValidateMesh({D, points, simplices, weights}, {});
  }

  // A vertex that is no corner of the box.
  VertexId Draw(SplitMix64& random) const {
    while (true) {
      const VertexId v{static_cast<uint32_t>(random.Below(triangulation.vertex_count()))};
      if (std::popcount(triangulation.faces(v)) < D) {
        return v;
      }
    }
  }

  // Puts `v`, which has just been removed, at `p`.
  void InsertInHole(VertexId v, const Point<D>& p, const std::vector<SimplexId>& hole) {
    const auto from =
        std::find_if(hole.begin(), hole.end(), [&](SimplexId s) { return triangulation.IsInConflict(s, p); });
    ASSERT_NE(from, hole.end());
    Cavity cavity;
    std::vector<SimplexId> created;
    triangulation.FindCavity(*from, p, cavity);
    triangulation.Insert(v, p, 0, cavity, created);
  }

  Triangulation<D> triangulation;
};

template <typename T>
class TriangulationTest : public ::testing::Test {
 protected:
  static constexpr int kDimension = T::kValue;
  static std::vector<std::pair<std::string_view, size_t>> Clouds() {
    if (kDimension == 3) {
      return {{"uniform", 200}, {"grid", 125}, {"boundary", 60}};
    }
    return {{"uniform", 3}, {"one", 1}};
  }
  const uint64_t seed_ = test::Seed(77);
  ::testing::ScopedTrace trace_{__FILE__, __LINE__, "seed " + std::to_string(seed_)};
  SplitMix64 random_{seed_};
};

using Dimensions = ::testing::Types<test::Dimension<3>, test::Dimension<4>>;
TYPED_TEST_SUITE(TriangulationTest, Dimensions);

TYPED_TEST(TriangulationTest, AVertexThatComesBackChangesNothing) {
  constexpr int D = TypeParam::kValue;
  for (const auto& [kind, n] : this->Clouds()) {
    SCOPED_TRACE(kind);
    TriangulationOf<D> mesh(kind, n);
    ASSERT_TRUE(mesh.Check().ok()) << mesh.Check();
    const SimplexSet<D> before = mesh.Simplices();
    std::vector<SimplexId> hole;
    for (int i = 0; i < 60; ++i) {
      const VertexId v = mesh.Draw(this->random_);
      const Point<D> p = mesh.triangulation.point(v);
      mesh.triangulation.Remove(v, hole);
      EXPECT_FALSE(mesh.triangulation.IsIn(v));
      mesh.InsertInHole(v, p, hole);
    }
    EXPECT_EQ(mesh.Simplices(), before);
    EXPECT_TRUE(mesh.Check().ok()) << mesh.Check();
  }
}

TYPED_TEST(TriangulationTest, RestoreGivesSimplicesTheirNumbersBack) {
  constexpr int D = TypeParam::kValue;
  for (const auto& [kind, n] : this->Clouds()) {
    SCOPED_TRACE(kind);
    TriangulationOf<D> mesh(kind, n);
    std::vector<std::array<VertexId, D + 1>> before;
    for (uint32_t s = 0; s < mesh.triangulation.simplex_limit(); ++s) {
      before.push_back(mesh.triangulation.item(SimplexId{s}).vertices);
    }
    std::vector<SimplexId> hole;
    for (int i = 0; i < 60; ++i) {
      mesh.triangulation.Remove(mesh.Draw(this->random_), hole);
      mesh.triangulation.Restore();
    }
    for (uint32_t s = 0; s < before.size(); ++s) {
      ASSERT_EQ(mesh.triangulation.item(SimplexId{s}).vertices, before[s]);
    }
    EXPECT_TRUE(mesh.Check().ok()) << mesh.Check();
  }
}

TYPED_TEST(TriangulationTest, MovedAndAddedVerticesAreTriangulated) {
  constexpr int D = TypeParam::kValue;
  for (const auto& [kind, n] : this->Clouds()) {
    SCOPED_TRACE(kind);
    TriangulationOf<D> mesh(kind, n);
    std::vector<SimplexId> hole;
    std::vector<SimplexId> created;
    Cavity cavity;
    for (int i = 0; i < 40; ++i) {
      const VertexId v = mesh.Draw(this->random_);
      Point<D> p = mesh.triangulation.point(v);
      for (int k = 0; k < D; ++k) {
        const bool is_free = ((mesh.triangulation.faces(v) >> (2 * k)) & 3) == 0;
        p[k] = is_free ? std::clamp(p[k] + 0.02 * (this->random_.Unit() - 0.5), 0x1p-10, 1 - 0x1p-10) : p[k];
      }
      mesh.triangulation.Remove(v, hole);
      mesh.triangulation.FindCavity(mesh.triangulation.Locate(p, mesh.triangulation.item(hole[0]).vertices[0]), p,
                                    cavity);
      mesh.triangulation.Insert(v, p, 0, cavity, created);
      // Anywhere, on a face now and then; walked to from afar.
      for (double& x : p) {
        x = this->random_.Unit();
      }
      if (i % 4 == 0) {
        p[i / 4 % D] = i % 8 == 0 ? 0 : 1;
      }
      mesh.triangulation.FindCavity(mesh.triangulation.Locate(p, v), p, cavity);
      mesh.triangulation.Insert(mesh.triangulation.AddVertex(), p, 0, cavity, created);
    }
    // No circumcentre has to be in the box any more, so not the whole of ValidateMesh.
    EXPECT_THAT(std::string(mesh.Check().message()), ::testing::AnyOf("", ::testing::HasSubstr("circumcentre")));
  }
}

TYPED_TEST(TriangulationTest, WeightsComeAndGo) {
  constexpr int D = TypeParam::kValue;
  for (const auto& [kind, n] : this->Clouds()) {
    SCOPED_TRACE(kind);
    TriangulationOf<D> mesh(kind, n);
    const SimplexSet<D> before = mesh.Simplices();
    std::vector<double> limit(mesh.triangulation.vertex_count(), 1);
    for (uint32_t v = 0; v < limit.size(); ++v) {
      for (uint32_t u = 0; u < v; ++u) {
        const double square =
            DistanceSq<D>(mesh.triangulation.point(VertexId{u}), mesh.triangulation.point(VertexId{v}));
        limit[u] = std::min(limit[u], square / 4);
        limit[v] = std::min(limit[v], square / 4);
      }
    }
    Cavity cavity;
    std::vector<SimplexId> hole;
    std::vector<SimplexId> created;
    std::vector<VertexId> weighted;
    for (int i = 0; i < 40; ++i) {
      const VertexId v = mesh.Draw(this->random_);
      if (mesh.triangulation.weight(v) != 0) {
        continue;
      }
      // The largest allowed makes for ties on a grid.
      const double weight = limit[Index(v)] * (i % 2 == 0 ? 1 : static_cast<float>(this->random_.Unit()));
      mesh.triangulation.FindCavityOfWeight(v, weight, cavity);
      mesh.triangulation.Insert(v, mesh.triangulation.point(v), weight, cavity, created);
      weighted.push_back(v);
    }
    EXPECT_TRUE(mesh.Check().ok()) << mesh.Check();
    for (const VertexId v : weighted) {
      const Point<D> p = mesh.triangulation.point(v);
      mesh.triangulation.Remove(v, hole);
      mesh.InsertInHole(v, p, hole);
    }
    EXPECT_EQ(mesh.Simplices(), before);
  }
}

}  // namespace
}  // namespace wellspace::core
