#include "client/cli/helpful_threads.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace wellspace::cli {
namespace {

// Vertices of a mesh for each point, without sizes: 1.6 to 1.9 of uniform clouds.
constexpr double kVerticesPerPoint = 2;

// Each thread has at least so many vertices to look after. Two threads take 1.1 to 1.6 times as long as one for the 4
// 800 vertices of spot, 1.25 times for the 9 100 of coast-110m.
constexpr double kVerticesPerThread = 10'000;

// Above 3-D a vertex costs tens of times as much.
constexpr double kVerticesPerThreadAbove3D = 1'000;

// The circumradius that a length of edges stands for, roughly.
constexpr double kRadiusOfEdge = 0.75;

// How many simplices of circumradius `size` fill a box, by its sides; that is about the number of vertices, too. 0
// without a size.
double VerticesOfSize(const std::vector<double>& sides, double size) {
  double vertices = size > 0 ? 1 : 0;
  for (const double side : sides) {
    vertices *= side / size;
  }
  return size > 0 ? vertices : 0;
}

// The same of sizes at points, each of which stands for its part of the box.
double VerticesOfSamples(const std::vector<double>& sides, const client::SizeSamples& samples) {
  const double unit = samples.measure == client::SizeMeasure::kEdgeLength ? kRadiusOfEdge : 1;
  double vertices = 0;
  for (const double size : samples.sizes) {
    vertices += VerticesOfSize(sides, unit * size) / static_cast<double>(samples.sizes.size());
  }
  return vertices;
}

// The sides of the box to be meshed.
std::vector<double> SidesOfDomain(const client::MeshOptions& options, std::span<const double> points) {
  const size_t dimension = options.dimension;
  std::vector<double> sides(dimension, 0);
  if (!options.domain_low.empty()) {
    for (size_t axis = 0; axis < dimension; ++axis) {
      sides[axis] = options.domain_high[axis] - options.domain_low[axis];
    }
    return sides;
  }
  for (size_t axis = 0; axis < dimension; ++axis) {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (size_t i = axis; i < points.size(); i += dimension) {
      low = std::min(low, points[i]);
      high = std::max(high, points[i]);
    }
    sides[axis] = std::max(0.0, high - low);
  }
  const double margin = options.margin * *std::max_element(sides.begin(), sides.end());
  for (double& side : sides) {
    side += 2 * margin;
  }
  return sides;
}

}  // namespace

int HelpfulThreads(const client::MeshOptions& options, std::span<const double> points) {
  double vertices = kVerticesPerPoint * static_cast<double>(points.size()) / options.dimension;
  vertices += VerticesOfSize(SidesOfDomain(options, points), options.max_circumradius.value_or(0));
  vertices += VerticesOfSize(SidesOfDomain(options, points), kRadiusOfEdge * options.edge_length.value_or(0));
  if (options.size_samples != nullptr) {
    vertices += VerticesOfSamples(SidesOfDomain(options, points), *options.size_samples);
  }
  for (const client::SizeBox& box : options.size_boxes) {
    std::vector<double> sides(box.high);
    for (size_t axis = 0; axis < sides.size(); ++axis) {
      sides[axis] -= box.low[axis];
    }
    vertices += VerticesOfSize(sides, box.max_circumradius);
  }
  const double threads = vertices / (options.dimension > 3 ? kVerticesPerThreadAbove3D : kVerticesPerThread);
  // Sizes that are wrong, and are refused later, may have made anything of it.
  return threads >= 1 ? static_cast<int>(std::min<double>(threads, kMostThreads)) : 1;
}

}  // namespace wellspace::cli
