// The rows of a mesh whose simplices have numbers of their own, slots, some of which are free.
#ifndef WELLSPACE_CORE_SIMPLEX_SLOT_ROWS_H_
#define WELLSPACE_CORE_SIMPLEX_SLOT_ROWS_H_

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/memory/huge_pages.h"
#include "core/simplex/row_edits.h"

namespace wellspace::core {

// The slots that are taken. The rows are those of the slots that are taken, in their order.
//
// Thread safety: thread-compatible.
class SlotRows {
 public:
  void Clear() {
    words_.clear();
    before_.clear();
    slots_ = rows_ = 0;
  }

  // Adds a slot behind the last.
  void Push(bool is_taken) {
    if (slots_ % kWord == 0) {
      words_.push_back(0);
    }
    if (slots_ % kBlock == 0) {
      before_.push_back(rows_);
    }
    words_.back() |= uint64_t{is_taken} << (slots_ % kWord);
    ++slots_;
    rows_ += is_taken ? 1 : 0;
  }

  uint64_t slots() const { return slots_; }
  uint64_t rows() const { return rows_; }
  bool IsTaken(uint64_t slot) const { return slot < slots_ && ((words_[slot / kWord] >> (slot % kWord)) & 1) != 0; }

  // The number of slots below `slot` that are taken: the row of `slot`, if it is itself.
  //
  // Complexity: O(1).
  uint64_t RowOf(uint64_t slot) const {
    if (slot >= slots_) {
      return rows_;
    }
    uint64_t row = before_[slot / kBlock];
    for (uint64_t word = slot / kBlock * (kBlock / kWord); word < slot / kWord; ++word) {
      row += static_cast<uint64_t>(std::popcount(words_[word]));
    }
    return row + static_cast<uint64_t>(std::popcount(words_[slot / kWord] & ((uint64_t{1} << (slot % kWord)) - 1)));
  }

  // Takes and frees `slots`, ascending: is_taken(slot) says which. One that is taken as before counts as dropped and
  // added: its simplex is another. Returns the edits of the rows.
  //
  // Complexity: O(slots), and one step for each 512 slots.
  template <typename IsTakenNow>
  std::vector<RowEdit> Change(std::span<const uint32_t> slots, IsTakenNow is_taken) {
    std::vector<RowEdit> edits;
    for (const uint32_t slot : slots) {
      const bool was = IsTaken(slot);
      const bool is = is_taken(slot);
      if (was || is) {
        AppendEdit({RowOf(slot), was ? uint64_t{1} : 0, is ? uint64_t{1} : 0}, edits);
      }
    }
    while (!slots.empty() && slots_ <= slots.back()) {
      Push(false);
    }
    int64_t more = 0;
    uint64_t block = 0;  // those up to it have their sums
    const auto add_up_to = [&](uint64_t last) {
      for (; block <= last; ++block) {
        before_[block] += static_cast<uint64_t>(more);
      }
    };
    for (const uint32_t slot : slots) {
      add_up_to(slot / kBlock);
      more += int64_t{is_taken(slot)} - int64_t{IsTaken(slot)};
      const uint64_t bit = uint64_t{1} << (slot % kWord);
      words_[slot / kWord] = is_taken(slot) ? words_[slot / kWord] | bit : words_[slot / kWord] & ~bit;
    }
    if (!slots.empty()) {
      add_up_to(before_.size() - 1);
    }
    rows_ += static_cast<uint64_t>(more);
    return edits;
  }

  uint64_t MemoryBytes() const { return (words_.size() + before_.size()) * sizeof(uint64_t); }

 private:
  static constexpr uint64_t kWord = 64;
  static constexpr uint64_t kBlock = 512;  // slots

  HugeVector<uint64_t> words_;    // a bit for each slot
  std::vector<uint64_t> before_;  // by block: slots before it that are taken
  uint64_t slots_ = 0;
  uint64_t rows_ = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_SLOT_ROWS_H_
