// The options that say how a file of segments is read, and which faces they bound.
#ifndef WELLSPACE_CLIENT_CLI_DOMAIN_OPTIONS_H_
#define WELLSPACE_CLIENT_CLI_DOMAIN_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/length.h"
#include "client/formats/cloud.h"
#include "client/formats/domain/planar_domain.h"
#include "client/formats/domain/read_planar_domain.h"
#include "client/formats/read_cloud.h"
#include "client/types.h"

namespace wellspace::cli {

// May stand without its value: RunCommandLine gives it one.
inline constexpr char kSnapOption[] = "--snap";

// A domain in the plane: --segments, --faces, --split-crossings, --snap, --region-property and --marker-property.
//
// Thread safety: thread-compatible.
class DomainOptions {
 public:
  // REQUIRES:   this outlives `command`.
  void AddTo(CLI::App& command);
  // The same but for --split-crossings and --snap. `what` is the file, as the options say it.
  void AddReadingTo(CLI::App& command, const std::string& what);

  // --snap alone.
  void AddSnapTo(CLI::App& command, const std::string& description);

  // Whether `path`, or the format that is given, has segments.
  bool IsDomain(const std::string& path, const std::string& format) const;

  // Refuses options that want segments beside a cloud, as the error says.
  absl::Status CheckCloud(const std::string& cloud = "IN") const;
  // The same beside something else; `what` says what is there, and what to give.
  absl::Status CheckOther(const std::string& what) const;

  // Reads the domain, by the format and the columns that are given; its points alone are returned, with their origins,
  // and its segments are kept.
  //
  // Errors:     those of formats::ReadPlanarDomain.
  absl::StatusOr<formats::PointCloud> Read(const std::string& path, const formats::CloudOptions& options);

  // Whether the domain read tells the markers of segments, and the regions of faces: GeoJSON does by a property.
  //
  // REQUIRES:   Read is OK.
  bool KnowsMarkers() const { return domain_->places.empty() || !reading_.marker_property.empty(); }
  bool KnowsRegions() const { return domain_->places.empty() || !reading_.region_property.empty(); }

  // The domain that has been read; null before.
  const std::shared_ptr<const client::Features>& features() const { return features_; }
  // Names of parts. To be called before Read.
  void SetNames(client::PartNames names) { names_ = std::move(names); }

  // The part that the server has before the one that was read.
  struct Before {
    uint64_t points = 0;
    client::FeatureOffset features = {};
  };
  // `status`, with the places in the file of the points, segments and seeds that it names.
  absl::Status WithOrigins(const absl::Status& status, const Before& before) const;
  // Notes of a mesh of the domain on its seeds, a sentence each: seeds that mean nothing.
  //
  // REQUIRES:   Read is OK.
  std::vector<std::string> NotesOf(const std::optional<client::DomainStatistics>& statistics) const;
  absl::Status WithOrigins(const absl::Status& status) const { return WithOrigins(status, Before()); }

 private:
  bool has_segments_ = false;
  std::string faces_;
  bool splits_crossings_ = false;
  std::optional<Length> snap_;
  client::PartNames names_;
  formats::DomainOptions reading_;
  std::optional<formats::PlanarDomain> domain_;
  std::shared_ptr<const client::Features> features_;
};

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_DOMAIN_OPTIONS_H_
