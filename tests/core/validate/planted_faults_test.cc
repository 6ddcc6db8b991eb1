// Faults planted in a mesh that is right, in every dimension: each check has to find its own faults.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/validate/validate.h"
#include "tests/support/meshes.h"

namespace wellspace::core {
namespace {

using test::TestMesh;

// A mesh that is right, on lines at uneven distances, and the bounds that it just keeps.
struct Sound {
  explicit Sound(int dimension)
      : mesh(test::KuhnGridOn(dimension, dimension <= 3   ? std::vector<double>{0, 1, 2.25, 3}
                                         : dimension <= 5 ? std::vector<double>{0, 1, 2.25}
                                                          : std::vector<double>{0, 1.5})),
        cloud(mesh.points),
        lines(dimension <= 3   ? 4
              : dimension <= 5 ? 3
                               : 2) {
    const QualityReport report = MeasureQuality(mesh.View());
    rho = report.max_radius_edge;
    // The largest circumradius is that of the cell with the longest sides.
    largest = std::sqrt(dimension) * (dimension <= 5 ? 1.25 : 1.5) / 2;
    // A vertex between the longest and the shortest sides, if there is one.
    well_spaced_rho = largest / (dimension <= 3 ? 0.75 : dimension <= 5 ? 1 : 1.5);
  }

  size_t VertexAt(const std::vector<size_t>& line) const {
    return std::accumulate(line.begin(), line.end(), size_t{0}, [this](size_t v, size_t i) { return v * lines + i; });
  }
  size_t D() const { return static_cast<size_t>(mesh.dimension); }
  // All coordinates at line 1: inside, or the highest corner where there are two lines.
  size_t Middle() const { return VertexAt(std::vector<size_t>(D(), 1)); }
  // On the high face of axis 0 and, but for a single cell, on no other.
  size_t OnFace() const {
    std::vector<size_t> line(D(), 1);
    line[0] = lines - 1;
    return VertexAt(line);
  }

  TestMesh mesh;
  std::vector<double> cloud;
  size_t lines;
  double rho = 0;
  double well_spaced_rho = 0;
  double largest = 0;
};

struct NamedCheck {
  std::string name;
  std::function<absl::Status(const Sound&, const MeshView&)> run;
};

const std::vector<NamedCheck>& NamedChecks() {
  static const auto* const checks = new std::vector<NamedCheck>{
      {"indices", [](const Sound&, const MeshView& mesh) { return ValidateIndices(mesh); }},
      {"orientation", [](const Sound&, const MeshView& mesh) { return ValidateOrientation(mesh); }},
      {"topology", [](const Sound&, const MeshView& mesh) { return ValidateTopology(mesh); }},
      {"volume", [](const Sound&, const MeshView& mesh) { return ValidateVolume(mesh); }},
      {"Delaunay", [](const Sound&, const MeshView& mesh) { return ValidateDelaunay(mesh); }},
      {"radius-edge", [](const Sound& sound, const MeshView& mesh) { return ValidateRadiusEdge(mesh, sound.rho); }},
      {"well-spaced",
       [](const Sound& sound, const MeshView& mesh) { return ValidateWellSpaced(mesh, sound.well_spaced_rho); }},
      {"circumcentres", [](const Sound&, const MeshView& mesh) { return ValidateCircumcentres(mesh); }},
      {"sizing", [](const Sound& sound,
                    const MeshView& mesh) { return ValidateSizing(mesh, {.max_circumradius = sound.largest}); }},
      {"cloud", [](const Sound& sound, const MeshView& mesh) { return ValidateCloud(mesh, sound.cloud); }},
  };
  return *checks;
}

// Cuts simplex `s` into D + 1 at the mean of its corners.
void SplitSimplex(TestMesh& mesh, size_t s) {
  const size_t d = static_cast<size_t>(mesh.dimension);
  const std::vector<uint32_t> corners(mesh.Corners(s), mesh.Corners(s) + d + 1);
  const auto middle = static_cast<uint32_t>(mesh.VertexCount());
  for (size_t k = 0; k < d; ++k) {
    double sum = 0;
    for (const uint32_t v : corners) {
      sum += mesh.points[v * d + k];
    }
    mesh.points.push_back(sum / static_cast<double>(d + 1));
  }
  for (size_t skip = 0; skip <= d; ++skip) {
    std::vector<uint32_t> part = corners;
    part[skip] = middle;
    if (skip == 0) {
      std::copy(part.begin(), part.end(), mesh.Corners(s));
    } else {
      mesh.simplices.insert(mesh.simplices.end(), part.begin(), part.end());
    }
  }
}

struct Fault {
  std::string name;
  std::function<void(const Sound&, TestMesh&)> plant;
  std::vector<std::string> found_by;  // at least
  int last_dimension = 6;             // a single cell has no vertex inside, and one size
};

const std::vector<Fault>& Faults() {
  static const auto* const faults = new std::vector<Fault>{
      {"a simplex is mirrored",
       [](const Sound&, TestMesh& mesh) { std::swap(mesh.Corners(1)[0], mesh.Corners(1)[1]); },
       {"orientation", "volume"}},
      {"a simplex is dropped",
       [](const Sound& sound, TestMesh& mesh) { mesh.simplices.resize(mesh.simplices.size() - sound.D() - 1); },
       {"topology", "volume"}},
      {"all simplices of a vertex are dropped",
       [](const Sound& sound, TestMesh& mesh) {
         std::vector<uint32_t> kept;
         for (size_t s = 0; s < mesh.SimplexCount(); ++s) {
           const uint32_t* const corners = mesh.Corners(s);
           if (std::find(corners, corners + sound.D() + 1, sound.Middle()) == corners + sound.D() + 1) {
             kept.insert(kept.end(), corners, corners + sound.D() + 1);
           }
         }
         mesh.simplices = kept;
       },
       {"indices", "topology", "volume"},
       5},
      {"a simplex is there twice",
       [](const Sound& sound, TestMesh& mesh) {
         const std::vector<uint32_t> corners(mesh.Corners(2), mesh.Corners(2) + sound.D() + 1);
         mesh.simplices.insert(mesh.simplices.end(), corners.begin(), corners.end());
       },
       {"topology", "volume"}},
      {"two vertices have each other's coordinates",
       [](const Sound& sound, TestMesh& mesh) {
         std::swap_ranges(mesh.Vertex(0), mesh.Vertex(0) + sound.D(), mesh.Vertex(sound.OnFace()));
       },
       {"orientation", "cloud"}},
      {"a simplex has the number of another vertex",
       [](const Sound& sound, TestMesh& mesh) {
         uint32_t* const corners = mesh.Corners(0);
         uint32_t other = 0;
         while (std::find(corners, corners + sound.D() + 1, other) != corners + sound.D() + 1) {
           ++other;
         }
         corners[1] = other;
       },
       {"topology"}},
      {"a simplex has one vertex twice",
       [](const Sound&, TestMesh& mesh) { mesh.Corners(0)[1] = mesh.Corners(0)[0]; },
       {"indices", "orientation", "topology", "volume", "radius-edge", "well-spaced", "circumcentres", "sizing"}},
      {"a vertex is where another is",
       [](const Sound& sound, TestMesh& mesh) { std::copy_n(mesh.Vertex(0), sound.D(), mesh.Vertex(sound.OnFace())); },
       {"indices", "orientation", "cloud"}},
      {"a vertex that no simplex has",
       [](const Sound& sound, TestMesh& mesh) { mesh.points.insert(mesh.points.end(), sound.D(), 0.5); },
       {"indices"}},
      {"a vertex inside a circumball",
       [](const Sound&, TestMesh& mesh) { SplitSimplex(mesh, mesh.SimplexCount() / 2); },
       {"Delaunay", "radius-edge", "well-spaced"}},
      {"a vertex moved within its star",
       [](const Sound& sound, TestMesh& mesh) { mesh.Vertex(sound.Middle())[0] += 0.5; },
       {"Delaunay", "cloud", "sizing"},
       5},
      {"a vertex moved next to its neighbour",
       [](const Sound& sound, TestMesh& mesh) { mesh.Vertex(sound.Middle())[0] += 1.25 - 1e-3; },
       {"Delaunay", "cloud", "radius-edge", "well-spaced"},
       5},
      {"a vertex moved out of its star",
       [](const Sound& sound, TestMesh& mesh) {
         mesh.Vertex(sound.Middle())[0] += 1;
         mesh.Vertex(sound.Middle())[1] -= 0.9;
       },
       {"orientation", "topology", "cloud"},
       5},
      {"a vertex one step of the last bit off",
       [](const Sound& sound, TestMesh& mesh) {
         double& x = mesh.Vertex(sound.Middle())[1];
         x = std::nextafter(x, 0.0);
       },
       {"cloud", "Delaunay"},
       5},
      {"a vertex one step of the last bit off its face",
       [](const Sound& sound, TestMesh& mesh) {
         double& x = mesh.Vertex(sound.OnFace())[0];
         x = std::nextafter(x, 0.0);
       },
       {"topology", "volume", "cloud"}},
      {"a face moved out",
       [](const Sound& sound, TestMesh& mesh) {
         for (size_t v = 0; v < mesh.VertexCount(); ++v) {
           if (mesh.Vertex(v)[0] == sound.mesh.points[sound.OnFace() * sound.D()]) {
             mesh.Vertex(v)[0] += 1;
           }
         }
       },
       {"sizing", "cloud", "radius-edge", "well-spaced"}},
      {"only a corner of the box moved out",
       [](const Sound&, TestMesh& mesh) { mesh.Vertex(mesh.VertexCount() - 1)[0] += 1; },
       {"topology", "volume", "sizing", "cloud"}},
  };
  return *faults;
}

class PlantedFaultsTest : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Dimensions, PlantedFaultsTest, ::testing::Range(2, 7));

TEST_P(PlantedFaultsTest, AreFoundByTheChecksWhoseTheyAre) {
  const Sound sound(GetParam());
  for (const NamedCheck& check : NamedChecks()) {
    const absl::Status status = check.run(sound, sound.mesh.View());
    ASSERT_TRUE(status.ok()) << check.name << ": " << status;
  }
  for (const Fault& fault : Faults()) {
    if (GetParam() > fault.last_dimension) {
      continue;
    }
    TestMesh mesh = sound.mesh;
    fault.plant(sound, mesh);
    for (const std::string& name : fault.found_by) {
      const auto check = std::find_if(NamedChecks().begin(), NamedChecks().end(),
                                      [&](const NamedCheck& candidate) { return candidate.name == name; });
      ASSERT_NE(check, NamedChecks().end()) << name;
      EXPECT_EQ(check->run(sound, mesh.View()).code(), absl::StatusCode::kFailedPrecondition)
          << fault.name << ": " << name << " does not find it";
    }
    // The whole check finds the faults that a part finds.
    const absl::Status whole = ValidateMesh(mesh.View(), {.rho = sound.rho,
                                                          .criterion = Criterion::kRadiusEdge,
                                                          .max_circumradius = sound.largest,
                                                          .size_boxes = {},
                                                          .cloud = sound.cloud});
    EXPECT_EQ(whole.code(), absl::StatusCode::kFailedPrecondition) << fault.name;
  }
}

// No check is there for nothing: some fault is found by it.
TEST(EveryCheckTest, FindsSomeFault) {
  for (const NamedCheck& check : NamedChecks()) {
    EXPECT_TRUE(check.name == "circumcentres" || std::any_of(Faults().begin(), Faults().end(),
                                                             [&](const Fault& fault) {
                                                               return std::find(fault.found_by.begin(),
                                                                                fault.found_by.end(),
                                                                                check.name) != fault.found_by.end();
                                                             }))
        << check.name;
  }
}

}  // namespace
}  // namespace wellspace::core
