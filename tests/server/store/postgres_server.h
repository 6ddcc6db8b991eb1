// A PostgreSQL of the test's own: Debian's programs, a folder that goes away, a free port.
#ifndef WELLSPACE_TESTS_SERVER_STORE_POSTGRES_SERVER_H_
#define WELLSPACE_TESTS_SERVER_STORE_POSTGRES_SERVER_H_

#include <sys/types.h>

#include <string>
#include <vector>

#include "tests/server/store/store_support.h"

namespace wellspace::server {

// Ends with the test, also with one that crashes.
//
// Thread safety: thread-compatible.
class PostgresServer {
 public:
  // The one of this test program, which is started when it is first asked for.
  //
  // REQUIRES:   WhyNot() is empty.
  static PostgresServer& OfThisProgram();

  // Why there can be none; empty: there can.
  static std::string WhyNot();

  // It listens at `host`, where a command runs that has `before` in front of it.
  //
  // REQUIRES:   WhyNot() is empty.
  explicit PostgresServer(std::string host = "127.0.0.1", std::vector<std::string> before = {});
  ~PostgresServer();
  PostgresServer(const PostgresServer&) = delete;
  PostgresServer& operator=(const PostgresServer&) = delete;

  // A database, as `role` reaches it.
  std::string AddressOf(const std::string& database, const std::string& role = "tester") const;
  // Of a new database.
  std::string NewDatabase();
  // Runs a statement, as the superuser.
  void Run(const std::string& statement, const std::string& database = "postgres") const;
  // The name of the last NewDatabase.
  std::string last_database() const;
  int port() const { return port_; }

  void Start();
  // As a crash does: its processes are killed, and what was committed is there at the next start.
  void Kill();

 private:
  std::vector<std::string> AsUser(std::vector<std::string> command) const;

  const std::string host_;
  const std::vector<std::string> before_;
  const TestFolder folder_;
  int port_ = 0;
  pid_t pid_ = -1;  // -1: it does not run
  int databases_ = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_STORE_POSTGRES_SERVER_H_
