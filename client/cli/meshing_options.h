// The common part of the commands that mesh a cloud in one call.
#ifndef WELLSPACE_CLIENT_CLI_MESHING_OPTIONS_H_
#define WELLSPACE_CLIENT_CLI_MESHING_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/cloud_options.h"
#include "client/cli/domain_options.h"
#include "client/cli/interrupt.h"
#include "client/cli/parameter_options.h"
#include "client/cli/part_name_options.h"
#include "client/cli/remote_command.h"
#include "client/cli/size_field_options.h"
#include "client/cli/surface_options.h"
#include "client/client.h"
#include "client/formats/cloud.h"
#include "client/formats/file_plan.h"
#include "client/formats/mesh_order.h"

namespace wellspace::cli {

// The help text on the files that can be read.
extern const char kCloudsHelp[];

// The help text on the files that can be written.
extern const char kMeshesHelp[];

// The formats of --input-format beside those of clouds: of domains and of surfaces.
std::vector<std::string> InputFormats();

// A file that a mesh goes to, and what of the mesh.
struct MeshOutput {
  std::string path;
  std::string format;
  formats::MeshOrder order = formats::MeshOrder::kFirst;
  bool no_boundary = false;

  // Tells early whether a mesh cannot go there; see cli::CheckMeshOutput.
  absl::Status Check(int dimension = 0, bool may_have_weights = false) const;
};

// --order, of a mesh.
void AddMeshOrder(CLI::App& command, formats::MeshOrder& order);

// -o,--out, --format, --order and --no-boundary, of a mesh.
void AddMeshOutput(CLI::App& command, MeshOutput& output);

// --no-attributes, of a mesh of a file of points.
void AddNoAttributes(CLI::App& command, bool& no_attributes);

// A cloud to be read, the server to use and the options of the call.
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

  // From here on the cloud is read with the attributes of its points. To be called before Run.
  void KeepAttributes() { cloud_options_.keep_attributes = true; }

  // The faults of the options that can be known before anything is read.
  absl::Status Check() const;

  // Adds the files that are read, and those that WriteStatistics writes.
  void AddFilesTo(formats::FilePlan& files) const;

  // The work on a cloud; an error is explained in terms of its file and of the options.
  using Work = std::function<absl::Status(client::Client&, const client::MeshOptions&, const formats::PointCloud&,
                                          const client::CallOptions&)>;
  // Reads the cloud, or the domain, opens the server and does `work`. Returns the exit code, errors reported.
  int Run(const Work& work);

  // Notes of a mesh of the domain on its seeds; none for a cloud.
  std::vector<std::string> NotesOf(const client::MeshStatistics& statistics) const {
    return domain_.features() != nullptr    ? domain_.NotesOf(statistics.domain)
           : surface_.features() != nullptr ? surface_.NotesOf(statistics.surface)
                                            : std::vector<std::string>();
  }
  // The names of parts of the boundary that the file has, by their markers.
  std::map<int32_t, std::string> PartNames() const { return surface_.PartNames(); }

  // Writes `statistics`, an object in JSON, with the notes on the cloud, to where --stats and --output ask for it,
  // if they do.
  // With the notes of the cloud, and those of a file that was written.
  absl::Status WriteStatistics(const std::string& statistics, const std::vector<std::string>& more_notes = {}) const;

 private:
  absl::StatusOr<formats::PointCloud> Read();
  // `status`, with the places in the file of the rows that it names.
  absl::Status WithPlacesInFile(const absl::Status& status, const formats::PointCloud& cloud) const;
  // The request for a mesh of `cloud`; reads --size-field.
  absl::StatusOr<client::MeshOptions> OptionsFor(const formats::PointCloud& cloud);

  std::string input_;
  formats::CloudOptions cloud_options_;
  DomainOptions domain_;
  SurfaceOptions surface_;
  SizeFieldOptions size_field_;
  CloudReport report_;  // of the cloud, once it is read
  std::string statistics_;
  ParameterOptions parameters_;
  PartNameOptions part_names_;
  RemoteCommand remote_;
};

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_MESHING_OPTIONS_H_
