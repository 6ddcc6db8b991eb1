#include "core/simplex/solid_boundary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/features/boxed_surface.h"
#include "core/features/solids.h"
#include "core/geometry/box.h"
#include "core/geometry/box_tree.h"
#include "core/geometry/triangle.h"
#include "core/simplex/part_numbers.h"
#include "core/simplex/solid_labels.h"

namespace wellspace::core {
namespace {

// Rows that one thread looks at before the next look at the context; of facets, which take longer, there are fewer.
constexpr size_t kRowsTogether = size_t{1} << 14;
constexpr size_t kFacetsTogether = size_t{1} << 8;

// A vertex that is no farther from a triangle than this share of the coordinates is on it: it is rounded.
constexpr double kOnTriangle = 0x1p-40;

// The solid where there is no tetrahedron: beside a mesh of the meshed part alone.
constexpr uint32_t kNoSolid = std::numeric_limits<uint32_t>::max();

size_t BlocksOf(size_t rows, size_t together) { return (rows + together - 1) / together; }

// A facet as it is found: 4 s + k is that of tetrahedron s across from its corner k.
struct FoundFacet {
  uint64_t at = 0;
  uint32_t solid = 0;  // of tetrahedron s
  uint32_t other = 0;  // on the other side
  int32_t marker = 0;
};

std::array<uint32_t, 3> CornersOf(std::span<const uint32_t> simplices, uint64_t at) {
  // In the order in which the corner across from them, put before them, leaves the orientation as it is.
  constexpr std::array<std::array<uint32_t, 3>, 4> kCorners = {{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
  const std::array<uint32_t, 3>& corners = kCorners[at % 4];
  const uint64_t first = at - at % 4;
  return {simplices[first + corners[0]], simplices[first + corners[1]], simplices[first + corners[2]]};
}

// The facets that bound solids, in the order of their tetrahedra.
class FacetFinder {
 public:
  FacetFinder(const SolidMesh& mesh, const SurfaceIndex& index) : mesh_(mesh), index_(index) {}

  absl::StatusOr<std::vector<FoundFacet>> Find(ThreadTeam& team, const RunContext& context) {
    WELLSPACE_RETURN_IF_ERROR(SortByLowestVertex(context));
    WELLSPACE_RETURN_IF_ERROR(FindMembranes(context));
    const size_t vertices = first_.size() - 1;
    std::vector<std::vector<FoundFacet>> found(BlocksOf(vertices, kRowsTogether));
    const auto match = [&](size_t block) -> absl::Status {
      std::vector<SurfaceCrossing> crossings;
      const size_t end = std::min(vertices, (block + 1) * kRowsTogether);
      for (size_t v = block * kRowsTogether; v < end; ++v) {
        if (v % kFacetsTogether == 0) {
          WELLSPACE_RETURN_IF_ERROR(context.Check());
        }
        Match(v, crossings, found[block]);
      }
      return absl::OkStatus();
    };
    WELLSPACE_RETURN_IF_ERROR(team.TryForEach(found.size(), match));
    std::vector<FoundFacet> all;
    for (const std::vector<FoundFacet>& of_block : found) {
      all.insert(all.end(), of_block.begin(), of_block.end());
    }
    const auto by_place = [](const FoundFacet& a, const FoundFacet& b) { return a.at < b.at; };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(all, by_place, context));
    return all;
  }

 private:
  bool IsMeshed(uint32_t solid) const { return mesh_.region_of[solid] != 0; }
  uint32_t SolidOf(uint64_t at) const { return mesh_.solid_of[at / 4]; }

  absl::Status SortByLowestVertex(const RunContext& context) {
    first_.assign(mesh_.points.size() / 3 + 1, 0);
    const uint64_t facets = mesh_.simplices.size();
    const auto lowest_of = [&](uint64_t at) {
      const std::array<uint32_t, 3> corners = CornersOf(mesh_.simplices, at);
      return *std::min_element(corners.begin(), corners.end());
    };
    for (uint64_t at = 0; at < facets; ++at) {
      if (at % kStepsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      ++first_[lowest_of(at)];
    }
    // Each place is taken from its end down, and so is where its facets begin at last.
    uint64_t before = 0;
    for (uint64_t& count : first_) {
      before += count;
      count = before;
    }
    facets_.resize(facets);
    for (uint64_t at = facets; at > 0; --at) {
      if (at % kStepsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      facets_[--first_[lowest_of(at - 1)]] = at - 1;
    }
    return absl::OkStatus();
  }

  absl::Status FindMembranes(const RunContext& context) {
    const Solids& solids = index_.solids();
    has_membranes_.assign(solids.count, false);
    for (size_t half = 0; half < solids.solid_of.size() && solids.membranes > 0; half += 2) {
      if (half % kStepsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      if (solids.solid_of[half] == solids.solid_of[half + 1]) {
        has_membranes_[solids.solid_of[half]] = true;
      }
    }
    return absl::OkStatus();
  }

  // Finds facets of which vertex v is the lowest.
  void Match(size_t v, std::vector<SurfaceCrossing>& crossings, std::vector<FoundFacet>& found) {
    const auto key_of = [&](uint64_t at) {
      const std::array<uint32_t, 3> corners = CornersOf(mesh_.simplices, at);
      const auto [low, high] = std::minmax({corners[0], corners[1], corners[2]});
      return std::pair(corners[0] ^ corners[1] ^ corners[2] ^ low ^ high, high);
    };
    const auto begin = facets_.begin() + static_cast<std::ptrdiff_t>(first_[v]);
    const auto end = facets_.begin() + static_cast<std::ptrdiff_t>(first_[v + 1]);
    std::sort(begin, end, [&](uint64_t a, uint64_t b) { return std::pair(key_of(a), a) < std::pair(key_of(b), b); });
    for (auto at = begin; at != end; ++at) {
      if (at + 1 != end && key_of(*at) == key_of(*(at + 1))) {
        Add(*at, *(at + 1), crossings, found);
        ++at;
      } else if (const uint32_t solid = SolidOf(*at); IsMeshed(solid)) {
        found.push_back({.at = *at, .solid = solid, .other = kNoSolid});
      }
    }
  }

  // A facet with a tetrahedron on both sides.
  void Add(uint64_t one, uint64_t other, std::vector<SurfaceCrossing>& crossings, std::vector<FoundFacet>& found) {
    const auto rank_of = [&](uint64_t at) {
      const uint32_t solid = SolidOf(at);
      return std::tuple(!IsMeshed(solid), mesh_.region_of[solid], solid, at);
    };
    if (rank_of(other) < rank_of(one)) {
      std::swap(one, other);
    }
    const uint32_t solid = SolidOf(one);
    if (IsMeshed(solid) && (SolidOf(other) != solid || IsOnMembrane(one, other, crossings))) {
      found.push_back({.at = one, .solid = solid, .other = SolidOf(other)});
    }
  }

  bool IsOnMembrane(uint64_t one, uint64_t other, std::vector<SurfaceCrossing>& crossings) const {
    if (!has_membranes_[SolidOf(one)]) {
      return false;
    }
    const auto point_of = [&](uint64_t at) {
      Simplex<3> corners;
      for (size_t k = 0; k < 4; ++k) {
        corners[k] = PointAt<3>(mesh_.points, mesh_.simplices[at - at % 4 + k]);
      }
      return LabelledPoint(corners);
    };
    index_.FindCrossings(point_of(one), point_of(other), crossings);
    const std::vector<uint32_t>& solid_of = index_.solids().solid_of;
    const auto membranes = std::count_if(crossings.begin(), crossings.end(), [&](const SurfaceCrossing& crossing) {
      return solid_of[HalfFacetOf(crossing.triangle, false)] == solid_of[HalfFacetOf(crossing.triangle, true)];
    });
    return membranes % 2 != 0;
  }

  const SolidMesh& mesh_;
  const SurfaceIndex& index_;
  HugeVector<uint64_t> first_;   // by vertex, and one more: where the facets of which it is the lowest begin
  HugeVector<uint64_t> facets_;  // in that order
  std::vector<bool> has_membranes_;
};

// The markers between pairs of solids, and the choice of one of them for a facet.
class MarkerFinder {
 public:
  MarkerFinder(const SolidMesh& mesh, const SurfaceIndex& index) : mesh_(mesh), index_(index) {}

  absl::Status Collect(const RunContext& context) {
    const SurfaceComplex& complex = index_.complex();
    for (uint32_t t = 0; t < complex.triangles.size(); ++t) {
      if (t % kRowsTogether == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      const auto [low, high] = SidesOf(t);
      if (mesh_.region_of[low] != 0 || mesh_.region_of[high] != 0) {
        markers_.insert(complex.markers[t]);
        Note({low, high}, complex.markers[t]);
      }
    }
    return absl::OkStatus();
  }

  // The markers of all triangles around the meshed part.
  const std::set<int64_t>& markers() const { return markers_; }

  // The marker of a facet between two solids.
  int32_t MarkerOf(const FoundFacet& facet, std::vector<uint32_t>& near) const {
    const auto known = between_.find(std::minmax(facet.solid, facet.other));
    if (known != between_.end()) {
      return known->second.is_only_one ? known->second.marker : NearestMarker(facet, known->first, near);
    }
    return NearestMarker(facet, {kNoSolid, kNoSolid}, near);
  }

 private:
  using Pair = std::pair<uint32_t, uint32_t>;

  struct Between {
    int32_t marker = 0;
    bool is_only_one = true;
  };

  // The place of a facet, and its tolerance.
  struct Place {
    std::array<Point<3>, 3> corners;
    Point<3> middle{};
    double on_triangle = 0;  // how far a vertex is from a triangle that it is on, at most
  };

  Pair SidesOf(uint32_t triangle) const {
    const std::vector<uint32_t>& solid_of = index_.solids().solid_of;
    return std::minmax(solid_of[HalfFacetOf(triangle, false)], solid_of[HalfFacetOf(triangle, true)]);
  }

  void Note(const Pair& pair, int32_t marker) {
    const auto [known, is_new] = between_.try_emplace(pair, Between{.marker = marker});
    known->second.is_only_one = known->second.is_only_one && known->second.marker == marker;
  }

  Place PlaceOf(const FoundFacet& facet) const {
    Place place;
    const std::array<uint32_t, 3> vertices = CornersOf(mesh_.simplices, facet.at);
    double size = 0;
    for (size_t k = 0; k < 3; ++k) {
      place.corners[k] = PointAt<3>(mesh_.points, vertices[k]);
    }
    std::sort(place.corners.begin(), place.corners.end());
    for (const Point<3>& corner : place.corners) {
      for (int axis = 0; axis < 3; ++axis) {
        place.middle[axis] += corner[axis] / 3;
        size = std::max(size, std::abs(corner[axis]));
      }
    }
    place.on_triangle = kOnTriangle * size;
    return place;
  }

  // The markers of which triangles hold all three vertices, ascending.
  std::vector<int32_t> MarkersOn(const Place& place, const std::vector<uint32_t>& near) const {
    constexpr uint32_t kAll = 0b111;
    std::map<int32_t, uint32_t> held;  // by marker: a bit for each vertex
    for (const uint32_t t : near) {
      uint32_t& bits = held[index_.complex().markers[t]];
      for (size_t k = 0; k < 3 && bits != kAll; ++k) {
        const Point<3>& corner = place.corners[k];
        const bool is_on =
            DistanceSq<3>(corner, NearestPoint(index_.InOrderAt(t), corner)) <= place.on_triangle * place.on_triangle;
        bits |= is_on ? 1u << k : 0;
      }
    }
    std::vector<int32_t> markers;
    for (const auto& [marker, bits] : held) {
      if (bits == kAll) {
        markers.push_back(marker);
      }
    }
    return markers;
  }

  // `pair`: the sides that a triangle has to have; if they are no solids, it has to have one of those of the facet.
  int32_t NearestMarker(const FoundFacet& facet, const Pair& pair, std::vector<uint32_t>& near) const {
    const Place place = PlaceOf(facet);
    const Box<3> own = BoxOfTriangle(place.corners);
    const auto is_wanted = [&](uint32_t t) {
      const Pair sides = SidesOf(t);
      return pair.first == kNoSolid ? sides.first == facet.solid || sides.second == facet.solid ||
                                          sides.first == facet.other || sides.second == facet.other
                                    : sides == pair;
    };
    double reach = std::max(place.on_triangle, std::numeric_limits<double>::min());
    while (true) {
      index_.FindNear(Widened<3>(own, reach), near);
      std::erase_if(near, [&](uint32_t t) { return !is_wanted(t); });
      if (near.empty()) {
        reach = 2 * std::max(reach, own.LongestSide());
        continue;
      }
      const auto [marker, distance] = Best(place, near);
      if (distance <= reach) {
        return marker;
      }
      reach = distance;
    }
  }

  // The best marker of those near by, and how far from the middle of the facet the next triangle is that has it; 0 if
  // nothing farther away can have a better one.
  std::pair<int32_t, double> Best(const Place& place, const std::vector<uint32_t>& near) const {
    const std::vector<int32_t>& marker_of = index_.complex().markers;
    const std::vector<int32_t> on = MarkersOn(place, near);
    if (on.size() == 1) {
      return {on[0], 0};
    }
    double least = std::numeric_limits<double>::infinity();
    int32_t marker = 0;
    for (const uint32_t t : near) {
      const double distance_sq = DistanceSq<3>(place.middle, NearestPoint(index_.InOrderAt(t), place.middle));
      if (distance_sq < least && (on.empty() || std::binary_search(on.begin(), on.end(), marker_of[t]))) {
        least = distance_sq;
        marker = marker_of[t];
      }
    }
    return {marker, std::sqrt(least)};
  }

  const SolidMesh& mesh_;
  const SurfaceIndex& index_;
  std::set<int64_t> markers_;
  std::map<Pair, Between> between_;  // the lower solid first
};

// The name of the part with a marker, which may be that of a side of the box.
std::string PartNameOf(int64_t marker) {
  return IsSideMarker(marker) ? FaceName(static_cast<int>(marker - kFirstSideMarker)) : MarkerName(marker);
}

// Writes the facets in the order of their parts.
absl::StatusOr<SolidBoundary> PartsOf(const std::vector<FoundFacet>& found, const std::set<int64_t>& markers,
                                      const SolidMesh& mesh, const RunContext& context) {
  SolidBoundary boundary;
  std::map<int32_t, int64_t> marker_of;  // by tag
  for (const auto& [marker, tag] : NumberAboveZero(markers)) {
    marker_of[tag] = marker;
  }
  std::map<int64_t, size_t> part_of;  // by marker
  for (const auto& [tag, marker] : marker_of) {
    part_of[marker] = boundary.parts.size();
    boundary.parts.push_back({tag, PartNameOf(marker), 0});
  }
  for (const FoundFacet& facet : found) {
    ++boundary.parts[part_of.at(facet.marker)].facets;
  }
  std::vector<uint64_t> next;  // by part
  uint64_t before = 0;
  for (const BoundaryPart& part : boundary.parts) {
    next.push_back(std::exchange(before, before + part.facets));
  }
  boundary.facets.resize(3 * found.size());
  boundary.vertex_tags.assign(mesh.points.size() / 3, kNoTag);
  for (size_t i = 0; i < found.size(); ++i) {
    if (i % kRowsTogether == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const size_t part = part_of.at(found[i].marker);
    const std::array<uint32_t, 3> corners = CornersOf(mesh.simplices, found[i].at);
    std::copy(corners.begin(), corners.end(), &boundary.facets[3 * next[part]++]);
    for (const uint32_t v : corners) {
      int32_t& tag = boundary.vertex_tags[v];
      tag = tag == kNoTag ? boundary.parts[part].tag : std::min(tag, boundary.parts[part].tag);
    }
  }
  return boundary;
}

}  // namespace

uint64_t SolidBoundaryBytes(uint64_t points, uint64_t simplices, uint64_t triangles) {
  // A number for each facet of a tetrahedron, where those of a vertex begin, and its tag. Of pairs of solids there are
  // no more than triangles.
  constexpr uint64_t kPair = 96;
  return simplices * 4 * sizeof(uint64_t) + points * (sizeof(uint64_t) + sizeof(int32_t)) + triangles * kPair;
}

absl::StatusOr<SolidBoundary> FindSolidBoundary(const SolidMesh& mesh, const SurfaceIndex& index, int threads,
                                                const RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(
      index.MemoryBytes() + mesh.points.size_bytes() + mesh.simplices.size_bytes() + mesh.solid_of.size_bytes() +
      SolidBoundaryBytes(mesh.points.size() / 3, mesh.simplices.size() / 4, index.complex().triangles.size())));
  ThreadTeam team(threads);
  WELLSPACE_ASSIGN_OR_RETURN(std::vector<FoundFacet> found, FacetFinder(mesh, index).Find(team, context));
  MarkerFinder markers(mesh, index);
  WELLSPACE_RETURN_IF_ERROR(markers.Collect(context));
  const auto mark = [&](size_t block) -> absl::Status {
    std::vector<uint32_t> near;
    const size_t end = std::min(found.size(), (block + 1) * kFacetsTogether);
    for (size_t i = block * kFacetsTogether; i < end; ++i) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
      found[i].marker = markers.MarkerOf(found[i], near);
    }
    return absl::OkStatus();
  };
  WELLSPACE_RETURN_IF_ERROR(team.TryForEach(BlocksOf(found.size(), kFacetsTogether), mark));
  return PartsOf(found, markers.markers(), mesh, context);
}

}  // namespace wellspace::core
