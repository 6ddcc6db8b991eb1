// The mesher on small degenerate clouds: coordinates of a coarse grid, some a few tiny steps off, on the faces of the
// box or near them.
//
// Input: five bytes of parameters and more bytes that the first of them asks for (see ReadTask), then a byte for each
// coordinate (see ReadCoordinate).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "core/meshers/mesher.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/mesh_check.h"

namespace wellspace::fuzz {
namespace {

// By dimension: under the sanitizers a mesh of 150 vertices in 4-D or 5-D takes seconds.
constexpr std::array<size_t, 4> kMaxPoints = {24, 24, 4, 2};
constexpr std::array<uint64_t, 4> kMaxVertices = {2000, 1000, 150, 220};

// Coordinates are grid lines 0 to 7 times this.
constexpr double kGridStep = 0.125;
constexpr double kLastGridLine = 7 * kGridStep;

// The map of coordinates to those of the cloud: (x + offset) * scale.
struct Placement {
  double tiny_step = 0;
  double offset = 0;
  double scale = 1;

  double Of(double x) const { return (x + offset) * scale; }
};

// The work that is done with the points.
struct Task {
  core::MeshParameters parameters;
  Placement placement;
  // Of an edit: how many of the last points are added later, how, and the parameters then.
  bool is_edit = false;
  size_t added_points = 0;
  bool one_by_one = false;
  core::MeshParameters then;
  uint8_t samples = 0;  // for SetSamples
};

constexpr std::array kRhoFactors = {0.0, 1.0, 1.25, 2.0, 100.0};

// `box`: grown by a quarter, not grown, the grid's, the grid's but flat.
void SetBox(int box, const Placement& placement, core::MeshParameters& parameters) {
  if (box < 2) {
    parameters.margin = box == 0 ? 0.25 : 0;
    return;
  }
  parameters.domain_low.assign(parameters.dimension, placement.Of(0));
  parameters.domain_high.assign(parameters.dimension, placement.Of(kLastGridLine));
  if (box == 3) {
    parameters.domain_high.back() = placement.Of(kGridStep);
  }
}

// Bits of `axes`, the lowest for the first axis.
void SetPeriodicAxes(size_t axes, core::MeshParameters& parameters) {
  for (int axis = 0; axis < parameters.dimension; ++axis) {
    if ((axes >> axis & 1) != 0) {
      parameters.periodic_axes.push_back(axis);
    }
  }
}

// `sizes`: the lowest two bits the bound everywhere, if any, the next two that of a box, the next three where it is,
// the last one whether it is a point.
void SetSizes(uint8_t sizes, const Placement& placement, core::MeshParameters& parameters) {
  const double everywhere = std::array{0.0, 1.0, 0.5, 0.25}[sizes & 3];
  const double inside = std::array{0.0, 0.5, 0.125, 0x1p-6}[sizes >> 2 & 3];
  parameters.max_circumradius = everywhere * placement.scale;
  if (inside > 0) {
    const double low = (sizes >> 4 & 7) * kGridStep;
    const double high = low + ((sizes >> 7) != 0 ? 0 : kGridStep);
    parameters.size_boxes.push_back({std::vector<double>(parameters.dimension, placement.Of(low)),
                                     std::vector<double>(parameters.dimension, placement.Of(high)),
                                     inside * placement.scale});
  }
}

// `edit`: the lowest three bits how many points come later, the next one whether one by one, the next two rho then, the
// next one the other criterion, the last one no sizes any more.
void SetEdit(uint8_t edit, Task& task) {
  task.added_points = edit & 7;
  task.one_by_one = (edit >> 3 & 1) != 0;
  task.then = task.parameters;
  task.then.rho = kRhoFactors[edit >> 4 & 3] * core::MinimumRho(task.parameters.dimension);
  if ((edit >> 6 & 1) != 0) {
    task.then.criterion = task.parameters.criterion == core::Criterion::kWellSpaced ? core::Criterion::kRadiusEdge
                                                                                    : core::Criterion::kWellSpaced;
  }
  if ((edit >> 7) != 0) {
    task.then.max_circumradius = 0;
    task.then.size_boxes.clear();
  }
}

// Byte 0: bit 0 dimension 2 or 3, bits 1 and 2 the box (SetBox); bit 3 two dimensions more; bit 4 well-spaced; bit 5
// sizes; bit 6 an edit; bit 7 sizes at points. Byte 1: the exponent of the tiny step; from 3-D on bit 6 weights, bit 7
// no repair. Byte 2: offset. Byte 3: scale. Byte 4: rho, and periodic axes (SetPeriodicAxes). With sizes a byte more
// (SetSizes), with an edit one more (SetEdit), with sizes at points one more (SetSamples).
Task ReadTask(ByteReader& bytes) {
  constexpr std::array kOffsets = {0.0, -0.5, 1.0, 0x1p20, -0x1p35};
  constexpr std::array kScales = {1.0, 3.0, 0x1p-40, 0x1p100, 0x1p-700, 0x1p900};
  Task task;
  core::MeshParameters& parameters = task.parameters;
  Placement& placement = task.placement;
  const uint8_t shape = bytes.Next();
  const uint8_t step = bytes.Next();
  placement.tiny_step = std::ldexp(1.0, -(step % 64));
  placement.offset = kOffsets[bytes.Next() % kOffsets.size()];
  placement.scale = kScales[bytes.Next() % kScales.size()];
  parameters.dimension = 2 + (shape & 1) + ((shape >> 3 & 1) != 0 ? 2 : 0);
  const uint8_t rho = bytes.Next();
  parameters.rho = kRhoFactors[rho % kRhoFactors.size()] * core::MinimumRho(parameters.dimension);
  parameters.max_vertices = kMaxVertices[parameters.dimension - 2];
  if (parameters.dimension > 2) {
    parameters.pump_weights = (step >> 6 & 1) != 0;
    if ((step >> 7) != 0) {
      parameters.min_dihedral = 0;
    }
  }
  if ((shape >> 4 & 1) != 0) {
    parameters.criterion = core::Criterion::kWellSpaced;
  }
  if (parameters.dimension <= core::kMostPeriodicDimension && !parameters.pump_weights) {
    SetPeriodicAxes(rho / kRhoFactors.size(), parameters);
  }
  SetBox(shape >> 1 & 3, placement, parameters);
  if ((shape >> 5 & 1) != 0) {
    SetSizes(bytes.Next(), placement, parameters);
  }
  task.is_edit = (shape >> 6 & 1) != 0;
  if (task.is_edit) {
    SetEdit(bytes.Next(), task);
  }
  if ((shape >> 7) != 0) {
    task.samples = static_cast<uint8_t>(bytes.Next() | 1);
  }
  return task;
}

// The first points of a cloud have sizes. `samples`: the lowest bit whether, the next two how many of them, the next
// two the gradation, the next one whether they are lengths of edges, the last two the exponent of the sizes.
void SetSamples(uint8_t samples, const Placement& placement, std::span<const double> points,
                core::MeshParameters& parameters) {
  if ((samples & 1) == 0) {
    return;
  }
  const size_t dimension = parameters.dimension;
  const size_t count = std::min<size_t>((samples >> 1 & 3) + 1, points.size() / dimension);
  auto made = std::make_shared<core::SizeSamples>();
  made->points.assign(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(count * dimension));
  for (size_t i = 0; i < count; ++i) {
    made->sizes.push_back(std::ldexp(placement.scale, -static_cast<int>(i + (samples >> 6) * 4)));
  }
  made->measure = (samples >> 5 & 1) != 0 ? core::SizeMeasure::kEdgeLength : core::SizeMeasure::kCircumradius;
  parameters.size_samples = made;
  parameters.gradation = std::array{0.0, 1.0, 0.5, 0x1p-10}[samples >> 3 & 3];
}

// The lowest three bits: the grid line. The next three: how many tiny steps off. The highest two: at once much nearer
// to the first line.
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
  fuzz::Task task = fuzz::ReadTask(bytes);
  const core::MeshParameters& parameters = task.parameters;
  const size_t dimension = parameters.dimension;
  std::vector<double> points;
  while (bytes.size() >= dimension && points.size() < fuzz::kMaxPoints[dimension - 2] * dimension) {
    for (size_t axis = 0; axis < dimension; ++axis) {
      const double x = fuzz::ReadCoordinate(bytes, task.placement);
      // Clamped, so that boxes get points on their faces rather than outside.
      points.push_back(
          parameters.domain_low.empty() ? x : std::clamp(x, parameters.domain_low[axis], parameters.domain_high[axis]));
    }
  }
  fuzz::SetSamples(task.samples, task.placement, points, task.parameters);
  if (!core::ValidateParameters(parameters).ok()) {
    return 0;
  }
  if (!task.is_edit) {
    fuzz::RequireMeshOrRefusal(parameters, points);
  } else if (core::ValidateParameters(task.then).ok()) {
    const size_t added = std::min(points.size(), task.added_points * dimension);
    const std::span<const double> all(points);
    fuzz::RequireEditOrRefusal(parameters, all.first(all.size() - added), task.then, all.last(added), task.one_by_one);
  }
  return 0;
}
