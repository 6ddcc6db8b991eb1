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
#include "tests/support/temporary_folder.h"

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

// A file that is cut short by one of its bytes would start a server without its options, tokens among them.
TEST(Wellspaced, RefusesAConfigurationThatIsNoText) {
  const TemporaryFolder folder;
  const std::string key = "max-points = 2\n";
  const std::string comment = "# of wellspaced";
  for (const std::string& content :
       {std::string(100, '\0'), std::string(1, '\0') + key, key + std::string(1, '\0') + "\n" + key,
        comment + std::string(1, '\0') + "\n" + key, std::string("m\0a\0x\0\n\0", 8), comment + "\r" + key,
        comment + "\r\r\n" + key, comment + "\x1a\n" + key, comment + "\f" + key, comment + "\x7f\n" + key,
        key + "\r"}) {
    const std::string path = folder.Write("wellspaced.toml", content);
    Subprocess daemon("wellspaced", {"--config", path, "--listen", "127.0.0.1:0"}, folder.Path("errors"));
    EXPECT_EQ(daemon.ReadLine(), "");
    EXPECT_EQ(daemon.Wait(), 2);
    EXPECT_THAT(folder.Read("errors"), HasSubstr("expected TOML, text in UTF-8"));
    EXPECT_THAT(folder.Read("errors"), HasSubstr("--config: line "));
  }
  EXPECT_EQ(Subprocess("wellspaced", {"--config", folder.Path(""), "--listen", "127.0.0.1:0"}).Wait(), 2);
}

TEST(Wellspaced, TakesAConfigurationWithAnyEndsOfLinesAndLetters) {
  const TemporaryFolder folder;
  Daemon daemon({"--config", folder.Write("wellspaced.toml",
                                          "# Gr\xc3\xb6\xc3\x9f"
                                          "en\r\n\tmax-points = 2\r\n\r\n")});
  EXPECT_EQ(daemon.Client().GetServerInfo()->max_points, 2u);
  daemon.Stop();
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
