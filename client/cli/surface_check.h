// The report of `wellspace check` on a mesh of a surface.
#ifndef WELLSPACE_CLIENT_CLI_SURFACE_CHECK_H_
#define WELLSPACE_CLIENT_CLI_SURFACE_CHECK_H_

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "client/cli/cloud_options.h"
#include "client/cli/length.h"
#include "client/cli/surface_options.h"
#include "client/formats/file_plan.h"
#include "client/formats/mesh.h"
#include "client/json/json.h"
#include "core/validate/validate_solid.h"

namespace wellspace::cli {

// --surface and the options that say how it is read, --tolerance.
//
// Thread safety: thread-compatible.
class SurfaceCheck {
 public:
  // REQUIRES:   this outlives `command`.
  void AddTo(CLI::App& command);

  bool IsAsked() const { return !path_.empty(); }
  void AddFilesTo(formats::FilePlan& files) const;

  // Checks a mesh in space by itself and, where a surface is given, against that. The findings go to `json`, and to
  // standard output if this is for a user.
  //
  // Errors:     FAILED_PRECONDITION, naming the first violation; INVALID_ARGUMENT for a surface that cannot be read, or
  //             has faults.
  absl::Status Check(const formats::Mesh& mesh, double rho, OutputFormat format, client::Json& json) const;

 private:
  absl::Status Compare(const core::MeshView& view, const core::SolidParts& parts, OutputFormat format,
                       client::Json& json) const;

  std::string path_;
  SurfaceOptions options_;
  std::optional<Length> tolerance_;
};

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_SURFACE_CHECK_H_
