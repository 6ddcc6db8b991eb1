// Regions of simplices, on their way to a file and out of one. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_REGIONS_H_
#define WELLSPACE_CLIENT_FORMATS_REGIONS_H_

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "client/formats/mesh.h"

namespace wellspace::formats {

// The regions of simplices, for formats that have them on the lines of the simplices, which come later.
//
// Memory: 16 bytes for each run of simplices of one region.
// Thread safety: thread-compatible.
class RegionQueue {
 public:
  void Add(std::span<const int32_t> regions) {
    for (const int32_t region : regions) {
      if (runs_.empty() || runs_.back().region != region) {
        runs_.push_back({region, 0});
      }
      ++runs_.back().simplices;
    }
    count_ += regions.size();
  }

  // How many simplices have got a region.
  uint64_t count() const { return count_; }

  // INTERNAL unless Next can be called for so many more simplices.
  absl::Status CheckNext(uint64_t simplices) const {
    return taken_ + simplices <= count_ ? absl::OkStatus()
                                        : absl::InternalError(absl::StrCat("a mesh got ", taken_ + simplices,
                                                                           " simplices and ", count_, " regions"));
  }

  // The region of the next simplex.
  // REQUIRES:   no more calls than count().
  int32_t Next() {
    while (taken_of_run_ == runs_[run_].simplices) {
      ++run_;
      taken_of_run_ = 0;
    }
    ++taken_of_run_;
    ++taken_;
    return runs_[run_].region;
  }

  // How many simplices each region has, by its id.
  std::map<int32_t, uint64_t> Sizes() const {
    std::map<int32_t, uint64_t> sizes;
    for (const Run& run : runs_) {
      sizes[run.region] += run.simplices;
    }
    return sizes;
  }

 private:
  struct Run {
    int32_t region;
    uint64_t simplices;
  };

  std::vector<Run> runs_;
  uint64_t count_ = 0;
  size_t run_ = 0;
  uint64_t taken_of_run_ = 0;
  uint64_t taken_ = 0;
};

// The regions of simplices as a file has them, one after the other.
//
// Thread safety: thread-compatible.
class RegionCollector {
 public:
  void Add(int32_t region) { regions_.push_back(region); }
  void Name(int32_t region, std::string name) { names_[region] = std::move(name); }

  // Sets the regions of `mesh`, by ascending ids: none if all simplices are of 0, which has no name and stands for
  // none. Regions with a name and no simplices are regions too. Simplices have no regions if there is only one.
  void MoveTo(Mesh& mesh) {
    std::set<int32_t> ids(regions_.begin(), regions_.end());
    for (const auto& [id, name] : names_) {
      ids.insert(id);
    }
    if (ids.size() == 1 && *ids.begin() == 0 && names_.empty()) {
      return;
    }
    for (const int32_t id : ids) {
      mesh.regions.push_back({.id = id, .name = names_[id]});
    }
    if (ids.size() > 1) {
      mesh.simplex_regions = std::move(regions_);
    }
  }

 private:
  std::vector<int32_t> regions_;
  std::map<int32_t, std::string> names_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_REGIONS_H_
