// A mesh without the numbering of its vertices and the order of its simplices, to compare meshes by.
#ifndef WELLSPACE_TESTS_SUPPORT_CANONICAL_H_
#define WELLSPACE_TESTS_SUPPORT_CANONICAL_H_

#include <cstdint>
#include <vector>

#include "core/meshers/mesher.h"

namespace wellspace::test {

struct CanonicalMesh {
  std::vector<std::vector<double>> points;       // ascending
  std::vector<std::vector<uint32_t>> simplices;  // ascending, each ascending, by the places of its vertices in `points`

  bool operator==(const CanonicalMesh&) const = default;
};

CanonicalMesh Canonical(const core::Mesh& mesh);

// FNV-1a over the bits of the canonical mesh: the same on every machine.
uint64_t Hash(const CanonicalMesh& mesh);

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_CANONICAL_H_
