// One mesh for one input: whatever the order of the points, the number of threads, the machine.
#include <gtest/gtest.h>

#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "core/mesher.h"
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
      {"uniform_2", "uniform", 2, 2000, {}, 3765, 0x2fed97d37cd9388f},
      {"uniform_2_well_spaced", "uniform", 2, 1000, {.criterion = Criterion::kWellSpaced}, 5039, 0x9da6a5a8fc971e79},
      {"lines_2_tight", "lines", 2, 1000, {.rho = 1}, 8803, 0x221de598b19f9c12},
      {"grid_2", "grid", 2, 1000, {}, 1153, 0x4a9a692fc82fa791},
      {"cospherical_2", "cospherical", 2, 500, {}, 946, 0xb505d016a23dd44b},
      {"uniform_2_sized", "uniform", 2, 100, {.max_circumradius = 0.02}, 1743, 0x6253ddcb8115c893},
      {"uniform_3", "uniform", 3, 1000, {}, 3697, 0x0d82108fbff5ef3a},
      {"uniform_3_unmended", "uniform", 3, 1000, {.min_dihedral = 0}, 3682, 0x5d3fd40d4e7ce26d},
      {"uniform_3_well_spaced", "uniform", 3, 300, {.criterion = Criterion::kWellSpaced}, 2231, 0x5eada3a831f3139f},
      {"grid_3", "grid", 3, 1000, {}, 1333, 0x2ba5f3393ffcf8d7},
      {"rounded_3", "rounded", 3, 1000, {}, 3488, 0x23877b0d8da3e4ad},
      {"boundary_3", "boundary", 3, 300, {}, 652, 0x72f6ee2f592ede9a},
      {"skew_3", "skew", 3, 300, {}, 1574, 0xb5a6f1f7f3489a0c},
      {"uniform_4", "uniform", 4, 20, {}, 603, 0x944eebdef364296a},
      {"rounded_4_well_spaced", "rounded", 4, 10, {.criterion = Criterion::kWellSpaced}, 582, 0x879404af8dbbb49f},
      {"uniform_5", "uniform", 5, 2, {}, 299, 0xd15ff55b99a2dcd8},
      {"none_6", "none", 6, 0, {}, 64, 0x1b50318c82d97025},
      {"uniform_3_boxed",
       "uniform",
       3,
       100,
       {.size_boxes = {{{0.2, 0.2, 0.2}, {0.4, 0.4, 0.4}, 0.03}}},
       1242,
       0x13678fe7120e7235},
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
