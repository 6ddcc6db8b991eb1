// Meshes of random numbers, which files have to keep to the bit.
#ifndef WELLSPACE_TESTS_CLIENT_FORMATS_RANDOM_MESH_H_
#define WELLSPACE_TESTS_CLIENT_FORMATS_RANDOM_MESH_H_

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "client/formats/mesh.h"

namespace wellspace::formats {

// `vertices` points with the bits of all kinds of doubles, and simplices of random vertices.
inline Mesh RandomMesh(int dimension, uint64_t vertices, uint64_t simplices) {
  std::mt19937_64 random(7);
  Mesh mesh{.dimension = dimension, .points = {}, .simplices = {}};
  mesh.points = {0.0,    -0.0, 0.1, std::numeric_limits<double>::denorm_min(), std::numeric_limits<double>::max(),
                 1.0 / 3};
  while (mesh.points.size() < vertices * dimension) {
    const double value = std::bit_cast<double>(random());
    mesh.points.push_back(std::isfinite(value) ? value : 1e-300);
  }
  while (mesh.simplices.size() < simplices * (dimension + 1)) {
    mesh.simplices.push_back(static_cast<uint32_t>(random() % vertices));
  }
  return mesh;
}

inline std::vector<uint64_t> Bits(const std::vector<double>& values) {
  std::vector<uint64_t> bits;
  for (const double value : values) {
    bits.push_back(std::bit_cast<uint64_t>(value));
  }
  return bits;
}

}  // namespace wellspace::formats

#endif  // WELLSPACE_TESTS_CLIENT_FORMATS_RANDOM_MESH_H_
