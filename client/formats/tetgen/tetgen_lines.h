// Lines of TetGen's and Triangle's files: a header of counts, then rows that start with their index. Private to the
// readers of such files.
#ifndef WELLSPACE_CLIENT_FORMATS_TETGEN_TETGEN_LINES_H_
#define WELLSPACE_CLIENT_FORMATS_TETGEN_TETGEN_LINES_H_

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/cloud.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"
#include "client/formats/read_cloud.h"

namespace wellspace::formats {

// The counts of a header are not believed: more is reserved only as more lines arrive.
inline constexpr uint64_t kMaxReserved = 1 << 16;

// Reads the unsigned numbers of a header line; missing numbers stay as they are.
//
// REQUIRES:   names.size() == values.size() >= required.
absl::Status ReadHeader(LineReader& reader, std::string_view line, size_t required, std::span<const char* const> names,
                        std::span<uint64_t> values);

// Reads the index at the start of a line. That of the first line, 0 or 1, is the base of the others.
absl::Status ReadIndex(LineReader& reader, FieldSplitter& fields, uint64_t position, uint64_t& index_base);

// Reads a whole number of 32 bits, which may be negative.
//
// Errors:     a message without a location.
absl::Status ReadMarker(std::string_view text, int32_t& marker);

// The file ended after `got` of `count` `what`.
absl::Status CountError(LineReader& reader, uint64_t count, const char* what, uint64_t got);

absl::Status ExpectEnd(LineReader& reader, uint64_t count, const char* what);

// An error where the fields of the line go on behind the `expected` ones.
absl::Status ExpectNoMore(LineReader& reader, FieldSplitter& fields, std::string_view expected);

// The header of points, in a .node or at the start of a .poly.
struct NodeHeader {
  uint64_t count = 0;
  uint64_t dimension = 0;
  uint64_t attributes = 0;
  uint64_t markers = 0;
  bool has_weights = false;  // the attribute is a weight, as a comment says
};

absl::Status ReadNodeHeader(LineReader& reader, NodeHeader& header);

// The columns of rows of points besides coordinates.
struct NodeExtras {
  uint64_t index_base = 0;            // of the first point: 0 or 1
  std::vector<double> weights = {};   // of the points, if the header says that it has weights
  bool takes_markers = false;         // whether `markers` are read; otherwise any field is accepted in their place
  std::vector<int32_t> markers = {};  // of the points if the header says that they have them; 0 where one is missing
  bool may_skip = true;               // whether a message may say that points can be left out
};

// Reads the points that `header` announces into `cloud`, whose dimension it sets.
//
// REQUIRES:   header.dimension is from kMinDimension to kMaxDimension.
absl::Status ReadNodePoints(LineReader& reader, const NodeHeader& header, bool skip_invalid, PointCloud& cloud,
                            NodeExtras& extras);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_TETGEN_TETGEN_LINES_H_
