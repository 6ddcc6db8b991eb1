// STL, in ascii and in binary, part by part. Private to the readers of such files.
#ifndef WELLSPACE_CLIENT_FORMATS_STL_PARTS_H_
#define WELLSPACE_CLIENT_FORMATS_STL_PARTS_H_

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"

namespace wellspace::formats {

using StlPoint = std::array<double, 3>;

// Of the bits: -0 is not 0 here.
struct StlHash {
  size_t operator()(const StlPoint& point) const {
    uint64_t hash = 0;
    for (const double x : point) {
      hash = (std::rotl(hash, 25) ^ std::bit_cast<uint64_t>(x)) * 0x9e37'79b9'7f4a'7c15;
    }
    return hash ^ (hash >> 32);
  }
};

// Whether a file, of which nothing has been read, is STL in ascii.
absl::StatusOr<bool> IsStlText(InputFile& file);

// Thread safety: thread-compatible.
class StlParts {
 public:
  // The order of a file in ascii is not looked at but for "solid" at its start and "endsolid" at its end. One in binary
  // has facets of three vertices, and no solids.
  enum class Part : uint8_t { kEnd, kSolid, kFacet, kVertex, kEndFacet, kEndSolid };

  // Coordinates that are skipped come as NaN; in binary all come as they are.
  //
  // REQUIRES:   `reader` is at the start of the file, and outlives this.
  StlParts(LineReader& reader, bool is_text, InvalidValue invalid)
      : reader_(reader), is_text_(is_text), invalid_(invalid) {}

  // The next part; kEnd at the end of the file.
  //
  // Errors:     of reading; INVALID_ARGUMENT at the line or the byte.
  absl::StatusOr<Part> Next() { return is_text_ ? NextOfText() : NextOfBinary(); }

  // Of the kVertex, of the kSolid: "" without a name.
  const StlPoint& point() const { return point_; }
  const std::string& solid() const { return solid_; }

  // Facets that have begun.
  uint64_t facets() const { return facets_; }
  bool is_text() const { return is_text_; }
  // Of a file in ascii, where the part stands.
  uint64_t line_number() const { return reader_.line_number(); }
  // Of a file in binary: the kVertex is so many vertices after the first.
  uint64_t vertex() const { return 3 * (facets_ - 1) + corner_; }

  // INVALID_ARGUMENT at the line of the part or, in binary, at the byte of its triangle.
  absl::Status Error(std::string_view message) const;

 private:
  absl::StatusOr<Part> NextOfText();
  absl::StatusOr<Part> NextOfBinary();
  absl::Status ReadVertex(FieldSplitter& fields);
  absl::Status ReadTriangle(bool& is_there);
  absl::Status EndError(const std::string& message) const;

  static constexpr size_t kTriangleBytes = 50;  // of which three floats for the normal, then nine, then two bytes

  LineReader& reader_;
  const bool is_text_;
  const InvalidValue invalid_;
  StlPoint point_{};
  std::string solid_;
  bool has_begun_ = false;
  bool is_open_ = false;  // of text: between "solid" and "endsolid"
  uint64_t facets_ = 0;
  uint64_t count_ = 0;  // of binary: facets, as the header says; 0: all that follow
  std::array<char, kTriangleBytes> triangle_{};
  Part last_ = Part::kEndFacet;  // of binary
  uint64_t corner_ = 0;          // of binary: of the kVertex
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_STL_PARTS_H_
