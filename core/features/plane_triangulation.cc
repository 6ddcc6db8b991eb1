#include "core/features/plane_triangulation.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "core/base/cancellable_sort.h"
#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/geometry/exact_measure.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
// Looks at a side on the way to Delaunay, on average: inputs that take more are far from any that is met.
constexpr size_t kMostLooks = 64;

class Sweep {
 public:
  Sweep(std::span<const Point<2>> points, std::span<const SegmentEnds> segments, const RunContext& context)
      : points_(points), segments_(segments), context_(context), crossed_(Order{*this}) {}

  absl::StatusOr<PlaneTriangulation> Run() {
    WELLSPACE_RETURN_IF_ERROR(SortSegments());
    out_.triangles.reserve(2 * points_.size());
    for (uint32_t p = 0; p < points_.size() && !out_.do_meet; ++p) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(8 * size_t{p}, context_));
      WELLSPACE_RETURN_IF_ERROR(Take(p));
    }
    if (out_.do_meet) {
      out_.triangles = {};
    }
    return std::move(out_);
  }

 private:
  // A point on the border of what is triangulated between two segments. From a node up and down go edges.
  struct Node {
    uint32_t point = kNone;
    uint32_t down = kNone;
    uint32_t up = kNone;
  };
  // The border between two neighbours that the sweep crosses, from the lower end of the one below up to that of the
  // one above. Seen from the right it is convex. `last`: the node of its last point.
  struct Border {
    uint32_t bottom = kNone;
    uint32_t top = kNone;
    uint32_t last = kNone;
  };
  // The order of segments that the sweep crosses, and of a point among them, upwards.
  struct Order {
    using is_transparent = void;
    const Sweep& sweep;

    bool operator()(uint32_t s, uint32_t t) const {
      const auto [s_low, s_high] = sweep.EndsOf(s);
      const auto [t_low, t_high] = sweep.EndsOf(t);
      if (s_low < t_low) {
        const Sign of_low = sweep.Turn(s_low, s_high, t_low);
        return (of_low != Sign::kZero ? of_low : sweep.Turn(s_low, s_high, t_high)) == Sign::kPositive;
      }
      const Sign of_low = s_low == t_low ? Sign::kZero : sweep.Turn(t_low, t_high, s_low);
      return (of_low != Sign::kZero ? of_low : sweep.Turn(t_low, t_high, s_high)) == Sign::kNegative;
    }
    bool operator()(uint32_t s, const Point<2>* p) const { return SideOf(s, *p) == Sign::kPositive; }
    bool operator()(const Point<2>* p, uint32_t s) const { return SideOf(s, *p) == Sign::kNegative; }

    // kPositive: the point is above.
    Sign SideOf(uint32_t s, const Point<2>& p) const {
      const auto [low, high] = sweep.EndsOf(s);
      return Orientation<2>({sweep.points_[low], sweep.points_[high], p}).sign;
    }
  };
  using Crossed = std::map<uint32_t, Border, Order>;  // with the border above each

  SegmentEnds EndsOf(uint32_t s) const {
    const auto [a, b] = segments_[s];
    return {std::min(a, b), std::max(a, b)};
  }
  Sign Turn(uint32_t a, uint32_t b, uint32_t c) const {
    return Orientation<2>({points_[a], points_[b], points_[c]}).sign;
  }

  // Sorts segments by their lower ends, and those of each upwards.
  absl::Status SortSegments() {
    leaving_.resize(segments_.size());
    std::iota(leaving_.begin(), leaving_.end(), 0);
    const auto before = [this](uint32_t s, uint32_t t) {
      const uint32_t s_low = EndsOf(s)[0];
      const uint32_t t_low = EndsOf(t)[0];
      return s_low != t_low ? s_low < t_low : crossed_.key_comp()(s, t);
    };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(leaving_, before, context_));
    first_.assign(points_.size() + 1, 0);
    for (uint32_t s = 0; s < segments_.size(); ++s) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(s, context_));
      ++first_[EndsOf(s)[0] + 1];
    }
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    return absl::OkStatus();
  }

  uint32_t NewNode(uint32_t point) {
    nodes_.push_back({point, kNone, kNone});
    return static_cast<uint32_t>(nodes_.size() - 1);
  }
  void Link(uint32_t below, uint32_t above) {
    nodes_[below].up = above;
    nodes_[above].down = below;
  }

  // Joins `p` with the edges that it sees from node `at` downwards; returns the node at the end of them.
  uint32_t SeeDownwards(uint32_t p, uint32_t at) {
    for (uint32_t below = nodes_[at].down; below != kNone; below = nodes_[at].down) {
      if (Turn(nodes_[below].point, p, nodes_[at].point) != Sign::kPositive) {
        break;
      }
      out_.triangles.push_back({nodes_[below].point, p, nodes_[at].point});
      at = below;
    }
    return at;
  }
  uint32_t SeeUpwards(uint32_t p, uint32_t at) {
    for (uint32_t above = nodes_[at].up; above != kNone; above = nodes_[at].up) {
      if (Turn(nodes_[at].point, p, nodes_[above].point) != Sign::kPositive) {
        break;
      }
      out_.triangles.push_back({nodes_[at].point, p, nodes_[above].point});
      at = above;
    }
    return at;
  }

  bool IsOn(uint32_t s, uint32_t p) const { return crossed_.key_comp().SideOf(s, points_[p]) == Sign::kZero; }

  Border& BorderBelow(Crossed::iterator above) {
    return above == crossed_.begin() ? lowest_ : std::prev(above)->second;
  }

  // Moves the sweep over point `p`.
  absl::Status Take(uint32_t p) {
    if (p == 0) {
      const uint32_t node = NewNode(p);
      lowest_ = {node, node, node};
      Leave(p, lowest_, node, node, crossed_.end());
      return absl::OkStatus();
    }
    Crossed::iterator above = crossed_.lower_bound(&points_[p]);
    Border& border = BorderBelow(above);
    uint32_t down = kNone;  // nodes between which the new ones come
    uint32_t up = kNone;
    if (above == crossed_.end() || !IsOn(above->first, p)) {
      down = SeeDownwards(p, border.last);
      up = SeeUpwards(p, border.last);
      if (down == up) {  // an edge leads there and back again
        const uint32_t copy = NewNode(nodes_[down].point);
        up = nodes_[down].up;
        if (up != kNone) {
          Link(copy, up);
        }
        border.top = border.top == down ? copy : border.top;
        up = copy;
      }
    } else {
      down = SeeDownwards(p, border.top);
      Border last;
      for (size_t i = 0; above != crossed_.end() && IsOn(above->first, p); ++i) {
        WELLSPACE_RETURN_IF_ERROR(CheckAt(i + 1, context_));
        if (EndsOf(above->first)[1] != p) {
          out_.do_meet = true;
          return absl::OkStatus();
        }
        if (i > 0) {
          SeeUpwards(p, last.bottom);
        }
        last = above->second;
        above = crossed_.erase(above);
      }
      up = SeeUpwards(p, last.bottom);
      border.top = last.top;
    }
    Leave(p, border, down, up, above);
    return absl::OkStatus();
  }

  // Puts `p` into the border, between two nodes, and adds the segments that begin there, below `above`. For the first
  // point both are its own node.
  void Leave(uint32_t p, Border& border, uint32_t down, uint32_t up, Crossed::iterator above) {
    const auto begin = leaving_.begin() + first_[p];
    const auto end = leaving_.begin() + first_[p + 1];
    const bool is_first = nodes_[down].point == p;
    const uint32_t low = is_first ? down : NewNode(p);
    if (!is_first) {
      Link(down, low);
    }
    if (begin == end) {
      if (!is_first) {
        Link(low, up);
      }
      border.last = low;
      if (above != crossed_.end() && above != crossed_.begin()) {
        CheckApart(std::prev(above)->first, above->first);
      }
      return;
    }
    const uint32_t top = border.top;
    border = {border.bottom, low, low};
    if (above != crossed_.begin()) {
      CheckApart(std::prev(above)->first, *begin);
    }
    for (auto s = begin; s != end; ++s) {
      const uint32_t node = NewNode(p);
      const bool is_last = s + 1 == end;
      if (is_last && !is_first) {
        Link(node, up);
      }
      const size_t before = crossed_.size();
      crossed_.emplace_hint(above, *s, Border{node, is_last && !is_first ? top : node, node});
      out_.do_meet = out_.do_meet || crossed_.size() == before;  // it lies over another one
    }
    if (above != crossed_.end()) {
      CheckApart(*(end - 1), above->first);
    }
  }

  // Notes whether two neighbours meet elsewhere than in a common end.
  void CheckApart(uint32_t s, uint32_t t) {
    const auto [a, b] = EndsOf(s);
    const auto [c, d] = EndsOf(t);
    if (a == c || b == d || a == d || b == c) {
      return;  // if one lies on the other, that is seen at its end
    }
    out_.do_meet = out_.do_meet || (Turn(a, b, c) * Turn(a, b, d) != Sign::kPositive &&
                                    Turn(c, d, a) * Turn(c, d, b) != Sign::kPositive);
  }

  const std::span<const Point<2>> points_;
  const std::span<const SegmentEnds> segments_;
  const RunContext& context_;
  PlaneTriangulation out_;
  std::vector<uint32_t> first_;    // by point: where the segments that begin there are in leaving_
  std::vector<uint32_t> leaving_;  // segments by their lower ends
  std::vector<Node> nodes_;
  Border lowest_;  // below all segments
  Crossed crossed_;
};

// Makes triangles Delaunay, as far as segments let it: the common edge of two triangles that is no segment is exchanged
// for the other diagonal, if a corner of one is in the circumcircle of the other.
class Flips {
 public:
  Flips(std::span<const Point<2>> points, std::vector<std::array<uint32_t, 3>>& triangles, const RunContext& context)
      : points_(points), triangles_(triangles), context_(context) {}

  absl::Status Run(std::span<const SegmentEnds> segments) {
    WELLSPACE_RETURN_IF_ERROR(FindNeighbours(segments));
    std::vector<uint32_t> pending(beyond_.size());
    std::iota(pending.begin(), pending.end(), 0);
    std::vector<bool> is_pending(pending.size(), true);
    const size_t most = kMostLooks * pending.size();
    for (size_t step = 0; !pending.empty() && step < most; ++step) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(8 * step, context_));
      const uint32_t side = pending.back();
      pending.pop_back();
      is_pending[side] = false;
      if (beyond_[side] == kNone || !IsAsked(side)) {
        continue;
      }
      const std::array<uint32_t, 4> around = Flip(side);
      for (const uint32_t one : around) {
        if (!is_pending[one]) {
          is_pending[one] = true;
          pending.push_back(one);
        }
      }
    }
    return absl::OkStatus();
  }

 private:
  // Side 3 t + k of triangle t goes from its corner k to the next one.
  static uint32_t Next(uint32_t side) { return side % 3 == 2 ? side - 2 : side + 1; }
  static uint32_t Last(uint32_t side) { return side % 3 == 0 ? side + 2 : side - 1; }
  uint32_t& From(uint32_t side) { return triangles_[side / 3][side % 3]; }

  // Finds the side on the other side of each, but for those at segments and on the hull.
  absl::Status FindNeighbours(std::span<const SegmentEnds> segments) {
    std::vector<std::pair<SegmentEnds, uint32_t>> sides;
    sides.reserve(3 * triangles_.size() + segments.size());
    for (uint32_t side = 0; side < 3 * triangles_.size(); ++side) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(side, context_));
      const auto [low, high] = std::minmax(From(side), From(Next(side)));
      sides.push_back({{low, high}, side});
    }
    for (const auto& [a, b] : segments) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(sides.size(), context_));
      sides.push_back({{std::min(a, b), std::max(a, b)}, kNone});
    }
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(sides, std::less<std::pair<SegmentEnds, uint32_t>>(), context_));
    beyond_.assign(3 * triangles_.size(), kNone);
    size_t step = 0;
    for (size_t i = 0; i + 1 < sides.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(step++, context_));
      const bool is_at_segment =
          sides[i + 1].second == kNone || (i + 2 < sides.size() && sides[i + 2].first == sides[i].first);
      if (sides[i].first == sides[i + 1].first && !is_at_segment) {
        beyond_[sides[i].second] = sides[i + 1].second;
        beyond_[sides[i + 1].second] = sides[i].second;
      }
      i += sides[i].first == sides[i + 1].first ? (is_at_segment && sides[i + 1].second != kNone ? 2 : 1) : 0;
    }
    return absl::OkStatus();
  }

  // Whether the corner across from a side, on its other side, is in the circumcircle of its triangle.
  bool IsAsked(uint32_t side) {
    const std::array<uint32_t, 3>& t = triangles_[side / 3];
    const uint32_t across = From(Last(beyond_[side]));
    return InSphere<2>({points_[t[0]], points_[t[1]], points_[t[2]]}, points_[across]).sign == Sign::kPositive;
  }

  // Exchanges the diagonal; returns the four sides around.
  std::array<uint32_t, 4> Flip(uint32_t side) {
    const uint32_t other = beyond_[side];
    const uint32_t apex = From(Last(side));
    const uint32_t across = From(Last(other));
    // Triangles (a, b, apex) and (b, a, across) become (a, across, apex) and (b, apex, across).
    const uint32_t beyond_next = beyond_[Next(side)];
    const uint32_t beyond_other_next = beyond_[Next(other)];
    From(Next(side)) = across;
    From(Next(other)) = apex;
    Join(side, beyond_other_next);
    Join(other, beyond_next);
    Join(Next(side), Next(other));
    return {side, Last(side), other, Last(other)};
  }
  void Join(uint32_t one, uint32_t other) {
    beyond_[one] = other;
    if (other != kNone) {
      beyond_[other] = one;
    }
  }

  const std::span<const Point<2>> points_;
  std::vector<std::array<uint32_t, 3>>& triangles_;
  const RunContext& context_;
  std::vector<uint32_t> beyond_;  // by side; kNone at segments and on the hull
};

}  // namespace

absl::StatusOr<PlaneTriangulation> TriangulatePlane(std::span<const Point<2>> points,
                                                    std::span<const SegmentEnds> segments, const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(PlaneTriangulation made, Sweep(points, segments, context).Run());
  WELLSPACE_RETURN_IF_ERROR(Flips(points, made.triangles, context).Run(segments));
  return made;
}

uint64_t PlaneTriangulationBytes(uint64_t points, uint64_t segments) {
  constexpr uint64_t kTriangle = 3 * sizeof(uint32_t);
  constexpr uint64_t kNode = 3 * sizeof(uint32_t);
  constexpr uint64_t kCrossed = 80;  // of a node of the map
  // A point has at most two triangles and two nodes, a segment one node; vectors that grow are there twice.
  const uint64_t sweep =
      points * (2 * (2 * kNode) + 3 * sizeof(uint32_t)) + segments * (2 * kNode + kCrossed + 2 * sizeof(uint32_t));
  // Sides are sorted with their ends; then each has its neighbour, and waits.
  const uint64_t flips = 2 * (6 * points + segments) * 3 * sizeof(uint32_t) + 6 * points * 2 * sizeof(uint32_t);
  return points * 2 * kTriangle + std::max(sweep, flips);
}

}  // namespace wellspace::core
