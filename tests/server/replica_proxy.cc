#include "tests/server/replica_proxy.h"

#include <grpcpp/grpcpp.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "gtest/gtest.h"
#include "tests/server/replicas_fixture.h"

namespace wellspace::server {
namespace {

constexpr char kHaproxy[] = "/usr/sbin/haproxy";

std::string DeployedConfiguration() {
  const char* const data = std::getenv("WELLSPACE_DATA_DIR");
  const std::filesystem::path deploy = std::filesystem::path(data == nullptr ? "tests/data" : data) / "../../deploy";
  return TextOfFile(deploy / "haproxy-replicas.cfg");
}

}  // namespace

std::string ReplicaProxy::WhyNot() {
  return std::filesystem::exists(kHaproxy) ? "" : "HAProxy is not installed (deploy/install-deps.sh test)";
}

ReplicaProxy::ReplicaProxy(std::string address, const std::vector<Server>& servers, std::vector<std::string> before)
    : address_(std::move(address)), before_(std::move(before)) {
  std::string text = DeployedConfiguration();
  const auto replace = [&](const std::string& from, const std::string& to) {
    EXPECT_NE(text.find(from), std::string::npos) << from;
    text = absl::StrReplaceAll(text, {{from, to}});
  };
  replace(":7233 ssl crt /etc/wellspace/server-and-key.pem alpn h2", absl::StrCat(address_, " proto h2"));
  replace("/etc/haproxy/wellspace-owners.map", folder_.Path("owners.map"));
  replace("http-check connect port 9464 proto h1", "http-check connect proto h1");
  for (int i = 0; i < kServers; ++i) {
    const auto& [served, metrics] = servers.at(i);
    const std::string named = absl::StrCat("mesh-", i + 1, ":7233");
    replace(absl::StrCat("server ", named, " ", named),
            absl::StrCat("server ", served, " ", served, " port ", metrics.substr(metrics.find(':') + 1)));
  }
  std::ofstream(folder_.Path("haproxy.cfg")) << text;
  Start();
}

void ReplicaProxy::Start() {
  std::ofstream(folder_.Path("owners.map"));
  process_ = std::make_unique<Subprocess>(kHaproxy, std::vector<std::string>{"-db", "-f", folder_.Path("haproxy.cfg")},
                                          folder_.Path("log"), before_);
  const auto channel = grpc::CreateChannel(address_, grpc::InsecureChannelCredentials());
  EXPECT_TRUE(channel->WaitForConnected(std::chrono::system_clock::now() + std::chrono::minutes(1)))
      << TextOfFile(folder_.Path("log"));
}

void ReplicaProxy::Restart() {
  process_->Signal(SIGTERM);
  process_->Wait();
  Start();
}

}  // namespace wellspace::server
