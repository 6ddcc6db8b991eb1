#include "core/input/scaled_samples.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "core/base/dimensions.h"
#include "core/base/status_macros.h"

namespace wellspace::core {
namespace {

// Sides of a scaled box, and all lengths in it that doubles can tell apart, are within 2^120 of 1. Sizes farther out
// mean the same as these, and squares of them are neither 0 nor infinite.
constexpr double kFarBeyond = 0x1p400;

// A sample that is farther from the domain than so many of its longest sides is taken to be as far as that: no size at
// such a distance says anything there, and squares of it are no infinity.
constexpr double kFarAway = 0x1p60;

template <int D>
Point<D> Within(const Box<D>& box, Point<D> p) {
  for (int axis = 0; axis < D; ++axis) {
    p[axis] = std::clamp(p[axis], box.low[axis], box.high[axis]);
  }
  return p;
}

template <int D>
std::shared_ptr<const SampleTree<D>> MakeTree(const Frame<D>& frame, const SizeSamples& samples) {
  const double reach = kFarAway * frame.scaled_box.LongestSide();
  Box<D> far = frame.scaled_box;
  for (int axis = 0; axis < D; ++axis) {
    far.low[axis] -= reach;
    far.high[axis] += reach;
  }
  std::vector<SizedPlace<Point<D>>> places(samples.sizes.size());
  for (size_t i = 0; i < places.size(); ++i) {
    const double size =
        samples.measure == SizeMeasure::kEdgeLength ? CircumradiusOf(samples.sizes[i], D) : samples.sizes[i];
    places[i] = {Within<D>(far, frame.Scaled(PointAt<D>(samples.points, i))), ScaledSize(size, frame.scale)};
  }
  return std::make_shared<const SampleTree<D>>(std::move(places));
}

}  // namespace

double ScaledSize(double size, double scale) { return std::clamp(size * scale, 1 / kFarBeyond, kFarBeyond); }

template <int D>
absl::Status ScaledSamples<D>::Take(const Frame<D>& frame, const MeshParameters& parameters,
                                    const RunContext& context) {
  if (parameters.size_samples == taken_) {
    return absl::OkStatus();
  }
  if (parameters.size_samples == nullptr) {
    taken_ = nullptr;
    tree_ = nullptr;
    return absl::OkStatus();
  }
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  tree_ = MakeTree<D>(frame, *parameters.size_samples);
  taken_ = parameters.size_samples;
  return absl::OkStatus();
}

template <int D>
std::shared_ptr<const SampleTree<D>> ScaledSamples<D>::Of(const Frame<D>& frame,
                                                          const MeshParameters& parameters) const {
  if (parameters.size_samples == nullptr || parameters.size_samples == taken_) {
    return parameters.size_samples == nullptr ? nullptr : tree_;
  }
  return MakeTree<D>(frame, *parameters.size_samples);
}

#define WELLSPACE_INSTANTIATE(D) template class ScaledSamples<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
