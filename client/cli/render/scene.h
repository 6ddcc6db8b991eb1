// What is to be drawn of a mesh: triangles in the plane of the picture, in the order in which they are painted.
#ifndef WELLSPACE_CLIENT_CLI_RENDER_SCENE_H_
#define WELLSPACE_CLIENT_CLI_RENDER_SCENE_H_

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
  float angle_deg;      // smallest angle of its simplex
  float shade;          // brightness by its direction, about 1
  uint32_t region = 0;  // of its simplex, an index into Scene::regions
};

struct Scene {
  std::vector<Facet> facets;
  std::vector<std::array<PicturePoint, 2>> boundary;  // the facets of a 2-D mesh that have a tag
  std::vector<std::string> regions;                   // their names; empty: colours mean angles
  double width = 0;                                   // of the box of all corners
  double height = 0;
  double best_angle_deg = 0;  // that of a regular simplex
  std::string legend;         // what the colours mean
};

// The plane { x : normal · x = offset }; what lies on the side that the normal points to is cut off.
struct Plane {
  std::array<double, 3> normal;
  double offset;
};

enum class Colouring { kAngle, kRegion };

struct View {
  std::optional<Plane> plane{};          // 3-D; none: through the centre of the box, across the first axis
  int up = 2;                            // 3-D: the axis that points upwards
  std::optional<Colouring> colouring{};  // none: by region where the mesh has several, else by angle
};

// The triangles of a 2-D mesh with its boundary; of a 3-D mesh, the visible facets of the tetrahedra whose centroid the
// cut leaves, seen from the side that is cut off, without perspective.
//
// Facets are sorted by the circumcentres of their tetrahedra along the line of sight: an exact order for a Delaunay
// triangulation, whose circumcentres follow each other along any line.
//
// Complexity: O(m + f log f) for m simplices and f visible facets.
// Errors:     INVALID_ARGUMENT for a mesh of more than three dimensions, one with nothing to draw, a plane of a 2-D
//             mesh, a normal of no direction, coordinates whose extent is beyond the range of double, or colours by
//             region where the mesh tells of none.
// Source:     Edelsbrunner, "An acyclicity theorem for cell complexes in d dimensions", 1990; Max, Hanrahan, Crawfis,
//             "Area and volume coherence for efficient visualization of 3D scalar functions", 1990.
absl::StatusOr<Scene> MakeScene(const formats::MeshView& mesh, const View& view);

}  // namespace wellspace::render

#endif  // WELLSPACE_CLIENT_CLI_RENDER_SCENE_H_
