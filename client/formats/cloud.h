// A cloud of points as it was read from a file.
#ifndef WELLSPACE_CLIENT_FORMATS_CLOUD_H_
#define WELLSPACE_CLIENT_FORMATS_CLOUD_H_

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "client/formats/attributes.h"

namespace wellspace::formats {

inline constexpr int kMinDimension = 2;
inline constexpr int kMaxDimension = 6;

// The line of a file that each point came from. Points on lines that follow each other at equal steps cost nothing:
// only the first point after a gap (a comment, a blank line) is stored.
//
// Thread safety: thread-compatible.
class LineIndex {
 public:
  // Notes that the next point came from `line`. Lines never decrease.
  void Add(uint64_t line);
  // The line of point `point`. REQUIRES: point < size().
  uint64_t LineOf(uint64_t point) const;
  uint64_t size() const { return size_; }

 private:
  struct Run {
    uint64_t first_point = 0;
    uint64_t first_line = 0;
    uint64_t step = 0;  // from the line of one point to that of the next

    uint64_t LineOf(uint64_t point) const { return first_line + (point - first_point) * step; }
  };
  std::vector<Run> runs_;
  uint64_t size_ = 0;
};

struct PointCloud {
  std::string name;  // of the file, as messages say it
  int dimension = 0;
  std::vector<double> points;           // size() x dimension, row-major
  LineIndex lines;                      // of every point, or of none when the file has no lines
  LineIndex rows;                       // of every point in a file without lines, if points were skipped; or of none
  std::vector<Attribute> attributes{};  // if they were asked for, with as many values as there are points
  uint64_t skipped = 0;                 // points left out since a coordinate is missing or not finite
  // Notes for the user on how the file was read, a sentence each: the columns taken, the parts of the file not
  // used.
  std::vector<std::string> notes;

  uint64_t size() const { return dimension == 0 ? 0 : points.size() / dimension; }
  // Where point `point` was read: "cloud.csv:17" or, in a file without lines, "cloud.npy[16]", counted from 0.
  // REQUIRES: point < size().
  std::string Origin(uint64_t point) const;
};

// The sides of the box of points, `dimension` of them: 0 without points.
//
// Complexity: O(n) for n coordinates.
std::vector<double> BoxSides(std::span<const double> points, int dimension);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_CLOUD_H_
