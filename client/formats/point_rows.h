// Points of formats whose rows are numbers with names. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_POINT_ROWS_H_
#define WELLSPACE_CLIENT_FORMATS_POINT_ROWS_H_

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/cloud.h"
#include "client/formats/read_cloud.h"

namespace wellspace::formats {

// Sorts the numbers of rows: some are coordinates, others are attributes if these are asked for.
//
// Thread safety: thread-compatible.
class PointRows {
 public:
  // Chooses among numbers with these `names`: those of CloudOptions::columns or, without, x, y and, if it is there, z,
  // in any case. Sets dimension and attributes of `cloud`, which outlives this.
  //
  // Errors:     INVALID_ARGUMENT, a message without a location.
  static absl::StatusOr<PointRows> Create(const std::vector<std::string>& names, const CloudOptions& options,
                                          PointCloud& cloud);

  // Adds the point of the next row, or counts it as skipped; true if it was added.
  //
  // Errors:     INVALID_ARGUMENT, a message without a location, for a coordinate that is not finite.
  absl::StatusOr<bool> Add(std::span<const double> row);

 private:
  PointRows(bool skips_invalid, PointCloud& cloud) : skips_invalid_(skips_invalid), cloud_(&cloud) {}

  bool skips_invalid_;
  PointCloud* cloud_;
  std::vector<size_t> coordinates_;  // columns
  std::vector<size_t> attributes_;   // columns
};

// The names of `components` numbers with a name in common: "NAME", or "NAME:0", "NAME:1" and so on.
std::vector<std::string> ComponentNames(const std::string& name, uint64_t components);

// The same of columns that are no coordinates, whatever their names: "x:0" for "x".
std::vector<std::string> DataNames(const std::string& name, uint64_t components);

// Adds points that are all there: `columns` are their numbers, as many of each of `names`. Messages and origins count
// points from 0.
absl::Status AddAllRows(const std::vector<std::string>& names, std::span<const std::vector<double>> columns,
                        const CloudOptions& options, PointCloud& cloud);

// Columns of `numbers`, n x width, row-major.
std::vector<std::vector<double>> ColumnsOf(std::span<const double> numbers, size_t width);

// AddAllRows of points x 2 or x 3, row-major, that have nothing but coordinates.
absl::Status AddAllPoints(std::span<const double> points, size_t width, const CloudOptions& options, PointCloud& cloud);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_POINT_ROWS_H_
