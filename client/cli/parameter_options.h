// The options for the parameters of a mesh.
#ifndef WELLSPACE_CLIENT_CLI_PARAMETER_OPTIONS_H_
#define WELLSPACE_CLIENT_CLI_PARAMETER_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/length.h"
#include "client/types.h"

namespace wellspace::cli {

// --criterion; default: radius-edge.
CLI::Option* AddCriterion(CLI::App& command, client::Criterion& criterion);
// --size and --size-box. Boxes are taken as they are written; see SizeBoxesOf.
void AddSizes(CLI::App& command, std::optional<double>& max_circumradius, std::vector<std::vector<double>>& size_boxes);
// The boxes of --size-box.
//
// Errors:     INVALID_ARGUMENT unless each has 2 D + 1 numbers, D = `dimension`, or any that there is when that is 0.
absl::StatusOr<std::vector<client::SizeBox>> SizeBoxesOf(const std::vector<std::vector<double>>& size_boxes,
                                                         int dimension);

// --periodic, axes by their letters.
void AddPeriodic(CLI::App& command, std::vector<int>& axes, const std::string& description);

// Thread safety: thread-compatible.
class ParameterOptions {
 public:
  // Adds --dimension, --domain, --margin, --merge and --periodic. REQUIRES: this outlives `command`, here and below.
  void AddSpaceTo(CLI::App& command);
  // Adds the others.
  void AddQualityTo(CLI::App& command);

  // As far as the options tell it; 0: not known.
  int dimension() const;

  // The faults that can be known before the dimension is.
  absl::Status Check() const;

  // Their values for a mesh of `dimension`, of `points` if they are known.
  absl::StatusOr<client::MeshOptions> For(int dimension, std::span<const double> points = {}) const;

  // The first option that was given about the surface of a domain in 3-D; null if none was.
  const char* GivenOfSurface() const;

  // Whether any of AddQualityTo's was given; if so, `parameters` with these in the place of its own.
  bool has_quality() const;
  absl::StatusOr<client::MeshOptions> Replace(client::MeshOptions parameters) const;

  // `status`, with the option that the server blames: "--rho: …" for "parameters.rho". As it is when it blames none of
  // these.
  absl::Status Explain(const absl::Status& status) const;

 private:
  void AddSurfaceTo(CLI::App& command);
  std::string OptionOf(const std::string& field) const;

  int dimension_ = 0;
  std::vector<double> domain_;
  std::vector<std::vector<double>> size_boxes_;
  client::MeshOptions options_;
  std::optional<Length> merge_;
  std::optional<Length> tolerance_;
  std::optional<Length> facet_length_;
  std::optional<Length> min_size_;
  double min_angle_ = 0;               // degrees; 0: not given
  std::vector<CLI::Option*> quality_;  // in the order of AddQualityTo
};

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_PARAMETER_OPTIONS_H_
