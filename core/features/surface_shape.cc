#include "core/features/surface_shape.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <utility>

#include "core/base/cancellable_sort.h"
#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/features/union_find.h"
#include "core/geometry/box.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
constexpr double kTurn = 360;  // degrees

class ShapeFinder {
 public:
  ShapeFinder(const SurfaceComplex& complex, const RunContext& context) : complex_(complex), context_(context) {}

  absl::StatusOr<SurfaceShape> Find() {
    WELLSPACE_RETURN_IF_ERROR(CountComponents());
    WELLSPACE_RETURN_IF_ERROR(LookAtEdges());
    WELLSPACE_RETURN_IF_ERROR(CountFlipped());
    WELLSPACE_RETURN_IF_ERROR(FollowOpenEdges());
    for (uint32_t t = 0; t < complex_.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      out_.area += 0.5 * std::sqrt(NormSq<3>(Cross(Difference<3>(complex_.Corner(t, 1), complex_.Corner(t, 0)),
                                                   Difference<3>(complex_.Corner(t, 2), complex_.Corner(t, 0)))));
    }
    return std::move(out_);
  }

 private:
  absl::Status CountComponents() {
    UnionFind joined(complex_.points.size());
    std::vector<bool> is_used(complex_.points.size());
    for (size_t t = 0; t < complex_.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(4 * t, context_));
      const auto& [a, b, c] = complex_.triangles[t];
      joined.Join(a, b);
      joined.Join(a, c);
      is_used[a] = true;  // the least
    }
    for (uint32_t p = 0; p < complex_.points.size(); ++p) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(p, context_));
      out_.components += is_used[p] && joined.Find(p) == p ? 1 : 0;
    }
    return absl::OkStatus();
  }

  absl::Status LookAtEdges() {
    std::vector<double> turns;
    for (uint32_t e = 0; e < complex_.edges.size(); ++e) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(8 * size_t{e}, context_));
      const std::span<const TriangleSide> sides = complex_.SidesAt(e);
      if (sides.size() == 1) {
        open_.push_back(e);
        continue;
      }
      if (sides.size() > 2) {
        ++out_.branching_edges;
        if (sides.size() % 2 == 1) {
          out_.odd_edges.push_back(e);
        }
      }
      turns.clear();
      for (const TriangleSide side : sides) {
        turns.push_back(TurnOf(e, side, sides[0]));
      }
      WELLSPACE_RETURN_IF_ERROR(CancellableSort(turns, std::less<double>(), context_));
      double least = turns[0] + kTurn - turns.back();
      for (size_t i = 1; i < turns.size(); ++i) {
        least = std::min(least, turns[i] - turns[i - 1]);
      }
      if (least < out_.sharpest_angle) {
        out_.sharpest_angle = least;
        out_.sharpest_edge = e;
      }
    }
    out_.open_edges = open_.size();
    return absl::OkStatus();
  }

  // By which angle the triangle at `from` has to be turned around an edge until it lies on that at `side`; from 0 to
  // 360 degrees.
  double TurnOf(uint32_t edge, TriangleSide side, TriangleSide from) const {
    if (side == from) {
      return 0;
    }
    const Point<3>& a = complex_.points[complex_.edges[edge][0]];
    const Point<3> along = Difference<3>(complex_.points[complex_.edges[edge][1]], a);
    // Vectors across the edge, turned by a right angle.
    const Point<3> one = Cross(along, Difference<3>(complex_.points[complex_.ApexOf(from)], a));
    const Point<3> other = Cross(along, Difference<3>(complex_.points[complex_.ApexOf(side)], a));
    const double angle = AngleBetween(one, other);
    return Dot<3>(Cross(one, other), along) < 0 ? kTurn - angle : angle;
  }

  // Walks over edges of two triangles, and notes which go against the first.
  absl::Status CountFlipped() {
    const auto triangles = static_cast<uint32_t>(complex_.triangles.size());
    std::vector<uint8_t> ways(triangles);  // 0: not met; 1: as the first; 2: against it
    std::vector<uint32_t> pending;
    size_t steps = 0;
    for (uint32_t first = 0; first < triangles; ++first) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(steps++, context_));
      if (ways[first] != 0) {
        continue;
      }
      uint64_t count = 0;
      uint64_t against = 0;
      uint32_t first_against = kNone;
      bool is_one_sided = false;
      ways[first] = 1;
      pending.push_back(first);
      while (!pending.empty()) {
        WELLSPACE_RETURN_IF_ERROR(CheckAt(4 * steps++, context_));
        const uint32_t t = pending.back();
        pending.pop_back();
        ++count;
        if (ways[t] == 2) {
          ++against;
          first_against = std::min(first_against, t);
        }
        for (uint32_t k = 0; k < 3; ++k) {
          const TriangleSide side = SideOf(t, k);
          const std::span<const TriangleSide> sides = complex_.SidesAt(complex_.edge_of_side[side]);
          if (sides.size() != 2) {
            continue;
          }
          const TriangleSide other = sides[0] == side ? sides[1] : sides[0];
          const bool go_together = complex_.RunsUp(side) != complex_.RunsUp(other);
          const auto way = static_cast<uint8_t>(go_together ? ways[t] : 3 - ways[t]);
          uint8_t& known = ways[TriangleOf(other)];
          if (known == 0) {
            known = way;
            pending.push_back(TriangleOf(other));
          } else {
            is_one_sided = is_one_sided || known != way;
          }
        }
      }
      if (is_one_sided) {
        ++out_.one_sided;
      } else {
        const uint64_t flipped = std::min(against, count - against);
        if (out_.flipped_triangles == 0 && flipped > 0) {
          out_.first_flipped = flipped == against ? first_against : first;
        }
        out_.flipped_triangles += flipped;
      }
    }
    return absl::OkStatus();
  }

  // The open edges at points, and which of them have been followed.
  struct OpenEdges {
    std::vector<std::pair<uint32_t, uint32_t>> around;  // point, number of an open edge; ascending
    std::vector<uint32_t> next_at;                      // by point: a place in `around`
    std::vector<bool> is_followed;                      // by number

    // The next at a point that has not been followed; kNone without one.
    uint32_t NextAt(uint32_t point) {
      uint32_t& at = next_at[point];
      while (at < around.size() && around[at].first == point && is_followed[around[at].second]) {
        ++at;
      }
      return at < around.size() && around[at].first == point ? around[at].second : kNone;
    }
  };

  absl::StatusOr<OpenEdges> SortOpenEdges() const {
    OpenEdges edges;
    edges.around.reserve(2 * open_.size());
    for (size_t i = 0; i < open_.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      for (const uint32_t end : complex_.edges[open_[i]]) {
        edges.around.emplace_back(end, static_cast<uint32_t>(i));
      }
    }
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(edges.around, std::less<std::pair<uint32_t, uint32_t>>(), context_));
    edges.next_at.assign(open_.empty() ? 0 : complex_.points.size(), kNone);
    for (size_t i = edges.around.size(); i > 0; --i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context_));
      edges.next_at[edges.around[i - 1].first] = static_cast<uint32_t>(i - 1);
    }
    edges.is_followed.resize(open_.size());
    return edges;
  }

  // Follows open edges from the lowest on. A way that comes back to a point of its own is a loop, which is taken off.
  absl::Status FollowOpenEdges() {
    WELLSPACE_ASSIGN_OR_RETURN(OpenEdges left, SortOpenEdges());
    std::vector<bool> is_on_way(left.next_at.size());
    std::vector<uint32_t> points;  // of the way
    std::vector<uint32_t> edges;   // between them
    size_t steps = 0;
    for (uint32_t first = 0; first < open_.size(); ++first) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(steps++, context_));
      if (left.is_followed[first]) {
        continue;
      }
      points = {complex_.edges[open_[first]][0]};
      edges.clear();
      is_on_way[points[0]] = true;
      for (uint32_t edge = left.NextAt(points[0]); edge != kNone; edge = left.NextAt(points.back())) {
        WELLSPACE_RETURN_IF_ERROR(CheckAt(4 * steps++, context_));
        left.is_followed[edge] = true;
        const auto [a, b] = complex_.edges[open_[edge]];
        const uint32_t to = a == points.back() ? b : a;
        edges.push_back(edge);
        if (!is_on_way[to]) {
          is_on_way[to] = true;
          points.push_back(to);
          continue;
        }
        size_t begin = points.size() - 1;
        while (points[begin] != to) {
          is_on_way[points[begin--]] = false;
        }
        AddLoop(std::span(edges).subspan(begin), /*is_closed=*/true);
        points.resize(begin + 1);
        edges.resize(begin);
      }
      if (!edges.empty()) {
        AddLoop(edges, /*is_closed=*/false);
      }
      for (const uint32_t point : points) {
        is_on_way[point] = false;
      }
    }
    return CancellableSort(
        out_.loops,
        [](const OpenLoop& a, const OpenLoop& b) {
          return a.length != b.length ? a.length > b.length : a.first < b.first;
        },
        context_);
  }

  void AddLoop(std::span<const uint32_t> edges, bool is_closed) {
    OpenLoop loop;
    loop.edges = static_cast<uint32_t>(edges.size());
    loop.is_closed = is_closed;
    loop.first = open_[*std::min_element(edges.begin(), edges.end())];
    const Point<3>& start = complex_.points[complex_.edges[loop.first][0]];
    Box<3> box{start, start};
    for (const uint32_t edge : edges) {
      const Point<3>& a = complex_.points[complex_.edges[open_[edge]][0]];
      const Point<3>& b = complex_.points[complex_.edges[open_[edge]][1]];
      box.Include({a, a});
      box.Include({b, b});
      loop.length += Distance<3>(a, b);
    }
    for (int axis = 0; axis < 3; ++axis) {
      loop.at[axis] = 0.5 * (box.low[axis] + box.high[axis]);
    }
    out_.loops.push_back(loop);
  }

  const SurfaceComplex& complex_;
  const RunContext& context_;
  SurfaceShape out_;
  std::vector<uint32_t> open_;  // edges of one triangle
};

}  // namespace

absl::StatusOr<SurfaceShape> DescribeShape(const SurfaceComplex& complex, const RunContext& context) {
  return ShapeFinder(complex, context).Find();
}

uint64_t SurfaceShapeBytes(uint64_t points, uint64_t triangles) {
  // Where every edge is open: these, their ends, and ways along them; a loop for each triangle, twice while sorted.
  constexpr uint64_t kOfTriangle = 3 * sizeof(uint32_t) + 2 * 6 * 2 * sizeof(uint32_t) + 2 * sizeof(OpenLoop) + 8;
  return points * (2 * sizeof(uint32_t) + 1) + triangles * kOfTriangle;
}

}  // namespace wellspace::core
