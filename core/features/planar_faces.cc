#include "core/features/planar_faces.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/features/face_walk.h"
#include "core/features/place.h"
#include "core/features/polygon_seeds.h"
#include "core/features/union_find.h"
#include "core/geometry/exact_measure.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kNone = OddSets::kEmpty;

// Half-edges that are sorted without a look at the context.
constexpr std::ptrdiff_t kFewAround = 1024;

// Finds the faces, step after step.
class FaceFinder {
 public:
  FaceFinder(const PlanarGraph& graph, FaceRule rule, std::span<const FaceSeed> seeds, const RunContext& context)
      : graph_(graph), rule_(rule), seeds_(seeds), context_(context) {}

  absl::StatusOr<PlanarFaces> Find() {
    for (size_t i = 0; i < seeds_.size(); ++i) {
      if (!std::isfinite(seeds_[i].at[0]) || !std::isfinite(seeds_[i].at[1])) {
        return absl::InvalidArgumentError(absl::StrCat("seeds[", i, "]: its coordinates are not finite"));
      }
    }
    WELLSPACE_RETURN_IF_ERROR(SortAround());
    WELLSPACE_RETURN_IF_ERROR(FollowCycles());
    WELLSPACE_RETURN_IF_ERROR(Sweep());
    WELLSPACE_RETURN_IF_ERROR(NumberFaces());
    WELLSPACE_RETURN_IF_ERROR(ApplyRule());
    WELLSPACE_RETURN_IF_ERROR(ApplySeeds());
    if (std::none_of(out_.faces.begin(), out_.faces.end(), [](const Face& face) { return face.is_meshed; })) {
      return absl::InvalidArgumentError(
          out_.faces.size() == 1
              ? "faces: the segments enclose nothing, so that there is no face to be meshed; close a ring of them, or "
                "mesh all of the box"
              : "faces: no face is left to be meshed; take away a hole, or mesh all of the box");
    }
    return std::move(out_);
  }

 private:
  uint32_t half_edge_count() const { return static_cast<uint32_t>(2 * graph_.segments.size()); }
  uint32_t OriginOf(HalfEdge h) const {
    const GraphSegment& s = graph_.segments[SegmentOf(h)];
    return IsFromB(h) ? s.b : s.a;
  }
  uint32_t TargetOf(HalfEdge h) const { return OriginOf(TwinOf(h)); }
  const Point<2>& At(uint32_t point) const { return graph_.points[point]; }

  // A look at the context in a loop that makes short steps, of which this is one.
  absl::Status CheckAt(size_t step) const {
    return step % kStepsBetweenChecks == 0 ? context_.Check() : absl::OkStatus();
  }

  // Puts the half-edges around each point in counterclockwise order, from the direction of minus the second axis on:
  // first those that lead to greater points.
  absl::Status SortAround() {
    const size_t points = graph_.points.size();
    out_.first_around.assign(points + 1, 0);
    for (HalfEdge h = 0; h < half_edge_count(); ++h) {
      ++out_.first_around[OriginOf(h) + 1];
    }
    std::partial_sum(out_.first_around.begin(), out_.first_around.end(), out_.first_around.begin());
    out_.around.resize(half_edge_count());
    std::vector<uint32_t> next(out_.first_around.begin(), out_.first_around.end() - 1);
    for (HalfEdge h = 0; h < half_edge_count(); ++h) {
      out_.around[next[OriginOf(h)]++] = h;
    }
    std::vector<HalfEdge> own;
    for (uint32_t p = 0; p < points; ++p) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(p));
      const auto leads_up = [&](HalfEdge h) { return At(p) < At(TargetOf(h)); };
      const auto is_before = [&](HalfEdge h, HalfEdge k) {
        return leads_up(h) != leads_up(k)
                   ? leads_up(h)
                   : Orientation<2>({At(p), At(TargetOf(h)), At(TargetOf(k))}).sign == Sign::kPositive;
      };
      const auto begin = out_.around.begin() + out_.first_around[p];
      const auto end = out_.around.begin() + out_.first_around[p + 1];
      if (end - begin <= kFewAround) {
        std::sort(begin, end, is_before);
        continue;
      }
      own.assign(begin, end);
      WELLSPACE_RETURN_IF_ERROR(CancellableSort(own, is_before, context_));
      std::copy(own.begin(), own.end(), begin);
    }
    return absl::OkStatus();
  }

  // Numbers the cycles of half-edges around faces: each keeps its face on the left.
  absl::Status FollowCycles() {
    std::vector<uint32_t> place(half_edge_count());  // in `around`
    for (uint32_t i = 0; i < out_.around.size(); ++i) {
      place[out_.around[i]] = i;
    }
    cycle_of_.assign(half_edge_count(), kNone);
    size_t steps = 0;
    for (HalfEdge first = 0; first < half_edge_count(); ++first) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(steps++));
      if (cycle_of_[first] != kNone) {
        continue;
      }
      for (HalfEdge h = first; cycle_of_[h] == kNone;) {
        WELLSPACE_RETURN_IF_ERROR(CheckAt(steps++));
        cycle_of_[h] = cycles_;
        // At its target, the next one clockwise from the way back.
        const uint32_t at = TargetOf(h);
        const uint32_t back = place[TwinOf(h)];
        h = out_.around[(back == out_.first_around[at] ? out_.first_around[at + 1] : back) - 1];
      }
      ++cycles_;
    }
    return absl::OkStatus();
  }

  // Orders segments that a line across the first axis meets by the second axis, and places on that line to them. All
  // that is compared does not cross, so that the order stays.
  struct IsBelow {
    using is_transparent = void;
    const FaceFinder* finder;

    const Point<2>& Low(uint32_t s) const { return finder->At(finder->graph_.segments[s].a); }
    const Point<2>& High(uint32_t s) const { return finder->At(finder->graph_.segments[s].b); }
    bool operator()(uint32_t s, const Point<2>& p) const {
      return Orientation<2>({Low(s), High(s), p}).sign == Sign::kPositive;
    }
    bool operator()(const Point<2>& p, uint32_t s) const {
      return Orientation<2>({Low(s), High(s), p}).sign == Sign::kNegative;
    }
    bool operator()(uint32_t s, uint32_t t) const {
      if (s == t) {
        return false;
      }
      if (Low(s) < Low(t) || Low(s) == Low(t)) {
        const Sign side = Orientation<2>({Low(s), High(s), Low(t)}).sign;
        return (side != Sign::kZero ? side : Orientation<2>({Low(s), High(s), High(t)}).sign) == Sign::kPositive;
      }
      return Orientation<2>({Low(t), High(t), Low(s)}).sign == Sign::kNegative;
    }
  };

  // For the lowest point of every component, every point without segments and every seed: which half-edge is below.
  absl::Status Sweep() {
    const auto points = static_cast<uint32_t>(graph_.points.size());
    below_.assign(points + seeds_.size(), kNone);
    const auto at = [&](uint32_t event) { return event < points ? At(event) : seeds_[event - points].at; };
    std::vector<uint32_t> events(below_.size());
    std::iota(events.begin(), events.end(), 0);
    const auto is_before = [&](uint32_t i, uint32_t j) { return std::pair(at(i), i) < std::pair(at(j), j); };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(events, is_before, context_));
    UnionFind components(points);
    for (size_t s = 0; s < graph_.segments.size(); ++s) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(s));
      components.Join(graph_.segments[s].a, graph_.segments[s].b);
    }
    std::vector<bool> has_begun(points);
    std::set<uint32_t, IsBelow> met(IsBelow{this});
    uint32_t steps = 0;
    for (const uint32_t event : events) {
      if (++steps % 1024 == 0) {
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
      }
      const bool is_point = event < points;
      if (is_point) {
        for (const HalfEdge h : out_.Around(event)) {
          if (IsFromB(h)) {
            met.erase(SegmentOf(h));
          }
        }
      }
      const bool is_first = is_point && !has_begun[components.Find(event)];
      if (is_first || !is_point) {
        const auto above = met.lower_bound(at(event));
        if (!is_point && !seeds_[event - points].IsPolygon() &&
            ((above != met.end() && !IsBelow{this}(at(event), *above)) || IsOnEnd(at(event)))) {
          const GraphSegment& on = graph_.segments[above != met.end() ? *above : 0];
          return absl::InvalidArgumentError(absl::StrCat(
              "seeds[", event - points, "] at ", PlaceText(at(event)), " lies on ",
              above != met.end() && !on.IsBoxSide() ? absl::StrCat("segments[", on.source, "]") : "a segment",
              "; a seed has to lie inside the face that it names"));
        }
        below_[event] = above == met.begin() ? kNone : HalfEdgeOf(*std::prev(above), false);
      }
      if (is_point) {
        has_begun[components.Find(event)] = true;
        if (is_first && !out_.Around(event).empty()) {
          first_points_.push_back(event);
        }
        for (const HalfEdge h : out_.Around(event)) {
          if (!IsFromB(h)) {
            met.insert(SegmentOf(h));
          }
        }
      }
    }
    return absl::OkStatus();
  }

  // Whether a seed is where segments begin or end: ends are no longer, or not yet, among those that are met.
  bool IsOnEnd(const Point<2>& p) {
    if (ends_.empty()) {
      for (uint32_t i = 0; i < graph_.points.size(); ++i) {
        if (!out_.Around(i).empty()) {
          ends_.push_back(At(i));
        }
      }
      std::sort(ends_.begin(), ends_.end());
    }
    return std::binary_search(ends_.begin(), ends_.end(), p);
  }

  // Joins the cycles of one face: that around a component from outside with those of the face which it lies in.
  absl::Status NumberFaces() {
    const uint32_t unbounded = 0;  // cycles are numbered from 1 here
    UnionFind joined(cycles_ + 1);
    const auto face_below = [&](uint32_t event) {
      return below_[event] == kNone ? unbounded : cycle_of_[below_[event]] + 1;
    };
    for (const uint32_t point : first_points_) {
      // All its half-edges lead to greater points; left of the last lies the outside of the component.
      joined.Join(cycle_of_[out_.Around(point).back()] + 1, face_below(point));
    }
    std::vector<uint32_t> number(cycles_ + 1, kNone);
    const auto face_of = [&](uint32_t cycle) {
      uint32_t& face = number[joined.Find(cycle)];
      if (face == kNone) {
        face = static_cast<uint32_t>(out_.faces.size());
        out_.faces.emplace_back();
      }
      return face;
    };
    face_of(unbounded);
    out_.left_face.resize(half_edge_count());
    for (HalfEdge h = 0; h < half_edge_count(); ++h) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(h));
      out_.left_face[h] = face_of(cycle_of_[h] + 1);
    }
    const auto points = static_cast<uint32_t>(graph_.points.size());
    out_.point_face.resize(points);
    for (uint32_t p = 0; p < points; ++p) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(p));
      out_.point_face[p] = out_.Around(p).empty() ? face_of(face_below(p)) : PlanarFaces::kOnSegments;
    }
    for (size_t i = 0; i < seeds_.size(); ++i) {
      seed_face_.push_back(face_of(face_below(static_cast<uint32_t>(points + i))));
    }
    return absl::OkStatus();
  }

  absl::Status ApplyRule() {
    if (rule_ == FaceRule::kUnion) {
      return ApplyUnion();
    }
    if (rule_ != FaceRule::kEvenOdd) {
      for (size_t face = 1; face < out_.faces.size(); ++face) {
        out_.faces[face].is_meshed = true;
      }
      return absl::OkStatus();
    }
    // From the unbounded face on across segments.
    std::vector<std::vector<HalfEdge>> sides(out_.faces.size());
    for (HalfEdge h = 0; h < half_edge_count(); ++h) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(h));
      sides[out_.left_face[h]].push_back(h);
    }
    std::vector<bool> is_known(out_.faces.size());
    std::vector<uint32_t> pending = {0};
    is_known[0] = true;
    size_t steps = 0;
    while (!pending.empty()) {
      const uint32_t face = pending.back();
      pending.pop_back();
      for (const HalfEdge h : sides[face]) {
        WELLSPACE_RETURN_IF_ERROR(CheckAt(steps++));
        const uint32_t beyond = out_.left_face[TwinOf(h)];
        const GraphSegment& segment = graph_.segments[SegmentOf(h)];
        const bool is_odd = out_.faces[face].is_meshed != (segment.rings % 2 == 1);
        if (!is_known[beyond]) {
          is_known[beyond] = true;
          out_.faces[beyond].is_meshed = is_odd;
          pending.push_back(beyond);
        } else if (out_.faces[beyond].is_meshed != is_odd) {
          return absl::InvalidArgumentError(absl::StrCat(
              "faces: the rings are not closed, so that inside and outside cannot be told apart beside segments[",
              segment.source, "] from ", PlaceText(At(segment.a)), " to ", PlaceText(At(segment.b)),
              "; close the rings, or name the holes by seeds"));
        }
      }
    }
    return absl::OkStatus();
  }

  // Meshes the faces that the rings of some group surround an odd number of times.
  absl::Status ApplyUnion() {
    std::set<uint32_t> around;  // groups
    const auto toggle = [&](uint32_t group) {
      if (around.erase(group) == 0) {
        around.insert(group);
      }
    };
    const auto visit = [&](uint32_t face, std::span<const HalfEdge> /*half_edges*/) {
      out_.faces[face].is_meshed = !around.empty();
      return absl::OkStatus();
    };
    return FaceWalk(graph_, out_, context_)
        .Run(
            graph_.groups, [](const GraphSegment& segment) { return segment.groups; }, toggle, visit);
  }

  // A point that names a face comes before polygons.
  absl::Status ApplySeeds() {
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<uint32_t> polygons,
                               FindPolygonsOfFaces(graph_, out_, seeds_, context_));
    std::vector<uint32_t> seed_of(out_.faces.size(), kNone);
    for (uint32_t i = 0; i < seeds_.size(); ++i) {
      const FaceSeed& seed = seeds_[i];
      if (seed.IsPolygon()) {
        continue;
      }
      uint32_t& first = seed_of[seed_face_[i]];
      const bool is_unused = !out_.faces[seed_face_[i]].is_meshed;
      if (is_unused) {
        out_.first_unused_seed = out_.unused_seeds++ == 0 ? i : out_.first_unused_seed;
      }
      if (first == kNone) {
        first = i;
      } else if (!is_unused && !seeds_[first].SaysTheSameAs(seed)) {
        return absl::InvalidArgumentError(absl::StrCat("seeds[", first, "] at ", PlaceText(seeds_[first].at),
                                                       " and seeds[", i, "] at ", PlaceText(seed.at),
                                                       " lie in one face and differ; leave one out"));
      }
    }
    for (uint32_t i = 0; i < seed_of.size(); ++i) {
      const uint32_t number = seed_of[i] != kNone ? seed_of[i] : polygons[i];
      if (number == kNone) {
        continue;
      }
      Face& face = out_.faces[i];
      const FaceSeed& seed = seeds_[number];
      if (seed.is_hole) {
        face.is_meshed = false;
      } else {
        face.region = seed.region;
        face.max_area = seed.max_area;
      }
    }
    return absl::OkStatus();
  }

  const PlanarGraph& graph_;
  const FaceRule rule_;
  const std::span<const FaceSeed> seeds_;
  const RunContext& context_;
  PlanarFaces out_;
  std::vector<uint32_t> cycle_of_;  // by half-edge
  uint32_t cycles_ = 0;
  std::vector<HalfEdge> below_;         // by point, then by seed: leads to greater points; kNone: nothing is below
  std::vector<uint32_t> first_points_;  // of the components that have segments, ascending by place
  std::vector<uint32_t> seed_face_;
  std::vector<Point<2>> ends_;  // ascending; empty until needed
};

}  // namespace

absl::StatusOr<PlanarFaces> FindFaces(const PlanarGraph& graph, FaceRule rule, std::span<const FaceSeed> seeds,
                                      const RunContext& context) {
  return FaceFinder(graph, rule, seeds, context).Find();
}

std::vector<bool> FindMeshedPoints(const PlanarGraph& graph, const PlanarFaces& faces) {
  std::vector<bool> is_meshed(graph.points.size());
  for (uint32_t p = 0; p < graph.points.size(); ++p) {
    const std::span<const HalfEdge> around = faces.Around(p);
    is_meshed[p] = around.empty() ? faces.IsMeshed(faces.point_face[p])
                                  : std::any_of(around.begin(), around.end(),
                                                [&](HalfEdge h) { return faces.IsMeshed(faces.left_face[h]); });
  }
  return is_meshed;
}

absl::Status KeepMeshed(std::span<const uint32_t> permutation, PlanarGraph& graph, PlanarFaces& faces,
                        const RunContext& context) {
  const std::vector<bool> is_kept = FindMeshedPoints(graph, faces);
  std::vector<uint32_t> number(graph.points.size(), kNone);
  PlanarGraph kept;
  kept.counts = graph.counts;
  kept.points.resize(permutation.size());
  kept.input_of_point.resize(permutation.size());
  PlanarFaces kept_faces;
  kept_faces.faces = faces.faces;
  kept_faces.unused_seeds = faces.unused_seeds;
  kept_faces.first_unused_seed = faces.first_unused_seed;
  kept_faces.point_face.resize(permutation.size());
  std::vector<uint32_t> old_of(permutation.size());
  for (uint32_t p = 0, next = 0; p < graph.points.size(); ++p) {
    if (is_kept[p]) {
      const uint32_t to = number[p] = permutation[next++];
      old_of[to] = p;
      kept.points[to] = graph.points[p];
      kept.input_of_point[to] = graph.input_of_point[p];
      kept_faces.point_face[to] = faces.point_face[p];
    }
  }
  for (const uint32_t point : graph.point_of_input) {
    kept.point_of_input.push_back(number[point]);
  }
  std::vector<uint32_t> order;
  for (uint32_t s = 0; s < graph.segments.size(); ++s) {
    if (faces.IsMeshed(faces.left_face[HalfEdgeOf(s, false)]) || faces.IsMeshed(faces.left_face[HalfEdgeOf(s, true)])) {
      order.push_back(s);
    }
  }
  const auto ends_of = [&](uint32_t s) { return std::pair(number[graph.segments[s].a], number[graph.segments[s].b]); };
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(
      order, [&](uint32_t s, uint32_t t) { return ends_of(s) < ends_of(t); }, context));
  std::vector<uint32_t> new_segment(graph.segments.size(), kNone);
  for (const uint32_t s : order) {
    new_segment[s] = static_cast<uint32_t>(kept.segments.size());
    GraphSegment segment = graph.segments[s];
    std::tie(segment.a, segment.b) = ends_of(s);
    kept.segments.push_back(segment);
    kept_faces.left_face.push_back(faces.left_face[HalfEdgeOf(s, false)]);
    kept_faces.left_face.push_back(faces.left_face[HalfEdgeOf(s, true)]);
  }
  kept_faces.first_around.push_back(0);
  for (const uint32_t old : old_of) {
    for (const HalfEdge h : faces.Around(old)) {
      if (const uint32_t s = new_segment[SegmentOf(h)]; s != kNone) {
        kept_faces.around.push_back(HalfEdgeOf(s, IsFromB(h)));
      }
    }
    kept_faces.first_around.push_back(static_cast<uint32_t>(kept_faces.around.size()));
  }
  graph = std::move(kept);
  faces = std::move(kept_faces);
  return absl::OkStatus();
}

}  // namespace wellspace::core
