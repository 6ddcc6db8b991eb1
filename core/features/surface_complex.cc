#include "core/features/surface_complex.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/cancellable_sort.h"
#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/geometry/exact_measure.h"

namespace wellspace::core {
namespace {

// Sides of a point that are sorted without a look at the context.
constexpr size_t kFewSides = 1024;

// A triangle on its way into the complex.
struct GivenTriangle {
  std::array<uint32_t, 3> corners;  // the least first
  uint32_t source;

  // Its corners in order, which way they go, and where it was given.
  auto Key() const {
    return std::tuple(corners[0], std::min(corners[1], corners[2]), std::max(corners[1], corners[2]),
                      corners[1] > corners[2], source);
  }
  bool HasTheCornersOf(const GivenTriangle& other) const {
    return corners[0] == other.corners[0] && ((corners[1] == other.corners[1] && corners[2] == other.corners[2]) ||
                                              (corners[1] == other.corners[2] && corners[2] == other.corners[1]));
  }
};

class ComplexMaker {
 public:
  ComplexMaker(const SurfaceFeatures& features, const RunContext& context) : features_(features), context_(context) {}

  absl::StatusOr<SurfaceComplex> Make(std::span<const double> points, std::span<const uint32_t> place_of) {
    if (features_.triangle_count() > std::numeric_limits<uint32_t>::max() / 3) {
      return absl::InvalidArgumentError(absl::StrCat("triangles: there are ", features_.triangle_count(),
                                                     "; expected at most ", std::numeric_limits<uint32_t>::max() / 3));
    }
    WELLSPACE_RETURN_IF_ERROR(NumberPoints(points, place_of));
    WELLSPACE_RETURN_IF_ERROR(TakeTriangles());
    WELLSPACE_RETURN_IF_ERROR(DropEqual());
    WELLSPACE_RETURN_IF_ERROR(FindEdges());
    return std::move(out_);
  }

 private:
  int32_t MarkerOf(uint32_t given) const { return features_.markers.empty() ? 0 : features_.markers[given]; }

  // Numbers the points by their places.
  absl::Status NumberPoints(std::span<const double> points, std::span<const uint32_t> place_of) {
    const auto count = static_cast<uint32_t>(points.size() / 3);
    const auto at = [&](uint32_t row) {
      Point<3> p = PointAt<3>(points, row);
      for (double& x : p) {
        x += 0.0;  // -0 becomes 0
      }
      return p;
    };
    std::vector<std::pair<Point<3>, uint32_t>> rows(count);
    for (uint32_t row = 0; row < count; ++row) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(row, context_));
      rows[row] = {at(row), row};
    }
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(rows, std::less<std::pair<Point<3>, uint32_t>>(), context_));
    std::vector<uint32_t> number(count);
    out_.points.reserve(count);
    for (uint32_t i = 0; i < count; ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      if (out_.points.empty() || out_.points.back() != rows[i].first) {
        out_.points.push_back(rows[i].first);
      }
      number[rows[i].second] = static_cast<uint32_t>(out_.points.size() - 1);
    }
    if (place_of.empty()) {
      out_.point_of_input = std::move(number);
    } else {
      out_.point_of_input.resize(place_of.size());
      for (size_t i = 0; i < place_of.size(); ++i) {
        WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
        out_.point_of_input[i] = number[place_of[i]];
      }
    }
    out_.cleaning.equal_points = count - out_.points.size();
    return absl::OkStatus();
  }

  // Takes the triangles that have an area, in the order of their corners.
  absl::Status TakeTriangles() {
    const size_t inputs = out_.point_of_input.size();
    taken_.reserve(features_.triangle_count());
    for (uint32_t t = 0; t < features_.triangle_count(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(8 * size_t{t}, context_));
      GivenTriangle triangle{.corners = {}, .source = t};
      for (uint32_t k = 0; k < 3; ++k) {
        const uint32_t input = features_.corners[3 * size_t{t} + k];
        if (input >= inputs) {
          return absl::InvalidArgumentError(
              absl::StrCat("triangles[", t, "]: its corner ", input, " is not a point; ",
                           inputs == 0 ? "there are no points" : absl::StrCat("points are 0 to ", inputs - 1)));
        }
        triangle.corners[k] = out_.point_of_input[input];
      }
      auto& [a, b, c] = triangle.corners;
      if (a == b || b == c || c == a || AreCollinear(out_.points[a], out_.points[b], out_.points[c])) {
        const Point<3>& at = out_.points[std::min({a, b, c})];
        if (out_.cleaning.flat_triangles++ == 0 || at < out_.cleaning.lowest_flat.at) {
          out_.cleaning.lowest_flat = {t, at};
        }
        continue;
      }
      std::rotate(triangle.corners.begin(), std::min_element(triangle.corners.begin(), triangle.corners.end()),
                  triangle.corners.end());
      taken_.push_back(triangle);
    }
    return CancellableSort(
        taken_, [](const GivenTriangle& t, const GivenTriangle& u) { return t.Key() < u.Key(); }, context_);
  }

  // Leaves one of the triangles over the same corners: of those that go one way the first. Their markers are compared.
  absl::Status DropEqual() {
    out_.triangles.reserve(taken_.size());
    out_.markers.reserve(taken_.size());
    out_.sources.reserve(taken_.size());
    for (size_t i = 0; i < taken_.size();) {
      size_t end = i + 1;
      int32_t least = MarkerOf(taken_[i].source);
      uint32_t source = taken_[i].source;
      bool differ = false;
      for (; end < taken_.size() && taken_[end].HasTheCornersOf(taken_[i]); ++end) {
        WELLSPACE_RETURN_IF_ERROR(CheckAt(end, context_));
        const int32_t marker = MarkerOf(taken_[end].source);
        differ = differ || marker != least;
        least = std::min(least, marker);
        source = std::min(source, taken_[end].source);
      }
      if (differ) {
        AddConflict(i, end);
      }
      if (end - i > 1 && out_.cleaning.equal_triangles == 0) {
        out_.cleaning.lowest_equal = {taken_[end - 1].source, out_.points[taken_[i].corners[0]]};
      }
      out_.cleaning.equal_triangles += end - i - 1;
      out_.triangles.push_back(taken_[i].corners);
      out_.markers.push_back(least);
      out_.sources.push_back(source);
      WELLSPACE_RETURN_IF_ERROR(CheckAt(out_.triangles.size(), context_));
      i = end;
    }
    taken_ = {};
    return absl::OkStatus();
  }

  // Adds a conflict of the equal triangles from `begin` to `end`: the first one and the first with another marker.
  void AddConflict(size_t begin, size_t end) {
    ++out_.conflict_count;
    if (out_.conflicts.size() == SurfaceComplex::kMostConflicts) {
      return;
    }
    std::vector<uint32_t> sources;
    for (size_t i = begin; i < end; ++i) {
      sources.push_back(taken_[i].source);
    }
    std::sort(sources.begin(), sources.end());
    const auto other = std::find_if(sources.begin(), sources.end(),
                                    [&](uint32_t source) { return MarkerOf(source) != MarkerOf(sources[0]); });
    out_.conflicts.push_back({sources[0], *other});
  }

  // Sorts sides by their lower points, and those of each by their higher ones.
  absl::Status FindEdges() {
    const auto side_count = static_cast<uint32_t>(3 * out_.triangles.size());
    const auto ends_of = [this](TriangleSide side) {
      const std::array<uint32_t, 3>& corners = out_.triangles[TriangleOf(side)];
      const uint32_t a = corners[side % 3];
      const uint32_t b = corners[(side + 1) % 3];
      return std::array<uint32_t, 2>{std::min(a, b), std::max(a, b)};
    };
    std::vector<uint32_t> next(out_.points.size() + 1);
    for (TriangleSide side = 0; side < side_count; ++side) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(side, context_));
      ++next[ends_of(side)[0] + 1];
    }
    std::partial_sum(next.begin(), next.end(), next.begin());
    using HighAndSide = std::pair<uint32_t, TriangleSide>;
    std::vector<HighAndSide> sorted(side_count);
    for (TriangleSide side = 0; side < side_count; ++side) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(side, context_));
      const auto [low, high] = ends_of(side);
      sorted[next[low]++] = {high, side};
    }
    next.pop_back();  // where the sides of each point end
    out_.sides.reserve(side_count);
    out_.edge_of_side.resize(side_count);
    uint32_t begin = 0;
    for (uint32_t low = 0; low < next.size(); ++low) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(8 * size_t{low}, context_));
      const auto first = sorted.begin() + begin;
      const auto last = sorted.begin() + next[low];
      if (static_cast<size_t>(last - first) <= kFewSides) {
        std::sort(first, last);
      } else {
        std::vector<HighAndSide> own(first, last);
        WELLSPACE_RETURN_IF_ERROR(CancellableSort(own, std::less<HighAndSide>(), context_));
        std::copy(own.begin(), own.end(), first);
      }
      for (auto at = first; at != last; ++at) {
        if (at == first || at->first != out_.edges.back()[1]) {
          out_.edges.push_back({low, at->first});
          out_.first_side.push_back(static_cast<uint32_t>(out_.sides.size()));
        }
        out_.edge_of_side[at->second] = static_cast<uint32_t>(out_.edges.size() - 1);
        out_.sides.push_back(at->second);
      }
      begin = next[low];
    }
    out_.first_side.push_back(static_cast<uint32_t>(out_.sides.size()));
    return absl::OkStatus();
  }

  const SurfaceFeatures& features_;
  const RunContext& context_;
  std::vector<GivenTriangle> taken_;
  SurfaceComplex out_;
};

// The bytes of a point and of a triangle: those kept, and those beside them at the peak.
constexpr uint64_t kPointBytes = 24 + 4 + 2 * 32 + 4 + 4;
constexpr uint64_t kTriangleBytes = 20 + 2 * 16 + 12 + 12 + 3 * 8 + 2 * 12 + 2 * 12;

}  // namespace

bool AreCollinear(const Point<3>& a, const Point<3>& b, const Point<3>& c) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto u = static_cast<size_t>((axis + 1) % 3);
    const auto v = static_cast<size_t>((axis + 2) % 3);
    if (Orientation<2>({{{a[u], a[v]}, {b[u], b[v]}, {c[u], c[v]}}}).sign != Sign::kZero) {
      return false;
    }
  }
  return true;
}

absl::StatusOr<SurfaceComplex> MakeSurfaceComplex(std::span<const double> points, std::span<const uint32_t> place_of,
                                                  const SurfaceFeatures& features, const RunContext& context) {
  return ComplexMaker(features, context).Make(points, place_of);
}

uint64_t SurfaceComplexBytes(uint64_t points, uint64_t triangles) {
  return points * kPointBytes + triangles * kTriangleBytes;
}

}  // namespace wellspace::core
