#include "client/formats/domain/read_planar_domain.h"

#include <algorithm>
#include <span>

#include "absl/strings/str_cat.h"
#include "client/formats/domain/domain_readers.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/open_input.h"
#include "client/formats/registry.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

enum class Kind { kPoly, kGeoJson, kGeoJsonLines, kWkt, kShapefile, kAdcirc, kObj, kCsv };

std::span<const Format<Kind>> Kinds() {
  static const std::vector<Format<Kind>> kinds = {
      {"poly", {".poly"}, Kind::kPoly},
      {"geojson", {".geojson", ".json"}, Kind::kGeoJson},
      {"geojsonl", {".geojsonl", ".geojsons", ".ndjson"}, Kind::kGeoJsonLines},
      {"wkt", {".wkt"}, Kind::kWkt},
      {"shp", {".shp"}, Kind::kShapefile},
      {"adcirc", {".14", ".grd", ".gr3"}, Kind::kAdcirc},
      {"obj", {".obj"}, Kind::kObj},
      {"csv", {".csv", ".tsv", ".txt", ".dat"}, Kind::kCsv},
  };
  return kinds;
}

absl::Status CheckOptions(const std::string& path, Kind kind, const DomainOptions& options) {
  const auto error = [&path](const char* option, const char* format) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": ", option, " is of the format ", format, "; expected none of another one"));
  };
  const bool has_properties = kind == Kind::kGeoJson || kind == Kind::kGeoJsonLines;
  if (!has_properties && !options.region_property.empty()) {
    return error("--region-property", "geojson");
  }
  if (!has_properties && !options.marker_property.empty()) {
    return error("--marker-property", "geojson");
  }
  if (kind != Kind::kCsv && !options.columns.empty()) {
    return error("--columns", "csv");
  }
  if (kind != Kind::kCsv && !options.id_column.empty()) {
    return error("--id-column", "csv");
  }
  return absl::OkStatus();
}

absl::Status Read(InputFile& file, const std::string& path, Kind kind, const DomainOptions& options,
                  PlanarDomain& domain) {
  switch (kind) {
    case Kind::kPoly:
      return ReadPoly(file, path, domain);
    case Kind::kGeoJson:
      return ReadGeoJson(file, options, domain);
    case Kind::kGeoJsonLines:
      return ReadGeoJsonLines(file, options, domain);
    case Kind::kWkt:
      return ReadWkt(file, options, domain);
    case Kind::kShapefile:
      return ReadShapefile(file, options, domain);
    case Kind::kAdcirc:
      return ReadAdcircBoundary(file, domain);
    case Kind::kObj:
      return ReadObjLines(file, domain);
    case Kind::kCsv:
      return ReadPolylines(file, options, domain);
  }
  return absl::OkStatus();
}

void NoteChanges(PlanarDomain& domain) {
  const auto note = [&domain](uint64_t count, const std::string& one, const std::string& more) {
    if (count > 0) {
      domain.notes.push_back(absl::StrCat(domain.name, ": ", count, count == 1 ? one : more));
    }
  };
  note(domain.repeated_points, " point is dropped, which is equal to the one before",
       " points are dropped, which are equal to the ones before them");
  note(domain.unclosed_rings, " ring is closed, whose last point is not its first",
       " rings are closed, whose last points are not their first ones");
  note(domain.altitudes, " position has an altitude, which is not used",
       " positions have altitudes, which are not used");
  note(domain.rounded_numbers,
       absl::StrCat(" coordinate is a whole number that no double is, and is rounded: ", domain.first_rounded),
       absl::StrCat(" coordinates are whole numbers that no double is, and are rounded; the first is ",
                    domain.first_rounded));
  const std::string first = absl::StrCat("; the first is ", domain.first_flat);
  note(domain.flat_rings, absl::StrCat(" ring encloses nothing, and is left out", first),
       absl::StrCat(" rings enclose nothing, and are left out", first));
  note(domain.flat_lines, absl::StrCat(" line has no length, and is left out", first),
       absl::StrCat(" lines have no length, and are left out", first));
}

}  // namespace

std::vector<std::string> DomainFormats() { return FormatNames(Kinds()); }

bool IsDomainPath(const std::string& path) {
  // .json may be anything, and the others are of clouds as well.
  const std::string extension = ExtensionOf(WithoutGzip(path));
  const auto row = FindInputFormat(Kinds(), path, "");
  return extension != ".json" && row.ok() && IsDomainFormat((*row)->name);
}

std::vector<std::string> DomainOnlyFormats() { return {"poly", "geojson", "geojsonl", "wkt", "shp"}; }

bool IsDomainFormat(const std::string& format) {
  const std::vector<std::string> formats = DomainOnlyFormats();
  return std::find(formats.begin(), formats.end(), format) != formats.end();
}

absl::StatusOr<PlanarDomain> ReadPlanarDomain(const std::string& path, const DomainOptions& options) {
  if (path == kStandardStream && options.format.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("<stdin>: expected to be told the format: one of ", absl::StrJoin(DomainFormats(), ", ")));
  }
  const auto row = FindInputFormat(Kinds(), path, options.format);
  if (!row.ok()) {
    return row.status();
  }
  const Kind kind = (*row)->handler;
  WELLSPACE_RETURN_IF_ERROR(CheckOptions(path, kind, options));
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, OpenInflated(path));
  PlanarDomain domain;
  domain.name = file.name();
  WELLSPACE_RETURN_IF_ERROR(Read(file, path, kind, options, domain));
  if (domain.points.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        domain.name, ": no points; expected at least one",
        domain.first_flat.empty() ? "" : "; what encloses nothing is left out, the first is ", domain.first_flat));
  }
  NoteChanges(domain);
  return domain;
}

}  // namespace wellspace::formats
