#include "client/formats/surface/read_seeds.h"

#include <array>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"
#include "client/formats/io/open_input.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr std::string_view kHole = "hole";
constexpr size_t kFields = 4;  // and perhaps a volume
constexpr std::array<const char*, kFields> kNames = {"x", "y", "z", "region"};

// The fields of a line, as many as there are.
std::vector<std::string_view> FieldsOf(std::string_view line) {
  std::vector<std::string_view> fields;
  FieldSplitter splitter(line, ',');
  for (std::string_view field; splitter.Next(field);) {
    fields.push_back(field);
  }
  return fields;
}

// Errors: a message without a location.
absl::Status ParseSeed(const std::vector<std::string_view>& fields, Surface::Seed& seed) {
  if (fields.size() != kFields && fields.size() != kFields + 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("expected x,y,z,region or x,y,z,region,max-volume, got ", fields.size(), " fields"));
  }
  seed.is_hole = fields[kFields - 1] == kHole;
  const std::array<double*, kFields> values = {&seed.x, &seed.y, &seed.z, &seed.attribute};
  for (size_t i = 0; i < kFields - (seed.is_hole ? 1 : 0); ++i) {
    if (absl::Status status = ParseFinite(fields[i], *values[i]); !status.ok()) {
      return absl::InvalidArgumentError(
          absl::StrCat(kNames[i], i + 1 == kFields ? ", a number or hole: " : ": ", status.message()));
    }
  }
  if (fields.size() == kFields || fields.back().empty()) {
    return absl::OkStatus();
  }
  if (absl::Status status = ParseFinite(fields.back(), seed.max_volume); !status.ok() || !(seed.max_volume > 0)) {
    return absl::InvalidArgumentError(
        absl::StrCat("max-volume: expected a number above 0, or nothing for no bound, got ", Quote(fields.back())));
  }
  return seed.is_hole ? absl::InvalidArgumentError("max-volume: a hole is not meshed, and has no bound; leave it out")
                      : absl::OkStatus();
}

bool IsHeader(const std::vector<std::string_view>& fields) {
  return fields.size() >= kFields && !fields[0].empty() && !IsNumber(fields[0]);
}

}  // namespace

std::string SolidSeeds::Origin(uint64_t seed) const { return absl::StrCat(name, ":", places.LineOf(seed)); }

absl::StatusOr<SolidSeeds> ReadSolidSeeds(const std::string& path) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, OpenInflated(path));
  LineReader reader(std::move(file));
  SolidSeeds read;
  read.name = reader.name();
  bool is_first = true;
  for (std::string_view line; reader.NextContent(line);) {
    const std::vector<std::string_view> fields = FieldsOf(line);
    if (std::exchange(is_first, false) && IsHeader(fields)) {
      continue;
    }
    Surface::Seed seed;
    if (absl::Status status = ParseSeed(fields, seed); !status.ok()) {
      return reader.Error(std::string(status.message()));
    }
    read.seeds.push_back(seed);
    read.places.Add(reader.line_number());
  }
  WELLSPACE_RETURN_IF_ERROR(reader.Finish());
  if (read.seeds.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(read.name, ": no seeds; expected at least one line x,y,z,region"));
  }
  return read;
}

}  // namespace wellspace::formats
