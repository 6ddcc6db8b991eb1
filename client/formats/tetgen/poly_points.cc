#include "client/formats/tetgen/poly_points.h"

#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"
#include "client/formats/io/open_input.h"
#include "client/formats/registry.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// The file of points at `plain`, or compressed beside it.
absl::StatusOr<InputFile> OpenNode(const std::string& plain) {
  absl::StatusOr<InputFile> file = OpenInflated(plain);
  return absl::IsNotFound(file.status()) ? OpenInflated(plain + std::string(kGzipExtension)) : std::move(file);
}

absl::Status ReadHeaderOf(LineReader& reader, uint64_t dimension, std::string_view reason, NodeHeader& header) {
  WELLSPACE_RETURN_IF_ERROR(ReadNodeHeader(reader, header));
  return header.dimension == dimension ? absl::OkStatus()
                                       : reader.Error(absl::StrCat("expected dimension ", dimension, ", ",
                                                                   std::string(reason), ", got ", header.dimension));
}

}  // namespace

absl::Status ReadPolyPoints(LineReader& reader, const std::string& path, uint64_t dimension, std::string_view reason,
                            PointCloud& cloud, NodeExtras& extras, std::string& points_name) {
  NodeHeader header;
  WELLSPACE_RETURN_IF_ERROR(ReadHeaderOf(reader, dimension, reason, header));
  if (header.count > 0) {
    return ReadNodePoints(reader, header, /*skip_invalid=*/false, cloud, extras);
  }
  if (path == kStandardStream) {
    return reader.Error(
        "0 points stand for those of the .node file beside this one, and standard input has none; "
        "expected the points here");
  }
  const std::string poly = WithoutGzip(path);
  const std::string plain = poly.substr(0, poly.size() - ExtensionOf(poly).size()) + ".node";
  absl::StatusOr<InputFile> file = OpenNode(plain);
  if (absl::IsNotFound(file.status())) {
    return reader.Error(absl::StrCat("0 points stand for those of the file ", plain,
                                     ", and there is none; expected it, also with .gz, or the points here"));
  }
  if (!file.ok()) {
    return file.status();
  }
  LineReader beside(*std::move(file));
  WELLSPACE_RETURN_IF_ERROR(ReadHeaderOf(beside, dimension, reason, header));
  WELLSPACE_RETURN_IF_ERROR(ReadNodePoints(beside, header, /*skip_invalid=*/false, cloud, extras));
  points_name = beside.name();
  WELLSPACE_RETURN_IF_ERROR(ExpectEnd(beside, header.count, "points"));
  return beside.Finish();
}

absl::Status ReadPolyPoint(LineReader& reader, std::string_view field, uint64_t index_base, uint64_t count,
                           std::string_view what, uint32_t& point) {
  uint64_t index = 0;
  if (!ParseUnsigned(field, kMaxCount, index) || index < index_base || index - index_base >= count) {
    return reader.Error(count == 0 ? absl::StrCat("expected no ", std::string(what),
                                                  ", since there are no points, got one to point ", Quote(field))
                                   : absl::StrCat("expected a point from ", index_base, " to ", count - 1 + index_base,
                                                  ", got ", Quote(field)));
  }
  point = static_cast<uint32_t>(index - index_base);
  return absl::OkStatus();
}

}  // namespace wellspace::formats
