// HAProxy in front of servers that share their sessions, by deploy/haproxy-replicas.cfg.
#ifndef WELLSPACE_TESTS_SERVER_REPLICA_PROXY_H_
#define WELLSPACE_TESTS_SERVER_REPLICA_PROXY_H_

#include <memory>
#include <string>
#include <vector>

#include "tests/server/subprocess.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {

// The configuration that is deployed, with the places of a test, and without TLS.
//
// Thread safety: thread-compatible.
class ReplicaProxy {
 public:
  // Of a server: where it serves, and where it answers probes, HOST:PORT.
  struct Server {
    std::string address;
    std::string metrics;
  };
  static constexpr int kServers = 3;  // as the configuration has them

  // Why there can be none; empty: there can.
  static std::string WhyNot();

  // Starts it at `address`. `before`: see Subprocess. REQUIRES: kServers of them, and WhyNot() is empty.
  ReplicaProxy(std::string address, const std::vector<Server>& servers, std::vector<std::string> before = {});

  const std::string& address() const { return address_; }
  // It forgets what it has learned.
  void Restart();

 private:
  void Start();

  const std::string address_;
  const std::vector<std::string> before_;
  const TemporaryFolder folder_;
  std::unique_ptr<Subprocess> process_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_REPLICA_PROXY_H_
