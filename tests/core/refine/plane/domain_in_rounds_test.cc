// Refinement of domains that are large enough for many rounds: several threads speculate, and the mesh does not tell.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/thread_team.h"
#include "core/input/domain_cloud.h"
#include "core/meshers/mesher.h"
#include "core/refine/plane/plane_domain.h"
#include "core/refine/refine.h"
#include "core/simplex/domain_simplices.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

constexpr uint64_t kMany = 10'000'000;

struct Input {
  std::vector<double> points;
  std::vector<uint32_t> ends;
  std::vector<FaceSeed> seeds;
  FaceRule faces = FaceRule::kBox;

  uint32_t Add(const Point<2>& p) {
    points.insert(points.end(), p.begin(), p.end());
    return static_cast<uint32_t>(points.size() / 2 - 1);
  }
  void Join(uint32_t p, uint32_t q) { ends.insert(ends.end(), {p, q}); }
  void Ring(const std::vector<Point<2>>& corners) {
    const auto first = static_cast<uint32_t>(points.size() / 2);
    const auto count = static_cast<uint32_t>(corners.size());
    for (uint32_t i = 0; i < count; ++i) {
      Add(corners[i]);
      Join(first + i, first + (i + 1) % count);
    }
  }
  Features features() const {
    Features features;
    features.ends = ends;
    features.seeds = seeds;
    features.faces = faces;
    return features;
  }
};

// One segment in each square of a grid, with room between them.
Input Strewn(int side, test::SplitMix64& random) {
  Input input;
  const auto at = [&](int i) { return (i + 0.02 + 0.96 * random.Unit()) / side; };
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      const Point<2> p = {at(i), at(j)};
      const Point<2> q = {at(i), at(j)};
      const uint32_t a = input.Add(p);
      input.Join(a, input.Add(q));
    }
  }
  return input;
}

// Rows of lines that turn at small angles: every segment has one at both ends.
Input Zigzags(int rows, int teeth, test::SplitMix64& random) {
  Input input;
  for (int row = 0; row < rows; ++row) {
    uint32_t last = 0;
    for (int i = 0; i < teeth; ++i) {
      const double height = (row + (i % 2 == 0 ? 0.1 : 0.8 + 0.1 * random.Unit())) / rows;
      const uint32_t next = input.Add({(i + 0.5 + 0.2 * random.Unit()) / teeth, height});
      if (i > 0) {
        input.Join(last, next);
      }
      last = next;
    }
  }
  return input;
}

// Squares in a square: holes, regions with an area, and some with neither.
Input Holed(int side, test::SplitMix64& random) {
  Input input;
  input.faces = FaceRule::kHoles;
  input.Ring({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      const Point<2> centre = {(i + 0.5) / side, (j + 0.5) / side};
      const double half = (0.1 + 0.3 * random.Unit()) / side;
      const double turn = random.Unit();
      std::vector<Point<2>> corners;
      for (int k = 0; k < 4; ++k) {
        corners.push_back({centre[0] + half * std::cos(turn + k * 1.5), centre[1] + half * std::sin(turn + k * 1.5)});
      }
      input.Ring(corners);
      if ((i + j) % 3 == 0) {
        input.seeds.push_back({.at = centre, .is_hole = true});
      } else if ((i + j) % 3 == 1) {
        input.seeds.push_back({.at = centre, .region = i + 1, .max_area = half * half / 20});
      }
    }
  }
  return input;
}

// A domain, refined by so many threads.
struct Refined {
  Refined(const Input& input, double rho, double size, int threads) {
    RunContext context;
    absl::StatusOr<DomainCloud> made =
        MakeDomainCloud(input.points, input.features(), {{-0.1, -0.1}, {1.1, 1.1}}, 0, 1'000'000, 1, context);
    EXPECT_TRUE(made.ok()) << made.status();
    planar = std::move(made->planar);
    EXPECT_TRUE(
        structure.Initialize(made->cloud.grid, std::move(made->cloud.points), kMany, 1, context, planar->Ends()).ok());
    refinement = std::make_unique<Refinement<PlaneDomain>>(structure, made->frame.MinEdge(), PlaneDomain(*planar));
    MeshCriteria<2> criteria{.rho = rho};
    criteria.sizes = SizeField<2>(size * made->frame.scale);
    const absl::Status status = refinement->Run(criteria, kMany, threads, context);
    EXPECT_TRUE(status.ok()) << status;
  }

  QueryStructure<2> structure;
  std::unique_ptr<PlanarDomain> planar;
  std::unique_ptr<Refinement<PlaneDomain>> refinement;
};

void ExpectSame(const Refined& actual, const Refined& expected) {
  ASSERT_EQ(actual.structure.vertex_count(), expected.structure.vertex_count());
  ASSERT_EQ(actual.planar->vertex_count(), expected.planar->vertex_count());
  for (uint32_t i = 0; i < actual.structure.vertex_count(); ++i) {
    const VertexId v{i};
    ASSERT_EQ(actual.structure.point(v), expected.structure.point(v)) << "vertex " << i;
    ASSERT_EQ(actual.planar->IsInFace(v), expected.planar->IsInFace(v)) << "vertex " << i;
    ASSERT_EQ(actual.planar->PlaceOf(v).segment, expected.planar->PlaceOf(v).segment) << "vertex " << i;
    ASSERT_EQ(actual.planar->PlaceOf(v).distance, expected.planar->PlaceOf(v).distance) << "vertex " << i;
    if (actual.planar->IsInFace(v)) {
      ASSERT_EQ(actual.planar->FaceOf(v), expected.planar->FaceOf(v)) << "vertex " << i;
    }
  }
}

struct Case {
  std::string_view name;
  Input (*make)(test::SplitMix64&);
  double rho = std::sqrt(2.0);
  double size = std::numeric_limits<double>::infinity();
  bool is_tame = true;  // few vertices ask for shorter edges, which are refined first, and spoil records
};

void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

class DomainInRoundsTest : public ::testing::TestWithParam<Case> {};

INSTANTIATE_TEST_SUITE_P(
    Domains, DomainInRoundsTest,
    ::testing::Values(
        Case{"strewn", [](test::SplitMix64& random) { return Strewn(80, random); }},
        Case{"strewn_fine", [](test::SplitMix64& random) { return Strewn(60, random); }, 1.0},
        Case{"strewn_sized", [](test::SplitMix64& random) { return Strewn(10, random); }, std::sqrt(2.0), 0.006},
        Case{"zigzags", [](test::SplitMix64& random) { return Zigzags(30, 200, random); }, 1.0,
             std::numeric_limits<double>::infinity(), false},
        Case{"zigzags_sized", [](test::SplitMix64& random) { return Zigzags(10, 60, random); }, 1.2, 0.006},
        Case{"holed", [](test::SplitMix64& random) { return Holed(30, random); }, std::sqrt(2.0), 0.008}),
    [](const auto& one) { return std::string(one.param.name); });

TEST_P(DomainInRoundsTest, ThreadsSpeculateAndTheMeshIsTheSame) {
  test::SplitMix64 random(test::Seed(71));
  const Input input = GetParam().make(random);
  const Refined alone(input, GetParam().rho, GetParam().size, 1);
  EXPECT_EQ(alone.refinement->speculation().speculated, 0);
  for (const int threads : {2, 3, 4}) {
    const Refined together(input, GetParam().rho, GetParam().size, threads);
    ExpectSame(together, alone);
    if (ThreadTeam(threads).threads() > 1) {
      const SpeculationCounts& counts = together.refinement->speculation();
      EXPECT_GT(counts.replayed, 0);
      if (GetParam().is_tame) {
        EXPECT_GT(counts.speculated, 2000) << "of " << alone.structure.vertex_count() << " vertices";
        EXPECT_GT(counts.replayed, counts.speculated * 3 / 4) << "the bulk of the records";
      }
    }
  }
}

// The triangles of a refined domain.
DomainSimplices TrianglesOf(const Refined& refined, int threads) {
  std::vector<uint32_t> output_index(refined.structure.vertex_count());
  for (uint32_t i = 0; i < output_index.size(); ++i) {
    output_index[i] = static_cast<uint32_t>(output_index.size()) - 1 - i;  // any order
  }
  RunContext context;
  absl::StatusOr<DomainSimplices> triangles = ComputeDomainSimplices(
      refined.structure, *refined.planar, refined.planar->FindChains(), refined.refinement->stars(), [] {},
      output_index, threads, context);
  EXPECT_TRUE(triangles.ok()) << triangles.status();
  EXPECT_TRUE(triangles->broken.empty());
  return *std::move(triangles);
}

void ExpectSame(const DomainSimplices& actual, const DomainSimplices& expected) {
  EXPECT_EQ(actual.simplices.indices, expected.simplices.indices);
  EXPECT_EQ(actual.faces, expected.faces);
  EXPECT_EQ(actual.simplices.max_radius_edge, expected.simplices.max_radius_edge);
  EXPECT_EQ(actual.simplices.min_angle_deg, expected.simplices.min_angle_deg);
}

TEST_P(DomainInRoundsTest, ListedTrianglesAreThoseOfCells) {
  test::SplitMix64 random(test::Seed(72));
  const Input input = GetParam().make(random);
  for (const int threads : {1, 2}) {
    const Refined refined(input, GetParam().rho, GetParam().size, threads);
    const DomainSimplices listed = TrianglesOf(refined, threads);
    EXPECT_EQ(listed.simplices.counters.leaves, 0) << "no cell is computed";
    refined.refinement->DropStars();
    const DomainSimplices computed = TrianglesOf(refined, threads);
    EXPECT_GT(computed.simplices.counters.leaves, 0);
    ExpectSame(listed, computed);
  }
}

}  // namespace
}  // namespace wellspace::core
