// The mesher on small degenerate clouds: coordinates of a coarse grid, some a few tiny steps off, on the faces of the box or near them.
//
// Input: five bytes of parameters (see ReadParameters), then a byte for each coordinate (see ReadCoordinate).
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/mesher.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/mesh_check.h"

namespace wellspace::fuzz {
namespace {

constexpr size_t kMaxPoints = 24;
constexpr uint64_t kMaxVertices = 2000;

// Coordinates are grid lines 0 to 7 times this.
constexpr double kGridStep = 0.125;
constexpr double kLastGridLine = 7 * kGridStep;

// How coordinates become those of the cloud: (x + offset) * scale.
struct Placement {
  double tiny_step = 0;
  double offset = 0;
  double scale = 1;

  double Of(double x) const { return (x + offset) * scale; }
};

// Byte 0: bit 0 dimension, bits 1 and 2 the box: grown by a quarter, not grown, the grid's, the grid's but flat. Byte 1: the exponent
// of the tiny step. Byte 2: offset. Byte 3: scale. Byte 4: rho.
core::MeshParameters ReadParameters(ByteReader& bytes, Placement& placement) {
  constexpr std::array kOffsets = {0.0, -0.5, 1.0, 0x1p20, -0x1p35};
  constexpr std::array kScales = {1.0, 3.0, 0x1p-40, 0x1p100, 0x1p-700, 0x1p900};
  constexpr std::array kRhoFactors = {0.0, 1.0, 1.25, 2.0, 100.0};
  const uint8_t shape = bytes.Next();
  placement.tiny_step = std::ldexp(1.0, -(bytes.Next() % 64));
  placement.offset = kOffsets[bytes.Next() % kOffsets.size()];
  placement.scale = kScales[bytes.Next() % kScales.size()];
  core::MeshParameters parameters;
  parameters.dimension = (shape & 1) != 0 ? 3 : 2;
  parameters.rho = kRhoFactors[bytes.Next() % kRhoFactors.size()] * core::MinimumRho(parameters.dimension);
  parameters.max_vertices = kMaxVertices;
  const int box = shape >> 1 & 3;
  if (box < 2) {
    parameters.margin = box == 0 ? 0.25 : 0;
  } else {
    parameters.domain_low.assign(parameters.dimension, placement.Of(0));
    parameters.domain_high.assign(parameters.dimension, placement.Of(kLastGridLine));
    if (box == 3) {
      parameters.domain_high.back() = placement.Of(kGridStep);
    }
  }
  return parameters;
}

// The lowest three bits: the grid line. The next three: how many tiny steps off. The highest two: at once much nearer to the first
// line.
double ReadCoordinate(ByteReader& bytes, const Placement& placement) {
  constexpr std::array kSteps = {0, 0, 0, 0, 1, -1, 2, -3};
  constexpr std::array kShrink = {1.0, 1.0, 0x1p-4, 0x1p-16};
  const uint8_t byte = bytes.Next();
  const double x = (byte & 7) * kGridStep + kSteps[byte >> 3 & 7] * placement.tiny_step;
  return placement.Of(x * kShrink[byte >> 6]);
}

}  // namespace
}  // namespace wellspace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace wellspace;
  fuzz::ByteReader bytes(data, size);
  fuzz::Placement placement;
  const core::MeshParameters parameters = fuzz::ReadParameters(bytes, placement);
  const size_t dimension = parameters.dimension;
  std::vector<double> points;
  while (bytes.size() >= dimension && points.size() < fuzz::kMaxPoints * dimension) {
    for (size_t axis = 0; axis < dimension; ++axis) {
      const double x = fuzz::ReadCoordinate(bytes, placement);
      // Clamped, so that boxes get points on their faces rather than outside.
      points.push_back(
          parameters.domain_low.empty() ? x : std::clamp(x, parameters.domain_low[axis], parameters.domain_high[axis]));
    }
  }
  if (core::ValidateParameters(parameters).ok()) {
    fuzz::RequireMeshOrRefusal(parameters, points);
  }
  return 0;
}
