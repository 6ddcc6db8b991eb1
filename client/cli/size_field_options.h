// The options that say which sizes are wanted at points.
#ifndef WELLSPACE_CLIENT_CLI_SIZE_FIELD_OPTIONS_H_
#define WELLSPACE_CLIENT_CLI_SIZE_FIELD_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/cloud.h"
#include "client/formats/file_plan.h"
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

  // Reads the file; null if there is none.
  //
  // Errors:     those of formats::ReadSizes.
  absl::StatusOr<std::shared_ptr<const client::SizeSamples>> Read(int dimension);

  // `status`, with the place in the file of the sample that it names.
  absl::Status WithOrigins(const absl::Status& status) const;

 private:
  std::string path_;
  client::SizeMeasure measure_ = client::SizeMeasure::kCircumradius;
  formats::PointCloud origins_;  // of the samples, without their coordinates
};

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_SIZE_FIELD_OPTIONS_H_
