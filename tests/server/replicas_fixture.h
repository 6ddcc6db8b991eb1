// Real servers that share a PostgreSQL and a folder.
#ifndef WELLSPACE_TESTS_SERVER_REPLICAS_FIXTURE_H_
#define WELLSPACE_TESTS_SERVER_REPLICAS_FIXTURE_H_

#include <chrono>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "gtest/gtest.h"
#include "tests/server/daemon.h"
#include "tests/server/session_calls.h"
#include "tests/server/store/postgres_server.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {

inline constexpr absl::Duration kLease = absl::Seconds(2);

inline std::string TextOfFile(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline SessionCalls CallsOf(Daemon& daemon) {
  return SessionCalls(grpc::CreateChannel(daemon.address(), grpc::InsecureChannelCredentials()));
}

class ReplicasTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = PostgresServer::WhyNot(); !why.empty()) {
      GTEST_SKIP() << why;
    }
    store_ = PostgresServer::OfThisProgram().NewDatabase();
  }

  std::vector<std::string> Options(const std::string& name) const {
    return {"--data",
            folder_.path(),
            "--store",
            store_,
            "--replica",
            name,
            "--lease",
            absl::StrCat(absl::ToDoubleSeconds(kLease)),
            "--log-level",
            "info",
            "--workers",
            "1",
            "--max-sessions-per-tenant",
            "1000000",
            "--max-sessions",
            "1000000"};
  }
  std::string ErrorPath(const std::string& name) const { return absl::StrCat(errors_.path(), "/", name); }
  std::unique_ptr<Daemon> Start(const std::string& name) const {
    return std::make_unique<Daemon>(Options(name), ErrorPath(name));
  }
  // Until `daemon` has the session, or a minute is over.
  static v1::Session AwaitSession(Daemon& daemon, const std::string& name) {
    SessionCalls calls = CallsOf(daemon);
    const absl::Time deadline = absl::Now() + absl::Minutes(1);
    grpc::Status status;
    v1::Session session;
    do {
      session = calls.Get(name, &status);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    } while (!status.ok() && absl::Now() < deadline);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return session;
  }
  // Makes a session that is refined.
  static std::string MakeSession(Daemon& daemon) {
    SessionCalls calls = CallsOf(daemon);
    const std::string name = calls.Create(2).name();
    calls.Upload(name, 0, UniformPoints(300, 2, 1));
    EXPECT_EQ(calls.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
    return name;
  }

  const TestFolder folder_;
  const TestFolder errors_;
  std::string store_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_REPLICAS_FIXTURE_H_
