// The real server, killed again and again among clients that go on: all that it has acknowledged is there.
#include <signal.h>

#include <chrono>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "server/store/check_data.h"
#include "server/store/data_folder.h"
#include "tests/server/recorder.h"
#include "tests/server/store/store_support.h"
#include "tests/server/subprocess.h"
#include "tests/support/amount.h"

namespace wellspace::server {
namespace {

// Deaths of the process; the long test has a thousand.
const int kKills = test::Amount("WELLSPACE_KILLS", 25);
constexpr int kClients = 4;

// wellspaced over one folder and on one port, from one death to the next.
class MortalServer {
 public:
  explicit MortalServer(std::string folder) : folder_(std::move(folder)) { Start("127.0.0.1:0"); }

  const std::string& address() const { return address_; }

  void KillAndRestart() {
    process_->Signal(SIGKILL);
    process_->Wait();
    Start(address_);
  }

  int Stop() {
    process_->Signal(SIGTERM);
    return process_->Wait();
  }

 private:
  void Start(const std::string& listen) {
    process_.emplace("wellspaced",
                     std::vector<std::string>{"--data", folder_, "--listen", listen, "--log-level", "error",
                                              "--max-sessions-per-tenant", "1000000", "--max-sessions", "1000000"});
    const std::string line = process_->ReadLine();
    const std::string prefix = "listening on ";
    ASSERT_EQ(line.substr(0, prefix.size()), prefix) << "it does not start";
    address_ = line.substr(prefix.size());
  }

  const std::string folder_;
  std::string address_;
  std::optional<Subprocess> process_;
};

TEST(Kill, WhatWasAcknowledgedIsThere) {
  const uint32_t seed = std::random_device()();
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  std::minstd_rand random(seed);
  const TestFolder folder;
  MortalServer server(folder.path());
  const Recorded recorded = RecordAmongFaults({server.address()}, kClients, kKills, [&](int /*kill*/) {
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 150));
    server.KillAndRestart();
  });
  EXPECT_EQ(server.Stop(), 0);
  const absl::StatusOr<DataReport> report = CheckData(folder.path());
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_TRUE(report->is_whole()) << report->problems[0];
  EXPECT_TRUE(report->unknown.empty()) << report->unknown[0];
  RecordProperty("sessions", recorded.lives);
}

}  // namespace
}  // namespace wellspace::server
