// What the commands that send a cloud to a server have in common.
#ifndef WELLSPACE_CLIENT_CLI_MESHING_OPTIONS_H_
#define WELLSPACE_CLIENT_CLI_MESHING_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/interrupt.h"
#include "client/cli/server_link.h"
#include "client/client.h"
#include "client/formats/cloud.h"

namespace wellspace::cli {

// What a help text says of the files that can be read.
extern const char kCloudsHelp[];

// --criterion; default: radius-edge.
CLI::Option* AddCriterion(CLI::App& command, client::Criterion& criterion);
// --size and --size-box. Boxes are taken as they are written; see SizeBoxesOf.
void AddSizes(CLI::App& command, double& max_circumradius, std::vector<std::vector<double>>& size_boxes);
// The boxes of --size-box.
//
// Errors:     INVALID_ARGUMENT unless each has 2 D + 1 numbers, D = `dimension`, or any that there is when that is 0.
absl::StatusOr<std::vector<client::SizeBox>> SizeBoxesOf(const std::vector<std::vector<double>>& size_boxes,
                                                         int dimension);

// A cloud to be read, the server to use and what it is asked.
//
// Thread safety: thread-compatible.
class MeshingOptions {
 public:
  // Adds the options to `command`, the file of the cloud, IN, first. REQUIRES: this outlives `command`.
  void AddTo(CLI::App& command);

  const std::string& statistics() const { return statistics_; }
  bool quiet() const { return quiet_; }
  // Of the points: as far as the options tell it, later that of the cloud; 0: not known.
  int dimension() const;

  // What can be known to be wrong before anything is read.
  absl::Status Check() const;

  // What is done with a cloud; an error is explained in terms of its file and of the options.
  using Work =
      std::function<absl::Status(client::Client&, const client::MeshOptions&, const formats::PointCloud&, Interrupt&)>;
  // Reads the cloud, opens the server and does `work`. Returns the exit code, errors reported.
  int Run(const Work& work);

  // Writes `json` where --stats asks for it, if it does.
  absl::Status WriteStatistics(const std::string& json) const;

 private:
  absl::StatusOr<formats::PointCloud> Read();
  absl::Status Explain(const absl::Status& status, const formats::PointCloud& cloud) const;
  // "--rho" of "parameters.rho"; empty for what no option sets.
  std::string OptionOf(const std::string& field) const;

  std::string input_;
  std::string input_format_;
  std::string statistics_;
  ServerChoice server_;
  int dimension_ = 0;
  std::vector<double> domain_;
  std::vector<std::vector<double>> size_boxes_;
  double timeout_seconds_ = 0;  // 0: none
  bool quiet_ = false;
  client::MeshOptions options_;
};

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_MESHING_OPTIONS_H_
