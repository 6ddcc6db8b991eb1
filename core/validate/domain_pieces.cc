#include "core/validate/domain_pieces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/status_macros.h"
#include "core/geometry/box_tree.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/segment.h"
#include "core/validate/facet_fans.h"
#include "core/validate/vertex_places.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
constexpr uint32_t kStepsBetweenLooks = 1024;
// Rounds of cutting stretches at each other before it is given up.
constexpr int kMostRounds = 64;

std::string PlaceName(const Point<2>& p) { return absl::StrFormat("(%.17g, %.17g)", p[0], p[1]); }

// The way along a segment.
struct Course {
  Point<2> from;
  Point<2> along;  // of length 1
  double length;

  Course(const Point<2>& a, const Point<2>& b) : from(a), along(Difference<2>(b, a)), length(Distance<2>(a, b)) {
    along = {along[0] / length, along[1] / length};
  }
  double At(const Point<2>& p) const { return Dot<2>(along, Difference<2>(p, from)); }
  double Away(const Point<2>& p) const { return std::abs(Cross(along, Difference<2>(p, from))); }
};

// Follows segments along facets.
//
// Facets on a line form chains, along which a segment is followed at once: else segments that lie on each other would
// take the square of their number.
class Follower {
 public:
  Follower(std::vector<Point<2>>& vertices, std::span<const double> mesh_vertices, std::span<const uint32_t> facets,
           const BoundingSegments& segments, double tolerance, VertexPlaces& places)
      : vertices_(vertices),
        mesh_vertices_(vertices.size()),
        segments_(segments),
        tolerance_(tolerance),
        places_(places),
        fans_(mesh_vertices, facets),
        chain_of_(facets.size() / 2, kNone),
        place_in_chain_(facets.size() / 2),
        source_of_(facets.size() / 2, Piece::kNotGiven),
        corners_(CornersOf(facets)),
        tree_(BoxesOf(corners_)) {}

  // Follows a segment, and appends the stretches of it that have no facets.
  //
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Follow(uint32_t segment, std::vector<Piece>& stretches, const RunContext& context) {
    const Point<2>& a = segments_.points[segments_.ends[segment][0]];
    const Point<2>& b = segments_.points[segments_.ends[segment][1]];
    if (a == b) {
      return absl::OkStatus();
    }
    const Course course(a, b);
    const Course back(b, a);
    const uint32_t last = places_.At(b);
    const uint32_t first = places_.At(a);
    const auto last_way = WayAlong(last, back, first);
    std::vector<Stop> stops;  // where a stretch may end, once there is one
    bool has_stops = false;
    uint32_t open_chain = kNone;
    for (uint32_t at = first; at != last;) {
      if (++steps_ % kStepsBetweenLooks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      const auto way = WayAlong(at, course, last);
      if (way) {
        at = Step(segment, at, *way, last, last_way, course, open_chain);
        continue;
      }
      if (!std::exchange(has_stops, true)) {
        stops = StopsOn(course);
      }
      const uint32_t next = NextStop(stops, at, last, course);
      stretches.push_back(Between(at, next, segment));
      at = next;
    }
    return absl::OkStatus();
  }

  // The piece that lies on each facet.
  std::vector<Piece> Facets(std::span<const uint32_t> facets) const {
    std::vector<Piece> pieces(facets.size() / 2);
    std::vector<std::vector<int64_t>> rings;
    for (const Chain& chain : chains_) {
      rings.push_back(chain.rings);
      std::partial_sum(rings.back().begin(), rings.back().end(), rings.back().begin());
    }
    for (uint32_t f = 0; f < pieces.size(); ++f) {
      pieces[f] = Between(facets[2 * f], facets[2 * f + 1], source_of_[f]);
      pieces[f].rings = chain_of_[f] == kNone ? 0 : static_cast<uint32_t>(rings[chain_of_[f]][place_in_chain_[f]]);
      pieces[f].groups.clear();
    }
    if (!segments_.groups.empty()) {
      SetGroups(pieces);
    }
    return pieces;
  }

  // The groups of which an odd number of rings lies on each facet.
  void SetGroups(std::vector<Piece>& pieces) const {
    std::vector<std::vector<uint32_t>> facets;  // of each chain, in their order
    for (const Chain& chain : chains_) {
      facets.emplace_back(chain.vertices.size() - 1, kNone);
    }
    for (uint32_t f = 0; f < pieces.size(); ++f) {
      if (chain_of_[f] != kNone) {
        facets[chain_of_[f]][place_in_chain_[f]] = f;
      }
    }
    for (size_t c = 0; c < chains_.size(); ++c) {
      std::vector<std::pair<uint32_t, uint32_t>> toggles = chains_[c].toggles;
      std::sort(toggles.begin(), toggles.end());
      std::set<uint32_t> on;
      auto next = toggles.begin();
      for (uint32_t place = 0; place < facets[c].size(); ++place) {
        for (; next != toggles.end() && next->first == place; ++next) {
          if (on.erase(next->second) == 0) {
            on.insert(next->second);
          }
        }
        pieces[facets[c][place]].groups.assign(on.begin(), on.end());
      }
    }
  }

  Piece Between(uint32_t u, uint32_t v, uint32_t source) const {
    const bool is_up = vertices_[u] < vertices_[v];
    const uint32_t rings = source == Piece::kNotGiven ? 0 : segments_.is_ring[source];
    Piece piece{.ends = {is_up ? u : v, is_up ? v : u}, .rings = rings, .source = source};
    if (rings > 0 && !segments_.groups.empty()) {
      piece.groups = {segments_.groups[source]};
    }
    return piece;
  }

 private:
  using Way = FacetFans::Way;

  // Facets in a row on a line.
  struct Chain {
    std::vector<uint32_t> vertices;
    std::vector<int64_t> rings;  // of each facet less those of the one before; one more at the end
    std::vector<std::pair<uint32_t, uint32_t>> toggles;  // from which facet on a ring of which group begins or ends
  };

  struct Stop {
    double at;
    uint32_t vertex;
  };

  static std::vector<uint32_t> CornersOf(std::span<const uint32_t> facets) {
    std::vector<uint32_t> corners(facets.begin(), facets.end());
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    return corners;
  }
  std::vector<Box<2>> BoxesOf(const std::vector<uint32_t>& corners) const {
    std::vector<Box<2>> boxes;
    for (const uint32_t v : corners) {
      boxes.push_back({vertices_[v], vertices_[v]});
    }
    return boxes;
  }

  // The facet at `v` that leads on along `course`, which ends at the vertex `last`, or none; of several the facet that
  // strays least.
  std::optional<Way> WayAlong(uint32_t v, const Course& course, uint32_t last) const {
    std::optional<Way> best;
    if (v >= mesh_vertices_) {
      return best;
    }
    const double from = course.At(vertices_[v]);
    double best_away = 0;
    fans_.ForEachNear(v, course.along, [&](const Way& way) {
      const double away = course.Away(vertices_[way.to]);
      const double at = course.At(vertices_[way.to]);
      if (away <= tolerance_ && at > from && (at < course.length || way.to == last) && (!best || away < best_away)) {
        best = way;
        best_away = away;
      }
    });
    return best;
  }

  // Goes on from `at`: to the end of the segment, or of the chain, or over one facet. Returns the vertex there.
  uint32_t Step(uint32_t segment, uint32_t at, const Way& way, uint32_t last, const std::optional<Way>& last_way,
                const Course& course, uint32_t& open_chain) {
    uint32_t& chain = chain_of_[way.facet];
    if (chain == kNone) {
      if (open_chain == kNone || chains_[open_chain].vertices.back() != at) {
        open_chain = static_cast<uint32_t>(chains_.size());
        chains_.push_back({.vertices = {at}, .rings = {0}, .toggles = {}});
      }
      chain = open_chain;
      place_in_chain_[way.facet] = static_cast<uint32_t>(chains_[chain].vertices.size() - 1);
      chains_[chain].vertices.push_back(way.to);
      chains_[chain].rings.push_back(0);
      source_of_[way.facet] = segment;
    }
    Chain& line = chains_[chain];
    const uint32_t from = IndexOf(at, way);
    const bool is_forward = from == place_in_chain_[way.facet];
    uint32_t to = is_forward ? from + 1 : from - 1;
    if (last_way && chain_of_[last_way->facet] == chain && (IndexOf(last, *last_way) > from) == is_forward) {
      to = IndexOf(last, *last_way);
    } else if (const uint32_t end = is_forward ? static_cast<uint32_t>(line.vertices.size() - 1) : 0;
               IsOn(course, line.vertices[end]) &&
               course.At(vertices_[line.vertices[end]]) > course.At(vertices_[at])) {
      to = end;
    }
    line.rings[std::min(from, to)] += segments_.is_ring[segment];
    line.rings[std::max(from, to)] -= segments_.is_ring[segment];
    if (segments_.is_ring[segment] != 0 && !segments_.groups.empty()) {
      for (const uint32_t end : {from, to}) {
        line.toggles.emplace_back(end, segments_.groups[segment]);
      }
    }
    return line.vertices[to];
  }

  // The index of an end of a facet in its chain.
  uint32_t IndexOf(uint32_t vertex, const Way& way) const {
    const uint32_t place = place_in_chain_[way.facet];
    return chains_[chain_of_[way.facet]].vertices[place] == vertex ? place : place + 1;
  }

  bool IsOn(const Course& course, uint32_t vertex) const {
    const double at = course.At(vertices_[vertex]);
    return at > 0 && at < course.length && course.Away(vertices_[vertex]) <= tolerance_;
  }

  // Corners of facets on a segment, in their order.
  std::vector<Stop> StopsOn(const Course& course) const {
    std::vector<Stop> stops;
    const Point<2> end = {course.from[0] + course.length * course.along[0],
                          course.from[1] + course.length * course.along[1]};
    tree_.ForEach([&](const Box<2>& box) { return !SurelyMisses(course.from, end, Widened(box, tolerance_)); },
                  [&](uint32_t i) {
                    const Point<2>& p = vertices_[corners_[i]];
                    if (IsOn(course, corners_[i])) {
                      stops.push_back({course.At(p), corners_[i]});
                    }
                    return true;
                  });
    std::sort(stops.begin(), stops.end(),
              [](const Stop& a, const Stop& b) { return std::tie(a.at, a.vertex) < std::tie(b.at, b.vertex); });
    return stops;
  }

  // Where the stretch that begins at `at` ends: where facets go on along the segment, or at its end.
  uint32_t NextStop(const std::vector<Stop>& stops, uint32_t at, uint32_t last, const Course& course) const {
    const double from = course.At(vertices_[at]);
    auto stop = std::upper_bound(stops.begin(), stops.end(), from,
                                 [](double begin, const Stop& next) { return begin < next.at; });
    for (; stop != stops.end(); ++stop) {
      if (stop->vertex != at && (stop->vertex == last || WayAlong(stop->vertex, course, last))) {
        return stop->vertex;
      }
    }
    return last;
  }

  std::vector<Point<2>>& vertices_;
  const size_t mesh_vertices_;
  const BoundingSegments& segments_;
  const double tolerance_;
  VertexPlaces& places_;
  const FacetFans fans_;
  std::vector<uint32_t> chain_of_;        // by facet
  std::vector<uint32_t> place_in_chain_;  // by facet
  std::vector<uint32_t> source_of_;       // by facet
  const std::vector<uint32_t> corners_;   // the ends of facets
  const BoxTree<2> tree_;                 // of these
  std::vector<Chain> chains_;
  uint32_t steps_ = 0;
};

// Cuts stretches at vertices and at each other.
class StretchCutter {
 public:
  StretchCutter(DomainPieces& made, size_t facets, double tolerance, VertexPlaces& places, const RunContext& context)
      : made_(made), facets_(facets), tolerance_(tolerance), places_(places), context_(context) {}

  absl::Status Cut(const BoundingSegments& segments) {
    for (int round = 0; round < kMostRounds; ++round) {
      WELLSPACE_RETURN_IF_ERROR(CutAtVertices());
      JoinEqual();
      if (made_.pieces.size() == facets_) {
        return absl::OkStatus();
      }
      WELLSPACE_ASSIGN_OR_RETURN(const SweptFaces swept, SweepFaces(made_.vertices, made_.pieces, {}, context_));
      if (swept.crossings.empty()) {
        return absl::OkStatus();
      }
      for (const auto& [one, other] : swept.crossings) {
        if (one < facets_) {
          return CrossesFacet(segments, one, other);
        }
      }
      WELLSPACE_RETURN_IF_ERROR(CutAtEachOther());
    }
    return absl::FailedPreconditionError(absl::StrCat(
        "segments: those that bound nothing which is meshed cross in places that double precision does not "
        "tell apart, after ",
        kMostRounds, " rounds"));
  }

 private:
  const Point<2>& Low(const Piece& piece) const { return made_.vertices[piece.ends[0]]; }
  const Point<2>& High(const Piece& piece) const { return made_.vertices[piece.ends[1]]; }

  absl::Status CrossesFacet(const BoundingSegments& segments, uint32_t facet, uint32_t other) const {
    const Piece& one = made_.pieces[facet];
    const Piece& two = made_.pieces[other];
    return absl::FailedPreconditionError(
        absl::StrCat("facet ", facet, " of vertices ", one.ends[0], " and ", one.ends[1], " is crossed by ",
                     other < facets_ ? absl::StrCat("facet ", other) : segments.NameOf(two.source), " from ",
                     PlaceName(Low(two)), " to ", PlaceName(High(two))));
  }

  // Leads stretches through the vertices of pieces that are on them.
  absl::Status CutAtVertices() {
    std::vector<uint32_t> corners;
    for (const Piece& piece : made_.pieces) {
      corners.insert(corners.end(), piece.ends.begin(), piece.ends.end());
    }
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    std::vector<Box<2>> boxes;
    for (const uint32_t v : corners) {
      boxes.push_back({made_.vertices[v], made_.vertices[v]});
    }
    const BoxTree<2> tree(std::move(boxes));
    std::vector<Piece> cut(made_.pieces.begin(), made_.pieces.begin() + static_cast<std::ptrdiff_t>(facets_));
    std::vector<std::pair<double, uint32_t>> on;
    for (size_t p = facets_; p < made_.pieces.size(); ++p) {
      const Piece& piece = made_.pieces[p];
      const Course course(Low(piece), High(piece));
      on.clear();
      tree.ForEach([&](const Box<2>& box) { return !SurelyMisses(Low(piece), High(piece), Widened(box, tolerance_)); },
                   [&](uint32_t i) {
                     const double at = course.At(made_.vertices[corners[i]]);
                     if (at > 0 && at < course.length && course.Away(made_.vertices[corners[i]]) <= tolerance_) {
                       on.emplace_back(at, corners[i]);
                     }
                     return true;
                   });
      std::sort(on.begin(), on.end());
      AppendParts(piece, on, cut);
      if (p % kStepsBetweenLooks == 0 || on.size() > kStepsBetweenLooks) {
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
      }
    }
    made_.pieces = std::move(cut);
    return absl::OkStatus();
  }

  void AppendParts(const Piece& piece, const std::vector<std::pair<double, uint32_t>>& on, std::vector<Piece>& parts) {
    uint32_t from = piece.ends[0];
    const auto append = [&](uint32_t to) {
      if (to != from) {
        Piece part = piece;
        const bool is_up = made_.vertices[from] < made_.vertices[to];
        part.ends = {is_up ? from : to, is_up ? to : from};
        parts.push_back(part);
        from = to;
      }
    };
    for (const auto& [at, vertex] : on) {
      if (vertex != piece.ends[1]) {
        append(vertex);
      }
    }
    append(piece.ends[1]);
  }

  // Makes one of pieces with the same ends: a facet, if one of them is.
  void JoinEqual() {
    std::vector<uint32_t> order(made_.pieces.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](uint32_t i, uint32_t j) {
      return std::tie(made_.pieces[i].ends, i) < std::tie(made_.pieces[j].ends, j);
    });
    std::vector<bool> is_left_out(order.size());
    for (size_t begin = 0, end = 0; begin < order.size(); begin = end) {
      for (end = begin + 1; end < order.size() && made_.pieces[order[end]].ends == made_.pieces[order[begin]].ends;
           ++end) {
        made_.pieces[order[begin]].rings += made_.pieces[order[end]].rings;
        std::vector<uint32_t>& groups = made_.pieces[order[begin]].groups;
        groups.insert(groups.end(), made_.pieces[order[end]].groups.begin(), made_.pieces[order[end]].groups.end());
        is_left_out[order[end]] = order[end] >= facets_;
      }
    }
    size_t kept = 0;
    for (size_t p = 0; p < made_.pieces.size(); ++p) {
      if (!is_left_out[p]) {
        made_.pieces[kept++] = made_.pieces[p];
      }
    }
    made_.pieces.resize(kept);
  }

  // Cuts stretches where two of them cross.
  absl::Status CutAtEachOther() {
    std::vector<Piece>& pieces = made_.pieces;
    std::sort(pieces.begin() + static_cast<std::ptrdiff_t>(facets_), pieces.end(),
              [&](const Piece& a, const Piece& b) { return std::tie(Low(a), High(a)) < std::tie(Low(b), High(b)); });
    std::vector<std::vector<std::pair<double, uint32_t>>> cuts(pieces.size());
    uint64_t steps = 0;
    for (size_t i = facets_; i < pieces.size(); ++i) {
      for (size_t j = i + 1; j < pieces.size() && Low(pieces[j])[0] <= High(pieces[i])[0]; ++j) {
        if (++steps % kStepsBetweenLooks == 0) {
          WELLSPACE_RETURN_IF_ERROR(context_.Check());
        }
        if (const auto place = CrossingOf(pieces[i], pieces[j])) {
          const uint32_t vertex = VertexNear(*place);
          for (const size_t p : {i, j}) {
            cuts[p].emplace_back(Course(Low(pieces[p]), High(pieces[p])).At(made_.vertices[vertex]), vertex);
          }
        }
      }
    }
    std::vector<Piece> parts(pieces.begin(), pieces.begin() + static_cast<std::ptrdiff_t>(facets_));
    for (size_t p = facets_; p < pieces.size(); ++p) {
      std::sort(cuts[p].begin(), cuts[p].end());
      AppendParts(pieces[p], cuts[p], parts);
    }
    pieces = std::move(parts);
    return absl::OkStatus();
  }

  // Where two pieces cross, rounded.
  std::optional<Point<2>> CrossingOf(const Piece& one, const Piece& other) const {
    const Point<2>& a = Low(one);
    const Point<2>& b = High(one);
    const Point<2>& c = Low(other);
    const Point<2>& d = High(other);
    if (std::max(a[1], b[1]) < std::min(c[1], d[1]) || std::max(c[1], d[1]) < std::min(a[1], b[1]) ||
        Orientation<2>({a, b, c}).sign * Orientation<2>({a, b, d}).sign != Sign::kNegative ||
        Orientation<2>({c, d, a}).sign * Orientation<2>({c, d, b}).sign != Sign::kNegative) {
      return std::nullopt;
    }
    const Point<2> along = Difference<2>(b, a);
    const double from = Cross(Difference<2>(c, a), along);
    const double to = Cross(Difference<2>(d, a), along);
    const double t = from == to ? 0.5 : std::clamp(from / (from - to), 0.0, 1.0);
    return Point<2>{c[0] + t * (d[0] - c[0]), c[1] + t * (d[1] - c[1])};
  }

  // A vertex of stretches within the tolerance of `p`, or a new one there.
  uint32_t VertexNear(const Point<2>& p) {
    const auto cell_of = [this](const Point<2>& q) {
      return Point<2>{std::floor(q[0] / tolerance_), std::floor(q[1] / tolerance_)};
    };
    const Point<2> cell = cell_of(p);
    for (const double x : {cell[0] - 1, cell[0], cell[0] + 1}) {
      for (const double y : {cell[1] - 1, cell[1], cell[1] + 1}) {
        const auto [begin, end] = crossings_.equal_range({x, y});
        for (auto at = begin; at != end; ++at) {
          if (Distance<2>(made_.vertices[at->second], p) <= tolerance_) {
            return at->second;
          }
        }
      }
    }
    const uint32_t vertex = places_.At(p);
    crossings_.emplace(cell, vertex);
    return vertex;
  }

  DomainPieces& made_;
  const size_t facets_;
  const double tolerance_;
  VertexPlaces& places_;
  const RunContext& context_;
  std::multimap<Point<2>, uint32_t> crossings_;  // by cells as large as the tolerance
};

}  // namespace

std::string BoundingSegments::NameOf(uint32_t segment) const {
  return segment < given ? absl::StrCat("segments[", segment, "]") : "a side of the box";
}

BoundingSegments SegmentsOf(std::span<const double> points, const Features& features, const Box<2>* box) {
  BoundingSegments made;
  for (size_t i = 0; i < points.size() / 2; ++i) {
    made.points.push_back(PointAt<2>(points, i));
  }
  made.given = static_cast<uint32_t>(features.segment_count());
  for (size_t s = 0; s < made.given; ++s) {
    made.ends.push_back({features.ends[2 * s], features.ends[2 * s + 1]});
    made.is_ring.push_back(features.is_open.empty() || features.is_open[s] == 0 ? 1 : 0);
    if (features.faces == FaceRule::kUnion) {
      made.groups.push_back(features.groups.empty() ? 0 : features.groups[s]);
    }
  }
  if (box != nullptr) {
    const auto first = static_cast<uint32_t>(made.points.size());
    for (const uint32_t corner : {0U, 1U, 2U, 3U}) {
      made.points.push_back(
          {(corner & 1) == 0 ? box->low[0] : box->high[0], (corner & 2) == 0 ? box->low[1] : box->high[1]});
    }
    for (const auto& [a, b] : {std::pair{0U, 2U}, {1U, 3U}, {0U, 1U}, {2U, 3U}}) {  // by FaceIndex
      made.ends.push_back({first + a, first + b});
      made.is_ring.push_back(1);
    }
  }
  return made;
}

absl::StatusOr<DomainPieces> CutSegments(std::span<const double> vertices, std::span<const uint32_t> facets,
                                         const BoundingSegments& segments, double tolerance,
                                         const RunContext& context) {
  DomainPieces made;
  for (size_t v = 0; v < vertices.size() / 2; ++v) {
    made.vertices.push_back(PointAt<2>(vertices, v));
  }
  WELLSPACE_ASSIGN_OR_RETURN(VertexPlaces places, VertexPlaces::Of(made.vertices, context));
  Follower follower(made.vertices, vertices, facets, segments, tolerance, places);
  // Long ones first, so that shorter ones on them find their chains; and sides of the box last, so that facets are
  // known to be of segments that lie on these.
  std::vector<uint32_t> order(segments.ends.size());
  std::iota(order.begin(), order.end(), 0);
  const auto length_of = [&](uint32_t s) {
    return Distance<2>(segments.points[segments.ends[s][0]], segments.points[segments.ends[s][1]]);
  };
  std::sort(order.begin(), order.end(), [&](uint32_t s, uint32_t t) {
    return std::tuple(s >= segments.given, -length_of(s), s) < std::tuple(t >= segments.given, -length_of(t), t);
  });
  std::vector<Piece> stretches;
  for (const uint32_t segment : order) {
    WELLSPACE_RETURN_IF_ERROR(follower.Follow(segment, stretches, context));
  }
  made.pieces = follower.Facets(facets);
  for (size_t f = 0; f < made.pieces.size(); ++f) {
    if (made.pieces[f].source == Piece::kNotGiven) {
      return absl::FailedPreconditionError(
          absl::StrCat("facet ", f, " of vertices ", facets[2 * f], " and ", facets[2 * f + 1], ", from ",
                       PlaceName(made.vertices[facets[2 * f]]), " to ", PlaceName(made.vertices[facets[2 * f + 1]]),
                       ", lies along no segment"));
    }
  }
  made.pieces.insert(made.pieces.end(), stretches.begin(), stretches.end());
  WELLSPACE_RETURN_IF_ERROR(StretchCutter(made, facets.size() / 2, tolerance, places, context).Cut(segments));
  return made;
}

}  // namespace wellspace::core
