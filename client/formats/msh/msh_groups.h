// Physical groups and entities of Gmsh's MSH, as writers have them. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_MSH_MSH_GROUPS_H_
#define WELLSPACE_CLIENT_FORMATS_MSH_MSH_GROUPS_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "client/formats/mesh.h"
#include "client/formats/names.h"

namespace wellspace::formats {

// Appends the bytes that `value` has in memory.
template <typename T>
void AppendBytes(T value, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

// The groups of a mesh: its regions, of which there is one even if nothing is told of regions, and the parts of its
// boundary. Each is an entity, too.
//
// Thread safety: thread-compatible.
class MshGroups {
 public:
  // REQUIRES:   `shape` outlives this.
  explicit MshGroups(const MeshShape& shape);

  // Physical groups of simplices, and 0 for none.
  const std::vector<Region>& regions() const { return regions_; }
  // The region of simplices that are all of one.
  int32_t first() const { return regions_.front().id; }
  // The numbers of entities, by those of regions and of parts of the boundary.
  const std::map<int32_t, int32_t>& entities() const { return entities_; }
  const std::map<int32_t, int32_t>& part_entities() const { return part_entities_; }

  // The section with the names of groups; empty if there are none. Gmsh counts groups by their dimensions: a part of
  // the boundary and a region may have the same number. Parts stand first, for gmshToFoam, which does not count so and
  // takes the first name of a number.
  std::string PhysicalNames();

  // The section of MSH 4.1 with points, curves, surfaces, volumes: of each its number, its bounding box, its groups,
  // and its bounds. Every part of the boundary is an entity with its number; the bounding box of all is that of the
  // mesh. Nothing is appended if no group has a name.
  void AppendEntities(std::string& text) const;
  // The bounding box of an entity, and its group, if it is not 0.
  void AppendBoxAndGroup(int32_t group, std::string& text) const;

  // Notes on names and numbers that Gmsh reads otherwise, a sentence each.
  std::vector<std::string> Notes() const;

 private:
  // Whether groups have names, and entities are described.
  bool has_groups() const { return !shape_.boundary.empty() || !shape_.regions.empty(); }

  const MeshShape& shape_;
  std::vector<Region> regions_;
  std::map<int32_t, int32_t> entities_;
  std::map<int32_t, int32_t> part_entities_;
  NameChanges changes_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MSH_MSH_GROUPS_H_
