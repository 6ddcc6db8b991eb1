#include "server/jobs/job_size.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace wellspace::server {
namespace {

// The longest time that a small job may be expected to take: less than a second, since others have the cores too.
constexpr double kSmallSeconds = 0.25;

// By dimension, of even clouds on a machine of 2023, and a little above: vertices for each point, and the time that
// each takes.
constexpr std::array<double, core::kMaxDimension + 1> kVerticesPerPoint = {0, 0, 2, 2.5, 5, 25, 100};
constexpr std::array<double, core::kMaxDimension + 1> kSecondsPerVertex = {0, 0, 4e-6, 25e-6, 150e-6, 1.2e-3, 12e-3};

// Vertices in a cube whose side is the bound on the circumradius, and how many times more grading around a box of sizes
// makes.
constexpr double kVerticesPerCube = 4;
constexpr double kGrading = 4;

// A demand above the default takes as many times more.
constexpr double kHarderDemand = 4;

// The sides of the box that would be meshed.
std::vector<double> Sides(const core::MeshParameters& parameters, std::span<const double> points) {
  const int dimension = parameters.dimension;
  std::vector<double> sides(dimension, 0);
  if (!parameters.domain_low.empty()) {
    for (int k = 0; k < dimension; ++k) {
      sides[k] = parameters.domain_high[k] - parameters.domain_low[k];
    }
    return sides;
  }
  for (int k = 0; k < dimension; ++k) {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (size_t i = k; i < points.size(); i += dimension) {
      low = std::min(low, points[i]);
      high = std::max(high, points[i]);
    }
    sides[k] = std::max(0.0, high - low);
  }
  const double grown = 2 * parameters.margin * *std::ranges::max_element(sides);
  for (double& side : sides) {
    side += grown;
  }
  return sides;
}

// How many cubes of side `size` a box of `sides` has; NaN never compares as small.
double Cubes(std::span<const double> sides, double size) {
  double cubes = 1;
  for (const double side : sides) {
    cubes *= side / size + 1;
  }
  return cubes;
}

// Each sample stands for its part of the box.
double VerticesOfSamples(const core::MeshParameters& parameters, std::span<const double> points) {
  if (parameters.size_samples == nullptr) {
    return 0;
  }
  const int dimension = parameters.dimension;
  const core::SizeSamples& samples = *parameters.size_samples;
  std::vector<double> sides = Sides(parameters, points);
  const auto count = static_cast<double>(samples.sizes.size());
  for (double& side : sides) {
    side /= std::pow(count, 1.0 / dimension);
  }
  const double unit = samples.measure == core::SizeMeasure::kEdgeLength ? core::CircumradiusOf(1, dimension) : 1;
  double vertices = 0;
  for (const double size : samples.sizes) {
    vertices += kVerticesPerCube * Cubes(sides, unit * size);
  }
  return vertices;
}

double PredictVertices(const core::MeshParameters& parameters, std::span<const double> points) {
  const int dimension = parameters.dimension;
  const double count = static_cast<double>(points.size()) / dimension;
  double vertices = (count + 16) * kVerticesPerPoint[dimension];
  if (parameters.max_circumradius > 0) {
    vertices += kVerticesPerCube * Cubes(Sides(parameters, points), parameters.max_circumradius);
  }
  if (parameters.edge_length > 0) {
    vertices +=
        kVerticesPerCube * Cubes(Sides(parameters, points), core::CircumradiusOf(parameters.edge_length, dimension));
  }
  vertices += VerticesOfSamples(parameters, points);
  std::vector<double> sides(dimension);
  for (const core::SizeBox& box : parameters.size_boxes) {
    for (int k = 0; k < dimension; ++k) {
      sides[k] = box.high[k] - box.low[k];
    }
    vertices += kVerticesPerCube * kGrading * Cubes(sides, box.max_circumradius);
  }
  const bool is_harder = (parameters.rho != 0 && parameters.rho < core::DefaultRho(dimension)) ||
                         parameters.criterion != core::Criterion::kRadiusEdge || parameters.pump_weights;
  return is_harder ? kHarderDemand * vertices : vertices;
}

bool HasManySamples(const core::MeshParameters& parameters) {
  return parameters.size_samples != nullptr && parameters.size_samples->sizes.size() > kMostSmallPoints;
}

bool IsSmall(int dimension, double vertices) { return vertices * kSecondsPerVertex[dimension] <= kSmallSeconds; }

}  // namespace

bool IsSmallMesh(const core::MeshParameters& parameters, std::span<const double> points) {
  return points.size() / parameters.dimension <= kMostSmallPoints && !HasManySamples(parameters) &&
         IsSmall(parameters.dimension, PredictVertices(parameters, points));
}

bool IsSmallRefinement(const core::MeshParameters& parameters, std::span<const double> points, uint64_t vertices,
                       uint64_t steps) {
  const double built = static_cast<double>(vertices) * static_cast<double>(1 + steps);
  return points.size() / parameters.dimension <= kMostSmallPoints && !HasManySamples(parameters) &&
         IsSmall(parameters.dimension, built + PredictVertices(parameters, points));
}

bool IsSmallEstimate(int dimension, uint64_t points) { return points <= kMostSmallPoints >> (2 * (dimension - 2)); }

bool IsSmallAddition(uint64_t points, uint64_t vertices, uint64_t steps) {
  constexpr uint64_t kMostReplayed = 2'000;  // vertices, all steps together
  constexpr uint64_t kMostAdded = 5'000;
  return points <= kMostAdded && steps * vertices <= kMostReplayed;
}

bool IsSmallPart(bool is_cut, uint64_t simplices) {
  constexpr uint64_t kMostCut = 200'000;
  constexpr uint64_t kMostTakenFrom = 10'000'000;
  return simplices <= (is_cut ? kMostTakenFrom : kMostCut);
}

bool IsSmallTransfer(uint64_t simplices, uint64_t components) {
  constexpr uint64_t kMostSearched = 1'000'000;
  constexpr uint64_t kMostNumbers = 4'000'000;
  return simplices <= kMostSearched && simplices * components <= kMostNumbers;
}

}  // namespace wellspace::server
