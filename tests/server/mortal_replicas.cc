#include "tests/server/mortal_replicas.h"

#include <signal.h>

#include <chrono>
#include <thread>
#include <utility>

namespace wellspace::server {

MortalReplicas::MortalReplicas(std::vector<Place> places, absl::Duration lease, PostgresServer& database)
    : places_(std::move(places)), lease_(lease), database_(database) {
  for (size_t i = 0; i < places_.size(); ++i) {
    servers_.emplace_back();
    Start(i);
    places_[i].address = servers_[i]->address();
  }
}

std::vector<std::string> MortalReplicas::addresses() const {
  std::vector<std::string> addresses;
  for (const Place& place : places_) {
    addresses.push_back(place.address);
  }
  return addresses;
}

void MortalReplicas::Start(size_t i) {
  const Place& place = places_[i];
  std::vector<std::string> options = place.options;
  options.insert(options.end(), {"--grace", "1", "--listen", place.address});
  servers_[i] = std::make_unique<Daemon>(options, place.error_path, place.before, Daemon::Listen::kAsTold);
}

void MortalReplicas::End(size_t i, int signal) {
  servers_[i]->process().Signal(signal);
  servers_[i]->process().Wait();
}

int MortalReplicas::StartEnded() {
  int started = 0;
  for (size_t i = 0; i < servers_.size(); ++i) {
    if (servers_[i]->process().HasEnded()) {
      EXPECT_EQ(servers_[i]->process().Wait(), 1) << "it says why, in " << places_[i].error_path;
      Start(i);
      ++started;
    }
  }
  return started;
}

void MortalReplicas::Stop() {
  for (const auto& server : servers_) {
    server->Stop();
  }
}

void MortalReplicas::StandStill(size_t i) {
  servers_[i]->process().Signal(SIGSTOP);
  std::this_thread::sleep_for(absl::ToChronoMilliseconds(lease_ + absl::Seconds(2)));
  servers_[i]->process().Signal(SIGCONT);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // it answers those who have waited for it
}

std::vector<Fault> MortalReplicas::Faults() {
  return {{"killed",
           [this](size_t i) {
             End(i, SIGKILL);
             Start(i);
           }},
          {"drained",
           [this](size_t i) {
             End(i, SIGTERM);
             Start(i);
           }},
          {"stood still",
           [this](size_t i) {
             StandStill(i);
             End(i, SIGTERM);
             Start(i);
           }},
          {"database killed", [this](size_t) {
             database_.Kill();
             database_.Start();
           }}};
}

}  // namespace wellspace::server
