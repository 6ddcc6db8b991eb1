// Domains in the plane: faces that are meshed, segments kept, and errors; seen from outside, by other means.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <set>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/run_context.h"
#include "core/geometry/exact_measure.h"
#include "core/meshers/mesher.h"
#include "core/simplex/quality.h"
#include "tests/core/domain_input.h"
#include "tests/support/canonical.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using test::At;
using test::ExpectPointsKept;
using Input = test::DomainInput;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

double AreaOf(const Mesh& mesh) {
  double area = 0;
  for (size_t t = 0; t < mesh.simplex_count(); ++t) {
    const Point<2> a = At(mesh, mesh.simplices[3 * t]);
    const Point<2> b = Difference<2>(At(mesh, mesh.simplices[3 * t + 1]), a);
    const Point<2> c = Difference<2>(At(mesh, mesh.simplices[3 * t + 2]), a);
    area += 0.5 * (b[0] * c[1] - b[1] * c[0]);
  }
  return area;
}

// Checks, by a look at all pairs, that the mesh is conforming: its triangles are Delaunay among all vertices, every
// edge has one triangle or two, and those with one are facets, as are all of the subsegments that facets tell of.
void ExpectConforming(const Mesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, int> triangles_at;
  for (size_t t = 0; t < mesh.simplex_count(); ++t) {
    Simplex<2> corners;
    for (int k = 0; k < 3; ++k) {
      const uint32_t v = mesh.simplices[3 * t + k];
      const uint32_t w = mesh.simplices[3 * t + (k + 1) % 3];
      corners[k] = At(mesh, v);
      ++triangles_at[std::minmax(v, w)];
    }
    ASSERT_EQ(Orientation<2>(corners).sign, Sign::kPositive);
    for (uint32_t v = 0; v < mesh.vertex_count(); ++v) {
      ASSERT_NE(InSphere<2>(corners, At(mesh, v)).sign, Sign::kPositive) << "triangle " << t << ", vertex " << v;
    }
  }
  std::set<std::pair<uint32_t, uint32_t>> facets;
  for (size_t f = 0; f < mesh.facet_count(); ++f) {
    facets.insert(std::minmax(mesh.facets[2 * f], mesh.facets[2 * f + 1]));
  }
  EXPECT_EQ(facets.size(), mesh.facet_count());
  for (const auto& facet : facets) {
    EXPECT_TRUE(triangles_at.contains(facet)) << facet.first << " " << facet.second;
  }
  for (const auto& [edge, count] : triangles_at) {
    EXPECT_LE(count, 2);
    EXPECT_TRUE(count == 2 || facets.contains(edge)) << edge.first << " " << edge.second;
  }
}

TEST(PlaneMesherTest, ASquareIsTwoTriangles) {
  const auto mesh = Input().Ring({{0, 0}, {1, 0}, {1, 1}, {0, 1}}).Make();
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertex_count(), 4u);
  EXPECT_EQ(mesh->simplex_count(), 2u);
  EXPECT_EQ(mesh->facet_count(), 4u);
  EXPECT_THAT(mesh->domain_high, ElementsAre(1, 1));
  ExpectConforming(*mesh);
}

// Where a size is asked for, most vertices are yet to come: few that wait do not mean that little is left.
TEST(PlaneMesherTest, ProgressFollowsTheVerticesThatTheSizeAsksFor) {
  Input input = Input().Ring({{0, 0}, {4, 0}, {4, 3}, {1, 2}});
  input.parameters.max_circumradius = 0.01;
  RunContext context;
  std::vector<Progress> seen;
  std::thread watcher([&] {
    do {
      seen.push_back(context.Snapshot());
      std::this_thread::yield();
    } while (seen.back().phase < Phase::kSimplices);
  });
  const auto mesh = MeshPoints(input.parameters, {input.points, input.features()}, context);
  watcher.join();
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(static_cast<double>(context.estimated_vertices()) / mesh->vertex_count(), 1, 0.5);
  double most = 0;
  for (const Progress& progress : seen) {
    const bool is_early = progress.vertices < mesh->vertex_count() / 2;
    most = is_early ? std::max(most, progress.fraction) : most;
  }
  EXPECT_GT(most, 0.06);
  EXPECT_LT(most, 0.45);
}

TEST(PlaneMesherTest, AHoleStaysEmptyAndItsEdgeHasAMarker) {
  Input input = Input().Circle({0, 0}, 2, 30, 5).Circle({0.5, 0}, 1, 20, 7);
  input.seeds = {{.at = {0.5, 0}, .is_hole = true}};
  const auto mesh = input.Make();
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectConforming(*mesh);
  ExpectPointsKept(input.points, *mesh);
  const double outer = 0.5 * 30 * 4 * std::sin(2 * std::numbers::pi / 30);
  const double inner = 0.5 * 20 * std::sin(2 * std::numbers::pi / 20);
  EXPECT_NEAR(AreaOf(*mesh), outer - inner, 1e-12);
  ASSERT_EQ(mesh->boundary.size(), 2u);
  EXPECT_EQ(mesh->boundary[0].tag, 5);
  EXPECT_EQ(mesh->boundary[1].name, "marker_7");
  EXPECT_EQ(mesh->boundary[0].facets + mesh->boundary[1].facets, mesh->facet_count());
  EXPECT_LE(mesh->statistics.max_radius_edge, std::numbers::sqrt2 * (1 + 1e-9));
  // The domain is on the left of every facet, whose triangle there has both ends.
  for (size_t f = 0; f < mesh->facet_count(); ++f) {
    bool is_left = false;
    for (size_t t = 0; t < mesh->simplex_count() && !is_left; ++t) {
      for (int k = 0; k < 3; ++k) {
        is_left = is_left || (mesh->simplices[3 * t + k] == mesh->facets[2 * f] &&
                              mesh->simplices[3 * t + (k + 1) % 3] == mesh->facets[2 * f + 1]);
      }
    }
    EXPECT_TRUE(is_left) << f;
  }
}

TEST(PlaneMesherTest, RegionsHaveTheirIdsAndAreas) {
  Input input = Input().Ring({{0, 0}, {2, 0}, {2, 1}, {0, 1}});
  input.points.insert(input.points.end(), {1, 0, 1, 1});
  input.ends.insert(input.ends.end(), {4, 5});
  input.markers.push_back(3);
  input.seeds = {{.at = {0.5, 0.5}, .region = 10, .max_area = 0.005}, {.at = {1.5, 0.5}, .region = 20}};
  const auto mesh = input.Make();
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectConforming(*mesh);
  ASSERT_EQ(mesh->regions.size(), 2u);
  EXPECT_EQ(mesh->regions[0].id, 10);
  ASSERT_EQ(mesh->simplex_regions.size(), mesh->simplex_count());
  for (size_t t = 0; t < mesh->simplex_count(); ++t) {
    double x = 0;
    for (int k = 0; k < 3; ++k) {
      x += At(*mesh, mesh->simplices[3 * t + k])[0] / 3;
    }
    EXPECT_EQ(mesh->simplex_regions[t], x < 1 ? 10 : 20);
    if (x < 1) {
      Mesh one = *mesh;
      one.simplices.assign(mesh->simplices.begin() + 3 * t, mesh->simplices.begin() + 3 * t + 3);
      EXPECT_LE(AreaOf(one), 0.005 * (1 + 1e-9));
    }
  }
}

TEST(PlaneMesherTest, SegmentsInTheBox) {
  Input input;
  input.faces = FaceRule::kBox;
  input.points = {0.2, 0.2, 0.8, 0.7, 0.2, 0.8, 0, 0.5};
  input.ends = {0, 1, 2, 3};
  input.parameters.domain_low = {0, 0};
  input.parameters.domain_high = {1, 1};
  const auto mesh = input.Make();
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectConforming(*mesh);
  EXPECT_NEAR(AreaOf(*mesh), 1, 1e-14);
  std::vector<std::string> names;
  for (const BoundaryPart& part : mesh->boundary) {
    names.push_back(part.name);
  }
  EXPECT_THAT(names, ElementsAre("xmin", "xmax", "ymin", "ymax", "unmarked"));
}

TEST(PlaneMesherTest, PointsOutsideHaveNoVertex) {
  Input input = Input().Ring({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
  input.points.insert(input.points.end(), {0.5, 0.5, 3, 3});
  const auto mesh = input.Make();
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_EQ(mesh->input_vertex.size(), 6u);
  EXPECT_NE(mesh->input_vertex[4], kNoOutput);
  EXPECT_EQ(mesh->input_vertex[5], kNoOutput);
  ExpectConforming(*mesh);
}

TEST(PlaneMesherTest, SmallAnglesEndAndKeepTheBound) {
  for (const double degrees : {50.0, 30.0, 10.0, 2.0, 0.3, 0.01}) {
    const double angle = degrees * std::numbers::pi / 180;
    const auto mesh = Input().Ring({{0, 0}, {3, 0}, {2 * std::cos(angle), 2 * std::sin(angle)}}).Make();
    ASSERT_TRUE(mesh.ok()) << degrees << ": " << mesh.status();
    ExpectConforming(*mesh);
    const double theta = std::min(angle, std::asin(1 / (2 * std::numbers::sqrt2)));
    const double bound = std::atan2(std::sin(theta), 2 - std::cos(theta));
    EXPECT_GE(mesh->statistics.min_angle_deg, (1 - 1e-6) * bound * 180 / std::numbers::pi) << degrees;
    EXPECT_LT(mesh->vertex_count(), 200u) << degrees;
  }
}

// Two segments with a common end, so close to each other that a vertex on one and its foot on the other round to the
// same distance from that end.
TEST(PlaneMesherTest, NeedlesThatDoublesHardlySeparateAreMeshed) {
  int meshed = 0;
  for (const double offset : {0.0, 1.0, 78.0, 1e4, 5e5}) {
    for (int gap_exponent = 2; gap_exponent <= 8; ++gap_exponent) {
      for (const double longer : {1.0, 1.001, 1.3}) {
        const double gap = std::pow(10, -gap_exponent);
        const double turn = 0.7 * gap_exponent + longer;
        const auto at = [&](double along, double across) -> Point<2> {
          return {offset + along * std::cos(turn) - across * std::sin(turn),
                  0.6 * offset + along * std::sin(turn) + across * std::cos(turn)};
        };
        if (offset * 0x1p-45 > gap && longer == 1) {
          continue;  // the far ends are too close to each other to be two points
        }
        Input input;
        input.faces = FaceRule::kBox;
        input.Segment(at(0, 0), at(1, 0)).Segment(at(0, 0), at(longer, longer * gap));
        const auto mesh = input.Make();
        ASSERT_TRUE(mesh.ok()) << offset << " " << gap << " " << longer << ": " << mesh.status();
        ExpectPointsKept(input.points, *mesh);
        EXPECT_LT(mesh->vertex_count(), 400u) << offset << " " << gap << " " << longer;
        ExpectConforming(*mesh);
        ++meshed;
      }
    }
  }
  EXPECT_EQ(meshed, 104);
}

// As they are in maps: places in degrees with six decimals, and two borders that are digitized one after the other.
TEST(PlaneMesherTest, NeedlesOfMapsAreMeshed) {
  Input needle;
  needle.faces = FaceRule::kBox;
  needle.Segment({-71.501186, 42.041924}, {-71.500424, 42.041923})
      .Segment({-71.500424, 42.041923}, {-71.501185, 42.041924});
  Input wards;
  wards.faces = FaceRule::kEvenOdd;
  wards.crossings = CrossingRule::kSplit;
  wards.Ring({{-71.501186, 42.041924}, {-71.500424, 42.041923}, {-71.500408, 42.042098}})
      .Ring({{-71.500424, 42.041923}, {-71.501185, 42.041924}, {-71.501185, 42.042055}});
  for (Input* input : {&needle, &wards}) {
    for (const double rho : {0.0, 1.0, 3.0}) {
      input->parameters.rho = rho;
      const auto mesh = input->Make();
      ASSERT_TRUE(mesh.ok()) << rho << ": " << mesh.status();
      ExpectPointsKept(input->points, *mesh);
      ExpectConforming(*mesh);
      EXPECT_GT(mesh->statistics.domain->exempt_simplices, 0u) << "those in the needle";
    }
  }
}

// Rounding is not little beside these: their centres are off by 1e-8 of their lengths.
TEST(PlaneMesherTest, VeryShortSegmentsAreNotSplitByWhatIsRounded) {
  for (int turn = 0; turn < 40; ++turn) {
    Input input;
    input.faces = FaceRule::kBox;
    const double angle = 0.157 * turn;
    const double length = 3e-9 * (1 + turn % 7);
    input.points = {0.61, 0.73, 0.61 + length * std::cos(angle), 0.73 + length * std::sin(angle)};
    input.ends = {0, 1};
    input.parameters.domain_low = {0, 0};
    input.parameters.domain_high = {1, 1};
    const auto mesh = input.Make();
    ASSERT_TRUE(mesh.ok()) << turn << ": " << mesh.status();
    EXPECT_EQ(mesh->statistics.domain->subsegments, mesh->facet_count());
    EXPECT_EQ(std::count(mesh->vertex_tags.begin(), mesh->vertex_tags.end(), 5), 2)
        << turn;  // no vertex between its ends
    EXPECT_LT(mesh->vertex_count(), 600u);
  }
}

TEST(PlaneMesherTest, TheMeshDoesNotDependOnTheOrderOfTheInput) {
  Input input = Input().Circle({0, 0}, 1, 17, 1).Ring({{-0.2, -0.1}, {0.3, 0}, {0, 0.25}}, 2);
  const auto one = input.Make();
  ASSERT_TRUE(one.ok()) << one.status();
  Input turned = input;
  const size_t count = input.points.size() / 2;
  for (size_t i = 0; i < count; ++i) {
    turned.points[2 * i] = input.points[2 * (count - 1 - i)];
    turned.points[2 * i + 1] = input.points[2 * (count - 1 - i) + 1];
  }
  for (size_t s = 0; s < input.markers.size(); ++s) {
    const size_t from = input.markers.size() - 1 - s;
    turned.ends[2 * s] = static_cast<uint32_t>(count - 1) - input.ends[2 * from + 1];
    turned.ends[2 * s + 1] = static_cast<uint32_t>(count - 1) - input.ends[2 * from];
    turned.markers[s] = input.markers[from];
  }
  const auto two = turned.Make();
  ASSERT_TRUE(two.ok()) << two.status();
  const auto places = [](const Mesh& mesh) {
    std::set<Point<2>> all;
    for (uint32_t v = 0; v < mesh.vertex_count(); ++v) {
      all.insert(At(mesh, v));
    }
    return all;
  };
  EXPECT_EQ(places(*one), places(*two));
  EXPECT_EQ(one->simplex_count(), two->simplex_count());
}

TEST(PlaneMesherTest, ParametersThatADomainDoesNotHaveAreRefused) {
  const Input square = Input().Ring({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
  Input input = square;
  input.parameters.dimension = 3;
  EXPECT_THAT(input.Make().status().message(), HasSubstr("dimension"));
  input = square;
  input.parameters.criterion = Criterion::kWellSpaced;
  EXPECT_THAT(input.Make().status().message(), HasSubstr("criterion"));
  input = square;
  input.snap_distance = 0.1;
  EXPECT_THAT(input.Make().status().message(), HasSubstr("snap_distance"));
  input = square;
  input.parameters.domain_low = {0, 0};
  input.parameters.domain_high = {1, 1};
  EXPECT_THAT(input.Make().status().message(), AllOf(HasSubstr("domain"), HasSubstr("box")));
  input = square;
  input.markers.pop_back();
  EXPECT_THAT(input.Make().status().message(), HasSubstr("3 markers"));
  input = square;
  input.parameters.max_vertices = 3;
  EXPECT_EQ(input.Make().status().code(), absl::StatusCode::kResourceExhausted);
}

TEST(PlaneMesherTest, MorePointsThanCanBeNumberedAreRefused) {
  const double none = 0;
  const std::span<const double> many(&none, 2 * (kMaxVertices + 1));  // refused before they are read
  const std::vector<uint32_t> ends = {0, 1};
  Features features;
  features.ends = ends;
  RunContext context;
  const absl::Status status = Mesher::Create({.dimension = 2}, {many, features}, context).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(status.message(), HasSubstr("more than vertices can be numbered"));
}

TEST(PlaneMesherTest, ACancelledRunSaysSo) {
  Input input = Input().Circle({0, 0}, 1, 1000);
  Features features;
  features.ends = input.ends;
  features.faces = FaceRule::kHoles;
  RunContext context;
  context.Cancel();
  EXPECT_EQ(MeshPoints(input.parameters, {input.points, features}, context).status().code(),
            absl::StatusCode::kCancelled);
}

class PlaneMesherPropertyTest : public test::SeededTest {
 protected:
  PlaneMesherPropertyTest() : SeededTest(0xd0) {}
};

TEST_F(PlaneMesherPropertyTest, RandomSegmentsOnASmallGridAreMeshed) {
  for (int run = 0; run < 60; ++run) {
    Input input = test::SegmentsOnASmallGrid(random_);
    input.parameters.rho = run % 2 == 0 ? 0 : 1;
    const auto mesh = input.Make();
    ASSERT_TRUE(mesh.ok()) << run << ": " << mesh.status();
    ExpectPointsKept(input.points, *mesh);
    EXPECT_NEAR(AreaOf(*mesh), 100, 1e-10);
    if (mesh->vertex_count() < 1000) {
      ExpectConforming(*mesh);
    }
  }
}

TEST_F(PlaneMesherPropertyTest, SegmentsThatCrossMakeTheSameMeshInAnyOrder) {
  for (int run = 0; run < 12; ++run) {
    Input input;
    input.faces = FaceRule::kBox;
    input.crossings = CrossingRule::kSplit;
    const size_t count = 3 + random_.Below(6);
    for (size_t i = 0; i < count; ++i) {
      input.Segment({random_.Unit(), random_.Unit()}, {random_.Unit(), random_.Unit()});
    }
    const auto mesh = input.Make();
    ASSERT_TRUE(mesh.ok()) << run << ": " << mesh.status();
    for (int other = 0; other < 3; ++other) {
      Input shuffled = input;
      for (size_t i = count; i-- > 0;) {
        const size_t from = random_.Below(i + 1);
        std::swap(shuffled.ends[2 * i], shuffled.ends[2 * from]);
        std::swap(shuffled.ends[2 * i + 1], shuffled.ends[2 * from + 1]);
        if (random_.Below(2) == 1) {
          std::swap(shuffled.ends[2 * i], shuffled.ends[2 * i + 1]);
        }
      }
      shuffled.parameters.threads = 1 + other % 2;
      const auto same = shuffled.Make();
      ASSERT_TRUE(same.ok()) << run << ": " << same.status();
      EXPECT_EQ(test::Canonical(*same), test::Canonical(*mesh)) << run;
    }
  }
}

}  // namespace
}  // namespace wellspace::core
