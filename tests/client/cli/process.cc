#include "tests/client/cli/process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <string_view>

namespace wellspace {
namespace {

// Whether the process has not taken a signal yet that was sent to it.
bool IsPending(pid_t process, int signal) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  std::string line;
  while (std::getline(status, line)) {
    if (line.substr(0, 7) == "ShdPnd:") {
      return (std::stoull(line.substr(7), nullptr, 16) >> (signal - 1) & 1) != 0;
    }
  }
  return false;
}

std::string Program() {
  const char* folder = std::getenv("WELLSPACE_BIN_DIR");
  if (folder == nullptr) {
    ADD_FAILURE() << "WELLSPACE_BIN_DIR is not set; CTest sets it";
    return "";
  }
  return std::string(folder) + "/wellspace";
}

std::vector<char*> Pointers(std::vector<std::string>& strings) {
  std::vector<char*> pointers;
  for (std::string& string : strings) {
    pointers.push_back(string.data());
  }
  pointers.push_back(nullptr);
  return pointers;
}

}  // namespace

Process::Process(const std::vector<std::string>& arguments, const RunOptions& options) {
  std::vector<std::string> words = {Program()};
  if (!options.shell.empty()) {
    words = {"/bin/sh", "-c", options.shell + "; exec \"$0\" \"$@\"", Program()};
  }
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<std::string> environment = options.environment;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    if (std::string_view(*variable).substr(0, 17) != "WELLSPACE_SERVER=") {
      environment.emplace_back(*variable);
    }
  }
  const std::string input = folder_.Write("in", options.input);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, input.c_str(), O_RDONLY, 0);
  if (options.output_descriptor >= 0) {
    posix_spawn_file_actions_adddup2(&actions, options.output_descriptor, STDOUT_FILENO);
  } else {
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, folder_.Path("out").c_str(), O_WRONLY | O_CREAT, 0600);
  }
  if (options.error_descriptor >= 0) {
    posix_spawn_file_actions_adddup2(&actions, options.error_descriptor, STDERR_FILENO);
  } else {
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, folder_.Path("err").c_str(), O_WRONLY | O_CREAT, 0600);
  }
  const int error =
      posix_spawn(&id_, words[0].c_str(), &actions, nullptr, Pointers(words).data(), Pointers(environment).data());
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    ADD_FAILURE() << "cannot start " << words[0];
    id_ = -1;
  }
}

Process::~Process() {
  if (id_ > 0) {
    kill(id_, SIGKILL);
    waitpid(id_, nullptr, 0);
  }
}

void Process::Send(int signal) const {
  ASSERT_EQ(kill(id_, signal), 0);
  while (IsPending(id_, signal)) {
    sched_yield();
  }
}

RunResult Process::Wait() {
  RunResult result;
  int status = 0;
  if (id_ > 0 && waitpid(id_, &status, 0) == id_) {
    id_ = -1;
    result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    result.out = folder_.Read("out");
    result.err = folder_.Read("err");
  }
  return result;
}

RunResult RunWellspace(const std::vector<std::string>& arguments, const RunOptions& options) {
  return Process(arguments, options).Wait();
}

}  // namespace wellspace
