#include "core/features/boxed_surface.h"

#include <algorithm>
#include <array>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "core/base/cancellable_sort.h"
#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/features/plane_triangulation.h"

namespace wellspace::core {
namespace {

constexpr int kSides = 6;
constexpr uint32_t kNone = SurfaceComplex::kNoPoint;

// A triangle that is cut at six planes has at most so many corners, and is that many triangles.
constexpr uint64_t kMostCorners = 9;
constexpr uint64_t kMostParts = kMostCorners - 2;

using Real = boost::multiprecision::cpp_bin_float_quad;

// A corner of a part of a triangle.
struct Corner {
  std::array<Real, 3> at;

  Point<3> Rounded() const {
    Point<3> p;
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] = at[static_cast<size_t>(axis)].convert_to<double>();
    }
    return p;
  }
};

// Above 0 outside of the plane of a side, 0 on it.
double Beyond(const Box<3>& box, int side, const Point<3>& p) {
  const double x = p[side / 2];
  const double plane = box.FaceCoordinate(side);
  return x == plane ? 0 : ((x > plane) == (side % 2 != 0) ? 1 : -1);
}
int Beyond(const Box<3>& box, int side, const Corner& corner) {
  const int sign = corner.at[static_cast<size_t>(side / 2)].compare(Real(box.FaceCoordinate(side)));
  return side % 2 != 0 ? sign : -sign;
}

// Triangles on their way into a complex.
struct Rows {
  std::vector<double> points;
  std::vector<uint32_t> corners;
  std::vector<int32_t> markers;
  std::vector<uint32_t> sources;

  uint32_t AddPoint(const Point<3>& p) {
    points.insert(points.end(), p.begin(), p.end());
    return static_cast<uint32_t>(points.size() / 3 - 1);
  }
  void AddTriangle(const std::array<uint32_t, 3>& of, int32_t marker, uint32_t source) {
    corners.insert(corners.end(), of.begin(), of.end());
    markers.push_back(marker);
    sources.push_back(source);
  }
  static uint64_t Bytes(uint64_t points, uint64_t triangles) {
    return 2 * (points * 3 * sizeof(double) + triangles * 5 * sizeof(uint32_t));  // vectors that grow are there twice
  }
};

class BoxCutter {
 public:
  BoxCutter(const SurfaceComplex& given, const Box<3>& box, double weld, double reach, uint64_t held,
            const RunContext& context)
      : given_(given), box_(box), weld_(weld), reach_(reach), held_(held), context_(context) {}

  absl::StatusOr<BoxedSurface> Cut() {
    WELLSPACE_RETURN_IF_ERROR(TakePoints());
    WELLSPACE_RETURN_IF_ERROR(CutTriangles());
    WELLSPACE_RETURN_IF_ERROR(MakeParts());
    if (!out_.complex.triangles.empty()) {
      WELLSPACE_RETURN_IF_ERROR(AddSides());
    }
    return std::move(out_);
  }

 private:
  // The point, on the plane of each side that is within `reach`.
  template <typename Coordinates>
  Coordinates OntoSides(Coordinates p, double reach) const {
    using std::abs;
    for (int side = 0; side < kSides; ++side) {
      auto& x = p[static_cast<size_t>(side / 2)];
      const double plane = box_.FaceCoordinate(side);
      if (abs(x - plane) <= reach) {
        x = plane;
      }
    }
    return p;
  }

  // Moves points onto sides, and numbers those in the box.
  absl::Status TakePoints() {
    WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory(held_ + given_.points.size() * (sizeof(Point<3>) + 4)));
    points_.reserve(given_.points.size());
    row_of_.reserve(given_.points.size());
    for (size_t i = 0; i < given_.points.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      points_.push_back(OntoSides(given_.points[i], weld_));
      out_.moved_points += points_.back() != given_.points[i] ? 1 : 0;
    }
    return absl::OkStatus();
  }

  enum class Kind : uint8_t { kWhole, kOutside, kCut };

  // kCut: it may turn out to be outside.
  Kind KindOf(const std::array<uint32_t, 3>& corners) const {
    Kind kind = Kind::kWhole;
    for (int side = 0; side < kSides; ++side) {
      int inside = 0;
      int outside = 0;
      for (const uint32_t corner : corners) {
        const double beyond = Beyond(box_, side, points_[corner]);
        inside += beyond < 0 ? 1 : 0;
        outside += beyond > 0 ? 1 : 0;
      }
      if (outside > 0 && inside == 0) {
        return Kind::kOutside;
      }
      kind = outside > 0 ? Kind::kCut : kind;
    }
    return kind;
  }

  absl::Status CutTriangles() {
    std::vector<Kind> kinds(given_.triangles.size());
    std::array<uint64_t, 3> counts{};
    for (size_t t = 0; t < given_.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      kinds[t] = KindOf(given_.triangles[t]);
      ++counts[static_cast<size_t>(kinds[t])];
    }
    const uint64_t whole = counts[static_cast<size_t>(Kind::kWhole)];
    const uint64_t cut = counts[static_cast<size_t>(Kind::kCut)];
    const uint64_t most_points = given_.points.size() + kMostCorners * cut;
    const uint64_t most_parts = whole + kMostParts * cut;
    held_ += given_.points.size() * (sizeof(Point<3>) + sizeof(uint32_t)) + given_.triangles.size();
    WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory(held_ + Rows::Bytes(most_points, most_parts) +
                                                   SurfaceComplexBytes(most_points, most_parts)));
    for (const Point<3>& p : points_) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(row_of_.size(), context_));
      row_of_.push_back(box_.Contains(p) ? rows_.AddPoint(p) : kNone);
    }
    for (uint32_t t = 0; t < kinds.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(8 * size_t{t}, context_));
      const auto& [a, b, c] = given_.triangles[t];
      if (kinds[t] == Kind::kWhole) {
        rows_.AddTriangle({row_of_[a], row_of_[b], row_of_[c]}, given_.markers[t], given_.sources[t]);
      } else if (kinds[t] == Kind::kCut && AddParts(t)) {
        ++out_.cut_triangles;
      } else {
        ++out_.outside_triangles;
      }
    }
    return absl::OkStatus();
  }

  // Where the segment between two corners on both sides of the plane of `side` crosses it; the same from both ends.
  Corner CrossingOf(const Corner& one, const Corner& other, int side) const {
    const auto& [from, to] = std::minmax(one, other, [](const Corner& p, const Corner& q) { return p.at < q.at; });
    const auto axis = static_cast<size_t>(side / 2);
    const double plane = box_.FaceCoordinate(side);
    const Real share = (Real(plane) - from.at[axis]) / (to.at[axis] - from.at[axis]);
    Corner crossing;
    for (size_t k = 0; k < 3; ++k) {
      crossing.at[k] = from.at[k] + share * (to.at[k] - from.at[k]);
    }
    crossing.at[axis] = plane;
    crossing.at = OntoSides(crossing.at, reach_);
    return crossing;
  }

  // Leaves of `polygon` what is not beyond a side; nothing, if that has no area.
  void CutAt(int side, std::vector<Corner>& polygon) {
    kept_.clear();
    bool is_some_inside = false;
    bool is_some_outside = false;
    for (size_t i = 0; i < polygon.size(); ++i) {
      const Corner& one = polygon[i];
      const Corner& next = polygon[(i + 1) % polygon.size()];
      const int at_one = Beyond(box_, side, one);
      const int at_next = Beyond(box_, side, next);
      is_some_inside = is_some_inside || at_one < 0;
      is_some_outside = is_some_outside || at_one > 0;
      if (at_one <= 0) {
        kept_.push_back(one);
      }
      if (at_one * at_next < 0) {
        kept_.push_back(CrossingOf(one, next, side));
      }
    }
    if (is_some_outside && !is_some_inside) {
      kept_.clear();
    }
    std::swap(polygon, kept_);
  }

  // Adds the part of a triangle in the box; returns whether there is one.
  bool AddParts(uint32_t t) {
    polygon_.clear();
    for (const uint32_t corner : given_.triangles[t]) {
      const Point<3>& p = points_[corner];
      polygon_.push_back({{Real(p[0]), Real(p[1]), Real(p[2])}});
    }
    for (int side = 0; side < kSides; ++side) {
      CutAt(side, polygon_);
    }
    rounded_.clear();
    for (const Corner& corner : polygon_) {
      if (const Point<3> p = corner.Rounded(); rounded_.empty() || p != rounded_.back()) {
        rounded_.push_back(p);
      }
    }
    while (rounded_.size() > 1 && rounded_.back() == rounded_.front()) {
      rounded_.pop_back();
    }
    if (rounded_.size() < 3) {
      return false;
    }
    const size_t apex = ApexOfFan();
    std::rotate(rounded_.begin(), rounded_.begin() + static_cast<ptrdiff_t>(apex), rounded_.end());
    std::vector<uint32_t> rows;
    for (const Point<3>& p : rounded_) {
      rows.push_back(rows_.AddPoint(p));
    }
    for (size_t i = 2; i < rows.size(); ++i) {
      rows_.AddTriangle({rows[0], rows[i - 1], rows[i]}, given_.markers[t], given_.sources[t]);
    }
    return true;
  }

  // The lowest corner of rounded_ from which no triangle of a fan is flat; the lowest one, if there is none.
  size_t ApexOfFan() const {
    const size_t count = rounded_.size();
    std::vector<size_t> order(count);
    for (size_t i = 0; i < count; ++i) {
      order[i] = i;
    }
    std::sort(order.begin(), order.end(), [this](size_t i, size_t k) { return rounded_[i] < rounded_[k]; });
    for (const size_t apex : order) {
      bool is_flat = false;
      for (size_t i = 1; i + 1 < count && !is_flat; ++i) {
        is_flat = AreCollinear(rounded_[apex], rounded_[(apex + i) % count], rounded_[(apex + i + 1) % count]);
      }
      if (!is_flat) {
        return apex;
      }
    }
    return order[0];
  }

  // Makes a complex of all rows; sources and points of input are those of the given one.
  absl::StatusOr<SurfaceComplex> MakeComplex() {
    SurfaceFeatures features;
    features.corners = rows_.corners;
    features.markers = rows_.markers;
    WELLSPACE_ASSIGN_OR_RETURN(SurfaceComplex complex, MakeSurfaceComplex(rows_.points, {}, features, context_));
    for (uint32_t& source : complex.sources) {
      source = rows_.sources[source];
    }
    const std::vector<uint32_t> point_of_row =
        std::exchange(complex.point_of_input, std::vector<uint32_t>(given_.point_of_input.size()));
    for (size_t i = 0; i < given_.point_of_input.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      const uint32_t row = row_of_[given_.point_of_input[i]];
      complex.point_of_input[i] = row == kNone ? SurfaceComplex::kNoPoint : point_of_row[row];
    }
    // Its numbers of points take the place of rows.
    for (uint32_t& row : row_of_) {
      row = row == kNone ? kNone : point_of_row[row];
    }
    return complex;
  }

  // The complex of the parts of triangles.
  absl::Status MakeParts() {
    WELLSPACE_ASSIGN_OR_RETURN(out_.complex, MakeComplex());
    std::vector<MarkerConflict> conflicts = given_.conflicts;
    for (const MarkerConflict& conflict : out_.complex.conflicts) {
      conflicts.push_back({rows_.sources[conflict.one], rows_.sources[conflict.other]});
    }
    conflicts_ = given_.conflict_count + out_.complex.conflict_count;
    conflicts.resize(std::min(conflicts.size(), SurfaceComplex::kMostConflicts));
    out_.complex.conflicts = conflicts;
    out_.complex.conflict_count = conflicts_;
    out_.complex.cleaning = given_.cleaning;
    return absl::OkStatus();
  }

  // Makes the sides of the box triangles of the complex.
  absl::Status AddSides() {
    const SurfaceComplex& parts = out_.complex;
    std::vector<bool> is_used(parts.points.size());
    for (size_t t = 0; t < parts.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      for (const uint32_t corner : parts.triangles[t]) {
        is_used[corner] = true;
      }
    }
    uint64_t on_sides = 0;
    for (size_t i = 0; i < parts.points.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      on_sides += is_used[i] && box_.FacesOf(parts.points[i]) != 0 ? 3 : 0;  // of three at most
    }
    on_sides += uint64_t{kSides} * 4;
    const uint64_t triangles = parts.triangles.size() + 2 * on_sides;
    const uint64_t points = parts.points.size() + 8;
    // Of m points in a plane that segments without crossings have for ends, there are fewer than 3 m.
    WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory(
        held_ + SurfaceComplexBytes(parts.points.size(), parts.triangles.size()) + Rows::Bytes(points, triangles) +
        SurfaceComplexBytes(points, triangles) + PlaneTriangulationBytes(on_sides, 4 * on_sides) +
        on_sides * (sizeof(Point<2>) + 4 * sizeof(uint32_t))));
    rows_ = {};
    for (const Point<3>& p : parts.points) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(rows_.points.size(), context_));
      rows_.AddPoint(p);
    }
    for (uint32_t t = 0; t < parts.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      rows_.AddTriangle(parts.triangles[t], parts.markers[t], parts.sources[t]);
    }
    std::array<uint32_t, 8> box_corners{};
    for (size_t k = 0; k < 8; ++k) {
      Point<3> p;
      for (size_t axis = 0; axis < 3; ++axis) {
        p[axis] = ((k >> axis) & 1) != 0 ? box_.high[axis] : box_.low[axis];
      }
      const auto known = std::lower_bound(parts.points.begin(), parts.points.end(), p);
      const bool is_known = known != parts.points.end() && *known == p;
      box_corners[k] = is_known ? static_cast<uint32_t>(known - parts.points.begin()) : rows_.AddPoint(p);
      if (is_known) {
        is_used[box_corners[k]] = true;
      }
    }
    is_used.resize(rows_.points.size() / 3, true);
    for (int side = 0; side < kSides && !out_.do_meet; ++side) {
      WELLSPACE_RETURN_IF_ERROR(AddSide(side, is_used));
    }
    if (out_.do_meet) {
      return absl::OkStatus();
    }
    WELLSPACE_ASSIGN_OR_RETURN(SurfaceComplex complex, MakeComplex());
    complex.conflicts = std::move(out_.complex.conflicts);
    complex.conflict_count = conflicts_;
    complex.cleaning = given_.cleaning;
    out_.complex = std::move(complex);
    return absl::OkStatus();
  }

  // Adds the triangles of a side.
  absl::Status AddSide(int side, const std::vector<bool>& is_used) {
    const auto axis = static_cast<size_t>(side / 2);
    const size_t u = (axis + 1) % 3;
    const size_t v = (axis + 2) % 3;
    std::vector<std::pair<Point<2>, uint32_t>> found;  // points in the side, and their rows
    for (uint32_t row = 0; row < is_used.size(); ++row) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(row, context_));
      const Point<3> p = PointAt<3>(rows_.points, row);
      if (is_used[row] && p[axis] == box_.FaceCoordinate(side)) {
        found.push_back({Point<2>{p[u], p[v]}, row});
      }
    }
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(found, std::less<std::pair<Point<2>, uint32_t>>(), context_));
    std::vector<Point<2>> points;
    std::vector<uint32_t> row_of;
    std::vector<uint32_t> number_of(is_used.size(), kNone);  // by row
    for (const auto& [p, row] : found) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(points.size(), context_));
      number_of[row] = static_cast<uint32_t>(points.size());
      points.push_back(p);
      row_of.push_back(row);
    }
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<SegmentEnds> segments,
                               SegmentsIn({box_.low[u], box_.low[v]}, {box_.high[u], box_.high[v]}, points, number_of));
    WELLSPACE_ASSIGN_OR_RETURN(const PlaneTriangulation made, TriangulatePlane(points, segments, context_));
    out_.do_meet = made.do_meet;
    // Triangles of the surface in this side, by their corners, which ascend.
    std::vector<std::array<uint32_t, 3>> known;
    for (size_t t = 0; t < out_.complex.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      std::array<uint32_t, 3> corners = out_.complex.triangles[t];
      if (std::none_of(corners.begin(), corners.end(), [&](uint32_t row) { return number_of[row] == kNone; })) {
        std::sort(corners.begin(), corners.end());
        known.push_back(corners);
      }
    }
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(known, std::less<std::array<uint32_t, 3>>(), context_));
    for (size_t i = 0; i < made.triangles.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      std::array<uint32_t, 3> corners;
      for (size_t k = 0; k < 3; ++k) {
        corners[k] = row_of[made.triangles[i][k]];
      }
      if (side % 2 == 0) {
        std::swap(corners[1], corners[2]);
      }
      std::array<uint32_t, 3> sorted = corners;
      std::sort(sorted.begin(), sorted.end());
      if (!std::binary_search(known.begin(), known.end(), sorted)) {
        rows_.AddTriangle(corners, kFirstSideMarker + side, SurfaceComplex::kNoSource);
      }
    }
    return absl::OkStatus();
  }

  // The edges of the surface in a side, from `low` to `high`, and those of the side from point to point.
  absl::StatusOr<std::vector<SegmentEnds>> SegmentsIn(const Point<2>& low, const Point<2>& high,
                                                      const std::vector<Point<2>>& points,
                                                      const std::vector<uint32_t>& number_of) const {
    std::vector<SegmentEnds> segments;
    for (size_t e = 0; e < out_.complex.edges.size(); ++e) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(e, context_));
      const auto [a, b] = out_.complex.edges[e];
      if (number_of[a] != kNone && number_of[b] != kNone) {
        const auto [first, second] = std::minmax(number_of[a], number_of[b]);
        segments.push_back({first, second});
      }
    }
    for (size_t along = 0; along < 2; ++along) {  // points ascend along both axes
      const size_t across = 1 - along;
      for (const double line : {low[across], high[across]}) {
        uint32_t last = kNone;
        for (uint32_t i = 0; i < points.size(); ++i) {
          WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
          if (points[i][across] == line) {
            if (last != kNone) {
              segments.push_back({last, i});
            }
            last = i;
          }
        }
      }
    }
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(segments, std::less<SegmentEnds>(), context_));
    segments.erase(std::unique(segments.begin(), segments.end()), segments.end());
    return segments;
  }

  const SurfaceComplex& given_;
  const Box<3>& box_;
  const double weld_;
  const double reach_;
  uint64_t held_;
  const RunContext& context_;
  BoxedSurface out_;
  uint64_t conflicts_ = 0;
  Rows rows_;
  std::vector<Point<3>> points_;  // the given ones, moved onto sides
  std::vector<uint32_t> row_of_;  // by given point: its row, then its point of the last complex; kNone outside
  std::vector<Corner> polygon_;
  std::vector<Corner> kept_;
  std::vector<Point<3>> rounded_;
};

}  // namespace

absl::StatusOr<BoxedSurface> CutAtBox(const SurfaceComplex& given, const Box<3>& box, double weld, double reach,
                                      uint64_t held, const RunContext& context) {
  return BoxCutter(given, box, weld, reach, held, context).Cut();
}

}  // namespace wellspace::core
