// The boundary that a mesh comes with, and where its vertices come from.
#include "core/simplex/boundary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "core/geometry/exact_measure.h"
#include "core/meshers/mesher.h"
#include "core/validate/validate_boundary.h"
#include "tests/support/clouds.h"
#include "tests/support/parameters.h"

namespace wellspace::core {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The tag of every facet.
std::vector<int32_t> TagsOf(const Mesh& mesh) {
  std::vector<int32_t> tags;
  for (const BoundaryPart& part : mesh.boundary) {
    tags.insert(tags.end(), part.facets, part.tag);
  }
  return tags;
}

std::map<int32_t, std::string> NamesOf(const Mesh& mesh) {
  std::map<int32_t, std::string> names;
  for (const BoundaryPart& part : mesh.boundary) {
    names[part.tag] = part.name;
  }
  return names;
}

absl::Status Validate(const Mesh& mesh) {
  const std::vector<int32_t> tags = TagsOf(mesh);
  return ValidateBoundary({mesh.dimension, mesh.points, mesh.simplices}, {mesh.facets, tags, NamesOf(mesh)});
}

// `vertices` ascending, and whether that took an odd number of exchanges.
std::pair<std::vector<uint32_t>, bool> Sorted(std::vector<uint32_t> vertices) {
  bool is_odd = false;
  for (size_t i = 1; i < vertices.size(); ++i) {
    for (size_t k = i; k > 0 && vertices[k] < vertices[k - 1]; --k) {
      std::swap(vertices[k], vertices[k - 1]);
      is_odd = !is_odd;
    }
  }
  return {vertices, is_odd};
}

// The rows of `values` but for the place `left_out` of each.
std::vector<uint32_t> Without(const uint32_t* row, int width, int left_out) {
  std::vector<uint32_t> rest;
  for (int k = 0; k < width; ++k) {
    if (k != left_out) {
      rest.push_back(row[k]);
    }
  }
  return rest;
}

// The facets that belong to one simplex, ascending: an oracle that knows nothing of the box.
std::set<std::vector<uint32_t>> FacetsOfOneSimplex(const Mesh& mesh) {
  const int d = mesh.dimension;
  std::map<std::vector<uint32_t>, int> simplices_of;
  for (size_t at = 0; at < mesh.simplices.size(); at += d + 1) {
    for (int apex = 0; apex <= d; ++apex) {
      ++simplices_of[Sorted(Without(&mesh.simplices[at], d + 1, apex)).first];
    }
  }
  std::set<std::vector<uint32_t>> facets;
  for (const auto& [facet, count] : simplices_of) {
    if (count == 1) {
      facets.insert(facet);
    }
  }
  return facets;
}

// The area that the facets of `face` cover, less its own, without rounding: 0 unless they overlap or leave gaps.
template <int D>
double ExcessArea(const Mesh& mesh, int face, std::span<const uint32_t> facets) {
  const auto point_of = [&](uint32_t v) {
    Point<D - 1> p;
    for (int k = 0, at = 0; k < D; ++k) {
      if (k != face / 2) {
        p[at++] = mesh.points[size_t{v} * D + k];
      }
    }
    return p;
  };
  ExactVolumeSum<D - 1> excess;
  for (size_t at = 0; at < facets.size(); at += D) {
    Simplex<D - 1> simplex;
    for (int k = 0; k < D; ++k) {
      simplex[k] = point_of(facets[at + k]);
    }
    if (Orientation<D - 1>(simplex).sign == Sign::kNegative) {
      std::swap(simplex[0], simplex[1]);
    }
    excess.Add(simplex);
  }
  Box<D - 1> area;
  for (int k = 0, at = 0; k < D; ++k) {
    if (k != face / 2) {
      area.low[at] = mesh.domain_low[k];
      area.high[at++] = mesh.domain_high[k];
    }
  }
  excess.Subtract(area);
  return excess.value();
}

// In 2-D: whether the edges of `face` are a chain from corner to corner; edges have the mesh on their left.
bool IsChain(const Mesh& mesh, int face, std::span<const uint32_t> edges) {
  const int along = 1 - face / 2;
  std::vector<std::pair<double, double>> spans;
  for (size_t at = 0; at < edges.size(); at += 2) {
    const double a = mesh.points[size_t{edges[at]} * 2 + along];
    const double b = mesh.points[size_t{edges[at + 1]} * 2 + along];
    spans.emplace_back(std::min(a, b), std::max(a, b));
  }
  std::sort(spans.begin(), spans.end());
  double reached = mesh.domain_low[along];
  for (const auto& [first, last] : spans) {
    if (first != reached || last <= first) {
      return false;
    }
    reached = last;
  }
  return reached == mesh.domain_high[along];
}

void ExpectTiling(const Mesh& mesh, int face, std::span<const uint32_t> facets) {
  switch (mesh.dimension) {
    case 2:
      EXPECT_TRUE(IsChain(mesh, face, facets));
      break;
    case 3:
      EXPECT_EQ(ExcessArea<3>(mesh, face, facets), 0);
      break;
    case 4:
      EXPECT_EQ(ExcessArea<4>(mesh, face, facets), 0);
      break;
    case 5:
      EXPECT_EQ(ExcessArea<5>(mesh, face, facets), 0);
      break;
    default:
      EXPECT_EQ(ExcessArea<6>(mesh, face, facets), 0);
  }
}

// Guarantees (1) to (3) of FindBoxBoundary, and the tags of vertices.
void ExpectBoundary(const Mesh& mesh) {
  const int d = mesh.dimension;
  EXPECT_TRUE(Validate(mesh).ok()) << Validate(mesh);
  ASSERT_EQ(mesh.boundary.size(), 2 * static_cast<size_t>(d));
  const std::vector<int32_t> tags = TagsOf(mesh);
  ASSERT_EQ(tags.size(), mesh.facet_count());
  std::set<std::vector<uint32_t>> given;
  std::map<std::vector<uint32_t>, std::pair<int, int>> ridges;  // how many facets have it, and their orientations' sum
  std::vector<int32_t> vertex_tags(mesh.vertex_count(), kNoTag);
  size_t first = 0;
  for (int face = 0; face < 2 * d; ++face) {
    SCOPED_TRACE(FaceName(face));
    const BoundaryPart& part = mesh.boundary[face];
    EXPECT_EQ(part.tag, face + 1);
    EXPECT_EQ(part.name, FaceName(face));
    const auto facets = std::span(mesh.facets).subspan(first * d, part.facets * d);
    first += part.facets;
    const double bound = face % 2 == 0 ? mesh.domain_low[face / 2] : mesh.domain_high[face / 2];
    for (size_t at = 0; at < facets.size(); at += d) {
      EXPECT_TRUE(given.insert(Sorted({&facets[at], &facets[at] + d}).first).second) << "a facet twice";
      for (int k = 0; k < d; ++k) {
        EXPECT_EQ(mesh.points[size_t{facets[at + k]} * d + face / 2], bound);
        int32_t& tag = vertex_tags[facets[at + k]];
        tag = tag == kNoTag ? part.tag : std::min(tag, part.tag);
        const auto [ridge, is_odd] = Sorted(Without(&facets[at], d, k));
        ++ridges[ridge].first;
        ridges[ridge].second += is_odd == (k % 2 == 1) ? 1 : -1;
      }
    }
    ExpectTiling(mesh, face, facets);
  }
  EXPECT_EQ(given, FacetsOfOneSimplex(mesh));
  for (const auto& [ridge, shared] : ridges) {
    EXPECT_EQ(shared, std::pair(2, 0)) << "ridge of vertex " << ridge[0];
  }
  EXPECT_EQ(std::vector(mesh.vertex_tags.begin(), mesh.vertex_tags.end()), vertex_tags);
  EXPECT_THAT(mesh.regions, ElementsAre(Region{.id = 1, .name = "domain"}));
  EXPECT_TRUE(mesh.simplex_regions.empty());
}

// Expects vertex_origins as input_vertex and the coordinates alone give them; repairs count as Steiner vertices.
void ExpectOrigins(const Mesh& mesh) {
  const int d = mesh.dimension;
  ASSERT_EQ(mesh.vertex_origins.size(), mesh.vertex_count());
  std::map<uint32_t, uint32_t> first_input;
  for (uint32_t i = 0; i < mesh.input_vertex.size(); ++i) {
    first_input.emplace(mesh.input_vertex[i], i);
  }
  for (uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    const double* p = &mesh.points[size_t{v} * d];
    bool is_corner = true;
    for (int k = 0; k < d; ++k) {
      is_corner = is_corner && (p[k] == mesh.domain_low[k] || p[k] == mesh.domain_high[k]);
    }
    const uint32_t origin = mesh.vertex_origins[v];
    if (const auto input = first_input.find(v); input != first_input.end()) {
      EXPECT_EQ(origin, input->second) << v;
    } else if (is_corner) {
      EXPECT_EQ(origin, kCornerOrigin) << v;
    } else {
      EXPECT_TRUE(origin == kSteinerOrigin || origin == kRepairOrigin) << v << ": " << origin;
    }
  }
}

Mesh MeshOf(const MeshParameters& parameters, std::span<const double> points) {
  RunContext context;
  absl::StatusOr<Mesh> mesh = MeshPoints(parameters, points, context);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : Mesh();
}

class BoundaryOf : public ::testing::TestWithParam<std::tuple<int, std::string_view>> {};

TEST_P(BoundaryOf, TilesEachFaceOnce) {
  const auto [dimension, kind] = GetParam();
  const size_t points = dimension == 2 ? 400 : dimension == 3 ? 150 : dimension == 4 ? 30 : 4;
  const std::vector<double> cloud = test::MakeCloud(kind, dimension, points);
  const Mesh mesh = MeshOf(test::InUnitBox(dimension), cloud);
  ExpectBoundary(mesh);
  ExpectOrigins(mesh);
}

std::vector<std::tuple<int, std::string_view>> Cases() {
  std::vector<std::tuple<int, std::string_view>> cases;
  for (int dimension = 2; dimension <= 6; ++dimension) {
    for (const std::string_view kind : test::SomeKinds(dimension)) {
      cases.emplace_back(dimension, kind);
    }
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Clouds, BoundaryOf, ::testing::ValuesIn(Cases()), [](const auto& test) {
  return test::CloudName(std::get<1>(test.param), std::get<0>(test.param));
});

// Boxes as thin, as small and as far away as doubles serve; coordinates of both zeros.
TEST(Boundary, OfUnusualBoxes) {
  MeshParameters parameters;
  parameters.dimension = 2;
  for (const auto& [low, high] : std::vector<std::pair<std::vector<double>, std::vector<double>>>{
           {{-0.0, 0}, {1, 0x1p-6}}, {{0, 0}, {0x1p-300, 0x1p-300}}, {{0x1p30, -0x1p30}, {0x1p30 + 1, 1 - 0x1p30}}}) {
    parameters.domain_low = low;
    parameters.domain_high = high;
    ExpectBoundary(MeshOf(parameters, {}));
    ExpectBoundary(MeshOf(parameters, low));
  }
  parameters = {};
  parameters.dimension = 3;
  parameters.margin = 0;  // the extreme points lie on the faces
  ExpectBoundary(MeshOf(parameters, test::MakeCloud("uniform", 3, 200)));
  ExpectBoundary(MeshOf(parameters, std::vector<double>{0, 0, 0, 1, 1, 1, 1, 0, 0, 0.5, 0.5, 0, 0.5, 0, 0}));
}

// After an update the facets are those of a mesh that is made whole.
TEST(Boundary, FollowsAnEdit) {
  for (const int dimension : {2, 3}) {
    SCOPED_TRACE(dimension);
    MeshParameters parameters = test::InUnitBox(dimension);
    parameters.min_dihedral = 0;
    RunContext context;
    auto mesher = Mesher::Create(parameters, test::MakeCloud("uniform", dimension, 50), context);
    ASSERT_TRUE(mesher.ok() && (*mesher)->Refine(parameters, context).ok());
    absl::StatusOr<Mesh> mesh = (*mesher)->Extract(1, context);
    ASSERT_TRUE(mesh.ok());
    const Mesh before = *mesh;
    // Inside, on a face, and on an edge of it.
    std::vector<double> added(3 * dimension, 0.3125);
    added[dimension] = 0;
    added[2 * dimension] = added[2 * dimension + 1] = 1;
    ASSERT_TRUE((*mesher)->AddPoints(added, context).ok());
    ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
    ASSERT_TRUE((*mesher)->Update(*mesh, 1, context).ok());
    EXPECT_GT(mesh->facet_count(), before.facet_count());
    ExpectBoundary(*mesh);
    ExpectOrigins(*mesh);
    const absl::StatusOr<Mesh> whole = (*mesher)->Extract(1, context);
    ASSERT_TRUE(whole.ok());
    EXPECT_EQ(mesh->boundary, whole->boundary);
    EXPECT_EQ(mesh->vertex_origins, whole->vertex_origins);
    EXPECT_EQ(mesh->vertex_tags, whole->vertex_tags);
  }
}

TEST(Boundary, RepairedVerticesAreTold) {
  MeshParameters parameters = test::InUnitBox(3);
  parameters.min_dihedral = 15;
  const std::vector<double> cloud = test::MakeCloud("uniform", 3, 3000);
  const Mesh mesh = MeshOf(parameters, cloud);
  ASSERT_GT(mesh.statistics.sliver_vertices, 0u);
  EXPECT_EQ(std::count(mesh.vertex_origins.begin(), mesh.vertex_origins.end(), kRepairOrigin),
            mesh.statistics.sliver_vertices);
  ExpectOrigins(mesh);
  EXPECT_TRUE(Validate(mesh).ok()) << Validate(mesh);
}

TEST(Boundary, OriginsOfEqualPointsAndCorners) {
  const Mesh mesh = MeshOf(test::InUnitBox(2), std::vector<double>{0.5, 0.5, 1, 1, 0.5, 0.5, 0.25, 0.5});
  EXPECT_THAT(std::vector(mesh.vertex_origins.begin(), mesh.vertex_origins.begin() + 6),
              ElementsAre(0, 1, 3, kCornerOrigin, kCornerOrigin, kCornerOrigin));
  EXPECT_THAT(std::vector(mesh.vertex_tags.begin(), mesh.vertex_tags.begin() + 3), ElementsAre(kNoTag, 2, kNoTag));
}

// Large enough for several blocks of rows.
TEST(Boundary, DoesNotDependOnThreads) {
  const Mesh mesh = MeshOf(test::InUnitBox(2), test::MakeCloud("uniform", 2, 40'000));
  ASSERT_GT(mesh.simplex_count(), 100'000u);
  RunContext context;
  for (const int threads : {1, 3}) {
    const absl::StatusOr<BoxBoundary> found =
        FindBoxBoundary({mesh.domain_low, mesh.domain_high, mesh.points, mesh.simplices}, threads, context);
    ASSERT_TRUE(found.ok()) << found.status();
    EXPECT_EQ(found->facets, mesh.facets);
    EXPECT_EQ(found->parts, mesh.boundary);
    EXPECT_EQ(found->vertex_tags, mesh.vertex_tags);
  }
}

TEST(Boundary, StopsWhenItIsCancelled) {
  const Mesh mesh = MeshOf(test::InUnitBox(2), {});
  RunContext context;
  context.Cancel();
  EXPECT_TRUE(absl::IsCancelled(
      FindBoxBoundary({mesh.domain_low, mesh.domain_high, mesh.points, mesh.simplices}, 1, context).status()));
}

// Planted faults, and the errors that name them.
TEST(Boundary, PlantedFaultsAreFound) {
  for (const int dimension : {2, 3, 4}) {
    SCOPED_TRACE(dimension);
    const Mesh mesh = MeshOf(test::InUnitBox(dimension), {});
    const auto check = [&](std::vector<uint32_t> facets, std::vector<int32_t> tags) {
      return std::string(
          ValidateBoundary({mesh.dimension, mesh.points, mesh.simplices}, {facets, tags, NamesOf(mesh)}).message());
    };
    const std::vector<uint32_t> facets(mesh.facets.begin(), mesh.facets.end());
    const std::vector<int32_t> tags = TagsOf(mesh);
    EXPECT_EQ(check(facets, tags), "");
    std::vector<int32_t> wrong_tags = tags;
    wrong_tags[0] = 2;
    EXPECT_THAT(check(facets, wrong_tags), HasSubstr("lies on xmin, but has the tag 2"));
    wrong_tags[0] = 77;
    EXPECT_THAT(check(facets, wrong_tags), HasSubstr("lies on xmin, but has the tag 77"));
    wrong_tags[0] = 0;
    EXPECT_THAT(check(facets, wrong_tags), HasSubstr("has the tag 0"));
    EXPECT_THAT(check({facets.begin() + dimension, facets.end()}, {tags.begin() + 1, tags.end()}),
                HasSubstr("lies on xmin, but is no boundary facet"));
    std::vector<uint32_t> twice = facets;
    twice.insert(twice.end(), facets.begin(), facets.begin() + dimension);
    std::vector<int32_t> tags_of_twice = tags;
    tags_of_twice.push_back(tags[0]);
    EXPECT_THAT(check(twice, tags_of_twice), HasSubstr("is there twice"));
    std::vector<uint32_t> inward = facets;
    std::swap(inward[0], inward[1]);
    EXPECT_THAT(check(inward, tags), HasSubstr("is oriented inward"));
    std::vector<uint32_t> beyond = facets;
    beyond[1] = static_cast<uint32_t>(mesh.vertex_count());
    EXPECT_THAT(check(beyond, tags), HasSubstr("has vertex"));
    EXPECT_THAT(check(facets, {tags.begin() + 1, tags.end()}), HasSubstr("for each tag"));
  }
  // The diagonal of a square is a facet of two triangles.
  const std::vector<double> square = {0, 0, 1, 0, 1, 1, 0, 1};
  const std::vector<uint32_t> triangles = {0, 1, 2, 0, 2, 3};
  const std::vector<uint32_t> edges = {0, 1, 1, 2, 2, 3, 3, 0, 0, 2};
  const std::vector<int32_t> tags = {3, 2, 4, 1, 5};
  EXPECT_THAT(std::string(ValidateBoundary({2, square, triangles}, {edges, tags}).message()),
              HasSubstr("boundary facet 4 (0 2) is no facet of one simplex on a face of the box"));
}

}  // namespace
}  // namespace wellspace::core
