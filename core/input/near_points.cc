#include "core/input/near_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/cancellable_sort.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/geometry/point_grid.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

// Pairs that an error names.
constexpr size_t kNamed = 10;

// Distances looked at for each point, before pairs are no longer counted: a few where they are pairs, and not heaps.
constexpr uint64_t kLooksPerPoint = 256;

// A pair of places in a cloud that are too close.
struct Pair {
  size_t first = 0;
  size_t second = 0;
  double distance = 0;  // scaled
};

struct Pairs {
  uint64_t count = 0;
  bool is_all = true;
  std::vector<Pair> named;
};

template <int D>
absl::StatusOr<Pairs> PairsNearer(const Frame<D>& frame, std::span<const double> points, double least,
                                  const RunContext& context) {
  Pairs pairs;
  PointGrid<D> grid(frame.scaled_box, least);
  std::vector<uint32_t> place_of;  // by point of the grid
  const size_t count = points.size() / D;
  uint64_t looks = kLooksPerPoint * (count + 1024);
  for (uint32_t i = 0; i < count && pairs.is_all; ++i) {
    if (i % 1024 == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Point<D> p = frame.Scaled(PointAt<D>(points, i));
    std::vector<Pair> found;
    bool is_known = false;
    grid.ForEachNear(p, [&](uint32_t other) {
      const double distance_sq = DistanceSq<D>(p, grid[other]);
      is_known = distance_sq == 0;
      if (distance_sq > 0 && distance_sq < least * least) {
        found.push_back({place_of[other], i, std::sqrt(distance_sq)});
      }
      pairs.is_all = --looks > 0;
      return !is_known && pairs.is_all;
    });
    if (is_known) {
      continue;  // its pairs are those of the point that it is equal to
    }
    std::sort(found.begin(), found.end(), [](const Pair& a, const Pair& b) { return a.first < b.first; });
    pairs.count += found.size();
    for (size_t k = 0; k < found.size() && pairs.named.size() < kNamed; ++k) {
      pairs.named.push_back(found[k]);
    }
    grid.Add(p);
    place_of.push_back(i);
  }
  return pairs;
}

// The places of the points that are farther from the middle of the cloud than nine in ten are, by so many times that
// these are why doubles cannot tell others apart; at most one in ten.
template <int D>
std::vector<uint32_t> Outliers(const Frame<D>& frame, std::span<const double> points) {
  constexpr double kFar = 1024;
  const size_t count = points.size() / D;
  std::vector<double> values(count);
  Point<D> middle;
  for (int k = 0; k < D; ++k) {
    for (size_t i = 0; i < count; ++i) {
      values[i] = points[i * D + k] * frame.scale;
    }
    std::nth_element(values.begin(), values.begin() + count / 2, values.end());
    middle[k] = values[count / 2];
  }
  std::vector<double> distance(count);
  for (size_t i = 0; i < count; ++i) {
    distance[i] = Distance<D>(frame.Scaled(PointAt<D>(points, i)), middle);
  }
  values = distance;
  const size_t usual_place = std::max<size_t>(count - std::max<size_t>(1, count / 10), 1) - 1;
  std::nth_element(values.begin(), values.begin() + usual_place, values.end());
  const double usual = values[usual_place];
  std::vector<uint32_t> outliers;
  for (uint32_t i = 0; i < count; ++i) {
    if (usual > 0 && distance[i] > kFar * usual) {
      outliers.push_back(i);
    }
  }
  return outliers;
}

template <int D>
std::string Coordinates(std::span<const double> points, size_t place) {
  std::string text = "(";
  for (int k = 0; k < D; ++k) {
    absl::StrAppendFormat(&text, "%s%.17g", k == 0 ? "" : ", ", points[place * D + k]);
  }
  return text + ")";
}

// The error that blames points far away, if without them no pair is too close; OK if they are not to blame.
template <int D>
absl::Status BlameOutliers(const Frame<D>& frame, std::span<const double> points, std::span<const uint32_t> inputs,
                           double margin, const Pairs& pairs, const RunContext& context) {
  const std::vector<uint32_t> outliers = Outliers<D>(frame, points);
  if (outliers.empty()) {
    return absl::OkStatus();
  }
  std::vector<double> others;
  size_t next = 0;
  for (uint32_t i = 0; i < points.size() / D; ++i) {
    if (next < outliers.size() && outliers[next] == i) {
      ++next;
    } else {
      others.insert(others.end(), points.begin() + i * D, points.begin() + (i + 1) * D);
    }
  }
  WELLSPACE_ASSIGN_OR_RETURN(const Box<D> box, BoxAround<D>(others, margin, context));
  const absl::StatusOr<Frame<D>> smaller = Frame<D>::Of(box);
  if (!smaller.ok()) {
    return absl::OkStatus();
  }
  WELLSPACE_ASSIGN_OR_RETURN(const Pairs left, PairsNearer<D>(*smaller, others, smaller->MinSeparation(), context));
  if (left.count > 0) {
    return absl::OkStatus();
  }
  std::string names;
  for (size_t i = 0; i < std::min(outliers.size(), kNamed); ++i) {
    absl::StrAppend(&names, i == 0 ? "" : ", ", "points[", inputs.empty() ? outliers[i] : inputs[outliers[i]],
                    "] = ", Coordinates<D>(points, outliers[i]));
  }
  return absl::InvalidArgumentError(absl::StrFormat(
      "%s%s %s so far from the others that doubles cannot tell %s%d pairs of these apart: the domain is %g long, and "
      "%g without; drop what is far away, or give a smaller domain",
      names, outliers.size() > kNamed ? absl::StrCat(" and ", outliers.size() - kNamed, " others") : std::string(),
      outliers.size() == 1 ? "is" : "are", pairs.is_all ? "" : "more than ", pairs.count, frame.box.LongestSide(),
      box.LongestSide()));
}

}  // namespace

template <int D>
absl::StatusOr<MergedPoints> MergeNear(const Frame<D>& frame, std::span<const double> points, double distance,
                                       const RunContext& context) {
  const size_t count = points.size() / D;
  const auto scaled = [&](size_t i) { return frame.Scaled(PointAt<D>(points, i)); };
  std::vector<uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0);
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(
      order,
      [&](uint32_t a, uint32_t b) {
        const Point<D> p = scaled(a);
        const Point<D> q = scaled(b);
        return p != q ? p < q : a < b;
      },
      context));
  // Larger than any distance in the box is no larger; cells are no finer than doubles can tell apart.
  const double reach = std::min(distance * frame.scale, 4 * frame.scaled_box.LongestSide());
  const double reach_sq = reach * reach;
  PointGrid<D> grid(frame.scaled_box, std::max(reach, 0.25 * frame.MinSeparation()));
  // Finer than that, several points in reach of each other stay only where the cloud is refused: looks may be bounded.
  const uint64_t most_looks = reach < 0.25 * frame.MinSeparation() ? kLooksPerPoint : kNone;
  std::vector<uint32_t> input_of;  // by point of the grid
  std::vector<uint32_t> becomes(count, kNone);
  MergedPoints result;
  for (size_t i = 0; i < count; ++i) {
    if (i % 1024 == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Point<D> p = scaled(order[i]);
    uint32_t nearest = kNone;
    double nearest_sq = std::numeric_limits<double>::infinity();
    uint64_t looks = 0;
    grid.ForEachNear(p, [&](uint32_t other) {
      const double distance_sq = DistanceSq<D>(p, grid[other]);
      if (distance_sq <= reach_sq && (distance_sq < nearest_sq || (distance_sq == nearest_sq && other < nearest))) {
        nearest = other;
        nearest_sq = distance_sq;
      }
      return ++looks < most_looks;
    });
    if (nearest == kNone) {
      becomes[order[i]] = order[i];
      grid.Add(p);
      input_of.push_back(order[i]);
    } else {
      becomes[order[i]] = input_of[nearest];
      result.merged += nearest_sq > 0 ? 1 : 0;
    }
  }
  result.place_of.resize(count);
  for (uint32_t i = 0; i < count; ++i) {
    if (becomes[i] == i) {
      result.place_of[i] = static_cast<uint32_t>(result.inputs.size());
      result.inputs.push_back(i);
      result.points.insert(result.points.end(), points.begin() + size_t{i} * D, points.begin() + (size_t{i} + 1) * D);
    }
  }
  for (uint32_t i = 0; i < count; ++i) {
    result.place_of[i] = result.place_of[becomes[i]];
  }
  return result;
}

template <int D>
absl::StatusOr<SortedCloud<D>> SortMerged(const Frame<D>& frame, const MergedPoints& merged, int threads,
                                          const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(SortedCloud<D> cloud, SortCloud<D>(frame, merged.points, threads, context, merged.inputs));
  std::vector<uint32_t> sorted(merged.inputs.size());
  for (uint32_t i = 0; i < cloud.first_input.size(); ++i) {
    uint32_t& input = cloud.first_input[i];
    sorted[input] = i;
    input = merged.inputs[input];
  }
  for (auto& duplicate : cloud.duplicates) {  // images of points, at others
    duplicate.input = merged.inputs[duplicate.input];
  }
  for (uint32_t i = 0; i < merged.place_of.size(); ++i) {
    if (merged.inputs[merged.place_of[i]] != i) {
      cloud.duplicates.push_back({i, sorted[merged.place_of[i]]});
    }
  }
  return cloud;
}

template <int D>
absl::Status TooClosePairsError(const Frame<D>& frame, std::span<const double> points, std::span<const uint32_t> inputs,
                                bool is_domain_given, double margin, const absl::Status& found,
                                const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(const Pairs pairs, PairsNearer<D>(frame, points, frame.MinSeparation(), context));
  if (pairs.named.empty()) {
    return found;
  }
  if (!is_domain_given) {
    WELLSPACE_RETURN_IF_ERROR(BlameOutliers<D>(frame, points, inputs, margin, pairs, context));
  }
  const auto name = [&](size_t place) { return absl::StrCat("points[", inputs.empty() ? place : inputs[place], "]"); };
  const Pair& first = pairs.named.front();
  std::string text = absl::StrFormat(
      "%s = %s is only %g from %s, too close for the arithmetic of doubles in this domain (at least %g is needed); ",
      name(first.second), Coordinates<D>(points, first.second), first.distance / frame.scale, name(first.first),
      frame.MinSeparation() / frame.scale);
  if (pairs.count > 1) {
    absl::StrAppendFormat(&text, "%s%d pairs are too close: ", pairs.is_all ? "" : "more than ", pairs.count);
    for (size_t i = 0; i < pairs.named.size(); ++i) {
      const Pair& pair = pairs.named[i];
      absl::StrAppendFormat(&text, "%s%s and %s (%.3g)", i == 0 ? "" : ", ", name(pair.first), name(pair.second),
                            pair.distance / frame.scale);
    }
    absl::StrAppend(&text, pairs.count > pairs.named.size() || !pairs.is_all ? ", …; " : "; ");
  }
  absl::StrAppendFormat(
      &text, "merge them, by a merge distance (--merge) of %.2g or more, or give a smaller domain nearer to the origin",
      1.1 * frame.MinSeparation() / frame.scale);
  return absl::InvalidArgumentError(text);
}

#define WELLSPACE_INSTANTIATE(D)                                                                                       \
  template absl::StatusOr<MergedPoints> MergeNear<D>(const Frame<D>&, std::span<const double>, double,                 \
                                                     const RunContext&);                                               \
  template absl::StatusOr<SortedCloud<D>> SortMerged<D>(const Frame<D>&, const MergedPoints&, int, const RunContext&); \
  template absl::Status TooClosePairsError<D>(const Frame<D>&, std::span<const double>, std::span<const uint32_t>,     \
                                              bool, double, const absl::Status&, const RunContext&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
