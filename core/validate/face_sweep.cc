#include "core/validate/face_sweep.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <set>
#include <tuple>
#include <utility>

#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/features/union_find.h"
#include "core/geometry/exact_measure.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kStepsBetweenLooks = 1024;

Sign Side(const Point<2>& a, const Point<2>& b, const Point<2>& p) { return Orientation<2>({a, b, p}).sign; }

class Sweep {
 public:
  Sweep(std::span<const Point<2>> vertices, std::span<const Piece> pieces, std::span<const Point<2>> places)
      : vertices_(vertices),
        pieces_(pieces),
        places_(places),
        met_(IsBelow{this}),
        at_(pieces.size(), met_.end()),
        above_(pieces.size()),
        below_(pieces.size()) {}

  absl::StatusOr<SweptFaces> Run(const RunContext& context) {
    std::vector<Event> events;
    for (uint32_t p = 0; p < pieces_.size(); ++p) {
      events.push_back({vertices_[pieces_[p].ends[0]], Kind::kStart, p});
      events.push_back({vertices_[pieces_[p].ends[1]], Kind::kEnd, p});
    }
    for (uint32_t i = 0; i < places_.size(); ++i) {
      events.push_back({places_[i], Kind::kPlace, i});
    }
    const auto is_earlier = [](const Event& a, const Event& b) {
      return std::tie(a.at, a.kind, a.number) < std::tie(b.at, b.kind, b.number);
    };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(events, is_earlier, context));
    gaps_.Add();  // the unbounded face
    out_.face_of.resize(places_.size());
    uint32_t steps = 0;
    for (size_t begin = 0, end = 0; begin < events.size(); begin = end) {
      while (end < events.size() && events[end].at == events[begin].at) {
        ++end;
      }
      Reach(std::span<const Event>(events).subspan(begin, end - begin));
      if ((steps += static_cast<uint32_t>(end - begin)) >= kStepsBetweenLooks) {
        steps = 0;
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
    }
    NumberFaces();
    return std::move(out_);
  }

 private:
  enum class Kind : uint8_t { kEnd, kStart, kPlace };

  struct Event {
    Point<2> at;
    Kind kind;
    uint32_t number;  // of a piece or a place
  };

  // Pieces that the line meets from below to above. The line is turned by an infinitesimal angle, so that it meets a
  // vertical piece, too, in one point.
  struct IsBelow {
    using is_transparent = void;
    const Sweep* sweep;

    bool operator()(uint32_t one, const Point<2>& p) const { return sweep->SideOf(one, p) == Sign::kPositive; }
    bool operator()(const Point<2>& p, uint32_t one) const { return sweep->SideOf(one, p) == Sign::kNegative; }
    bool operator()(uint32_t one, uint32_t other) const {
      if (one == other) {
        return false;
      }
      // The piece that starts later is compared with the other.
      const bool is_later = sweep->Low(other) < sweep->Low(one);
      const uint32_t line = is_later ? other : one;
      const uint32_t starts = is_later ? one : other;
      Sign side = sweep->SideOf(line, sweep->Low(starts));
      side = side != Sign::kZero ? side : sweep->SideOf(line, sweep->High(starts));
      return side == (is_later ? Sign::kNegative : Sign::kPositive);
    }
  };
  using Met = std::multiset<uint32_t, IsBelow>;

  const Point<2>& Low(uint32_t piece) const { return vertices_[pieces_[piece].ends[0]]; }
  const Point<2>& High(uint32_t piece) const { return vertices_[pieces_[piece].ends[1]]; }
  Sign SideOf(uint32_t piece, const Point<2>& p) const { return Side(Low(piece), High(piece), p); }

  // Sorts pieces of which the end `end` is one vertex from below to above.
  void SortUpwards(std::vector<uint32_t>& pieces, int end) const {
    std::sort(pieces.begin(), pieces.end(), [&](uint32_t one, uint32_t other) {
      const Sign side = end == 0 ? SideOf(one, High(other)) : SideOf(one, Low(other));
      return side == Sign::kZero ? one < other : side == Sign::kPositive;
    });
  }

  uint32_t GapBelow(Met::const_iterator at) const { return at == met_.begin() ? 0 : above_[*std::prev(at)]; }

  // Notes it if two pieces that have come to lie beside each other cross.
  void Compare(Met::const_iterator low, Met::const_iterator high) {
    if (Side(Low(*low), High(*low), Low(*high)) * Side(Low(*low), High(*low), High(*high)) == Sign::kNegative &&
        Side(Low(*high), High(*high), Low(*low)) * Side(Low(*high), High(*high), High(*low)) == Sign::kNegative) {
      out_.crossings.push_back({std::min(*low, *high), std::max(*low, *high)});
    }
  }

  // Lets the line go over one point. Places come last.
  void Reach(std::span<const Event> events) {
    const Point<2>& at = events[0].at;
    std::vector<uint32_t> ending;
    size_t i = 0;
    for (; i < events.size() && events[i].kind == Kind::kEnd; ++i) {
      ending.push_back(events[i].number);
    }
    auto next = met_.lower_bound(at);  // the first that is not below
    uint32_t low_gap = GapBelow(next);
    uint32_t high_gap = low_gap;
    if (!ending.empty()) {
      SortUpwards(ending, 1);
      low_gap = GapBelow(at_[ending.front()]);
      high_gap = above_[ending.back()];
      for (const uint32_t piece : ending) {
        next = met_.erase(at_[piece]);
      }
    }
    std::vector<uint32_t> starting;
    for (; i < events.size() && events[i].kind == Kind::kStart; ++i) {
      starting.push_back(events[i].number);
    }
    if (i < events.size() &&
        (!ending.empty() || !starting.empty() || (next != met_.end() && SideOf(*next, at) == Sign::kZero))) {
      for (; i < events.size(); ++i) {
        out_.face_of[events[i].number] = SweptFaces::kOnPiece;
      }
    }
    for (; i < events.size(); ++i) {
      out_.face_of[events[i].number] = low_gap;
    }
    if (starting.empty()) {
      if (!ending.empty()) {
        gaps_.Join(low_gap, high_gap);
        if (next != met_.begin() && next != met_.end()) {
          Compare(std::prev(next), next);
        }
      }
      return;
    }
    Start(starting, low_gap, high_gap);
  }

  // Lets pieces begin between two gaps, which may be one.
  void Start(std::vector<uint32_t>& starting, uint32_t low_gap, uint32_t high_gap) {
    SortUpwards(starting, 0);
    for (const uint32_t piece : starting) {
      below_[piece] = low_gap;
      low_gap = above_[piece] = piece == starting.back() ? high_gap : gaps_.Add();
      at_[piece] = met_.insert(piece);
    }
    const Met::const_iterator first = at_[starting.front()];
    const Met::const_iterator last = at_[starting.back()];
    if (first != met_.begin()) {
      Compare(std::prev(first), first);
    }
    if (std::next(last) != met_.end()) {
      Compare(last, std::next(last));
    }
  }

  void NumberFaces() {
    std::vector<uint32_t> number(gaps_.size(), SweptFaces::kOnPiece);
    const auto number_of = [&](uint32_t gap) {
      uint32_t& face = number[gaps_.Find(gap)];
      if (face == SweptFaces::kOnPiece) {
        face = out_.face_count++;
      }
      return face;
    };
    number_of(0);
    for (uint32_t p = 0; p < pieces_.size(); ++p) {
      const uint32_t below = number_of(below_[p]);
      out_.beside.push_back({below, number_of(above_[p])});
    }
    for (uint32_t& gap : out_.face_of) {
      gap = gap == SweptFaces::kOnPiece ? gap : number_of(gap);
    }
  }

  const std::span<const Point<2>> vertices_;
  const std::span<const Piece> pieces_;
  const std::span<const Point<2>> places_;
  Met met_;
  std::vector<Met::const_iterator> at_;  // where each piece is in met_
  std::vector<uint32_t> above_;          // gaps, by piece
  std::vector<uint32_t> below_;
  UnionFind gaps_;  // entries of one face are joined
  SweptFaces out_;
};

}  // namespace

absl::StatusOr<SweptFaces> SweepFaces(std::span<const Point<2>> vertices, std::span<const Piece> pieces,
                                      std::span<const Point<2>> places, const RunContext& context) {
  return Sweep(vertices, pieces, places).Run(context);
}

}  // namespace wellspace::core
