#include "core/features/odd_sets.h"

#include <algorithm>
#include <queue>

namespace wellspace::core {

uint32_t OddSets::Join(uint32_t one, uint32_t other) {
  if (one == other) {
    return kEmpty;  // in and out again
  }
  if (one == kEmpty || other == kEmpty) {
    return std::min(one, other);
  }
  joined_.push_back({one, other});
  return static_cast<uint32_t>(bound_ + joined_.size() - 1);
}

std::vector<uint32_t> OddSets::MembersOf(uint32_t set) const {
  std::vector<uint32_t> members;
  if (set == kEmpty) {
    return members;
  }
  if (set < bound_) {
    members.push_back(set);
    return members;
  }
  // The sets that two are joined of have lower numbers, so that each comes up as often as it is there, at once.
  std::priority_queue<uint32_t> pending;
  pending.push(set);
  while (!pending.empty()) {
    const uint32_t one = pending.top();
    bool is_odd = false;
    for (; !pending.empty() && pending.top() == one; pending.pop()) {
      is_odd = !is_odd;
    }
    if (is_odd && one < bound_) {
      members.push_back(one);
    } else if (is_odd) {
      for (const uint32_t part : joined_[one - bound_]) {
        pending.push(part);
      }
    }
  }
  std::reverse(members.begin(), members.end());
  return members;
}

}  // namespace wellspace::core
