#include "client/formats/domain/geojson_geometry.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/domain/polyline.h"
#include "client/formats/io/number.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// How many arrays each position of a geometry stands in, its own included.
int PositionDepth(GeometryType type) {
  switch (type) {
    case GeometryType::kPoint:
      return 1;
    case GeometryType::kMultiPoint:
    case GeometryType::kLineString:
      return 2;
    case GeometryType::kMultiLineString:
    case GeometryType::kPolygon:
      return 3;
    case GeometryType::kMultiPolygon:
      break;
  }
  return 4;
}

bool HasRings(GeometryType type) { return type == GeometryType::kPolygon || type == GeometryType::kMultiPolygon; }

// The place of the next part, a ring or a line or points, of a geometry.
GeoJsonPlace PlaceOfPart(GeometryType type, const GeoJsonPlace& geometry, uint32_t part, uint32_t ring) {
  GeoJsonPlace place = geometry;
  place.has_index = type != GeometryType::kPoint;
  if (type == GeometryType::kMultiLineString || type == GeometryType::kMultiPolygon) {
    place.part = part;
  }
  if (HasRings(type)) {
    place.ring = ring;
  }
  return place;
}

}  // namespace

const char* TypeName(GeometryType type) {
  switch (type) {
    case GeometryType::kPoint:
      return "Point";
    case GeometryType::kMultiPoint:
      return "MultiPoint";
    case GeometryType::kLineString:
      return "LineString";
    case GeometryType::kMultiLineString:
      return "MultiLineString";
    case GeometryType::kPolygon:
      return "Polygon";
    case GeometryType::kMultiPolygon:
      break;
  }
  return "MultiPolygon";
}

absl::Status GeoJsonGeometry::StartArray(uint64_t line) {
  if (numbers_ > 0) {
    return absl::InvalidArgumentError("expected a number, as the one before it, got an array");
  }
  if (depth_ == kMaxDepth) {
    return absl::InvalidArgumentError(
        absl::StrCat("expected at most ", kMaxDepth, " nested arrays, as a MultiPolygon has, got more"));
  }
  ++depth_;
  index_[depth_] = 0;
  lines_[depth_] = line;
  return absl::OkStatus();
}

absl::Status GeoJsonGeometry::AddNumber(double number) {
  if (numbers_ == 0) {
    if (index_[depth_] > 0) {
      return absl::InvalidArgumentError("expected an array, as the one before it, got a number");
    }
    if (position_depth_ == 0) {
      position_depth_ = depth_;
    } else if (position_depth_ != depth_) {
      return absl::InvalidArgumentError(absl::StrCat("expected each position in ", position_depth_,
                                                     position_depth_ == 1 ? " array" : " nested arrays",
                                                     ", as the first one is, got one in ", depth_));
    }
  }
  if (numbers_ < 2) {
    position_[numbers_] = number;
  }
  numbers_ = std::min(numbers_ + 1, 3);
  ++index_[depth_];
  return absl::OkStatus();
}

absl::Status GeoJsonGeometry::EndArray() {
  if (numbers_ == 1) {
    return absl::InvalidArgumentError("expected a position of at least 2 numbers, got 1");
  }
  if (numbers_ == 0) {
    closed_.push_back({depth_, lines_[depth_], positions_.size() / 2});
  } else {
    positions_.insert(positions_.end(), position_.begin(), position_.end());
    altitudes_ += numbers_ > 2 ? 1 : 0;
    numbers_ = 0;
  }
  --depth_;
  ++index_[depth_];
  return absl::OkStatus();
}

std::string GeoJsonGeometry::Path() const {
  std::string path;
  for (int depth = 1; depth <= depth_; ++depth) {
    absl::StrAppend(&path, "[", index_[depth], "]");
  }
  return path;
}

absl::Status GeoJsonGeometry::Error(const PlanarDomain& domain, const GeoJsonPlace& place, std::string_view message) {
  return LineError(domain.name, place.line,
                   absl::StrCat(PathOf(place, domain.collections), ": ", std::string(message)));
}

absl::Status GeoJsonGeometry::AddPart(GeometryType type, std::span<const double> positions, const GeoJsonPlace& place,
                                      PlanarDomain& domain, bool& is_flat) const {
  is_flat = false;
  if (type == GeometryType::kPoint || type == GeometryType::kMultiPoint) {
    if (positions.size() / 2 > kMaxCount - domain.point_count()) {
      return Error(domain, place, absl::StrCat("expected at most ", kMaxCount, " points, got more"));
    }
    domain.points.insert(domain.points.end(), positions.begin(), positions.end());
    for (size_t i = 0; i < positions.size() / 2; ++i) {
      domain.point_lines.Add(i);
    }
    return absl::OkStatus();
  }
  const bool is_ring = HasRings(type);
  if (is_ring ? IsFlat(positions) : CountDifferent(positions) < 2) {
    is_flat = true;
    return absl::OkStatus();
  }
  if (const absl::Status status = AddPolyline(positions, nullptr, is_ring, domain); !status.ok()) {
    return Error(domain, place, std::string(status.message()));
  }
  domain.is_line.resize(domain.segment_count(), is_ring ? 0 : 1);
  if (is_ring) {
    domain.faces = PlanarDomain::FaceRule::kUnion;
  }
  return absl::OkStatus();
}

absl::Status GeoJsonGeometry::MoveTo(GeometryType type, const GeoJsonPlace& geometry, PlanarDomain& domain,
                                     bool& is_empty) {
  const int wanted = PositionDepth(type);
  is_empty = positions_.empty();
  GeoJsonPlace place = geometry;
  if (position_depth_ != 0 && position_depth_ != wanted) {
    return Error(domain, place,
                 absl::StrCat("expected each position of a ", TypeName(type), " in ", wanted,
                              wanted == 1 ? " array" : " nested arrays", ", its own included, got ", position_depth_));
  }
  if (type == GeometryType::kPoint && !is_empty) {
    closed_.push_back({0, geometry.line, 1});  // its array is that of the numbers
  }
  uint64_t first = 0;
  uint32_t part = 0;
  uint32_t ring = 0;
  bool is_outer_flat = false;  // the outer ring of the polygon
  for (const Closed& closed : closed_) {
    place = PlaceOfPart(type, geometry, part, ring);
    place.line = closed.line;
    if (closed.depth >= wanted && closed.depth > 1) {
      return Error(domain, place, "expected a position of at least 2 numbers, got an empty array");
    }
    if (closed.depth == wanted - 1 && (closed.depth > 1 || closed.positions > 0)) {
      place.first_point = domain.point_count();
      place.first_segment = domain.segment_count();
      const std::span<const double> all = positions_;
      const std::span<const double> own = all.subspan(2 * first, 2 * (closed.positions - first));
      bool is_flat = true;
      is_outer_flat = is_outer_flat && ring > 0;
      if (!is_outer_flat) {  // the holes of nothing are nothing
        WELLSPACE_RETURN_IF_ERROR(AddPart(type, own, place, domain, is_flat));
      }
      if (is_flat) {
        is_outer_flat = is_outer_flat || (HasRings(type) && ring == 0);
        ++(HasRings(type) ? domain.flat_rings : domain.flat_lines);
        domain.first_flat = domain.first_flat.empty()
                                ? absl::StrCat(PathOf(place, domain.collections), " in line ", place.line)
                                : domain.first_flat;
      } else {
        domain.places.push_back(place);
      }
      first = closed.positions;
      (HasRings(type) ? ring : part) += 1;
    } else if (closed.depth == 2 && type == GeometryType::kMultiPolygon) {
      ++part;
      ring = 0;
    }
  }
  domain.altitudes += altitudes_;
  altitudes_ = 0;
  position_depth_ = 0;
  positions_.clear();
  closed_.clear();
  return absl::OkStatus();
}

}  // namespace wellspace::formats
