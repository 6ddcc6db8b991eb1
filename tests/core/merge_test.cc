// Merging of near points: points that stay, points that become others, and the answer where nothing is merged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "core/input/near_points.h"
#include "core/meshers/mesher.h"
#include "core/validate/validate.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

absl::StatusOr<Mesh> MeshOf(const MeshParameters& parameters, const std::vector<double>& points) {
  RunContext context;
  return MeshPoints(parameters, points, context);
}

double DistanceBetween(const double* p, const double* q, int dimension) {
  double sum = 0;
  for (int k = 0; k < dimension; ++k) {
    sum += (p[k] - q[k]) * (p[k] - q[k]);
  }
  return std::sqrt(sum);
}

// The definition, literally: O(n^2).
std::vector<uint32_t> BecomesByDefinition(const std::vector<double>& points, int dimension, double distance) {
  const auto at = [&](uint32_t i) { return &points[size_t{i} * dimension]; };
  std::vector<uint32_t> order(points.size() / dimension);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return std::lexicographical_compare(at(a), at(a) + dimension, at(b), at(b) + dimension);
  });
  std::vector<uint32_t> becomes(order.size());
  std::vector<uint32_t> stay;
  for (const uint32_t i : order) {
    uint32_t nearest = i;
    double least = INFINITY;
    for (const uint32_t other : stay) {
      const double there = DistanceBetween(at(i), at(other), dimension);
      if (there <= distance && there < least) {
        nearest = other;
        least = there;
      }
    }
    if (nearest == i) {
      stay.push_back(i);
    }
    becomes[i] = nearest;
  }
  return becomes;
}

class MergeTest : public test::SeededTest {
 protected:
  MergeTest() : SeededTest(1977) {}

  // On a coarse lattice, a multiple of a power of two: distances are exact, and many equal.
  std::vector<double> Lattice(int dimension, size_t count) {
    std::vector<double> points;
    for (size_t i = 0; i < count * dimension; ++i) {
      points.push_back(0x1p-6 * static_cast<double>(random_.Below(dimension < 4 ? 24 : 6)));
    }
    return points;
  }
};

template <int D>
void ExpectByDefinition(const std::vector<double>& points, double distance) {
  const auto domain = Frame<D>::Of(*BoxAround<D>(points, 0.25, RunContext()));
  ASSERT_TRUE(domain.ok());
  const auto merged = MergeNear<D>(*domain, points, distance, RunContext());
  ASSERT_TRUE(merged.ok());
  const std::vector<uint32_t> becomes = BecomesByDefinition(points, D, distance);
  uint64_t others = 0;
  for (uint32_t i = 0; i < becomes.size(); ++i) {
    EXPECT_EQ(merged->inputs[merged->place_of[i]], becomes[i]) << D << "-D: point " << i << " within " << distance;
    others += DistanceBetween(&points[size_t{i} * D], &points[size_t{becomes[i]} * D], D) > 0 ? 1 : 0;
  }
  EXPECT_EQ(merged->merged, others);
}

TEST_F(MergeTest, IsWhatItsDefinitionSays) {
  for (const double distance : {0x1p-7, 0x1p-6, 0x1.8p-6, 0x1p-5, 0x1p-4}) {
    ExpectByDefinition<2>(Lattice(2, 300), distance);
    ExpectByDefinition<3>(Lattice(3, 300), distance);
    ExpectByDefinition<4>(Lattice(4, 300), distance);
    ExpectByDefinition<5>(Lattice(5, 300), distance);
    ExpectByDefinition<6>(Lattice(6, 300), distance);
  }
}

TEST_F(MergeTest, IsToldInTheMesh) {
  for (const int dimension : {2, 3}) {
    const std::vector<double> points = Lattice(dimension, 150);
    const std::vector<uint32_t> becomes = BecomesByDefinition(points, dimension, 0x1p-6);
    const auto mesh = MeshOf({.dimension = dimension, .merge_distance = 0x1p-6}, points);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    uint64_t merged = 0;
    uint64_t stay = 0;
    for (uint32_t i = 0; i < becomes.size(); ++i) {
      const double* became = &mesh->points[size_t{mesh->input_vertex[i]} * dimension];
      EXPECT_EQ(std::memcmp(became, &points[size_t{becomes[i]} * dimension], dimension * sizeof(double)), 0) << i;
      merged += DistanceBetween(became, &points[size_t{i} * dimension], dimension) > 0 ? 1 : 0;
      stay += becomes[i] == i ? 1 : 0;
    }
    EXPECT_EQ(mesh->statistics.merged_points, merged);
    EXPECT_EQ(mesh->statistics.input_points, 150u);
    EXPECT_EQ(mesh->statistics.duplicates, 150 - stay - merged);
  }
}

// A vertex has its number by the first point that became it, which need not be the one that stayed.
TEST_F(MergeTest, MeshesOfMergedCloudsAreValid) {
  for (const int dimension : {2, 3}) {
    for (int round = 0; round < 10; ++round) {
      std::vector<double> points;
      while (points.size() < size_t{200} * dimension) {
        points.push_back(random_.Unit());
      }
      const auto mesh = MeshOf({.dimension = dimension, .merge_distance = 0.1}, points);
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      const MeshView view{dimension, mesh->points, mesh->simplices, mesh->weights};
      EXPECT_EQ(ValidateCloud(view, points, 0.1), absl::OkStatus());
      std::vector<double> more = points;
      more.insert(more.end(), dimension, -0.2);  // in the box, and far from all
      EXPECT_THAT(std::string(ValidateCloud(view, more, 0.1).message()), HasSubstr("point 200 of the cloud"));
    }
  }
}

TEST_F(MergeTest, MakesTheMeshOfWhatStays) {
  const std::vector<double> points = Lattice(3, 300);
  const MeshParameters merging{.dimension = 3, .margin = 0, .merge_distance = 0x1p-6};
  const auto merged = MeshOf(merging, points);
  ASSERT_TRUE(merged.ok()) << merged.status();
  const std::vector<uint32_t> becomes = BecomesByDefinition(points, 3, merging.merge_distance);
  std::vector<double> left;
  for (uint32_t i = 0; i < becomes.size(); ++i) {
    // In the order in which points are first met.
    const uint32_t vertex = merged->input_vertex[i];
    if (vertex == left.size() / 3) {
      left.insert(left.end(), &points[3 * becomes[i]], &points[3 * becomes[i]] + 3);
    }
    EXPECT_LT(vertex, left.size() / 3);
  }
  const auto mesh = MeshOf({.dimension = 3, .margin = 0}, left);
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->points, merged->points);
  EXPECT_EQ(mesh->simplices, merged->simplices);
  const auto again = MeshOf(merging, left);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->statistics.merged_points, 0u) << "merging what stays changes nothing";
  EXPECT_EQ(again->simplices, merged->simplices);
}

TEST_F(MergeTest, DoesNotDependOnTheOrderOfPointsNorOnThreads) {
  const std::vector<double> points = Lattice(2, 400);
  std::vector<uint32_t> order(400);
  std::iota(order.begin(), order.end(), 0);
  const auto first = MeshOf({.dimension = 2, .merge_distance = 0x1p-6}, points);
  ASSERT_TRUE(first.ok());
  const auto sorted_points = [](const Mesh& mesh) {
    std::vector<std::pair<double, double>> all;
    for (size_t i = 0; i < mesh.points.size(); i += 2) {
      all.emplace_back(mesh.points[i], mesh.points[i + 1]);
    }
    std::sort(all.begin(), all.end());
    return all;
  };
  for (int threads = 1; threads <= 3; ++threads) {
    std::shuffle(order.begin(), order.end(), std::mt19937_64(random_.Below(1000)));
    std::vector<double> shuffled;
    for (const uint32_t i : order) {
      shuffled.insert(shuffled.end(), {points[2 * i], points[2 * i + 1]});
    }
    const auto mesh = MeshOf({.dimension = 2, .merge_distance = 0x1p-6, .threads = threads}, shuffled);
    ASSERT_TRUE(mesh.ok());
    EXPECT_EQ(sorted_points(*mesh), sorted_points(*first));
    for (uint32_t i = 0; i < 400; ++i) {
      const uint32_t v = mesh->input_vertex[i];
      const uint32_t w = first->input_vertex[order[i]];
      EXPECT_EQ(mesh->points[2 * v], first->points[2 * w]);
      EXPECT_EQ(mesh->points[2 * v + 1], first->points[2 * w + 1]);
    }
  }
}

TEST_F(MergeTest, ThinsChainsAndDoesNotDrawThemTogether) {
  std::vector<double> points;
  for (int i = 0; i < 100; ++i) {
    points.insert(points.end(), {static_cast<double>(i), 0.0});
  }
  const auto mesh = MeshOf({.dimension = 2, .merge_distance = 1}, points);
  ASSERT_TRUE(mesh.ok());
  for (uint32_t i = 0; i < 100; ++i) {
    EXPECT_EQ(mesh->points[2 * mesh->input_vertex[i]], i - i % 2);
  }
  EXPECT_EQ(mesh->statistics.merged_points, 50u);
}

TEST_F(MergeTest, KeepsNegativeZerosOfWhatStays) {
  const auto mesh = MeshOf({.dimension = 2, .merge_distance = 1e-3}, {1e-9, 1e-9, -0.0, -0.0, 1, 1, 1, 0});
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->input_vertex[0], 0u);
  EXPECT_EQ(mesh->input_vertex[1], 0u);
  EXPECT_TRUE(std::signbit(mesh->points[0]) && std::signbit(mesh->points[1])) << "the bits of the point that stays";
}

TEST_F(MergeTest, MeshesTwinsThatAreOneUlpApart) {
  for (int dimension = 2; dimension <= 4; ++dimension) {
    std::vector<double> points;
    for (int i = 0; i < 12 * dimension; ++i) {
      points.push_back(random_.Unit());
    }
    const std::vector<double> singles = points;
    for (int i = 0; i < 12; ++i) {
      for (int k = 0; k < dimension; ++k) {
        points.push_back(std::nextafter(singles[i * dimension + k], k == 0 ? 2.0 : singles[i * dimension + k]));
      }
    }
    const auto refused = MeshOf({.dimension = dimension, .rho = 50}, points);
    EXPECT_THAT(std::string(refused.status().message()),
                AllOf(HasSubstr("12 pairs are too close: points[0] and points[12]"),
                      HasSubstr("points[9] and points[21]"), HasSubstr("…"), Not(HasSubstr("points[10]"))));
    const auto mesh = MeshOf({.dimension = dimension, .rho = 50, .merge_distance = 1e-10}, points);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->statistics.merged_points, 12u);
    for (int i = 0; i < 12; ++i) {
      EXPECT_EQ(mesh->input_vertex[i], static_cast<uint32_t>(i));
      EXPECT_EQ(mesh->input_vertex[12 + i], static_cast<uint32_t>(i));
    }
  }
}

// The distance that an error names is enough.
TEST_F(MergeTest, TheDistanceThatAnErrorNamesMerges) {
  for (const double offset : {0.0, 1e3, 1e6}) {
    std::vector<double> points;
    for (int i = 0; i < 60; ++i) {
      points.insert(points.end(), {offset + 1e-13 * random_.Unit() * (1 + offset), offset + (i / 3) * 0.05});
    }
    const auto refused = MeshOf({.dimension = 2}, points);
    ASSERT_FALSE(refused.ok());
    const std::string text(refused.status().message());
    const size_t at = text.find("(--merge) of ");
    ASSERT_NE(at, std::string::npos) << text;
    const auto mesh = MeshOf({.dimension = 2, .merge_distance = std::stod(text.substr(at + 13))}, points);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
  }
}

TEST_F(MergeTest, AHeapOfNearPointsIsCountedInBoundedWork) {
  std::vector<double> points = {0, 0, 1, 1};
  for (int i = 0; i < 20'000; ++i) {
    points.insert(points.end(), {0.5 + 1e-17 * random_.Unit() * i, 0.5 + 0x1p-52 * i});
  }
  const auto refused = MeshOf({.dimension = 2}, points);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("more than "));
  const auto mesh = MeshOf({.dimension = 2, .merge_distance = 1e-9}, points);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->statistics.merged_points + mesh->statistics.duplicates, 19'999u);
}

TEST_F(MergeTest, FarPointsAreBlamedAndNotTheOthers) {
  std::vector<double> points;
  for (int i = 0; i < 200; ++i) {
    points.insert(points.end(), {random_.Unit(), random_.Unit()});
  }
  points.insert(points.begin() + 100, {1e12, 1e12});
  const auto one = MeshOf({.dimension = 2}, points);
  EXPECT_THAT(std::string(one.status().message()),
              AllOf(HasSubstr("points[50] = (1000000000000, 1000000000000) is so far from the others"),
                    HasSubstr("drop what is far away")));
  points.insert(points.end(), {-1e12, 0});
  EXPECT_THAT(std::string(MeshOf({.dimension = 2}, points).status().message()),
              AllOf(HasSubstr("points[50]"), HasSubstr("points[201]"), HasSubstr("are so far from the others")));
  // With a domain, it is the domain that is too large; and twins stay twins, whatever is far away.
  EXPECT_THAT(std::string(MeshOf({.dimension = 2, .domain_low = {-1e13, -1e13}, .domain_high = {1e13, 1e13}}, points)
                              .status()
                              .message()),
              AllOf(HasSubstr("pairs are too close"), Not(HasSubstr("so far from"))));
  points = {0, 0, 1, 1, 1, 0, 0, 1, 0.5, 0.5, 0.5, std::nextafter(0.5, 1), 1e5, 0};
  EXPECT_THAT(std::string(MeshOf({.dimension = 2}, points).status().message()),
              AllOf(HasSubstr("points[5]"), HasSubstr("points[4]"), Not(HasSubstr("so far from"))));
}

// As a session does that is built anew.
TEST_F(MergeTest, TheBoxOfWhatStayedTakesTheSamePoints) {
  const std::vector<double> points = {0, 0, 1, 1, std::nextafter(1, 2), 1, 0.5, 0.75, 1, std::nextafter(1, 2)};
  MeshParameters parameters{.dimension = 2, .margin = 0, .merge_distance = 1e-9};
  const auto mesh = MeshOf(parameters, points);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->domain_high, (std::vector<double>{1, 1}));
  parameters.domain_low = mesh->domain_low;
  parameters.domain_high = mesh->domain_high;
  const auto again = MeshOf(parameters, points);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->points, mesh->points);
  EXPECT_EQ(again->input_vertex, mesh->input_vertex);
  const std::vector<double> outside = {0, 0, 1, 1, 1.1, 1};
  EXPECT_THAT(std::string(MeshOf(parameters, outside).status().message()), HasSubstr("points[2] = "));
}

TEST_F(MergeTest, TinyExtentsGetTheirOwnReason) {
  std::vector<double> points;
  for (int i = 0; i < 40; ++i) {
    points.push_back(1e-310 * random_.Unit());
  }
  EXPECT_THAT(std::string(MeshOf({.dimension = 2}, points).status().message()),
              AllOf(HasSubstr("at least 2^-900"), HasSubstr("multiply the coordinates"), Not(HasSubstr("2^-40"))));
}

TEST_F(MergeTest, AddedPointsBecomeTheNearestVertexWithinTheDistance) {
  const MeshParameters parameters{.dimension = 2, .merge_distance = 0.01};
  RunContext context;
  const auto mesher = Mesher::Create(parameters, std::vector<double>{0, 0, 1, 0, 1, 1, 0, 1}, context);
  ASSERT_TRUE(mesher.ok());
  ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
  auto mesh = (*mesher)->Extract(1, context);
  ASSERT_TRUE(mesh.ok());
  const auto before = mesh->vertex_count();
  // Beside vertex 1; beside a Steiner vertex; a new one and its twin, and one that is a twin of the twin but farther
  // from it.
  const double* const last = &mesh->points[2 * (before - 1)];
  const auto vertices = (*mesher)->AddPoints(
      std::vector<double>{1.004, 0, last[0] + 1e-13, last[1], 0.31, 0.52, 0.305, 0.52, 0.318, 0.52}, context);
  ASSERT_TRUE(vertices.ok()) << vertices.status();
  EXPECT_EQ(*vertices, (std::vector<uint32_t>{1, static_cast<uint32_t>(before - 1), static_cast<uint32_t>(before),
                                              static_cast<uint32_t>(before), static_cast<uint32_t>(before + 1)}));
  const auto one = (*mesher)->AddVertex(0, std::vector<double>{0.003, 0.004});
  ASSERT_TRUE(one.ok()) << one.status();
  EXPECT_EQ(*one, 0u);
  ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
  ASSERT_TRUE((*mesher)->Update(*mesh, 1, context).ok());
  EXPECT_EQ(mesh->statistics.merged_points, 4u);
  EXPECT_EQ(mesh->statistics.input_points, 10u);
  EXPECT_EQ(mesh->statistics.duplicates, 0u);
  EXPECT_EQ(mesh->points[2 * before], 0.305) << "the first by coordinates stays";
  EXPECT_EQ(mesh->points[2 * before + 2], 0.318);
}

TEST_F(MergeTest, AddedPointsThatAreTooCloseAreAllCounted) {
  RunContext context;
  std::vector<double> points;
  for (int i = 0; i < 30; ++i) {
    points.insert(points.end(), {random_.Unit(), random_.Unit()});
  }
  const auto mesher = Mesher::Create({.dimension = 2}, points, context);
  ASSERT_TRUE(mesher.ok());
  ASSERT_TRUE((*mesher)->Refine({.dimension = 2}, context).ok());
  for (size_t i = 0; i < points.size(); i += 2) {
    points[i] = std::nextafter(points[i], 2);
  }
  EXPECT_THAT(std::string((*mesher)->AddPoints(points, context).status().message()),
              AllOf(HasSubstr("points[0] = "), HasSubstr("from vertex 0"), HasSubstr("so are points[1]"),
                    HasSubstr("30 points in all")));
}

TEST_F(MergeTest, DistancesThatAreNoneAreRefused) {
  for (const double distance : {-1.0, std::nan(""), static_cast<double>(INFINITY)}) {
    EXPECT_THAT(std::string(ValidateParameters({.merge_distance = distance}).message()), HasSubstr("merge_distance: "));
  }
}

}  // namespace
}  // namespace wellspace::core
