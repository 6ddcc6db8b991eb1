// The simplices of a triangulation that have changed since a mesh was made of it.
#ifndef WELLSPACE_CORE_SLIVER_SIMPLEX_JOURNAL_H_
#define WELLSPACE_CORE_SLIVER_SIMPLEX_JOURNAL_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace wellspace::core {

// Numbers of simplices that were taken or freed since Begin, until they are too many to be of use.
//
// Thread safety: thread-compatible.
class SimplexJournal {
 public:
  // Forgets what was noted; from now on up to `most` numbers are.
  void Begin(size_t most) {
    numbers_.clear();
    most_ = most;
    is_whole_ = true;
  }
  // Forgets all, and notes nothing.
  void End() {
    numbers_ = {};
    is_whole_ = false;
  }

  void Note(uint32_t simplex) {
    if (is_whole_) {
      numbers_.push_back(simplex);
      if (numbers_.size() > most_) {
        End();
      }
    }
  }

  // Whether it has all since Begin.
  bool is_whole() const { return is_whole_; }
  size_t size() const { return numbers_.size(); }
  // Forgets all but the first `size`: the others are again what they were.
  void Rewind(size_t size) {
    if (is_whole_) {
      numbers_.resize(size);
    }
  }
  // Those that it has, ascending, each once.
  std::vector<uint32_t> Sorted() const {
    std::vector<uint32_t> sorted = numbers_;
    std::ranges::sort(sorted);
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    return sorted;
  }

 private:
  std::vector<uint32_t> numbers_;
  size_t most_ = 0;
  bool is_whole_ = false;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_SIMPLEX_JOURNAL_H_
