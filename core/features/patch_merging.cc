#include "core/features/patch_merging.h"

#include <functional>
#include <map>
#include <numeric>
#include <queue>
#include <utility>

#include "core/base/status_macros.h"

namespace wellspace::core {
namespace {

constexpr size_t kCreasesBetweenChecks = 1024;

class PatchMerger {
 public:
  PatchMerger(std::span<const double> areas, double least_area, const RunContext& context)
      : areas_(areas.begin(), areas.end()),
        neighbours_(areas.size()),
        owner_(areas.size()),
        name_(areas.size()),
        least_area_(least_area),
        context_(context) {
    std::iota(owner_.begin(), owner_.end(), 0);
    std::iota(name_.begin(), name_.end(), 0);
  }

  absl::Status AddCreases(std::span<const CommonCrease> creases) {
    for (size_t i = 0; i < creases.size(); ++i) {
      if (i % kCreasesBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
      }
      const CommonCrease& crease = creases[i];
      neighbours_[crease.one][crease.other] += crease.length;
      neighbours_[crease.other][crease.one] += crease.length;
    }
    return absl::OkStatus();
  }

  absl::StatusOr<std::vector<uint32_t>> Merge() {
    for (uint32_t patch = 0; patch < areas_.size(); ++patch) {
      Enqueue(patch);
    }
    while (!smallest_.empty()) {
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
      const auto [area, name, patch] = smallest_.top();
      smallest_.pop();
      // A patch that has grown, or become another one, has an entry of its own.
      if (owner_[patch] != patch || areas_[patch] != area || name_[patch] != name || neighbours_[patch].empty()) {
        continue;
      }
      Join(patch, LongestNeighbour(patch));
    }
    std::vector<uint32_t> become(areas_.size());
    for (uint32_t patch = 0; patch < areas_.size(); ++patch) {
      become[patch] = name_[Find(patch)];
    }
    return become;
  }

 private:
  struct Small {
    double area;
    uint32_t name;
    uint32_t patch;

    bool operator>(const Small& other) const { return std::pair(area, name) > std::pair(other.area, other.name); }
  };

  void Enqueue(uint32_t patch) {
    if (areas_[patch] < least_area_) {
      smallest_.push({areas_[patch], name_[patch], patch});
    }
  }

  uint32_t Find(uint32_t patch) {
    while (owner_[patch] != patch) {
      patch = owner_[patch] = owner_[owner_[patch]];
    }
    return patch;
  }

  uint32_t LongestNeighbour(uint32_t patch) const {
    uint32_t longest = 0;
    double most = -1;
    for (const auto& [neighbour, length] : neighbours_[patch]) {
      if (length > most || (length == most && name_[neighbour] < name_[longest])) {
        longest = neighbour;
        most = length;
      }
    }
    return longest;
  }

  // The small one becomes the other. The one with more neighbours keeps its entries.
  void Join(uint32_t small, uint32_t other) {
    const uint32_t name = name_[other];
    const double area = areas_[small] + areas_[other];
    const bool gives_small = neighbours_[small].size() <= neighbours_[other].size();
    const uint32_t kept = gives_small ? other : small;
    const uint32_t gone = gives_small ? small : other;
    neighbours_[kept].erase(gone);
    neighbours_[gone].erase(kept);
    for (const auto& [neighbour, length] : neighbours_[gone]) {
      neighbours_[kept][neighbour] += length;
      neighbours_[neighbour][kept] += length;
      neighbours_[neighbour].erase(gone);
    }
    neighbours_[gone] = {};
    owner_[gone] = kept;
    areas_[kept] = area;
    name_[kept] = name;
    Enqueue(kept);
  }

  std::vector<double> areas_;
  std::vector<std::map<uint32_t, double>> neighbours_;  // and the length of the crease between
  std::vector<uint32_t> owner_;                         // where the entries of a patch are now
  std::vector<uint32_t> name_;                          // by owner: the patch that others have joined
  const double least_area_;
  const RunContext& context_;
  std::priority_queue<Small, std::vector<Small>, std::greater<Small>> smallest_;
};

}  // namespace

absl::StatusOr<std::vector<uint32_t>> MergePatches(std::span<const double> areas, std::span<const CommonCrease> creases,
                                                   double least_area, const RunContext& context) {
  PatchMerger merger(areas, least_area, context);
  WELLSPACE_RETURN_IF_ERROR(merger.AddCreases(creases));
  return merger.Merge();
}

}  // namespace wellspace::core
