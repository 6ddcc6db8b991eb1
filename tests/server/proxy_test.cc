// Servers that share their sessions, behind HAProxy by deploy/haproxy-replicas.cfg: each call comes to the server that
// has its session.
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/client.h"
#include "client/mesh_sink.h"
#include "client/point_source.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/free_port.h"
#include "tests/server/recorder.h"
#include "tests/server/replicas_fixture.h"
#include "tests/support/amount.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {
namespace {

constexpr char kHaproxy[] = "/usr/sbin/haproxy";
constexpr size_t kServers = 3;
constexpr int kClients = 3;
// Faults among clients that go on; the long test has more.
const int kFaults = test::Amount("WELLSPACE_FAULTS", 6);

std::string DeployedConfiguration() {
  const char* const data = std::getenv("WELLSPACE_DATA_DIR");
  const std::filesystem::path deploy = std::filesystem::path(data == nullptr ? "tests/data" : data) / "../../deploy";
  return TextOfFile(deploy / "haproxy-replicas.cfg");
}

// Servers and the proxy, each of which comes back where it was.
class ProxyTest : public ReplicasTest {
 protected:
  void SetUp() override {
    ReplicasTest::SetUp();
    if (IsSkipped()) {
      return;
    }
    if (!std::filesystem::exists(kHaproxy)) {
      GTEST_SKIP() << "HAProxy is not installed (deploy/install-deps.sh test)";
    }
    for (size_t i = 0; i < kServers; ++i) {
      addresses_.push_back(absl::StrCat("127.0.0.1:", FreePort()));
      metrics_.push_back(absl::StrCat("127.0.0.1:", FreePort()));
      servers_.emplace_back();
      StartServer(i);
    }
    proxy_address_ = absl::StrCat("127.0.0.1:", FreePort());
    WriteConfiguration();
    StartProxy();
  }

  void StartServer(size_t i) {
    std::vector<std::string> options = Options(absl::StrCat("mesh-", i + 1));
    options.insert(options.end(), {"--grace", "1", "--listen", addresses_[i], "--metrics-listen", metrics_[i]});
    servers_[i] =
        std::make_unique<Daemon>(options, ErrorPath(absl::StrCat("mesh-", i + 1)), "", Daemon::Listen::kAsTold);
  }

  // The configuration that is deployed, with the places of this test, and without TLS.
  void WriteConfiguration() {
    std::string text = DeployedConfiguration();
    const auto replace = [&](const std::string& from, const std::string& to) {
      ASSERT_NE(text.find(from), std::string::npos) << from;
      text = absl::StrReplaceAll(text, {{from, to}});
    };
    replace(":7233 ssl crt /etc/wellspace/server-and-key.pem alpn h2", absl::StrCat(proxy_address_, " proto h2"));
    replace("/etc/haproxy/wellspace-owners.map", owners_.Path("owners.map"));
    replace("http-check connect port 9464 proto h1", "http-check connect proto h1");
    for (size_t i = 0; i < kServers; ++i) {
      const std::string named = absl::StrCat("mesh-", i + 1, ":7233");
      replace(absl::StrCat("server ", named, " ", named),
              absl::StrCat("server ", addresses_[i], " ", addresses_[i], " port ",
                           metrics_[i].substr(metrics_[i].find(':') + 1)));
    }
    std::ofstream(owners_.Path("haproxy.cfg")) << text;
  }

  // What it has learned is forgotten with it.
  void StartProxy() {
    std::ofstream(owners_.Path("owners.map"));
    proxy_ = std::make_unique<Subprocess>(kHaproxy, std::vector<std::string>{"-db", "-f", owners_.Path("haproxy.cfg")},
                                          owners_.Path("log"));
    const auto channel = grpc::CreateChannel(proxy_address_, grpc::InsecureChannelCredentials());
    EXPECT_TRUE(channel->WaitForConnected(std::chrono::system_clock::now() + std::chrono::minutes(1)))
        << TextOfFile(owners_.Path("log"));
  }
  void StopProxy() {
    proxy_->Signal(SIGTERM);
    proxy_->Wait();
  }

  // A client that knows the proxy alone.
  client::Client ProxiedClient() const {
    client::ConnectOptions options;
    options.follow = false;
    return client::Connect(proxy_address_, options).value();
  }

  // Makes a session that is refined, through the proxy.
  static std::string MakeBy(client::Client& client) {
    client::SessionOptions options;
    options.parameters.dimension = 2;
    const absl::StatusOr<client::Session> session = client.CreateSession(options);
    EXPECT_TRUE(session.ok()) << session.status();
    const std::vector<double> points = UniformPoints(100, 2, 1);
    client::SpanSource source(2, points);
    EXPECT_TRUE(client.UploadPoints(session->name, source).ok());
    Refine(client, session->name);
    return session->name;
  }
  static void Refine(client::Client& client, const std::string& name) {
    const absl::StatusOr<client::Operation> started = client.StartRefinement(name);
    ASSERT_TRUE(started.ok()) << started.status();
    const absl::StatusOr<client::Operation> ended = client.WatchOperation(started->name);
    ASSERT_TRUE(ended.ok()) << ended.status();
    EXPECT_EQ(ended->state, client::OperationState::kSucceeded);
  }
  static client::Mesh Download(client::Client& client, const std::string& name) {
    client::MeshCollector mesh;
    const absl::Status status = client.DownloadMesh(name, mesh);
    EXPECT_TRUE(status.ok()) << status;
    return std::move(mesh.mesh());
  }

  // The server that has a session; kServers if none says so.
  size_t OwnerOf(const std::string& name) {
    for (size_t i = 0; i < kServers; ++i) {
      grpc::Status status;
      CallsOf(*servers_[i]).Get(name, &status);
      if (status.ok()) {
        return i;
      }
    }
    return kServers;
  }

  // A fault of a server, of the database, or of the proxy.
  void Suffer(int fault, size_t which) {
    switch (fault % 5) {
      case 3:
        PostgresServer::OfThisProgram().Kill();
        PostgresServer::OfThisProgram().Start();
        return;
      case 4:
        StopProxy();
        StartProxy();
        return;
      case 2:
        servers_[which]->process().Signal(SIGSTOP);
        std::this_thread::sleep_for(absl::ToChronoMilliseconds(kLease + absl::Seconds(2)));
        servers_[which]->process().Signal(SIGCONT);
        std::this_thread::sleep_for(std::chrono::milliseconds(300));  // it answers those who have waited for it
        break;
      default:
        break;
    }
    servers_[which]->process().Signal(fault % 5 == 0 ? SIGKILL : SIGTERM);
    servers_[which]->process().Wait();
    StartServer(which);
  }

  const TemporaryFolder owners_;
  std::vector<std::string> addresses_;
  std::vector<std::string> metrics_;
  std::vector<std::unique_ptr<Daemon>> servers_;
  std::string proxy_address_;
  std::unique_ptr<Subprocess> proxy_;
};

TEST_F(ProxyTest, SessionsAreWhereTheyWereMade) {
  client::Client client = ProxiedClient();
  std::vector<std::string> names;
  std::set<size_t> owners;
  for (int i = 0; i < 9; ++i) {
    names.push_back(MakeBy(client));
    owners.insert(OwnerOf(names.back()));
  }
  EXPECT_FALSE(owners.contains(kServers));
  EXPECT_GE(owners.size(), 2u) << "new sessions go to several servers";
  // A proxy that knows of none is told by the servers.
  StopProxy();
  StartProxy();
  for (const std::string& name : names) {
    EXPECT_GT(Download(client, name).simplices.size(), 0u);
  }
  for (const std::string& name : names) {
    EXPECT_EQ(client.DeleteSession(name), absl::OkStatus());
    EXPECT_TRUE(absl::IsNotFound(client.GetSession(name).status()));
  }
}

// Calls find the server that has taken a session over, wherever the proxy sent them before.
TEST_F(ProxyTest, SessionsThatAreTakenOverAreFound) {
  client::Client client = ProxiedClient();
  const std::string name = MakeBy(client);
  const client::Mesh before = Download(client, name);
  const size_t owner = OwnerOf(name);
  ASSERT_LT(owner, kServers);
  servers_[owner]->process().Signal(SIGKILL);
  servers_[owner]->process().Wait();
  const client::Mesh after = Download(client, name);
  EXPECT_EQ(after.points, before.points);
  EXPECT_EQ(after.simplices, before.simplices);
  EXPECT_NE(OwnerOf(name), owner);
  // The first is back, and what the proxy knew of it no longer holds.
  StartServer(owner);
  EXPECT_TRUE(client.AddVertices(name, std::vector<double>{0.501, 0.499}).ok());
  Refine(client, name);
  EXPECT_GT(Download(client, name).points.size(), before.points.size());
}

TEST_F(ProxyTest, NothingIsLostAmongClientsThatGoOn) {
  const uint32_t seed = std::random_device()();
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  std::minstd_rand random(seed);
  const Recorded recorded = RecordAmongFaults({proxy_address_}, kClients, kFaults, [&](int i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200 + random() % 1000));
    Suffer(i, random() % kServers);
  });
  RecordProperty("sessions", recorded.lives);
}

}  // namespace
}  // namespace wellspace::server
