// The readers behind ReadCloud, one for each format. Each fills `cloud.dimension`, `points`, `skipped` and `notes`,
// those of text `lines`, too; `options.dimension` is the one it must have, or 0. REQUIRES: cloud.name is set.
// Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_CLOUD_READERS_H_
#define WELLSPACE_CLIENT_FORMATS_CLOUD_READERS_H_

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/cloud.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/read_cloud.h"

namespace wellspace::formats {

// These obey options.columns themselves.
absl::Status ReadCsv(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadXyz(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadAsc(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadPts(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadPly(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadNpy(InputFile& file, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadStl(InputFile& file, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadPcd(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadLas(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadVtkPoints(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadVtp(InputFile& file, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadVts(InputFile& file, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadVtr(InputFile& file, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadVti(InputFile& file, const CloudOptions& options, PointCloud& cloud);
// The same of files of pieces: each piece is a file beside it.
absl::Status ReadPvtp(InputFile& file, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadPvts(InputFile& file, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadPvtu(InputFile& file, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadPvtr(InputFile& file, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadPvti(InputFile& file, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadVtuPoints(InputFile& file, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadMshPoints(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadMeditPoints(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadAdcircPoints(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status Read2dmPoints(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadNpzPoints(InputFile& file, const CloudOptions& options, PointCloud& cloud);

// These leave options.columns to TakeColumns, which is called with their result when no dimension was asked for.
absl::Status ReadNode(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadObj(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status ReadOff(LineReader& reader, const CloudOptions& options, PointCloud& cloud);
absl::Status TakeColumns(const CloudOptions& options, PointCloud& cloud);

// The columns of a .node beside its points.
struct NodeNumbers {
  uint64_t index_base = 0;        // the index of the first point, 0 or 1
  std::vector<double> weights{};  // of the points, if the file has them
  bool has_markers = false;       // whether its header says that points have markers
};

// ReadNode that tells these, too.
absl::Status ReadNode(LineReader& reader, const CloudOptions& options, PointCloud& cloud, NodeNumbers& numbers);

// Reads a coordinate that a line must have.
//
// Guarantees: `is_invalid` becomes true for a value that is missing or not finite, if those are to be skipped;
//             otherwise it is as it was.
// Errors:     a message without a location.
absl::Status TakeCoordinate(std::string_view text, bool skip_invalid, double& value, bool& is_invalid);

// The treatment of a value that is missing or not finite.
enum class InvalidValue : uint8_t {
  kRefuse,
  kTell,  // an error whose message says that it could be skipped
  kSkip,
};

// The same for a reader of more than clouds.
absl::Status TakeCoordinate(std::string_view text, InvalidValue rule, double& value, bool& is_invalid);

// Adds `point`, read from the last line of `reader`, to the cloud; or counts it as skipped.
void AddPoint(std::span<const double> point, bool is_invalid, uint64_t line, PointCloud& cloud);

// The message where a file has other coordinates than the options ask for: "expected 2 coordinates, got 3; --columns
// 1,2 takes two".
std::string DimensionError(int wanted, uint64_t count);

// Notes that a file has faces, or cells that are not vertices.
void NoteFaces(uint64_t faces, PointCloud& cloud);
void NoteCells(uint64_t cells, PointCloud& cloud);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_CLOUD_READERS_H_
