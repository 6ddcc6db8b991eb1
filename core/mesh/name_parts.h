// The names of the input for parts of a mesh.
#ifndef WELLSPACE_CORE_MESH_NAME_PARTS_H_
#define WELLSPACE_CORE_MESH_NAME_PARTS_H_

#include "core/features/part_names.h"
#include "core/mesh/mesh.h"

namespace wellspace::core {

// Gives names to the parts of the boundary of `mesh` whose markers have one, and to its regions; the others keep
// theirs. A mesh of one region has that of its number, whether seeds gave it or not.
//
// REQUIRES:   CheckPartNames(names) is OK; parts of the mesh have their default names.
// Complexity: O(parts log names).
void NameParts(const PartNames& names, Mesh& mesh);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESH_NAME_PARTS_H_
