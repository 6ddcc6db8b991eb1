// Fields that are carried from mesh to mesh: linear ones, constants, integrals, and hostile numbers.
#include "core/mesh/carry_field.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/mesh/mesh_locator.h"
#include "core/meshers/mesher.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/support/clouds.h"
#include "tests/support/limited_lender.h"
#include "tests/support/meshes.h"

namespace wellspace::core {
namespace {

using ::testing::HasSubstr;

const RunContext kNoContext;

std::vector<double> RandomNumbers(size_t count, uint64_t seed, double scale = 1) {
  test::SplitMix64 random(seed);
  std::vector<double> numbers(count);
  std::ranges::generate(numbers, [&] { return scale * random.Unit(); });
  return numbers;
}

// A mesh of the unit box.
Mesh BoxMesh(int dimension, size_t count, uint64_t seed) {
  RunContext context;
  MeshParameters parameters{.dimension = dimension};
  parameters.domain_low.assign(dimension, 0);
  parameters.domain_high.assign(dimension, 1);
  return MeshPoints(parameters, RandomNumbers(count * dimension, seed), context).value();
}

// A mesh, and the mesh that it becomes with more points: most vertices are kept.
std::pair<Mesh, Mesh> BeforeAndAfter(int dimension, size_t count, size_t more) {
  RunContext context;
  MeshParameters parameters{.dimension = dimension};
  parameters.domain_low.assign(dimension, 0);
  parameters.domain_high.assign(dimension, 1);
  auto mesher = Mesher::Create(parameters, RandomNumbers(count * dimension, 7), context).value();
  EXPECT_TRUE(mesher->Refine(parameters, context).ok());
  Mesh before = mesher->Extract(1, context).value();
  Mesh after = before;
  EXPECT_TRUE(mesher->AddPoints(RandomNumbers(more * dimension, 5, 0.2), context).ok());
  EXPECT_TRUE(mesher->Refine(parameters, context).ok());
  EXPECT_TRUE(mesher->Update(after, 1, context).ok());
  return {std::move(before), std::move(after)};
}

MeshView ViewOf(const Mesh& mesh) {
  return {.dimension = mesh.dimension, .points = mesh.points, .simplices = mesh.simplices};
}

std::unique_ptr<MeshLocator> LocatorOf(const Mesh& mesh) {
  Mesh copy;
  copy.dimension = mesh.dimension;
  copy.points = mesh.points;
  copy.simplices = mesh.simplices;
  return MeshLocator::Create(std::move(copy), kNoContext).value();
}

CarriedField Carried(Carrying carrying, const Mesh& from, const std::vector<double>& values, const Mesh& onto,
                     size_t components = 1, int threads = 1) {
  const Field field{.values = values, .components = components};
  return CarryField(carrying, field, ViewOf(from), ViewOf(onto), {.context = kNoContext, .threads = threads}).value();
}

CarriedField Means(const Mesh& from, const std::vector<double>& values, const Mesh& onto, size_t components = 1,
                   int threads = 1) {
  return Carried(Carrying::kMeans, from, values, onto, components, threads);
}

// Volumes of simplices by elimination in long double.
std::vector<double> VolumesOf(const Mesh& mesh) {
  const size_t d = mesh.dimension;
  std::vector<double> volumes(mesh.simplex_count());
  for (size_t s = 0; s < volumes.size(); ++s) {
    std::vector<std::vector<long double>> m(d, std::vector<long double>(d));
    for (size_t i = 0; i < d; ++i) {
      for (size_t axis = 0; axis < d; ++axis) {
        m[i][axis] = static_cast<long double>(mesh.points[mesh.simplices[s * (d + 1) + i + 1] * d + axis]) -
                     mesh.points[mesh.simplices[s * (d + 1)] * d + axis];
      }
    }
    long double volume = 1;
    for (size_t k = 0; k < d; ++k) {
      size_t pivot = k;
      for (size_t row = k + 1; row < d; ++row) {
        pivot = std::abs(m[row][k]) > std::abs(m[pivot][k]) ? row : pivot;
      }
      std::swap(m[k], m[pivot]);
      volume *= m[k][k] / static_cast<long double>(k + 1);
      for (size_t row = k + 1; row < d; ++row) {
        const long double factor = m[row][k] / m[k][k];
        for (size_t axis = k; axis < d; ++axis) {
          m[row][axis] -= factor * m[k][axis];
        }
      }
    }
    volumes[s] = static_cast<double>(std::abs(volume));
  }
  return volumes;
}

// The sum of all values, each times the volume of its simplex; and that of their sizes.
std::pair<double, double> Mass(const Mesh& mesh, const std::vector<double>& values) {
  const std::vector<double> volumes = VolumesOf(mesh);
  long double sum = 0;
  long double sizes = 0;
  for (size_t s = 0; s < volumes.size(); ++s) {
    sum += static_cast<long double>(volumes[s]) * values[s];
    sizes += static_cast<long double>(volumes[s]) * std::abs(values[s]);
  }
  return {static_cast<double>(sum), static_cast<double>(sizes)};
}

void ExpectMassKept(const Mesh& from, const std::vector<double>& values, const Mesh& onto) {
  const CarriedField carried = Means(from, values, onto);
  EXPECT_EQ(carried.outside_count, 0u);
  const auto [before, size] = Mass(from, values);
  EXPECT_NEAR(Mass(onto, carried.values).first, before, 1e-12 * size);
  const auto [low, high] = std::ranges::minmax(values);
  EXPECT_GE(std::ranges::min(carried.values), low);
  EXPECT_LE(std::ranges::max(carried.values), high);
}

TEST(CarryField, LinearFunctionsAreCarriedExactly) {
  for (int d = 2; d <= 5; ++d) {
    const Mesh from = BoxMesh(d, d < 5 ? 60 : 3, 1);
    const Mesh onto = BoxMesh(d, d < 5 ? 80 : 2, 2);
    const std::vector<double> coordinates(from.points.begin(), from.points.end());
    const CarriedField carried = Carried(Carrying::kLinear, from, coordinates, onto, d);
    ASSERT_EQ(carried.values.size(), onto.points.size());
    EXPECT_EQ(carried.outside_count, 0u);
    for (size_t i = 0; i < carried.values.size(); ++i) {
      EXPECT_NEAR(carried.values[i], onto.points[i], 1e-13) << i;
    }
  }
}

TEST(CarryField, VerticesOfBothMeshesKeepTheirBits) {
  const auto [before, after] = BeforeAndAfter(3, 300, 40);
  ASSERT_GT(after.vertex_count(), before.vertex_count());
  std::vector<double> values = RandomNumbers(before.vertex_count(), 3);
  values[5] = -0.0;
  values[6] = std::numeric_limits<double>::denorm_min();
  values[7] = -std::numeric_limits<double>::max();
  const CarriedField carried = Carried(Carrying::kLinear, before, values, after);
  for (size_t v = 0; v < before.vertex_count(); ++v) {
    if (!std::ranges::binary_search(after.moved_vertices, v)) {
      EXPECT_EQ(std::memcmp(&carried.values[v], &values[v], sizeof(double)), 0) << v;
    }
  }
  // A vertex with another number is located, and has the same value, too.
  Mesh turned = before;
  const size_t n = turned.vertex_count();
  for (size_t v = 0; v < n; ++v) {
    std::copy_n(&before.points[v * 3], 3, &turned.points[(n - 1 - v) * 3]);
  }
  const CarriedField backwards = Carried(Carrying::kLinear, before, values, turned);
  for (size_t v = 0; v < n; ++v) {
    EXPECT_EQ(std::memcmp(&backwards.values[n - 1 - v], &values[v], sizeof(double)), 0) << v;
  }
}

TEST(CarryField, OutsideTheNearestPointCounts) {
  const Mesh from = BoxMesh(2, 30, 1);
  Mesh onto = from;
  // Beside an edge of the box, at a corner, and beside an edge by rounding alone.
  const std::vector<double> places = {0.5, 2, -3, -4, 0.5, std::nextafter(1.0, 2.0)};
  onto.points.assign(places.begin(), places.end());
  const std::vector<double> coordinates(from.points.begin(), from.points.end());
  const CarriedField carried = Carried(Carrying::kLinear, from, coordinates, onto, 2);
  EXPECT_EQ(carried.outside_count, 2u);
  const std::vector<double> expected = {0.5, 1, 0, 0, 0.5, 1};
  for (size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(carried.values[i], expected[i], 1e-15) << i;
  }
  for (int d = 3; d <= 4; ++d) {
    const Mesh box = BoxMesh(d, 10, 1);
    Mesh away = box;
    away.points = HugeVector<double>(d, 0.5);
    away.points[0] = -7;
    const std::vector<double> numbers(box.points.begin(), box.points.end());
    const CarriedField nearest = Carried(Carrying::kLinear, box, numbers, away, d);
    for (int axis = 0; axis < d; ++axis) {
      EXPECT_NEAR(nearest.values[axis], axis == 0 ? 0 : 0.5, 1e-14);
    }
  }
}

TEST(CarryField, ConstantsAreThoseOfTheCentroids) {
  for (int d = 2; d <= 4; ++d) {
    const Mesh from = BoxMesh(d, 40, 1);
    const Mesh onto = BoxMesh(d, 50, 2);
    const std::vector<double> values = RandomNumbers(from.simplex_count(), 4);
    const CarriedField carried = Carried(Carrying::kConstant, from, values, onto);
    std::vector<double> centroids(onto.simplex_count() * d);
    for (size_t i = 0; i < onto.simplices.size(); ++i) {
      for (int axis = 0; axis < d; ++axis) {
        centroids[i / (d + 1) * d + axis] += onto.points[onto.simplices[i] * size_t(d) + axis] / (d + 1);
      }
    }
    const LocatedPoints located = LocatorOf(from)->Locate(centroids, kNoContext).value();
    for (size_t t = 0; t < onto.simplex_count(); ++t) {
      EXPECT_EQ(carried.values[t], values[located.simplices[t]]) << t;
    }
  }
}

TEST(CarryField, MeansKeepTheMass) {
  for (int d = 2; d <= 3; ++d) {
    const Mesh from = BoxMesh(d, 200, 1);
    const Mesh onto = BoxMesh(d, 150, 2);
    ExpectMassKept(from, RandomNumbers(from.simplex_count(), 3), onto);
    std::vector<double> signs = RandomNumbers(from.simplex_count(), 3);
    for (double& x : signs) {
      x -= 0.5;
    }
    ExpectMassKept(from, signs, onto);
    // All of it in one simplex: the smallest, the largest, and any.
    const std::vector<double> volumes = VolumesOf(from);
    for (const size_t s : {size_t(std::ranges::min_element(volumes) - volumes.begin()),
                           size_t(std::ranges::max_element(volumes) - volumes.begin()), volumes.size() / 2}) {
      std::vector<double> one(volumes.size(), 0);
      one[s] = 1;
      ExpectMassKept(from, one, onto);
    }
    // To and from meshes that are much finer, and by grids whose facets are parallel.
    const Mesh coarse = BoxMesh(d, 0, 1);
    ExpectMassKept(coarse, RandomNumbers(coarse.simplex_count(), 3), onto);
    ExpectMassKept(onto, RandomNumbers(onto.simplex_count(), 3), coarse);
    for (const uint32_t cells : {2u, 3u, 4u}) {
      const test::TestMesh grid = test::KuhnGrid(d, cells, 0, 1.0 / cells);
      Mesh even;
      even.dimension = d;
      even.points.assign(grid.points.begin(), grid.points.end());
      even.simplices.assign(grid.simplices.begin(), grid.simplices.end());
      ExpectMassKept(from, RandomNumbers(from.simplex_count(), 3), even);
      ExpectMassKept(even, RandomNumbers(even.simplex_count(), 3), coarse);
    }
  }
}

TEST(CarryField, MeansAreIntegralsOfTheOldField) {
  // Of a field that is the number of the half of the box, each new simplex has the part that it has of it.
  const test::TestMesh halves = test::KuhnGrid(2, 1);
  Mesh from;
  from.dimension = 2;
  from.points.assign(halves.points.begin(), halves.points.end());
  from.simplices.assign(halves.simplices.begin(), halves.simplices.end());
  const Mesh onto = BoxMesh(2, 40, 2);
  const CarriedField carried = Means(from, {0, 1}, onto);
  const auto is_above = [&](uint32_t v) { return onto.points[v * 2 + 1] > onto.points[v * 2]; };
  size_t pure = 0;
  for (size_t t = 0; t < onto.simplex_count(); ++t) {
    const int above =
        is_above(onto.simplices[3 * t]) + is_above(onto.simplices[3 * t + 1]) + is_above(onto.simplices[3 * t + 2]);
    if (above == 0 || above == 3) {
      ++pure;
      EXPECT_TRUE(carried.values[t] == 0 || carried.values[t] == 1) << t;
    } else {
      EXPECT_GT(carried.values[t], 0);
      EXPECT_LT(carried.values[t], 1);
    }
  }
  EXPECT_GT(pure, 10u);
}

TEST(CarryField, SimplicesOfBothMeshesKeepTheirBits) {
  for (int d = 2; d <= 3; ++d) {
    const auto [before, after] = BeforeAndAfter(d, 300, 20);
    const std::vector<double> values = RandomNumbers(before.simplex_count(), 3);
    const CarriedField means = Means(before, values, after);
    const CarriedField constants = Carried(Carrying::kConstant, before, values, after);
    std::vector<std::pair<std::vector<uint32_t>, size_t>> old;
    const auto corners_of = [&](const Mesh& mesh, size_t s) {
      std::vector<uint32_t> corners(&mesh.simplices[s * (d + 1)], &mesh.simplices[s * (d + 1)] + d + 1);
      std::ranges::sort(corners);
      return corners;
    };
    const auto is_moved = [&](uint32_t v) { return std::ranges::binary_search(after.moved_vertices, v); };
    for (size_t s = 0; s < before.simplex_count(); ++s) {
      old.emplace_back(corners_of(before, s), s);
    }
    std::ranges::sort(old);
    size_t kept = 0;
    for (size_t t = 0; t < after.simplex_count(); ++t) {
      const std::vector<uint32_t> corners = corners_of(after, t);
      const auto twin = std::ranges::lower_bound(old, std::pair(corners, size_t{0}));
      if (twin != old.end() && twin->first == corners && std::ranges::none_of(corners, is_moved)) {
        ++kept;
        EXPECT_EQ(means.values[t], values[twin->second]);
        EXPECT_EQ(constants.values[t], values[twin->second]);
      }
    }
    EXPECT_GT(kept, before.simplex_count() / 2);
    ExpectMassKept(before, values, after);
  }
}

TEST(CarryField, MeansBeyondTheOldDomainAreThoseOfThePartWithin) {
  Mesh from = BoxMesh(2, 50, 1);
  Mesh onto = BoxMesh(2, 60, 2);
  for (size_t i = 0; i < onto.points.size(); i += 2) {
    onto.points[i] += 0.5;  // a half is outside
  }
  const std::vector<double> ones(from.simplex_count(), 1);
  const CarriedField carried = Means(from, ones, onto);
  EXPECT_GT(carried.outside_count, 5u);
  EXPECT_LT(carried.outside_count, onto.simplex_count() / 2 + 20);
  EXPECT_EQ(carried.values, std::vector<double>(onto.simplex_count(), 1));
}

TEST(CarryField, TheBitsDoNotDependOnThreads) {
  for (int d = 2; d <= 3; ++d) {
    const Mesh from = BoxMesh(d, 1200, 1);
    const Mesh onto = BoxMesh(d, 1000, 2);
    const std::vector<double> vertices = RandomNumbers(2 * from.vertex_count(), 3);
    EXPECT_EQ(Carried(Carrying::kLinear, from, vertices, onto, 2, 1).values,
              Carried(Carrying::kLinear, from, vertices, onto, 2, 4).values);
    const std::vector<double> simplices = RandomNumbers(from.simplex_count(), 3);
    EXPECT_EQ(Carried(Carrying::kConstant, from, simplices, onto, 1, 1).values,
              Carried(Carrying::kConstant, from, simplices, onto, 1, 4).values);
    EXPECT_EQ(Means(from, simplices, onto, 1, 1).values, Means(from, simplices, onto, 1, 4).values);
  }
}

TEST(CarryField, NumbersOfEveryExponentStayWithinTheirRange) {
  for (int d = 2; d <= 3; ++d) {
    Mesh from = BoxMesh(d, 6, 1);
    Mesh onto = BoxMesh(d, 5, 2);
    for (const double unit : {1.0, 0x1p-1060, 0x1p-400, 0x1p400, 0x1p1022}) {
      Mesh scaled_from = from;
      Mesh scaled_onto = onto;
      for (double& x : scaled_from.points) {
        x *= unit;
      }
      for (double& x : scaled_onto.points) {
        x *= unit;
      }
      for (const double size : {std::numeric_limits<double>::max(), std::numeric_limits<double>::denorm_min()}) {
        for (const Carrying carrying : {Carrying::kLinear, Carrying::kConstant}) {
          std::vector<double> values(carrying == Carrying::kLinear ? from.vertex_count() : from.simplex_count(), size);
          EXPECT_THAT(Carried(carrying, scaled_from, values, scaled_onto).values, testing::Each(size));
          values[0] = -size;
          EXPECT_THAT(Carried(carrying, scaled_from, values, scaled_onto).values,
                      testing::Each(testing::AllOf(testing::Ge(-size), testing::Le(size))));
        }
        std::vector<double> values(from.simplex_count(), size);
        EXPECT_THAT(Means(scaled_from, values, scaled_onto).values, testing::Each(size));
        values[0] = -size;
        EXPECT_THAT(Means(scaled_from, values, scaled_onto).values,
                    testing::Each(testing::AllOf(testing::Ge(-size), testing::Le(size))));
      }
    }
  }
}

TEST(CarryField, ErrorsNameTheRow) {
  const Mesh mesh = BoxMesh(2, 20, 1);
  std::vector<double> values(2 * mesh.vertex_count(), 1);
  const auto carry = [&](size_t components) {
    return std::string(CarryField(Carrying::kLinear, {.values = values, .components = components}, ViewOf(mesh),
                                  ViewOf(mesh), {.context = kNoContext})
                           .status()
                           .message());
  };
  EXPECT_EQ(carry(2), "");
  EXPECT_THAT(carry(1), HasSubstr(absl::StrCat("there are ", values.size(), "; expected 1 for each of the ",
                                               mesh.vertex_count(), " vertices")));
  EXPECT_NE(carry(0), "");
  values[7] = std::nan("");
  EXPECT_THAT(carry(2), HasSubstr("values[3]: component 1 is nan"));
  values[7] = -std::numeric_limits<double>::infinity();
  EXPECT_THAT(carry(2), HasSubstr("values[3]: component 1 is -inf"));
  const Mesh four = BoxMesh(4, 5, 1);
  const std::vector<double> of_simplices(four.simplex_count(), 1);
  const auto in_four =
      CarryField(Carrying::kMeans, {.values = of_simplices}, ViewOf(four), ViewOf(four), {.context = kNoContext});
  EXPECT_THAT(std::string(in_four.status().message()), HasSubstr("in 2-D and 3-D; the mesh is in 4-D"));
}

TEST(CarryField, CancelsAndMemoryThatIsNotThereEndIt) {
  const Mesh from = BoxMesh(2, 200, 1);
  const Mesh onto = BoxMesh(2, 200, 2);
  const std::vector<double> vertices(from.vertex_count(), 1);
  const std::vector<double> simplices(from.simplex_count(), 1);
  const auto expect_all = [&](const RunContext& context, absl::StatusCode code) {
    for (const Carrying carrying : {Carrying::kLinear, Carrying::kConstant, Carrying::kMeans}) {
      const Field field{.values = carrying == Carrying::kLinear ? vertices : simplices};
      const CarryRun run{.context = context, .held_bytes = 1000};
      EXPECT_EQ(CarryField(carrying, field, ViewOf(from), ViewOf(onto), run).status().code(), code);
    }
  };
  RunContext cancelled;
  cancelled.Cancel();
  expect_all(cancelled, absl::StatusCode::kCancelled);
  test::LimitedLender lender(1000 + 8 * onto.vertex_count());
  RunContext limited;
  limited.SetMemoryLender(&lender);
  expect_all(limited, absl::StatusCode::kResourceExhausted);
  lender.limit = 1'000'000;
  expect_all(limited, absl::StatusCode::kOk);
}

// Where each old simplex overlaps all new ones, the parts are far more than simplices: their memory is asked for as
// they come, and given up after each round.
TEST(CarryField, MemoryOfManyOverlapsIsAskedFor) {
  constexpr size_t kPoints = 400;
  const auto slabs = [](bool is_across) {
    std::vector<double> points;
    for (size_t i = 0; i < kPoints; ++i) {
      const double along = (i + 0.5) / kPoints;
      const double side = i % 2 == 0 ? 0.0 : 1.0;
      points.insert(points.end(), {is_across ? along : side, is_across ? side : along});
    }
    MeshParameters parameters{.dimension = 2, .rho = 1e9};
    parameters.domain_low = {0, 0};
    parameters.domain_high = {1, 1};
    RunContext context;
    return MeshPoints(parameters, points, context).value();
  };
  const Mesh from = slabs(false);
  const Mesh onto = slabs(true);
  const std::vector<double> values(from.simplex_count(), 1);
  test::LimitedLender lender(100'000'000);
  RunContext context;
  context.SetMemoryLender(&lender);
  const CarryRun run{.context = context};
  ASSERT_TRUE(CarryField(Carrying::kMeans, {.values = values}, ViewOf(from), ViewOf(onto), run).ok());
  lender.limit = 200'000;
  EXPECT_EQ(CarryField(Carrying::kMeans, {.values = values}, ViewOf(from), ViewOf(onto), run).status().code(),
            absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace wellspace::core
