// Runs the program `wellspace` of this build.
#ifndef WELLSPACE_TESTS_CLIENT_CLI_PROCESS_H_
#define WELLSPACE_TESTS_CLIENT_CLI_PROCESS_H_

#include <sys/types.h>

#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace wellspace {

struct RunResult {
  int exit_code = -1;  // 128 + signal when one ended it
  std::string out;
  std::string err;
};

struct RunOptions {
  std::string input;                     // on standard input
  std::vector<std::string> environment;  // NAME=value, besides that of the test; WELLSPACE_SERVER is unset otherwise
  int error_descriptor = -1;             // standard error goes there instead of to RunResult::err
  int output_descriptor = -1;            // the same of standard output
  std::string shell = "";                // commands before sh becomes the program: "exec >/dev/full", "ulimit -f 1"
};

// One run of the program.
//
// Thread safety: thread-compatible.
class Process {
 public:
  explicit Process(const std::vector<std::string>& arguments, const RunOptions& options = {});
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t id() const { return id_; }
  // Sends a signal, and returns once the program has taken it.
  void Send(int signal) const;
  // Waits for its end. Call once.
  RunResult Wait();

 private:
  TemporaryFolder folder_;
  pid_t id_ = -1;
};

RunResult RunWellspace(const std::vector<std::string>& arguments, const RunOptions& options = {});

}  // namespace wellspace

#endif  // WELLSPACE_TESTS_CLIENT_CLI_PROCESS_H_
