// The treatment of the features of a file of geometries: of the properties of GeoJSON's markers and regions, and of all
// notes on the file. Private to the readers of such files.
#ifndef WELLSPACE_CLIENT_FORMATS_DOMAIN_GEOJSON_FEATURES_H_
#define WELLSPACE_CLIENT_FORMATS_DOMAIN_GEOJSON_FEATURES_H_

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/domain/domain_readers.h"
#include "client/formats/domain/geojson_objects.h"

namespace wellspace::formats {

// Thread safety: thread-compatible.
class GeoJsonFeatures {
 public:
  // REQUIRES:   both outlive this.
  GeoJsonFeatures(const DomainOptions& options, PlanarDomain& domain) : options_(options), domain_(domain) {}

  // The value of a property: a number or a string, null if it is none; and the text that shows it.
  struct Value {
    const double* number = nullptr;
    const std::string* string = nullptr;
    std::string_view text;
  };
  // Takes the property `name` of a feature. Strings are names, which get numbers from 1 on.
  //
  // Errors:     INVALID_ARGUMENT without a place: it should be a number, or a string, as of the features before.
  absl::Status TakeProperty(GeoJsonLevel& feature, const std::string& name, const Value& value);

  // Counts a feature or geometry without positions.
  void CountEmpty() { ++empty_; }

  // Gives the segments of a feature, which ends, its marker, and its polygons their region.
  void End(const GeoJsonLevel& feature);

  // Completes the domain once the file is read, and adds its notes.
  void Finish();

 private:
  // The names among the values of a property.
  struct Names {
    bool has_numbers = false;
    std::map<std::string, int32_t> numbers{};
  };
  // The number that stands for a name; 0 for the empty one.
  //
  // Errors:     INVALID_ARGUMENT after features with numbers.
  static absl::StatusOr<int32_t> NumberOf(const Value& value, Names& names, std::map<int32_t, std::string>& of_domain);
  void AddRegions(const GeoJsonLevel& feature);
  void NoteFeatures() const;
  void NoteWidth() const;

  const DomainOptions& options_;
  PlanarDomain& domain_;
  Names markers_;
  Names regions_;
  uint64_t empty_ = 0;           // features and geometries without positions
  uint64_t without_region_ = 0;  // features with polygons
  uint64_t without_marker_ = 0;  // features with segments
  uint64_t flat_ = 0;            // polygons that are to have an attribute, and have no inside
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_DOMAIN_GEOJSON_FEATURES_H_
