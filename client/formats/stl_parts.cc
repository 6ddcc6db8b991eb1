#include "client/formats/stl_parts.h"

#include <limits>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/formats/vtk/vtk_array.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kStlHeaderBytes = 80;
constexpr size_t kStlCornersAt = 12;

bool Is(std::string_view word, const char* keyword) {
  return absl::EqualsIgnoreCase(absl::string_view(word.data(), word.size()), keyword);
}

}  // namespace

absl::StatusOr<bool> IsStlText(InputFile& file) {
  // A file in binary may start with "solid", too; but then bytes follow that no text has, at the latest in the number
  // of triangles.
  WELLSPACE_ASSIGN_OR_RETURN(const std::string_view start, file.Peek(kStlHeaderBytes + sizeof(uint32_t)));
  bool is_text = true;
  for (const char c : start) {
    is_text = is_text && c != '\0' && c != '\x7f';
  }
  const size_t word = start.find_first_not_of(" \t\r\n");
  return is_text && (start.size() < kStlHeaderBytes + sizeof(uint32_t) ||
                     (word != std::string_view::npos && Is(start.substr(word, 5), "solid")));
}

absl::StatusOr<StlParts::Part> StlParts::NextOfText() {
  std::string_view line;
  while (reader_.NextContent(line)) {
    FieldSplitter fields(line, ' ');
    std::string_view word;
    fields.Next(word);
    if (!has_begun_) {
      constexpr std::string_view kStart = "solid";
      if (!absl::StartsWithIgnoreCase(absl::string_view(line.data(), line.size()), "solid")) {
        break;
      }
      word = line.substr(0, kStart.size());  // some programs leave no blank behind it
      has_begun_ = true;
    }
    if (Is(word, "vertex")) {
      WELLSPACE_RETURN_IF_ERROR(ReadVertex(fields));
      return Part::kVertex;
    }
    if (Is(word, "facet")) {
      ++facets_;
      return Part::kFacet;
    }
    if (Is(word, "endfacet")) {
      return Part::kEndFacet;
    }
    if (Is(word, "solid") || Is(word, "endsolid")) {
      is_open_ = Is(word, "solid");
      solid_ = is_open_ ? TrimBlanks(line.substr(word.size())) : "";
      return is_open_ ? Part::kSolid : Part::kEndSolid;
    }
    if (!Is(word, "outer") && !Is(word, "endloop")) {
      return reader_.Error(absl::StrCat(
          "expected \"facet\", \"outer loop\", \"vertex\", \"endloop\", \"endfacet\" or \"endsolid\", got ",
          Quote(word)));
    }
  }
  if (!has_begun_) {
    return reader_.EndError("expected \"solid\" at the start of the file");
  }
  if (is_open_) {
    return reader_.EndError("the file ends; expected \"endsolid\"");
  }
  WELLSPACE_RETURN_IF_ERROR(reader_.status());
  return Part::kEnd;
}

absl::Status StlParts::ReadVertex(FieldSplitter& fields) {
  for (double& x : point_) {
    std::string_view field;
    if (!fields.Next(field)) {
      return reader_.Error("expected three coordinates after \"vertex\"");
    }
    bool is_invalid = false;
    if (const absl::Status status = TakeCoordinate(field, invalid_, x, is_invalid); !status.ok()) {
      return reader_.Error(std::string(status.message()));
    }
    x = is_invalid ? std::numeric_limits<double>::quiet_NaN() : x + 0.0;  // -0 becomes 0
  }
  std::string_view field;
  return fields.Next(field) ? reader_.Error(absl::StrCat("expected the end of the line, got ", Quote(field)))
                            : absl::OkStatus();
}

absl::StatusOr<StlParts::Part> StlParts::NextOfBinary() {
  if (!has_begun_) {
    char header[kStlHeaderBytes + sizeof(uint32_t)];
    if (reader_.Take(header, sizeof(header)) != sizeof(header)) {
      return EndError("expected 80 bytes of a header and a number of triangles");
    }
    count_ = LoadWord<uint32_t>({header + kStlHeaderBytes, sizeof(uint32_t)}, 0, /*big_endian=*/false);
    has_begun_ = true;
  }
  switch (last_) {
    case Part::kFacet:
      corner_ = 0;
      last_ = Part::kVertex;
      break;
    case Part::kVertex:
      last_ = ++corner_ < 3 ? Part::kVertex : Part::kEndFacet;
      break;
    default: {
      bool is_there = false;
      WELLSPACE_RETURN_IF_ERROR(ReadTriangle(is_there));
      last_ = is_there ? Part::kFacet : Part::kEnd;
      break;
    }
  }
  if (last_ == Part::kVertex) {
    for (size_t axis = 0; axis < point_.size(); ++axis) {
      const float x = LoadWord<float>({triangle_.data() + kStlCornersAt, triangle_.size() - kStlCornersAt},
                                      3 * corner_ + axis, /*big_endian=*/false);
      point_[axis] = x + 0.0;  // -0 becomes 0
    }
  }
  return last_;
}

absl::Status StlParts::ReadTriangle(bool& is_there) {
  // Programs that write triangles as they come leave a 0 in the header: then all that follow are meant.
  if (count_ != 0 && facets_ == count_) {
    return reader_.status();
  }
  const size_t taken = reader_.Take(triangle_.data(), triangle_.size());
  if (taken == 0 && count_ == 0 && reader_.status().ok()) {
    return absl::OkStatus();
  }
  if (taken != triangle_.size()) {
    return EndError(absl::StrCat("expected ", count_ == 0 ? std::string("whole") : absl::StrCat(count_),
                                 " triangles, as the header says; the file ends in triangle ", facets_));
  }
  ++facets_;
  is_there = true;
  return absl::OkStatus();
}

absl::Status StlParts::Error(std::string_view message) const {
  if (is_text_) {
    return reader_.Error(message);
  }
  return absl::InvalidArgumentError(
      absl::StrCat(reader_.name(), ": byte ", reader_.offset() - kTriangleBytes, ": triangle ", facets_ - 1,
                   last_ == Part::kVertex ? absl::StrCat(", corner ", corner_) : "", ": ", std::string(message)));
}

absl::Status StlParts::EndError(const std::string& message) const {
  return reader_.status().ok()
             ? absl::InvalidArgumentError(absl::StrCat(reader_.name(), ": byte ", reader_.offset(), ": ", message))
             : reader_.status();
}

}  // namespace wellspace::formats
