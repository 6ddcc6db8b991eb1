// Geomview's OFF: the vertices.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/number.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// What the word at the start says.
struct OffKind {
  uint64_t coordinates = 3;      // 0: a number says it
  bool has_more_values = false;  // after the coordinates
};

// Takes [ST][C][N][4][n]OFF off the start of `line`, if it is there.
std::optional<OffKind> TakeKind(std::string_view& line) {
  std::string_view rest = line;
  const auto take = [&rest](std::string_view word) {
    const bool starts = rest.substr(0, word.size()) == word;
    rest.remove_prefix(starts ? word.size() : 0);
    return starts;
  };
  OffKind kind;
  for (const char* more : {"ST", "C", "N"}) {
    kind.has_more_values |= take(more);
  }
  kind.coordinates = take("4") ? 4 : 3;
  if (kind.coordinates == 3 && take("n")) {
    kind.coordinates = 0;
  }
  if (!take("OFF")) {
    return std::nullopt;
  }
  line = TrimBlanks(rest);
  return kind;
}

class OffReader {
 public:
  OffReader(LineReader& reader, const CloudOptions& options, PointCloud& cloud)
      : reader_(reader), options_(options), cloud_(cloud) {}

  absl::Status Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadHeader());
    if (options_.dimension != 0 && kind_.coordinates != static_cast<uint64_t>(options_.dimension)) {
      return reader_.Error(DimensionError(options_.dimension, kind_.coordinates));
    }
    cloud_.dimension = static_cast<int>(kind_.coordinates);
    for (uint64_t vertex = 0; vertex < vertices_; ++vertex) {
      WELLSPACE_RETURN_IF_ERROR(ReadVertex(vertex));
    }
    NoteFaces(faces_, cloud_);
    return absl::OkStatus();
  }

 private:
  // The word, of nOFF the dimension, the counts; on one line or more.
  absl::Status ReadHeader() {
    std::string_view line;
    const bool has_line = reader_.NextContent(line);
    const std::optional<OffKind> kind = has_line ? TakeKind(line) : std::nullopt;
    if (!kind) {
      return reader_.EndError("expected OFF, STOFF, COFF, NOFF, CNOFF, 4OFF or nOFF at the start of the file");
    }
    kind_ = *kind;
    std::vector<uint64_t> numbers;
    const bool has_dimension = kind_.coordinates == 0;
    const size_t needed = has_dimension ? 3 : 2;  // the number of edges may be missing, as it does for many programs
    while (true) {
      FieldSplitter fields(line, ' ');
      for (std::string_view field; fields.Next(field);) {
        if (numbers.size() == needed + 1 || !ParseUnsigned(field, kMaxCount, numbers.emplace_back())) {
          return reader_.Error(absl::StrCat("expected ", has_dimension ? "the dimension and " : "",
                                            "the numbers of vertices, faces and edges, whole numbers below 2^32, got ",
                                            Quote(field)));
        }
      }
      if (numbers.size() >= needed) {
        break;
      }
      if (!reader_.NextContent(line)) {
        return reader_.EndError("the file ends inside its header; expected the numbers of vertices, faces and edges");
      }
    }
    if (has_dimension) {
      kind_.coordinates = numbers[0];
      if (kind_.coordinates < kMinDimension || kind_.coordinates > kMaxDimension) {
        return reader_.Error(absl::StrCat("expected a dimension from ", kMinDimension, " to ", kMaxDimension, ", got ",
                                          kind_.coordinates));
      }
    }
    vertices_ = numbers[has_dimension ? 1 : 0];
    faces_ = numbers[has_dimension ? 2 : 1];
    return absl::OkStatus();
  }

  absl::Status ReadVertex(uint64_t vertex) {
    std::string_view line;
    if (!reader_.NextContent(line)) {
      return reader_.EndError(absl::StrCat("expected ", vertices_, " vertices, as the header says, got ", vertex));
    }
    FieldSplitter fields(line, ' ');
    std::string_view field;
    std::array<double, kMaxDimension> point;
    bool is_invalid = false;
    for (uint64_t axis = 0; axis < kind_.coordinates; ++axis) {
      if (!fields.Next(field)) {
        return reader_.Error(absl::StrCat("expected ", kind_.coordinates, " coordinates, got ", axis));
      }
      if (absl::Status status = TakeCoordinate(field, options_.skip_invalid, point[axis], is_invalid); !status.ok()) {
        return reader_.Error(absl::StrCat("coordinate ", axis + 1, ": ", status.message()));
      }
    }
    if (!kind_.has_more_values && fields.Next(field)) {
      return reader_.Error(absl::StrCat("expected ", kind_.coordinates, " coordinates, got also ", Quote(field),
                                        " (COFF, NOFF and STOFF have more numbers)"));
    }
    AddPoint({point.data(), kind_.coordinates}, is_invalid, reader_.line_number(), cloud_);
    return absl::OkStatus();
  }

  LineReader& reader_;
  const CloudOptions& options_;
  PointCloud& cloud_;
  OffKind kind_;
  uint64_t vertices_ = 0;
  uint64_t faces_ = 0;
};

}  // namespace

absl::Status ReadOff(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  return OffReader(reader, options, cloud).Read();
}

}  // namespace wellspace::formats
