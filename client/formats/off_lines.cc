#include "client/formats/off_lines.h"

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/io/number.h"

namespace wellspace::formats {
namespace {

// Takes [ST][C][N][4][n]OFF off the start of `line`, if it is there. Of nOFF the coordinates are 0: a number says them.
bool TakeKind(std::string_view& line, OffHeader& header) {
  std::string_view rest = line;
  const auto take = [&rest](std::string_view word) {
    const bool starts = rest.substr(0, word.size()) == word;
    rest.remove_prefix(starts ? word.size() : 0);
    return starts;
  };
  for (const char* more : {"ST", "C", "N", "st", "c"}) {
    header.has_more_values |= take(more);
  }
  header.coordinates = take("4") ? 4 : 3;
  if (header.coordinates == 3 && take("n")) {
    header.coordinates = 0;
  }
  if (!take("OFF") && (header.coordinates == 0 || !take("off"))) {
    return false;
  }
  line = TrimBlanks(rest);
  return true;
}

}  // namespace

absl::Status ReadOffHeader(LineReader& reader, OffHeader& header) {
  std::string_view line;
  if (!reader.NextContent(line) || !TakeKind(line, header)) {
    return reader.EndError("expected OFF, STOFF, COFF, NOFF, CNOFF, 4OFF or nOFF at the start of the file");
  }
  std::vector<uint64_t> numbers;
  const bool has_dimension = header.coordinates == 0;
  const size_t needed = has_dimension ? 3 : 2;  // the number of edges may be missing, as it does for many programs
  while (true) {
    FieldSplitter fields(line, ' ');
    for (std::string_view field; fields.Next(field);) {
      if (numbers.size() == needed + 1 || !ParseUnsigned(field, kMaxCount, numbers.emplace_back())) {
        return reader.Error(absl::StrCat("expected ", has_dimension ? "the dimension and " : "",
                                         "the numbers of vertices, faces and edges, whole numbers below 2^32, got ",
                                         Quote(field)));
      }
    }
    if (numbers.size() >= needed) {
      break;
    }
    if (!reader.NextContent(line)) {
      return reader.EndError("the file ends inside its header; expected the numbers of vertices, faces and edges");
    }
  }
  if (has_dimension) {
    header.coordinates = numbers[0];
    if (header.coordinates < kMinDimension || header.coordinates > kMaxDimension) {
      return reader.Error(absl::StrCat("expected a dimension from ", kMinDimension, " to ", kMaxDimension, ", got ",
                                       header.coordinates));
    }
  }
  header.vertices = numbers[has_dimension ? 1 : 0];
  header.faces = numbers[has_dimension ? 2 : 1];
  return absl::OkStatus();
}

absl::Status ReadOffVertex(LineReader& reader, const OffHeader& header, uint64_t vertex, InvalidValue invalid,
                           PointCloud& cloud) {
  std::string_view line;
  if (!reader.NextContent(line)) {
    return reader.EndError(absl::StrCat("expected ", header.vertices, " vertices, as the header says, got ", vertex));
  }
  FieldSplitter fields(line, ' ');
  std::string_view field;
  std::array<double, kMaxDimension> point;
  bool is_invalid = false;
  for (uint64_t axis = 0; axis < header.coordinates; ++axis) {
    if (!fields.Next(field)) {
      return reader.Error(absl::StrCat("expected ", header.coordinates, " coordinates, got ", axis));
    }
    if (absl::Status status = TakeCoordinate(field, invalid, point[axis], is_invalid); !status.ok()) {
      return reader.Error(absl::StrCat("coordinate ", axis + 1, ": ", status.message()));
    }
  }
  if (!header.has_more_values && fields.Next(field)) {
    return reader.Error(absl::StrCat("expected ", header.coordinates, " coordinates, got also ", Quote(field),
                                     " (COFF, NOFF and STOFF have more numbers)"));
  }
  AddPoint({point.data(), header.coordinates}, is_invalid, reader.line_number(), cloud);
  return absl::OkStatus();
}

}  // namespace wellspace::formats
