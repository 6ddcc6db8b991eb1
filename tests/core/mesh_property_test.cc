// The promises of core::MeshPoints, on every kind of cloud.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>
#include <vector>

#include "core/meshers/mesher.h"
#include "core/validate/validate.h"
#include "tests/support/clouds.h"
#include "tests/support/parameters.h"

namespace wellspace::core {
namespace {

using test::InUnitBox;
using test::MakeCloud;
using test::SplitMix64;
using ::testing::AllOf;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

MATCHER_P2(Fails, code, message, "") {
  *result_listener << arg.status();
  return arg.status().code() == code &&
         ::testing::ExplainMatchResult(message, std::string(arg.status().message()), result_listener);
}

template <typename Message>
auto Refuses(const Message& message) {
  return Fails(absl::StatusCode::kInvalidArgument, message);
}

absl::StatusOr<Mesh> MeshOf(const MeshParameters& parameters, std::span<const double> points) {
  RunContext context;
  return MeshPoints(parameters, points, context);
}

MeshView ViewOf(const Mesh& mesh) { return {mesh.dimension, mesh.points, mesh.simplices}; }

// A point, padded to as many coordinates as there may be.
using Row = std::array<double, kMaxDimension>;

// The points of a row-major array.
std::vector<Row> Rows(std::span<const double> points, int dimension) {
  std::vector<Row> rows(points.size() / static_cast<size_t>(dimension));
  for (size_t i = 0; i < points.size(); ++i) {
    rows[i / static_cast<size_t>(dimension)][i % static_cast<size_t>(dimension)] = points[i];
  }
  return rows;
}

size_t CountDistinct(std::vector<Row> rows) {
  std::sort(rows.begin(), rows.end());
  return static_cast<size_t>(std::unique(rows.begin(), rows.end()) - rows.begin());
}

void ExpectSameMesh(const Mesh& a, const Mesh& b) {
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.simplices, b.simplices);
  EXPECT_EQ(a.input_vertex, b.input_vertex);
}

// Guarantees (1) to (3) of Mesher::Extract, the sizes asked for, and the order of vertices and simplices that Mesh
// describes.
void ExpectPromises(const Mesh& mesh, const MeshParameters& parameters, std::span<const double> cloud) {
  const int d = mesh.dimension;
  const double rho = parameters.rho == 0 ? DefaultRho(d) : parameters.rho;
  const absl::Status valid = ValidateMesh(ViewOf(mesh), {.rho = rho,
                                                         .criterion = parameters.criterion,
                                                         .max_circumradius = parameters.max_circumradius,
                                                         .size_boxes = parameters.size_boxes,
                                                         .cloud = cloud});
  EXPECT_TRUE(valid.ok()) << valid;

  const std::vector<Row> vertices = Rows(mesh.points, d);
  const std::vector<Row> inputs = Rows(cloud, d);
  const size_t distinct = CountDistinct(inputs);
  const MeshStatistics& statistics = mesh.statistics;
  EXPECT_EQ(statistics.input_points, inputs.size());
  EXPECT_EQ(statistics.duplicates, inputs.size() - distinct);
  EXPECT_EQ(statistics.vertices, vertices.size());
  EXPECT_EQ(statistics.simplices, mesh.simplex_count());
  EXPECT_EQ(statistics.stars_computed, vertices.size() - statistics.sliver_vertices);
  EXPECT_GE(statistics.cells_computed, vertices.size() - statistics.sliver_vertices);
  EXPECT_GE(statistics.leaves_visited, statistics.cells_computed);
  EXPECT_GE(statistics.max_leaves_visited * statistics.cells_computed, statistics.leaves_visited);
  EXPECT_GE(statistics.exact_predicates, statistics.perturbed_predicates);
  const QualityReport quality = MeasureQuality(ViewOf(mesh));
  EXPECT_NEAR(statistics.max_radius_edge, quality.max_radius_edge, 1e-8);
  EXPECT_NEAR(statistics.min_angle_deg, quality.min_angle_deg, 1e-6);

  ASSERT_EQ(mesh.input_vertex.size(), inputs.size());
  uint32_t next = 0;
  for (size_t i = 0; i < inputs.size(); ++i) {
    ASSERT_LE(mesh.input_vertex[i], next) << "inputs are numbered by first appearance";
    next += mesh.input_vertex[i] == next ? 1 : 0;
    EXPECT_EQ(vertices[mesh.input_vertex[i]], inputs[i]) << "input " << i;
  }

  // Then the corners of the box; and the mesh's bounding box is the domain.
  std::vector<Row> corners;
  for (int bits = 0; bits < 1 << d; ++bits) {
    Row corner{};
    for (int k = 0; k < d; ++k) {
      corner[k] = (bits >> k & 1) != 0 ? mesh.domain_high[k] : mesh.domain_low[k];
    }
    if (std::find(inputs.begin(), inputs.end(), corner) == inputs.end()) {
      corners.push_back(corner);
    }
  }
  ASSERT_GE(vertices.size(), distinct + corners.size());
  EXPECT_TRUE(
      std::is_permutation(corners.begin(), corners.end(), vertices.begin() + static_cast<std::ptrdiff_t>(distinct)));
  for (const Row& v : vertices) {
    for (int k = 0; k < d; ++k) {
      EXPECT_TRUE(mesh.domain_low[k] <= v[k] && v[k] <= mesh.domain_high[k]);
    }
  }

  const size_t corners_of_simplex = static_cast<size_t>(d) + 1;
  for (size_t i = 0; i < mesh.simplices.size(); ++i) {
    EXPECT_LE(mesh.simplices[i - i % corners_of_simplex], mesh.simplices[i]) << "the lowest vertex comes first";
  }
}

using CloudCase = std::tuple<std::string_view, int>;

std::string NameOf(const ::testing::TestParamInfo<CloudCase>& param) {
  return test::CloudName(std::get<0>(param.param), std::get<1>(param.param));
}

class MeshPropertyTest : public ::testing::TestWithParam<CloudCase> {
 protected:
  int D() const { return std::get<1>(GetParam()); }
  // `factor` times as many points as usual. In 4-D a mesh of 5 points has some 100 to 300 vertices, and for each decade
  // that a point is nearer to the centre 300 more.
  std::vector<double> Cloud(double factor = 1) const {
    const std::string_view kind = std::get<0>(GetParam());
    const double points = factor * (D() == 2 ? 300 : D() == 3 ? 120 : kind == "log-uniform" ? 2 : 5);
    return MakeCloud(kind, D(), static_cast<size_t>(std::ceil(points)));
  }
};

INSTANTIATE_TEST_SUITE_P(Clouds, MeshPropertyTest,
                         ::testing::Combine(::testing::ValuesIn(test::AllKinds()), ::testing::Values(2, 3, 4)), NameOf);

TEST_P(MeshPropertyTest, KeepsItsPromisesForEveryRho) {
  const std::vector<double> cloud = Cloud();
  MeshParameters parameters = InUnitBox(D());
  uint64_t previous = std::numeric_limits<uint64_t>::max();
  const std::array<std::vector<double>, 3> rhos = {{{0.95, 0, 3}, {1.4, 0, 4}, {2.2, 0, 6}}};
  for (const double rho : rhos[static_cast<size_t>(D()) - 2]) {
    SCOPED_TRACE(rho);
    parameters.rho = rho;
    const absl::StatusOr<Mesh> mesh = MeshOf(parameters, cloud);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_THAT(mesh->domain_low, ElementsAreArray(parameters.domain_low));
    EXPECT_THAT(mesh->domain_high, ElementsAreArray(parameters.domain_high));
    ExpectPromises(*mesh, parameters, cloud);
    EXPECT_LE(mesh->vertex_count(), previous) << "a weaker bound needs no more vertices";
    // Of a mesh of a hundred vertices up to a sixth are chance: among the meshes of a point in 4-D one in twenty-four
    // is larger by a tenth or more.
    previous = mesh->vertex_count() + (D() == 4 ? mesh->vertex_count() / 6 : 0);
  }
}

// Both criteria, without and with bounds on the sizes: everywhere, in a box inside, in one that is a point on a face.
TEST_P(MeshPropertyTest, KeepsBothCriteriaAndSizes) {
  const size_t d = static_cast<size_t>(D());
  const std::vector<double> cloud = Cloud(D() == 4 ? 0.4 : 0.25);
  const double size = D() == 2 ? 0.1 : D() == 3 ? 0.25 : 0.5;
  std::vector<double> on_face(d, 0.25);
  on_face[0] = 1;
  for (const Criterion criterion : {Criterion::kRadiusEdge, Criterion::kWellSpaced}) {
    SCOPED_TRACE(criterion == Criterion::kWellSpaced ? "well-spaced" : "radius-edge");
    for (const bool has_sizes : {false, true}) {
      SCOPED_TRACE(has_sizes ? "with sizes" : "without sizes");
      if (criterion == Criterion::kRadiusEdge && !has_sizes) {
        continue;  // above
      }
      MeshParameters parameters = InUnitBox(D());
      parameters.criterion = criterion;
      if (has_sizes) {
        parameters.max_circumradius = 2 * size;
        parameters.size_boxes = {{std::vector<double>(d, 0.4), std::vector<double>(d, 0.45), size},
                                 {on_face, on_face, 0.75 * size}};
      }
      const absl::StatusOr<Mesh> mesh = MeshOf(parameters, cloud);
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      ExpectPromises(*mesh, parameters, cloud);
    }
  }
}

// Guarantee (4).
TEST_P(MeshPropertyTest, IsTheSameForEveryNumberOfThreads) {
  const std::vector<double> cloud = Cloud();
  MeshParameters parameters = InUnitBox(D());
  const absl::StatusOr<Mesh> one = MeshOf(parameters, cloud);
  ASSERT_TRUE(one.ok()) << one.status();
  for (const int threads : {1, 2, 5}) {
    parameters.threads = threads;
    const absl::StatusOr<Mesh> mesh = MeshOf(parameters, cloud);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    ExpectSameMesh(*one, *mesh);
  }
}

TEST_P(MeshPropertyTest, KeepsItsPromisesForPermutedInput) {
  const uint64_t seed = test::Seed(9);
  SCOPED_TRACE(seed);
  const std::vector<double> cloud = test::Shuffled(Cloud(), D(), seed);
  const MeshParameters parameters = InUnitBox(D());
  const absl::StatusOr<Mesh> mesh = MeshOf(parameters, cloud);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectPromises(*mesh, parameters, cloud);
}

TEST_P(MeshPropertyTest, KeepsItsPromisesFarFromTheUnitBox) {
  struct Frame {
    double factor;
    double offset;
  };
  for (const Frame frame : {Frame{1e-150, 0}, Frame{1e150, 0}, Frame{3, -1e6}}) {
    SCOPED_TRACE(frame.factor);
    MeshParameters parameters = InUnitBox(D());
    std::vector<double> cloud = Cloud();
    if (frame.offset != 0) {
      // Coarser than the rounding of far offsets, so that no two points come too close.
      cloud.resize(std::min(cloud.size(), size_t{60}) / static_cast<size_t>(D()) * static_cast<size_t>(D()));
      for (double& x : cloud) {
        x = std::round(x * 4096) / 4096;
      }
    }
    for (std::vector<double>* numbers : {&cloud, &parameters.domain_low, &parameters.domain_high}) {
      for (double& x : *numbers) {
        x = frame.factor * x + frame.offset;
      }
    }
    const absl::StatusOr<Mesh> mesh = MeshOf(parameters, cloud);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    ExpectPromises(*mesh, parameters, cloud);
  }
}

TEST_P(MeshPropertyTest, DefaultDomainIsTheBoundingBoxGrown) {
  std::vector<double> cloud = Cloud();
  if (cloud.empty()) {
    cloud.assign(static_cast<size_t>(D()), 7.0);
  }
  MeshParameters parameters;
  parameters.dimension = D();
  const absl::StatusOr<Mesh> mesh = MeshOf(parameters, cloud);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectPromises(*mesh, parameters, cloud);
  std::vector<double> low(static_cast<size_t>(D()), kInfinity);
  std::vector<double> high(static_cast<size_t>(D()), -kInfinity);
  double longest = 0;
  for (size_t i = 0; i < cloud.size(); ++i) {
    const size_t k = i % static_cast<size_t>(D());
    low[k] = std::min(low[k], cloud[i]);
    high[k] = std::max(high[k], cloud[i]);
  }
  for (size_t k = 0; k < low.size(); ++k) {
    longest = std::max(longest, high[k] - low[k]);
  }
  for (size_t k = 0; k < low.size(); ++k) {
    const double grown = longest == 0 ? mesh->domain_high[k] - high[k] : longest / 4;
    EXPECT_GT(grown, 0);
    EXPECT_NEAR(mesh->domain_low[k], low[k] - grown, 1e-15);
    EXPECT_NEAR(mesh->domain_high[k], high[k] + grown, 1e-15);
  }
}

class MeshErrorTest : public ::testing::TestWithParam<int> {
 protected:
  int D() const { return GetParam(); }
  // Up to number 41 points are named below. In 4-D they are but on a line: a mesh of 50 uniform ones takes a second.
  std::vector<double> Cloud() const { return MakeCloud(D() <= 3 ? "uniform" : "diagonal", D(), 50); }
  double& Coordinate(std::vector<double>& cloud, size_t point, size_t axis) const {
    return cloud[point * static_cast<size_t>(D()) + axis];
  }
};

INSTANTIATE_TEST_SUITE_P(Dimensions, MeshErrorTest, ::testing::Values(2, 3, 4));

TEST_P(MeshErrorTest, CoordinatesThatAreNoNumbers) {
  for (const auto& [value, text] :
       {std::pair{kNaN, "nan"}, std::pair{kInfinity, "inf"}, std::pair{-kInfinity, "-inf"}}) {
    std::vector<double> cloud = Cloud();
    Coordinate(cloud, 17, 1) = value;
    EXPECT_THAT(MeshOf(InUnitBox(D()), cloud), Refuses(HasSubstr(std::string("points[17]: coordinate 1 is ") + text)));
    MeshParameters anywhere;
    anywhere.dimension = D();
    EXPECT_THAT(MeshOf(anywhere, cloud), Refuses(HasSubstr(std::string("points[17]: coordinate 1 is ") + text)));
  }
}

TEST_P(MeshErrorTest, PointsOutsideTheDomain) {
  for (const double value : {std::nextafter(0.0, -1.0), std::nextafter(1.0, 2.0), 1e300}) {
    std::vector<double> cloud = Cloud();
    Coordinate(cloud, 23, 0) = value;
    EXPECT_THAT(MeshOf(InUnitBox(D()), cloud),
                Refuses(AllOf(HasSubstr("points[23] = ("), HasSubstr("outside the domain"))));
  }
}

TEST_P(MeshErrorTest, IncompletePoint) {
  std::vector<double> cloud = Cloud();
  cloud.pop_back();
  EXPECT_THAT(MeshOf(InUnitBox(D()), cloud), Refuses(HasSubstr("points: " + std::to_string(cloud.size()))));
}

TEST_P(MeshErrorTest, NothingToMesh) {
  MeshParameters parameters;
  parameters.dimension = D();
  EXPECT_THAT(MeshOf(parameters, {}), Refuses(HasSubstr("points: ")));
}

TEST_P(MeshErrorTest, Parameters) {
  const std::vector<double> cloud = Cloud();
  const auto refuses = [&](const auto& change, const std::string& field) {
    MeshParameters parameters = InUnitBox(D());
    change(parameters);
    EXPECT_THAT(MeshOf(parameters, cloud), Refuses(HasSubstr(field)));
    EXPECT_EQ(ValidateParameters(parameters).code(), absl::StatusCode::kInvalidArgument) << field;
  };
  for (const int dimension : {-1, 0, 1, 7, 1000}) {
    refuses([&](MeshParameters& p) { p.dimension = dimension; }, "dimension: " + std::to_string(dimension));
  }
  const double too_small = std::nextafter(MinimumRho(D()), 0.0);
  for (const double rho : {-1.0, 0.5, too_small, kNaN, kInfinity}) {
    refuses([&](MeshParameters& p) { p.rho = rho; }, "rho: ");
  }
  refuses([](MeshParameters& p) { p.rho = 0.5; }, "rho: 0.5");
  for (const int threads : {-1, 0}) {
    refuses([&](MeshParameters& p) { p.threads = threads; }, "threads: " + std::to_string(threads));
  }
  for (const double margin : {-0.25, kNaN, kInfinity}) {
    refuses([&](MeshParameters& p) { p.margin = margin; }, "margin: ");
  }
  refuses([](MeshParameters& p) { p.domain_low.pop_back(); }, "domain: ");
  refuses([](MeshParameters& p) { p.domain_high.clear(); }, "domain: ");
  for (const double high : {0.0, -1.0, kNaN, kInfinity}) {
    refuses([&](MeshParameters& p) { p.domain_high[1] = high; }, "domain: along axis 1");
  }
}

TEST_P(MeshErrorTest, PointsTooCloseForTheArithmetic) {
  for (const int ulps : {1, 3}) {
    std::vector<double> cloud = Cloud();
    double x = Coordinate(cloud, 5, 0);
    for (int i = 0; i < ulps; ++i) {
      x = std::nextafter(x, 2.0);
    }
    for (size_t k = 0; k < static_cast<size_t>(D()); ++k) {
      Coordinate(cloud, 41, k) = k == 0 ? x : Coordinate(cloud, 5, k);
    }
    EXPECT_THAT(MeshOf(InUnitBox(D()), cloud), Refuses(AllOf(HasSubstr("points[5]"), HasSubstr("points[41]"),
                                                             HasSubstr("too close"), HasSubstr("merge them"))));
  }
}

// Two points on either side of faces of leaves of every size, as close as is allowed, and by a step of the grid closer.
TEST_P(MeshErrorTest, PointsAsCloseAsTheArithmeticServes) {
  constexpr double kStep = 0x1p-50;
  for (const double distance : {64 * kStep, 63 * kStep}) {
    std::vector<double> cloud = Cloud();
    for (size_t k = 0; k < static_cast<size_t>(D()); ++k) {
      Coordinate(cloud, 5, k) = k == 0 ? 0.5 - 8 * kStep : 0.375;
      Coordinate(cloud, 41, k) = k == 0 ? 0.5 - 8 * kStep + distance : 0.375;
    }
    RunContext context;
    const auto mesher = Mesher::Create(InUnitBox(D()), cloud, context);
    if (distance == 64 * kStep) {
      EXPECT_TRUE(mesher.ok()) << mesher.status();
    } else {
      EXPECT_THAT(mesher, Refuses(AllOf(HasSubstr("points[5]"), HasSubstr("points[41]"), HasSubstr("too close"))));
    }
  }
}

TEST_P(MeshErrorTest, PointTooCloseToAFace) {
  std::vector<double> cloud = Cloud();
  Coordinate(cloud, 8, 1) = std::nextafter(1.0, 0.0);
  EXPECT_THAT(MeshOf(InUnitBox(D()), cloud),
              Refuses(AllOf(HasSubstr("points[8] = ("), HasSubstr("high face of axis 1"))));
  Coordinate(cloud, 8, 1) = 1;
  EXPECT_TRUE(MeshOf(InUnitBox(D()), cloud).ok());
}

TEST_P(MeshErrorTest, BudgetOfVertices) {
  const std::vector<double> cloud = Cloud();
  MeshParameters parameters = InUnitBox(D());
  const absl::StatusOr<Mesh> mesh = MeshOf(parameters, cloud);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  parameters.max_vertices = mesh->vertex_count();
  const absl::StatusOr<Mesh> exact = MeshOf(parameters, cloud);
  ASSERT_TRUE(exact.ok()) << exact.status();
  ExpectSameMesh(*mesh, *exact);
  for (const uint64_t limit : {mesh->vertex_count() - 1, uint64_t{60}, uint64_t{10}, uint64_t{1}}) {
    parameters.max_vertices = limit;
    EXPECT_THAT(MeshOf(parameters, cloud), Fails(absl::StatusCode::kResourceExhausted,
                                                 AllOf(HasSubstr("max_vertices"), HasSubstr(std::to_string(limit)))));
  }
}

TEST_P(MeshErrorTest, CancelledAndTooLateBeforeTheStart) {
  RunContext cancelled;
  cancelled.Cancel();
  EXPECT_EQ(MeshPoints(InUnitBox(D()), Cloud(), cancelled).status().code(), absl::StatusCode::kCancelled);
  RunContext late;
  late.ExceedDeadline();
  late.Cancel();
  EXPECT_EQ(MeshPoints(InUnitBox(D()), Cloud(), late).status().code(), absl::StatusCode::kDeadlineExceeded);
}

// A watcher cancels as soon as it sees a phase; the cloud is large enough for every phase to outlive that by far.
TEST_P(MeshErrorTest, CancelledInEveryPhase) {
  const std::vector<double> cloud = MakeCloud("uniform", D(), D() == 2 ? 60000 : D() == 3 ? 10000 : 200);
  for (const Phase phase : {Phase::kTree, Phase::kRefinement, Phase::kSimplices}) {
    SCOPED_TRACE(PhaseName(phase));
    RunContext context;
    Progress seen;
    std::thread watcher([&] {
      do {
        seen = context.Snapshot();
      } while (seen.phase < phase);
      context.Cancel();
    });
    const absl::StatusOr<Mesh> mesh = MeshPoints(InUnitBox(D()), cloud, context);
    watcher.join();
    EXPECT_EQ(mesh.status().code(), absl::StatusCode::kCancelled) << mesh.status();
    EXPECT_LT(context.Snapshot().phase, Phase::kDone);
  }
}

// Progress as an observer sees it while the mesher works.
TEST_P(MeshErrorTest, ProgressNeverDecreases) {
  const std::vector<double> cloud = MakeCloud("uniform", D(), D() <= 3 ? 3000 : 20);
  RunContext context;
  std::vector<Progress> seen;
  std::thread watcher([&] {
    Progress progress;
    do {
      progress = context.Snapshot();
      if (seen.empty() || progress.vertices != seen.back().vertices || progress.phase != seen.back().phase) {
        seen.push_back(progress);
      }
    } while (progress.phase != Phase::kDone);
  });
  const absl::StatusOr<Mesh> mesh = MeshPoints(InUnitBox(D()), cloud, context);
  watcher.join();
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  for (size_t i = 1; i < seen.size(); ++i) {
    EXPECT_LE(seen[i - 1].phase, seen[i].phase);
    EXPECT_LE(seen[i - 1].fraction, seen[i].fraction);
    EXPECT_LE(seen[i - 1].vertices, seen[i].vertices);
  }
  const Progress last = context.Snapshot();
  EXPECT_EQ(last.phase, Phase::kDone);
  EXPECT_EQ(last.fraction, 1);
  EXPECT_EQ(last.vertices, mesh->vertex_count());
  if (mesh->statistics.slivers == 0) {  // repair comes after they were counted
    EXPECT_EQ(last.simplices, mesh->simplex_count());
  }
}

}  // namespace
}  // namespace wellspace::core
