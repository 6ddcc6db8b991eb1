// What the commands that mesh a cloud in one call have in common.
#ifndef WELLSPACE_CLIENT_CLI_MESHING_OPTIONS_H_
#define WELLSPACE_CLIENT_CLI_MESHING_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/cloud_options.h"
#include "client/cli/domain_options.h"
#include "client/cli/interrupt.h"
#include "client/cli/parameter_options.h"
#include "client/cli/remote_command.h"
#include "client/cli/size_field_options.h"
#include "client/client.h"
#include "client/formats/cloud.h"
#include "client/formats/file_plan.h"

namespace wellspace::cli {

// What a help text says of the files that can be read.
extern const char kCloudsHelp[];

// What a help text says of the files that can be written.
extern const char kMeshesHelp[];

// -o,--out, --format and --no-boundary, of a mesh.
void AddMeshOutput(CLI::App& command, std::string& path, std::string& format, bool& no_boundary);

// --no-attributes, of a mesh of a file of points.
void AddNoAttributes(CLI::App& command, bool& no_attributes);

// A cloud to be read, the server to use and what it is asked.
//
// Thread safety: thread-compatible.
class MeshingOptions {
 public:
  // Adds the options to `command`, the file of the cloud, IN, first. REQUIRES: this outlives `command`.
  void AddTo(CLI::App& command);

  const RemoteCommand& remote() const { return remote_; }
  // Of the points, as far as the options tell it; 0: not known.
  int dimension() const { return parameters_.dimension(); }
  // Whether figures go to standard output.
  bool has_figures_on_stdout() const;

  // From here on the cloud is read with what its points have beside coordinates. To be called before Run.
  void KeepAttributes() { cloud_options_.keep_attributes = true; }

  // What can be known to be wrong with the options before anything is read.
  absl::Status Check() const;

  // Adds the files that are read, and those that WriteStatistics writes.
  void AddFilesTo(formats::FilePlan& files) const;

  // What is done with a cloud; an error is explained in terms of its file and of the options.
  using Work = std::function<absl::Status(client::Client&, const client::MeshOptions&, const formats::PointCloud&,
                                          const client::CallOptions&)>;
  // Reads the cloud, or the domain, opens the server and does `work`. Returns the exit code, errors reported.
  int Run(const Work& work);

  // What a mesh of the domain tells of its seeds; nothing of a cloud.
  std::vector<std::string> NotesOf(const std::optional<client::DomainStatistics>& statistics) const {
    return domain_.features() == nullptr ? std::vector<std::string>() : domain_.NotesOf(statistics);
  }

  // Writes `statistics`, an object in JSON, with what was noted of the cloud, to where --stats and --output ask for it,
  // if they do.
  // With the notes of the cloud, and those of a file that was written.
  absl::Status WriteStatistics(const std::string& statistics, const std::vector<std::string>& more_notes = {}) const;

 private:
  absl::StatusOr<formats::PointCloud> Read();
  // What is asked of a mesh of `cloud`; reads --size-field.
  absl::StatusOr<client::MeshOptions> OptionsFor(const formats::PointCloud& cloud);

  std::string input_;
  formats::CloudOptions cloud_options_;
  DomainOptions domain_;
  SizeFieldOptions size_field_;
  CloudReport report_;  // of the cloud, once it is read
  std::string statistics_;
  ParameterOptions parameters_;
  RemoteCommand remote_;
};

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_MESHING_OPTIONS_H_
