// The treatment of the features of a file of geometries: of the properties of GeoJSON's markers and regions, and of all
// notes on the file. Private to the readers of such files.
#ifndef WELLSPACE_CLIENT_FORMATS_DOMAIN_GEOJSON_FEATURES_H_
#define WELLSPACE_CLIENT_FORMATS_DOMAIN_GEOJSON_FEATURES_H_

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "client/formats/domain/domain_readers.h"
#include "client/formats/domain/geojson_objects.h"

namespace wellspace::formats {

// Thread safety: thread-compatible.
class GeoJsonFeatures {
 public:
  // REQUIRES:   both outlive this.
  GeoJsonFeatures(const DomainOptions& options, PlanarDomain& domain) : options_(options), domain_(domain) {}

  // Takes the property `name` of a feature: a number, or the `text` to show of it.
  //
  // Errors:     INVALID_ARGUMENT without a place: it should be a number.
  absl::Status TakeProperty(GeoJsonLevel& feature, const std::string& name, const double* number,
                            std::string_view text) const;

  // Counts a feature or geometry without positions.
  void CountEmpty() { ++empty_; }

  // Gives the segments of a feature, which ends, its marker, and its polygons their region.
  void End(const GeoJsonLevel& feature);

  // Completes the domain once the file is read, and adds its notes.
  void Finish();

 private:
  void AddRegions(const GeoJsonLevel& feature);
  void NoteFeatures() const;
  void NoteWidth() const;

  const DomainOptions& options_;
  PlanarDomain& domain_;
  uint64_t empty_ = 0;           // features and geometries without positions
  uint64_t without_region_ = 0;  // features with polygons
  uint64_t without_marker_ = 0;  // features with segments
  uint64_t flat_ = 0;            // polygons that are to have an attribute, and have no inside
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_DOMAIN_GEOJSON_FEATURES_H_
