#include "core/voronoi/neighbour_lists.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/base/status_macros.h"

namespace wellspace::core {
namespace {

// In 6-D a vertex has a hundred entries, each somewhere else in memory.
constexpr uint32_t kVerticesBetweenChecks = 4096;

}  // namespace

void NeighbourLists::Set(VertexId v, std::span<const VertexId> neighbours) {
  if (ids_.size() + 1 + neighbours.size() >= kNone) {
    DropUnused();
    is_full_ = is_full_ || ids_.size() + 1 + neighbours.size() >= kNone;
  }
  if (is_full_) {
    return;
  }
  const size_t end = ids_.size();
  if (Index(v) >= begin_.size()) {
    begin_.resize(size_t{Index(v)} + 1, kNone);
  }
  ids_.resize(end + 1 + neighbours.size());
  size_t count = 0;
  for (const VertexId u : neighbours) {
    ids_[end + 1 + count] = u;
    count += Has(u) ? 1 : 0;
  }
  ids_[end] = VertexId{static_cast<uint32_t>(count)};
  ids_.resize(end + 1 + count);
  uint32_t& begin = begin_[Index(v)];
  if (begin == kNone) {
    begin = static_cast<uint32_t>(end);
    return;
  }
  const size_t before = Of(v).size();
  if (count <= before) {
    unused_ += before - count;
    std::copy_n(ids_.begin() + static_cast<std::ptrdiff_t>(end), 1 + count, ids_.begin() + begin);
    ids_.resize(end);
  } else {
    unused_ += before + 1;
    begin = static_cast<uint32_t>(end);
  }
  if (unused_ > ids_.size() / 2) {
    DropUnused();
  }
}

void NeighbourLists::DropUnused() {
  std::vector<VertexId> ids;
  ids.reserve(ids_.size() - unused_);
  for (uint32_t& begin : begin_) {
    if (begin != kNone) {
      const auto from = ids_.begin() + begin;
      begin = static_cast<uint32_t>(ids.size());
      ids.insert(ids.end(), from, from + 1 + Index(*from));
    }
  }
  ids_ = std::move(ids);
  unused_ = 0;
}

void NeighbourLists::Clear() {
  begin_.clear();
  ids_.clear();
  unused_ = 0;
  is_full_ = false;
}

absl::StatusOr<NeighbourTable> NeighbourTable::Of(const NeighbourLists& lists, uint32_t vertex_count,
                                                  const RunContext& context) {
  if (lists.IsFull()) {
    return NeighbourLists::FullError();
  }
  NeighbourTable table(lists);
  // First how many list each; then, from the last vertex to the first, where those of each begin.
  std::vector<uint32_t>& begin = table.begin_;
  begin.resize(size_t{vertex_count} + 1);
  for (uint32_t v = 0; v < vertex_count; ++v) {
    if (v % kVerticesBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    for (const VertexId u : lists.Of(VertexId{v})) {
      ++begin[Index(u)];
    }
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  table.listed_by_.resize(begin.back());
  for (uint32_t v = vertex_count; v-- > 0;) {
    if (v % kVerticesBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    for (const VertexId u : lists.Of(VertexId{v})) {
      table.listed_by_[--begin[Index(u)]] = VertexId{v};
    }
  }
  return table;
}

}  // namespace wellspace::core
