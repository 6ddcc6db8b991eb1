// Writes the simplices of vertices that are done into lists, be it by another thread. Refinement::Finish hands the
// stars over; Rounds says when another thread may write.
#ifndef WELLSPACE_CORE_REFINE_STAR_WRITER_H_
#define WELLSPACE_CORE_REFINE_STAR_WRITER_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <utility>
#include <vector>

#include "core/base/ids.h"
#include "core/base/thread_team.h"
#include "core/cell/star.h"
#include "core/voronoi/star_lists.h"

namespace wellspace::core {

// Stars are written in the order in which Write was called: by the caller, or, if they were collected, by
// another thread after that.
//
// Thread safety: thread-compatible.
// Invariants: (1) while IsWriting, another thread uses the lists, and the caller only collects.
template <int D>
class StarWriter {
 public:
  using Simplices = std::span<const std::array<VertexId, D>>;

  // REQUIRES:   not IsWriting().
  const StarLists<D>& lists() const { return lists_; }

  // Whether the star of a vertex that is done has to be found.
  bool NeedsStars() const { return is_collecting_ || lists_.IsComplete(); }

  // Room for a star that Write is called with next; while this collects, it is kept until it has been written.
  Star<D>& Room() { return is_collecting_ ? collected_.stars.emplace_back() : star_; }

  // Writes the `star` of `v`, among so many vertices. While this collects, the star has to be kept until it has been
  // written.
  void Write(VertexId v, Simplices star, uint32_t vertex_count);

  // Writes the star that Write has put off while the memory was asked for its lists.
  //
  // REQUIRES:   not IsWriting().
  void WriteLast();

  // Collects stars from now on.
  void BeginCollecting() {
    WriteLast();
    is_collecting_ = true;
  }
  // Goes on collecting, or not.
  void SetCollecting(bool is_collecting) { is_collecting_ = is_collecting; }

  // Collects no more, and has another thread write the collected stars.
  //
  // REQUIRES:   not IsWriting().
  void BeginWriting(ThreadTeam& team);
  // Whether another thread may write.
  bool IsWriting() const { return is_writing_; }
  // Notes that the call which the team began has ended.
  void EndWriting() { is_writing_ = false; }

  // As StarLists.
  void Reserve(uint32_t vertices) { lists_.Reserve(vertices); }
  void GiveUp() { lists_.GiveUp(); }
  void Clear() {
    last_ = {};
    lists_.Clear();
  }

  // Asks the memory for the list of `v`.
  void Prefetch(VertexId v) const {
    if (!is_collecting_) {
      lists_.Prefetch(v, 0);
    }
  }

  // While another thread writes, as before it began.
  uint64_t MemoryBytes() const {
    return (is_writing_ ? bytes_before_ : lists_.MemoryBytes()) +
           (star_.capacity() + last_star_.capacity()) * sizeof(star_[0]);
  }

 private:
  struct Entry {
    VertexId vertex = kNoVertex;
    Simplices star;
    uint32_t vertex_count = 0;  // of the structure when the star was found
  };
  struct Collected {
    std::vector<Entry> entries;
    std::deque<Star<D>> stars;  // of entries that are in no batch; a deque, so that they stay where they are
  };

  void Set(const Entry& entry) { lists_.Set(entry.vertex, entry.star, entry.vertex_count); }
  void WriteAll(Collected& collected);
  void PrefetchWrite(Simplices star) const;

  StarLists<D> lists_;
  Star<D> star_;  // the result of Room
  Entry last_;    // with last_star_; no vertex if there is none
  Star<D> last_star_;
  bool is_collecting_ = false;
  Collected collected_;
  bool is_writing_ = false;
  Collected written_;  // by another thread; else empty
  uint64_t bytes_before_ = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_STAR_WRITER_H_
