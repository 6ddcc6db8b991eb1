// The points of a .poly or .smesh: in the file, or in the .node beside it. Private to the readers of such files.
#ifndef WELLSPACE_CLIENT_FORMATS_TETGEN_POLY_POINTS_H_
#define WELLSPACE_CLIENT_FORMATS_TETGEN_POLY_POINTS_H_

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "client/formats/cloud.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/tetgen/tetgen_lines.h"

namespace wellspace::formats {

// Reads the points at the start of a file; where it has 0, those of the .node beside `path`, whose name is then
// `points_name`. `reason` follows "expected dimension 2" in the message for another dimension.
//
// Errors:     of opening and reading; INVALID_ARGUMENT at the line, also if there is no .node.
absl::Status ReadPolyPoints(LineReader& reader, const std::string& path, uint64_t dimension, std::string_view reason,
                            PointCloud& cloud, NodeExtras& extras, std::string& points_name);

// Reads the point of which a row has the index; those of `count` points start at `index_base`. `what` has the point,
// for messages.
//
// Errors:     INVALID_ARGUMENT at the line.
absl::Status ReadPolyPoint(LineReader& reader, std::string_view field, uint64_t index_base, uint64_t count,
                           std::string_view what, uint32_t& point);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_TETGEN_POLY_POINTS_H_
