// Points that are added to the mesh of a domain in the plane, held against exact tests of the whole mesh.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "core/geometry/exact_measure.h"
#include "core/meshers/mesher.h"
#include "core/validate/validate_domain.h"
#include "tests/core/domain_check.h"
#include "tests/core/domain_input.h"
#include "tests/support/canonical.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using test::At;
using Input = test::DomainInput;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// In a box of 3 by 3 at the origin two vertices are to be this far apart.
constexpr double kLeastSeparation = 0x1p-43;

// A square of side 2 with a square hole that stands on its corner, and a segment inside with free ends.
Input Plate() {
  Input input = Input().Ring({{0, 0}, {2, 0}, {2, 2}, {0, 2}}, 1).Ring({{1, 0.5}, {1.5, 1}, {1, 1.5}, {0.5, 1}}, 2);
  input.points.insert(input.points.end(), {0.25, 0.25, 0.5, 0.375});
  input.ends.insert(input.ends.end(), {8, 9});
  input.markers.push_back(3);
  input.seeds = {{.at = {1, 1}, .is_hole = true}};
  return input;
}

bool IsInTriangle(const Mesh& mesh, const Point<2>& p) {
  for (size_t t = 0; t < mesh.simplex_count(); ++t) {
    bool is_inside = true;
    for (int k = 0; k < 3 && is_inside; ++k) {
      is_inside =
          Orientation<2>({At(mesh, mesh.simplices[3 * t + k]), At(mesh, mesh.simplices[3 * t + (k + 1) % 3]), p})
              .sign != Sign::kNegative;
    }
    if (is_inside) {
      return true;
    }
  }
  return false;
}

class DomainEditingTest : public test::SeededTest {
 protected:
  DomainEditingTest() : SeededTest(0xed) {}

  Mesh Refined(const Input& input, Mesher& mesher) {
    EXPECT_EQ(mesher.Refine(input.parameters, context_), absl::OkStatus());
    absl::StatusOr<Mesh> mesh = mesher.Extract(1, context_);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return *std::move(mesh);
  }

  // Checks the mesh by itself and against its domain, and that inputs are where they were given.
  static void ExpectValid(const Input& input, const Mesh& mesh, const std::vector<double>& given) {
    const MeshView view{2, mesh.points, mesh.simplices};
    const auto report = ValidateDomainMesh(view, mesh.facets, DefaultRho(2), RunContext());
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_EQ(report->exempt, mesh.statistics.domain->exempt_simplices);
    const test::DomainMesh copy(mesh);
    const DomainView domain{.points = input.points, .features = input.features()};
    EXPECT_EQ(ValidateConformity(view, copy.Parts(), domain, 2 * kLeastSeparation, RunContext()), absl::OkStatus());
    test::ExpectPointsKept(given, mesh);
  }

  static std::vector<double> Joined(std::vector<double> points, const std::vector<double>& more) {
    points.insert(points.end(), more.begin(), more.end());
    return points;
  }

  RunContext context_;
};

TEST_F(DomainEditingTest, PointsInsideOnSegmentsAndAtVerticesBecomeVertices) {
  const Input input = Plate();
  const auto mesher = input.Create();
  const Mesh before = Refined(input, *mesher);
  const auto count = static_cast<uint32_t>(before.vertex_count());
  const Point<2> steiner = At(before, count - 1);
  // Inside, on a side, there again, on a side of the hole, on the segment inside, its end, a Steiner vertex.
  const std::vector<double> added = {
      1.75, 0.3, 0.7, 0, 0.7, 0, 1.1, 0.6, 0.25 + 0.25 / 3, 0.25 + 0.125 / 3, 0.25, 0.25, steiner[0], steiner[1]};
  const auto vertices = mesher->AddPoints(added, context_);
  ASSERT_TRUE(vertices.ok()) << vertices.status();
  EXPECT_EQ((*vertices)[1], (*vertices)[2]);
  EXPECT_EQ((*vertices)[5], 8u);
  EXPECT_EQ((*vertices)[6], count - 1);
  EXPECT_EQ(mesher->vertex_count(), count + 4);
  EXPECT_EQ(mesher->Extract(1, context_).status().code(), absl::StatusCode::kFailedPrecondition);

  Mesh mesh = before;
  ASSERT_EQ(mesher->Refine(input.parameters, context_), absl::OkStatus());
  ASSERT_EQ(mesher->Update(mesh, 1, context_), absl::OkStatus());
  ExpectValid(input, mesh, Joined(input.points, added));
  EXPECT_TRUE(std::equal(before.points.begin(), before.points.end(), mesh.points.begin())) << "vertices stay";
  std::vector<int32_t> tags;
  std::vector<uint32_t> origins;
  for (const uint32_t v : *vertices) {
    tags.push_back(mesh.vertex_tags[v]);
    origins.push_back(mesh.vertex_origins[v]);
  }
  EXPECT_THAT(tags, ElementsAre(kNoTag, 1, 1, 2, 3, 3, before.vertex_tags[count - 1]));
  EXPECT_THAT(origins, ElementsAre(10, 11, 11, 13, 14, 8, 16));
  EXPECT_EQ(mesh.statistics.input_points, 17u);
  EXPECT_EQ(mesh.statistics.duplicates, 3u);
  EXPECT_TRUE(test::Canonical(mesh) == test::Canonical(*mesher->Extract(1, context_)));
}

TEST_F(DomainEditingTest, PointsThatAreNotMeshedAreRefusedAndNothingIsAdded) {
  const Input input = Plate();
  const auto mesher = input.Create();
  const Mesh before = Refined(input, *mesher);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  struct Case {
    std::vector<double> points;
    std::vector<std::string> message;
  };
  for (const Case& c :
       {Case{{0.1, 0.2, 1.125, 1}, {"points[1] = (1.125, 1)", "not in the domain that is meshed"}},
        Case{{0.1, 0.2, 3.5, 1}, {"points[1] = (3.5, 1)", "not in the domain that is meshed"}},
        Case{{0.1, -1e300, 0.1, 0.2, 1, 1},
             {"points[0] = (0.1", "not in the domain", "nor are points[2]: 2 points in all"}},
        Case{{2 + 1e-9, 1}, {"points[0]", "not in the domain that is meshed"}},
        Case{{0.1, 0.2, nan, 1}, {"points[1]", "finite"}}, Case{{0.1, 0.2, 0.5, infinity}, {"points[1]", "finite"}},
        Case{{0.1, 0.2, 0.5}, {"3 coordinates"}}}) {
    const auto added = mesher->AddPoints(c.points, context_);
    EXPECT_EQ(added.status().code(), absl::StatusCode::kInvalidArgument) << added.status();
    for (const std::string& part : c.message) {
      EXPECT_THAT(std::string(added.status().message()), HasSubstr(part));
    }
  }
  EXPECT_EQ(mesher->AddVertex(0, std::vector<double>{1, 1}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(mesher->AddVertex(4000, std::vector<double>{0.1, 0.2}).status().code(), absl::StatusCode::kOutOfRange);
  context_.Cancel();
  EXPECT_EQ(mesher->AddPoints(std::vector<double>{0.1, 0.2}, context_).status().code(), absl::StatusCode::kCancelled);
  RunContext context;
  EXPECT_EQ(mesher->vertex_count(), before.vertex_count());
  EXPECT_TRUE(mesher->Extract(1, context).ok()) << "it is refined still";
}

TEST_F(DomainEditingTest, PointsAreOnASegmentOrApartFromIt) {
  const Input input = Plate();
  for (const double sign : {1.0, -1.0}) {
    const auto mesher = input.Create();
    const Mesh before = Refined(input, *mesher);
    // Beside the lower side, from inside and outside; beside the segment inside, from both sides.
    for (const Point<2>& from : {Point<2>{0.3, 0}, Point<2>{0.375, 0.3125}}) {
      const auto at = [&](double away) { return std::vector<double>{from[0], from[1] + sign * away}; };
      const auto near = mesher->AddPoints(at(0.5 * kLeastSeparation), context_);
      EXPECT_EQ(near.status().code(), absl::StatusCode::kInvalidArgument) << near.status();
      const auto on = mesher->AddPoints(at(0.2 * kLeastSeparation), context_);
      ASSERT_TRUE(on.ok()) << on.status();
      const auto again = mesher->AddPoints(at(0.7 * kLeastSeparation), context_);
      EXPECT_THAT(std::string(again.status().message()), HasSubstr("points[0]"));
    }
    const Mesh mesh = Refined(input, *mesher);
    EXPECT_EQ(mesh.vertex_tags[before.vertex_count()], 1);
    EXPECT_EQ(mesh.vertex_tags[before.vertex_count() + 1], 3);
    EXPECT_LE(mesh.domain_low[1], At(mesh, static_cast<uint32_t>(before.vertex_count()))[1]);
  }
  const auto mesher = input.Create();
  const auto to_segment = mesher->AddPoints(std::vector<double>{0.1, 0.1, 0.3, 0.5 * kLeastSeparation}, context_);
  EXPECT_THAT(std::string(to_segment.status().message()),
              AllOf(HasSubstr("points[1] at (0.29"), HasSubstr("from segments[0] and not on it"),
                    HasSubstr("too close"), HasSubstr("move it away, or onto the segment"), Not(HasSubstr("merge"))));
  const auto to_vertex = mesher->AddPoints(std::vector<double>{0.25, 0.25 + 0.5 * kLeastSeparation}, context_);
  EXPECT_THAT(std::string(to_vertex.status().message()), AllOf(HasSubstr("vertex 8"), HasSubstr("too close")));
  const auto together = mesher->AddPoints(std::vector<double>{0.1, 0.1, 0.1, 0.1 + 0.5 * kLeastSeparation}, context_);
  EXPECT_THAT(std::string(together.status().message()), HasSubstr("points[0]"));
  EXPECT_EQ(mesher->vertex_count(), 10u);
}

TEST_F(DomainEditingTest, NeitherOrderNorHintsNorThreadsMatter) {
  const Input input = Plate();
  std::vector<double> added = {0.7, 0, 0.25 + 0.25 / 3, 0.25 + 0.125 / 3, 1.1, 0.6, 2, 1.37};
  for (int i = 0; i < 40; ++i) {
    added.insert(added.end(), {0.05 + 0.0105 * i, 1.9 - 0.0173 * i});
  }
  std::vector<test::CanonicalMesh> meshes;
  std::vector<std::vector<double>> points;
  for (int run = 0; run < 4; ++run) {
    Input own = input;
    own.parameters.threads = 1 + run % 2;
    const auto mesher = own.Create();
    Refined(own, *mesher);
    const std::vector<double> order = test::Shuffled(added, 2, run);
    std::vector<uint32_t> near;
    for (size_t i = 0; i < order.size() / 2 && run > 1; ++i) {
      near.push_back(random_.Below(mesher->vertex_count()));
    }
    const auto vertices = mesher->AddPointsNear(order, near, context_);
    ASSERT_TRUE(vertices.ok()) << vertices.status();
    const Mesh mesh = Refined(own, *mesher);
    ExpectValid(own, mesh, Joined(own.points, order));
    meshes.push_back(test::Canonical(mesh));
    points.emplace_back(mesh.points.begin(), mesh.points.end());
  }
  for (int run = 1; run < 4; ++run) {
    EXPECT_TRUE(meshes[run] == meshes[0]) << run;
    EXPECT_EQ(points[run], points[0]) << "numbers of vertices, too: a batch is sorted";
  }
}

TEST_F(DomainEditingTest, OnePointIsTheSameAsABatchOfIt) {
  const Input input = Plate();
  for (const std::vector<double>& point : {std::vector<double>{0.7, 0}, std::vector<double>{0.7, 0.1}}) {
    std::vector<test::CanonicalMesh> meshes;
    for (const bool is_batch : {false, true}) {
      const auto mesher = input.Create();
      Refined(input, *mesher);
      if (is_batch) {
        ASSERT_TRUE(mesher->AddPoints(point, context_).ok());
      } else {
        const auto vertex = mesher->AddVertex(3, point);
        ASSERT_TRUE(vertex.ok()) << vertex.status();
        EXPECT_EQ(*vertex, mesher->vertex_count() - 1);
        EXPECT_EQ(*mesher->AddVertex(*vertex, point), *vertex) << "it is there already";
      }
      meshes.push_back(test::Canonical(Refined(input, *mesher)));
    }
    EXPECT_TRUE(meshes[0] == meshes[1]);
  }
}

TEST_F(DomainEditingTest, PointsMayBeAddedBeforeTheFirstRefinement) {
  const Input input = Plate();
  const auto mesher = input.Create();
  const std::vector<double> added = {1.2, 0.69, 1.2, 0.71, 0.4, 1.2, 0.99, 2, 1.99, 0.01};
  const auto refused = mesher->AddPoints(added, context_);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("points[1]")) << "the one in the hole";
  const std::vector<double> good = {1.2, 0.69, 0.4, 1.2, 0.99, 2, 1.99, 0.01};
  const auto vertices = mesher->AddPoints(good, context_);
  ASSERT_TRUE(vertices.ok()) << vertices.status();
  EXPECT_THAT(*vertices, ::testing::UnorderedElementsAre(10, 11, 12, 13));
  ExpectValid(input, Refined(input, *mesher), Joined(input.points, good));
}

TEST_F(DomainEditingTest, PointsMayBeAddedToAMeshThatIsNotDone) {
  Input input = Input().Circle({0, 0}, 1, 50).Circle({0.3, 0}, 0.1, 20);
  input.parameters.max_vertices = 90;
  const auto mesher = input.Create();
  const std::vector<double> added = {0.3, 0.05, 0.5, 0.5, 0.4 - 1e-3, 0};
  EXPECT_EQ(mesher->Refine(input.parameters, context_).code(), absl::StatusCode::kResourceExhausted);
  const auto vertices = mesher->AddPoints(added, context_);
  ASSERT_TRUE(vertices.ok()) << vertices.status();
  EXPECT_THAT(*vertices, ::testing::UnorderedElementsAre(90, 91, 92));
  EXPECT_THAT(std::string(mesher->Refine(input.parameters, context_).message()), HasSubstr("max_vertices = 90"));
  input.parameters.max_vertices = 0;
  ExpectValid(input, Refined(input, *mesher), Joined(input.points, added));
}

TEST_F(DomainEditingTest, TrianglesKeepTheRegionsOfTheirFaces) {
  Input input = Input().Ring({{0, 0}, {2, 0}, {2, 1}, {0, 1}});
  input.points.insert(input.points.end(), {1, 0, 1, 1});
  input.ends.insert(input.ends.end(), {4, 5});
  input.markers.push_back(3);
  input.seeds = {{.at = {0.5, 0.5}, .region = 10}, {.at = {1.5, 0.5}, .region = 20}};
  const auto mesher = input.Create();
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 20; ++i) {
      const double x = round == 0 ? 2 * random_.Unit() : 1 + std::ldexp(random_.Unit() - 0.5, -3 * i / 2);
      ASSERT_TRUE(mesher->AddVertex(0, std::vector<double>{x, random_.Unit()}).ok());
    }
    const Mesh mesh = Refined(input, *mesher);
    ASSERT_EQ(mesh.simplex_regions.size(), mesh.simplex_count());
    for (size_t t = 0; t < mesh.simplex_count(); ++t) {
      double x = 0;
      for (int k = 0; k < 3; ++k) {
        x += (At(mesh, mesh.simplices[3 * t + k])[0] - 1) / 3;
      }
      EXPECT_EQ(mesh.simplex_regions[t], x < 0 ? 10 : 20) << t;
    }
  }
}

TEST_F(DomainEditingTest, EditsAreLocal) {
  for (const int corners : {100, 10'000}) {
    const Input input = Input().Circle({0, 0}, 1, corners);
    const auto mesher = input.Create();
    const uint64_t cells = Refined(input, *mesher).statistics.cells_computed;
    const double angle = 2 * std::numbers::pi / corners;
    // Inside, and on a side.
    ASSERT_TRUE(
        mesher->AddPoints(std::vector<double>{0.1, 0.9, 0.5 * (1 + std::cos(angle)), 0.5 * std::sin(angle)}, context_)
            .ok());
    EXPECT_LT(Refined(input, *mesher).statistics.cells_computed - cells, 1000u) << corners;
  }
}

TEST_F(DomainEditingTest, PointsAtSmallAnglesEnd) {
  for (const double degrees : {50.0, 20.0, 3.0, 0.3}) {
    const double angle = degrees * std::numbers::pi / 180;
    const Point<2> leg = {std::cos(angle), std::sin(angle)};
    const Input input = Input().Ring({{0, 0}, {3, 0}, {2 * leg[0], 2 * leg[1]}});
    const auto mesher = input.Create();
    Refined(input, *mesher);
    std::vector<double> added;
    for (const double distance : {0.9, 0.47, 0.11, 0.1, 1e-3, 1.1e-6}) {
      added.insert(added.end(), {distance, 0, 0.97 * distance * leg[0], 0.97 * distance * leg[1]});
      added.insert(added.end(), {0.93 * distance * std::cos(0.4 * angle), 0.93 * distance * std::sin(0.4 * angle)});
    }
    const auto vertices = mesher->AddPoints(added, context_);
    ASSERT_TRUE(vertices.ok()) << vertices.status();
    const Mesh mesh = Refined(input, *mesher);
    ExpectValid(input, mesh, Joined(input.points, added));
    EXPECT_LT(mesh.vertex_count(), 6000u) << degrees;
    EXPECT_EQ(mesh.vertex_tags[vertices->front()], mesh.vertex_tags[0]) << "it is on the leg";
  }
}

TEST_F(DomainEditingTest, OnlyTheLastMeshCanBeUpdated) {
  const Input input = Plate();
  const auto mesher = input.Create();
  Mesh mesh = Refined(input, *mesher);
  Mesh other = mesh;
  other.simplices.resize(other.simplices.size() - 3);
  EXPECT_EQ(mesher->Update(other, 1, context_).code(), absl::StatusCode::kInvalidArgument);
  ASSERT_TRUE(mesher->AddVertex(0, std::vector<double>{0.1, 0.2}).ok());
  EXPECT_EQ(mesher->Update(mesh, 1, context_).code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(mesher->Estimate(input.parameters, context_).status().code(), absl::StatusCode::kFailedPrecondition);
  MeshParameters wrong = input.parameters;
  wrong.dimension = 3;
  EXPECT_THAT(std::string(mesher->Refine(wrong, context_).message()), HasSubstr("dimension: 3"));
}

TEST_F(DomainEditingTest, NegativeZerosKeepTheirBits) {
  const Input input = Input().Ring({{-1, -1}, {1, -1}, {1, 1}, {-0.0, 1}, {-1, 1}});
  const auto mesher = input.Create();
  Refined(input, *mesher);
  const auto vertices = mesher->AddPoints(std::vector<double>{-0.0, 0.1}, context_);
  ASSERT_TRUE(vertices.ok()) << vertices.status();
  const Mesh mesh = Refined(input, *mesher);
  EXPECT_TRUE(std::signbit(At(mesh, 3)[0]));
  EXPECT_TRUE(std::signbit(At(mesh, vertices->front())[0]));
}

// All that Refine and Extract do is in the times, the triangles that Refine makes too.
TEST_F(DomainEditingTest, TimesAddUp) {
  const Input input = Input().Circle({0, 0}, 1, 20'000);
  const auto mesher = input.Create();
  double tree = 0;
  absl::Duration passed;
  for (int round = 0; round < 2; ++round) {
    RunContext context;
    const absl::Time start = absl::Now();
    ASSERT_EQ(mesher->Refine(input.parameters, context), absl::OkStatus());
    const auto mesh = mesher->Extract(1, context);
    passed += absl::Now() - start;
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    const MeshStatistics& statistics = mesh->statistics;
    tree = statistics.tree_seconds;
    EXPECT_GT(statistics.refinement_seconds, 0);
    EXPECT_GT(statistics.simplices_seconds, 0);
    EXPECT_NEAR(statistics.total_seconds - tree, absl::ToDoubleSeconds(passed), 0.1 * absl::ToDoubleSeconds(passed));
    ASSERT_TRUE(mesher->AddVertex(0, std::vector<double>{0.01, 0.02}).ok());
  }
}

// Random segments on a grid, where many meet in acute angles, and points of all kinds in and on their faces.
TEST_F(DomainEditingTest, RandomPointsInRandomDomains) {
  for (int run = 0; run < 40; ++run) {
    Input input = test::SegmentsOnASmallGrid(random_);
    const size_t count = input.ends.size() / 2;
    const auto mesher = input.Create();
    std::vector<double> given = input.points;
    Mesh before;
    for (int round = 0; round < 3; ++round) {
      for (int i = 0; i < 12; ++i) {
        const size_t s = random_.Below(count);
        const double t = random_.Below(2) == 0 ? random_.Unit() : std::pow(10, -9 * random_.Unit());
        const double away = random_.Below(2) == 0 ? 0 : std::pow(10, 1 - 15 * random_.Unit());
        const Point<2> a = PointAt<2>(input.points, 2 * s);
        const Point<2> b = PointAt<2>(input.points, 2 * s + 1);
        const std::vector<double> p = {(1 - t) * a[0] + t * b[0] + away, (1 - t) * a[1] + t * b[1] - 0.3 * away};
        const auto vertex = mesher->AddVertex(random_.Below(mesher->vertex_count()), p);
        if (vertex.ok()) {
          given.insert(given.end(), p.begin(), p.end());
        } else if (p[0] <= 9 && p[1] >= -1) {
          EXPECT_THAT(std::string(vertex.status().message()), HasSubstr("too close"));
        }
      }
      input.parameters.threads = 1 + round % 2;
      const Mesh mesh = Refined(input, *mesher);
      ExpectValid(input, mesh, given);
      EXPECT_TRUE(std::equal(before.points.begin(), before.points.end(), mesh.points.begin())) << "vertices stay";
      before = mesh;
    }
  }
}

// The points that are meshed are compared with the triangles that there are.
TEST_F(DomainEditingTest, RandomPointsAreMeshedWhereTrianglesAre) {
  Input input = Input().Circle({0, 0}, 1, 60).Circle({0.3, 0}, 0.3, 23);
  input.seeds = {{.at = {0.3, 0}, .is_hole = true}};
  for (size_t i = 0; i < input.points.size(); i += 6) {  // notches
    input.points[i] *= 0.6;
    input.points[i + 1] *= 0.6;
  }
  const auto mesher = input.Create();
  const Mesh before = Refined(input, *mesher);
  std::vector<double> given = input.points;
  int added = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::vector<double> p = {2 * random_.Unit() - 1, 2 * random_.Unit() - 1};
    const auto vertex = mesher->AddVertex(0, p);
    EXPECT_EQ(vertex.ok(), IsInTriangle(before, {p[0], p[1]})) << vertex.status();
    if (vertex.ok()) {
      given.insert(given.end(), p.begin(), p.end());
      ++added;
    }
  }
  EXPECT_GT(added, 200);
  EXPECT_LT(added, 800);
  ExpectValid(input, Refined(input, *mesher), given);
}

TEST_F(DomainEditingTest, WithAMergeDistancePointsBecomeVerticesThatAreNear) {
  Input input = Plate();
  input.parameters.merge_distance = 0.01;
  input.points.insert(input.points.end(), {2.001, 2.001, 0.25, 0.2501});  // a corner, and the end of a segment
  const auto mesher = input.Create();
  const Mesh before = Refined(input, *mesher);
  EXPECT_EQ(before.statistics.merged_points, 2u);
  EXPECT_EQ(before.input_vertex[10], before.input_vertex[2]);
  EXPECT_EQ(before.input_vertex[11], before.input_vertex[8]);
  // Near to a corner from inside, near to a segment's end on either side, and one that is near to none.
  const std::vector<double> added = {1.999, 1.999, 0.251, 0.251, 0.249, 0.25, 1.7, 1.8};
  const auto vertices = mesher->AddPoints(added, context_);
  ASSERT_TRUE(vertices.ok()) << vertices.status();
  EXPECT_EQ((*vertices)[0], before.input_vertex[2]);
  EXPECT_EQ((*vertices)[1], before.input_vertex[8]);
  EXPECT_EQ((*vertices)[2], before.input_vertex[8]);
  EXPECT_EQ((*vertices)[3], before.vertex_count());
  const Mesh after = Refined(input, *mesher);
  EXPECT_EQ(after.statistics.merged_points, 5u);
  EXPECT_EQ(after.statistics.duplicates, 0u);
  EXPECT_EQ(after.input_vertex.size(), 16u);
}

TEST_F(DomainEditingTest, MergingDoesNotDependOnTheOrderOfPoints) {
  for (int run = 0; run < 20; ++run) {
    Input input;
    input.faces = FaceRule::kUnion;
    input.parameters.merge_distance = 0.02;
    input.crossings = CrossingRule::kSplit;
    input.snap_distance = 0.02;
    for (int ring = 0; ring < 3; ++ring) {
      const auto place = [&] { return Point<2>{random_.Unit(), random_.Unit()}; };
      input.Ring({place(), place(), place(), place()});
      input.groups.resize(input.ends.size() / 2, static_cast<uint32_t>(ring));
    }
    // The same, from the last point and the last segment to the first.
    Input turned = input;
    const auto last = static_cast<uint32_t>(input.points.size() / 2 - 1);
    for (uint32_t i = 0; i <= last; ++i) {
      turned.points[2 * i] = input.points[2 * (last - i)];
      turned.points[2 * i + 1] = input.points[2 * (last - i) + 1];
    }
    for (size_t i = 0; i < input.ends.size(); ++i) {
      turned.ends[i] = last - input.ends[input.ends.size() - 1 - i];
    }
    std::reverse(turned.groups.begin(), turned.groups.end());
    const auto one = input.Make();
    const auto two = turned.Make();
    ASSERT_EQ(one.ok(), two.ok()) << one.status() << two.status();
    if (one.ok()) {
      const auto places = [](const Mesh& mesh) {
        std::set<Point<2>> all;
        for (uint32_t v = 0; v < mesh.vertex_count(); ++v) {
          all.insert(At(mesh, v));
        }
        return all;
      };
      EXPECT_EQ(places(*one), places(*two));
      EXPECT_EQ(one->simplex_count(), two->simplex_count());
      EXPECT_EQ(one->statistics.merged_points, two->statistics.merged_points);
    }
  }
}

}  // namespace
}  // namespace wellspace::core
