#include "core/voronoi/star_lists.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/base/dimensions.h"
#include "core/base/status_macros.h"

namespace wellspace::core {
namespace {

// Places are dropped, which takes a look at all vertices, once there are as many as one for so many of these.
constexpr size_t kLeastShare = 8;

template <typename Pairs>
void MakeUnique(Pairs& stale) {
  std::sort(stale.begin(), stale.end());
  stale.erase(std::unique(stale.begin(), stale.end()), stale.end());
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
  neighbours_.resize(std::max(neighbours_.size(), D * star.size() + 1));
  const uint32_t added_at = AddedAt(v);
  const Entry* const entries = entries_.data();
  std::array<VertexId, D>* const listed = listed_.data() + begin;
  VertexId* const stale = neighbours_.data();
  size_t stale_count = 0;
  uint32_t count = 0;
  for (const std::array<VertexId, D>& simplex : star) {
    // No branch, since it could not be predicted.
    uint32_t last_look = 0;
    for (const VertexId u : simplex) {
      const uint32_t look = entries[Index(u)].begin;
      last_look = std::max(last_look, look);
      stale[stale_count] = u;
      stale_count += added_at > look ? 1 : 0;
    }
    listed[count] = simplex;
    count += last_look != kNone ? 1 : 0;
  }
  listed_.resize(begin + count);
  if (stale_count != 0) {
    NoteStale(v, std::span(neighbours_).first(stale_count));
  }
  unused_ += std::exchange(entries_[Index(v)], {begin, count}).count;
  if (unused_ > listed_.size() / 2 && kLeastShare * unused_ > entries_.size()) {
    DropUnused();
  }
}

// Notes that the lists of neighbours are stale since `v` came; some neighbours are given more than once.
template <int D>
void StarLists<D>::NoteStale(VertexId v, std::span<const VertexId> neighbours) {
  const auto begin = static_cast<std::ptrdiff_t>(stale_.size());
  for (const VertexId u : neighbours) {
    if (std::find(stale_.begin() + begin, stale_.end(), StalePair(u, v)) == stale_.end()) {
      stale_.emplace_back(u, v);
    }
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
  std::erase_if(stale_, [this](const StalePair& pair) { return !CameAfter(pair.second, pair.first); });
  MakeUnique(stale_);
}

template <int D>
absl::StatusOr<StaleStars> StaleStars::Of(const StarLists<D>& lists, uint32_t vertex_count, const RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  StaleStars found;
  std::vector<StalePair>& stale = found.stale_;
  // A vertex that has been looked at again since then is stale no longer.
  std::copy_if(lists.stale().begin(), lists.stale().end(), std::back_inserter(stale),
               [&](const StalePair& pair) { return lists.CameAfter(pair.second, pair.first); });
  MakeUnique(stale);
  found.is_at_.resize(vertex_count);
  for (const StalePair& pair : stale) {
    found.is_at_[Index(pair.first)] = true;
  }
  return found;
}

std::span<const StalePair> StaleStars::At(VertexId v) const {
  if (!is_at_[Index(v)]) {
    return {};
  }
  const auto begin = std::lower_bound(stale_.begin(), stale_.end(), StalePair(v, VertexId{0}));
  const auto end = std::find_if(begin, stale_.end(), [v](const StalePair& pair) { return pair.first != v; });
  return {begin, end};
}

#define WELLSPACE_INSTANTIATE(D) \
  template class StarLists<D>;   \
  template absl::StatusOr<StaleStars> StaleStars::Of<D>(const StarLists<D>&, uint32_t, const RunContext&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
