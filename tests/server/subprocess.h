// A program that runs beside the test.
#ifndef WELLSPACE_TESTS_SERVER_SUBPROCESS_H_
#define WELLSPACE_TESTS_SERVER_SUBPROCESS_H_

#include <sys/types.h>

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace wellspace::server {

// A command that runs a program behind it after `commands` of a shell, as "ulimit -n 64", a limit that the
// program cannot raise.
std::vector<std::string> AfterShell(const std::string& commands);

// Killed with SIGKILL at the latest on destruction.
//
// Thread safety: thread-compatible.
class Subprocess {
 public:
  // Starts WELLSPACE_BIN_DIR/`name`, or `name` itself if that is an absolute path. Its standard output is read here,
  // its standard error is the test's, or goes to the file `error_path`. `before`: a command in front of it, which
  // becomes what stands behind it.
  Subprocess(const std::string& name, std::vector<std::string> arguments, const std::string& error_path = "",
             std::vector<std::string> before = {});
  ~Subprocess();
  Subprocess(const Subprocess&) = delete;
  Subprocess& operator=(const Subprocess&) = delete;

  // The next line of its standard output, without its end; empty at the end of the output.
  std::string ReadLine();

  pid_t pid() const { return pid_; }

  // The most resident memory that it has had, in bytes. 0 when it is no more.
  uint64_t PeakMemory() const;

  void Signal(int signal);

  // Waits for its end. Its exit code, or minus the signal that ended it.
  int Wait();
  // Whether Wait would not have to wait.
  bool HasEnded() const;

 private:
  pid_t pid_ = -1;
  FILE* output_ = nullptr;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_SUBPROCESS_H_
