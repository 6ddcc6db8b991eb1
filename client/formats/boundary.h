// Facets of the boundary, on their way to a file and out of one. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_BOUNDARY_H_
#define WELLSPACE_CLIENT_FORMATS_BOUNDARY_H_

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/formats/mesh.h"

namespace wellspace::formats {

// The part of each facet of a mesh, as facets come one after the other.
//
// Thread safety: thread-compatible.
class PartWalk {
 public:
  // REQUIRES:   `parts` outlive this.
  explicit PartWalk(std::span<const BoundaryPart> parts) : parts_(parts) {}

  // The part of the next facet.
  // REQUIRES:   no more calls than the parts have facets.
  const BoundaryPart& Next() {
    while (done_ == parts_.front().facets) {
      parts_ = parts_.subspan(1);
      done_ = 0;
    }
    ++done_;
    return parts_.front();
  }
  // Whether the last facet was the first of its part.
  bool is_first() const { return done_ == 1; }

 private:
  std::span<const BoundaryPart> parts_;
  uint64_t done_ = 0;  // facets of the first of parts_
};

// Facets as a file has them, in any order, sorted by their tags.
//
// Thread safety: thread-compatible.
class FacetSorter {
 public:
  // The facets with the tag 0, which stands for none, are left out.
  void Add(std::span<const uint32_t> facet, int32_t tag) {
    if (tag != 0) {
      std::vector<uint32_t>& facets = by_tag_[tag];
      facets.insert(facets.end(), facet.begin(), facet.end());
    }
  }
  void Name(int32_t tag, std::string name) { names_[tag] = std::move(name); }

  // Sets facets and parts of `mesh`: facets by ascending tags, and of one tag in the order in which they came. Tags
  // with a name and no facets are parts too.
  void MoveTo(Mesh& mesh) {
    for (const auto& [tag, name] : names_) {
      by_tag_[tag];
    }
    for (const auto& [tag, facets] : by_tag_) {
      const auto name = names_.find(tag);
      mesh.boundary.push_back({.tag = tag,
                               .name = name == names_.end() ? std::string() : name->second,
                               .facets = facets.size() / mesh.dimension});
      mesh.facets.insert(mesh.facets.end(), facets.begin(), facets.end());
    }
  }

 private:
  std::map<int32_t, std::vector<uint32_t>> by_tag_;
  std::map<int32_t, std::string> names_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_BOUNDARY_H_
