// Meshes of boxes that are brought up to date: to the bit what a mesh made anew has, at the cost of the change.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "core/meshers/mesher.h"
#include "core/simplex/boundary.h"
#include "core/validate/validate.h"
#include "tests/support/clouds.h"

namespace wellspace::core {
namespace {

MeshParameters InUnitBox(int dimension) {
  MeshParameters parameters{.dimension = dimension};
  parameters.domain_low = test::UnitLow(dimension);
  parameters.domain_high = test::UnitHigh(dimension);
  return parameters;
}

std::unique_ptr<Mesher> Refined(const MeshParameters& parameters, std::span<const double> cloud) {
  RunContext context;
  auto mesher = Mesher::Create(parameters, cloud, context);
  EXPECT_TRUE(mesher.ok()) << mesher.status();
  EXPECT_EQ((*mesher)->Refine(parameters, context), absl::OkStatus());
  return *std::move(mesher);
}

Mesh Extract(Mesher& mesher) {
  RunContext context;
  absl::StatusOr<Mesh> mesh = mesher.Extract(1, context);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *std::move(mesh);
}

void Add(Mesher& mesher, const MeshParameters& parameters, std::span<const double> points) {
  RunContext context;
  const auto added = mesher.AddPoints(points, context);
  ASSERT_TRUE(added.ok()) << added.status();
  ASSERT_EQ(mesher.Refine(parameters, context), absl::OkStatus());
}

void Update(Mesher& mesher, Mesh& mesh) {
  RunContext context;
  ASSERT_EQ(mesher.Update(mesh, 1, context), absl::OkStatus());
}

// All but the order of simplices and facets, and what follows from it.
void ExpectSameVertices(const Mesh& mesh, const Mesh& expected) {
  EXPECT_EQ(mesh.points, expected.points);
  EXPECT_EQ(mesh.input_vertex, expected.input_vertex);
  EXPECT_EQ(mesh.vertex_origins, expected.vertex_origins);
  EXPECT_EQ(mesh.vertex_tags, expected.vertex_tags);
  EXPECT_EQ(mesh.boundary, expected.boundary);
  EXPECT_EQ(mesh.regions, expected.regions);
}

// Points of edits: inside, one that is a vertex of Steiner, one on a face, one on an edge of the box, a cluster.
std::vector<std::vector<double>> EditsOf(const Mesh& mesh) {
  const auto dimension = static_cast<size_t>(mesh.dimension);
  const std::vector<double> inside = test::MakeCloud("inner", mesh.dimension, 12);
  std::vector<double> steiner;
  for (uint32_t v = 0; v < mesh.vertex_count() && steiner.empty(); ++v) {
    if (mesh.vertex_origins[v] >= kRepairOrigin) {
      steiner.assign(&mesh.points[v * dimension], &mesh.points[v * dimension] + dimension);
    }
  }
  std::vector<double> on_face(dimension, 0.3125);
  on_face[0] = 1;
  std::vector<double> on_edge = on_face;
  on_edge[1] = 0;
  const auto part = [&](size_t first, size_t count) {
    return std::vector<double>(inside.begin() + static_cast<std::ptrdiff_t>(first * dimension),
                               inside.begin() + static_cast<std::ptrdiff_t>((first + count) * dimension));
  };
  return {part(0, 1), steiner, on_face, part(1, 3), on_edge, part(0, 1), part(4, 8)};
}

TEST(MesherUpdateTest, ARepairedMeshIsThatOfExtractToTheBit) {
  MeshParameters parameters = InUnitBox(3);
  const std::vector<double> cloud = test::MakeCloud("uniform", 3, 800);
  const auto updating = Refined(parameters, cloud);
  const auto making = Refined(parameters, cloud);
  Mesh mesh = Extract(*updating);
  const std::vector<std::vector<double>> edits = EditsOf(Extract(*making));
  uint64_t moved = 0;
  for (size_t k = 0; k < edits.size(); ++k) {
    SCOPED_TRACE(k);
    parameters.keep_vertices = k == 3;
    parameters.min_dihedral = k == 5 ? 13 : 12;
    const uint64_t measured = mesh.statistics.simplices_measured;
    Add(*updating, parameters, edits[k]);
    Add(*making, parameters, edits[k]);
    Update(*updating, mesh);
    const Mesh made = Extract(*making);
    ExpectSameVertices(mesh, made);
    EXPECT_EQ(mesh.simplices, made.simplices);
    EXPECT_EQ(mesh.facets, made.facets);
    EXPECT_EQ(mesh.moved_vertices, made.moved_vertices);
    EXPECT_EQ(mesh.statistics.max_radius_edge, made.statistics.max_radius_edge);
    EXPECT_EQ(mesh.statistics.min_angle_deg, made.statistics.min_angle_deg);
    EXPECT_EQ(mesh.statistics.slivers_left, made.statistics.slivers_left);
    const QualityReport quality = MeasureQuality({3, mesh.points, mesh.simplices});
    EXPECT_NEAR(mesh.statistics.max_radius_edge, quality.max_radius_edge, 1e-12);
    EXPECT_NEAR(mesh.statistics.min_angle_deg, quality.min_angle_deg, 1e-9);
    EXPECT_TRUE(k == 5 || mesh.statistics.simplices_measured - measured < mesh.simplex_count())
        << "it was not made anew";
    moved += mesh.moved_vertices.size();
  }
  EXPECT_GT(moved, 0u);
}

// The simplices that stay keep their order; those that come follow.
void ExpectAppended(const Mesh& before, const Mesh& mesh) {
  const size_t width = before.dimension + 1;
  const auto row = [&](const Mesh& of, size_t i) {
    return std::vector<uint32_t>(&of.simplices[i * width], &of.simplices[i * width] + width);
  };
  std::set<std::vector<uint32_t>> rows;
  for (size_t i = 0; i < mesh.simplex_count(); ++i) {
    rows.insert(row(mesh, i));
  }
  size_t next = 0;
  size_t gone = 0;
  for (size_t i = 0; i < before.simplex_count(); ++i) {
    if (next < mesh.simplex_count() && row(before, i) == row(mesh, next)) {
      ++next;
    } else {
      ++gone;  // or it has come again, behind the others
    }
  }
  EXPECT_LT(gone, before.simplex_count() / 2);
  EXPECT_EQ(rows.size(), mesh.simplex_count());
}

TEST(MesherUpdateTest, AMeshOfStarsIsThatOfExtractInAnotherOrder) {
  for (const int d : {2, 3, 4}) {
    SCOPED_TRACE(d);
    MeshParameters parameters = InUnitBox(d);
    parameters.min_dihedral = 0;
    const std::vector<double> cloud = test::MakeCloud("uniform", d, d == 4 ? 10 : 500);
    const auto updating = Refined(parameters, cloud);
    const auto making = Refined(parameters, cloud);
    Mesh mesh = Extract(*updating);
    for (const std::vector<double>& edit : EditsOf(Extract(*making))) {
      Add(*updating, parameters, edit);
      Add(*making, parameters, edit);
      const Mesh before = mesh;
      Update(*updating, mesh);
      const Mesh made = Extract(*making);
      ExpectSameVertices(mesh, made);
      if (d < 4) {
        ExpectAppended(before, mesh);
      }
      const auto boundary =
          FindBoxBoundary({mesh.domain_low, mesh.domain_high, mesh.points, mesh.simplices}, 1, RunContext());
      ASSERT_TRUE(boundary.ok());
      EXPECT_EQ(mesh.facets, boundary->facets);
      EXPECT_EQ(mesh.simplex_count(), made.simplex_count());
      EXPECT_EQ(ValidateMesh({d, mesh.points, mesh.simplices}, {.rho = DefaultRho(d)}), absl::OkStatus());
    }
  }
}

// Points and simplices are enough: servers load no more of a mesh from a file.
TEST(MesherUpdateTest, LabelsThatAMeshHasNotAreMadeAnew) {
  for (const double min_dihedral : {12.0, 0.0}) {
    MeshParameters parameters = InUnitBox(3);
    parameters.min_dihedral = min_dihedral;
    const std::vector<double> cloud = test::MakeCloud("uniform", 3, 200);
    const auto mesher = Refined(parameters, cloud);
    const auto twin = Refined(parameters, cloud);
    Mesh mesh = Extract(*mesher);
    Mesh whole = Extract(*twin);
    for (const std::vector<double>& edit : EditsOf(whole)) {
      Mesh loaded;
      loaded.dimension = 3;
      loaded.domain_low = mesh.domain_low;
      loaded.domain_high = mesh.domain_high;
      loaded.points = mesh.points;
      loaded.simplices = mesh.simplices;
      loaded.statistics = mesh.statistics;
      mesh = std::move(loaded);
      Add(*mesher, parameters, edit);
      Add(*twin, parameters, edit);
      Update(*mesher, mesh);
      Update(*twin, whole);
      ExpectSameVertices(mesh, whole);
      EXPECT_EQ(mesh.simplices, whole.simplices);
      EXPECT_EQ(mesh.facets, whole.facets);
      EXPECT_EQ(mesh.moved_vertices, whole.moved_vertices);
    }
  }
}

TEST(MesherUpdateTest, ACancelledUpdateLeavesTheMeshAsItWas) {
  for (const double min_dihedral : {12.0, 0.0}) {
    MeshParameters parameters = InUnitBox(3);
    parameters.min_dihedral = min_dihedral;
    const auto mesher = Refined(parameters, test::MakeCloud("uniform", 3, 300));
    Mesh mesh = Extract(*mesher);
    const Mesh before = mesh;
    Add(*mesher, parameters, std::vector<double>{0.4375, 0.4375, 0.4375});
    RunContext cancelled;
    cancelled.Cancel();
    EXPECT_EQ(mesher->Update(mesh, 1, cancelled).code(), absl::StatusCode::kCancelled);
    EXPECT_EQ(mesh.simplices, before.simplices);
    ExpectSameVertices(mesh, before);
    Update(*mesher, mesh);
    EXPECT_EQ(ValidateMesh({3, mesh.points, mesh.simplices}, {.rho = 2}), absl::OkStatus());
  }
}

// What an edit measures does not grow with the mesh.
TEST(MesherUpdateTest, FewTetrahedraAreMeasured) {
  const MeshParameters parameters = InUnitBox(3);
  for (const size_t n : {1000, 10000}) {
    const auto mesher = Refined(parameters, test::MakeCloud("uniform", 3, n));
    Mesh mesh = Extract(*mesher);
    for (int edit = 0; edit < 4; ++edit) {
      const uint64_t measured = mesh.statistics.simplices_measured;
      Add(*mesher, parameters, std::vector<double>{0.3 + 0.1 * edit, 0.41, 0.52});
      Update(*mesher, mesh);
      EXPECT_GT(mesh.statistics.simplices_measured, measured);
      EXPECT_LT(mesh.statistics.simplices_measured - measured, 12'000u) << n;
    }
  }
}

}  // namespace
}  // namespace wellspace::core
