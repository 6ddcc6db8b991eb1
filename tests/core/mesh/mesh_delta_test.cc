// Differences of meshes: one that is applied gives the mesh that was asked for, to the bit, whatever the two are.
#include "core/mesh/mesh_delta.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/meshers/mesher.h"
#include "tests/support/clouds.h"
#include "tests/support/parameters.h"
#include "tests/support/same_mesh.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

constexpr uint64_t kMuch = uint64_t{1} << 40;  // bytes

void ExpectSame(const Mesh& a, const Mesh& b) {
  test::ExpectSameMesh(a, b);
  EXPECT_EQ(a.statistics.vertices, b.statistics.vertices);
}

MeshDelta Diff(const Mesh& base, const Mesh& next) {
  absl::StatusOr<MeshDelta> delta = DiffMeshes(base, next, kMuch, RunContext());
  EXPECT_TRUE(delta.ok()) << delta.status();
  return delta.ok() ? *std::move(delta) : MeshDelta();
}

void ExpectApplied(const Mesh& base, const Mesh& next) {
  const absl::StatusOr<Mesh> applied = ApplyDelta(base, Diff(base, next));
  ASSERT_TRUE(applied.ok()) << applied.status();
  ExpectSame(*applied, next);
}

// Meshes that no geometry would allow: the arrays are as long as they would be.
class MeshDeltaTest : public test::SeededTest, public ::testing::WithParamInterface<int> {
 protected:
  MeshDeltaTest() : SeededTest(77) {}

  uint64_t Below(uint64_t end) { return random_.Next() % end; }

  template <typename T>
  void Append(HugeVector<T>& values, size_t count, uint64_t end) {
    for (size_t i = 0; i < count; ++i) {
      values.push_back(static_cast<T>(Below(end)));
    }
  }

  Mesh RandomMesh(size_t vertices, size_t simplices, bool with_all) {
    const size_t d = GetParam();
    Mesh mesh;
    mesh.dimension = GetParam();
    mesh.domain_low.assign(d, 0);
    mesh.domain_high.assign(d, 1 + static_cast<double>(Below(3)));
    Append(mesh.points, vertices * d, 1000);
    Append(mesh.simplices, simplices * (d + 1), std::max<size_t>(1, vertices));
    Append(mesh.input_vertex, vertices / 2, std::max<size_t>(1, vertices));
    mesh.statistics.vertices = vertices;
    if (with_all) {
      Append(mesh.weights, vertices, 5);
      Append(mesh.vertex_origins, vertices, 5);
      Append(mesh.vertex_tags, vertices, 3);
      Append(mesh.simplex_regions, simplices, 3);
      Append(mesh.facets, simplices / 3 * d, std::max<size_t>(1, vertices));
      mesh.boundary = {{.tag = 1, .name = "one", .facets = simplices / 3}};
      mesh.regions = {{.id = 1, .name = "domain"}};
    }
    return mesh;
  }

  // Drops, inserts, changes and exchanges some rows of `width` numbers.
  template <typename T>
  void Edit(HugeVector<T>& values, size_t width, uint64_t end) {
    for (uint64_t edits = Below(6); edits > 0 && !values.empty(); --edits) {
      const size_t row = Below(values.size() / width) * width;
      const size_t other = Below(values.size() / width) * width;
      switch (Below(3)) {
        case 0:
          values.erase(values.begin() + row, values.begin() + row + width);
          break;
        case 1:
          values[row + Below(width)] = static_cast<T>(Below(end));
          break;
        default:
          std::swap_ranges(values.begin() + row, values.begin() + row + width, values.begin() + other);
      }
    }
  }

  Mesh Edited(Mesh mesh) {
    const size_t d = GetParam();
    Edit(mesh.simplices, d + 1, mesh.vertex_count());
    Edit(mesh.facets, d, mesh.vertex_count());
    const size_t added = Below(4);
    Append(mesh.points, added * d, 1000);
    Append(mesh.simplices, Below(5) * (d + 1), mesh.vertex_count());
    Append(mesh.input_vertex, Below(3), mesh.vertex_count());
    if (!mesh.weights.empty()) {
      Append(mesh.weights, added, 5);
      Append(mesh.vertex_origins, added, 5);
      Append(mesh.vertex_tags, added, 3);
      mesh.simplex_regions.resize(mesh.simplex_count(), 7);
    }
    if (!mesh.points.empty() && Below(2) == 0) {
      mesh.points[Below(mesh.points.size())] = -0.0;
      mesh.moved_vertices = {static_cast<uint32_t>(Below(mesh.vertex_count()))};
    }
    return mesh;
  }
};

INSTANTIATE_TEST_SUITE_P(Dimensions, MeshDeltaTest, ::testing::Values(2, 3, 4, 5, 6));

TEST_P(MeshDeltaTest, MakesTheMeshToTheBitWhateverWasEdited) {
  for (int round = 0; round < 300; ++round) {
    const Mesh base = RandomMesh(1 + Below(30), Below(60), Below(2) == 0);
    ExpectApplied(base, Edited(base));
  }
}

TEST_P(MeshDeltaTest, MakesTheMeshOfAnyOther) {
  for (int round = 0; round < 100; ++round) {
    ExpectApplied(RandomMesh(Below(30), Below(60), Below(2) == 0), RandomMesh(Below(30), Below(60), Below(2) == 0));
  }
}

TEST_P(MeshDeltaTest, OfTheSameMeshHasNoRows) {
  const Mesh mesh = RandomMesh(40, 70, true);
  const MeshDelta delta = Diff(mesh, mesh);
  EXPECT_TRUE(delta.points.values.empty());
  EXPECT_TRUE(delta.vertex_tags.values.empty());
  EXPECT_TRUE(delta.simplex_regions.values.empty());
  EXPECT_TRUE(delta.kept_simplices.added.empty());
  EXPECT_EQ(delta.kept_simplices.runs, (HugeVector<RowRun>{{.begin = 0, .kept = 70, .added = 0}}));
  ExpectApplied(mesh, mesh);
}

TEST_P(MeshDeltaTest, IsNotMadeIfItTakesMoreThanItMay) {
  const Mesh base = RandomMesh(30, 60, true);
  const Mesh next = RandomMesh(30, 60, true);
  const uint64_t bytes = Diff(base, next).memory_bytes();
  EXPECT_TRUE(DiffMeshes(base, next, bytes, RunContext()).ok());
  EXPECT_EQ(DiffMeshes(base, next, bytes - 1, RunContext()).status().code(), absl::StatusCode::kResourceExhausted);
}

TEST_P(MeshDeltaTest, IsNotMadeOnceItIsCancelled) {
  RunContext context;
  context.Cancel();
  const Mesh mesh = RandomMesh(30, 60, true);
  EXPECT_EQ(DiffMeshes(mesh, mesh, kMuch, context).status().code(), absl::StatusCode::kCancelled);
}

TEST_P(MeshDeltaTest, ZerosHaveSigns) {
  Mesh base = RandomMesh(3, 1, false);
  base.points[0] = 0.0;
  Mesh next = base;
  next.points[0] = -0.0;
  EXPECT_EQ(Diff(base, next).points.changed.size(), 1);
  ExpectApplied(base, next);
}

TEST_P(MeshDeltaTest, IsRefusedByAnotherMesh) {
  const Mesh base = RandomMesh(20, 40, true);
  const MeshDelta delta = Diff(base, Edited(base));
  Mesh larger = base;
  Append(larger.simplices, GetParam() + 1, 20);
  EXPECT_EQ(ApplyDelta(larger, delta).status().code(), absl::StatusCode::kInvalidArgument);
  Mesh as_large = base;
  as_large.points.back() += 1;
  EXPECT_EQ(ApplyDelta(as_large, Diff(base, base)).status().code(), absl::StatusCode::kInvalidArgument);
  Mesh without_boundary = base;
  without_boundary.facets.clear();
  EXPECT_EQ(ApplyDelta(without_boundary, Diff(base, base)).status().code(), absl::StatusCode::kInvalidArgument);
  Mesh other_dimension = base;
  other_dimension.dimension = GetParam() == 2 ? 3 : 2;
  EXPECT_EQ(ApplyDelta(other_dimension, delta).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(DiffMeshes(base, other_dimension, kMuch, RunContext()).status().code(), absl::StatusCode::kInvalidArgument);
}

// The difference may be right in all that it says, and of another mesh all the same: that shows only by a number of all
// arrays.
TEST_P(MeshDeltaTest, IsRefusedByAMeshOfWhichOneNumberOfOneArrayIsAnother) {
  const Mesh base = RandomMesh(20, 40, true);
  const MeshDelta delta = Diff(base, base);
  ASSERT_TRUE(ApplyDelta(base, delta).ok());
  const auto expect_refused = [&](const char* array, const auto& change) {
    Mesh other = base;
    change(other);
    EXPECT_EQ(ApplyDelta(other, delta).status().code(), absl::StatusCode::kInvalidArgument) << array;
  };
  const auto expect_each_refused = [&](const char* array, auto Mesh::*values) {
    ASSERT_FALSE((base.*values).empty()) << array;
    for (const size_t place : {size_t{0}, (base.*values).size() / 2, (base.*values).size() - 1}) {
      expect_refused(array, [&](Mesh& other) { (other.*values)[place] += 1; });
    }
  };
  expect_each_refused("points", &Mesh::points);
  expect_each_refused("weights", &Mesh::weights);
  expect_each_refused("simplices", &Mesh::simplices);
  expect_each_refused("input_vertex", &Mesh::input_vertex);
  expect_each_refused("vertex_origins", &Mesh::vertex_origins);
  expect_each_refused("vertex_tags", &Mesh::vertex_tags);
  expect_each_refused("simplex_regions", &Mesh::simplex_regions);
  expect_each_refused("facets", &Mesh::facets);
  MeshDelta moved = delta;  // they are whole in the difference
  moved.moved_vertices.push_back(3);
  EXPECT_EQ(ApplyDelta(base, moved).status().code(), absl::StatusCode::kInvalidArgument) << "moved_vertices";
}

TEST_P(MeshDeltaTest, IsRefusedIfItContradictsItself) {
  for (int round = 0; round < 2000; ++round) {
    const Mesh base = RandomMesh(1 + Below(20), 1 + Below(40), Below(2) == 0);
    MeshDelta delta = Diff(base, Edited(base));
    const uint64_t wrong = Below(2) == 0 ? Below(50) : random_.Next();
    const auto damage = [&](uint64_t& number) { return std::exchange(number, wrong) != wrong; };
    bool is_damaged = false;
    switch (Below(5)) {
      case 0:
        is_damaged = !delta.kept_simplices.runs.empty() && damage(delta.kept_simplices.runs.back().kept);
        break;
      case 1:
        is_damaged = !delta.kept_simplices.runs.empty() && damage(delta.kept_simplices.runs.front().added);
        break;
      case 2:
        is_damaged = damage(delta.points.rows);
        break;
      case 3:
        is_damaged = delta.vertex_origins.rows > 0 && damage(delta.vertex_origins.rows);
        break;
      default:
        is_damaged = true;
        delta.points.changed.push_back(static_cast<uint32_t>(wrong));
    }
    EXPECT_EQ(ApplyDelta(base, delta).ok(), !is_damaged);
  }
}

// A mesh of a cloud, then as it is after a few points more.
class UpdatedMesh {
 public:
  UpdatedMesh(int dimension, size_t points, const MeshParameters& parameters) : parameters_(parameters) {
    auto mesher = Mesher::Create(parameters, test::MakeCloud("uniform", dimension, points), context_);
    EXPECT_TRUE(mesher.ok()) << mesher.status();
    mesher_ = *std::move(mesher);
    EXPECT_TRUE(mesher_->Refine(parameters, context_).ok());
    mesh = *mesher_->Extract(1, context_);
  }

  Mesh After(const std::vector<double>& points) {
    EXPECT_TRUE(mesher_->AddPoints(points, context_).ok());
    EXPECT_TRUE(mesher_->Refine(parameters_, context_).ok());
    Mesh next = mesh;
    EXPECT_TRUE(mesher_->Update(next, 1, context_).ok());
    return next;
  }

  Mesh mesh;

 private:
  MeshParameters parameters_;
  RunContext context_;
  std::unique_ptr<Mesher> mesher_;
};

TEST(MeshDeltaOfUpdate, IsSmallInEachDimension) {
  for (const auto& [dimension, points] : {std::pair(2, 4000), {3, 600}, {4, 100}, {5, 10}, {6, 3}}) {
    UpdatedMesh updated(dimension, points, test::InUnitBox(dimension));
    const std::vector<double> added(dimension, 0.4567);
    const Mesh next = updated.After(added);
    const MeshDelta delta = Diff(updated.mesh, next);
    ExpectApplied(updated.mesh, next);
    EXPECT_GT(next.vertex_count(), updated.mesh.vertex_count());
    // New rows are about the point: in 5-D and 6-D they are a large part of so small a mesh.
    const double part =
        static_cast<double>(delta.kept_simplices.added.size()) / static_cast<double>(next.simplices.size());
    EXPECT_LT(part, dimension <= 3 ? 0.03 : 0.6) << dimension << "-D";
    std::cout << dimension << "-D: " << part << " of " << next.simplex_count() << " simplices are new, in "
              << delta.kept_simplices.runs.size() << " runs\n";
  }
}

TEST(MeshDeltaOfUpdate, WithWeightsIsTheMeshToTheBit) {
  MeshParameters parameters = test::InUnitBox(3);
  parameters.pump_weights = true;
  parameters.min_dihedral = 0;
  UpdatedMesh updated(3, 500, parameters);
  EXPECT_FALSE(updated.mesh.weights.empty());
  ExpectApplied(updated.mesh, updated.After({0.31, 0.62, 0.53}));
}

TEST(MeshDeltaOfUpdate, ScratchMemoryIsOfTheSimplices) {
  EXPECT_GE(DeltaScratchBytes(1000), 1000 * sizeof(uint32_t));
  EXPECT_LE(DeltaScratchBytes(1000), 4 * 1000 * sizeof(uint32_t) + 4096);
}

}  // namespace
}  // namespace wellspace::core
