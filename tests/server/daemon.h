// The real server, in a process of its own.
#ifndef WELLSPACE_TESTS_SERVER_DAEMON_H_
#define WELLSPACE_TESTS_SERVER_DAEMON_H_

#include <signal.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "client/client.h"
#include "gtest/gtest.h"
#include "tests/server/subprocess.h"

namespace wellspace::server {

// Whether the server of `client` meshes: a triangle's corners, within a minute.
inline absl::Status MeshTriangle(client::Client client) {
  client::MeshOptions options;
  options.dimension = 2;
  client::CallOptions call;
  call.timeout = absl::Minutes(1);
  const std::vector<double> points = {0, 0, 1, 0, 0.5, 0.75};
  return client.MeshPoints(options, points, nullptr, call).status();
}

// A wellspaced on a free port.
class Daemon {
 public:
  // Its standard error is the test's, or goes to the file `error_path`. `before`: see Subprocess.
  // kAsTold: the arguments say where it listens.
  enum class Listen { kAnywhere, kAsTold };
  explicit Daemon(std::vector<std::string> arguments = {}, const std::string& error_path = "",
                  const std::vector<std::string>& before = {}, Listen listen = Listen::kAnywhere)
      : process_("wellspaced", listen == Listen::kAsTold ? std::move(arguments) : Listening(std::move(arguments)),
                 error_path, before) {
    const std::string line = process_.ReadLine();
    const std::string prefix = "listening on ";
    EXPECT_EQ(line.substr(0, prefix.size()), prefix);
    address_ = line.substr(std::min(line.size(), prefix.size()));
  }

  Subprocess& process() { return process_; }
  const std::string& address() const { return address_; }
  client::Client Client(const client::ConnectOptions& options = {}) {
    return client::Connect(address_, options).value();
  }

  // Ends it as an administrator does.
  void Stop() {
    process_.Signal(SIGTERM);
    EXPECT_EQ(process_.Wait(), 0);
  }

 private:
  static std::vector<std::string> Listening(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--listen", "127.0.0.1:0"});
    return arguments;
  }

  Subprocess process_;
  std::string address_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_DAEMON_H_
