// One mesh for one input: whatever the order of the points, the number of threads, the machine.
#include <gtest/gtest.h>

#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "core/meshers/mesher.h"
#include "tests/support/canonical.h"
#include "tests/support/clouds.h"

namespace wellspace::core {
namespace {

using test::Canonical;
using test::CanonicalMesh;
using test::MakeCloud;

struct GoldenMesh {
  std::string_view name;
  std::string_view kind;
  int dimension;
  size_t points;
  MeshParameters parameters;
  uint64_t vertices;
  uint64_t hash;
};

void PrintTo(const GoldenMesh& golden, std::ostream* out) { *out << golden.name; }

// Made by this very test. A change of the algorithm changes them, and says so in CHANGELOG.md; nothing else may.
std::vector<GoldenMesh> GoldenMeshes() {
  return {
      {"uniform_2", "uniform", 2, 2000, {}, 3384, 0x78a04f3696bd7ef7},
      {"uniform_2_well_spaced", "uniform", 2, 1000, {.criterion = Criterion::kWellSpaced}, 4997, 0x9813e20bf5dcde36},
      {"lines_2_tight", "lines", 2, 1000, {.rho = 1}, 6618, 0x8b507260fb5b2d2b},
      {"grid_2", "grid", 2, 1000, {}, 1147, 0xe79c8b92229141f5},
      {"cospherical_2", "cospherical", 2, 500, {}, 893, 0x68acc49762387a78},
      {"uniform_2_sized", "uniform", 2, 100, {.max_circumradius = 0.02}, 1719, 0x5561938b0a9105b9},
      {"uniform_3", "uniform", 3, 1000, {}, 3676, 0x2b758241cb8466d1},
      {"uniform_3_unrepaired", "uniform", 3, 1000, {.min_dihedral = 0}, 3655, 0x92639b398bd61187},
      {"uniform_3_well_spaced", "uniform", 3, 300, {.criterion = Criterion::kWellSpaced}, 2245, 0x498a2f6183bfe5ba},
      {"grid_3", "grid", 3, 1000, {}, 1306, 0x1b258c979a281c81},
      {"rounded_3", "rounded", 3, 1000, {}, 3438, 0x73f60d80f631045d},
      {"boundary_3", "boundary", 3, 300, {}, 628, 0x34633e5dbb355811},
      {"skew_3", "skew", 3, 300, {}, 1549, 0x5520d4dda9cbce19},
      {"uniform_4", "uniform", 4, 20, {}, 599, 0x0f2929cf65dcee9d},
      {"rounded_4_well_spaced", "rounded", 4, 10, {.criterion = Criterion::kWellSpaced}, 577, 0x459fc23886284415},
      {"uniform_5", "uniform", 5, 2, {}, 299, 0xd15ff55b99a2dcd8},
      {"none_6", "none", 6, 0, {}, 64, 0x1b50318c82d97025},
      {"uniform_3_boxed",
       "uniform",
       3,
       100,
       {.size_boxes = {{{0.2, 0.2, 0.2}, {0.4, 0.4, 0.4}, 0.03}}},
       1247,
       0xa879d09b247db5d2},
  };
}

class DeterminismTest : public ::testing::TestWithParam<GoldenMesh> {
 protected:
  Mesh MeshOf(const std::vector<double>& cloud, int threads) {
    MeshParameters parameters = GetParam().parameters;
    parameters.dimension = GetParam().dimension;
    parameters.domain_low = test::UnitLow(parameters.dimension);
    parameters.domain_high = test::UnitHigh(parameters.dimension);
    parameters.threads = threads;
    RunContext context;
    absl::StatusOr<Mesh> mesh = MeshPoints(parameters, cloud, context);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return mesh.ok() ? *std::move(mesh) : Mesh{};
  }
};

INSTANTIATE_TEST_SUITE_P(Golden, DeterminismTest, ::testing::ValuesIn(GoldenMeshes()),
                         [](const auto& golden) { return std::string(golden.param.name); });

TEST_P(DeterminismTest, IsTheMeshItAlwaysWas) {
  const Mesh mesh = MeshOf(MakeCloud(GetParam().kind, GetParam().dimension, GetParam().points), 1);
  EXPECT_EQ(mesh.vertex_count(), GetParam().vertices);
  EXPECT_EQ(test::Hash(Canonical(mesh)), GetParam().hash) << std::hex << "0x" << test::Hash(Canonical(mesh));
}

TEST_P(DeterminismTest, OrderOfThePointsAndThreadsDoNotMatter) {
  const std::vector<double> cloud = MakeCloud(GetParam().kind, GetParam().dimension, GetParam().points);
  if (cloud.empty()) {
    return;  // there is no order
  }
  const Mesh unshuffled = MeshOf(cloud, 1);
  const CanonicalMesh expected = Canonical(unshuffled);
  for (const uint64_t seed : {1, 2}) {
    const Mesh shuffled = MeshOf(test::Shuffled(cloud, GetParam().dimension, seed), static_cast<int>(2 * seed));
    EXPECT_TRUE(Canonical(shuffled) == expected) << "seed " << seed;
  }
  EXPECT_EQ(unshuffled.simplices, MeshOf(cloud, 4).simplices) << "not even the order of the simplices";
}

}  // namespace
}  // namespace wellspace::core
