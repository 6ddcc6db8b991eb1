// STL, in ascii and in binary: the corners of its triangles.
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <unordered_set>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"
#include "client/formats/point_rows.h"
#include "client/formats/vtk/vtk_array.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kStlHeaderBytes = 80;
constexpr size_t kStlTriangleBytes = 50;  // of which three floats for the normal, then nine, then two bytes
constexpr size_t kStlCornersAt = 12;

bool Is(std::string_view word, const char* keyword) {
  return absl::EqualsIgnoreCase(absl::string_view(word.data(), word.size()), keyword);
}

using StlPoint = std::array<double, 3>;

struct StlHash {
  size_t operator()(const StlPoint& point) const {
    uint64_t hash = 0;
    for (const double x : point) {
      hash = (std::rotl(hash, 25) ^ std::bit_cast<uint64_t>(x)) * 0x9e37'79b9'7f4a'7c15;
    }
    return hash ^ (hash >> 32);
  }
};

class StlReader {
 public:
  StlReader(LineReader& reader, const CloudOptions& options, PointCloud& cloud)
      : reader_(reader), options_(options), cloud_(cloud) {}

  absl::Status ReadAscii() {
    WELLSPACE_RETURN_IF_ERROR(Begin());
    std::string_view line;
    if (!reader_.NextContent(line) ||
        !absl::StartsWithIgnoreCase(absl::string_view(line.data(), line.size()), "solid")) {
      return reader_.EndError("expected \"solid\" at the start of the file");
    }
    bool is_open = true;  // between "solid" and "endsolid"
    while (reader_.NextContent(line)) {
      FieldSplitter fields(line, ' ');
      std::string_view word;
      fields.Next(word);
      if (Is(word, "vertex")) {
        WELLSPACE_RETURN_IF_ERROR(ReadVertex(fields));
      } else if (Is(word, "facet")) {
        ++facets_;
      } else if (Is(word, "solid") || Is(word, "endsolid")) {
        is_open = Is(word, "solid");
      } else if (!Is(word, "outer") && !Is(word, "endloop") && !Is(word, "endfacet")) {
        return reader_.Error(absl::StrCat(
            "expected \"facet\", \"outer loop\", \"vertex\", \"endloop\", \"endfacet\" or \"endsolid\", got ",
            Quote(word)));
      }
    }
    if (is_open) {
      return reader_.EndError("the file ends; expected \"endsolid\"");
    }
    NoteFaces(facets_, cloud_);
    return reader_.status();
  }

  absl::Status ReadBinary() {
    WELLSPACE_RETURN_IF_ERROR(Begin());
    char header[kStlHeaderBytes + sizeof(uint32_t)];
    if (reader_.Take(header, sizeof(header)) != sizeof(header)) {
      return EndError("expected 80 bytes of a header and a number of triangles");
    }
    const auto count = LoadWord<uint32_t>({header + kStlHeaderBytes, sizeof(uint32_t)}, 0, /*big_endian=*/false);
    // Programs that write triangles as they come leave a 0 there: then all that follow are meant.
    for (; count == 0 || facets_ < count; ++facets_) {
      char triangle[kStlTriangleBytes];
      const size_t taken = reader_.Take(triangle, sizeof(triangle));
      if (taken == 0 && count == 0 && reader_.status().ok()) {
        break;
      }
      if (taken != sizeof(triangle)) {
        return EndError(absl::StrCat("expected ", count == 0 ? std::string("whole") : absl::StrCat(count),
                                     " triangles, as the header says; the file ends in triangle ", facets_));
      }
      for (size_t corner = 0; corner < 3; ++corner) {
        StlPoint point;
        for (size_t axis = 0; axis < point.size(); ++axis) {
          point[axis] = LoadWord<float>({triangle + kStlCornersAt, kStlTriangleBytes - kStlCornersAt},
                                        3 * corner + axis, /*big_endian=*/false);
        }
        const uint64_t row = 3 * facets_ + corner;
        const absl::StatusOr<bool> is_added = Add(point);
        if (!is_added.ok()) {
          return absl::InvalidArgumentError(absl::StrCat(cloud_.name, ": byte ", reader_.offset() - kStlTriangleBytes,
                                                         ": triangle ", facets_, ", corner ", corner, ": ",
                                                         is_added.status().message()));
        }
        if (*is_added) {
          cloud_.rows.Add(row);
        }
      }
    }
    NoteFaces(facets_, cloud_);
    return reader_.status();
  }

 private:
  absl::Status Begin() {
    absl::StatusOr<PointRows> rows = PointRows::Create({"x", "y", "z"}, options_, cloud_);
    if (!rows.ok()) {
      return absl::InvalidArgumentError(absl::StrCat(cloud_.name, ": ", rows.status().message()));
    }
    rows_.push_back(*std::move(rows));
    return absl::OkStatus();
  }

  absl::Status ReadVertex(FieldSplitter& fields) {
    StlPoint point;
    for (double& x : point) {
      std::string_view field;
      if (!fields.Next(field)) {
        return reader_.Error("expected three coordinates after \"vertex\"");
      }
      bool is_invalid = false;
      if (const absl::Status status = TakeCoordinate(field, options_.skip_invalid, x, is_invalid); !status.ok()) {
        return reader_.Error(std::string(status.message()));
      }
      x = is_invalid ? std::numeric_limits<double>::quiet_NaN() : x;
    }
    std::string_view field;
    if (fields.Next(field)) {
      return reader_.Error(absl::StrCat("expected the end of the line, got ", Quote(field)));
    }
    WELLSPACE_ASSIGN_OR_RETURN(const bool is_added, Add(point));
    if (is_added) {
      cloud_.lines.Add(reader_.line_number());
    }
    return absl::OkStatus();
  }

  // Adds a corner, unless one at its place has been.
  absl::StatusOr<bool> Add(StlPoint point) {
    for (double& x : point) {
      x += 0.0;  // -0 becomes 0
    }
    if (!seen_.insert(point).second) {  // NaN is equal to nothing
      return false;
    }
    return rows_.front().Add(point);
  }

  absl::Status EndError(const std::string& message) const {
    return reader_.status().ok()
               ? absl::InvalidArgumentError(absl::StrCat(cloud_.name, ": byte ", reader_.offset(), ": ", message))
               : reader_.status();
  }

  LineReader& reader_;
  const CloudOptions& options_;
  PointCloud& cloud_;
  std::vector<PointRows> rows_;  // one
  std::unordered_set<StlPoint, StlHash> seen_;
  uint64_t facets_ = 0;
};

}  // namespace

absl::Status ReadStl(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  // A file in binary may start with "solid", too; but then bytes follow that no text has, at the latest in the number
  // of triangles.
  WELLSPACE_ASSIGN_OR_RETURN(const std::string_view start, file.Peek(kStlHeaderBytes + sizeof(uint32_t)));
  bool is_text = true;
  for (const char c : start) {
    is_text = is_text && c != '\0' && c != '\x7f';
  }
  const size_t word = start.find_first_not_of(" \t\r\n");
  is_text = is_text && (start.size() < kStlHeaderBytes + sizeof(uint32_t) ||
                        (word != std::string_view::npos && Is(start.substr(word, 5), "solid")));
  LineReader reader(std::move(file));
  StlReader stl(reader, options, cloud);
  WELLSPACE_RETURN_IF_ERROR(is_text ? stl.ReadAscii() : stl.ReadBinary());
  return reader.Finish();
}

}  // namespace wellspace::formats
