// Real servers that share a PostgreSQL, and what can happen to them.
#ifndef WELLSPACE_TESTS_SERVER_MORTAL_REPLICAS_H_
#define WELLSPACE_TESTS_SERVER_MORTAL_REPLICAS_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "tests/server/daemon.h"
#include "tests/server/recorder.h"
#include "tests/server/store/postgres_server.h"

namespace wellspace::server {

// Each comes back where clients look for it.
//
// Thread safety: thread-compatible.
class MortalReplicas {
 public:
  struct Place {
    std::vector<std::string> options;  // but for --listen
    std::string address;               // where it listens; port 0: where it came first
    std::string error_path;
    std::vector<std::string> before = {};  // see Subprocess
  };

  // Starts them. `lease`: theirs. REQUIRES: `database` outlives this.
  MortalReplicas(std::vector<Place> places, absl::Duration lease, PostgresServer& database);

  size_t size() const { return servers_.size(); }
  std::vector<std::string> addresses() const;
  Daemon& operator[](size_t i) { return *servers_[i]; }

  void Start(size_t i);
  // Ends it by this signal, and does not start it.
  void End(size_t i, int signal);
  // As a supervisor does: starts those that have ended by themselves. Returns how many.
  int StartEnded();
  // As an administrator does: all of them.
  void Stop();

  // One of them is killed, or drained, or stands still for longer than its lease; or the database is killed. Then it
  // is started again.
  std::vector<Fault> Faults();

 private:
  void StandStill(size_t i);

  std::vector<Place> places_;
  const absl::Duration lease_;
  PostgresServer& database_;
  std::vector<std::unique_ptr<Daemon>> servers_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_MORTAL_REPLICAS_H_
