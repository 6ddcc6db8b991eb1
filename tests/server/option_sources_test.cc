// Options of the real program from the command line, the environment and a file, and the output of --check-config.
#include <string>
#include <vector>

#include "client/client.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/daemon.h"
#include "tests/server/subprocess.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

struct Result {
  int code = -1;
  std::string out;
  std::string err;
};

// Runs a server that ends by itself, with `environment`, words VARIABLE=VALUE.
Result RunServer(const std::vector<std::string>& arguments, const std::string& environment = "") {
  const TemporaryFolder folder;
  Subprocess process("wellspaced", arguments, folder.Path("errors"),
                     AfterShell(environment.empty() ? ":" : "export " + environment));
  Result result;
  for (std::string line = process.ReadLine(); !line.empty(); line = process.ReadLine()) {
    result.out += line + "\n";
  }
  result.code = process.Wait();
  result.err = folder.Read("errors");
  return result;
}

TEST(OptionSources, TheCommandLineWinsThenTheEnvironmentThenTheFile) {
  const TemporaryFolder folder;
  const std::string file = folder.Write("wellspaced.toml", "max-points = 2\nmax-vertices = 1000\nworkers = 5\n");
  Daemon daemon({"--workers", "3", "--config", file}, "",
                AfterShell("export WELLSPACED_WORKERS=4 WELLSPACED_MAX_VERTICES=2000 WELLSPACED_LISTEN=127.0.0.1:1"));
  const absl::StatusOr<client::ServerInfo> info = daemon.Client().GetServerInfo();
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->workers, 3);
  EXPECT_EQ(info->max_vertices, 2000u);
  EXPECT_EQ(info->max_points, 2u);
  daemon.Stop();
}

TEST(OptionSources, EachOptionHasItsSource) {
  const TemporaryFolder folder;
  const std::string file = folder.Write("wellspaced.toml", "max-points = 2\nworkers = 5\n");
  const Result result = RunServer({"--check-config", "--config=" + file, "--max-memory=1GB"},
                                  "WELLSPACED_WORKERS=4 WELLSPACED_MAX_MEMORY=2GB WELLSPACED_EPHEMERAL=true "
                                  "WELLSPACED_DATA=/var/lib/wellspace WELLSPACED_MAX_TTL= WELLSPACED_OPTIONS=any");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.err, IsEmpty());
  EXPECT_THAT(result.out, AllOf(HasSubstr("max-points = 2  # file\n"), HasSubstr("workers = 4  # WELLSPACED_WORKERS\n"),
                                HasSubstr("max-memory = \"1GB\"  # command line\n"),
                                HasSubstr("ephemeral = true  # WELLSPACED_EPHEMERAL\n"),
                                HasSubstr("data = \"/var/lib/wellspace\"  # WELLSPACED_DATA\n"),
                                HasSubstr("max-ttl = 604800  # default\n"), HasSubstr("# token-file is not set\n"),
                                HasSubstr("tls-require-client-cert = false  # default\n")));
}

TEST(OptionSources, TheFileMayBeNamedByTheEnvironment) {
  const TemporaryFolder folder;
  const std::string file = folder.Write("wellspaced.toml", "max-points = 2\n");
  EXPECT_THAT(RunServer({"--check-config"}, "WELLSPACED_CONFIG=" + file).out, HasSubstr("max-points = 2  # file\n"));
  const Result gone = RunServer({"--listen", "127.0.0.1:0"}, "WELLSPACED_CONFIG=" + folder.Path("gone"));
  EXPECT_EQ(gone.code, 2);
  EXPECT_THAT(gone.err, HasSubstr(folder.Path("gone")));
}

TEST(OptionSources, WhatIsPrintedIsAFileOfOptions) {
  const TemporaryFolder folder;
  const std::string variables = "WELLSPACED_LOG_FORMAT=json WELLSPACED_DATA='/a \"b\"' WELLSPACED_MAX_QUEUED=7";
  const Result first = RunServer({"--check-config", "--insecure-remote"}, variables);
  ASSERT_EQ(first.code, 0) << first.err;
  const Result second = RunServer({"--check-config", "--config", folder.Write("printed.toml", first.out)});
  EXPECT_EQ(second.code, 0) << second.err;
  EXPECT_THAT(second.out, AllOf(HasSubstr("log-format = \"json\"  # file"), HasSubstr("max-queued = 7  # file"),
                                HasSubstr("insecure-remote = true  # file"), HasSubstr("grace = 10  # file")));
}

TEST(OptionSources, AVariableThatIsNoOptionIsRefusedWithTheNearest) {
  const Result wrong = RunServer({"--listen", "127.0.0.1:0"}, "WELLSPACED_MAX_MEMROY=secret");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("WELLSPACED_MAX_MEMROY in the environment is no option (did you mean "
                                   "WELLSPACED_MAX_MEMORY?)"));
  EXPECT_THAT(wrong.err, Not(HasSubstr("secret")));
  const Result far = RunServer({"--check-config"}, "WELLSPACED_PORT_7233_TCP_ADDR=10.0.0.1");
  EXPECT_EQ(far.code, 1);
  EXPECT_THAT(far.err, AllOf(HasSubstr("WELLSPACED_PORT_7233_TCP_ADDR in the environment is no option; variables"),
                             Not(HasSubstr("10.0.0.1"))));
  // Options of the process itself, which no file has either.
  EXPECT_EQ(RunServer({"--listen", "127.0.0.1:0"}, "WELLSPACED_CHECK_CONFIG=true").code, 2);
  EXPECT_EQ(RunServer({"--version"}, "WELLSPACE_WORKERS=4").code, 0);
}

TEST(OptionSources, AWrongValueNamesItsVariable) {
  const Result result = RunServer({"--listen", "127.0.0.1:0"}, "WELLSPACED_WORKERS=0");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.err, AllOf(HasSubstr("--workers"), HasSubstr("comes from WELLSPACED_WORKERS")));
  EXPECT_THAT(RunServer({"--listen=127.0.0.1:0", "--workers=0"}, "WELLSPACED_WORKERS=4").err,
              Not(HasSubstr("WELLSPACED_")));
  EXPECT_THAT(RunServer({}, "WELLSPACED_MAX_POINTS_PER_TENANT=none").err,
              HasSubstr("from WELLSPACED_MAX_POINTS_PER_TENANT"));
}

TEST(OptionSources, ACheckFindsWhatAStartWouldRefuse) {
  const TemporaryFolder folder;
  EXPECT_EQ(RunServer({"--check-config", "--workers", "0"}).code, 1);
  for (const std::vector<std::string>& wrong :
       std::vector<std::vector<std::string>>{{"--listen", "nonsense"},
                                             {"--listen", "0.0.0.0:7233"},
                                             {"--metrics-listen", "nonsense"},
                                             {"--admin-listen", "0.0.0.0:1"},
                                             {"--token-file", folder.Path("gone")},
                                             {"--token-file", folder.Write("tokens", "alice plain-text-of-a-token\n")},
                                             {"--tls-cert", folder.Path("gone"), "--tls-key", folder.Path("gone")}}) {
    std::vector<std::string> arguments = wrong;
    arguments.push_back("--check-config");
    const Result result = RunServer(arguments);
    EXPECT_EQ(result.code, 1) << wrong[0] << " " << wrong[1];
    EXPECT_THAT(result.err, StartsWith("wellspaced: "));
    EXPECT_THAT(result.out + result.err, Not(HasSubstr("plain-text-of-a-token")));
  }
}

TEST(OptionSources, APasswordInAnAddressIsNotPrinted) {
  const Result result = RunServer({"--check-config"}, "WELLSPACED_DATA=postgresql://user:se/cret@host/db");
  EXPECT_THAT(result.out, AllOf(HasSubstr("data = \"postgresql://user:***@host/db\""), Not(HasSubstr("cret"))));
  EXPECT_THAT(RunServer({"--check-config", "--data", "s3://bucket/a:b@c"}).out, HasSubstr("\"s3://bucket/a:b@c\""));
  const Result behind = RunServer({"--check-config", "--data", "folder"},
                                  "WELLSPACED_STORE='postgresql://host/db?password=secret&sslpassword=cret&user=me'");
  EXPECT_THAT(behind.out, AllOf(HasSubstr("db?password=***&sslpassword=***&user=me"), Not(HasSubstr("cret"))));
  EXPECT_EQ(behind.code, 0);
}

// An address that is none is not repeated, since its password may be where none belongs.
TEST(OptionSources, AStoreWantsAnAddressAndAFolder) {
  const Result wrong = RunServer({"--data", "folder", "--store", "postgresql://user:se%cret@host/db"});
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.err,
              AllOf(HasSubstr("--store"), HasSubstr("postgresql://USER:PASSWORD@HOST"), Not(HasSubstr("cret"))));
  EXPECT_EQ(RunServer({"--data", "folder", "--store", "mysql://host/db"}).code, 2);
  const Result alone = RunServer({"--store", "postgresql://host/db"});
  EXPECT_EQ(alone.code, 2);
  EXPECT_THAT(alone.err, HasSubstr("--store wants --data"));
  EXPECT_EQ(RunServer({"--store", "postgresql://host/db", "--check-config"}).code, 1);
}

}  // namespace
}  // namespace wellspace::server
