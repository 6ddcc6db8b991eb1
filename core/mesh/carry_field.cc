#include "core/mesh/carry_field.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/check_at.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/geometry/largest_coordinate.h"
#include "core/mesh/carry_means.h"
#include "core/mesh/kept_parts.h"
#include "core/mesh/view_rows.h"

namespace wellspace::core {
namespace {

// Places of one block, which a thread locates one after the other; each is near the one before.
constexpr size_t kPlacesOfABlock = size_t{1} << 12;
constexpr size_t kPlacesBetweenChecks = size_t{1} << 8;

// A place is outside of a mesh if it is farther from it than this part of its largest coordinate; less is rounding.
constexpr double kRounding = 0x1p-40;

// The sum of rows of `values` by the weights of their simplex's corners. It is no less than the least of them, and no
// more than the largest: rounding makes no extremes.
template <int D>
void Interpolate(const Field& field, std::span<const uint32_t> corners, const std::array<double, D + 1>& weights,
                 double* result) {
  for (size_t c = 0; c < field.components; ++c) {
    double sum = -0.0;  // with it, the first addition changes no bit
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (int i = 0; i <= D; ++i) {
      if (weights[i] > 0) {
        const double value = field.values[size_t{corners[i]} * field.components + c];
        sum += weights[i] * value;
        low = std::min(low, value);
        high = std::max(high, value);
      }
    }
    result[c] = std::clamp(sum, low, high);
  }
}

void CopyRow(const Field& field, size_t from, size_t to, std::vector<double>* values) {
  std::copy_n(&field.values[from * field.components], field.components, &(*values)[to * field.components]);
}

// One transfer of values to places: vertices, or centroids of simplices.
template <int D>
class PlaceTransfer {
 public:
  PlaceTransfer(Carrying carrying, const Field& field, const MeshView& from, const MeshView& onto, const CarryRun& run)
      : is_linear_(carrying == Carrying::kLinear), field_(field), from_(from), onto_(onto), run_(run) {}

  absl::StatusOr<CarriedField> Run();

 private:
  size_t from_count() const { return from_.simplices.size() / (D + 1); }
  size_t rows() const { return is_linear_ ? onto_.points.size() / D : onto_.simplices.size() / (D + 1); }
  uint64_t Bytes() const;

  // Copies the rows of what both meshes have, and notes the places of the others.
  absl::Status CopyKept();
  // Locates the places in some simplices of the old mesh, by threads; `numbers` are those of the simplices. Says
  // whether one is outside of them by more than rounding: its row is left as it is, unless `are_all`.
  absl::StatusOr<bool> LocateAll(const Locator<D>& locator, std::span<const uint32_t> numbers, bool are_all);
  // The same of some places, one after the other.
  absl::Status LocateSome(const Locator<D>& locator, std::span<const uint32_t> numbers,
                          std::span<const uint32_t> places, bool are_all);
  void Take(size_t row, uint32_t simplex, const std::array<double, D + 1>& coordinates);

  const bool is_linear_;
  const Field& field_;
  const MeshView& from_;
  const MeshView& onto_;
  const CarryRun& run_;

  double rounding_ = 0;
  Twins twins_;
  std::vector<uint32_t> rows_;   // that are not copied
  std::vector<double> places_;   // of these: rows x D
  std::vector<uint32_t> order_;  // of the places, along a curve
  std::atomic<uint64_t> outside_ = 0;
  CarriedField carried_;
};

template <int D>
uint64_t PlaceTransfer<D>::Bytes() const {
  // Vectors grow by doubling; the order along the curve is made beside the places.
  const uint64_t of_row = field_.components * sizeof(double) + 2 * (sizeof(uint32_t) + D * sizeof(double)) + 36;
  return rows() * of_row + TwinBytes(from_count(), onto_.simplices.size() / (D + 1), onto_.points.size() / D) +
         ChangedSimplices<D>::BytesFor(from_count(), from_.points.size() / D);
}

template <int D>
absl::StatusOr<CarriedField> PlaceTransfer<D>::Run() {
  WELLSPACE_RETURN_IF_ERROR(run_.context.AllowMemory(run_.held_bytes + Bytes()));
  WELLSPACE_RETURN_IF_ERROR(CopyKept());
  if (rows_.empty()) {
    return std::move(carried_);
  }
  WELLSPACE_ASSIGN_OR_RETURN(const double largest, LargestCoordinate(from_.points, run_.context));
  rounding_ = kRounding * largest;
  bool is_outside = false;
  {
    ChangedSimplices<D> changed;
    WELLSPACE_RETURN_IF_ERROR(changed.Find(
        from_, [&](size_t i) { return !twins_.has_twin[i]; }, run_.context));
    WELLSPACE_ASSIGN_OR_RETURN(order_, changed.locator.CurveOrder(places_, run_.context));
    const bool are_all = changed.numbers.size() == from_count();
    WELLSPACE_ASSIGN_OR_RETURN(is_outside, LocateAll(changed.locator, changed.numbers, are_all));
    is_outside = is_outside && !are_all;
  }
  if (is_outside) {  // of those that have changed; the nearest simplex may be one that has not
    ChangedSimplices<D> all;
    WELLSPACE_RETURN_IF_ERROR(all.Find(
        from_, [](size_t) { return true; }, run_.context));
    WELLSPACE_RETURN_IF_ERROR(LocateAll(all.locator, all.numbers, true).status());
  }
  carried_.outside_count = outside_;
  return std::move(carried_);
}

template <int D>
absl::Status PlaceTransfer<D>::CopyKept() {
  WELLSPACE_RETURN_IF_ERROR(Fill(carried_.values, rows() * field_.components, 0, run_.context));
  for (size_t row = 0; is_linear_ && row < rows(); ++row) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(row, run_.context));
    if (IsKept<D>(from_.points, onto_.points, row)) {
      CopyRow(field_, row, row, &carried_.values);
    } else {
      rows_.push_back(static_cast<uint32_t>(row));
      places_.insert(places_.end(), &onto_.points[row * D], &onto_.points[row * D] + D);
    }
  }
  if (is_linear_ && rows_.empty()) {
    return absl::OkStatus();
  }
  WELLSPACE_ASSIGN_OR_RETURN(twins_, TwinSearch<D>(from_, onto_, run_.context).Run());
  for (size_t row = 0; !is_linear_ && row < rows(); ++row) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(row, run_.context));
    if (twins_.of_onto[row] != kNoSimplex) {
      CopyRow(field_, twins_.of_onto[row], row, &carried_.values);
    } else {
      rows_.push_back(static_cast<uint32_t>(row));
      const Point<D> centroid = CentroidOf<D>(CornersOf<D>(onto_, row));
      places_.insert(places_.end(), centroid.begin(), centroid.end());
    }
  }
  return absl::OkStatus();
}

template <int D>
absl::StatusOr<bool> PlaceTransfer<D>::LocateAll(const Locator<D>& locator, std::span<const uint32_t> numbers,
                                                 bool are_all) {
  outside_ = 0;
  const std::span<const uint32_t> all(order_);
  ThreadTeam team(run_.threads);
  const size_t blocks = (order_.size() + kPlacesOfABlock - 1) / kPlacesOfABlock;
  WELLSPACE_RETURN_IF_ERROR(team.TryForEach(blocks, [&](size_t block) {
    const size_t begin = block * kPlacesOfABlock;
    return LocateSome(locator, numbers, all.subspan(begin, std::min(kPlacesOfABlock, all.size() - begin)), are_all);
  }));
  return outside_ > 0;
}

template <int D>
absl::Status PlaceTransfer<D>::LocateSome(const Locator<D>& locator, std::span<const uint32_t> numbers,
                                          std::span<const uint32_t> places, bool are_all) {
  uint32_t hint = kNoSimplex;
  for (size_t k = 0; k < places.size(); ++k) {
    if (k % kPlacesBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(run_.context.Check());
    }
    const Point<D> x = PointAt<D>(places_, places[k]);
    PlaceInSimplex<D> place = locator.Locate(x, hint);
    double distance = 0;
    if (place.simplex == kNoSimplex) {
      place = locator.Nearest(x, &distance);
      outside_ += distance > rounding_ ? 1 : 0;
    }
    hint = place.simplex;
    if (place.simplex != kNoSimplex && (are_all || distance <= rounding_)) {
      Take(rows_[places[k]], numbers[place.simplex], place.coordinates);
    }
  }
  return absl::OkStatus();
}

template <int D>
void PlaceTransfer<D>::Take(size_t row, uint32_t simplex, const std::array<double, D + 1>& coordinates) {
  if (is_linear_) {
    Interpolate<D>(field_, from_.simplices.subspan(size_t{simplex} * (D + 1), D + 1), coordinates,
                   &carried_.values[row * field_.components]);
  } else {
    CopyRow(field_, simplex, row, &carried_.values);
  }
}

// Refuses values of another number of rows than `count`, and those that are no numbers.
absl::Status CheckField(const Field& field, size_t count, const char* of, const RunContext& context) {
  if (field.components == 0 || field.values.size() != count * field.components) {
    return absl::InvalidArgumentError(absl::StrCat("values: there are ", field.values.size(), "; expected ",
                                                   field.components, " for each of the ", count, " ", of));
  }
  for (size_t i = 0; i < field.values.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
    if (!std::isfinite(field.values[i])) {
      return absl::InvalidArgumentError(absl::StrCat("values[", i / field.components, "]: component ",
                                                     i % field.components, " is ", field.values[i],
                                                     "; a finite number is needed"));
    }
  }
  return absl::OkStatus();
}

template <int D>
absl::StatusOr<CarriedField> Carry(Carrying carrying, const Field& field, const MeshView& from, const MeshView& onto,
                                   const CarryRun& run) {
  if (carrying == Carrying::kLinear) {
    WELLSPACE_RETURN_IF_ERROR(CheckField(field, from.points.size() / D, "vertices", run.context));
  } else {
    WELLSPACE_RETURN_IF_ERROR(CheckField(field, from.simplices.size() / (D + 1), "simplices", run.context));
  }
  if (carrying != Carrying::kMeans) {
    return PlaceTransfer<D>(carrying, field, from, onto, run).Run();
  }
  if constexpr (D <= 3) {
    return CarryMeans<D>(field, from, onto, run);
  } else {
    return absl::InvalidArgumentError(
        absl::StrCat("values are carried conservatively in 2-D and 3-D; the mesh is in ", D, "-D"));
  }
}

}  // namespace

absl::StatusOr<CarriedField> CarryField(Carrying carrying, const Field& field, const MeshView& from,
                                        const MeshView& onto, const CarryRun& run) {
  switch (from.dimension) {
#define WELLSPACE_CASE(D) \
  case D:                 \
    return Carry<D>(carrying, field, from, onto, run);
    WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_CASE)
#undef WELLSPACE_CASE
    default:
      return absl::InvalidArgumentError(
          absl::StrCat("dimension is ", from.dimension, "; ", kMinDimension, " to ", kMaxDimension, " are accepted"));
  }
}

}  // namespace wellspace::core
