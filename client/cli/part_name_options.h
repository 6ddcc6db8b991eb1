// --names and --region-names: names of parts of a mesh by their numbers.
#ifndef WELLSPACE_CLIENT_CLI_PART_NAME_OPTIONS_H_
#define WELLSPACE_CLIENT_CLI_PART_NAME_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <cstdint>
#include <map>
#include <string>

#include "absl/status/status.h"
#include "client/types.h"

namespace wellspace::cli {

// Thread safety: thread-compatible.
class PartNameOptions {
 public:
  // REQUIRES:   this outlives `command`.
  void AddTo(CLI::App& command);

  // The first of the two options that is given; null: neither.
  const char* given() const;
  // Errors:     INVALID_ARGUMENT, naming the option, for names that the service does not take.
  absl::Status Check() const;
  const client::PartNames& names() const { return names_; }

 private:
  client::PartNames names_;
};

// Adds the names of a file to `names`, but for those that the service does not take.
void AddPartNames(const std::map<int32_t, std::string>& of_file, std::map<int32_t, std::string>& names);

// Names of a file with the given ones over them, of which none is there twice.
client::PartNames Joined(client::PartNames of_file, const client::PartNames& given);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_PART_NAME_OPTIONS_H_
