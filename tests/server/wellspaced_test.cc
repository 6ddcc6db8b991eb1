// The real program, with clients in other processes.
#include <signal.h>

#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "client/client.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/daemon.h"
#include "tests/server/patience.h"
#include "tests/server/subprocess.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

TEST(Wellspaced, MeshesAndStops) {
  for (const int signal : {SIGTERM, SIGINT}) {
    Daemon daemon;
    client::MeshOptions options;
    options.dimension = 2;
    const std::vector<double> points = {0, 0, 1, 0, 0.5, 0.75};
    const absl::StatusOr<client::Mesh> mesh = daemon.Client().MeshPoints(options, points);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_GE(mesh->points.size(), points.size());
    daemon.process().Signal(signal);
    EXPECT_EQ(daemon.process().Wait(), 0);
  }
}

TEST(Wellspaced, WithoutGraceEndsRunningCallsAtOnce) {
  Daemon daemon({"--grace", "0"});
  Subprocess client("endless_client", {daemon.address()});
  ASSERT_EQ(client.ReadLine(), "running");
  daemon.Stop();
  EXPECT_THAT(client.ReadLine(), HasSubstr("UNAVAILABLE: the server stopped before the answer was delivered"));
  EXPECT_EQ(client.Wait(), 1);
}

TEST(Wellspaced, AfterTheGracePeriodEndsRunningCalls) {
  Daemon daemon({"--grace", "0.2"});
  Subprocess client("endless_client", {daemon.address()});
  ASSERT_EQ(client.ReadLine(), "running");
  daemon.Stop();
  EXPECT_THAT(client.ReadLine(), HasSubstr("UNAVAILABLE: the server stopped before the answer was delivered"));
  EXPECT_EQ(client.Wait(), 1);
}

TEST(Wellspaced, ASecondSignalEndsItAtOnce) {
  Daemon daemon({"--grace", "3600"});
  Subprocess client("endless_client", {daemon.address()});
  ASSERT_EQ(client.ReadLine(), "running");
  daemon.process().Signal(SIGTERM);
  // Refused calls show that the first signal has been taken.
  client::CallOptions call;
  call.timeout = absl::Milliseconds(50);
  while (daemon.Client().MeshPoints({}, {}, nullptr, call).status().code() != absl::StatusCode::kUnavailable) {
  }
  daemon.process().Signal(SIGTERM);
  EXPECT_EQ(daemon.process().Wait(), -SIGTERM);
}

TEST(Wellspaced, AKilledClientFreesItsWorker) {
  Daemon daemon;
  client::Client observer = daemon.Client();
  Subprocess client("endless_client", {daemon.address()});
  ASSERT_EQ(client.ReadLine(), "running");
  EXPECT_EQ(observer.GetServerInfo()->running_jobs, 1);
  client.Signal(SIGKILL);
  const absl::Time killed = absl::Now();
  ASSERT_EQ(client.Wait(), -SIGKILL);
  while (observer.GetServerInfo()->running_jobs != 0 && absl::Now() - killed < absl::Minutes(1)) {
  }
  EXPECT_LE(absl::Now() - killed, kIdleWithin);
  daemon.Stop();
}

TEST(Wellspaced, AKilledServerIsAClearError) {
  Daemon daemon;
  Subprocess client("endless_client", {daemon.address()});
  ASSERT_EQ(client.ReadLine(), "running");
  daemon.process().Signal(SIGKILL);
  EXPECT_THAT(client.ReadLine(), HasSubstr("UNAVAILABLE"));
  EXPECT_EQ(client.Wait(), 1);
}

TEST(Wellspaced, HonoursItsLimits) {
  Daemon daemon({"--workers", "3", "--max-points", "2", "--max-vertices", "1000"});
  client::Client client = daemon.Client();
  const absl::StatusOr<client::ServerInfo> info = client.GetServerInfo();
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->workers, 3);
  EXPECT_EQ(info->max_points, 2u);
  EXPECT_EQ(info->max_vertices, 1000u);
  const std::vector<double> points(9);
  EXPECT_EQ(client.MeshPoints({}, points).status().code(), absl::StatusCode::kResourceExhausted);
}

TEST(Wellspaced, RefusesRemoteListenersAndNonsense) {
  EXPECT_EQ(Subprocess("wellspaced", {"--listen", "0.0.0.0:0"}).Wait(), 1);
  EXPECT_EQ(Subprocess("wellspaced", {"--listen", "nonsense"}).Wait(), 1);
  EXPECT_EQ(Subprocess("wellspaced", {"--workers", "0"}).Wait(), 2);
  EXPECT_EQ(Subprocess("wellspaced", {"--grace", "nan"}).Wait(), 2);
  EXPECT_EQ(Subprocess("wellspaced", {"--no-such-flag"}).Wait(), 2);
  Subprocess version("wellspaced", {"--version"});
  EXPECT_EQ(version.ReadLine(), "wellspaced " WELLSPACE_VERSION);
  EXPECT_EQ(version.Wait(), 0);
}

}  // namespace
}  // namespace wellspace::server
