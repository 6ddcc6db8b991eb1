// The angles that are kept between repairs: after every change they are those that a measure of all would give, and few
// are measured for it.
#include "core/sliver/known_cosines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/meshers/mesher.h"
#include "core/sliver/tetrahedron.h"
#include "tests/support/clouds.h"

namespace wellspace::core {
namespace {

class KnownCosinesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    MeshParameters parameters;
    parameters.domain_low = test::UnitLow(3);
    parameters.domain_high = test::UnitHigh(3);
    parameters.min_dihedral = 0;
    const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, test::MakeCloud("uniform", 3, 300), context_);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    HugeVector<Point<3>> points;
    for (uint64_t v = 0; v < mesh->vertex_count(); ++v) {
      points.push_back(PointAt<3>(mesh->points, v));
    }
    const Box<3> box{{0, 0, 0}, {1, 1, 1}};
    ASSERT_TRUE(triangulation_.Build(box, points, mesh->simplices, 1, context_).ok());
    all_ = mesh->simplex_count();
  }

  // The slivers of a run, which is not ended; sets measured_.
  std::vector<SimplexId> Begin(KnownCosines& cosines, double degrees) {
    measured_ = 0;
    absl::StatusOr<std::vector<SimplexId>> slivers =
        cosines.BeginRun(triangulation_, BoxCarrier(), FlatCosine(degrees), 1, context_, measured_);
    EXPECT_TRUE(slivers.ok()) << slivers.status();
    return slivers.ok() ? *std::move(slivers) : std::vector<SimplexId>();
  }

  std::vector<SimplexId> SliversOfAll(double degrees) {
    KnownCosines fresh;
    const uint64_t measured = measured_;
    std::vector<SimplexId> slivers = Begin(fresh, degrees);
    measured_ = measured;
    return slivers;
  }

  // Adds `count` vertices, each told of. Returns how many simplices came.
  size_t AddVertices(size_t count) {
    const std::vector<double> places = test::MakeCloud("inner", 3, count);
    size_t came = 0;
    for (size_t i = 0; i < count; ++i) {
      const Point<3> p = PointAt<3>(places, i);
      Cavity cavity;
      std::vector<SimplexId> created;
      triangulation_.FindCavity(triangulation_.Locate(p, VertexId{0}), p, cavity);
      triangulation_.Insert(triangulation_.AddVertex(), p, 0, cavity, created);
      cosines_.NoteCreated(created);
      came += created.size();
    }
    return came;
  }

  RunContext context_;
  Triangulation<3> triangulation_;
  KnownCosines cosines_;
  size_t all_ = 0;
  uint64_t measured_ = 0;
};

TEST_F(KnownCosinesTest, ANextRunMeasuresThoseThatCame) {
  std::vector<SimplexId> slivers = Begin(cosines_, 12);
  EXPECT_EQ(slivers, SliversOfAll(12));
  EXPECT_FALSE(slivers.empty());
  EXPECT_EQ(measured_, all_);
  cosines_.EndRun(slivers);
  const size_t came = AddVertices(3);
  const std::vector<SimplexId> next = Begin(cosines_, 12);
  EXPECT_EQ(next, SliversOfAll(12));
  EXPECT_NE(next, slivers) << "so that the test would see it";
  EXPECT_LE(measured_, came + slivers.size());
  EXPECT_GT(measured_, 0u);
  cosines_.EndRun(next);
  EXPECT_EQ(Begin(cosines_, 12), next);
  EXPECT_LE(measured_, next.size()) << "nothing has come";
}

TEST_F(KnownCosinesTest, AnotherBoundIsHeldAgainstThoseThatAreKnown) {
  cosines_.EndRun(Begin(cosines_, 5));
  const size_t came = AddVertices(2);
  const std::vector<SimplexId> more = Begin(cosines_, 15);
  EXPECT_EQ(more, SliversOfAll(15));
  EXPECT_LT(measured_, came + more.size());
  EXPECT_LT(measured_, all_ / 4);
  cosines_.EndRun(more);
  const std::vector<SimplexId> fewer = Begin(cosines_, 5);
  EXPECT_EQ(fewer, SliversOfAll(5));
  EXPECT_LT(fewer.size(), more.size());
}

// A run that was cancelled has moved vertices without a notice.
TEST_F(KnownCosinesTest, AfterARunThatWasNotEndedAllAreMeasured) {
  cosines_.EndRun(Begin(cosines_, 12));
  Begin(cosines_, 12);
  AddVertices(1);
  EXPECT_EQ(Begin(cosines_, 12), SliversOfAll(12));
  EXPECT_GE(measured_, all_);
}

TEST_F(KnownCosinesTest, EndsWhenItIsCancelled) {
  context_.Cancel();
  uint64_t measured = 0;
  EXPECT_EQ(cosines_.BeginRun(triangulation_, BoxCarrier(), FlatCosine(12), 1, context_, measured).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
