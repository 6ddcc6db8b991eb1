// The options that say which sizes are wanted at points.
#ifndef WELLSPACE_CLIENT_CLI_SIZE_FIELD_OPTIONS_H_
#define WELLSPACE_CLIENT_CLI_SIZE_FIELD_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/cloud_options.h"
#include "client/cli/exit_codes.h"
#include "client/formats/cloud.h"
#include "client/formats/file_plan.h"
#include "client/formats/read_cloud.h"
#include "client/types.h"

namespace wellspace::cli {

// --gradation. Returns the option.
CLI::Option* AddGradation(CLI::App& command, std::optional<double>& gradation);

// A file of sizes at points: --size-field and --size-unit.
//
// Thread safety: thread-compatible.
class SizeFieldOptions {
 public:
  // Returns --size-field.
  //
  // REQUIRES:   this outlives `command`.
  CLI::Option* AddTo(CLI::App& command);

  bool IsGiven() const { return !path_.empty(); }
  void AddFilesTo(formats::FilePlan& files) const;

  // Reads the file; null if there is none. With `skip_invalid` sizes that are missing or not finite are left out.
  // `gradation`: the requested one; none: the default.
  //
  // Errors:     those of formats::ReadSizes.
  absl::StatusOr<std::shared_ptr<const client::SizeSamples>> Read(int dimension, bool skip_invalid,
                                                                  std::optional<double> gradation);

  // Findings while the file was read; how many sizes were left out.
  const std::vector<std::string>& notes() const { return origins_.notes; }
  uint64_t skipped() const { return origins_.skipped; }

  // `status`, with the place in the file of the sample that it names.
  absl::Status WithOrigins(const absl::Status& status) const;

 private:
  std::string path_;
  client::SizeMeasure measure_ = client::SizeMeasure::kCircumradius;
  bool interpolates_ = false;
  formats::PointCloud origins_;  // of the samples, without their coordinates
};

// Prints the notes on the reading of the field, as PrintNotes does, and adds it to `report`.
void NoteSizes(const SizeFieldOptions& field, const formats::CloudOptions& options, OutputFormat format, bool quiet,
               CloudReport& report);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_SIZE_FIELD_OPTIONS_H_
