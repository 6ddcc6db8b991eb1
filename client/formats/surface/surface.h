// A surface in 3-D as files have it: points, triangles over them with markers, and seeds of the solids that they bound.
#ifndef WELLSPACE_CLIENT_FORMATS_SURFACE_SURFACE_H_
#define WELLSPACE_CLIENT_FORMATS_SURFACE_SURFACE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "client/formats/cloud.h"

namespace wellspace::formats {

// Nothing is cleaned: triangles may be flat, equal, or cross each other, and points may coincide.
//
// Thread safety: thread-compatible.
struct Surface {
  // The solids that are meant: those that an odd number of triangles separates from outside; all bounded ones without a
  // hole.
  enum class SolidRule : uint8_t { kEvenOdd, kHoles };

  // A point that stands for the solid that it is in.
  struct Seed {
    double x = 0;
    double y = 0;
    double z = 0;
    bool is_hole = false;
    double attribute = 0;
    double max_volume = 0;  // of a tetrahedron; 0: no bound

    bool operator==(const Seed&) const = default;
  };

  // The name of a marker.
  struct Part {
    int32_t marker = 0;
    std::string name;

    bool operator==(const Part&) const = default;
  };

  // Where the triangles and seeds of a file stand in it: lines or, in a file without lines, rows from 0.
  struct Places {
    std::string file;  // as messages say it
    bool has_lines = true;
    LineIndex triangles;
    LineIndex seeds;
  };

  std::string name;               // of the file or files, as messages say it
  std::string format;             // that it was read in
  std::vector<double> points;     // point_count() x 3, row-major
  std::vector<uint32_t> corners;  // triangle_count() x 3, indices of points
  std::vector<int32_t> markers;   // of each triangle; 0 where the file has none
  std::vector<Part> parts;        // markers that have a name, ascending
  std::vector<Seed> seeds;        // of each file holes first, then regions
  SolidRule solids = SolidRule::kEvenOdd;
  // Whether triangles share their corners by numbers. Otherwise, in STL, each has corners of its own, of which those
  // that are equal to the bit have been made one.
  bool names_points = true;
  uint64_t cut_polygons = 0;  // of more than three corners, which were cut into triangles
  // Notes for the user on how the file was read, a sentence each.
  std::vector<std::string> notes;
  // Of each file; its triangles and seeds come before those of the next one. A file that was read has one.
  std::vector<Places> places = std::vector<Places>(1);

  uint64_t point_count() const { return points.size() / 3; }
  uint64_t triangle_count() const { return corners.size() / 3; }

  // Where a triangle or a seed was read: "part.stl:17" or, in a file without lines, "part.stl[16]", the face counted
  // from 0. Triangles of one polygon were read in the same place.
  // REQUIRES: the index is below the number of triangles or seeds.
  std::string TriangleOrigin(uint64_t triangle) const;
  std::string SeedOrigin(uint64_t seed) const;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_SURFACE_SURFACE_H_
