#include "core/scaled_samples.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"

namespace wellspace::core {
namespace {

// Sides of a scaled box, and all lengths in it that doubles can tell apart, are within 2^120 of 1. Sizes farther out
// mean the same as these, and squares of them are neither 0 nor infinite.
constexpr double kFarBeyond = 0x1p400;

constexpr size_t kSamplesBetweenChecks = 1 << 14;

template <int D>
std::shared_ptr<const SampleTree<D>> MakeTree(const Domain<D>& domain, const SizeSamples& samples) {
  std::vector<SizedPlace<Point<D>>> places(samples.sizes.size());
  for (size_t i = 0; i < places.size(); ++i) {
    const double size =
        samples.measure == SizeMeasure::kEdgeLength ? CircumradiusOf(samples.sizes[i], D) : samples.sizes[i];
    places[i] = {domain.Scaled(PointAt<D>(samples.points, i)), ScaledSize(size, domain.scale)};
  }
  return std::make_shared<const SampleTree<D>>(std::move(places));
}

}  // namespace

double ScaledSize(double size, double scale) { return std::clamp(size * scale, 1 / kFarBeyond, kFarBeyond); }

template <int D>
absl::Status ScaledSamples<D>::Take(const Domain<D>& domain, const Box<D>& box, const MeshParameters& parameters,
                                    const RunContext& context) {
  if (parameters.size_samples == taken_) {
    return absl::OkStatus();
  }
  if (parameters.size_samples == nullptr) {
    taken_ = nullptr;
    tree_ = nullptr;
    return absl::OkStatus();
  }
  const SizeSamples& samples = *parameters.size_samples;
  for (size_t i = 0; i < samples.sizes.size(); ++i) {
    if (i % kSamplesBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Point<D> p = PointAt<D>(samples.points, i);
    if (!box.Contains(p)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "size_samples.points[", i, "]: (", absl::StrJoin(p, ", "), ") lies outside the domain from (",
          absl::StrJoin(box.low, ", "), ") to (", absl::StrJoin(box.high, ", "), "); only points in it have a size"));
    }
  }
  tree_ = MakeTree<D>(domain, samples);
  taken_ = parameters.size_samples;
  return absl::OkStatus();
}

template <int D>
std::shared_ptr<const SampleTree<D>> ScaledSamples<D>::Of(const Domain<D>& domain,
                                                          const MeshParameters& parameters) const {
  if (parameters.size_samples == nullptr || parameters.size_samples == taken_) {
    return parameters.size_samples == nullptr ? nullptr : tree_;
  }
  return MakeTree<D>(domain, *parameters.size_samples);
}

#define WELLSPACE_INSTANTIATE(D) template class ScaledSamples<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
