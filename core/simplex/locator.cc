#include "core/simplex/locator.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "core/base/cancellable_sort.h"
#include "core/base/check_at.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/simplex/determinant.h"
#include "core/simplex/nearest_place.h"

namespace wellspace::core {
namespace {

constexpr size_t kSimplicesBetweenChecks = size_t{1} << 16;

// A walk over more facets costs more than a search from the top of the tree.
constexpr int kMostSteps = 30;

// The neighbours of each simplex: over the facet opposite to each of its corners.
template <int D>
HugeVector<uint32_t> FindNeighbours(std::span<const uint32_t> simplices, size_t vertices) {
  // Facets are gathered by their lowest vertex.
  using Facet = std::array<uint32_t, D>;  // ascending
  const auto facet_of = [&](size_t place) {
    const size_t first = place / (D + 1) * (D + 1);
    Facet facet;
    for (size_t i = first, to = 0; i <= first + D; ++i) {
      if (i != place) {
        facet[to++] = simplices[i];
      }
    }
    std::ranges::sort(facet);
    return facet;
  };
  std::vector<uint64_t> ends(vertices + 1, 0);
  for (size_t place = 0; place < simplices.size(); ++place) {
    ++ends[facet_of(place)[0] + 1];
  }
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  HugeVector<uint64_t> places(simplices.size());
  for (size_t place = 0; place < simplices.size(); ++place) {
    places[ends[facet_of(place)[0]]++] = place;
  }
  HugeVector<uint32_t> across(simplices.size(), kNoSimplex);
  std::vector<std::pair<Facet, uint64_t>> around;  // the facets of one vertex
  uint64_t begin = 0;
  for (size_t v = 0; v < vertices; begin = ends[v], ++v) {
    around.clear();
    for (uint64_t k = begin; k < ends[v]; ++k) {
      around.emplace_back(facet_of(places[k]), places[k]);
    }
    std::ranges::sort(around);
    for (size_t k = 1; k < around.size(); ++k) {
      if (around[k].first == around[k - 1].first) {
        across[around[k].second] = static_cast<uint32_t>(around[k - 1].second / (D + 1));
        across[around[k - 1].second] = static_cast<uint32_t>(around[k].second / (D + 1));
      }
    }
  }
  return across;
}

// The place of `p` on the Morton curve through `box`: bits of the axes by turns, the highest first.
template <int D>
uint64_t CurvePlace(const Point<D>& p, const Box<D>& box, const Point<D>& cells_per_unit) {
  constexpr int kBits = 63 / D;
  std::array<uint64_t, D> cell;
  for (int i = 0; i < D; ++i) {
    // Halves: the difference may be beyond the range of doubles.
    const double at = (0.5 * p[i] - 0.5 * box.low[i]) * cells_per_unit[i];
    cell[i] = static_cast<uint64_t>(std::clamp(at, 0.0, static_cast<double>((uint64_t{1} << kBits) - 1)));
  }
  uint64_t place = 0;
  for (int bit = kBits - 1; bit >= 0; --bit) {
    for (int i = 0; i < D; ++i) {
      place = (place << 1) | ((cell[i] >> bit) & 1);
    }
  }
  return place;
}

template <int D>
Box<D> BoxAround(const Simplex<D>& corners) {
  Box<D> box{corners[0], corners[0]};
  for (int i = 1; i <= D; ++i) {
    box.Include(Box<D>{corners[i], corners[i]});
  }
  return box;
}

// The largest float that is not above `x`.
float RoundedDown(double x) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  if (x > std::numeric_limits<float>::max()) {
    return std::numeric_limits<float>::max();
  }
  const auto rounded = static_cast<float>(x);
  return static_cast<double>(rounded) > x ? std::nextafter(rounded, -kInfinity) : rounded;
}

// Products of differences that are so far from 1 may be beyond the range of doubles.
constexpr double kFarFromOne = 0x1p100;

// The error of a determinant of rows of differences, none of them larger than `size`, if it is known. Of
// Shewchuk, 1997: 4 eps in the plane and 8 eps in space, of the sum of the sizes of all products.
template <int D>
double ErrorBound(double size) {
  constexpr double kEpsilon = 0x1p-53;
  if constexpr (D == 2) {
    return 8 * kEpsilon * size * size;
  } else if constexpr (D == 3) {
    return 48 * kEpsilon * size * size * size;
  } else {
    return std::numeric_limits<double>::infinity();
  }
}

}  // namespace

template <int D>
Simplex<D> Locator<D>::CornersOf(uint32_t simplex) const {
  Simplex<D> corners;
  for (int i = 0; i <= D; ++i) {
    const double* p = &points_[size_t{simplices_[size_t{simplex} * (D + 1) + i]} * D];
    std::copy_n(p, D, corners[i].begin());
  }
  return corners;
}

template <int D>
absl::StatusOr<Locator<D>> Locator<D>::Create(std::span<const double> points, std::span<const uint32_t> simplices,
                                              const RunContext& context) {
  Locator locator;
  locator.points_ = points;
  locator.simplices_ = simplices;
  const size_t count = simplices.size() / (D + 1);
  if (count == 0) {
    return locator;
  }
  locator.all_ = BoxAround<D>(locator.CornersOf(0));
  for (size_t v = 0; v < points.size() / D; ++v) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(v, context));
    const Point<D> p = PointAt<D>(points, v);
    locator.all_.Include(Box<D>{p, p});
  }
  for (int i = 0; i < D; ++i) {
    locator.cells_per_unit_[i] = std::ldexp(1.0, 63 / D) / (0.5 * locator.all_.high[i] - 0.5 * locator.all_.low[i]);
  }
  HugeVector<std::pair<uint64_t, uint32_t>> places(count);
  for (size_t i = 0; i < count; ++i) {
    if (i % kSimplicesBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Box<D> box = BoxAround<D>(locator.CornersOf(static_cast<uint32_t>(i)));
    Point<D> middle;
    for (int axis = 0; axis < D; ++axis) {
      middle[axis] = 0.5 * box.low[axis] + 0.5 * box.high[axis];
    }
    places[i] = {CurvePlace<D>(middle, locator.all_, locator.cells_per_unit_), static_cast<uint32_t>(i)};
  }
  std::sort(places.begin(), places.end());
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  locator.across_ = FindNeighbours<D>(simplices, points.size() / D);
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  locator.order_.resize(count);
  std::ranges::transform(places, locator.order_.begin(), [](const auto& place) { return place.second; });

  HugeVector<RoundedBox>& boxes = locator.levels_.emplace_back(count);
  for (size_t k = 0; k < count; ++k) {
    const Box<D> box = BoxAround<D>(locator.CornersOf(locator.order_[k]));
    for (int i = 0; i < D; ++i) {
      boxes[k].low[i] = RoundedDown(box.low[i]);
      boxes[k].high[i] = -RoundedDown(-box.high[i]);
    }
  }
  while (locator.levels_.back().size() > 1) {
    const HugeVector<RoundedBox>& below = locator.levels_.back();
    HugeVector<RoundedBox> level((below.size() + kFan - 1) / kFan);
    for (size_t k = 0; k < below.size(); ++k) {
      RoundedBox& box = level[k / kFan];
      if (k % kFan == 0) {
        box = below[k];
      }
      for (int i = 0; i < D; ++i) {
        box.low[i] = std::min(box.low[i], below[k].low[i]);
        box.high[i] = std::max(box.high[i], below[k].high[i]);
      }
    }
    locator.levels_.push_back(std::move(level));
  }
  return locator;
}

template <int D>
typename Locator<D>::Side Locator<D>::Test(uint32_t simplex, const Point<D>& x, Volumes* volumes, int* beyond) const {
  Simplex<D> corners = CornersOf(simplex);
  Simplex<D> from_x;
  double size = Differences<D>(corners, x, 1, &from_x);
  if (!(size > 1 / kFarFromOne && size < kFarFromOne)) {
    double largest = 0;
    for (int axis = 0; axis < D; ++axis) {
      largest = std::max({largest, std::abs(x[axis]), std::abs(corners[0][axis]), std::abs(corners[D][axis])});
    }
    size = Differences<D>(corners, x, ScaleOf(largest), &from_x);
  }
  const double bound = ErrorBound<D>(size);
  Side side = Side::kInside;
  for (int i = 0; i <= D; ++i) {
    double volume = CornerVolume<D>(from_x, i);
    if (!(std::abs(volume) > bound)) {
      const Point<D> corner = std::exchange(corners[i], x);
      const Sign sign = Orientation<D>(corners).sign;
      corners[i] = corner;
      // A positive value may have underflown, or be lost in rounding.
      volume = sign == Sign::kZero       ? 0
               : sign == Sign::kNegative ? -1
                                         : std::max(std::abs(volume), std::numeric_limits<double>::min());
      side = sign == Sign::kZero ? Side::kOnFace : side;
    }
    if (volume < 0) {
      *beyond = i;
      return Side::kOutside;
    }
    (*volumes)[i] = volume;
  }
  return side;
}

template <int D>
PlaceInSimplex<D> Locator<D>::PlaceOf(uint32_t simplex, const Volumes& volumes) const {
  PlaceInSimplex<D> place{.simplex = simplex};
  double sum = 0;
  for (const double volume : volumes) {
    sum += volume;
  }
  for (int i = 0; i <= D; ++i) {
    place.coordinates[i] = volumes[i] / sum;
  }
  return place;
}

template <int D>
absl::StatusOr<std::vector<uint32_t>> Locator<D>::CurveOrder(std::span<const double> points,
                                                             const RunContext& context) const {
  std::vector<std::pair<uint64_t, uint32_t>> places(points.size() / D);
  for (size_t i = 0; i < places.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
    places[i] = {levels_.empty() ? 0 : CurvePlace<D>(PointAt<D>(points, i), all_, cells_per_unit_),
                 static_cast<uint32_t>(i)};
  }
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(places, std::less(), context));
  std::vector<uint32_t> order(places.size());
  std::ranges::transform(places, order.begin(), [](const auto& place) { return place.second; });
  return order;
}

template <int D>
uint32_t Locator<D>::Walk(uint32_t from, const Point<D>& x, Volumes* volumes) const {
  for (int step = 0; step < kMostSteps && from != kNoSimplex; ++step) {
    int beyond = 0;
    switch (Test(from, x, volumes, &beyond)) {
      case Side::kInside:
        return from;
      case Side::kOnFace:
        return kNoSimplex;
      case Side::kOutside:
        from = across_[size_t{from} * (D + 1) + beyond];
    }
  }
  return kNoSimplex;
}

template <int D>
PlaceInSimplex<D> Locator<D>::Locate(const Point<D>& x, uint32_t hint) const {
  Volumes volumes;
  if (const uint32_t near = hint == kNoSimplex ? hint : Walk(hint, x, &volumes); near != kNoSimplex) {
    return PlaceOf(near, volumes);
  }
  int beyond = 0;
  PlaceInSimplex<D> found{.simplex = kNoSimplex};
  Volumes found_volumes{};
  NodeStack waiting;
  if (!levels_.empty() && levels_.back()[0].Contains(x)) {
    waiting.Push({levels_.size() - 1, 0});
  }
  while (!waiting.empty()) {
    const Node node = waiting.Pop();
    if (node.level > 0) {
      const HugeVector<RoundedBox>& below = levels_[node.level - 1];
      const size_t first = node.number * kFan;
      for (size_t child = first; child < std::min(first + kFan, below.size()); ++child) {
        waiting.PushIf(below[child].Contains(x), {node.level - 1, child});
      }
      continue;
    }
    const uint32_t simplex = order_[node.number];
    const Side side = simplex < found.simplex ? Test(simplex, x, &volumes, &beyond) : Side::kOutside;
    if (side == Side::kInside) {
      return PlaceOf(simplex, volumes);
    }
    if (side == Side::kOnFace) {
      found.simplex = simplex;
      found_volumes = volumes;
    }
  }
  return found.simplex == kNoSimplex ? found : PlaceOf(found.simplex, found_volumes);
}

template <int D>
void Locator<D>::ForEachNear(const Box<D>& box, absl::FunctionRef<void(uint32_t)> f) const {
  NodeStack waiting;
  if (!levels_.empty() && levels_.back()[0].Meets(box)) {
    waiting.Push({levels_.size() - 1, 0});
  }
  while (!waiting.empty()) {
    const Node node = waiting.Pop();
    if (node.level == 0) {
      f(order_[node.number]);
      continue;
    }
    const HugeVector<RoundedBox>& below = levels_[node.level - 1];
    const size_t first = node.number * kFan;
    for (size_t child = first; child < std::min(first + kFan, below.size()); ++child) {
      if (below[child].Meets(box)) {
        waiting.Push({node.level - 1, child});
      }
    }
  }
}

template <int D>
PlaceInSimplex<D> Locator<D>::Nearest(const Point<D>& x, double* distance) const {
  PlaceInSimplex<D> nearest{.simplex = kNoSimplex};
  double least_sq = std::numeric_limits<double>::infinity();
  // Distances are squared, so they are of differences of at most about 1.
  double largest = 0;
  for (int axis = 0; axis < D; ++axis) {
    largest = std::max({largest, std::abs(x[axis]), std::abs(all_.low[axis]), std::abs(all_.high[axis])});
  }
  const double scale = ScaleOf(largest);
  NodeStack waiting;
  if (!levels_.empty()) {
    waiting.Push({levels_.size() - 1, 0});
  }
  while (!waiting.empty()) {
    const Node node = waiting.Pop();
    if (levels_[node.level][node.number].DistanceSq(x, scale) > least_sq) {
      continue;
    }
    if (node.level == 0) {
      const uint32_t simplex = order_[node.number];
      const NearestPlace<D> place = NearestIn<D>(CornersOf(simplex), x, scale);
      if (place.distance_sq < least_sq || (place.distance_sq == least_sq && simplex < nearest.simplex)) {
        least_sq = place.distance_sq;
        nearest = {.simplex = simplex, .coordinates = place.coordinates};
      }
      continue;
    }
    const HugeVector<RoundedBox>& below = levels_[node.level - 1];
    const size_t first = node.number * kFan;
    std::array<std::pair<double, size_t>, kFan> children;
    size_t count = 0;
    for (size_t child = first; child < std::min(first + kFan, below.size()); ++child) {
      children[count++] = {below[child].DistanceSq(x, scale), child};
    }
    std::sort(children.begin(), children.begin() + count, std::greater());  // the nearest is looked at first
    for (size_t k = 0; k < count; ++k) {
      waiting.Push({node.level - 1, children[k].second});
    }
  }
  *distance = std::sqrt(least_sq) / scale;
  return nearest;
}

template <int D>
uint64_t Locator<D>::BytesFor(uint64_t simplices) {
  // While it is made, there are the places on the curve beside the order, and those of facets beside the neighbours.
  return simplices * (sizeof(uint32_t) + sizeof(std::pair<uint64_t, uint32_t>) + (D + 1) * 3 * sizeof(uint32_t)) +
         simplices * sizeof(RoundedBox) * kFan / (kFan - 1);
}

#define WELLSPACE_INSTANTIATE(D) template class Locator<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
