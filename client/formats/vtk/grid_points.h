// Points of VTK's grids whose files tell their places by axes: images, and rectilinear grids. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_VTK_GRID_POINTS_H_
#define WELLSPACE_CLIENT_FORMATS_VTK_GRID_POINTS_H_

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace wellspace::formats {

// The first and the last index of points along each axis.
struct VtkExtent {
  std::array<int64_t, 3> first{};
  std::array<int64_t, 3> last{};

  uint64_t PointsAlong(int axis) const { return static_cast<uint64_t>(last[axis] - first[axis]) + 1; }
  // Points of the grid; none if they are more than `most`.
  std::optional<uint64_t> PointCount(uint64_t most) const;
};

// The most points that a file of so many bytes may have by its axes: a line of text can tell of 2^32. Data of so many
// points take more bytes than that, but for constants that are compressed.
constexpr uint64_t MostGridPoints(uint64_t file_bytes) { return (uint64_t{1} << 20) + 64 * file_bytes; }

// The places of points at whole indices: index x spacing, turned, from the origin on.
struct VtkImage {
  std::array<double, 3> origin{};
  std::array<double, 3> spacing{1, 1, 1};
  std::array<double, 9> direction{1, 0, 0, 0, 1, 0, 0, 0, 1};  // 3 x 3, row-major: columns are the grid's axes

  // Calls add(x, y, z) for the points of `extent`, the first axis running fastest, with the bits of VTK.
  template <typename Add>
  void ForEachPoint(const VtkExtent& extent, const Add& add) const {
    for (int64_t k = extent.first[2]; k <= extent.last[2]; ++k) {
      for (int64_t j = extent.first[1]; j <= extent.last[1]; ++j) {
        for (int64_t i = extent.first[0]; i <= extent.last[0]; ++i) {
          add(At(0, i, j, k), At(1, i, j, k), At(2, i, j, k));
        }
      }
    }
  }

 private:
  double At(int axis, int64_t i, int64_t j, int64_t k) const {
    const double* row = &direction[3 * axis];
    return row[0] * spacing[0] * static_cast<double>(i) + row[1] * spacing[1] * static_cast<double>(j) +
           row[2] * spacing[2] * static_cast<double>(k) + origin[axis];
  }
};

// Calls add(x, y, z) for the points of a grid with these coordinates along its axes, the first axis running fastest.
template <typename Add>
void ForEachRectilinearPoint(const std::array<std::vector<double>, 3>& axes, const Add& add) {
  for (const double z : axes[2]) {
    for (const double y : axes[1]) {
      for (const double x : axes[0]) {
        add(x, y, z);
      }
    }
  }
}

// Numbers with blanks between them, as many as `count`; none if there are more or fewer, or one is not finite.
std::optional<std::vector<double>> ParseVtkNumbers(std::string_view text, size_t count);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_VTK_GRID_POINTS_H_
