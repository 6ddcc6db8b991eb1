// GeoJSON, RFC 7946, as its parser comes to each value; and sequences of its texts, RFC 8142.
#include <algorithm>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/formats/domain/domain_readers.h"
#include "client/formats/domain/geojson_features.h"
#include "client/formats/domain/geojson_geometry.h"
#include "client/formats/domain/geojson_objects.h"
#include "client/formats/domain/json_source.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

using nlohmann::json;

using Level = GeoJsonLevel;
using Member = GeoJsonMember;
using Role = GeoJsonRole;

// Deeper nesting is no geometry and no property of one.
constexpr size_t kMaxNesting = 256;

// `text` of another program, cut off when long, with unprintable characters escaped.
std::string Printable(std::string_view text) {
  constexpr size_t kShown = 300;
  return absl::StrReplaceAll(absl::CHexEscape({text.data(), std::min(text.size(), kShown)}),
                             {{"\\'", "'"}, {"\\\"", "\""}});
}

// Whether the end of `token`, at which the parser stopped, may be the start of NaN or an infinity.
bool IsLikeNan(std::string_view token) {
  token = token.substr(token.find_last_of(",[: \t\r\n") + 1);
  constexpr std::array<std::string_view, 8> kStarts = {"N", "na", "i", "I", "-N", "-n", "-i", "-I"};
  return std::find(kStarts.begin(), kStarts.end(), token) != kStarts.end();
}

// The callbacks of the parser; true goes on, false ends it, and status() says why.
class GeoJsonReader {
 public:
  // `is_sequence`: the file is one of texts, of which each is a feature by itself.
  GeoJsonReader(JsonSource& source, const DomainOptions& options, bool is_sequence, PlanarDomain& domain)
      : source_(source), is_sequence_(is_sequence), domain_(domain), features_(options, domain) {}

  bool null() { return Scalar("null", nullptr); }
  bool boolean(bool value) { return Scalar(value ? "true" : "false", nullptr); }
  bool number_integer(int64_t value) {
    // Only numbers with a sign come here: 0 is -0.
    return Number(value == 0 ? -0.0 : static_cast<double>(value), std::to_string(value));
  }
  bool number_unsigned(uint64_t value) { return Number(static_cast<double>(value), std::to_string(value)); }
  bool number_float(double value, const std::string& text) { return Number(value, text); }
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
  void Finish() { features_.Finish(); }

 private:
  // `text`: as it is written, or the whole number that it is.
  bool Number(double value, const std::string& text);
  // Null, a boolean or, if it is not null, a string.
  bool Scalar(std::string_view text, const std::string* string);
  bool Property(const GeoJsonFeatures::Value& value);
  bool TakeType(const std::string& name);
  bool StartObjectIn(Level& parent);
  bool StartArrayIn(Level& object);
  bool Skip() { return ++foreign_depth_ + levels_.size() <= kMaxNesting || FailNesting(); }
  bool EndGeoJsonObject();
  bool EndGeometry(const Level& object);
  // The value that has just ended is no more the element that comes.
  void EndValue();
  bool Has(Level& object, Member member);

  std::string Path() const;
  bool Fail(std::string_view message) { return FailAt(source_.line(), message); }
  bool FailAt(uint64_t line, std::string_view message);
  bool FailNesting() { return Fail(absl::StrCat("expected at most ", kMaxNesting, " nested values, got more")); }
  // "expected an object, got WHAT" for a value in the place that comes.
  bool FailKind(std::string_view got);

  JsonSource& source_;
  const bool is_sequence_;
  PlanarDomain& domain_;
  absl::Status status_;
  std::vector<Level> levels_;
  GeoJsonGeometry geometry_;
  GeoJsonFeatures features_;
  size_t foreign_depth_ = 0;  // open containers that mean nothing
  std::string property_;      // the last key of "properties"
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
          absl::StrAppend(&path, path.empty() ? "" : ".", kGeoJsonMembers[static_cast<size_t>(level.member)]);
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

bool GeoJsonReader::Number(double value, const std::string& written) {
  if (foreign_depth_ > 0) {
    return true;
  }
  if (geometry_.is_open()) {
    if (IsRoundedWhole(written, value) && domain_.rounded_numbers++ == 0) {
      domain_.first_rounded = absl::StrCat(written, " at ", Path());
    }
    const absl::Status status = geometry_.AddNumber(value);
    return status.ok() || Fail(std::string(status.message()));
  }
  std::string text;
  AppendNumber(value, text);
  if (!levels_.empty() && levels_.back().kind == Level::kProperties) {
    if (IsRoundedWhole(written, value)) {
      const std::string rounded = absl::StrCat(written, ", which no double is");
      return Property({.text = rounded});
    }
    return Property({.number = &value, .text = text});
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
    return Property({.string = string, .text = shown});
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
      features_.CountEmpty();
      break;
    default:
      return FailKind(shown);
  }
  EndValue();
  return true;
}

bool GeoJsonReader::TakeType(const std::string& name) {
  Level& object = levels_.back();
  std::string accepted;
  const int type = GeoJsonTypeOf(name, object.role, accepted);
  if (type == kNoType) {
    return Fail(absl::StrCat("expected ", accepted, ", got ", Quote(name)));
  }
  object.type = type;
  return true;
}

bool GeoJsonReader::Property(const GeoJsonFeatures::Value& value) {
  const absl::Status status = features_.TakeProperty(levels_[levels_.size() - 2], property_, value);
  return status.ok() || Fail(std::string(status.message()));
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
    levels_.push_back({.kind = Level::kObject,
                       .line = source_.line(),
                       .first_segment = domain_.segment_count(),
                       .first_place = domain_.places.size()});
    return true;
  }
  return StartObjectIn(levels_.back());
}

bool GeoJsonReader::StartObjectIn(Level& parent) {
  Role role = Role::kGeometry;
  switch (parent.kind) {
    case Level::kProperties:
      return Property({.text = "an object"}) && Skip();
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
  level.member = GeoJsonMemberOf(name);
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
    return Property({.text = "an array"}) && Skip();
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
  if (const std::string wrong = WrongMembers(object); !wrong.empty()) {
    return FailAt(object.line, wrong);
  }
  levels_.pop_back();
  if (object.type < kGeoJsonGeometryTypes && !EndGeometry(object)) {
    return false;
  }
  const bool is_text_of_geometry = is_sequence_ && levels_.empty() && object.type < kFeature;
  if (object.type == kFeature || is_text_of_geometry) {
    features_.End(object);
  }
  return true;
}

bool GeoJsonReader::EndGeometry(const Level& object) {
  const GeoJsonPlace place = GeoJsonPlaceOf(object, levels_, domain_);
  bool is_empty = false;
  status_ = geometry_.MoveTo(static_cast<GeometryType>(object.type), place, domain_, is_empty);
  if (is_empty) {
    features_.CountEmpty();
  }
  return status_.ok();
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

}  // namespace

absl::Status ReadGeoJson(InputFile& file, const DomainOptions& options, PlanarDomain& domain) {
  JsonSource source(file);
  GeoJsonReader reader(source, options, /*is_sequence=*/false, domain);
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

absl::Status ReadGeoJsonLines(InputFile& file, const DomainOptions& options, PlanarDomain& domain) {
  // The bytes that may stand between texts; the last is the separator of RFC 8142.
  constexpr std::string_view kBetween = " \t\r\n\x1e";
  JsonSource source(file);
  GeoJsonReader reader(source, options, /*is_sequence=*/true, domain);
  while (!source.IsAtEnd()) {
    if (JsonSource::Iterator at = source.begin(); kBetween.find(*at) != std::string_view::npos) {
      ++at;
      continue;
    }
    const bool is_parsed =
        json::sax_parse(source.begin(), source.end(), &reader, json::input_format_t::json, /*strict=*/false);
    if (source.status().ok() && !is_parsed) {
      return reader.status();
    }
  }
  WELLSPACE_RETURN_IF_ERROR(source.status());
  reader.Finish();
  return absl::OkStatus();
}

}  // namespace wellspace::formats
