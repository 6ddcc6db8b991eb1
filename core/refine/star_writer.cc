#include "core/refine/star_writer.h"

#include "core/base/dimensions.h"

namespace wellspace::core {
namespace {

// The memory that writing a star reads is asked for so many before its turn.
constexpr size_t kWrittenAhead = 4;

}  // namespace

template <int D>
void StarWriter<D>::Write(VertexId v, Simplices star, uint32_t vertex_count) {
  if (is_collecting_) {
    collected_.entries.push_back({v, star, vertex_count});
    return;
  }
  PrefetchWrite(star);
  WriteLast();
  last_star_.assign(star.begin(), star.end());
  last_ = {v, last_star_, vertex_count};
}

template <int D>
void StarWriter<D>::WriteLast() {
  if (last_.vertex != kNoVertex) {
    Set(last_);
    last_.vertex = kNoVertex;
  }
}

template <int D>
void StarWriter<D>::BeginWriting(ThreadTeam& team) {
  is_collecting_ = false;
  std::swap(written_, collected_);
  if (!written_.entries.empty()) {
    bytes_before_ = lists_.MemoryBytes();
    is_writing_ = true;
    team.BeginCall([this] { WriteAll(written_); });
  }
}

template <int D>
void StarWriter<D>::WriteAll(Collected& collected) {
  for (size_t i = 0; i < collected.entries.size(); ++i) {
    if (i + kWrittenAhead < collected.entries.size()) {
      PrefetchWrite(collected.entries[i + kWrittenAhead].star);
    }
    Set(collected.entries[i]);
  }
  collected.entries.clear();
  collected.stars.clear();
}

// Asks the memory for the lists that writing a star reads.
template <int D>
void StarWriter<D>::PrefetchWrite(Simplices star) const {
  for (const std::array<VertexId, D>& simplex : star) {
    lists_.Prefetch(simplex[0], 0);  // most neighbours are the first of some
  }
}

#define WELLSPACE_INSTANTIATE(D) template class StarWriter<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
