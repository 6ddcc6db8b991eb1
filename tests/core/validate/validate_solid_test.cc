// Faults planted in meshes of surfaces that are right: each check has to find its own faults.
#include "core/validate/validate_solid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/simplex/solid_boundary.h"
#include "core/simplex/solid_labels.h"
#include "core/validate/validate_fidelity.h"
#include "tests/support/seeded_test.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using test::TestSurface;
using test::Tetrahedra;
using ::testing::HasSubstr;

// A mesh of the meshed solids alone, as a file has it.
struct SolidTestMesh {
  std::vector<double> points;
  std::vector<uint32_t> simplices;
  std::vector<uint32_t> facets;
  std::vector<int32_t> tags;
  std::vector<int32_t> regions;
  std::vector<uint32_t> ridges;

  MeshView View() const { return {.dimension = 3, .points = points, .simplices = simplices}; }
  SolidParts Parts() const {
    SolidParts parts;
    parts.domain.boundary = {.facets = facets, .tags = tags};
    parts.domain.regions = regions;
    parts.ridges = ridges;
    return parts;
  }
  // Points that nothing uses are dropped, and the others numbered anew.
  void DropUnused() {
    std::vector<uint32_t> number(points.size() / 3, 0xffff'ffff);
    std::vector<double> kept;
    for (uint32_t& v : simplices) {
      if (number[v] == 0xffff'ffff) {
        number[v] = static_cast<uint32_t>(kept.size() / 3);
        kept.insert(kept.end(), &points[3 * size_t{v}], &points[3 * size_t{v}] + 3);
      }
      v = number[v];
    }
    points = kept;
    for (std::vector<uint32_t>* rows : {&facets, &ridges}) {
      for (uint32_t& v : *rows) {
        v = number[v];
      }
    }
  }
};

// The mesh of a surface that a grid has the facets of; each solid that is meshed a region of its own.
SolidTestMesh MeshOf(const TestSurface& surface, const Tetrahedra& grid) {
  const std::unique_ptr<test::IndexedSurface> indexed = IndexOf(surface);
  const HugeVector<uint32_t> solid_of = *LabelSimplices(indexed->index, grid.points, grid.simplices, 1, RunContext());
  std::vector<int32_t> region_of(indexed->solids.count);
  std::iota(region_of.begin(), region_of.end(), 0);
  const SolidBoundary boundary =
      *FindSolidBoundary({grid.points, grid.simplices, solid_of, region_of}, indexed->index, 1, RunContext());
  SolidTestMesh mesh{.points = grid.points, .simplices = {}, .facets = {}, .tags = {}, .regions = {}, .ridges = {}};
  mesh.facets.assign(boundary.facets.begin(), boundary.facets.end());
  for (const BoundaryPart& part : boundary.parts) {
    mesh.tags.insert(mesh.tags.end(), part.facets, part.tag);
  }
  for (size_t s = 0; s < solid_of.size(); ++s) {
    if (solid_of[s] != 0) {
      mesh.simplices.insert(mesh.simplices.end(), &grid.simplices[4 * s], &grid.simplices[4 * s] + 4);
      mesh.regions.push_back(static_cast<int32_t>(solid_of[s]));
    }
  }
  mesh.DropUnused();
  return mesh;
}

std::vector<double> Halved(const std::vector<double>& grid) {
  std::vector<double> halved;
  for (size_t i = 0; i + 1 < grid.size(); ++i) {
    halved.push_back(grid[i]);
    halved.push_back(0.5 * (grid[i] + grid[i + 1]));
  }
  halved.push_back(grid.back());
  return halved;
}

// Of a grid that is twice as fine as the surface needs.
SolidTestMesh MeshOf(const TestSurface& surface) {
  return MeshOf(surface, test::GridMesh(Halved(GridAround(surface, 0)), Halved(GridAround(surface, 1)),
                                        Halved(GridAround(surface, 2))));
}

SurfaceView ViewOf(const TestSurface& surface, SolidRule rule = SolidRule::kHoles) {
  SurfaceView view{.points = surface.points, .features = surface.Features()};
  view.features.solids = rule;
  return view;
}

absl::Status CheckAlone(const SolidTestMesh& mesh) {
  return ValidateSolidMesh(mesh.View(), mesh.Parts(), 0, RunContext()).status();
}

FidelityReport Compare(const SolidTestMesh& mesh, const SurfaceView& surface, double tolerance = 1e-2) {
  const absl::StatusOr<FidelityReport> report =
      CompareWithSurface(mesh.View(), mesh.Parts(), surface, {.tolerance = tolerance}, RunContext());
  EXPECT_TRUE(report.ok()) << report.status();
  return report.ok() ? *report : FidelityReport{};
}

// Two materials side by side, in one of which is a third; all tags differ.
struct Sound {
  Sound() {
    const std::vector<double> line = {0, 0.5, 1};
    surface = test::Boxes({0, 1, 1.5, 2, 3}, {0, 0.5, 1, 1.5}, {0, 0.5, 1, 1.5}, [](int i, int j, int k) {
      return i == 2 && j == 1 && k == 1 ? 3 : i == 0 ? 1 : 2;
    });
    mesh = MeshOf(surface);
    view = ViewOf(surface);
  }
  TestSurface surface;
  SolidTestMesh mesh;
  SurfaceView view;
};

const Sound& SoundMesh() {
  static const auto* const sound = new Sound();
  return *sound;
}

TEST(ValidateSolidTest, AMeshThatIsRightIsRight) {
  const Sound& sound = SoundMesh();
  const absl::StatusOr<SolidMeshReport> report =
      ValidateSolidMesh(sound.mesh.View(), sound.mesh.Parts(), 2, RunContext());
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->pieces, 3);
  EXPECT_EQ(report->over_rho, 0);
  EXPECT_EQ(report->open_edges, 0);
  EXPECT_GT(report->branching_edges, 0);
  EXPECT_NEAR(report->areas.at(12), 2.25, 1e-12);
  EXPECT_NEAR(report->areas.at(23), 6 * 0.25, 1e-12);
  const FidelityReport fidelity = Compare(sound.mesh, sound.view);
  EXPECT_TRUE(fidelity.verdict.ok()) << fidelity.verdict;
  EXPECT_EQ(fidelity.solids, 3);
  EXPECT_LT(fidelity.of_facets.found, 1e-12);
  EXPECT_LT(fidelity.of_surface.found, 1e-12);
  EXPECT_LT(fidelity.worst_volume, 1e-12);
  EXPECT_EQ(fidelity.lost_curves, 0);
  EXPECT_GT(fidelity.curves, 3 * 4 + 4 * 1.5 * 3);
  EXPECT_GT(fidelity.tested_points, 2000);
}

TEST(ValidateSolidTest, TheSevenComplexesAreRight) {
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    SCOPED_TRACE(given.name);
    const SolidTestMesh mesh = MeshOf(given.surface);
    const absl::StatusOr<SolidMeshReport> report = ValidateSolidMesh(mesh.View(), mesh.Parts(), 0, RunContext());
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_EQ(report->pieces, given.volumes.size());
    std::vector<double> volumes;
    for (const auto& [region, volume] : report->volumes) {
      volumes.push_back(volume);
    }
    std::sort(volumes.begin(), volumes.end());
    EXPECT_THAT(volumes, ::testing::Pointwise(::testing::DoubleNear(1e-12), given.volumes));
    const FidelityReport fidelity = Compare(mesh, ViewOf(given.surface));
    EXPECT_TRUE(fidelity.verdict.ok()) << fidelity.verdict;
    EXPECT_LT(fidelity.of_surface.found, 1e-12);
    EXPECT_LT(fidelity.of_surface.at_most, 2e-2);
  }
}

struct Fault {
  std::string name;
  std::function<void(SolidTestMesh&)> plant;
  std::string alone;    // in the error of the mesh's own check; empty: it finds nothing
  std::string against;  // in the error of the comparison with the surface; empty: not asked
};

// The first row of three vertices for which all of `is_wanted` holds.
size_t FacetWith(const SolidTestMesh& mesh, int32_t tag) {
  return static_cast<size_t>(std::find(mesh.tags.begin(), mesh.tags.end(), tag) - mesh.tags.begin());
}

void EraseTetrahedra(SolidTestMesh& mesh, const std::function<bool(size_t)>& is_erased) {
  std::vector<uint32_t> simplices;
  std::vector<int32_t> regions;
  for (size_t s = 0; s < mesh.regions.size(); ++s) {
    if (!is_erased(s)) {
      simplices.insert(simplices.end(), &mesh.simplices[4 * s], &mesh.simplices[4 * s] + 4);
      regions.push_back(mesh.regions[s]);
    }
  }
  mesh.simplices = simplices;
  mesh.regions = regions;
}

void EraseFacet(SolidTestMesh& mesh, size_t f) {
  mesh.facets.erase(mesh.facets.begin() + 3 * static_cast<std::ptrdiff_t>(f),
                    mesh.facets.begin() + 3 * static_cast<std::ptrdiff_t>(f) + 3);
  mesh.tags.erase(mesh.tags.begin() + static_cast<std::ptrdiff_t>(f));
}

size_t VertexAt(const SolidTestMesh& mesh, const Point<3>& p) {
  for (size_t v = 0; v < mesh.points.size() / 3; ++v) {
    if (PointAt<3>(mesh.points, v) == p) {
      return v;
    }
  }
  ADD_FAILURE() << "no such vertex";
  return 0;
}

// Makes a facet of a face between two tetrahedra inside.
void AddMembrane(SolidTestMesh& m) {
  std::set<std::vector<uint32_t>> known;
  for (size_t f = 0; f < m.facets.size(); f += 3) {
    std::vector<uint32_t> row(&m.facets[f], &m.facets[f] + 3);
    std::sort(row.begin(), row.end());
    known.insert(row);
  }
  for (size_t s = 0; s < m.simplices.size(); s += 4) {
    std::vector<uint32_t> row(&m.simplices[s + 1], &m.simplices[s + 1] + 3);
    std::sort(row.begin(), row.end());
    if (!known.contains(row)) {
      m.facets.insert(m.facets.end(), &m.simplices[s + 1], &m.simplices[s + 1] + 3);
      m.tags.push_back(2);
      return;
    }
  }
}

std::vector<Fault> FaultsOfTetrahedra() {
  return {
      {"a tetrahedron is missing", [](SolidTestMesh& m) { EraseTetrahedra(m, [](size_t s) { return s == 7; }); },
       "alone, and no facet", ""},
      {"a region is missing",
       [](SolidTestMesh& m) {
         std::vector<bool> is_kept;
         for (size_t f = m.tags.size(); f > 0; --f) {
           if (m.tags[f - 1] == 1) {
             EraseFacet(m, f - 1);
           }
         }
         EraseTetrahedra(m, [&](size_t s) { return m.regions[s] == 1; });
         // The facets between both are now the boundary of the other one.
         for (size_t f = 0; f < m.tags.size(); ++f) {
           if (m.tags[f] == 12) {
             std::swap(m.facets[3 * f], m.facets[3 * f + 1]);
           }
         }
         m.DropUnused();
       },
       "", "lies in a solid that is meshed, but in no tetrahedron"},
      {"a region is there twice, moved",
       [](SolidTestMesh& m) {
         // The inner box once more, without a common vertex, in the first material.
         const auto vertices = static_cast<uint32_t>(m.points.size() / 3);
         const size_t tetrahedra = m.regions.size();
         const size_t facets = m.tags.size();
         const std::vector<double> points = m.points;
         for (size_t i = 0; i < points.size(); i += 3) {
           m.points.insert(m.points.end(), {points[i] - 1.13, points[i + 1] + 0.03, points[i + 2] + 0.01});
         }
         for (size_t s = 0; s < tetrahedra; ++s) {
           for (size_t k = 0; k < 4 && m.regions[s] == 3; ++k) {
             m.simplices.push_back(m.simplices[4 * s + k] + vertices);
           }
           if (m.regions[s] == 3) {
             m.regions.push_back(3);
           }
         }
         for (size_t f = 0; f < facets; ++f) {
           if (m.tags[f] == 23) {
             m.facets.insert(m.facets.end(), {m.facets[3 * f] + vertices, m.facets[3 * f + 2] + vertices,
                                              m.facets[3 * f + 1] + vertices});
             m.tags.push_back(23);
           }
         }
         m.DropUnused();
       },
       "inside its circumsphere", "overlap at the point"},
      {"a tetrahedron has a wrong label", [](SolidTestMesh& m) { m.regions[11] = m.regions[11] == 1 ? 2 : 1; },
       "between them is no facet", ""},
  };
}

std::vector<Fault> FaultsOfVerticesAndTags() {
  return {
      {"a vertex on a facet is moved inwards",
       [](SolidTestMesh& m) {
         m.points[3 * VertexAt(m, {0, 0.75, 0.75})] += 1e-3;
       },
       "", "away from the surface"},
      {"a vertex on a crease is moved away from it",
       [](SolidTestMesh& m) {
         const size_t v = VertexAt(m, {0.5, 0, 0});
         m.points[3 * v + 1] += 1e-3;
       },
       "", "away from"},
      {"a tag is swapped", [](SolidTestMesh& m) { m.tags[FacetWith(m, 1)] = 2; }, "",
       "has the tag 2, but the nearest triangle with it"},
      {"a tag is that of nothing", [](SolidTestMesh& m) { m.tags[FacetWith(m, 12)] = 77; }, "",
       "has the tag 77, which no triangle of the surface has"},
      {"a tag is 0", [](SolidTestMesh& m) { m.tags[5] = 0; }, "has the tag 0", ""},
  };
}

std::vector<Fault> FaultsOfFacetsAndRidges() {
  return {
      {"a facet is missing", [](SolidTestMesh& m) { EraseFacet(m, FacetWith(m, 2)); }, "alone, and no facet", ""},
      {"a facet between regions is missing", [](SolidTestMesh& m) { EraseFacet(m, FacetWith(m, 12)); },
       "between them is no facet", ""},
      {"a facet is there twice",
       [](SolidTestMesh& m) {
         m.facets.insert(m.facets.end(), {m.facets[0], m.facets[1], m.facets[2]});
         m.tags.push_back(m.tags[0]);
       },
       "is there twice", ""},
      {"a facet is turned", [](SolidTestMesh& m) { std::swap(m.facets[0], m.facets[1]); }, "on its outer side", ""},
      {"a facet has a vertex that there is not", [](SolidTestMesh& m) { m.facets[4] = 1u << 30; }, "but there are", ""},
      {"a facet is none of a tetrahedron",
       [](SolidTestMesh& m) {
         const auto at = [&](double x, double y, double z) { return static_cast<uint32_t>(VertexAt(m, {x, y, z})); };
         m.facets.insert(m.facets.end(), {at(0, 0, 0), at(3, 0, 0), at(0, 1.5, 0)});
         m.tags.push_back(1);
       },
       "is of no tetrahedron", ""},
      {"a membrane that nothing asks for", AddMembrane, "", "away from the surface"},
      {"a ridge is no edge",
       [](SolidTestMesh& m) {
         m.ridges = {0, 0};
       },
       "is no edge of a facet", ""},
      {"a ridge is there twice",
       [](SolidTestMesh& m) {
         m.ridges = {m.facets[0], m.facets[1], m.facets[1], m.facets[0]};
       },
       "is there twice", ""},
      {"ridges are lost",
       [](SolidTestMesh& m) {
         m.ridges = {m.facets[0], m.facets[1]};
       },
       "", "no ridge runs along curves"},
      {"a tetrahedron is mirrored", [](SolidTestMesh& m) { std::swap(m.simplices[0], m.simplices[1]); },
       "negative orientation", ""},
      {"a vertex inside is where it is in another's circumsphere",
       [](SolidTestMesh& m) {
         m.points[3 * VertexAt(m, {0.5, 0.75, 0.75})] += 0.05;
       },
       "inside its circumsphere", ""},
  };
}

std::vector<Fault> Faults() {
  std::vector<Fault> faults = FaultsOfTetrahedra();
  for (const std::vector<Fault>& more : {FaultsOfVerticesAndTags(), FaultsOfFacetsAndRidges()}) {
    faults.insert(faults.end(), more.begin(), more.end());
  }
  return faults;
}

TEST(ValidateSolidTest, FaultsAreFound) {
  const Sound& sound = SoundMesh();
  for (const Fault& fault : Faults()) {
    SCOPED_TRACE(fault.name);
    SolidTestMesh mesh = sound.mesh;
    fault.plant(mesh);
    const absl::Status alone = CheckAlone(mesh);
    if (!fault.alone.empty()) {
      EXPECT_EQ(alone.code(), absl::StatusCode::kFailedPrecondition);
      EXPECT_THAT(std::string(alone.message()), HasSubstr(fault.alone));
    }
    if (!fault.against.empty()) {
      const FidelityReport report = Compare(mesh, sound.view, 1e-4);
      EXPECT_THAT(std::string(report.verdict.message()), HasSubstr(fault.against));
    }
    EXPECT_FALSE(fault.alone.empty() && fault.against.empty());
  }
}

TEST(ValidateSolidTest, ACavityThatIsFilledIsFound) {
  const std::vector<double> line = {0, 1, 2, 3};
  const TestSurface surface =
      test::Boxes(line, line, line, [](int i, int j, int k) { return i == 1 && j == 1 && k == 1 ? 2 : 1; });
  SolidTestMesh mesh = MeshOf(surface);
  EXPECT_TRUE(Compare(mesh, ViewOf(surface)).verdict.ok());
  EXPECT_THAT(std::string(Compare(mesh, ViewOf(surface, SolidRule::kEvenOdd)).verdict.message()),
              HasSubstr("lies outside of what is meshed"));
  const std::vector<SolidSeed> seeds = {{.at = {1.5, 1.51, 1.52}, .is_hole = true},
                                        {.at = {0.51, 0.52, 0.53}, .is_hole = false, .region = 9}};
  SurfaceView with_hole = ViewOf(surface);
  with_hole.features.seeds = std::span(seeds).first(1);
  EXPECT_THAT(std::string(Compare(mesh, with_hole).verdict.message()), HasSubstr("lies outside of what is meshed"));
  SurfaceView with_region = ViewOf(surface);
  with_region.features.seeds = std::span(seeds).last(1);
  EXPECT_THAT(std::string(Compare(mesh, with_region).verdict.message()), HasSubstr("in it is of region 9"));
  // Without the tetrahedra of the cavity it is right by both.
  EraseTetrahedra(mesh, [&](size_t s) { return mesh.regions[s] == 2; });
  for (size_t f = 0; f < mesh.tags.size(); ++f) {
    if (mesh.tags[f] == 12) {
      EXPECT_EQ(mesh.regions[0], 1);
    }
  }
  mesh.DropUnused();
  EXPECT_TRUE(CheckAlone(mesh).ok()) << CheckAlone(mesh);
  EXPECT_TRUE(Compare(mesh, with_hole).verdict.ok()) << Compare(mesh, with_hole).verdict;
  EXPECT_TRUE(Compare(mesh, ViewOf(surface, SolidRule::kEvenOdd)).verdict.ok());
  EXPECT_THAT(std::string(Compare(mesh, ViewOf(surface)).verdict.message()), HasSubstr("but in no tetrahedron"));
}

// Each by a mesh that is right by itself, and has no tags or regions that could tell.
TEST(ValidateSolidTest, AHoleAShellAndACreaseThatAreMissingAreFound) {
  const std::vector<double> line = {0, 1, 2, 3};
  const auto verdict = [](SolidTestMesh mesh, SurfaceView surface, double tolerance) {
    EXPECT_TRUE(CheckAlone(mesh).ok()) << CheckAlone(mesh);
    mesh.tags.assign(mesh.tags.size(), 1);
    return std::string(Compare(mesh, surface, tolerance).verdict.message());
  };
  const auto block = [&](auto is_there) {
    TestSurface surface = test::Boxes(line, line, {0, 1}, [&](int i, int j, int) { return is_there(i, j) ? 1 : 0; });
    surface.markers.assign(surface.markers.size(), 1);
    return surface;
  };
  const TestSurface whole = block([](int, int) { return true; });
  const TestSurface ring = block([](int i, int j) { return i != 1 || j != 1; });
  const TestSurface two = block([](int i, int) { return i != 1; });
  const TestSurface one = block([](int i, int) { return i == 0; });
  EXPECT_EQ(verdict(MeshOf(ring), ViewOf(ring), 0.01), "");
  EXPECT_THAT(verdict(MeshOf(whole), ViewOf(ring), 0.01), HasSubstr("away from the surface at (1.5, 1.5, "));
  EXPECT_EQ(verdict(MeshOf(two), ViewOf(two), 0.01), "");
  EXPECT_THAT(verdict(MeshOf(one), ViewOf(two), 0.01), HasSubstr("but in no tetrahedron"));
  // A roof that is lower than the tolerance: the crease along its top is no edge of the mesh.
  TestSurface roofed{.points = whole.points, .corners = {}, .markers = {}};
  const uint32_t low = roofed.AddPoint({1.5, 0, 1.2});
  const uint32_t high = roofed.AddPoint({1.5, 3, 1.2});
  const uint32_t first = roofed.AddPoint({0, 0, 1});
  const uint32_t second = roofed.AddPoint({3, 0, 1});
  const uint32_t third = roofed.AddPoint({3, 3, 1});
  const uint32_t fourth = roofed.AddPoint({0, 3, 1});
  const uint32_t below_first = roofed.AddPoint({0, 0, 0});
  const uint32_t below_second = roofed.AddPoint({3, 0, 0});
  const uint32_t below_third = roofed.AddPoint({3, 3, 0});
  const uint32_t below_fourth = roofed.AddPoint({0, 3, 0});
  const auto add = [&](const std::vector<uint32_t>& polygon) {
    for (size_t i = 1; i + 1 < polygon.size(); ++i) {
      roofed.AddTriangle({polygon[0], polygon[i], polygon[i + 1]}, 1);
    }
  };
  add({below_first, below_fourth, below_third, below_second});
  add({below_first, below_second, second, low, first});
  add({below_third, below_fourth, fourth, high, third});
  add({below_second, below_third, third, second});
  add({below_fourth, below_first, first, fourth});
  add({first, low, high, fourth});
  add({low, second, third, high});
  SurfaceView sharp = ViewOf(roofed);
  sharp.features.crease_angle = 10;
  EXPECT_THAT(verdict(MeshOf(whole), sharp, 0.25), HasSubstr("along curves of the surface"));
  sharp.features.crease_angle = 180;
  EXPECT_EQ(verdict(MeshOf(whole), sharp, 0.25), "");
}

TEST(ValidateSolidTest, DeviationIsMeasuredBothWays) {
  // A cube under a roof, and a mesh that has the cube alone.
  TestSurface house = test::Cube();
  const uint32_t apex = house.AddPoint({0.5, 0.5, 1.25});
  TestSurface roofed{.points = house.points, .corners = {}, .markers = {}};
  std::array<uint32_t, 4> top;
  for (size_t t = 0; t < house.triangle_count(); ++t) {
    std::array<uint32_t, 3> corners;
    bool is_top = true;
    for (size_t k = 0; k < 3; ++k) {
      corners[k] = house.corners[3 * t + k];
      const Point<3> p = PointAt<3>(house.points, corners[k]);
      is_top = is_top && p[2] == 1;
      if (p[2] == 1) {
        top[(p[0] == 1 ? 1 : 0) + (p[1] == 1 ? 2 : 0)] = corners[k];
      }
    }
    if (!is_top) {
      roofed.AddTriangle(corners, 1);
    }
  }
  for (const auto& [i, k] : {std::pair(0, 1), std::pair(1, 3), std::pair(3, 2), std::pair(2, 0)}) {
    roofed.AddTriangle({top[i], top[k], apex}, 1);
  }
  const FidelityReport report = Compare(MeshOf(test::Cube()), ViewOf(roofed), 0.01);
  EXPECT_NEAR(report.of_surface.found, 0.25, 1e-12);
  EXPECT_EQ(report.of_surface.at, (Point<3>{0.5, 0.5, 1.25}));
  EXPECT_GE(report.of_surface.triangle, roofed.triangle_count() - 4);
  // The distance of the middle of the top from the roof above it.
  const double below = 0.25 / std::hypot(1, 0.5);
  EXPECT_NEAR(report.of_facets.found, below, 0.02 * below);
  EXPECT_LE(report.of_facets.found, below + 1e-12);
  EXPECT_GE(report.of_facets.at_most, below);
  EXPECT_LE(report.of_facets.at_most, report.of_facets.found * 1.02 + 1e-3);
  EXPECT_THAT(std::string(report.verdict.message()), HasSubstr("away from the surface at"));
}

TEST(ValidateSolidTest, PartsOfBoxesByChanceAreRight) {
  test::SplitMix64 random(test::Seed(60'119));
  for (int i = 0; i < 8; ++i) {
    SCOPED_TRACE(i);
    const test::VoxelPart part = test::RandomVoxelPart(2 + i % 2, 1 + i % 3, random);
    const TestSurface surface = part.Surface();
    const SolidTestMesh mesh = MeshOf(surface, GridMeshAround(surface));
    const absl::StatusOr<SolidMeshReport> alone = ValidateSolidMesh(mesh.View(), mesh.Parts(), 0, RunContext());
    ASSERT_TRUE(alone.ok()) << alone.status();
    const FidelityReport report = Compare(mesh, ViewOf(surface));
    // A void that materials enclose is meshed by that rule.
    EXPECT_TRUE(report.verdict.ok()) << report.verdict;
    EXPECT_LT(report.worst_volume, 1e-12);
  }
}

TEST(ValidateSolidTest, WhatCannotBeAskedIsRefused) {
  const Sound& sound = SoundMesh();
  SolidTestMesh mesh = sound.mesh;
  mesh.facets.pop_back();
  EXPECT_EQ(CheckAlone(mesh).code(), absl::StatusCode::kInvalidArgument);
  mesh = sound.mesh;
  mesh.tags.pop_back();
  EXPECT_EQ(CheckAlone(mesh).code(), absl::StatusCode::kInvalidArgument);
  mesh = sound.mesh;
  mesh.regions.pop_back();
  EXPECT_EQ(CheckAlone(mesh).code(), absl::StatusCode::kInvalidArgument);
  const auto compare = [&](const SurfaceView& view, double tolerance) {
    return CompareWithSurface(sound.mesh.View(), sound.mesh.Parts(), view, {.tolerance = tolerance}, RunContext())
        .status()
        .code();
  };
  EXPECT_EQ(compare(sound.view, 0), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(compare(sound.view, std::nan("")), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(compare({}, 1), absl::StatusCode::kInvalidArgument);
  RunContext cancelled;
  cancelled.Cancel();
  EXPECT_EQ(ValidateSolidMesh(sound.mesh.View(), sound.mesh.Parts(), 0, cancelled).status().code(),
            absl::StatusCode::kCancelled);
  EXPECT_EQ(CompareWithSurface(sound.mesh.View(), sound.mesh.Parts(), sound.view, {.tolerance = 1}, cancelled)
                .status()
                .code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
