// TetGen's .smesh and 3-D .poly.
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"
#include "client/formats/surface/surface_builder.h"
#include "client/formats/surface/surface_readers.h"
#include "client/formats/tetgen/poly_points.h"
#include "client/formats/tetgen/poly_seeds.h"
#include "client/formats/tetgen/tetgen_lines.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class FacetReader {
 public:
  FacetReader(InputFile& file, const std::string& path, bool is_poly, Surface& surface)
      : reader_(std::move(file)), path_(path), is_poly_(is_poly), surface_(surface), builder_(surface) {}

  absl::Status Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadPoints());
    std::string_view line;
    if (!reader_.NextContent(line)) {
      return reader_.Finish();  // every later part may be missing
    }
    WELLSPACE_RETURN_IF_ERROR(ReadFacets(line));
    return ReadSeeds();
  }

 private:
  absl::Status ReadPoints() {
    PointCloud cloud;
    NodeExtras extras = {.may_skip = false};
    std::string beside;
    WELLSPACE_RETURN_IF_ERROR(
        ReadPolyPoints(reader_, path_, 3, "since a surface is one in space", cloud, extras, beside));
    surface_.points = std::move(cloud.points);
    index_base_ = extras.index_base;
    return absl::OkStatus();
  }

  absl::Status ReadFacets(std::string_view line) {
    std::array<uint64_t, 2> header{};
    constexpr std::array kNames = {"number of facets", "number of markers"};
    WELLSPACE_RETURN_IF_ERROR(ReadHeader(reader_, line, 1, kNames, header));
    const auto [count, markers] = header;
    if (markers > 1) {
      return reader_.Error(absl::StrCat("expected 0 or 1 markers of each facet, got ", markers));
    }
    for (uint64_t facet = 0; facet < count; ++facet) {
      if (!reader_.NextContent(line)) {
        return CountError(reader_, count, "facets", facet);
      }
      int32_t marker = 0;
      if (is_poly_) {
        WELLSPACE_RETURN_IF_ERROR(ReadFacetHeader(line, markers == 1, marker));
        if (!reader_.NextContent(line)) {
          return reader_.EndError("the file ends; expected the polygon of the facet");
        }
      }
      WELLSPACE_RETURN_IF_ERROR(ReadPolygon(line, !is_poly_ && markers == 1, marker));
      if (absl::Status status = builder_.AddPolygon(corners_, marker, reader_.line_number()); !status.ok()) {
        return reader_.Error(std::string(status.message()));
      }
    }
    return absl::OkStatus();
  }

  // "polygons [holes] [marker]", of .poly. The marker may be missing, as it may for TetGen.
  absl::Status ReadFacetHeader(std::string_view line, bool has_marker, int32_t& marker) {
    FieldSplitter fields(line, ' ');
    std::string_view field;
    std::array<uint64_t, 2> counts{};  // polygons, holes
    constexpr std::array kNames = {"number of polygons", "number of holes"};
    for (size_t i = 0; i < counts.size(); ++i) {
      if (!fields.Next(field)) {
        break;  // there may be no holes
      }
      if (!ParseUnsigned(field, kMaxCount, counts[i])) {
        return reader_.Error(
            absl::StrCat("expected the ", kNames[i], ", a whole number below 2^32, got ", Quote(field)));
      }
    }
    if (counts != std::array<uint64_t, 2>{1, 0}) {
      return reader_.Error(absl::StrCat(
          "expected a facet of one polygon without holes, got ", counts[0], counts[0] == 1 ? " polygon" : " polygons",
          " and ", counts[1], counts[1] == 1 ? " hole" : " holes",
          "; cut it into polygons without holes, or into triangles, as tetgen -p writes them to a .smesh"));
    }
    if (has_marker && fields.Next(field)) {
      if (absl::Status status = ReadMarker(field, marker); !status.ok()) {
        return reader_.Error(absl::StrCat("marker: ", status.message()));
      }
    }
    return ExpectNoMore(reader_, fields,
                        has_marker ? "the numbers of polygons and holes and a marker"
                                   : "the numbers of polygons and holes, and no marker, as the header says");
  }

  // "corners corner … [marker]"
  absl::Status ReadPolygon(std::string_view line, bool has_marker, int32_t& marker) {
    FieldSplitter fields(line, ' ');
    std::string_view field;
    uint64_t count = 0;
    if (!fields.Next(field) || !ParseUnsigned(field, kMaxCount, count)) {
      return reader_.Error(absl::StrCat("expected the number of a polygon's corners, got ", Quote(field)));
    }
    corners_.clear();
    for (uint64_t corner = 0; corner < count; ++corner) {
      // The corners of a polygon may take more lines than one.
      while (!fields.Next(field)) {
        std::string_view next;
        if (!reader_.NextContent(next)) {
          return reader_.EndError(absl::StrCat("the file ends; expected ", count, " corners, got ", corner));
        }
        fields = FieldSplitter(next, ' ');
      }
      uint32_t point = 0;
      WELLSPACE_RETURN_IF_ERROR(ReadPolyPoint(reader_, field, index_base_, surface_.point_count(), "facet", point));
      corners_.push_back(point);
    }
    if (has_marker && fields.Next(field)) {
      if (absl::Status status = ReadMarker(field, marker); !status.ok()) {
        return reader_.Error(absl::StrCat("marker: ", status.message()));
      }
    }
    return ExpectNoMore(reader_, fields,
                        absl::StrCat(count, has_marker ? " corners and a marker" : " corners, and no marker"));
  }

  absl::Status ReadSeeds() {
    uint64_t without_volume = 0;
    WELLSPACE_RETURN_IF_ERROR(ReadPolySeeds(reader_, 3, [&](const PolySeed& row) {
      surface_.seeds.push_back({.x = row.at[0],
                                .y = row.at[1],
                                .z = row.at[2],
                                .is_hole = row.is_hole,
                                .attribute = row.attribute,
                                .max_volume = row.largest.value_or(0)});
      surface_.places.front().seeds.Add(reader_.line_number());
      without_volume += row.is_hole || row.largest.has_value() ? 0 : 1;
    }));
    if (without_volume > 0) {
      surface_.notes.push_back(absl::StrCat(
          surface_.name, ": of ", without_volume, without_volume == 1 ? " region" : " regions",
          " the only number is taken for the attribute; a second one would be the largest volume of a tetrahedron"));
    }
    return absl::OkStatus();
  }

  LineReader reader_;
  const std::string& path_;
  const bool is_poly_;
  Surface& surface_;
  SurfaceBuilder builder_;
  uint64_t index_base_ = 0;        // of the points
  std::vector<uint32_t> corners_;  // of the polygon that is read
};

absl::Status ReadFacetsOf(InputFile& file, const std::string& path, bool is_poly, Surface& surface) {
  surface.solids = Surface::SolidRule::kHoles;
  return FacetReader(file, path, is_poly, surface).Read();
}

}  // namespace

absl::Status ReadSmesh(InputFile& file, const std::string& path, Surface& surface) {
  return ReadFacetsOf(file, path, /*is_poly=*/false, surface);
}

absl::Status ReadPolySurface(InputFile& file, const std::string& path, Surface& surface) {
  return ReadFacetsOf(file, path, /*is_poly=*/true, surface);
}

}  // namespace wellspace::formats
