// Differences of meshes: one that is applied gives the mesh that was asked for, to the bit, whatever the two are.
#include "core/mesh/mesh_delta.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
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

MeshDelta Diff(const Mesh& base, const Mesh& next, const MovedRows* simplices = nullptr) {
  absl::StatusOr<MeshDelta> delta = DiffMeshes(base, next, simplices, kMuch, RunContext());
  EXPECT_TRUE(delta.ok()) << delta.status();
  return delta.ok() ? *std::move(delta) : MeshDelta();
}

HugeVector<uint32_t> Applied(const HugeVector<uint32_t>& base, const MovedRows& rows, size_t width) {
  HugeVector<uint32_t> next;
  size_t taken = 0;
  for (const RowRun& run : rows.runs) {
    EXPECT_LE(run.begin + run.kept, base.size() / width);
    EXPECT_LE(taken + run.added, rows.added.size() / width);
    next.insert(next.end(), base.begin() + run.begin * width, base.begin() + (run.begin + run.kept) * width);
    next.insert(next.end(), rows.added.begin() + taken * width, rows.added.begin() + (taken + run.added) * width);
    taken += run.added;
  }
  EXPECT_EQ(taken * width, rows.added.size());
  return next;
}

template <typename T>
HugeVector<T> Applied(const HugeVector<T>& base, const ChangedRows<T>& rows, size_t width) {
  HugeVector<T> next(base.begin(), base.begin() + std::min(base.size(), rows.rows * width));
  EXPECT_TRUE(std::ranges::is_sorted(rows.changed));
  for (size_t i = 0; i < rows.changed.size(); ++i) {
    std::copy_n(&rows.values[i * width], width, &next.at(rows.changed[i] * width));
  }
  next.insert(next.end(), rows.values.begin() + rows.changed.size() * width, rows.values.end());
  EXPECT_EQ(next.size(), rows.rows * width);
  return next;
}

HugeVector<int32_t> AppliedRegions(const Mesh& base, const MeshDelta& delta) {
  const ChangedRows<int32_t>& rows = delta.simplex_regions;
  if (rows.rows == 0 || base.simplex_regions.empty()) {
    return Applied(HugeVector<int32_t>(), rows, 1);
  }
  HugeVector<int32_t> next;
  size_t taken = rows.changed.size();
  for (const RowRun& run : delta.kept_simplices.runs) {
    const auto kept = base.simplex_regions.begin() + run.begin;
    next.insert(next.end(), kept, kept + run.kept);
    const auto added = rows.values.begin() + taken;
    next.insert(next.end(), added, added + run.added);
    taken += run.added;
  }
  for (size_t i = 0; i < rows.changed.size(); ++i) {
    next.at(rows.changed[i]) = rows.values[i];
  }
  return next;
}

// The mesh that `delta` makes of `base`, by its plain reading.
Mesh Applied(const Mesh& base, const MeshDelta& delta) {
  EXPECT_EQ(delta.base_vertices, base.vertex_count());
  EXPECT_EQ(delta.base_simplices, base.simplex_count());
  const size_t dimension = base.dimension;
  Mesh next;
  next.dimension = delta.dimension;
  next.domain_low = delta.domain_low;
  next.domain_high = delta.domain_high;
  next.moved_vertices = delta.moved_vertices;
  next.boundary = delta.boundary;
  next.regions = delta.regions;
  next.statistics = delta.statistics;
  next.points = Applied(base.points, delta.points, dimension);
  next.weights = Applied(base.weights, delta.weights, 1);
  next.input_vertex = Applied(base.input_vertex, delta.input_vertex, 1);
  next.vertex_origins = Applied(base.vertex_origins, delta.vertex_origins, 1);
  next.vertex_tags = Applied(base.vertex_tags, delta.vertex_tags, 1);
  next.simplices = Applied(base.simplices, delta.kept_simplices, dimension + 1);
  next.simplex_regions = AppliedRegions(base, delta);
  next.facets = Applied(base.facets, delta.kept_facets, dimension);
  next.ridges = Applied(base.ridges, delta.kept_ridges, 2);
  EXPECT_EQ(next.vertex_count(), delta.vertices);
  EXPECT_EQ(next.simplex_count(), delta.simplices);
  return next;
}

void ExpectApplied(const Mesh& base, const Mesh& next, const MovedRows* simplices = nullptr) {
  ExpectSame(Applied(base, Diff(base, next, simplices)), next);
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
  EXPECT_TRUE(DiffMeshes(base, next, nullptr, bytes, RunContext()).ok());
  EXPECT_EQ(DiffMeshes(base, next, nullptr, bytes - 1, RunContext()).status().code(),
            absl::StatusCode::kResourceExhausted);
}

TEST_P(MeshDeltaTest, IsNotMadeOnceItIsCancelled) {
  RunContext context;
  context.Cancel();
  const Mesh mesh = RandomMesh(30, 60, true);
  EXPECT_EQ(DiffMeshes(mesh, mesh, nullptr, kMuch, context).status().code(), absl::StatusCode::kCancelled);
}

TEST_P(MeshDeltaTest, ZerosHaveSigns) {
  Mesh base = RandomMesh(3, 1, false);
  base.points[0] = 0.0;
  Mesh next = base;
  next.points[0] = -0.0;
  EXPECT_EQ(Diff(base, next).points.changed.size(), 1);
  ExpectApplied(base, next);
}

TEST_P(MeshDeltaTest, IsNotMadeBetweenMeshesOfTwoDimensions) {
  const Mesh base = RandomMesh(20, 40, true);
  Mesh other = base;
  other.dimension = GetParam() == 2 ? 3 : 2;
  EXPECT_EQ(DiffMeshes(base, other, nullptr, kMuch, RunContext()).status().code(), absl::StatusCode::kInvalidArgument);
}

// Rows are compared by blocks first: a change is found wherever in its block it is.
TEST_P(MeshDeltaTest, FindsAChangeAnywhereAmongManyRows) {
  const Mesh base = RandomMesh(1500, 10, true);
  for (const uint32_t vertex : {0U, 255U, 256U, 511U, 1024U, 1499U}) {
    Mesh next = base;
    next.points[(vertex + 1) * GetParam() - 1] += 1;
    EXPECT_EQ(Diff(base, next).points.changed, HugeVector<uint32_t>{vertex});
    ExpectApplied(base, next);
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
    EXPECT_TRUE(mesher_->Update(next, 1, context_, &simplices).ok());
    return next;
  }

  Mesh mesh;
  std::optional<MovedRows> simplices;  // that Update has noted

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
    ASSERT_TRUE(updated.simplices.has_value());
    ExpectApplied(updated.mesh, next, &*updated.simplices);
    // Simplices that repair takes away and makes again are kept ones.
    EXPECT_EQ(Diff(updated.mesh, next, &*updated.simplices).kept_simplices.added.size(),
              delta.kept_simplices.added.size());
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
  EXPECT_FALSE(updated.simplices.has_value()) << "it was made anew";
}

TEST(MeshDeltaOfUpdate, ScratchMemoryIsOfTheSimplices) {
  EXPECT_GE(DeltaScratchBytes(1000), 1000 * sizeof(uint32_t));
  EXPECT_LE(DeltaScratchBytes(1000), 4 * 1000 * sizeof(uint32_t) + 4096);
}

}  // namespace
}  // namespace wellspace::core
