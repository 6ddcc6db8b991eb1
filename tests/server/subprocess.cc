#include "tests/server/subprocess.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <string>

extern char** environ;

namespace wellspace::server {

std::vector<std::string> AfterShell(const std::string& commands) {
  return {"/bin/sh", "-c", commands + R"(; exec "$0" "$@")"};
}

Subprocess::Subprocess(const std::string& name, std::vector<std::string> arguments, const std::string& error_path,
                       std::vector<std::string> before) {
  const char* folder = std::getenv("WELLSPACE_BIN_DIR");
  if (folder == nullptr) {
    throw std::runtime_error("WELLSPACE_BIN_DIR is not set: run this test with ctest");
  }
  arguments.insert(arguments.begin(), name[0] == '/' ? name : std::string(folder) + "/" + name);
  arguments.insert(arguments.begin(), before.begin(), before.end());
  const std::string program = arguments.front();
  std::vector<char*> argv;
  for (std::string& argument : arguments) {
    argv.push_back(argument.data());
  }
  argv.push_back(nullptr);

  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) {
    throw std::runtime_error("no pipe");
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  if (!error_path.empty()) {
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, error_path.c_str(), O_WRONLY | O_CREAT, 0600);
  }
  const int error = posix_spawn(&pid_, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  output_ = fdopen(ends[0], "r");
  if (error != 0) {
    fclose(output_);
    throw std::runtime_error("cannot start " + program);
  }
}

Subprocess::~Subprocess() {
  if (pid_ > 0) {
    Signal(SIGKILL);
    Wait();
  }
  fclose(output_);
}

std::string Subprocess::ReadLine() {
  std::string line;
  for (int c = fgetc(output_); c != EOF && c != '\n'; c = fgetc(output_)) {
    line.push_back(static_cast<char>(c));
  }
  return line;
}

uint64_t Subprocess::PeakMemory() const {
  std::ifstream file("/proc/" + std::to_string(pid_) + "/status");
  const std::string key = "VmHWM:";
  for (std::string line; std::getline(file, line);) {
    if (line.substr(0, key.size()) == key) {
      return std::stoull(line.substr(key.size())) * 1024;
    }
  }
  return 0;
}

void Subprocess::Signal(int signal) { kill(pid_, signal); }

int Subprocess::Wait() {
  int state = 0;
  waitpid(pid_, &state, 0);
  pid_ = -1;
  return WIFEXITED(state) ? WEXITSTATUS(state) : -WTERMSIG(state);
}

bool Subprocess::HasEnded() const {
  siginfo_t ended{};
  return pid_ <= 0 ||
         (waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 && ended.si_pid == pid_);
}

}  // namespace wellspace::server
