// The version of the meshes that the core makes.
#ifndef WELLSPACE_CORE_MESHERS_MESHING_VERSION_H_
#define WELLSPACE_CORE_MESHERS_MESHING_VERSION_H_

#include <cstdint>

namespace wellspace::core {

// Two builds of one version make, to the bit, the same mesh of the same steps. To be raised with every change that
// makes another mesh of any input: logs of sessions that were written by another version are then not taken again.
inline constexpr uint32_t kMeshingVersion = 2;

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_MESHING_VERSION_H_
