// TetGen's .smesh and 3-D .poly.
#include <algorithm>
#include <array>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/coordinate.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"
#include "client/formats/surface/surface_builder.h"
#include "client/formats/surface/surface_readers.h"
#include "client/formats/tetgen/poly_points.h"
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
    for (auto read : {&FacetReader::ReadFacets, &FacetReader::ReadHoles, &FacetReader::ReadRegions}) {
      std::string_view line;
      if (!reader_.NextContent(line)) {
        return reader_.Finish();  // every later part may be missing
      }
      WELLSPACE_RETURN_IF_ERROR((this->*read)(line));
    }
    WELLSPACE_RETURN_IF_ERROR(ExpectEnd(reader_, regions_, "regions"));
    return reader_.Finish();
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
    return ExpectNoMore(fields, has_marker ? "the numbers of polygons and holes and a marker"
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
    return ExpectNoMore(fields, absl::StrCat(count, has_marker ? " corners and a marker" : " corners, and no marker"));
  }

  absl::Status ReadHoles(std::string_view line) {
    std::array<uint64_t, 1> count{};
    constexpr std::array kNames = {"number of holes"};
    WELLSPACE_RETURN_IF_ERROR(ReadHeader(reader_, line, 1, kNames, count));
    uint64_t base = 0;
    for (uint64_t hole = 0; hole < count[0]; ++hole) {
      if (!reader_.NextContent(line)) {
        return CountError(reader_, count[0], "holes", hole);
      }
      FieldSplitter fields(line, ' ');
      WELLSPACE_RETURN_IF_ERROR(ReadIndex(reader_, fields, hole, base));
      Surface::Seed seed = {.is_hole = true};
      WELLSPACE_RETURN_IF_ERROR(ReadPlace(fields, seed));
      WELLSPACE_RETURN_IF_ERROR(ExpectNoMore(fields, "an index, x, y and z of a hole"));
      AddSeed(seed);
    }
    return absl::OkStatus();
  }

  absl::Status ReadRegions(std::string_view line) {
    constexpr std::array kNames = {"number of regions"};
    WELLSPACE_RETURN_IF_ERROR(ReadHeader(reader_, line, 1, kNames, {&regions_, 1}));
    uint64_t base = 0;
    uint64_t without_volume = 0;
    for (uint64_t region = 0; region < regions_; ++region) {
      if (!reader_.NextContent(line)) {
        return CountError(reader_, regions_, "regions", region);
      }
      FieldSplitter fields(line, ' ');
      WELLSPACE_RETURN_IF_ERROR(ReadIndex(reader_, fields, region, base));
      Surface::Seed seed;
      WELLSPACE_RETURN_IF_ERROR(ReadPlace(fields, seed));
      std::string_view field;
      if (!fields.Next(field)) {
        return reader_.Error("expected an index, x, y, z, an attribute and perhaps a largest volume, got no attribute");
      }
      if (absl::Status status = TakeFinite(field, seed.attribute); !status.ok()) {
        return reader_.Error(absl::StrCat("attribute: ", status.message()));
      }
      if (!fields.Next(field)) {
        ++without_volume;
      } else if (absl::Status status = TakeFinite(field, seed.max_volume); !status.ok()) {
        return reader_.Error(absl::StrCat("largest volume: ", status.message()));
      }
      seed.max_volume = std::max(seed.max_volume, 0.0);  // a negative one is none, as for TetGen
      WELLSPACE_RETURN_IF_ERROR(ExpectNoMore(fields, "an index, x, y, z, an attribute and a largest volume"));
      AddSeed(seed);
    }
    if (without_volume > 0) {
      surface_.notes.push_back(absl::StrCat(
          surface_.name, ": of ", without_volume, without_volume == 1 ? " region" : " regions",
          " the only number is taken for the attribute; a second one would be the largest volume of a tetrahedron"));
    }
    return absl::OkStatus();
  }

  absl::Status ReadPlace(FieldSplitter& fields, Surface::Seed& seed) {
    for (auto [coordinate, name] : {std::pair{&seed.x, "x"}, std::pair{&seed.y, "y"}, std::pair{&seed.z, "z"}}) {
      std::string_view field;
      if (!fields.Next(field)) {
        return reader_.Error(absl::StrCat("expected an index, x, y and z, got no ", name));
      }
      if (absl::Status status = TakeFinite(field, *coordinate); !status.ok()) {
        return reader_.Error(absl::StrCat(name, ": ", status.message()));
      }
    }
    return absl::OkStatus();
  }

  void AddSeed(const Surface::Seed& seed) {
    surface_.seeds.push_back(seed);
    surface_.seed_places.Add(reader_.line_number());
  }

  // An error where the fields of the line go on.
  absl::Status ExpectNoMore(FieldSplitter& fields, std::string_view expected) {
    std::string_view field;
    return fields.Next(field)
               ? reader_.Error(absl::StrCat("expected ", std::string(expected), ", got also ", Quote(field)))
               : absl::OkStatus();
  }

  LineReader reader_;
  const std::string& path_;
  const bool is_poly_;
  Surface& surface_;
  SurfaceBuilder builder_;
  uint64_t index_base_ = 0;  // of the points
  uint64_t regions_ = 0;
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
