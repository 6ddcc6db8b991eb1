// Vertices of a mesh that is refined again: which move, and that they can be kept where they are.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "core/meshers/mesher.h"
#include "core/validate/validate.h"
#include "tests/support/clouds.h"

namespace wellspace::core {
namespace {

class MovedVerticesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    parameters_.domain_low = test::UnitLow(3);
    parameters_.domain_high = test::UnitHigh(3);
    auto mesher = Mesher::Create(parameters_, cloud_, context_);
    ASSERT_TRUE(mesher.ok()) << mesher.status();
    mesher_ = *std::move(mesher);
    first_ = Refined();
  }

  Mesh Refined() {
    const absl::Status status = mesher_->Refine(parameters_, context_);
    EXPECT_TRUE(status.ok()) << status;
    absl::StatusOr<Mesh> mesh = mesher_->Extract(1, context_);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return mesh.ok() ? *std::move(mesh) : Mesh{};
  }

  void AddPoints() { ASSERT_TRUE(mesher_->AddPoints(test::MakeCloud("clusters", 3, 200), context_).ok()); }

  // The vertices of `before` that are elsewhere in `after`.
  static std::vector<uint32_t> Elsewhere(const Mesh& before, const Mesh& after) {
    std::vector<uint32_t> vertices;
    for (uint32_t v = 0; v < before.vertex_count(); ++v) {
      if (!std::equal(&before.points[3 * v], &before.points[3 * v] + 3, &after.points[3 * v])) {
        vertices.push_back(v);
      }
    }
    return vertices;
  }

  const std::vector<double> cloud_ = test::MakeCloud("uniform", 3, 600);
  MeshParameters parameters_;
  RunContext context_;
  std::unique_ptr<Mesher> mesher_;
  Mesh first_;
};

TEST_F(MovedVerticesTest, AreNamed) {
  EXPECT_TRUE(first_.moved_vertices.empty());
  EXPECT_GT(first_.statistics.sliver_moves, 0);
  AddPoints();
  const Mesh second = Refined();
  const std::vector<uint32_t> moved(second.moved_vertices.begin(), second.moved_vertices.end());
  EXPECT_FALSE(moved.empty());
  EXPECT_EQ(moved, Elsewhere(first_, second));
  // Of the mesh before alone.
  const Mesh third = Refined();
  EXPECT_TRUE(third.moved_vertices.empty());
  EXPECT_EQ(third.points, second.points);
}

TEST_F(MovedVerticesTest, UpdateNamesThemToo) {
  AddPoints();
  ASSERT_TRUE(mesher_->Refine(parameters_, context_).ok());
  Mesh second = first_;
  ASSERT_TRUE(mesher_->Update(second, 1, context_).ok());
  const std::vector<uint32_t> moved(second.moved_vertices.begin(), second.moved_vertices.end());
  EXPECT_FALSE(moved.empty());
  EXPECT_EQ(moved, Elsewhere(first_, second));
}

TEST_F(MovedVerticesTest, StayWhereTheyAreIfThatIsAsked) {
  AddPoints();
  parameters_.keep_vertices = true;
  const Mesh second = Refined();
  EXPECT_TRUE(second.moved_vertices.empty());
  EXPECT_TRUE(Elsewhere(first_, second).empty());
  // The demands are met all the same.
  ValidationOptions options;
  options.rho = 2;
  options.min_angle_deg = second.statistics.slivers_left == 0 ? 12 : 0;
  const absl::Status valid = ValidateMesh({3, second.points, second.simplices, second.weights}, options);
  EXPECT_TRUE(valid.ok()) << valid;
  EXPECT_LT(second.statistics.slivers_left, 20);
  // So they do at another bound, for which all the mesh is looked at.
  parameters_.min_dihedral = 15;
  const Mesh third = Refined();
  EXPECT_TRUE(Elsewhere(second, third).empty());
  EXPECT_GT(third.vertex_count(), second.vertex_count());
  // And later on they may move again.
  parameters_.keep_vertices = false;
  parameters_.min_dihedral = 17;
  EXPECT_FALSE(Refined().moved_vertices.empty());
}

}  // namespace
}  // namespace wellspace::core
