// Options that several commands have, and the kinds that CLI11 lacks.
#ifndef WELLSPACE_CLIENT_CLI_OPTIONS_H_
#define WELLSPACE_CLIENT_CLI_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/server_link.h"

namespace wellspace::cli {

// A finite number, correctly rounded (CLI11 rounds twice).
CLI::Option* AddNumber(CLI::App& command, const std::string& name, double& value, const std::string& description);
// The same, or "none": as if the option were not given, which takes back the value of a session.
CLI::Option* AddNumber(CLI::App& command, const std::string& name, std::optional<double>& value,
                       const std::string& description);

// To be checked of a number: it is above 0.
CLI::Validator AboveZero();

// MESH, the file of a mesh that is read.
void AddMeshInput(CLI::App& command, std::string& path);

// A whole number of at least `least` and at most `most`; CLI11 takes -1 for the largest there is.
CLI::Option* AddCount(CLI::App& command, const std::string& name, const std::function<void(uint64_t)>& take,
                      const std::string& description, uint64_t least = 0,
                      uint64_t most = std::numeric_limits<uint64_t>::max());

// The whole number of at most `most` in the text of option `name`.
uint64_t ParseCount(const std::string& name, std::string_view text, uint64_t least, uint64_t most);

// Finite numbers separated by commas.
CLI::Option* AddNumbers(CLI::App& command, const std::string& name, std::vector<double>& values,
                        const std::string& description);

// The same, as often as it is given: one list of numbers each time.
CLI::Option* AddNumberLists(CLI::App& command, const std::string& name, std::vector<std::vector<double>>& lists,
                            const std::string& description);

// --server, and how to talk to it: --tls, --tls-ca, --tls-cert, --tls-key, --token-file, --insecure-remote,
// --no-follow; the environment's WELLSPACE_SERVER, WELLSPACE_TLS_CA, …, and WELLSPACE_TOKEN for the token itself, which
// --token-file overrules.
void AddServer(CLI::App& command, ServerChoice& choice);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_OPTIONS_H_
