// Geomview's OFF: its header and its vertices. Private to the readers of such files.
#ifndef WELLSPACE_CLIENT_FORMATS_OFF_LINES_H_
#define WELLSPACE_CLIENT_FORMATS_OFF_LINES_H_

#include <cstdint>

#include "absl/status/status.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/line_reader.h"

namespace wellspace::formats {

struct OffHeader {
  uint64_t coordinates = 3;
  bool has_more_values = false;  // after the coordinates
  uint64_t vertices = 0;
  uint64_t faces = 0;
};

// The word, of nOFF the dimension, the counts; on one line or more. The word may be in lower case, but for those with N
// or n, which mean different things.
absl::Status ReadOffHeader(LineReader& reader, OffHeader& header);

// Reads vertex number `vertex` of those that the header announces, into `cloud`.
absl::Status ReadOffVertex(LineReader& reader, const OffHeader& header, uint64_t vertex, InvalidValue invalid,
                           PointCloud& cloud);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_OFF_LINES_H_
