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
void MakeUnique(Pairs& late) {
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
  neighbours_.resize(std::max(neighbours_.size(), D * star.size() + 1));
  const uint32_t added_at = AddedAt(v);
  const Entry* const entries = entries_.data();
  std::array<VertexId, D>* const listed = listed_.data() + begin;
  VertexId* const late = neighbours_.data();
  size_t late_count = 0;
  uint32_t count = 0;
  for (const std::array<VertexId, D>& simplex : star) {
    // No branch, since none could be foretold.
    uint32_t last_look = 0;
    for (const VertexId u : simplex) {
      const uint32_t look = entries[Index(u)].begin;
      last_look = std::max(last_look, look);
      late[late_count] = u;
      late_count += added_at > look ? 1 : 0;
    }
    listed[count] = simplex;
    count += last_look != kNone ? 1 : 0;
  }
  listed_.resize(begin + count);
  if (late_count != 0) {
    NoteLate(v, std::span(neighbours_).first(late_count));
  }
  unused_ += std::exchange(entries_[Index(v)], {begin, count}).count;
  if (unused_ > listed_.size() / 2 && kLeastShare * unused_ > entries_.size()) {
    DropUnused();
  }
}

// Puts down that `v` is late at neighbours, of whom some are given more than once.
template <int D>
void StarLists<D>::NoteLate(VertexId v, std::span<const VertexId> neighbours) {
  const auto begin = static_cast<std::ptrdiff_t>(late_.size());
  for (const VertexId u : neighbours) {
    if (std::find(late_.begin() + begin, late_.end(), LatePair(u, v)) == late_.end()) {
      late_.emplace_back(u, v);
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
  std::erase_if(late_, [this](const LatePair& pair) { return !CameAfter(pair.second, pair.first); });
  MakeUnique(late_);
}

template <int D>
absl::StatusOr<LateNeighbours> LateNeighbours::Of(const StarLists<D>& lists, uint32_t vertex_count,
                                                  const RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  LateNeighbours found;
  std::vector<LatePair>& late = found.late_;
  // Who has been looked at again since then knows them.
  std::copy_if(lists.late().begin(), lists.late().end(), std::back_inserter(late),
               [&](const LatePair& pair) { return lists.CameAfter(pair.second, pair.first); });
  MakeUnique(late);
  found.is_at_.resize(vertex_count);
  for (const LatePair& pair : late) {
    found.is_at_[Index(pair.first)] = true;
  }
  return found;
}

std::span<const LatePair> LateNeighbours::At(VertexId v) const {
  if (!is_at_[Index(v)]) {
    return {};
  }
  const auto begin = std::lower_bound(late_.begin(), late_.end(), LatePair(v, VertexId{0}));
  const auto end = std::find_if(begin, late_.end(), [v](const LatePair& pair) { return pair.first != v; });
  return {begin, end};
}

#define WELLSPACE_INSTANTIATE(D) \
  template class StarLists<D>;   \
  template absl::StatusOr<LateNeighbours> LateNeighbours::Of<D>(const StarLists<D>&, uint32_t, const RunContext&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
