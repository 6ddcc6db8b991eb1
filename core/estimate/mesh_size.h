// Expected numbers of simplices and bytes of a mesh, by its vertices and the leaves of its tree.
#ifndef WELLSPACE_CORE_ESTIMATE_MESH_SIZE_H_
#define WELLSPACE_CORE_ESTIMATE_MESH_SIZE_H_

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/base/ids.h"
#include "core/geometry/point.h"
#include "core/tree/leaf_tree.h"

namespace wellspace::core {

// The sections of docs/design/estimate.md that are named below have the measurements.

// Leaves that refinement leaves behind.
struct Leaves {
  double all = 0;
  double filled = 0;  // leaves with vertices
};

// Simplices per vertex without a boundary. In 2-D by Euler's formula; in 3-D as measured: 5 to 6 around surfaces and
// curves, 6.6 in uniformly random points; from 4-D on those of random points, 31.8, 187 and 1297, a tenth less. "The
// model".
template <int D>
constexpr double kSimplicesPerVertex = D == 2   ? 2.0
                                       : D == 3 ? 6.1
                                       : D == 4 ? 29.0
                                       : D == 5 ? 170.0
                                                : 1170.0;

// Vertices per h^-D where sizes h alone decide: kappa in "How it is computed".
template <int D>
constexpr double kVerticesPerSize = D == 2 ? 0.7 : 0.82;

template <int D>
double SimplicesOf(double vertices, double on_boundary) {
  if constexpr (D == 2) {
    return 2 * vertices - 2 - on_boundary;
  } else {
    // About half of the simplices around a vertex of the interior are around one of the boundary: "The model". The
    // empty box has D!.
    const double corners = 1 << D;
    return std::tgamma(D + 1) +
           kSimplicesPerVertex<D> * std::max(0.0, vertices - corners - 0.52 * (on_boundary - corners));
  }
}

// The memory that a process touches whatever the mesh, as measured: code, threads, their stacks and scratch space. "The
// model".
inline constexpr double kFixedBytes = 5.2e6;

// The memory that arrays leave free of the large pages that they share (PagePool), as measured: this part of all, up to
// this size. "Calibration" has the estimates of the memory with it, and with the margin.
inline constexpr double kLeftFree = 0.3;
inline constexpr double kMostLeftFree = 3e6;

// Where the estimate of the memory is wrong, it is rather short than long: 0.57 to 1.05 without this, which puts the
// two ends about as far from 1.
inline constexpr double kMemoryMargin = 1.25;

// The memory at its peak, when the mesh has been put together. Vectors grow by doubling, but of the bytes that they
// reserve only those in use are ever touched; the free rest of the last large page of each is within the margin.
template <int D>
double BytesOf(const Leaves& leaves, double vertices, double simplices) {
  constexpr double kChildren = LeafTree<D>::kChildren;
  const double nodes = leaves.all * kChildren / (kChildren - 1);
  // Beside the nodes, three marks of the queries' scratch space.
  const double node_bytes = LeafTree<D>::NodeBytes() + 3 * sizeof(uint32_t);
  using VertexPool = typename LeafTree<D>::VertexPool;
  // Coordinates in the tree, in the structure and in the mesh; number in the tree, leaf, faces, radius, place in the
  // schedule, numbers in the output; where its simplices are listed, how many, and when it was added; in the mesh its
  // origin and its tag.
  const double vertex_bytes = VertexPool::kPlaceBytes + 2 * sizeof(Point<D>) + 32 + 5 * sizeof(uint32_t);
  // Indices in the lists, some of which are no simplices any more, and in the mesh.
  const double simplex_bytes = 1.05 * D * sizeof(VertexId) + (D + 1) * sizeof(uint32_t);
  const double in_use = nodes * node_bytes + leaves.filled * VertexPool::OverheadBytes() + vertices * vertex_bytes +
                        simplices * simplex_bytes;
  return kMemoryMargin * (kFixedBytes + in_use + std::min(kLeftFree * in_use, kMostLeftFree));
}

// The memory of a domain in the plane beside that: by vertex its place, and its triangles with their faces, which are
// kept from the refinement to the output; by segment graph, faces and lists, as measured.
inline double DomainBytesOf(double vertices, double segments) {
  constexpr double kVertexBytes = 24 + 2 * (3 * sizeof(uint32_t) + sizeof(uint32_t));
  constexpr double kSegmentBytes = 200;
  return kMemoryMargin * (vertices * kVertexBytes + segments * kSegmentBytes);
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_ESTIMATE_MESH_SIZE_H_
