#include "core/simplex/listed_domain_simplices.h"

#include <algorithm>
#include <array>
#include <deque>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "core/base/memory/cache_lines.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/geometry/exact_measure.h"
#include "core/simplex/domain_row.h"
#include "core/simplex/listed_stars.h"
#include "core/simplex/simplex_list.h"
#include "core/tree/leaf_blocks.h"

namespace wellspace::core {
namespace {

constexpr HalfEdge kNoHalfEdge = std::numeric_limits<HalfEdge>::max();

// Edges by their ends, and which of them are subsegments.
//
// Thread safety: thread-compatible; const functions may run at once.
class Subsegments {
 public:
  // All arguments must outlive it; `place`: as PlacesIn.
  Subsegments(const PlanarDomain& domain, const PlanarDomain::Chains& chains, std::span<const uint32_t> place)
      : domain_(domain), chains_(chains), place_(place) {}

  // The half-edge that leads from `u` to `w` along a subsegment; kNoHalfEdge if they are not its ends.
  HalfEdge Along(VertexId u, VertexId w) const {
    if (place_[Index(u)] != 0) {
      return FromInner(u, w);
    }
    if (place_[Index(w)] != 0) {
      const HalfEdge h = FromInner(w, u);
      return h == kNoHalfEdge ? h : HalfEdgeOf(SegmentOf(h), !IsFromB(h));
    }
    if (domain_.IsGraphPoint(u) && domain_.IsGraphPoint(w)) {
      for (const HalfEdge h : domain_.WaysFrom(u)) {
        if (domain_.EndVertex(SegmentOf(h), !IsFromB(h)) == w && chains_.Of(SegmentOf(h)).size() == 2) {
          return h;
        }
      }
    }
    return kNoHalfEdge;
  }

  // The next vertex from `v` on the way `h`, which leads from it.
  VertexId Next(VertexId v, HalfEdge h) const {
    const std::span<const VertexId> chain = chains_.Of(SegmentOf(h));
    const size_t at = domain_.IsGraphPoint(v) ? (IsFromB(h) ? chain.size() - 1 : 0) : place_[Index(v)];
    return chain[IsFromB(h) ? at - 1 : at + 1];
  }

 private:
  // The half-edge from `u`, which is between the ends of a segment, to `w`.
  HalfEdge FromInner(VertexId u, VertexId w) const {
    const uint32_t segment = domain_.PlaceOf(u).segment;
    const VertexId* const at = chains_.Of(segment).data() + place_[Index(u)];
    return at[1] == w ? HalfEdgeOf(segment, false) : at[-1] == w ? HalfEdgeOf(segment, true) : kNoHalfEdge;
  }

  const PlanarDomain& domain_;
  const PlanarDomain::Chains& chains_;
  const std::span<const uint32_t> place_;
};

// A sum over edges with a direction, in which an edge and the same the other way cancel each other.
class BoundarySum {
 public:
  void Add(VertexId from, VertexId to) {
    const uint64_t low = std::min(Index(from), Index(to));
    uint64_t word = (low << 32 | std::max(Index(from), Index(to))) * 0x9e3779b97f4a7c15;
    word = (word ^ word >> 32) * 0xd6e8feb86659fd93;
    word ^= word >> 29;
    sum_ += Index(from) == low ? word : -word;
  }
  void Add(const BoundarySum& other) { sum_ += other.sum_; }

  bool operator==(const BoundarySum&) const = default;

 private:
  uint64_t sum_ = 0;
};

// The evidence that triangles are those of the domain: the edges that are theirs on one side alone, and how many of
// their edges are subsegments.
struct Outline {
  BoundarySum boundary;
  uint64_t subsegments = 0;

  void Add(const Outline& other) {
    boundary.Add(other.boundary);
    subsegments += other.subsegments;
  }

  bool operator==(const Outline&) const = default;
};

// The outline of the faces that are meshed.
Outline OutlineOf(const PlanarDomain& domain, const PlanarDomain::Chains& chains) {
  Outline outline;
  for (uint32_t s = 0; s < domain.segment_count(); ++s) {
    const bool is_left = domain.faces().IsMeshed(domain.faces().left_face[HalfEdgeOf(s, false)]);
    const bool is_right = domain.faces().IsMeshed(domain.faces().left_face[HalfEdgeOf(s, true)]);
    const std::span<const VertexId> chain = chains.Of(s);
    outline.subsegments += (chain.size() - 1) * ((is_left ? 1 : 0) + (is_right ? 1 : 0));
    for (size_t i = 0; i + 1 < chain.size() && is_left != is_right; ++i) {
      outline.boundary.Add(chain[is_left ? i : i + 1], chain[is_left ? i + 1 : i]);
    }
  }
  return outline;
}

// The triangles that are listed at one vertex after the other, with their faces. An edge on a subsegment tells the face
// of its triangle, and so does a corner inside a face; else exact signs say between which ways of the vertex it lies.
//
// Thread safety: thread-compatible.
class ListedDomainStars {
 public:
  // All arguments must outlive it.
  ListedDomainStars(const QueryStructure<2>& structure, const PlanarDomain& domain, const Subsegments& subsegments,
                    const StarLists<2>& stars, const StaleStars& stale)
      : structure_(structure), domain_(domain), subsegments_(subsegments), stars_(structure, stars, stale) {}

  // Calls take(corners, face) for the triangles in faces that are meshed; corners are counterclockwise.
  template <typename Take>
  void ForEach(VertexId v, Take take) {
    for (const auto& [a, b] : stars_.Find(v)) {
      const std::array<VertexId, 3> corners = {v, a, b};
      uint32_t along = 0;  // edges that are subsegments
      const uint32_t face = FaceOf(corners, along);
      if (!domain_.faces().IsMeshed(face)) {
        continue;
      }
      outline_.subsegments += along;
      for (int k = 0; k < 3; ++k) {
        outline_.boundary.Add(corners[k], corners[(k + 1) % 3]);
      }
      take(corners, face);
    }
  }

  // The outline of all triangles.
  const Outline& outline() const { return outline_; }
  const QueryCounters& counters() const { return stars_.counters(); }

 private:
  static constexpr uint32_t kUnknown = std::numeric_limits<uint32_t>::max();

  uint32_t FaceOf(const std::array<VertexId, 3>& corners, uint32_t& along) const {
    std::array<bool, 3> is_in_face;
    uint32_t face = kUnknown;
    for (int k = 0; k < 3; ++k) {
      is_in_face[k] = domain_.IsInFace(corners[k]);
      face = is_in_face[k] ? domain_.FaceOf(corners[k]) : face;
    }
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      if (is_in_face[k] || is_in_face[next]) {
        continue;
      }
      if (const HalfEdge h = subsegments_.Along(corners[k], corners[next]); h != kNoHalfEdge) {
        face = domain_.faces().left_face[h];
        ++along;
      }
    }
    return face != kUnknown ? face : FaceToward(corners[0], corners[1]);
  }

  // The face around `v`, which is on a segment, that the edge to `u` leads into.
  uint32_t FaceToward(VertexId v, VertexId u) const {
    const std::span<const HalfEdge> ways = domain_.WaysFrom(v);
    const std::vector<uint32_t>& faces = domain_.faces().left_face;
    if (std::all_of(ways.begin(), ways.end(), [&](HalfEdge h) { return faces[h] == faces[ways[0]]; })) {
      return faces[ways[0]];
    }
    size_t sector = 0;
    const VertexId first = subsegments_.Next(v, ways[0]);
    for (size_t w = 1; w < ways.size() && !IsBefore(v, first, u, subsegments_.Next(v, ways[w])); ++w) {
      sector = w;
    }
    return faces[ways[sector]];
  }

  // Whether, counterclockwise around `v` from the direction of `first` on, that of `u` comes before that of `w`.
  bool IsBefore(VertexId v, VertexId first, VertexId u, VertexId w) const {
    const bool is_u_left = Turn(v, first, u) == Sign::kPositive;
    const bool is_w_left = Turn(v, first, w) == Sign::kPositive;
    return is_u_left != is_w_left ? is_u_left : Turn(v, u, w) == Sign::kPositive;
  }

  Sign Turn(VertexId v, VertexId u, VertexId w) const {
    return Orientation<2>({structure_.point(v), structure_.point(u), structure_.point(w)}).sign;
  }

  const QueryStructure<2>& structure_;
  const PlanarDomain& domain_;
  const Subsegments& subsegments_;
  ListedStars<2> stars_;
  Outline outline_;
};

// A triangle of the vertex that comes so far along the Z curve.
struct RankedRow {
  uint32_t rank = 0;
  DomainRow row;
};

struct alignas(kCacheLines) ListedOfThread {
  ListedOfThread(const QueryStructure<2>& structure, const PlanarDomain& domain, const Subsegments& subsegments,
                 const StarLists<2>& star_lists, const StaleStars& stale)
      : stars(structure, domain, subsegments, star_lists, stale) {}

  ListedDomainStars stars;
  HugeVector<RankedRow> rows;     // that it has found
  std::vector<DomainRow> sorted;  // scratch
  SimplexList<2> list;
};

// The vertices in the order of the Z curve, and which of them are in each block.
struct ZOrder {
  explicit ZOrder(const LeafBlocks<2>& blocks, uint32_t vertices) : rank(vertices), vertex(vertices) {
    uint32_t next = 0;
    for (size_t block = 0; block < blocks.count(); ++block) {
      first.push_back(next);
      blocks.ForEachLeafOf(block, [&](const LeafTree<2>::LeafVertices& inside, NodeId) {
        for (uint32_t i = 0; i < inside.count; ++i) {
          vertex[next] = inside.ids[i];
          rank[Index(inside.ids[i])] = next++;
        }
      });
    }
    first.push_back(next);
  }

  HugeVector<uint32_t> rank;    // by vertex
  HugeVector<VertexId> vertex;  // by rank
  std::vector<uint32_t> first;  // by block, and one more
};

// Triangles by the vertex of each that has the lowest output index: the triangles of the vertex of rank r are the
// numbers first[r] to first[r + 1]. Each has three words, in the place of which its indices can be put.
struct RowsByRank {
  // Takes the rows of the threads, in any order.
  RowsByRank(std::deque<ListedOfThread>& of_threads, uint32_t vertices) : first(size_t{vertices} + 2) {
    for (const ListedOfThread& own : of_threads) {
      for (const RankedRow& ranked : own.rows) {
        ++first[ranked.rank + 2];
      }
    }
    std::partial_sum(first.begin(), first.end(), first.begin());
    words.resize(3 * size_t{first.back()});
    for (ListedOfThread& own : of_threads) {
      for (const RankedRow& ranked : own.rows) {
        uint32_t* const at = words.data() + 3 * size_t{first[ranked.rank + 1]++};
        at[0] = Index(ranked.row.first);
        at[1] = Index(ranked.row.second);
        at[2] = ranked.row.face;
      }
      own.rows = {};
    }
  }

  // Copies those of the vertex of rank `r`, ascending: their order is not to depend on that of the looks.
  void SortedOf(uint32_t r, std::vector<DomainRow>& rows) const {
    rows.clear();
    for (size_t i = first[r]; i < first[r + 1]; ++i) {
      rows.push_back({VertexId{words[3 * i]}, VertexId{words[3 * i + 1]}, words[3 * i + 2]});
    }
    std::sort(rows.begin(), rows.end());
  }

  HugeVector<uint32_t> first;
  HugeVector<uint32_t> words;
};

// Gives the threads the triangles that are listed.
void FindListed(const ZOrder& order, std::span<const uint32_t> output_index, ThreadTeam& team,
                std::deque<ListedOfThread>& of_threads, const RunContext& context) {
  for (ListedOfThread& own : of_threads) {
    own.rows.reserve(2 * order.vertex.size());  // unused room takes no memory
  }
  team.ForEach(order.first.size() - 1, [&](size_t block) {
    ListedOfThread& own = of_threads[ThreadTeam::CurrentThread()];
    for (uint32_t r = order.first[block]; r < order.first[block + 1] && !context.IsCancelled(); ++r) {
      own.stars.ForEach(order.vertex[r], [&](std::array<VertexId, 3> corners, uint32_t face) {
        const auto lowest = std::min_element(corners.begin(), corners.end(), [&](VertexId u, VertexId w) {
          return output_index[Index(u)] < output_index[Index(w)];
        });
        std::rotate(corners.begin(), lowest, corners.end());
        own.rows.push_back({order.rank[Index(corners[0])], {corners[1], corners[2], face}});
      });
    }
  });
}

// Puts the indices of the triangles in the place of their rows, and their faces into `faces`.
void PutInOrder(const QueryStructure<2>& structure, const ZOrder& order, std::span<const uint32_t> output_index,
                ThreadTeam& team, std::deque<ListedOfThread>& of_threads, RowsByRank& by_rank,
                HugeVector<uint32_t>& faces, RunContext& context) {
  faces.resize(by_rank.words.size() / 3);
  team.ForEach(order.first.size() - 1, [&](size_t block) {
    auto& [stars, found, sorted, list] = of_threads[ThreadTeam::CurrentThread()];
    list.Clear();
    const uint32_t begin = by_rank.first[order.first[block]];
    for (uint32_t r = order.first[block]; r < order.first[block + 1] && !context.IsCancelled(); ++r) {
      const VertexId v = order.vertex[r];
      by_rank.SortedOf(r, sorted);
      for (const DomainRow& row : sorted) {
        list.Add({structure.point(v), structure.point(row.first), structure.point(row.second)},
                 {output_index[Index(v)], output_index[Index(row.first)], output_index[Index(row.second)]});
        faces[by_rank.first[r] + (&row - sorted.data())] = row.face;
      }
    }
    std::copy(list.indices().begin(), list.indices().end(), by_rank.words.begin() + 3 * size_t{begin});
    context.AddSimplices(list.size());
  });
}

}  // namespace

absl::StatusOr<std::optional<DomainSimplices>> ListedDomainSimplices(
    const QueryStructure<2>& structure, const PlanarDomain& domain, const PlanarDomain::Chains& chains,
    const StarLists<2>& star_lists, absl::FunctionRef<void()> drop_stars, std::span<const uint32_t> output_index,
    int threads, RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(StaleStars stale, StaleStars::Of(star_lists, structure.vertex_count(), context));
  // Two triangles a vertex, as they are found and in their order, and four numbers a vertex.
  WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(
      structure.MemoryBytes() + domain.MemoryBytes() + star_lists.MemoryBytes() + stale.MemoryBytes() +
      output_index.size_bytes() +
      structure.vertex_count() * (2 * (sizeof(RankedRow) + sizeof(DomainRow)) + 4 * sizeof(uint32_t))));
  std::vector<uint32_t> place = PlacesIn(chains, domain.segment_count(), structure.vertex_count());
  const Subsegments subsegments(domain, chains, place);
  const LeafBlocks<2> leaf_blocks(structure.tree(), kVerticesInBlock);
  ZOrder order(leaf_blocks, structure.vertex_count());
  ThreadTeam team(threads);
  std::deque<ListedOfThread> of_threads;
  for (int i = 0; i < team.threads(); ++i) {
    of_threads.emplace_back(structure, domain, subsegments, star_lists, stale);
  }
  FindListed(order, output_index, team, of_threads, context);
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  DomainSimplices all;
  Outline outline;
  for (const ListedOfThread& own : of_threads) {
    outline.Add(own.stars.outline());
    all.simplices.counters.Add(own.stars.counters());
  }
  if (!(outline == OutlineOf(domain, chains))) {
    return std::nullopt;
  }
  drop_stars();  // and other data that are not read again
  stale = {};
  place = {};
  RowsByRank by_rank(of_threads, structure.vertex_count());
  order.rank = {};
  PutInOrder(structure, order, output_index, team, of_threads, by_rank, all.faces, context);
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  all.simplices.indices = std::move(by_rank.words);
  all.simplices.min_angle_deg = std::numeric_limits<double>::infinity();
  for (const ListedOfThread& own : of_threads) {
    all.simplices.max_radius_edge = std::max(all.simplices.max_radius_edge, own.list.max_radius_edge());
    all.simplices.min_angle_deg = std::min(all.simplices.min_angle_deg, own.list.min_angle_deg());
  }
  return all;
}

}  // namespace wellspace::core
