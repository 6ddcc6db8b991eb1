#include "core/estimate/least_vertices.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <queue>
#include <vector>

#include "core/base/dimensions.h"
#include "core/estimate/mesh_size.h"

namespace wellspace::core {
namespace {

// The rounding of sizes and circumcentres is far below this.
constexpr double kRounding = 0.99;

// Across, no place of a box is farther than this times rho times its shortest side from a vertex: 3 sqrt(3 / 2),
// rounded up.
constexpr double kThinReach = 3.6743;

// Boxes of sizes that are held against each other, the finest.
constexpr size_t kMostRegions = 1000;

// Sizes between those of a box and those far from it are taken in steps of this ratio.
constexpr double kShellRatio = 1.25;

// Parts of the box for which sizes at points are looked at.
constexpr size_t kMostParts = 4096;

double BallVolume(int dimension) {
  return std::pow(std::numbers::pi, 0.5 * dimension) / std::tgamma(0.5 * dimension + 1);
}

// (length / size)^power without overflow of the size alone.
double CountOf(double length, double size, int power) { return std::pow(length / size, power); }

template <int D>
std::array<double, D> SidesOf(const Box<D>& box) {
  std::array<double, D> sides;
  for (int i = 0; i < D; ++i) {
    sides[i] = box.high[i] - box.low[i];
  }
  return sides;
}

// The volume that two boxes have in common, in units of `unit`^D.
template <int D>
double SharedVolume(const Box<D>& a, const Box<D>& b, double unit) {
  double volume = 1;
  for (int i = 0; i < D; ++i) {
    volume *= std::max(0.0, std::min(a.high[i], b.high[i]) - std::max(a.low[i], b.low[i])) / unit;
  }
  return volume;
}

template <int D>
Box<D> Grown(const Box<D>& box, double by) {
  Box<D> grown = box;
  for (int i = 0; i < D; ++i) {
    grown.low[i] -= by;
    grown.high[i] += by;
  }
  return grown;
}

// The least vertices that cover a box by balls of radius `reach`: the most that any projection to some axes wants.
template <int D>
double LeastToCover(const Box<D>& box, double reach) {
  std::array<double, D> sides = SidesOf<D>(box);
  std::sort(sides.begin(), sides.end(), std::greater<>());
  double least = 0;
  double count = 1;
  for (int k = 1; k <= D; ++k) {
    count *= sides[k - 1] / reach;
    least = std::max(least, count / BallVolume(k));
  }
  return least;
}

// Vertices per h^-D that there are at least, wherever h holds; and where it holds everywhere.
template <int D>
double LeastPerSize() {
  return D == 2 ? 2 / (3 * std::numbers::sqrt3) : 1 / BallVolume(D);
}
template <int D>
double LeastPerSizeEverywhere() {
  // The part of four balls about the corners of a regular tetrahedron that lies in it, over its volume.
  constexpr double kCovering3 = 1.43;
  return D == 3 ? kCovering3 / BallVolume(D) : LeastPerSize<D>();
}

// The meshed part: the box, or the faces of a domain.
template <int D>
struct BoxShape {
  Box<D> box;

  // In units of unit^D; the second about.
  double VolumeIn(const Box<D>& part, double unit) const { return SharedVolume<D>(part, box, unit); }
  double AboutIn(const Box<D>& part, double unit) const { return SharedVolume<D>(part, box, unit); }
  double Volume(double unit) const { return SharedVolume<D>(box, box, unit); }
  bool IsBounded(const SizeField<D>& sizes) const { return !sizes.IsUnbounded(); }
  double LeastSize() const { return std::numeric_limits<double>::infinity(); }
  // Vertices at least where the bound is the same everywhere, and to cover a part of the box.
  double Least(double bound, double unit) const {
    return std::max(LeastToCover<D>(box, bound), LeastPerSizeEverywhere<D>() * Volume(unit) * CountOf(unit, bound, D));
  }
  double LeastIn(const Box<D>& part, double bound) const { return LeastToCover<D>(part, bound); }
  // About how many by kVerticesPerSize: with half a layer more at each face.
  double Typical(const SizeField<D>& sizes) const {
    const double bound = std::min(sizes.max_circumradius(), box.LongestSide());
    double sum = 1;
    for (const double side : SidesOf<D>(box)) {
      sum *= side / bound + 1;
    }
    return sum;
  }
};

struct FacesShape {
  // With more boxes of sizes, the area of faces around each is estimated by the faces' share of the whole box.
  static constexpr size_t kFewRegions = 8;

  const DomainShape& domain;
  Box<2> box;
  double filled = 1;  // that part of the box
  bool has_few_regions = true;

  FacesShape(const DomainShape& shape, const SizeField<2>& sizes)
      : domain(shape), box(shape.box()), has_few_regions(sizes.regions().size() <= kFewRegions) {
    const double all = (box.high[0] - box.low[0]) * (box.high[1] - box.low[1]);
    filled = all > 0 ? std::min(1.0, shape.area() / all) : 0;
  }
  double VolumeIn(const Box<2>& part, double unit) const { return domain.AreaIn(part) / (unit * unit); }
  double AboutIn(const Box<2>& part, double unit) const {
    return has_few_regions ? VolumeIn(part, unit) : filled * SharedVolume<2>(part, box, unit);
  }
  double Volume(double unit) const { return domain.area() / (unit * unit); }
  bool IsBounded(const SizeField<2>& sizes) const { return !sizes.IsUnbounded() || !std::isinf(LeastSize()); }
  double LeastSize() const {
    double least = std::numeric_limits<double>::infinity();
    for (const DomainShape::Part& part : domain.parts()) {
      least = part.SizeFor(least);
    }
    return least;
  }
  double Least(double bound, double unit) const {
    double sum = 0;
    for (const DomainShape::Part& part : domain.parts()) {
      sum += part.area / (unit * unit) * CountOf(unit, part.SizeFor(bound), 2);
    }
    return std::max(LeastPerSize<2>() * sum, domain.LeastVertices(bound));
  }
  double LeastIn(const Box<2>& /*part*/, double /*bound*/) const { return 0; }
  double Typical(const SizeField<2>& sizes) const {
    double sum = 1;
    for (const DomainShape::Part& part : domain.parts()) {
      const double size = std::min(std::max(part.SizeFor(sizes.max_circumradius()), sizes.least()), box.LongestSide());
      sum += part.area / size / size + 0.5 * part.length / size;
    }
    return sum;
  }
};

// A part of the box, and the sizes there.
template <int D>
struct SizedPart {
  Box<D> box;
  double volume = 0;  // in units of unit^D
  double size = 0;    // in the middle
  double most = 0;    // anywhere

  double Count(double of_size, double unit) const { return volume == 0 ? 0 : volume * CountOf(unit, of_size, D); }
};

// Cuts the box in parts, in each of which h is about the same, as far as so many tell: where most vertices are wanted
// first.
template <int D, typename Shape>
std::vector<SizedPart<D>> PartsBySize(const Shape& shape, const SizeField<D>& sizes, double unit) {
  const auto part_of = [&](const Box<D>& in) {
    Point<D> middle;
    double diagonal_sq = 0;
    for (int i = 0; i < D; ++i) {
      middle[i] = 0.5 * (in.low[i] + in.high[i]);
      diagonal_sq += (in.high[i] - in.low[i]) * (in.high[i] - in.low[i]);
    }
    SizedPart<D> part{.box = in, .volume = shape.VolumeIn(in, unit)};
    part.size = std::sqrt(sizes.AtSq(middle));
    part.most =
        std::min(part.size + 0.5 * sizes.growth().of_samples * std::sqrt(diagonal_sq), sizes.max_circumradius());
    return part;
  };
  const auto is_after = [&](const SizedPart<D>& a, const SizedPart<D>& b) {
    return a.Count(a.size, unit) < b.Count(b.size, unit);
  };
  std::priority_queue<SizedPart<D>, std::vector<SizedPart<D>>, decltype(is_after)> open(is_after);
  std::vector<SizedPart<D>> parts;
  open.push(part_of(shape.box));
  while (!open.empty()) {
    const SizedPart<D> part = open.top();
    open.pop();
    if (part.most <= 2 * part.size || parts.size() + open.size() >= kMostParts) {
      parts.push_back(part);
      continue;
    }
    int axis = 0;
    for (int i = 1; i < D; ++i) {
      axis = part.box.high[i] - part.box.low[i] > part.box.high[axis] - part.box.low[axis] ? i : axis;
    }
    Box<D> low = part.box;
    Box<D> high = part.box;
    low.high[axis] = high.low[axis] = 0.5 * (part.box.low[axis] + part.box.high[axis]);
    open.push(part_of(low));
    open.push(part_of(high));
  }
  return parts;
}

// Vertices that sizes at points take at least. A simplex with a place y and circumcentre c has R <= h(c) <= h(y) + G R.
template <int D, typename Shape>
double LeastVerticesForSamples(const Shape& shape, const SizeField<D>& sizes) {
  const double slack = 1 - sizes.growth().of_samples;
  if (sizes.samples().empty() || slack == 0) {
    return 0;
  }
  const double unit = shape.box.LongestSide();
  double sum = 0;
  for (const SizedPart<D>& part : PartsBySize<D>(shape, sizes.OfSamples(), unit)) {
    sum += part.Count(part.most / slack, unit);
  }
  return LeastPerSize<D>() * sum;
}

// The least x in [least, most] with fits(x), if it fits at all from some x on; `most` if none below does.
template <typename F>
double LeastThat(double least, double most, F fits) {
  if (fits(least)) {
    return least;
  }
  for (int i = 0; i < 40; ++i) {
    const double middle = std::sqrt(least) * std::sqrt(most);
    (fits(middle) ? most : least) = middle;
  }
  return most;
}

template <int D, typename Shape>
double LeastFor(const Shape& shape, const SizeField<D>& sizes) {
  if (!shape.IsBounded(sizes)) {
    return 0;
  }
  const Box<D>& box = shape.box;
  const double unit = box.LongestSide();
  const double everywhere = sizes.max_circumradius();
  // The smallest sizes first; of each box the part in which no smaller size has been counted.
  std::vector<typename SizeField<D>::Region> regions = sizes.regions();
  std::sort(regions.begin(), regions.end(), [](const auto& a, const auto& b) { return a.size < b.size; });
  double rest = shape.Volume(unit);
  double sum = 0;
  double most = 0;
  for (size_t i = 0; i < std::min(regions.size(), kMostRegions) && regions[i].size < everywhere; ++i) {
    Box<D> inside = regions[i].place;
    bool meets = true;
    for (int k = 0; k < D; ++k) {
      inside.low[k] = std::max(inside.low[k], box.low[k]);
      inside.high[k] = std::min(inside.high[k], box.high[k]);
      meets = meets && inside.low[k] <= inside.high[k];
    }
    if (!meets) {
      continue;
    }
    double own = shape.VolumeIn(inside, unit);
    rest -= own;
    for (size_t j = 0; j < i; ++j) {
      own -= SharedVolume<D>(inside, regions[j].place, unit);
    }
    sum += std::max(0.0, own) * CountOf(unit, regions[i].size, D);
    most = std::max(most, shape.LeastIn(inside, regions[i].size));
  }
  sum += std::max(0.0, rest) * CountOf(unit, everywhere, D);
  return kRounding * std::max({shape.Least(everywhere, unit), most, LeastPerSize<D>() * sum,
                               LeastVerticesForSamples<D>(shape, sizes)});
}

// Ends early once it is above `most`.
template <int D, typename Shape>
double TypicalFor(const Shape& shape, const SizeField<D>& sizes,
                  double most = std::numeric_limits<double>::infinity()) {
  const double unit = shape.box.LongestSide();
  const double everywhere = std::min(sizes.max_circumradius(), unit);
  double sum = shape.Typical(sizes);
  const double growth = sizes.growth().of_regions;
  for (const auto& region : sizes.regions()) {
    double size = std::max(region.size, sizes.least());
    double before = 0;
    // The places nearer to the box than its size, and then shells about them, in which sizes are as large as the shell
    // is far, times the growth.
    for (double reach = size / growth; size < everywhere && kVerticesPerSize<D> * sum <= most;
         size = growth * reach, reach *= kShellRatio) {
      const double within = shape.AboutIn(Grown<D>(region.place, reach), unit);
      sum += (within - before) * CountOf(unit, size, D);
      before = within;
    }
  }
  if (!sizes.samples().empty() && kVerticesPerSize<D> * sum <= most) {
    double of_samples = 0;
    for (const SizedPart<D>& part : PartsBySize<D>(shape, sizes.OfSamples(), unit)) {
      of_samples += part.Count(std::max(part.size, 0.5 * part.most), unit);
    }
    sum = std::max(sum, of_samples);
  }
  return kVerticesPerSize<D> * sum;
}

template <int D, typename Shape>
double SmallestFor(const Shape& shape, const SizeField<D>& sizes, double vertices) {
  double least = std::min(sizes.max_circumradius(), shape.LeastSize());
  for (const auto& region : sizes.regions()) {
    least = std::min(least, region.size);
  }
  for (const auto& sample : sizes.samples()) {
    least = std::min(least, sample.size);
  }
  const double most = shape.box.LongestSide();
  return LeastThat(std::min(least, most), most, [&](double size) {
    SizeField<D> raised = sizes;
    raised.RaiseTo(size);
    return TypicalFor<D>(shape, raised, vertices) <= vertices;
  });
}

}  // namespace

template <int D>
double LeastVerticesForSizes(const Box<D>& box, const SizeField<D>& sizes) {
  return LeastFor<D>(BoxShape<D>{box}, sizes);
}
double LeastVerticesForSizes(const DomainShape& shape, const SizeField<2>& sizes) {
  return LeastFor<2>(FacesShape(shape, sizes), sizes);
}

template <int D>
double LeastVerticesForShape(const Box<D>& box, double rho) {
  return kRounding * LeastToCover<D>(box, kThinReach * rho * box.ShortestSide());
}

template <int D>
double TypicalVerticesForSizes(const Box<D>& box, const SizeField<D>& sizes) {
  return TypicalFor<D>(BoxShape<D>{box}, sizes);
}
double TypicalVerticesForSizes(const DomainShape& shape, const SizeField<2>& sizes) {
  return TypicalFor<2>(FacesShape(shape, sizes), sizes);
}

template <int D>
double TypicalVerticesForShape(const Box<D>& box) {
  // The integral of (distance to the farther of two opposite faces)^-D across the thin axis, and half a vertex for
  // each.
  double count = (std::exp2(D - 1) - 1) / (D - 1);
  for (const double side : SidesOf<D>(box)) {
    count *= side / box.ShortestSide();
  }
  return count;
}

template <int D>
double SmallestSizeFor(const Box<D>& box, const SizeField<D>& sizes, double vertices) {
  return SmallestFor<D>(BoxShape<D>{box}, sizes, vertices);
}
double SmallestSizeFor(const DomainShape& shape, const SizeField<2>& sizes, double vertices) {
  return SmallestFor<2>(FacesShape(shape, sizes), sizes, vertices);
}

template <int D>
double SmallestSideFor(const Box<D>& box, double vertices) {
  return LeastThat(box.ShortestSide(), box.LongestSide(), [&](double side) {
    Box<D> thick = box;
    for (int i = 0; i < D; ++i) {
      thick.high[i] = std::max(thick.high[i], thick.low[i] + side);
    }
    return TypicalVerticesForShape<D>(thick) <= vertices;
  });
}

#define WELLSPACE_INSTANTIATE(D)                                                  \
  template double LeastVerticesForSizes<D>(const Box<D>&, const SizeField<D>&);   \
  template double LeastVerticesForShape<D>(const Box<D>&, double);                \
  template double TypicalVerticesForSizes<D>(const Box<D>&, const SizeField<D>&); \
  template double TypicalVerticesForShape<D>(const Box<D>&);                      \
  template double SmallestSizeFor<D>(const Box<D>&, const SizeField<D>&, double); \
  template double SmallestSideFor<D>(const Box<D>&, double);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
