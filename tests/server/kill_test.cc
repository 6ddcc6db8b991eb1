// The real server, killed again and again among clients that go on: all that it has acknowledged is there.
#include <signal.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "absl/cleanup/cleanup.h"
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
  std::atomic<bool> is_over = false;
  std::vector<std::unique_ptr<Recorder>> clients;
  std::vector<std::jthread> threads;
  const absl::Cleanup end = [&] { is_over = true; };  // an exception, too, is no reason to wait for ever
  for (int i = 0; i < kClients; ++i) {
    clients.push_back(std::make_unique<Recorder>(std::vector<std::string>{server.address()}, i, is_over));
    threads.emplace_back([client = clients.back().get()] { client->Run(); });
  }
  for (int i = 0; i < kKills && !HasFailure(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 150));
    server.KillAndRestart();
  }
  is_over = true;
  int lives = 0;
  for (int i = 0; i < kClients; ++i) {
    threads[i].join();
    lives += clients[i]->lives();
  }
  EXPECT_GT(lives, 0);
  for (const auto& client : clients) {
    client->CheckAll();
  }
  EXPECT_EQ(server.Stop(), 0);
  const absl::StatusOr<DataReport> report = CheckData(folder.path());
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_TRUE(report->is_whole()) << report->problems[0];
  EXPECT_TRUE(report->unknown.empty()) << report->unknown[0];
  RecordProperty("sessions", lives);
}

}  // namespace
}  // namespace wellspace::server
