// wellspace estimate: how large would the mesh of a cloud be?
#include <iostream>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/cli/commands/commands.h"
#include "client/cli/exit_codes.h"
#include "client/cli/meshing_options.h"
#include "client/cli/statistics.h"
#include "client/formats/file_plan.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

constexpr char kEstimateExamples[] =
    "Examples:\n"
    "  wellspace estimate cow.csv --size 0.01\n"
    "  wellspace estimate cow.csv --stats - --server mesher:7233\n";

absl::Status CheckOptions(const MeshingOptions& options) {
  WELLSPACE_RETURN_IF_ERROR(options.Check());
  formats::FilePlan files;
  options.AddFilesTo(files);
  if (!options.remote().quiet() && !options.has_figures_on_stdout()) {
    files.Writes("the estimate", std::string(formats::kStandardStream));
  }
  return files.Check();
}

int RunEstimate(MeshingOptions& options) {
  if (const absl::Status status = CheckOptions(options); !status.ok()) {
    return ReportError(status, options.remote().format());
  }
  return options.Run([&options](client::Client& client, const client::MeshOptions& mesh_options,
                                const formats::PointCloud& cloud, const client::CallOptions& call) {
    WELLSPACE_ASSIGN_OR_RETURN(const client::MeshEstimate estimate,
                               client.EstimateMesh(mesh_options, cloud.points, call));
    if (!options.remote().quiet() && !options.has_figures_on_stdout()) {
      std::cout << EstimateText(estimate, cloud.dimension);
    }
    return options.WriteStatistics(EstimateJson(estimate, cloud.dimension));
  });
}

}  // namespace

void AddEstimateCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<MeshingOptions>();
  CLI::App* estimate =
      app.add_subcommand("estimate",
                         "Estimate how large the mesh of a point cloud, of a domain in the plane, or of "
                         "the inside of a surface would be, and the memory that meshing it would take");
  estimate->footer(absl::StrCat(kCloudsHelp, kEstimateExamples, "\n", kExitCodesHelp));
  options->AddTo(*estimate);
  estimate->callback([options, &exit_code] { exit_code = RunEstimate(*options); });
}

}  // namespace wellspace::cli
