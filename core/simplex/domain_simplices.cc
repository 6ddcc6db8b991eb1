#include "core/simplex/domain_simplices.h"

#include <algorithm>
#include <atomic>
#include <deque>
#include <limits>
#include <optional>
#include <utility>

#include "core/base/memory/cache_lines.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/simplex/domain_row.h"
#include "core/simplex/listed_domain_simplices.h"
#include "core/simplex/simplex_list.h"
#include "core/tree/leaf_blocks.h"

namespace wellspace::core {
namespace {

// The way from a vertex to its neighbour along a segment, and the face beside it.
struct Way {
  VertexId next = kNoVertex;  // the neighbour
  uint32_t face = 0;          // counterclockwise from there
  uint32_t subsegment = 0;    // by the place of its first vertex in the chains
};

// The triangles around one vertex after the other.
//
// Thread safety: thread-compatible.
class DomainStars {
 public:
  // All arguments must outlive it; `place`: of each vertex on a segment, in its chain.
  DomainStars(const QueryStructure<2>& structure, const PlanarDomain& domain, const PlanarDomain::Chains& chains,
              std::span<const uint32_t> place)
      : structure_(structure), domain_(domain), chains_(chains), place_(place) {}

  // Finds the triangles of `v`, and the subsegments at it that are no edges; false if there is no end to its cell.
  bool Find(VertexId v) {
    FindWays(v);
    const double most = 8 * structure_.box().LongestSide();
    for (double radius = structure_.tree().SideOf(structure_.tree().leaf_of(v));; radius *= 4) {
      structure_.UnplacedClippedVoronoi(v, CubeAround<2>(structure_.point(v), radius), workspace_);
      workspace_.cell.Place();
      if (WalkAround(v) || radius > most) {
        return radius <= most || !broken_.empty();
      }
    }
  }

  const std::vector<DomainRow>& rows() const { return rows_; }
  const std::vector<uint32_t>& broken() const { return broken_; }
  const QueryCounters& counters() const { return workspace_.counters; }

 private:
  void FindWays(VertexId v) {
    ways_.clear();
    for (const HalfEdge h : domain_.WaysFrom(v)) {
      const uint32_t segment = SegmentOf(h);
      const std::span<const VertexId> chain = chains_.Of(segment);
      size_t at = IsFromB(h) ? chain.size() - 1 : 0;
      if (!domain_.IsGraphPoint(v)) {
        at = place_[Index(v)];
      }
      const size_t next = IsFromB(h) ? at - 1 : at + 1;
      ways_.push_back({chain[next], domain_.faces().left_face[h],
                       chains_.first[segment] + static_cast<uint32_t>(std::min(at, next))});
    }
  }

  // Goes once around the cell of `v`; false if it is clipped where it counts.
  bool WalkAround(VertexId v) {
    rows_.clear();
    broken_.clear();
    const Polytope<2>& cell = workspace_.cell;
    const size_t count = cell.nodes().size();
    edges_.resize(count);
    for (size_t i = 0; i < count; ++i) {
      // The edge to the next node leaves one plane of this node, and runs along the other.
      const CellNode<2>& node = cell.nodes()[i];
      const size_t leaves = node.neighbours[0] == (i + 1) % count ? 0 : 1;
      const Plane<2>& plane = cell.plane(node.planes[1 - leaves]);
      edges_[i] = plane.kind == PlaneKind::kBisector ? plane.vertex : kNoVertex;
    }
    way_at_.assign(count, kNoWay);
    size_t first = 0;
    for (size_t w = 0; w < ways_.size(); ++w) {
      const auto at = static_cast<size_t>(std::find(edges_.begin(), edges_.end(), ways_[w].next) - edges_.begin());
      if (at == count) {
        broken_.push_back(ways_[w].subsegment);
        continue;
      }
      way_at_[at] = w;
      first = at;
    }
    if (!broken_.empty() && std::find(edges_.begin(), edges_.end(), kNoVertex) != edges_.end()) {
      return false;  // the missing part may be beyond the clip
    }
    uint32_t face = ways_.empty() ? domain_.FaceOf(v) : 0;
    bool is_whole = true;
    for (size_t k = 0; k < count; ++k) {
      const size_t before = (first + k) % count;
      const size_t after = (before + 1) % count;
      if (way_at_[before] != kNoWay) {
        face = ways_[way_at_[before]].face;
      }
      if (!domain_.faces().IsMeshed(face)) {
        continue;
      }
      if (edges_[before] == kNoVertex || edges_[after] == kNoVertex) {
        is_whole = false;
      } else {
        rows_.push_back({edges_[before], edges_[after], face});
      }
    }
    return is_whole;
  }

  static constexpr size_t kNoWay = std::numeric_limits<size_t>::max();

  const QueryStructure<2>& structure_;
  const PlanarDomain& domain_;
  const PlanarDomain::Chains& chains_;
  const std::span<const uint32_t> place_;
  Workspace<2> workspace_;
  std::vector<Way> ways_;
  std::vector<VertexId> edges_;  // by node: beyond the edge to the next
  std::vector<size_t> way_at_;   // by edge
  std::vector<DomainRow> rows_;
  std::vector<uint32_t> broken_;
};

// The triangles of one block of vertices.
struct Block {
  HugeVector<uint32_t> indices;
  std::vector<uint32_t> faces;
  std::vector<uint32_t> broken;
};

struct alignas(kCacheLines) OfThread {
  OfThread(const QueryStructure<2>& structure, const PlanarDomain& domain, const PlanarDomain::Chains& chains,
           std::span<const uint32_t> place)
      : stars(structure, domain, chains, place) {}

  DomainStars stars;
  SimplexList<2> list;
};

// Appends the triangles of `v` of which it has the lowest output index; false if there is no end to its cell.
bool AppendStar(const QueryStructure<2>& structure, VertexId v, std::span<const uint32_t> output_index, OfThread& own,
                Block& block) {
  const bool has_end = own.stars.Find(v);
  block.broken.insert(block.broken.end(), own.stars.broken().begin(), own.stars.broken().end());
  std::vector<DomainRow> rows = own.stars.rows();
  const uint32_t lowest = output_index[Index(v)];
  std::erase_if(rows, [&](const DomainRow& row) {
    return output_index[Index(row.first)] < lowest || output_index[Index(row.second)] < lowest;
  });
  std::sort(rows.begin(), rows.end());  // their order is not to depend on that of the cuts
  for (const DomainRow& row : rows) {
    own.list.Add({structure.point(v), structure.point(row.first), structure.point(row.second)},
                 {lowest, output_index[Index(row.first)], output_index[Index(row.second)]});
    block.faces.push_back(row.face);
  }
  return has_end;
}

// Joins the triangles of the blocks, unless a subsegment is broken.
DomainSimplices Join(std::span<const Block> blocks) {
  DomainSimplices all;
  size_t count = 0;
  for (const Block& block : blocks) {
    all.broken.insert(all.broken.end(), block.broken.begin(), block.broken.end());
    count += block.faces.size();
  }
  std::sort(all.broken.begin(), all.broken.end());
  all.broken.erase(std::unique(all.broken.begin(), all.broken.end()), all.broken.end());
  if (!all.broken.empty()) {
    return all;
  }
  all.simplices.indices.reserve(3 * count);
  all.faces.reserve(count);
  for (const Block& block : blocks) {
    all.simplices.indices.insert(all.simplices.indices.end(), block.indices.begin(), block.indices.end());
    all.faces.insert(all.faces.end(), block.faces.begin(), block.faces.end());
  }
  return all;
}

}  // namespace

// The place of each vertex on a segment in its chain; 0 of other vertices.
std::vector<uint32_t> PlacesIn(const PlanarDomain::Chains& chains, uint32_t segments, uint32_t vertices) {
  std::vector<uint32_t> place(vertices);
  for (uint32_t segment = 0; segment < segments; ++segment) {
    const std::span<const VertexId> chain = chains.Of(segment);
    for (uint32_t i = 1; i + 1 < chain.size(); ++i) {
      place[Index(chain[i])] = i;
    }
  }
  return place;
}

absl::StatusOr<DomainSimplices> ComputeDomainSimplices(const QueryStructure<2>& structure, const PlanarDomain& domain,
                                                       const PlanarDomain::Chains& chains,
                                                       const StarLists<2>& star_lists,
                                                       absl::FunctionRef<void()> drop_stars,
                                                       std::span<const uint32_t> output_index, int threads,
                                                       RunContext& context) {
  if (star_lists.IsComplete()) {
    WELLSPACE_ASSIGN_OR_RETURN(
        std::optional<DomainSimplices> listed,
        ListedDomainSimplices(structure, domain, chains, star_lists, drop_stars, output_index, threads, context));
    if (listed.has_value()) {
      return *std::move(listed);
    }
  }
  // The triangles of the blocks, and all of them joined: two triangles a vertex, twice.
  WELLSPACE_RETURN_IF_ERROR(
      context.AllowMemory(structure.MemoryBytes() + domain.MemoryBytes() + output_index.size_bytes() +
                          uint64_t{structure.vertex_count()} * (16 * sizeof(uint32_t) + sizeof(uint32_t))));
  const std::vector<uint32_t> place = PlacesIn(chains, domain.segment_count(), structure.vertex_count());
  ThreadTeam team(threads);
  std::deque<OfThread> of_threads;
  for (int i = 0; i < team.threads(); ++i) {
    of_threads.emplace_back(structure, domain, chains, place);
  }
  const LeafBlocks<2> leaf_blocks(structure.tree(), kVerticesInBlock);
  std::vector<Block> blocks(leaf_blocks.count());
  std::atomic<bool> is_endless{false};
  team.ForEach(blocks.size(), [&](size_t number) {
    OfThread& own = of_threads[ThreadTeam::CurrentThread()];
    Block& block = blocks[number];
    own.list.Clear();
    leaf_blocks.ForEachLeafOf(number, [&](const LeafTree<2>::LeafVertices& inside, NodeId) {
      for (uint32_t i = 0; i < inside.count && !context.IsCancelled(); ++i) {
        is_endless = !AppendStar(structure, inside.ids[i], output_index, own, block) || is_endless;
      }
    });
    block.indices = own.list.indices();
    context.AddSimplices(block.faces.size());
  });
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  DomainSimplices all = Join(blocks);
  if (all.broken.empty() && is_endless) {
    return absl::InternalError("the cell of a vertex does not end inside the domain");
  }
  all.simplices.min_angle_deg = std::numeric_limits<double>::infinity();
  for (const OfThread& own : of_threads) {
    all.simplices.max_radius_edge = std::max(all.simplices.max_radius_edge, own.list.max_radius_edge());
    all.simplices.min_angle_deg = std::min(all.simplices.min_angle_deg, own.list.min_angle_deg());
    all.simplices.counters.Add(own.stars.counters());
  }
  return all;
}

}  // namespace wellspace::core
