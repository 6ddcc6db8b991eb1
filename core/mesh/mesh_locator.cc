#include "core/mesh/mesh_locator.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/simplex/locator.h"

namespace wellspace::core {
namespace {

constexpr size_t kPointsBetweenChecks = size_t{1} << 12;

template <int D>
class MeshLocatorIn final : public MeshLocator {
 public:
  static absl::StatusOr<std::unique_ptr<MeshLocator>> Make(Mesh mesh, const RunContext& context) {
    auto made = std::make_unique<MeshLocatorIn>();
    made->points_ = std::move(mesh.points);
    made->simplices_ = std::move(mesh.simplices);
    WELLSPACE_ASSIGN_OR_RETURN(made->locator_, Locator<D>::Create(made->points_, made->simplices_, context));
    return std::unique_ptr<MeshLocator>(std::move(made));
  }

  int dimension() const override { return D; }

  absl::StatusOr<LocatedPoints> Locate(std::span<const double> points, const RunContext& context) const override {
    const size_t count = points.size() / D;
    const auto wrong = std::ranges::find_if(points, [](double x) { return !std::isfinite(x); });
    if (wrong != points.end()) {
      const auto place = static_cast<size_t>(wrong - points.begin());
      return absl::InvalidArgumentError(absl::StrCat("points[", place / D, "]: coordinate ", place % D, " is ", *wrong,
                                                     "; a finite number is needed"));
    }
    LocatedPoints located;
    located.simplices.resize(count);
    located.vertices.resize(count * (D + 1));
    located.coordinates.resize(count * (D + 1));
    uint32_t hint = kNoSimplex;
    size_t done = 0;
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<uint32_t> order, locator_.CurveOrder(points, context));
    for (const uint32_t i : order) {
      if (done++ % kPointsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      Point<D> x;
      std::copy_n(&points[size_t{i} * D], D, x.begin());
      const PlaceInSimplex<D> place = locator_.Locate(x, hint);
      located.simplices[i] = place.simplex;
      if (place.simplex != kNoSimplex) {
        hint = place.simplex;
        std::copy_n(&simplices_[size_t{place.simplex} * (D + 1)], D + 1, &located.vertices[size_t{i} * (D + 1)]);
        std::ranges::copy(place.coordinates, &located.coordinates[size_t{i} * (D + 1)]);
      }
    }
    return located;
  }

 private:
  HugeVector<double> points_;
  HugeVector<uint32_t> simplices_;
  Locator<D> locator_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MeshLocator>> MeshLocator::Create(Mesh mesh, const RunContext& context) {
  switch (mesh.dimension) {
#define WELLSPACE_CASE(D) \
  case D:                 \
    return MeshLocatorIn<D>::Make(std::move(mesh), context);
    WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_CASE)
#undef WELLSPACE_CASE
    default:
      return absl::InvalidArgumentError(
          absl::StrCat("dimension is ", mesh.dimension, "; ", kMinDimension, " to ", kMaxDimension, " are accepted"));
  }
}

uint64_t MeshLocator::BytesFor(int dimension, uint64_t simplices) {
  switch (dimension) {
#define WELLSPACE_CASE(D) \
  case D:                 \
    return Locator<D>::BytesFor(simplices);
    WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_CASE)
#undef WELLSPACE_CASE
    default:
      return 0;
  }
}

}  // namespace wellspace::core
