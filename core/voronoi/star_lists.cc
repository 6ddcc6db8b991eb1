#include "core/voronoi/star_lists.h"

#include <algorithm>
#include <utility>

#include "core/base/cache_lines.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"

namespace wellspace::core {
namespace {

// Places are dropped, which takes a look at all vertices, once there are as many as one for so many of these.
constexpr size_t kLeastShare = 8;

// Whose lists one thread looks through at a time.
constexpr uint32_t kVerticesTogether = 1024;

// How many vertices before its turn what one lists is asked for.
constexpr uint32_t kAhead = 6;

// Fewer pairs may be held more than once.
constexpr size_t kLeastLate = 1 << 14;

void MakeUnique(std::vector<LateNeighbours::Late>& late) {
  std::sort(late.begin(), late.end());
  late.erase(std::unique(late.begin(), late.end()), late.end());
}

}  // namespace

template <int D>
void StarLists<D>::Set(VertexId v, std::span<const std::array<VertexId, D>> star, uint32_t vertex_count) {
  if (listed_.size() + star.size() >= kNone) {
    DropUnused();
    if (listed_.size() + star.size() >= kNone) {
      GiveUp();
    }
  }
  if (!is_complete_) {
    return;
  }
  const auto begin = static_cast<uint32_t>(listed_.size());
  if (entries_.empty()) {
    first_count_ = vertex_count;
  }
  entries_.resize(vertex_count);
  added_.resize(vertex_count - first_count_ + 1, begin);
  listed_.resize(begin + star.size());
  uint32_t count = 0;
  for (const std::array<VertexId, D>& simplex : star) {
    // No branch, since none could be foretold.
    listed_[begin + count] = simplex;
    uint32_t has_all = 1;
    for (const VertexId u : simplex) {
      has_all &= Has(u) ? 1 : 0;
    }
    count += has_all;
  }
  listed_.resize(begin + count);
  unused_ += std::exchange(entries_[Index(v)], {begin, count}).count;
  if (unused_ > listed_.size() / 2 && kLeastShare * unused_ > entries_.size()) {
    DropUnused();
  }
}

template <int D>
void StarLists<D>::GiveUp() {
  if (is_complete_) {
    Clear();
    is_complete_ = false;
  }
}

template <int D>
void StarLists<D>::DropUnused() {
  std::vector<Entry*> in_order;
  for (Entry& entry : entries_) {
    if (entry.begin != kNone) {
      in_order.push_back(&entry);
    }
  }
  std::sort(in_order.begin(), in_order.end(), [](const Entry* a, const Entry* b) {
    return std::pair(a->begin, a->count) < std::pair(b->begin, b->count);
  });
  HugeVector<std::array<VertexId, D>> listed;
  listed.reserve(listed_.size() - unused_);
  auto added = added_.begin();  // ascending
  for (Entry* const entry : in_order) {
    const auto size = static_cast<uint32_t>(listed.size());
    for (; added != added_.end() && *added <= entry->begin; ++added) {
      *added = size;
    }
    const auto from = listed_.begin() + entry->begin;
    entry->begin = size;
    listed.insert(listed.end(), from, from + entry->count);
  }
  std::fill(added, added_.end(), static_cast<uint32_t>(listed.size()));
  listed_ = std::move(listed);
  unused_ = 0;
}

template <int D>
absl::StatusOr<LateNeighbours> LateNeighbours::Of(const StarLists<D>& lists, uint32_t vertex_count, int threads,
                                                  const RunContext& context) {
  ThreadTeam team(threads);
  struct alignas(kCacheLines) Own {
    std::vector<Late> late;
    size_t most_late = kLeastLate;
  };
  std::vector<Own> of_threads(team.threads());
  team.ForEach((vertex_count + kVerticesTogether - 1) / kVerticesTogether, [&](size_t block) {
    auto& [late, most_late] = of_threads[ThreadTeam::CurrentThread()];
    const uint32_t begin = static_cast<uint32_t>(block) * kVerticesTogether;
    const uint32_t end = std::min(vertex_count, begin + kVerticesTogether);
    std::array<VertexId, D + 1> corners;
    for (uint32_t i = begin; i < end && !context.IsCancelled(); ++i) {
      corners[D] = VertexId{i};
      lists.Prefetch(VertexId{i + kAhead}, 1);
      for (const std::array<VertexId, D>& simplex : lists.Of(corners[D])) {
        std::copy(simplex.begin(), simplex.end(), corners.begin());
        if (!lists.SomeCameAfterOthers(corners)) {
          continue;
        }
        for (const VertexId v : corners) {
          for (const VertexId u : corners) {
            if (lists.CameAfter(u, v)) {
              late.emplace_back(v, u);
            }
          }
        }
      }
    }
    // Each pair comes with every simplex that has both.
    if (late.size() > most_late) {
      MakeUnique(late);
      most_late = std::max(kLeastLate, 2 * late.size());
    }
  });
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  LateNeighbours found;
  for (Own& own : of_threads) {
    found.late_.insert(found.late_.end(), own.late.begin(), own.late.end());
    own.late = {};
  }
  MakeUnique(found.late_);
  found.is_at_.resize(vertex_count);
  for (const Late& late : found.late_) {
    found.is_at_[Index(late.first)] = true;
  }
  return found;
}

std::span<const LateNeighbours::Late> LateNeighbours::At(VertexId v) const {
  if (!is_at_[Index(v)]) {
    return {};
  }
  const auto begin = std::lower_bound(late_.begin(), late_.end(), Late(v, VertexId{0}));
  const auto end = std::find_if(begin, late_.end(), [v](const Late& late) { return late.first != v; });
  return {begin, end};
}

#define WELLSPACE_INSTANTIATE(D) \
  template class StarLists<D>;   \
  template absl::StatusOr<LateNeighbours> LateNeighbours::Of<D>(const StarLists<D>&, uint32_t, int, const RunContext&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
