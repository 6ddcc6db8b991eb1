// GeoJSON, RFC 7946, as its parser comes to each value.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/formats/domain/domain_readers.h"
#include "client/formats/domain/geojson_geometry.h"
#include "client/formats/domain/interior_point.h"
#include "client/formats/domain/json_source.h"
#include "client/formats/number.h"

namespace wellspace::formats {
namespace {

using nlohmann::json;

// Deeper nesting is no geometry and no property of one.
constexpr size_t kMaxNesting = 256;

// `text` of another program, cut off when long, with what cannot be printed escaped.
std::string Printable(std::string_view text) {
  constexpr size_t kShown = 300;
  return absl::StrReplaceAll(absl::CHexEscape({text.data(), std::min(text.size(), kShown)}),
                             {{"\\'", "'"}, {"\\\"", "\""}});
}

// Whether what the parser stopped at, the end of `token`, may be the start of NaN or an infinity.
bool IsLikeNan(std::string_view token) {
  token = token.substr(token.find_last_of(",[: \t\r\n") + 1);
  constexpr std::array<std::string_view, 8> kStarts = {"N", "na", "i", "I", "-N", "-n", "-i", "-I"};
  return std::find(kStarts.begin(), kStarts.end(), token) != kStarts.end();
}

// What an object of GeoJSON may have of those members that mean something.
enum class Member { kType, kFeatures, kGeometry, kGeometries, kCoordinates, kProperties, kForeign };
constexpr std::array<const char*, 6> kMemberNames = {"type",       "features",    "geometry",
                                                     "geometries", "coordinates", "properties"};

Member MemberOf(std::string_view name) {
  return static_cast<Member>(std::find(kMemberNames.begin(), kMemberNames.end(), name) - kMemberNames.begin());
}

// The types of objects: those of GeometryType, in its order, then the others.
constexpr std::array<const char*, 9> kTypeNames = {
    "Point",        "MultiPoint",         "LineString", "MultiLineString",  "Polygon",
    "MultiPolygon", "GeometryCollection", "Feature",    "FeatureCollection"};
constexpr int kGeometryTypes = 6;
enum ObjectType { kNoType = -1, kGeometryCollection = kGeometryTypes, kFeature, kFeatureCollection };

// The member that a type of object has to have.
Member ContentOf(int type) {
  switch (type) {
    case kFeatureCollection:
      return Member::kFeatures;
    case kFeature:
      return Member::kGeometry;
    case kGeometryCollection:
      return Member::kGeometries;
    default:
      return Member::kCoordinates;
  }
}

// Where an object of GeoJSON may stand.
enum class Role { kTop, kFeature, kGeometry };

// A container of GeoJSON that is open. Those of "coordinates" and of foreign members are not among them.
struct Level {
  enum Kind { kObject, kFeatures, kGeometries, kProperties } kind = kObject;
  uint64_t line = 0;   // where it starts
  uint64_t index = 0;  // of the element that comes, of an array
  // Of an object:
  Role role = Role::kTop;
  Member member = Member::kForeign;  // the last key
  int type = kNoType;
  std::array<bool, 7> has{};  // by Member
  // Of a feature: what the properties say, and what the domain had before.
  std::optional<double> region = std::nullopt;
  std::optional<int32_t> marker = std::nullopt;
  uint64_t first_segment = 0;
  size_t first_place = 0;
};

// What the parser calls; true goes on, false ends it, and status() says why.
class GeoJsonReader {
 public:
  GeoJsonReader(JsonSource& source, const DomainOptions& options, PlanarDomain& domain)
      : source_(source), options_(options), domain_(domain) {}

  bool null() { return Scalar("null", nullptr); }
  bool boolean(bool value) { return Scalar(value ? "true" : "false", nullptr); }
  bool number_integer(int64_t value) {
    // Only numbers with a sign come here: 0 is -0.
    return Number(value == 0 ? -0.0 : static_cast<double>(value));
  }
  bool number_unsigned(uint64_t value) { return Number(static_cast<double>(value)); }
  bool number_float(double value, const std::string& /*text*/) { return Number(value); }
  bool string(std::string& value) { return Scalar({}, &value); }
  bool binary(json::binary_t& /*value*/) { return Fail("expected text"); }
  bool start_object(size_t /*elements*/);
  bool key(std::string& name);
  bool end_object();
  bool start_array(size_t /*elements*/);
  bool end_array();
  bool parse_error(size_t position, const std::string& last_token, const json::exception& exception);

  const absl::Status& status() const { return status_; }
  // To be called at the end of the file.
  void Finish();

 private:
  bool Number(double value);
  // Null, a boolean or, if it is not null, a string.
  bool Scalar(std::string_view text, const std::string* string);
  bool Property(const double* number, std::string_view text);
  bool TakeType(const std::string& name);
  bool StartObjectIn(Level& parent);
  bool StartArrayIn(Level& object);
  bool Skip() { return ++foreign_depth_ + levels_.size() <= kMaxNesting || FailNesting(); }
  bool EndGeoJsonObject();
  bool EndGeometry(const Level& object);
  bool EndFeature(const Level& feature);
  bool AddRegions(const Level& feature);
  // The value that has just ended is no more the element that comes.
  void EndValue();
  bool Has(Level& object, Member member);
  GeoJsonPlace Place(const Level& geometry);

  std::string Path() const;
  bool Fail(std::string_view message) { return FailAt(source_.line(), message); }
  bool FailAt(uint64_t line, std::string_view message);
  bool FailNesting() { return Fail(absl::StrCat("expected at most ", kMaxNesting, " nested values, got more")); }
  // "expected an object, got WHAT" for a value in the place that comes.
  bool FailKind(std::string_view got);
  void NoteFeatures();
  void NoteWidth();

  JsonSource& source_;
  const DomainOptions& options_;
  PlanarDomain& domain_;
  absl::Status status_;
  std::vector<Level> levels_;
  GeoJsonGeometry geometry_;
  size_t foreign_depth_ = 0;     // open containers that mean nothing
  std::string property_;         // the last key of "properties"
  uint64_t empty_ = 0;           // features and geometries without positions
  uint64_t without_region_ = 0;  // features with polygons
  uint64_t without_marker_ = 0;  // features with segments
  uint64_t flat_ = 0;            // polygons that are to have an attribute, and have no inside
};

std::string GeoJsonReader::Path() const {
  std::string path;
  for (const Level& level : levels_) {
    switch (level.kind) {
      case Level::kFeatures:
      case Level::kGeometries:
        absl::StrAppend(&path, "[", level.index, "]");
        break;
      case Level::kProperties:
        absl::StrAppend(&path, ".", Printable(std::string_view(property_).substr(0, 40)));
        break;
      case Level::kObject:
        if (level.member != Member::kForeign) {
          absl::StrAppend(&path, path.empty() ? "" : ".", kMemberNames[static_cast<size_t>(level.member)]);
        }
        break;
    }
  }
  return absl::StrCat(path, geometry_.Path());
}

bool GeoJsonReader::FailAt(uint64_t line, std::string_view message) {
  const std::string path = Path();
  status_ = LineError(domain_.name, line, absl::StrCat(path, path.empty() ? "" : ": ", std::string(message)));
  return false;
}

bool GeoJsonReader::FailKind(std::string_view got) {
  const char* expected = "an object of GeoJSON";
  if (!levels_.empty()) {
    const Level& level = levels_.back();
    if (geometry_.is_open()) {
      expected = "a number or an array of them";
    } else if (level.kind == Level::kFeatures) {
      expected = "a Feature";
    } else if (level.kind == Level::kGeometries) {
      expected = "a geometry";
    } else if (level.kind == Level::kObject) {
      expected = level.member == Member::kType       ? "a string"
                 : level.member == Member::kGeometry ? "a geometry or null"
                                                     : "an array";
    }
  }
  return Fail(absl::StrCat("expected ", expected, ", got ", std::string(got)));
}

void GeoJsonReader::EndValue() {
  if (levels_.empty()) {
    return;
  }
  Level& level = levels_.back();
  ++level.index;
  if (level.kind == Level::kObject) {
    level.member = Member::kForeign;
  }
}

bool GeoJsonReader::Has(Level& object, Member member) {
  bool& has = object.has[static_cast<size_t>(member)];
  if (has && member != Member::kForeign) {
    return Fail("expected it once, got it again");
  }
  has = true;
  return true;
}

bool GeoJsonReader::Number(double value) {
  if (foreign_depth_ > 0) {
    return true;
  }
  if (geometry_.is_open()) {
    const absl::Status status = geometry_.AddNumber(value);
    return status.ok() || Fail(std::string(status.message()));
  }
  std::string text;
  AppendNumber(value, text);
  if (!levels_.empty() && levels_.back().kind == Level::kProperties) {
    return Property(&value, text);
  }
  return Scalar(text, nullptr);
}

bool GeoJsonReader::Scalar(std::string_view text, const std::string* string) {
  if (foreign_depth_ > 0) {
    return true;
  }
  const std::string shown = string != nullptr ? Quote(*string) : std::string(text);
  if (levels_.empty() || geometry_.is_open()) {
    return FailKind(shown);
  }
  Level& level = levels_.back();
  if (level.kind == Level::kProperties) {
    return Property(nullptr, shown);
  }
  if (level.kind != Level::kObject) {
    return FailKind(shown);
  }
  switch (level.member) {
    case Member::kForeign:
    case Member::kProperties:
      break;
    case Member::kType:
      if (string == nullptr) {
        return FailKind(shown);
      }
      if (!TakeType(*string)) {
        return false;
      }
      break;
    case Member::kGeometry:
      if (text != "null") {
        return FailKind(shown);
      }
      ++empty_;
      break;
    default:
      return FailKind(shown);
  }
  EndValue();
  return true;
}

bool GeoJsonReader::TakeType(const std::string& name) {
  Level& object = levels_.back();
  const auto at = std::find(kTypeNames.begin(), kTypeNames.end(), name);
  const int type = static_cast<int>(at - kTypeNames.begin());
  size_t first = 0;
  size_t last = kTypeNames.size();
  if (object.role == Role::kFeature) {
    first = kFeature;
    last = kFeature + 1;
  } else if (object.role == Role::kGeometry) {
    last = kFeature;
  }
  if (at < kTypeNames.begin() + first || at >= kTypeNames.begin() + last) {
    std::string accepted;
    for (size_t i = first; i < last; ++i) {
      absl::StrAppend(&accepted, i == first ? "" : i + 1 == last ? " or " : ", ", kTypeNames[i]);
    }
    return Fail(absl::StrCat("expected ", accepted, ", got ", Quote(name)));
  }
  object.type = type;
  return true;
}

bool GeoJsonReader::Property(const double* number, std::string_view text) {
  Level& feature = levels_[levels_.size() - 2];
  if (text == "null" && number == nullptr) {
    return true;
  }
  if (!options_.region_property.empty() && property_ == options_.region_property) {
    if (number == nullptr) {
      return Fail(absl::StrCat("expected a number for the attribute of the region, got ", std::string(text)));
    }
    feature.region = *number;
  }
  if (!options_.marker_property.empty() && property_ == options_.marker_property) {
    constexpr double kLimit = 2147483648.0;
    if (number == nullptr || *number != std::floor(*number) || *number < -kLimit || *number >= kLimit) {
      return Fail(
          absl::StrCat("expected a whole number from -2^31 to below 2^31 for the marker, got ", std::string(text)));
    }
    feature.marker = static_cast<int32_t>(*number);
  }
  return true;
}

bool GeoJsonReader::start_object(size_t /*elements*/) {
  if (foreign_depth_ > 0) {
    return Skip();
  }
  if (geometry_.is_open()) {
    return FailKind("an object");
  }
  if (levels_.size() >= kMaxNesting) {
    return FailNesting();
  }
  if (levels_.empty()) {
    levels_.push_back({.kind = Level::kObject, .line = source_.line()});
    return true;
  }
  return StartObjectIn(levels_.back());
}

bool GeoJsonReader::StartObjectIn(Level& parent) {
  Role role = Role::kGeometry;
  switch (parent.kind) {
    case Level::kProperties:
      return Property(nullptr, "an object") && Skip();
    case Level::kFeatures:
      role = Role::kFeature;
      break;
    case Level::kGeometries:
      break;
    case Level::kObject:
      if (parent.member == Member::kForeign) {
        return Skip();
      }
      if (parent.member == Member::kProperties) {
        levels_.push_back({.kind = Level::kProperties, .line = source_.line()});
        return true;
      }
      if (parent.member != Member::kGeometry) {
        return FailKind("an object");
      }
      break;
  }
  levels_.push_back({.kind = Level::kObject,
                     .line = source_.line(),
                     .role = role,
                     .first_segment = domain_.segment_count(),
                     .first_place = domain_.places.size()});
  return true;
}

bool GeoJsonReader::key(std::string& name) {
  if (foreign_depth_ > 0) {
    return true;
  }
  Level& level = levels_.back();
  if (level.kind == Level::kProperties) {
    property_ = name;
    return true;
  }
  level.member = MemberOf(name);
  return Has(level, level.member);
}

bool GeoJsonReader::end_object() {
  if (foreign_depth_ > 0) {
    --foreign_depth_;
  } else if (levels_.back().kind == Level::kProperties) {
    levels_.pop_back();
  } else if (!EndGeoJsonObject()) {
    return false;
  }
  if (foreign_depth_ == 0) {
    EndValue();
  }
  return true;
}

bool GeoJsonReader::start_array(size_t /*elements*/) {
  if (foreign_depth_ > 0) {
    return Skip();
  }
  if (geometry_.is_open()) {
    const absl::Status status = geometry_.StartArray(source_.line());
    return status.ok() || Fail(std::string(status.message()));
  }
  if (levels_.size() >= kMaxNesting) {
    return FailNesting();
  }
  if (levels_.empty()) {
    return FailKind("an array");
  }
  Level& level = levels_.back();
  if (level.kind == Level::kProperties) {
    return Property(nullptr, "an array") && Skip();
  }
  return level.kind == Level::kObject ? StartArrayIn(level) : FailKind("an array");
}

bool GeoJsonReader::StartArrayIn(Level& object) {
  switch (object.member) {
    case Member::kFeatures:
      levels_.push_back({.kind = Level::kFeatures, .line = source_.line()});
      return true;
    case Member::kGeometries:
      levels_.push_back({.kind = Level::kGeometries, .line = source_.line()});
      return true;
    case Member::kCoordinates:
      return geometry_.StartArray(source_.line()).ok();
    case Member::kForeign:
    case Member::kProperties:
      return Skip();
    default:
      return FailKind("an array");
  }
}

bool GeoJsonReader::end_array() {
  if (foreign_depth_ > 0) {
    --foreign_depth_;
  } else if (geometry_.is_open()) {
    if (const absl::Status status = geometry_.EndArray(); !status.ok()) {
      return Fail(std::string(status.message()));
    }
    if (geometry_.is_open()) {
      return true;
    }
  } else {
    levels_.pop_back();
  }
  if (foreign_depth_ == 0) {
    EndValue();
  }
  return true;
}

bool GeoJsonReader::EndGeoJsonObject() {
  Level object = levels_.back();
  levels_.back().member = Member::kForeign;
  if (object.type == kNoType) {
    return FailAt(object.line, "expected an object of GeoJSON, with a \"type\", got one without");
  }
  const Member wanted = ContentOf(object.type);
  for (const Member member : {Member::kFeatures, Member::kGeometry, Member::kGeometries, Member::kCoordinates}) {
    if (object.has[static_cast<size_t>(member)] != (member == wanted)) {
      return FailAt(object.line, absl::StrCat("expected ", member == wanted ? "" : "no ", "\"",
                                              kMemberNames[static_cast<size_t>(member)], "\" in a ",
                                              kTypeNames[object.type], member == wanted ? ", got none" : ""));
    }
  }
  levels_.pop_back();
  if (object.type < kGeometryTypes) {
    return EndGeometry(object);
  }
  return object.type != kFeature || EndFeature(object);
}

// The place of a geometry whose level is closed.
GeoJsonPlace GeoJsonReader::Place(const Level& geometry) {
  GeoJsonPlace place = {.line = geometry.line};
  std::string chain;
  for (const Level& level : levels_) {
    if (level.kind == Level::kFeatures) {
      place.feature = static_cast<uint32_t>(level.index);
    } else if (level.kind == Level::kGeometries) {
      absl::StrAppend(&chain, "geometries[", level.index, "].");
    } else if (level.kind == Level::kObject && level.member == Member::kGeometry) {
      place.is_feature = true;
    }
  }
  if (!chain.empty()) {
    place.collection = static_cast<uint32_t>(domain_.collections.size());
    domain_.collections.push_back(std::move(chain));
  }
  return place;
}

bool GeoJsonReader::EndGeometry(const Level& object) {
  const GeoJsonPlace place = Place(object);
  bool is_empty = false;
  status_ = geometry_.MoveTo(static_cast<GeometryType>(object.type), place, domain_, is_empty);
  empty_ += is_empty ? 1 : 0;
  return status_.ok();
}

bool GeoJsonReader::EndFeature(const Level& feature) {
  const uint64_t segments = domain_.segment_count();
  if (feature.marker) {
    domain_.markers.resize(feature.first_segment);
    domain_.markers.resize(segments, *feature.marker);
  }
  without_marker_ += !feature.marker && segments > feature.first_segment ? 1 : 0;
  return AddRegions(feature);
}

// Adds a seed in each polygon of a feature.
bool GeoJsonReader::AddRegions(const Level& feature) {
  bool has_polygons = false;
  for (size_t at = feature.first_place; at < domain_.places.size();) {
    const size_t outer = at++;
    if (domain_.places[outer].ring == GeoJsonPlace::kNone) {
      continue;
    }
    has_polygons = true;
    while (at < domain_.places.size() && domain_.places[at].ring != GeoJsonPlace::kNone &&
           domain_.places[at].ring > 0) {
      ++at;
    }
    if (!feature.region) {
      continue;
    }
    const uint64_t first = domain_.places[outer].first_point;
    const uint64_t end = at < domain_.places.size() ? domain_.places[at].first_point : domain_.point_count();
    std::vector<size_t> starts;
    for (size_t ring = outer; ring < at; ++ring) {
      starts.push_back(domain_.places[ring].first_point - first);
    }
    const auto point =
        InteriorPoint(std::span<const double>(domain_.points).subspan(2 * first, 2 * (end - first)), starts);
    if (!point) {
      ++flat_;
      continue;
    }
    domain_.seeds.push_back({.x = (*point)[0], .y = (*point)[1], .attribute = *feature.region});
    domain_.seed_places.push_back(static_cast<uint32_t>(outer));
  }
  without_region_ += has_polygons && !feature.region ? 1 : 0;
  return true;
}

bool GeoJsonReader::parse_error(size_t /*position*/, const std::string& last_token, const json::exception& exception) {
  if (!source_.status().ok()) {
    status_ = source_.status();
    return false;
  }
  constexpr int kOutOfRange = 406;
  const std::string token = last_token.substr(last_token.size() > 60 ? last_token.size() - 60 : 0);
  if (exception.id == kOutOfRange) {
    return Fail(absl::StrCat("expected a number of magnitude below 1.8e308, got ", Quote(token)));
  }
  // "[json.exception.parse_error.101] parse error at line 1, column 2: syntax error while parsing …"
  constexpr std::string_view kMark = "syntax error ";
  std::string what = exception.what();
  if (const size_t mark = what.find(kMark); mark != std::string::npos) {
    what.erase(0, mark + kMark.size());
  }
  return Fail(absl::StrCat("expected JSON: ", Printable(what),
                           IsLikeNan(last_token) ? " (JSON has neither NaN nor infinities)" : ""));
}

void GeoJsonReader::NoteFeatures() {
  const auto note = [this](uint64_t count, std::string_view one, std::string_view more) {
    if (count > 0) {
      domain_.notes.push_back(absl::StrCat(domain_.name, ": ", count, std::string(count == 1 ? one : more)));
    }
  };
  note(empty_, " geometry is null or has no positions", " geometries are null or have no positions");
  if (!options_.region_property.empty()) {
    const std::string name = Quote(options_.region_property);
    note(without_region_, absl::StrCat(" feature with polygons has no property ", name, ", and gets no region"),
         absl::StrCat(" features with polygons have no property ", name, ", and get no regions"));
    note(flat_, " polygon has no inside, and gets no region", " polygons have no inside, and get no regions");
  }
  if (!options_.marker_property.empty()) {
    const std::string name = Quote(options_.marker_property);
    note(without_marker_, absl::StrCat(" feature has no property ", name, ", and its segments the marker 0"),
         absl::StrCat(" features have no property ", name, ", and their segments the marker 0"));
  }
}

// Longitudes that go around the world are no coordinates of one plane.
void GeoJsonReader::NoteWidth() {
  constexpr double kHalfTurn = 180;
  double low = INFINITY;
  double high = -INFINITY;
  for (size_t i = 0; i < domain_.points.size(); i += 2) {
    low = std::min(low, domain_.points[i]);
    high = std::max(high, domain_.points[i]);
    if (std::abs(domain_.points[i]) > 2 * kHalfTurn || std::abs(domain_.points[i + 1]) > kHalfTurn / 2) {
      return;  // these are no longitudes and latitudes
    }
  }
  if (high - low > kHalfTurn) {
    domain_.notes.push_back(absl::StrCat(domain_.name, ": longitudes span ", high - low,
                                         " degrees; they are taken as coordinates of a plane, in which both sides of "
                                         "the 180th meridian are far apart, and triangles near the poles are not what "
                                         "they are on the sphere"));
  }
}

void GeoJsonReader::Finish() {
  domain_.markers.resize(domain_.segment_count());
  const auto has = [this](uint8_t value) {
    return std::find(domain_.is_line.begin(), domain_.is_line.end(), value) != domain_.is_line.end();
  };
  if (!has(0) || !has(1)) {
    domain_.is_line.clear();
  }
  domain_.segment_lines = {};  // places say where segments are
  NoteFeatures();
  NoteWidth();
}

}  // namespace

absl::Status ReadGeoJson(InputFile& file, const DomainOptions& options, PlanarDomain& domain) {
  JsonSource source(file);
  GeoJsonReader reader(source, options, domain);
  const bool is_parsed = json::sax_parse(source.begin(), source.end(), &reader);
  if (!source.status().ok()) {
    return source.status();
  }
  if (!is_parsed) {
    return reader.status();
  }
  if (!source.IsAtEnd()) {  // the parser takes a byte 0 for the end
    return LineError(domain.name, source.line(), "expected the end of the file, got a byte 0");
  }
  reader.Finish();
  return absl::OkStatus();
}

}  // namespace wellspace::formats
