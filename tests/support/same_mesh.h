// Meshes that are the same to the bit: meshes of the core, or of the client library.
#ifndef WELLSPACE_TESTS_SUPPORT_SAME_MESH_H_
#define WELLSPACE_TESTS_SUPPORT_SAME_MESH_H_

#include <gtest/gtest.h>

#include <cstring>

namespace wellspace::test {

template <typename Array>
bool IsSame(const Array& a, const Array& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0);
}

// Expects the same of all that a mesh has but for its revision and its statistics.
template <typename Mesh>
void ExpectSameMesh(const Mesh& a, const Mesh& b) {
  EXPECT_EQ(a.dimension, b.dimension);
  EXPECT_EQ(a.domain_low, b.domain_low);
  EXPECT_EQ(a.domain_high, b.domain_high);
  EXPECT_TRUE(IsSame(a.points, b.points));
  EXPECT_TRUE(IsSame(a.weights, b.weights));
  EXPECT_TRUE(IsSame(a.simplices, b.simplices));
  EXPECT_TRUE(IsSame(a.input_vertex, b.input_vertex));
  EXPECT_TRUE(IsSame(a.moved_vertices, b.moved_vertices));
  EXPECT_TRUE(IsSame(a.vertex_origins, b.vertex_origins));
  EXPECT_TRUE(IsSame(a.vertex_tags, b.vertex_tags));
  EXPECT_TRUE(IsSame(a.facets, b.facets));
  EXPECT_TRUE(IsSame(a.simplex_regions, b.simplex_regions));
  EXPECT_EQ(a.boundary, b.boundary);
  EXPECT_EQ(a.regions, b.regions);
}

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_SAME_MESH_H_
