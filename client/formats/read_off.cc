// Geomview's OFF: the vertices.
#include "client/formats/cloud_readers.h"
#include "client/formats/off_lines.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {

absl::Status ReadOff(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  OffHeader header;
  WELLSPACE_RETURN_IF_ERROR(ReadOffHeader(reader, header));
  if (options.dimension != 0 && header.coordinates != static_cast<uint64_t>(options.dimension)) {
    return reader.Error(DimensionError(options.dimension, header.coordinates));
  }
  cloud.dimension = static_cast<int>(header.coordinates);
  const InvalidValue invalid = options.skip_invalid ? InvalidValue::kSkip : InvalidValue::kTell;
  for (uint64_t vertex = 0; vertex < header.vertices; ++vertex) {
    WELLSPACE_RETURN_IF_ERROR(ReadOffVertex(reader, header, vertex, invalid, cloud));
  }
  NoteFaces(header.faces, cloud);
  return absl::OkStatus();
}

}  // namespace wellspace::formats
