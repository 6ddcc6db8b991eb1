#include "client/formats/tetgen/poly_seeds.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/number.h"
#include "client/formats/tetgen/tetgen_lines.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr std::array kAxes = {"x", "y", "z"};

class SeedReader {
 public:
  SeedReader(LineReader& reader, size_t dimension, absl::FunctionRef<void(const PolySeed&)> add_seed)
      : reader_(reader), dimension_(dimension), add_seed_(add_seed) {}

  absl::Status Read() {
    uint64_t count = 0;
    for (const bool is_hole : {true, false}) {
      std::string_view line;
      if (!reader_.NextContent(line)) {
        return reader_.Finish();
      }
      WELLSPACE_RETURN_IF_ERROR(ReadPart(is_hole, line, count));
    }
    WELLSPACE_RETURN_IF_ERROR(ExpectEnd(reader_, count, "regions"));
    return reader_.Finish();
  }

 private:
  absl::Status ReadPart(bool is_hole, std::string_view line, uint64_t& count) {
    const std::array names = {is_hole ? "number of holes" : "number of regions"};
    count = 0;
    WELLSPACE_RETURN_IF_ERROR(ReadHeader(reader_, line, 1, names, {&count, 1}));
    uint64_t base = 0;
    for (uint64_t row = 0; row < count; ++row) {
      if (!reader_.NextContent(line)) {
        return CountError(reader_, count, is_hole ? "holes" : "regions", row);
      }
      FieldSplitter fields(line, ' ');
      WELLSPACE_RETURN_IF_ERROR(ReadIndex(reader_, fields, row, base));
      PolySeed seed = {.is_hole = is_hole, .largest = {}};
      WELLSPACE_RETURN_IF_ERROR(ReadPlace(fields, seed));
      WELLSPACE_RETURN_IF_ERROR(
          is_hole ? ExpectNoMore(reader_, fields,
                                 absl::StrCat("an index, ", dimension_ == 2 ? "x and y" : "x, y and z", " of a hole"))
                  : ReadNumbers(fields, seed));
      add_seed_(seed);
    }
    return absl::OkStatus();
  }

  absl::Status ReadPlace(FieldSplitter& fields, PolySeed& seed) {
    for (size_t axis = 0; axis < dimension_; ++axis) {
      std::string_view field;
      if (!fields.Next(field)) {
        return reader_.Error(
            absl::StrCat("expected an index, ", dimension_ == 2 ? "x and y" : "x, y and z", ", got no ", kAxes[axis]));
      }
      if (absl::Status status = TakeFinite(field, seed.at[axis]); !status.ok()) {
        return reader_.Error(absl::StrCat(kAxes[axis], ": ", status.message()));
      }
    }
    return absl::OkStatus();
  }

  absl::Status ReadNumbers(FieldSplitter& fields, PolySeed& seed) {
    const std::string place = dimension_ == 2 ? "x, y" : "x, y, z";
    const std::string largest = dimension_ == 2 ? "largest area" : "largest volume";
    std::string_view field;
    if (!fields.Next(field)) {
      return reader_.Error(
          absl::StrCat("expected an index, ", place, ", an attribute and perhaps a ", largest, ", got no attribute"));
    }
    if (absl::Status status = TakeFinite(field, seed.attribute); !status.ok()) {
      return reader_.Error(absl::StrCat("attribute: ", status.message()));
    }
    if (fields.Next(field)) {
      if (absl::Status status = TakeFinite(field, seed.largest.emplace()); !status.ok()) {
        return reader_.Error(absl::StrCat(largest, ": ", status.message()));
      }
      seed.largest = std::max(*seed.largest, 0.0);  // a negative one is none, as for Triangle and TetGen
    }
    return ExpectNoMore(reader_, fields, absl::StrCat("an index, ", place, ", an attribute and a ", largest));
  }

  LineReader& reader_;
  const size_t dimension_;
  const absl::FunctionRef<void(const PolySeed&)> add_seed_;
};

}  // namespace

absl::Status ReadPolySeeds(LineReader& reader, size_t dimension, absl::FunctionRef<void(const PolySeed&)> add_seed) {
  return SeedReader(reader, dimension, add_seed).Read();
}

}  // namespace wellspace::formats
