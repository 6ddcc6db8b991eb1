// The readers behind ReadCloud, one for each format. Each fills `cloud.dimension` and `points`, those of text `lines`,
// too; `dimension` is what the file must have, or 0. REQUIRES: cloud.name is set. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_CLOUD_READERS_H_
#define WELLSPACE_CLIENT_FORMATS_CLOUD_READERS_H_

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/cloud.h"
#include "client/formats/line_reader.h"

namespace wellspace::formats {

absl::Status ReadCsv(LineReader& reader, int dimension, PointCloud& cloud);
absl::Status ReadXyz(LineReader& reader, int dimension, PointCloud& cloud);
absl::Status ReadNode(LineReader& reader, int dimension, PointCloud& cloud);
absl::Status ReadPly(LineReader& reader, int dimension, PointCloud& cloud);
absl::Status ReadObj(LineReader& reader, int dimension, PointCloud& cloud);
absl::Status ReadOff(LineReader& reader, int dimension, PointCloud& cloud);
absl::Status ReadNpy(InputFile& file, int dimension, PointCloud& cloud);

// ReadNode that also tells the index of the first point, 0 or 1, and the points' weights, if the file has them.
absl::Status ReadNode(LineReader& reader, int dimension, PointCloud& cloud, uint64_t& index_base,
                      std::vector<double>& weights);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_CLOUD_READERS_H_
