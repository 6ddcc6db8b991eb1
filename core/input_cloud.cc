#include "core/input_cloud.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/base/cancellable_sort.h"
#include "core/base/dimensions.h"
#include "core/base/prefetch.h"
#include "core/base/status_macros.h"
#include "core/tree/morton.h"

namespace wellspace::core {
namespace {

// The longest side of a domain is scaled to about 1 when it is beyond these powers of two.
constexpr int kMaxScaleExponent = 60;

// A query takes less than a microsecond.
constexpr uint32_t kQueriesBetweenChecks = 256;

// Larger ones leave no room for sums and products.
constexpr double kMaxCoordinate = 0x1p1000;

std::string FormatCoordinates(std::span<const double> p) {
  return absl::StrCat(
      "(", absl::StrJoin(p, ", ", [](std::string* out, double x) { absl::StrAppendFormat(out, "%.17g", x); }), ")");
}

template <int D>
absl::Status CheckFinite(const Point<D>& p, size_t index) {
  for (int k = 0; k < D; ++k) {
    if (!std::isfinite(p[k])) {
      return absl::InvalidArgumentError(
          absl::StrCat("points[", index, "]: coordinate ", k, " is ", p[k], "; coordinates must be finite numbers"));
    }
  }
  return absl::OkStatus();
}

template <int D>
absl::Status CheckBox(const Box<D>& box) {
  double magnitude = 0;
  for (int i = 0; i < D; ++i) {
    if (!(std::abs(box.low[i]) <= kMaxCoordinate && std::abs(box.high[i]) <= kMaxCoordinate)) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "domain: along axis %d it goes from %g to %g; coordinates must be at most 2^1000; scale the points down", i,
          box.low[i], box.high[i]));
    }
    magnitude = std::max({magnitude, std::abs(box.low[i]), std::abs(box.high[i])});
  }
  for (int i = 0; i < D; ++i) {
    // The negation also catches a margin of zero around points in a plane.
    if (!(box.high[i] - box.low[i] > 0x1p-40 * magnitude) || box.high[i] - box.low[i] < 0x1p-900) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "domain: its extent along axis %d, from %.17g to %.17g, is too small; it must be at least 2^-40 of the "
          "largest coordinate, %g; give a larger domain or margin, or move the points nearer to the origin",
          i, box.low[i], box.high[i], magnitude));
    }
  }
  return absl::OkStatus();
}

// Refuses point `index`, which is `p` on the scale of the computation, if it is nearer to a face of the box that it does not lie on
// than the arithmetic serves.
template <int D>
absl::Status CheckFaces(const Domain<D>& domain, const Point<D>& p, std::span<const double> points, size_t index) {
  for (int face = 0; face < 2 * D; ++face) {
    const double distance = domain.scaled_box.DistanceToFace(p, face);
    if (distance > 0 && distance < domain.MinSeparation()) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "points[%d] = %s is only %g from the %s face of axis %d of the domain, too close for the arithmetic of "
          "doubles (on it, or at least %g away, is needed); move the domain's face",
          index, FormatCoordinates(PointAt<D>(points, index)), distance / domain.scale, face % 2 == 0 ? "low" : "high",
          face / 2, domain.MinSeparation() / domain.scale));
    }
  }
  return absl::OkStatus();
}

// A point that is sorted: half of its prefix on the Z curve, and its number.
struct Entry {
  uint32_t half = 0;
  uint32_t input = 0;
};

// Sorts by those halves. `scratch` is as long.
absl::Status SortByHalves(std::span<Entry> entries, std::span<Entry> scratch, const RunContext& context) {
  return CancellableRadixSort(
      entries, scratch, [](const Entry& entry) { return entry.half; }, context);
}

// Calls f(begin, count) -> absl::Status for each run of entries that share their half and are several.
template <typename F>
absl::Status ForEachRun(std::span<const Entry> entries, F f, const RunContext& context) {
  size_t runs = 0;
  for (size_t begin = 0, end = 0; begin < entries.size(); begin = end) {
    if (++runs % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    while (end < entries.size() && entries[end].half == entries[begin].half) {
      ++end;
    }
    if (end - begin > 1) {
      WELLSPACE_RETURN_IF_ERROR(f(begin, end - begin));
    }
  }
  return absl::OkStatus();
}

// Sorts entries by cube_of(entry) on the Z curve, those of one cube by number. `with_cubes` is scratch.
template <int D, typename CubeOf>
absl::Status SortByCubes(std::span<Entry> entries, CubeOf cube_of,
                         std::vector<std::pair<GridPoint<D>, Entry>>& with_cubes, const RunContext& context) {
  with_cubes.clear();
  for (const Entry& entry : entries) {
    with_cubes.emplace_back(cube_of(entry), entry);
  }
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(
      with_cubes,
      [](const auto& a, const auto& b) {
        return a.first != b.first ? MortonLess<D>(a.first, b.first) : a.second.input < b.second.input;
      },
      context));
  std::transform(with_cubes.begin(), with_cubes.end(), entries.begin(), [](const auto& one) { return one.second; });
  return absl::OkStatus();
}

}  // namespace

template <int D>
absl::StatusOr<Domain<D>> Domain<D>::Of(const Box<D>& box) {
  WELLSPACE_RETURN_IF_ERROR(CheckBox<D>(box));
  Domain domain;
  domain.box = box;
  const int exponent = std::ilogb(box.LongestSide());
  domain.scale = std::abs(exponent) <= kMaxScaleExponent ? 1.0 : std::ldexp(1.0, -exponent);
  domain.scaled_box = Box<D>{domain.Scaled(box.low), domain.Scaled(box.high)};
  domain.grid_step = MortonGrid<D>(domain.scaled_box).step();
  return domain;
}

template <int D>
absl::StatusOr<Box<D>> BoxAround(std::span<const double> points, double margin, const RunContext& context) {
  Box<D> box;
  if (points.empty()) {
    return absl::InvalidArgumentError(
        "points: there are none and no domain is given; give a domain or at least one point");
  }
  box.low = box.high = PointAt<D>(points, 0);
  for (size_t i = 0; i < points.size() / D; ++i) {
    if (i % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Point<D> p = PointAt<D>(points, i);
    WELLSPACE_RETURN_IF_ERROR(CheckFinite<D>(p, i));
    for (int k = 0; k < D; ++k) {
      box.low[k] = std::min(box.low[k], p[k]);
      box.high[k] = std::max(box.high[k], p[k]);
    }
  }
  double side = box.LongestSide();
  if (side == 0) {
    side = 1;  // one point, once or more often: any size serves
  }
  const double grow = margin * side;
  for (int i = 0; i < D; ++i) {
    box.low[i] -= grow;
    box.high[i] += grow;
  }
  return box;
}

template <int D>
absl::StatusOr<SortedCloud<D>> SortCloud(const Domain<D>& domain, std::span<const double> points,
                                         const RunContext& context) {
  const Box<D>& box = domain.box;
  const size_t count = points.size() / D;
  SortedCloud<D> cloud{MortonGrid<D>(domain.scaled_box, count), {}, {}, {}};
  const MortonGrid<D>& grid = cloud.grid;
  const auto point_of = [&](const Entry& entry) { return domain.Scaled(PointAt<D>(points, entry.input)); };
  const auto cube_of = [&](const Entry& entry) { return grid.CubeOf(point_of(entry)); };
  const double unscale = 1 / domain.scale;  // a power of two
  HugeVector<Entry> entries;
  entries.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    if (i % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Point<D> p = PointAt<D>(points, i);
    if (!box.Contains(p)) {
      WELLSPACE_RETURN_IF_ERROR(CheckFinite<D>(p, i));
      return absl::InvalidArgumentError(absl::StrCat(
          "points[", i, "] = ", FormatCoordinates(p), " lies outside the domain ", FormatCoordinates(box.low), " to ",
          FormatCoordinates(box.high), "; enlarge the domain or drop the point"));
    }
    const Point<D> scaled_p = domain.Scaled(p);
    for (int k = 0; k < D; ++k) {
      if (scaled_p[k] * unscale != p[k]) {
        return absl::InvalidArgumentError(absl::StrFormat(
            "points[%d]: coordinate %d is %g, too small for the arithmetic of doubles beside a domain of "
            "side %g; make it 0, or give a smaller domain",
            i, k, p[k], box.LongestSide()));
      }
    }
    const uint64_t prefix = MortonPrefix<D, 32>(grid.CubeOf(scaled_p), grid.levels());
    entries.push_back({static_cast<uint32_t>(prefix >> 32), static_cast<uint32_t>(i)});
  }
  // By the upper halves of the prefixes; those that share it, which are few in most clouds, by the lower, and then by what follows.
  {
    const std::span<Entry> all(entries);
    HugeVector<Entry> scratch(count);
    std::vector<std::pair<GridPoint<D>, Entry>> with_cubes;
    const auto sort_run = [&](size_t begin, size_t size) {
      const std::span<Entry> run = all.subspan(begin, size);
      for (Entry& entry : run) {
        entry.half = static_cast<uint32_t>(MortonPrefix<D>(cube_of(entry), grid.levels()));
      }
      WELLSPACE_RETURN_IF_ERROR(SortByHalves(run, std::span(scratch).subspan(begin, size), context));
      const auto sort_alike = [&](size_t from, size_t alike) {
        return SortByCubes<D>(run.subspan(from, alike), cube_of, with_cubes, context);
      };
      return ForEachRun(run, sort_alike, context);
    };
    WELLSPACE_RETURN_IF_ERROR(SortByHalves(all, scratch, context));
    WELLSPACE_RETURN_IF_ERROR(ForEachRun(all, sort_run, context));
  }

  // Points of one cube are equal, or too close to be served.
  // The corners of the box may follow, and the first of the vertices that are added.
  cloud.points.reserve(count + count / 8 + (size_t{1} << D));
  cloud.first_input.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    if (i % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    if (i + kAhead < count) {
      PrefetchLine(&points[size_t{entries[i + kAhead].input} * D]);
    }
    const Point<D> p = point_of(entries[i]);
    const bool may_be_alike = i > 0 && entries[i].half == entries[i - 1].half;
    if (!may_be_alike || cube_of(entries[i]) != cube_of(entries[i - 1])) {
      WELLSPACE_RETURN_IF_ERROR(CheckFaces<D>(domain, p, points, entries[i].input));
      cloud.points.push_back(p);
      cloud.first_input.push_back(entries[i].input);
    } else if (p != cloud.points.back()) {
      return TooCloseError<D>(domain, points, entries[i].input, std::sqrt(DistanceSq<D>(p, cloud.points.back())),
                              absl::StrCat("points[", cloud.first_input.back(), "]"));
    } else {
      cloud.duplicates.push_back({entries[i].input, static_cast<uint32_t>(cloud.points.size() - 1)});
    }
  }
  return cloud;
}

template <int D>
HugeVector<uint32_t> SortedCloud<D>::SortedOfInputs() const {
  HugeVector<uint32_t> sorted(first_input.size() + duplicates.size());
  for (uint32_t i = 0; i < first_input.size(); ++i) {
    sorted[first_input[i]] = i;
  }
  for (const Duplicate& duplicate : duplicates) {
    sorted[duplicate.input] = duplicate.sorted;
  }
  return sorted;
}

template <int D>
absl::StatusOr<PointNames> NamePoints(SortedCloud<D> cloud, const RunContext& context) {
  PointNames names;
  if (cloud.duplicates.empty()) {  // each is named as it was given: nothing has to be looked up
    names.of_input.resize(cloud.first_input.size());
    std::iota(names.of_input.begin(), names.of_input.end(), 0);
    names.of_sorted = std::move(cloud.first_input);
    return names;
  }
  names.of_input = cloud.SortedOfInputs();
  names.of_sorted.resize(cloud.first_input.size());
  uint32_t named = 0;
  for (uint32_t i = 0; i < names.of_input.size(); ++i) {
    if (i % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const uint32_t sorted = names.of_input[i];
    if (cloud.first_input[sorted] == i) {
      names.of_sorted[sorted] = named++;
    }
    names.of_input[i] = names.of_sorted[sorted];
  }
  return names;
}

template <int D>
absl::Status TooCloseError(const Domain<D>& domain, std::span<const double> points, size_t index, double distance,
                           std::string_view other) {
  return absl::InvalidArgumentError(absl::StrFormat(
      "points[%d] = %s is only %g from %s, too close for the arithmetic of doubles in this domain (at least %g is "
      "needed); merge them, or give a smaller domain nearer to the origin",
      index, FormatCoordinates(PointAt<D>(points, index)), distance / domain.scale, other,
      domain.MinSeparation() / domain.scale));
}

template <int D>
absl::Status CheckSeparation(const Domain<D>& domain, const QueryStructure<D>& structure, uint32_t first,
                             std::span<const uint32_t> first_input, std::span<const double> points,
                             const RunContext& context) {
  const double least = domain.MinSeparation();
  Workspace<D> workspace;
  const auto count = static_cast<uint32_t>(first_input.size());
  for (uint32_t i = 0; i < count; ++i) {
    if (i % kQueriesBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const VertexId v{first + i};
    if (structure.LeastSeparation(v) >= least) {
      continue;
    }
    const size_t input = first_input[i];
    const auto [nearest, nearest_sq] = structure.NearestWithin(v, least * least, workspace);
    // A distance of 0 is that of a point on a corner, which is one vertex with it in the mesh.
    if (nearest != kNoVertex && nearest_sq > 0) {
      const uint32_t other = Index(nearest) - first;  // a corner before them wraps around
      const bool is_input = other < count;
      return TooCloseError<D>(domain, points, input, std::sqrt(nearest_sq),
                              is_input ? absl::StrCat("points[", first_input[other], "]") : "a corner of the domain");
    }
  }
  return absl::OkStatus();
}

#define WELLSPACE_INSTANTIATE(D)                                                                                       \
  template struct Domain<D>;                                                                                           \
  template struct SortedCloud<D>;                                                                                      \
  template absl::StatusOr<Box<D>> BoxAround<D>(std::span<const double>, double, const RunContext&);                    \
  template absl::StatusOr<SortedCloud<D>> SortCloud<D>(const Domain<D>&, std::span<const double>, const RunContext&);  \
  template absl::StatusOr<PointNames> NamePoints<D>(SortedCloud<D>, const RunContext&);                                \
  template absl::Status TooCloseError<D>(const Domain<D>&, std::span<const double>, size_t, double, std::string_view); \
  template absl::Status CheckSeparation<D>(const Domain<D>&, const QueryStructure<D>&, uint32_t,                       \
                                           std::span<const uint32_t>, std::span<const double>, const RunContext&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
