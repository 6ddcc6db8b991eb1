// The options that say how a file of points is read, and the notes on how it was.
#ifndef WELLSPACE_CLIENT_CLI_CLOUD_OPTIONS_H_
#define WELLSPACE_CLIENT_CLI_CLOUD_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/exit_codes.h"
#include "client/formats/read_cloud.h"
#include "client/json/json.h"

namespace wellspace::cli {

// Adds --input-format, which takes `more_formats`, too, --columns and --skip-invalid, about the file `what`. REQUIRES:
// `options` outlives `command`.
void AddCloudOptions(CLI::App& command, formats::CloudOptions& options, const std::string& what = "IN",
                     const std::vector<std::string>& more_formats = {});

// Findings while a cloud was read: the columns taken, the parts of the file not used, the number of points skipped.
struct CloudReport {
  std::vector<std::string> notes = {};
  std::optional<uint64_t> skipped_points = {};  // if they were to be skipped
  std::optional<uint64_t> skipped_sizes = {};   // the same of a size field, if there is one
};

// Of a formats::PointCloud or a client::CloudFile.
CloudReport ReportOf(const formats::CloudOptions& options, std::vector<std::string> notes, uint64_t skipped);

// As text, prints the notes on standard error, a line each; with `quiet` only that points were skipped. Figures in JSON
// have them.
void PrintNotes(const CloudReport& report, OutputFormat format, bool quiet);

// Adds notes, if there are any, and skipped_points, if they were to be skipped, to an object.
void AddNotes(const CloudReport& report, client::Json& json);
// The same for the text of an object that client::Json::dump(2) made, without reading it.
std::string WithNotes(const CloudReport& report, const std::string& object);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_CLOUD_OPTIONS_H_
