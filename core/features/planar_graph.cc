#include "core/features/planar_graph.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/features/crossing_segments.h"
#include "core/features/near_segment.h"
#include "core/features/overlaps.h"
#include "core/features/place.h"
#include "core/features/point_merge.h"
#include "core/features/polygon_seeds.h"
#include "core/features/segment_groups.h"
#include "core/features/segment_pairs.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/segment.h"

namespace wellspace::core {
namespace {

// Faults that an error names; and so many at most are looked for.
constexpr size_t kNamed = 10;
constexpr size_t kMostFaults = 1000;
// Pairs of features that may meet, if the vertices that they make are no more. Crossings of many segments in one place
// are many pairs.
constexpr size_t kMostPairs = size_t{1} << 24;
// Faults that are looked at for equal ones.
constexpr size_t kFaultsBetweenLooks = size_t{1} << 16;
// Segments of a group of which those with a common end are looked for.
constexpr size_t kLargeGroup = 64;
// Rounds of splitting, each of which may bend segments over others, before it is given up.
constexpr int kMostRounds = 64;

constexpr uint32_t kNone = PlanarGraph::kNoInput;

// Makes the graph, step after step; in the coordinates as they are given, which the mesher scales later.
class GraphMaker {
 public:
  GraphMaker(const Features& features, double least_separation, uint64_t max_vertices, int threads,
             const RunContext& context)
      : features_(features),
        least_separation_(least_separation),
        reach_(features.crossings == CrossingRule::kRefuse ? least_separation
                                                           : std::max(least_separation, features.snap_distance)),
        max_vertices_(max_vertices),
        context_(context),
        team_(threads) {}

  absl::StatusOr<PlanarGraph> Make(std::span<const double> points, PointMerge merge, const Box<2>* box) {
    WELLSPACE_RETURN_IF_ERROR(TakePoints(points, std::move(merge)));
    WELLSPACE_RETURN_IF_ERROR(TakeSegments());
    if (box != nullptr) {
      AddBox(*box);
    }
    WELLSPACE_RETURN_IF_ERROR(DropDuplicates());
    WELLSPACE_RETURN_IF_ERROR(UniteOverlaps(graph_, context_));
    for (int round = 0;; ++round) {
      WELLSPACE_ASSIGN_OR_RETURN(std::vector<Fault> faults, FindFaults());
      if (faults.empty()) {
        break;
      }
      WELLSPACE_RETURN_IF_ERROR(FindNeedles(faults));
      WELLSPACE_RETURN_IF_ERROR(CheckAllowed(faults));
      if (round == kMostRounds) {
        return absl::ResourceExhaustedError(
            absl::StrCat("segments: splitting them where they cross does not end after ", kMostRounds, " rounds; ",
                         Describe(faults[0]), "; move these apart, or round the coordinates to fewer digits"));
      }
      WELLSPACE_RETURN_IF_ERROR(SplitAt(faults));
      WELLSPACE_RETURN_IF_ERROR(DropDuplicates());
    }
    return std::move(graph_);
  }

 private:
  const Point<2>& At(uint32_t point) const { return graph_.points[point]; }

  // A look at the context in a loop that makes short steps, of which this is one.
  absl::Status CheckAt(size_t step) const {
    return step % kStepsBetweenChecks == 0 ? context_.Check() : absl::OkStatus();
  }

  absl::Status TakePoints(std::span<const double> points, PointMerge merge) {
    graph_.points.reserve(merge.inputs.size());
    for (const uint32_t input : merge.inputs) {
      graph_.points.push_back(PointAt<2>(points, input));
    }
    graph_.counts.equal_points = merge.equal;
    graph_.counts.merged_points = merge.merged;
    has_taken_others_.resize(merge.merged > 0 ? merge.inputs.size() : 0);
    for (uint32_t i = 0; merge.merged > 0 && i < merge.place_of.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i));
      const uint32_t place = merge.place_of[i];
      has_taken_others_[place] = has_taken_others_[place] || PointAt<2>(points, i) != At(place);
    }
    graph_.point_of_input = std::move(merge.place_of);
    graph_.input_of_point = std::move(merge.inputs);
    return context_.Check();
  }

  absl::Status TakeSegments() {
    const size_t inputs = graph_.point_of_input.size();
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<uint32_t> polygons, PolygonsOfSegments(features_, context_));
    graph_.polygons = OddSets(static_cast<uint32_t>(features_.seeds.size()));
    WELLSPACE_ASSIGN_OR_RETURN(const SegmentGroups groups, GroupsOfSegments(features_, context_));
    graph_.groups = OddSets(groups.count());
    for (size_t s = 0; s < features_.segment_count(); ++s) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(s));
      GraphSegment segment;
      for (const size_t end : {size_t{0}, size_t{1}}) {
        const uint32_t input = features_.ends[2 * s + end];
        if (input >= inputs) {
          return absl::InvalidArgumentError(
              absl::StrCat("segments[", s, "]: its end ", input, " is not a point; ",
                           inputs == 0 ? "there are no points" : absl::StrCat("points are 0 to ", inputs - 1)));
        }
        (end == 0 ? segment.a : segment.b) = graph_.point_of_input[input];
      }
      segment.marker = features_.markers.empty() ? 0 : features_.markers[s];
      segment.source = static_cast<uint32_t>(s);
      segment.rings = features_.is_open.empty() || features_.is_open[s] == 0 ? 1 : 0;
      segment.polygons = polygons.empty() ? OddSets::kEmpty : polygons[s];
      segment.groups = groups.of_segment.empty() ? OddSets::kEmpty : groups.of_segment[s];
      if (segment.a == segment.b) {
        ++graph_.counts.empty_segments;
      } else {
        graph_.segments.push_back(segment);
      }
    }
    if (!polygons.empty()) {
      WELLSPACE_RETURN_IF_ERROR(CheckPolygonsClosed(graph_.point_of_input, features_, context_));
    }
    return CheckGroupsClosed(graph_.point_of_input, features_, groups, context_);
  }

  uint32_t AddPoint(const Point<2>& p) {
    graph_.points.push_back(p);
    graph_.input_of_point.push_back(kNone);
    return static_cast<uint32_t>(graph_.points.size() - 1);
  }

  // Makes the corners and sides of the box a part of the graph.
  void AddBox(const Box<2>& box) {
    std::array<uint32_t, 4> corner;
    for (uint32_t i = 0; i < 4; ++i) {
      const Point<2> p = {(i & 1) == 0 ? box.low[0] : box.high[0], (i & 2) == 0 ? box.low[1] : box.high[1]};
      const auto at = std::find(graph_.points.begin(), graph_.points.end(), p);
      corner[i] = at == graph_.points.end() ? AddPoint(p) : static_cast<uint32_t>(at - graph_.points.begin());
    }
    constexpr std::array<SegmentEnds, 4> kSides = {{{0, 2}, {1, 3}, {0, 1}, {2, 3}}};  // by FaceIndex
    for (uint32_t face = 0; face < 4; ++face) {
      graph_.segments.push_back(
          {corner[kSides[face][0]], corner[kSides[face][1]], 0, GraphSegment::kBoxSide + face, 1});
    }
  }

  // Has segments run from their lower end to the higher one, and leaves one of each.
  absl::Status DropDuplicates() {
    std::vector<GraphSegment>& segments = graph_.segments;
    for (GraphSegment& segment : segments) {
      if (At(segment.b) < At(segment.a)) {
        std::swap(segment.a, segment.b);
      }
    }
    std::vector<uint32_t> order(segments.size());
    std::iota(order.begin(), order.end(), 0);
    const auto is_before = [&](uint32_t i, uint32_t j) {
      const GraphSegment& s = segments[i];
      const GraphSegment& t = segments[j];
      return std::tie(s.a, s.b, s.source, i) < std::tie(t.a, t.b, t.source, j);
    };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(order, is_before, context_));
    std::vector<bool> is_dropped(segments.size());
    for (size_t k = 1; k < order.size(); ++k) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(k));
      GraphSegment& first = segments[order[k - 1]];
      const GraphSegment& next = segments[order[k]];
      if (first.a != next.a || first.b != next.b) {
        continue;
      }
      if (first.marker != next.marker && !next.IsBoxSide()) {
        return MarkersDifferError(graph_, first, next, first.a, first.b);
      }
      // A side of the box keeps the marker of a segment along it.
      graph_.counts.duplicate_segments += next.IsBoxSide() ? 0 : 1;
      first.rings += next.rings;
      first.polygons = graph_.polygons.Join(first.polygons, next.polygons);
      first.groups = graph_.groups.Join(first.groups, next.groups);
      is_dropped[order[k]] = true;
      std::swap(order[k - 1], order[k]);  // the next is compared with the one that stays
    }
    size_t kept = 0;
    for (size_t i = 0; i < segments.size(); ++i) {
      if (!is_dropped[i]) {
        segments[kept++] = segments[i];
      }
    }
    segments.resize(kept);
    return absl::OkStatus();
  }

  // The findings in a part of the plane.
  struct FaultsOfPart {
    std::vector<Fault> faults;  // some of them twice, as two features may come together in more than one group
    size_t unwanted = 0;
    uint64_t compared_pairs = 0;
    size_t next_look = kFaultsBetweenLooks;
  };

  // All faults: vertices that lie on segments or too close to them, and segments that cross; ascending, each once.
  // Stops early where a part has more than an error tells of.
  absl::StatusOr<std::vector<Fault>> FindFaults() {
    std::vector<Fault> faults;
    if (graph_.segments.empty()) {
      return faults;
    }
    std::vector<SegmentEnds> ends;
    ends.reserve(graph_.segments.size());
    for (const GraphSegment& segment : graph_.segments) {
      ends.push_back({segment.a, segment.b});
    }
    const SegmentPairs pairs(graph_.points, ends, reach_, context_);
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<SegmentPairs::Group> parts, pairs.Parts(team_));
    std::vector<FaultsOfPart> found(parts.size());
    are_too_many_ = false;
    team_.ForEach(parts.size(), [&](size_t part) {
      pairs.ForEachGroupOf(parts[part], [&](std::span<const uint32_t> segments, std::span<const uint32_t> points) {
        return AppendFaults(segments, points, found[part]) && found[part].unwanted <= kMostFaults && !IsStopped();
      });
      LookAt(found[part]);
    });
    WELLSPACE_RETURN_IF_ERROR(context_.Check());
    for (const FaultsOfPart& of_part : found) {
      graph_.counts.compared_pairs += of_part.compared_pairs;
      faults.insert(faults.end(), of_part.faults.begin(), of_part.faults.end());
    }
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(faults, std::less<Fault>(), context_));
    faults.erase(std::unique(faults.begin(), faults.end()), faults.end());
    if (are_too_many_ || faults.size() > MostPairs()) {
      return absl::ResourceExhaustedError(absl::StrCat(
          "segments: there are more than ", MostPairs(),
          " places where they cross or touch each other, or points lie on them or near them, two by two; give fewer "
          "segments",
          features_.snap_distance > least_separation_ ? ", or a smaller snap_distance" : ""));
    }
    return faults;
  }

  // Tells needles from other points that are too close to a segment: they are closed, whatever the rule, since no
  // double separates their sides. So are gaps that merging has opened.
  absl::Status FindNeedles(std::vector<Fault>& faults) {
    const auto is_near = [](const Fault& fault) { return fault.kind == Fault::Kind::kNear; };
    if (std::none_of(faults.begin(), faults.end(), is_near)) {
      return absl::OkStatus();
    }
    std::vector<SegmentEnds> ends;
    ends.reserve(graph_.segments.size());
    for (const GraphSegment& segment : graph_.segments) {
      ends.push_back({std::min(segment.a, segment.b), std::max(segment.a, segment.b)});
    }
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(ends, std::less<SegmentEnds>(), context_));
    const auto are_joined = [&](uint32_t p, uint32_t q) {
      return std::binary_search(ends.begin(), ends.end(), SegmentEnds{std::min(p, q), std::max(p, q)});
    };
    for (Fault& fault : faults) {
      const GraphSegment& segment = graph_.segments[fault.segment];
      if (is_near(fault) && (are_joined(fault.other, segment.a) || are_joined(fault.other, segment.b) ||
                             HasMoved(segment.a) || HasMoved(segment.b) || HasMoved(fault.other))) {
        fault.kind = Fault::Kind::kNeedle;
      }
    }
    return absl::OkStatus();
  }

  // Whether merging has moved the ends of segments at `point`. That may have moved them off vertices on their way.
  bool HasMoved(uint32_t point) const { return point < has_taken_others_.size() && has_taken_others_[point]; }

  size_t MostPairs() const { return std::max<size_t>(kMostPairs, max_vertices_); }
  bool IsStopped() const { return are_too_many_.load(std::memory_order_relaxed) || context_.IsCancelled(); }

  // Takes out equal faults, and notes if the others are too many.
  void LookAt(FaultsOfPart& found) {
    if (!CancellableSort(found.faults, std::less<Fault>(), context_).ok()) {
      return;
    }
    found.faults.erase(std::unique(found.faults.begin(), found.faults.end()), found.faults.end());
    found.next_look = std::max(kFaultsBetweenLooks, 2 * found.faults.size());
    if (found.faults.size() > MostPairs()) {
      are_too_many_ = true;
    }
  }

  void Note(const Fault& fault, FaultsOfPart& found) {
    found.faults.push_back(fault);
    found.unwanted += IsSplitAt(fault.kind) ? 0 : 1;
    if (found.faults.size() >= found.next_look) {
      LookAt(found);
    }
  }

  // Appends the faults among segments and points of a group, which may be large where features cannot be separated.
  // Returns false if that was stopped.
  bool AppendFaults(std::span<const uint32_t> segments, std::span<const uint32_t> points, FaultsOfPart& found) {
    const bool is_large = segments.size() > kLargeGroup;
    const auto goes_on = [&] { return !is_large || (found.unwanted <= kMostFaults && !IsStopped()); };
    for (const uint32_t p : points) {
      found.compared_pairs += segments.size();
      for (const uint32_t s : segments) {
        if (const auto kind = PointFault(s, p)) {
          Note({*kind, s, p}, found);
        }
      }
      if (!goes_on()) {
        return false;
      }
    }
    const auto compare = [&](uint32_t s, uint32_t t) {
      ++found.compared_pairs;
      if (Cross(s, t)) {
        Note({Fault::Kind::kCrossing, std::min(s, t), std::max(s, t)}, found);
      }
    };
    std::vector<uint32_t> rest(segments.begin(), segments.end());
    while (rest.size() > kLargeGroup) {
      // Segments with a common end do not cross: the others alone are compared with them.
      const uint32_t apex = MostCommonEnd(rest);
      const auto fan = std::partition(rest.begin(), rest.end(), [&](uint32_t s) {
        return graph_.segments[s].a != apex && graph_.segments[s].b != apex;
      });
      if (static_cast<size_t>(rest.end() - fan) < kLargeGroup) {
        break;
      }
      for (auto other = rest.begin(); other != fan; ++other) {
        std::for_each(fan, rest.end(), [&](uint32_t s) { compare(*other, s); });
        if (!goes_on()) {
          return false;
        }
      }
      rest.erase(fan, rest.end());
    }
    for (size_t i = 0; i < rest.size(); ++i) {
      for (size_t j = i + 1; j < rest.size(); ++j) {
        compare(rest[i], rest[j]);
      }
      if (!goes_on()) {
        return false;
      }
    }
    return true;
  }

  // The point in which most of `segments` have an end.
  uint32_t MostCommonEnd(std::span<const uint32_t> segments) const {
    std::vector<uint32_t> ends;
    ends.reserve(2 * segments.size());
    for (const uint32_t s : segments) {
      ends.insert(ends.end(), {graph_.segments[s].a, graph_.segments[s].b});
    }
    std::sort(ends.begin(), ends.end());
    uint32_t apex = ends.front();
    std::ptrdiff_t most = 0;
    for (auto end = ends.begin(); end != ends.end();) {
      const auto next = std::upper_bound(end, ends.end(), *end);
      if (next - end > most) {
        most = next - end;
        apex = *end;
      }
      end = next;
    }
    return apex;
  }

  std::optional<Fault::Kind> PointFault(uint32_t segment, uint32_t point) const {
    const GraphSegment& s = graph_.segments[segment];
    if (s.a == point || s.b == point) {
      return std::nullopt;
    }
    const Point<2>& a = At(s.a);
    const Point<2>& b = At(s.b);
    const Point<2>& p = At(point);
    const Box<2> box = BoxOfEnds(a, b);
    if (DistanceSq<2>(p, box) > 4 * reach_ * reach_) {
      return std::nullopt;
    }
    if (SideOf(a, b, p) == Sign::kZero) {
      return IsBetween(a, b, p) ? std::optional(Fault::Kind::kOn) : std::nullopt;
    }
    // Beyond an end, two points are too close to each other, which is told elsewhere.
    const double t = Along(a, b, p);
    const double distance = DistanceToSegment(a, b, p);
    if (!(t > 0 && t < 1 && distance < reach_)) {
      return std::nullopt;
    }
    // A segment is led through a point farther away only if both parts are shorter than it, so that this ends: else it
    // might be led from one of two points beside each other to the other, and back.
    const bool is_led = std::max(DistanceSq<2>(a, p), DistanceSq<2>(p, b)) < DistanceSq<2>(a, b);
    return distance < least_separation_ || is_led ? std::optional(Fault::Kind::kNear) : std::nullopt;
  }

  bool Cross(uint32_t s, uint32_t t) const {
    const GraphSegment& one = graph_.segments[s];
    const GraphSegment& two = graph_.segments[t];
    if (one.a == two.a || one.a == two.b || one.b == two.a || one.b == two.b) {
      return false;
    }
    const auto apart = [&](const GraphSegment& line, const GraphSegment& other) {
      return SideOf(At(line.a), At(line.b), At(other.a)) * SideOf(At(line.a), At(line.b), At(other.b)) ==
             Sign::kNegative;
    };
    return apart(one, two) && apart(two, one);
  }

  // A crossing of two segments. Segments that are given cross in the first round: later ones have been bent over each
  // other.
  Point<2> CrossingOf(const Fault& fault) const {
    const GraphSegment& s = graph_.segments[fault.segment];
    const GraphSegment& t = graph_.segments[fault.other];
    return std::pair(At(s.a), At(s.b)) < std::pair(At(t.a), At(t.b)) ? CrossingFrom(At(s.a), At(s.b), At(t.a), At(t.b))
                                                                     : CrossingFrom(At(t.a), At(t.b), At(s.a), At(s.b));
  }

  std::string NameOf(uint32_t segment) const {
    const GraphSegment& s = graph_.segments[segment];
    if (s.IsBoxSide()) {
      return absl::StrCat("a side of the box from ", PlaceText(At(s.a)), " to ", PlaceText(At(s.b)));
    }
    return absl::StrCat("segments[", s.source, "]");
  }
  std::string NameOfPoint(uint32_t point) const {
    return graph_.input_of_point[point] == kNone ? "the vertex"
                                                 : absl::StrCat("points[", graph_.input_of_point[point], "]");
  }

  std::string Describe(const Fault& fault) const {
    const GraphSegment& s = graph_.segments[fault.segment];
    if (fault.kind == Fault::Kind::kCrossing) {
      return absl::StrCat(NameOf(fault.segment), " and ", NameOf(fault.other), " cross at ",
                          PlaceText(CrossingOf(fault)));
    }
    const Point<2>& p = At(fault.other);
    return DescribeNearSegment(NameOfPoint(fault.other), p, DistanceToSegment(At(s.a), At(s.b), p),
                               NameOf(fault.segment));
  }

  bool IsSplitAt(Fault::Kind kind) const {
    return kind == Fault::Kind::kOn || features_.crossings == CrossingRule::kSplit ||
           (kind == Fault::Kind::kNear && features_.crossings == CrossingRule::kSnap);
  }

  // Refuses faults that are not to be split at.
  absl::Status CheckAllowed(const std::vector<Fault>& faults) const {
    for (const auto kind : {Fault::Kind::kCrossing, Fault::Kind::kNear}) {
      std::string names;
      size_t count = 0;
      for (const Fault& fault : faults) {
        if (fault.kind == kind && !IsSplitAt(kind) && count++ < kNamed) {
          absl::StrAppend(&names, count == 1 ? "" : "; ", Describe(fault));
        }
      }
      if (count == 0) {
        continue;
      }
      const std::string more =
          count > kNamed ? absl::StrCat("; and ", count - kNamed, " more", count >= kMostFaults ? " at least" : "")
                         : "";
      const std::string described = absl::StrCat("segments: ", names, more);
      if (kind == Fault::Kind::kNear) {
        return NearSegmentError(described, least_separation_, 0);
      }
      return absl::InvalidArgumentError(
          absl::StrCat(described,
                       "; segments may meet in common ends alone, or be split there by the rule of crossings "
                       "\"split\""));
    }
    return absl::OkStatus();
  }

  // The vertex within reach of `p`, or a new one: where several segments cross in one place, their crossings are
  // rounded to places beside each other.
  //
  // Complexity: O(log n); O(n log n) the first time.
  uint32_t VertexNear(const Point<2>& p) {
    const auto cell_of = [this](const Point<2>& q) {
      return Point<2>{std::floor(q[0] / reach_), std::floor(q[1] / reach_)};
    };
    for (; in_cells_ < graph_.points.size(); ++in_cells_) {
      by_cell_.emplace(cell_of(At(in_cells_)), in_cells_);
    }
    const Point<2> cell = cell_of(p);
    uint32_t nearest = kNone;
    for (const double x : {cell[0] - 1, cell[0], cell[0] + 1}) {
      for (const double y : {cell[1] - 1, cell[1], cell[1] + 1}) {
        const auto [begin, end] = by_cell_.equal_range({x, y});
        for (auto at = begin; at != end; ++at) {
          const double distance = Distance<2>(At(at->second), p);
          if (distance < reach_ && (nearest == kNone || std::pair(distance, At(at->second)) <
                                                            std::pair(Distance<2>(At(nearest), p), At(nearest)))) {
            nearest = at->second;
          }
        }
      }
    }
    return nearest != kNone ? nearest : AddPoint(p);
  }

  // Splits segments at points on them and at crossings. Crossings are taken by their places, and so are points on a
  // segment: their numbers are those of the input, whose order is not to matter.
  absl::Status SplitAt(const std::vector<Fault>& faults) {
    std::vector<std::pair<uint32_t, uint32_t>> splits;   // segment, point
    std::vector<std::pair<Point<2>, size_t>> crossings;  // place, fault
    for (size_t i = 0; i < faults.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i));
      if (faults[i].kind == Fault::Kind::kCrossing) {
        crossings.emplace_back(CrossingOf(faults[i]), i);
        continue;
      }
      splits.emplace_back(faults[i].segment, faults[i].other);
      ++(faults[i].kind == Fault::Kind::kOn ? graph_.counts.touching_vertices : graph_.counts.near_vertices);
    }
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(crossings, std::less<std::pair<Point<2>, size_t>>(), context_));
    const size_t points_before = graph_.points.size();
    for (size_t i = 0; i < crossings.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i));
      const uint32_t point = VertexNear(crossings[i].first);
      const Fault& fault = faults[crossings[i].second];
      for (const uint32_t segment : {fault.segment, fault.other}) {
        splits.emplace_back(segment, point);
      }
      ++graph_.counts.crossings;
      if (graph_.points.size() - points_before > max_vertices_) {
        return absl::ResourceExhaustedError(
            absl::StrCat("segments: ", crossings.size(), " pairs of them cross, which makes more than max_vertices = ",
                         max_vertices_, " vertices; raise max_vertices, or give fewer segments"));
      }
    }
    const auto is_before = [this](const auto& x, const auto& y) {
      const GraphSegment& s = graph_.segments[x.first];
      return x.first != y.first ? x.first < y.first
                                : std::pair(Along(At(s.a), At(s.b), At(x.second)), At(x.second)) <
                                      std::pair(Along(At(s.a), At(s.b), At(y.second)), At(y.second));
    };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(splits, is_before, context_));
    std::vector<GraphSegment> split;
    auto next = splits.begin();
    for (uint32_t s = 0; s < graph_.segments.size(); ++s) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(s));
      GraphSegment part = graph_.segments[s];
      const uint32_t end = part.b;
      for (; next != splits.end() && next->first == s; ++next) {
        part.b = next->second;
        if (part.a != part.b && part.b != end) {
          split.push_back(part);
          part.a = part.b;
        }
      }
      part.b = end;
      split.push_back(part);
    }
    graph_.segments = std::move(split);
    return absl::OkStatus();
  }

  const Features& features_;
  const double least_separation_;
  const double reach_;  // a vertex nearer than this to a segment is too close to it
  const uint64_t max_vertices_;
  const RunContext& context_;
  ThreadTeam team_;
  std::atomic<bool> are_too_many_ = false;  // faults
  PlanarGraph graph_;
  std::vector<bool> has_taken_others_;         // by point: others are it now; empty if none is
  std::multimap<Point<2>, uint32_t> by_cell_;  // points by cells as large as the reach, of which so many:
  uint32_t in_cells_ = 0;
};

}  // namespace

absl::StatusOr<PlanarGraph> MakePlanarGraph(std::span<const double> points, const Features& features, const Box<2>* box,
                                            double least_separation, uint64_t max_vertices, int threads,
                                            const RunContext& context, std::optional<PointMerge> merge) {
  if (!merge.has_value()) {
    WELLSPACE_ASSIGN_OR_RETURN(merge, MergeTwins(points, features, least_separation, context));
  }
  return GraphMaker(features, least_separation, max_vertices, threads, context).Make(points, *std::move(merge), box);
}

}  // namespace wellspace::core
