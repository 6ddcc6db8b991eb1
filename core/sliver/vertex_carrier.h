// Carriers, which say where vertices of a mesh may go while it is repaired; and that of a cloud's mesh, the box.
#ifndef WELLSPACE_CORE_SLIVER_VERTEX_CARRIER_H_
#define WELLSPACE_CORE_SLIVER_VERTEX_CARRIER_H_

#include <concepts>
#include <cstdint>
#include <optional>
#include <span>

#include "core/base/ids.h"
#include "core/geometry/box.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"
#include "core/sliver/triangulation.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// A place for a vertex, and all that the triangulation would change for it.
struct RepairStep {
  VertexId vertex{};  // that moves, and is taken out; or a number that is not used yet
  Point<3> to{};
  const Cavity& cavity;             // of `to`, the last that was found
  std::span<const SimplexId> hole;  // the filling of the vertex' place meanwhile; of these the cavity takes some
};

// A carrier brings vertices to where they may be, and says which steps count. Repairer is a template on it: a carrier
// pays for nothing that it does not need. All functions get the triangulation that is repaired.
//
//   Track              The corner, curve, patch or faces that a vertex stays on while it moves.
//   kMeshesAll         bool: whether every tetrahedron is meshed, so that IsMeshed has not to be asked.
//   MayMove(v)         Whether a vertex that the caller has not fixed may move.
//   TrackOf(triangulation, v)
//                      That of a vertex which is in, and may move.
//   Bring(triangulation, track, p)
//                      The place near `p` that the track has for its vertex, if there is one.
//   MayHold(triangulation, p)
//                      Whether a new vertex may be put at `p`.
//   IsMeshed(corners)  Whether a tetrahedron belongs to the mesh, and not to the tube of an acute crease, so that its
//                      angles count. A function of the set of its corners alone: there is no label that could be out of
//                      date.
//   OutsideRho(corners)
//                      The bound of the radius-edge ratio of one that does not, which keeps no sizes.
//   Accepts(triangulation, step)
//                      Whether a step keeps all that the mesh promises beside the shape of tetrahedra. Does not begin a
//                      search in the triangulation.
//   Moved(triangulation, v, near), Added(triangulation, v, near)
//                      A step has been taken. `near` is a neighbour of its vertex.
//   MemoryBytes()      The memory of the carrier. Unit: bytes.
//
// The const functions but Accepts may run at once.
template <typename T>
concept VertexCarrier = requires(T carrier, const T& same, const Triangulation<3>& triangulation,
                                 const typename T::Track& track, const RepairStep& step, const Simplex<3>& corners,
                                 const Point<3>& p, VertexId v) {
  { T::kMeshesAll } -> std::convertible_to<bool>;
  { same.MayMove(v) } -> std::same_as<bool>;
  { same.TrackOf(triangulation, v) } -> std::same_as<typename T::Track>;
  { same.Bring(triangulation, track, p) } -> std::same_as<std::optional<Point<3>>>;
  { same.MayHold(triangulation, p) } -> std::same_as<bool>;
  { same.IsMeshed(corners) } -> std::same_as<bool>;
  { same.OutsideRho(corners) } -> std::same_as<double>;
  { carrier.Accepts(triangulation, step) } -> std::same_as<bool>;
  carrier.Moved(triangulation, v, v);
  carrier.Added(triangulation, v, v);
  { same.MemoryBytes() } -> std::same_as<uint64_t>;
};

// Vertices stay on the faces of the box that they are on, and off all others; those on faces across periodic axes stay
// where they are, as do their images.
//
// Thread safety: thread-safe.
class BoxCarrier {
 public:
  using Track = FaceMask;
  static constexpr bool kMeshesAll = true;

  // The box is not periodic.
  BoxCarrier() = default;

  // REQUIRES:   `structure` outlives this; its vertices are those of the triangulation.
  BoxCarrier(const QueryStructure<3>& structure, FaceMask periodic_faces)
      : structure_(&structure), periodic_faces_(periodic_faces) {}

  bool MayMove(VertexId v) const { return periodic_faces_ == 0 || (structure_->faces(v) & periodic_faces_) == 0; }
  FaceMask TrackOf(const Triangulation<3>& triangulation, VertexId v) const { return triangulation.faces(v); }
  std::optional<Point<3>> Bring(const Triangulation<3>& triangulation, FaceMask faces, Point<3> p) const {
    const Box<3>& box = triangulation.box();
    for (int face = 0; face < 6; ++face) {
      if (((faces >> face) & 1) != 0) {
        p[face / 2] = box.FaceCoordinate(face);
      }
    }
    return box.Contains(p) && box.FacesOf(p) == faces ? std::optional(p) : std::nullopt;
  }
  bool MayHold(const Triangulation<3>& triangulation, const Point<3>& p) const {
    return triangulation.box().Contains(p) && triangulation.box().FacesOf(p) == 0;
  }
  bool IsMeshed(const Simplex<3>& /*corners*/) const { return true; }
  double OutsideRho(const Simplex<3>& /*corners*/) const { return 0; }
  bool Accepts(const Triangulation<3>& /*triangulation*/, const RepairStep& /*step*/) const { return true; }
  void Moved(const Triangulation<3>& /*triangulation*/, VertexId /*v*/, VertexId /*near*/) const {}
  void Added(const Triangulation<3>& /*triangulation*/, VertexId /*v*/, VertexId /*near*/) const {}
  uint64_t MemoryBytes() const { return 0; }

 private:
  const QueryStructure<3>* structure_ = nullptr;
  FaceMask periodic_faces_ = 0;  // those across periodic axes
};
static_assert(VertexCarrier<BoxCarrier>);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_VERTEX_CARRIER_H_
