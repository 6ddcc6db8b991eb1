// The picture of a mesh before it is painted: triangles in its plane, in the order in which they are painted.
#ifndef WELLSPACE_CLIENT_RENDER_SCENE_H_
#define WELLSPACE_CLIENT_RENDER_SCENE_H_

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/mesh.h"

namespace wellspace::render {

using PicturePoint = std::array<float, 2>;  // relative to the scene's low corner; y upwards

struct Facet {
  std::array<PicturePoint, 3> corners;
  float share;                    // of the way from Scene::low to high, of its value; NaN: it has none
  float shade;                    // brightness by its direction, about 1
  uint32_t category = 0;          // an index into Scene::categories
  std::array<bool, 3> has_dot{};  // by corner
};

struct Scene {
  std::vector<Facet> facets{};
  std::vector<std::array<PicturePoint, 2>> boundary{};  // the facets of a 2-D mesh that have a tag
  std::vector<std::string> categories{};  // names of regions, or of parts of the boundary; empty: colours are values
  double width = 0;                       // of the box of all corners
  double height = 0;
  double low = 0;        // of values: smallest angles of simplices, or of a field
  double high = 0;       // of angles that of a regular simplex
  bool is_angle = true;  // values are angles
  std::string legend{};  // the meaning of the colours
};

// The plane { x : normal · x = offset }; the side that the normal points to is cut off.
struct Plane {
  std::array<double, 3> normal;
  double offset;
};

enum class Colouring { kAngle, kRegion, kBoundary, kField };

struct View {
  std::optional<Plane> plane{};                   // 3-D; none: through the centre of the box, across the first axis
  bool only_boundary = false;                     // 3-D: nothing is cut off
  std::optional<std::array<double, 3>> camera{};  // 3-D: the direction to the spectator; none: before the cut
  int up = 2;                                     // 3-D: the axis that points upwards
  // None: of the boundary alone by its parts where it has several, else by region where the mesh has several, else by
  // angle.
  std::optional<Colouring> colouring{};
  // Of kField: a number for each vertex of the mesh, of whose corners a facet has the mean; or for each simplex. NaN
  // where there is none.
  const formats::Attribute* field = nullptr;
  bool is_field_of_simplices = false;
  std::vector<bool> dots{};  // by vertex: whether it has a dot; empty: none has
};

// The triangles of a 2-D mesh with its boundary; of a 3-D mesh, the visible facets of the tetrahedra whose centroid the
// cut leaves, seen from the side that is cut off, without perspective. With colours of the boundary, facets without a
// tag, as those of the cut, are the last category.
//
// Facets are sorted by the circumcentres of their tetrahedra along the line of sight: an exact order for a Delaunay
// triangulation, whose circumcentres follow each other along any line.
//
// Complexity: O(m + f log f) for m simplices and f visible facets.
// Errors:     INVALID_ARGUMENT for a mesh of more than three dimensions, one with nothing to draw, a plane, a camera or
//             the boundary alone of a 2-D mesh, a plane beside the boundary alone, a normal or a camera of no
//             direction, coordinates whose extent is beyond the range of double, or colours by region, of the
//             boundary of a 3-D mesh, or by a field, where the mesh tells of none; dots for another number of vertices.
// Source:     Edelsbrunner, "An acyclicity theorem for cell complexes in d dimensions", 1990; Max, Hanrahan, Crawfis,
//             "Area and volume coherence for efficient visualization of 3D scalar functions", 1990.
absl::StatusOr<Scene> MakeScene(const formats::MeshView& mesh, const View& view);

}  // namespace wellspace::render

#endif  // WELLSPACE_CLIENT_RENDER_SCENE_H_
