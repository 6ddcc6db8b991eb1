#include "core/features/polygon_seeds.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <set>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/features/closed_rings.h"
#include "core/features/face_walk.h"
#include "core/features/odd_sets.h"
#include "core/features/place.h"
#include "core/geometry/segment.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kOfNoPolygon = OddSets::kEmpty;
constexpr uint32_t kStepsBetweenLooks = 1024;

// A segment that bounds a polygon, which lies to the left of it.
struct Side {
  uint32_t polygon;
  HalfEdge half_edge;
};

// The areas of polygons: sums of terms in the order of their size, so that equal rings have equal areas.
std::vector<double> AreasOf(const PlanarGraph& graph, std::vector<Side>& sides, size_t seeds) {
  const auto place_of = [&](HalfEdge h) -> const Point<2>& {
    const GraphSegment& s = graph.segments[SegmentOf(h)];
    return graph.points[IsFromB(h) ? s.b : s.a];
  };
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.polygon, a.half_edge) < std::tie(b.polygon, b.half_edge);
  });
  std::vector<double> areas(seeds);
  std::vector<double> terms;
  for (auto begin = sides.begin(); begin != sides.end();) {
    auto end = begin;
    Point<2> lowest = place_of(begin->half_edge);
    for (; end != sides.end() && end->polygon == begin->polygon; ++end) {
      lowest = std::min(lowest, place_of(end->half_edge));
    }
    terms.clear();
    for (auto side = begin; side != end; ++side) {
      terms.push_back(0.5 * Cross(Difference<2>(place_of(side->half_edge), lowest),
                                  Difference<2>(place_of(TwinOf(side->half_edge)), lowest)));
    }
    std::sort(terms.begin(), terms.end());
    areas[begin->polygon] = std::accumulate(terms.begin(), terms.end(), 0.0);
    begin = end;
  }
  return areas;
}

// Polygons in the order in which they have faces: by area, and those of one area by hole, region and largest area.
struct Ranks {
  std::vector<uint32_t> rank;      // by seed
  std::vector<uint32_t> seed;      // by rank
  std::vector<uint32_t> area_end;  // by rank: the first rank of a larger area
};

Ranks RanksOf(std::span<const FaceSeed> seeds, const std::vector<double>& areas) {
  Ranks ranks;
  ranks.rank.resize(seeds.size());
  ranks.seed.resize(seeds.size());
  ranks.area_end.resize(seeds.size());
  std::iota(ranks.seed.begin(), ranks.seed.end(), 0);
  std::sort(ranks.seed.begin(), ranks.seed.end(), [&](uint32_t i, uint32_t j) {
    const auto key = [&](uint32_t s) {
      return std::tuple(areas[s], seeds[s].is_hole, seeds[s].region, seeds[s].max_area, s);
    };
    return key(i) < key(j);
  });
  for (auto r = static_cast<uint32_t>(seeds.size()); r-- > 0;) {
    ranks.rank[ranks.seed[r]] = r;
    const bool is_last = r + 1 == seeds.size() || areas[ranks.seed[r]] != areas[ranks.seed[r + 1]];
    ranks.area_end[r] = is_last ? r + 1 : ranks.area_end[r + 1];
  }
  return ranks;
}

}  // namespace

absl::StatusOr<std::vector<uint32_t>> PolygonsOfSegments(const Features& features, const RunContext& context) {
  std::vector<uint32_t> polygons;
  uint32_t steps = 0;
  for (uint32_t i = 0; i < features.seeds.size(); ++i) {
    const FaceSeed& seed = features.seeds[i];
    if (!seed.IsPolygon()) {
      continue;
    }
    const uint64_t end = uint64_t{seed.first_segment} + seed.segment_count;
    if (end > features.segment_count()) {
      return absl::InvalidArgumentError(absl::StrCat("seeds[", i, "]: its polygon has segments ", seed.first_segment,
                                                     " to ", end - 1, ", and there are ", features.segment_count(),
                                                     " segments; expected numbers of segments, which count from 0"));
    }
    polygons.resize(features.segment_count(), kOfNoPolygon);
    for (uint64_t s = seed.first_segment; s < end; ++s) {
      if (polygons[s] != kOfNoPolygon) {
        return absl::InvalidArgumentError(absl::StrCat("seeds[", i, "]: segments[", s, "] is of the polygon of seeds[",
                                                       polygons[s],
                                                       "], too; a segment bounds one polygon, so give it twice"));
      }
      polygons[s] = i;
      if (++steps % kStepsBetweenLooks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
    }
  }
  return polygons;
}

absl::Status CheckPolygonsClosed(std::span<const uint32_t> point_of_input, const Features& features,
                                 const RunContext& context) {
  std::vector<uint32_t> segments;
  for (uint32_t i = 0; i < features.seeds.size(); ++i) {
    segments.resize(features.seeds[i].segment_count);
    std::iota(segments.begin(), segments.end(), features.seeds[i].first_segment);
    const auto whose = [i] { return absl::StrCat("seeds[", i, "]: its polygon is"); };
    WELLSPACE_RETURN_IF_ERROR(CheckClosed(segments, point_of_input, features, whose, context));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<uint32_t>> FindPolygonsOfFaces(const PlanarGraph& graph, const PlanarFaces& faces,
                                                          std::span<const FaceSeed> seeds, const RunContext& context) {
  std::vector<uint32_t> found(faces.faces.size(), kOfNoPolygon);
  if (std::none_of(seeds.begin(), seeds.end(), [](const FaceSeed& seed) { return seed.IsPolygon(); })) {
    return found;
  }
  const FaceWalk walk(graph, faces, context);
  const auto of_segment = [](const GraphSegment& segment) { return segment.polygons; };
  std::set<uint32_t> inside;  // the polygons around the face
  std::vector<Side> sides;
  bool have_areas_a_say = false;
  const auto toggle_in = [](std::set<uint32_t>& set, uint32_t one) {
    if (set.erase(one) == 0) {
      set.insert(one);
    }
  };
  WELLSPACE_RETURN_IF_ERROR(walk.Run(
      graph.polygons, of_segment, [&](uint32_t polygon) { toggle_in(inside, polygon); },
      [&](uint32_t face, std::span<const HalfEdge> half_edges) {
        have_areas_a_say = have_areas_a_say || inside.size() > 1;
        if (!inside.empty()) {
          found[face] = *inside.begin();
        }
        for (const HalfEdge h : half_edges) {
          for (const uint32_t p : graph.polygons.MembersOf(graph.segments[SegmentOf(h)].polygons)) {
            if (inside.contains(p)) {
              sides.push_back({p, h});
            }
          }
        }
        return absl::OkStatus();
      }));
  if (!have_areas_a_say) {
    return found;
  }
  const Ranks ranks = RanksOf(seeds, AreasOf(graph, sides, seeds.size()));
  std::set<uint32_t> around;  // the same, by rank
  WELLSPACE_RETURN_IF_ERROR(walk.Run(
      graph.polygons, of_segment, [&](uint32_t polygon) { toggle_in(around, ranks.rank[polygon]); },
      [&](uint32_t face, std::span<const HalfEdge> half_edges) -> absl::Status {
        if (around.empty()) {
          return absl::OkStatus();
        }
        const uint32_t least = found[face] = ranks.seed[*around.begin()];
        const uint32_t last = ranks.seed[*std::prev(around.lower_bound(ranks.area_end[*around.begin()]))];
        if (seeds[least].SaysTheSameAs(seeds[last])) {
          return absl::OkStatus();
        }
        const GraphSegment& beside = graph.segments[SegmentOf(half_edges[0])];
        return absl::InvalidArgumentError(
            absl::StrCat("seeds[", std::min(least, last), "] and seeds[", std::max(least, last),
                         "]: their polygons have one area, lie over each other at ", PlaceText(graph.points[beside.a]),
                         ", and differ; leave one out"));
      }));
  return found;
}

}  // namespace wellspace::core
