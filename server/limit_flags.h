// The limits of ServiceOptions as options of the command line, and of the file that --config names.
#ifndef WELLSPACE_SERVER_LIMIT_FLAGS_H_
#define WELLSPACE_SERVER_LIMIT_FLAGS_H_

#include <string>

#include "CLI/CLI.hpp"
#include "absl/time/time.h"
#include "server/base/options.h"
#include "server/server.h"

namespace wellspace::server {

// Declares all limits of `service`, with its present values for defaults, and checks of their values.
void DeclareLimits(CLI::App& app, ServiceOptions& service);

// Declares those of `connections` likewise.
void DeclareConnections(CLI::App& app, ConnectionOptions& connections);

// --config FILE: every option of `app`, without its dashes, is a key of a TOML file; the command line wins, then the
// environment (DeclareVariables). Keys that are no option and values that an option does not take are refused, naming
// the key.
void DeclareConfigFile(CLI::App& app);

// An option that takes seconds, `least` to `most`, fractions too.
CLI::Option* AddSeconds(CLI::App& app, const std::string& name, absl::Duration& value, absl::Duration least,
                        absl::Duration most, const std::string& description);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_LIMIT_FLAGS_H_
