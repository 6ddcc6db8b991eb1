// Well-known text of geometries: OGC 06-103r4, and PostGIS's SRID before it.
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
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

// The words of geometries; `depth` arrays are nested around a position, its own not counted.
struct WktType {
  std::string_view word;
  GeometryType type;
  int depth;
};
constexpr std::array kWktTypes = {
    WktType{"POINT", GeometryType::kPoint, 0},
    WktType{"MULTIPOINT", GeometryType::kMultiPoint, 1},
    WktType{"LINESTRING", GeometryType::kLineString, 1},
    WktType{"LINEARRING", GeometryType::kLineString, 1},
    WktType{"MULTILINESTRING", GeometryType::kMultiLineString, 2},
    WktType{"POLYGON", GeometryType::kPolygon, 2},
    WktType{"TRIANGLE", GeometryType::kPolygon, 2},
    WktType{"MULTIPOLYGON", GeometryType::kMultiPolygon, 3},
};
constexpr std::string_view kCollection = "GEOMETRYCOLLECTION";

class WktReader {
 public:
  WktReader(InputFile& file, const DomainOptions& options, PlanarDomain& domain)
      : source_(file), domain_(domain), features_(options, domain) {}

  absl::Status Read() {
    WELLSPACE_RETURN_IF_ERROR(Next());
    while (!token_.empty()) {
      if (token_ == ";") {
        WELLSPACE_RETURN_IF_ERROR(Next());
        continue;
      }
      GeoJsonLevel feature{
          .line = line_, .first_segment = domain_.segment_count(), .first_place = domain_.places.size()};
      WELLSPACE_RETURN_IF_ERROR(SkipSrid());
      WELLSPACE_RETURN_IF_ERROR(ReadGeometry());
      features_.End(feature);
    }
    features_.Finish();
    return absl::OkStatus();
  }

 private:
  // Collections in collections; no file in use has more.
  static constexpr size_t kMaxNesting = 32;

  absl::Status Error(std::string_view message) const { return LineError(domain_.name, line_, message); }
  // `status` of the geometry, with the line.
  absl::Status Located(const absl::Status& status) const {
    return status.ok() ? status : Error({status.message().data(), status.message().size()});
  }
  absl::Status Expected(std::string_view what) const {
    return Error(absl::StrCat("expected ", std::string(what), ", got ", token_.empty() ? "the end" : Quote(token_)));
  }
  bool IsWord(std::string_view word) const {
    return absl::EqualsIgnoreCase(absl::string_view(token_), absl::string_view(word.data(), word.size()));
  }

  // The next word, number or mark; empty at the end of the file.
  absl::Status Next() {
    constexpr std::string_view kMarks = "(),;=";
    constexpr size_t kMaxToken = 400;  // digits of a number
    token_.clear();
    JsonSource::Iterator at = source_.begin();
    for (bool is_comment = false; !source_.IsAtEnd(); ++at) {
      is_comment = *at == '#' || (is_comment && *at != '\n' && *at != '\r');
      if (!is_comment && !absl::ascii_isspace(static_cast<unsigned char>(*at))) {
        break;
      }
    }
    bool is_first = true;
    while (!source_.IsAtEnd()) {
      const char c = *at;
      const bool is_mark = kMarks.find(c) != std::string_view::npos;
      if (absl::ascii_isspace(static_cast<unsigned char>(c)) || (is_mark && !is_first)) {
        break;
      }
      ++at;
      line_ = is_first ? source_.line() : line_;
      is_first = false;
      token_ += c;
      if (is_mark) {
        break;
      }
      if (token_.size() > kMaxToken) {
        return Error(absl::StrCat("expected a word or a number, got ", Quote(token_)));
      }
    }
    return source_.status();
  }

  // "SRID=4326;"
  absl::Status SkipSrid() {
    if (!IsWord("SRID")) {
      return absl::OkStatus();
    }
    for (const char* expected : {"=", "", ";"}) {
      WELLSPACE_RETURN_IF_ERROR(Next());
      uint64_t number = 0;
      if (*expected == '\0' ? !ParseUnsigned(token_, kMaxCount, number) : token_ != expected) {
        return Expected(*expected == '\0' ? "the number of a reference system" : Quote(expected));
      }
    }
    return Next();
  }

  absl::Status ReadGeometry() {
    const uint64_t line = line_;
    // "POINTZ" is "POINT Z".
    std::string word = absl::AsciiStrToUpper(token_);
    const auto type_of = [&word] {
      return std::find_if(kWktTypes.begin(), kWktTypes.end(), [&word](const WktType& t) { return t.word == word; });
    };
    auto type = type_of();
    for (const char* suffix : {"ZM", "Z", "M"}) {
      if (type == kWktTypes.end() && word != std::string(kCollection) && absl::EndsWith(word, suffix)) {
        word.resize(word.size() - std::string_view(suffix).size());
        type = type_of();
        word += type == kWktTypes.end() && word != std::string(kCollection) ? suffix : "";
      }
    }
    const bool is_collection = word == std::string(kCollection);
    if (type == kWktTypes.end() && !is_collection) {
      return Expected(absl::StrCat("a geometry of well-known text, one of ", Types()));
    }
    WELLSPACE_RETURN_IF_ERROR(Next());
    if (IsWord("Z") || IsWord("M") || IsWord("ZM")) {
      WELLSPACE_RETURN_IF_ERROR(Next());
    }
    if (IsWord("EMPTY")) {
      features_.CountEmpty();
      return Next();
    }
    if (token_ != "(") {
      return Expected("\"(\" or EMPTY");
    }
    if (is_collection) {
      return ReadCollection();
    }
    WELLSPACE_RETURN_IF_ERROR(type->depth == 0 ? ReadPosition() : ReadList(type->depth, type->type));
    return MoveGeometry(type->type, line);
  }

  absl::Status MoveGeometry(GeometryType type, uint64_t line) {
    GeoJsonPlace place{.line = line};
    if (!collection_.empty()) {
      std::string path;
      for (const uint64_t index : collection_) {
        absl::StrAppend(&path, "geometries[", index, "].");
      }
      place.collection = static_cast<uint32_t>(domain_.collections.size());
      domain_.collections.push_back(std::move(path));
    }
    bool is_empty = false;
    WELLSPACE_RETURN_IF_ERROR(geometry_.MoveTo(type, place, domain_, is_empty));
    if (is_empty) {
      features_.CountEmpty();
    }
    return absl::OkStatus();
  }

  // Geometries between "(", which stands here, and ")".
  absl::Status ReadCollection() {
    if (collection_.size() == kMaxNesting) {
      return Error(absl::StrCat("expected at most ", kMaxNesting, " nested collections, got more"));
    }
    collection_.push_back(0);
    do {
      WELLSPACE_RETURN_IF_ERROR(Next());
      WELLSPACE_RETURN_IF_ERROR(ReadGeometry());
      ++collection_.back();
    } while (token_ == ",");
    collection_.pop_back();
    return EndList();
  }

  // `depth` nested lists of positions, of which the outermost begins here, with "(".
  absl::Status ReadList(int depth, GeometryType type) {
    WELLSPACE_RETURN_IF_ERROR(Located(geometry_.StartArray(line_)));
    do {
      WELLSPACE_RETURN_IF_ERROR(Next());
      if (depth > 1 && IsWord("EMPTY")) {
        features_.CountEmpty();
        WELLSPACE_RETURN_IF_ERROR(Next());
      } else if (depth > 1 || (type == GeometryType::kMultiPoint && token_ == "(")) {
        if (token_ != "(") {
          return Expected("\"(\"");
        }
        WELLSPACE_RETURN_IF_ERROR(depth > 1 ? ReadList(depth - 1, type) : ReadPosition());
      } else if (type == GeometryType::kMultiPoint && IsWord("EMPTY")) {
        features_.CountEmpty();
        WELLSPACE_RETURN_IF_ERROR(Next());
      } else {
        WELLSPACE_RETURN_IF_ERROR(ReadNumbers());
      }
    } while (token_ == ",");
    WELLSPACE_RETURN_IF_ERROR(Located(geometry_.EndArray()));
    return EndList();
  }

  // A position between "(", which stands here, and ")".
  absl::Status ReadPosition() {
    WELLSPACE_RETURN_IF_ERROR(Next());
    WELLSPACE_RETURN_IF_ERROR(ReadNumbers());
    return EndList();
  }

  absl::Status EndList() { return token_ == ")" ? Next() : Expected("\",\" or \")\""); }

  // Two to four numbers.
  absl::Status ReadNumbers() {
    constexpr int kMost = 4;
    WELLSPACE_RETURN_IF_ERROR(Located(geometry_.StartArray(line_)));
    int count = 0;
    for (; count < kMost && token_ != "," && token_ != ")" && !token_.empty(); ++count) {
      double value = 0;
      WELLSPACE_RETURN_IF_ERROR(Located(ParseFinite(token_, value)));
      WELLSPACE_RETURN_IF_ERROR(Located(geometry_.AddNumber(value)));
      WELLSPACE_RETURN_IF_ERROR(Next());
    }
    if (count < 2) {
      return Expected("a position of 2 to 4 numbers");
    }
    return Located(geometry_.EndArray());
  }

  static std::string Types() {
    const auto append = [](std::string* out, const WktType& type) { out->append(type.word); };
    return absl::StrCat(absl::StrJoin(kWktTypes, ", ", append), ", ", std::string(kCollection));
  }

  JsonSource source_;
  PlanarDomain& domain_;
  GeoJsonFeatures features_;
  GeoJsonGeometry geometry_;
  std::string token_;
  uint64_t line_ = 1;                 // of the token
  std::vector<uint64_t> collection_;  // the index of the geometry that is read in each open collection
};

}  // namespace

absl::Status ReadWkt(InputFile& file, const DomainOptions& options, PlanarDomain& domain) {
  return WktReader(file, options, domain).Read();
}

}  // namespace wellspace::formats
