// Servers that share their sessions, behind HAProxy by deploy/haproxy-replicas.cfg: each call comes to the server that
// has its session.
#include <signal.h>

#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/client.h"
#include "client/mesh_sink.h"
#include "client/point_source.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/free_port.h"
#include "tests/server/mortal_replicas.h"
#include "tests/server/recorder.h"
#include "tests/server/replica_proxy.h"
#include "tests/server/replicas_fixture.h"
#include "tests/support/amount.h"

namespace wellspace::server {
namespace {

constexpr size_t kServers = ReplicaProxy::kServers;
constexpr int kClients = 3;
// Faults among clients that go on; the long test has more.
const int kFaults = test::Amount("WELLSPACE_FAULTS", 6);

// Servers and the proxy, each of which comes back where it was.
class ProxyTest : public ReplicasTest {
 protected:
  void SetUp() override {
    ReplicasTest::SetUp();
    if (IsSkipped()) {
      return;
    }
    if (const std::string why = ReplicaProxy::WhyNot(); !why.empty()) {
      GTEST_SKIP() << why;
    }
    std::vector<ReplicaProxy::Server> proxied;
    std::vector<MortalReplicas::Place> places;
    for (size_t i = 0; i < kServers; ++i) {
      const std::string name = absl::StrCat("mesh-", i + 1);
      proxied.push_back(
          {.address = absl::StrCat("127.0.0.1:", FreePort()), .metrics = absl::StrCat("127.0.0.1:", FreePort())});
      std::vector<std::string> options = Options(name);
      options.insert(options.end(), {"--metrics-listen", proxied[i].metrics});
      places.push_back({.options = options, .address = proxied[i].address, .error_path = ErrorPath(name)});
    }
    servers_ = std::make_unique<MortalReplicas>(std::move(places), kLease, PostgresServer::OfThisProgram());
    proxy_ = std::make_unique<ReplicaProxy>(absl::StrCat("127.0.0.1:", FreePort()), proxied);
  }

  // A client that knows the proxy alone.
  client::Client ProxiedClient() const {
    client::ConnectOptions options;
    options.follow = false;
    return client::Connect(proxy_->address(), options).value();
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
      CallsOf((*servers_)[i]).Get(name, &status);
      if (status.ok()) {
        return i;
      }
    }
    return kServers;
  }

  std::unique_ptr<MortalReplicas> servers_;
  std::unique_ptr<ReplicaProxy> proxy_;
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
  proxy_->Restart();
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
  servers_->End(owner, SIGKILL);
  const client::Mesh after = Download(client, name);
  EXPECT_EQ(after.points, before.points);
  EXPECT_EQ(after.simplices, before.simplices);
  EXPECT_NE(OwnerOf(name), owner);
  // The first is back, and what the proxy knew of it no longer holds.
  servers_->Start(owner);
  EXPECT_TRUE(client.AddVertices(name, std::vector<double>{0.501, 0.499}).ok());
  Refine(client, name);
  EXPECT_GT(Download(client, name).points.size(), before.points.size());
}

TEST_F(ProxyTest, NothingIsLostAmongClientsThatGoOn) {
  std::vector<Fault> faults = servers_->Faults();
  faults.push_back({"proxy restarted", [this](size_t) { proxy_->Restart(); }});
  const Recorded recorded = RecordAmongFaults({proxy_->address()}, kClients, kFaults, faults, kServers);
  RecordProperty("sessions", recorded.lives);
}

}  // namespace
}  // namespace wellspace::server
