#include "tests/server/store/postgres_server.h"

#include <fcntl.h>
#include <pwd.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <pqxx/pqxx>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "tests/server/free_port.h"

namespace wellspace::server {
namespace {

namespace fs = std::filesystem;

// PostgreSQL does not run as root: as these users then.
constexpr const char* kUsers[] = {"postgres", "nobody"};

// The folder of the newest PostgreSQL; empty: there is none.
std::string Programs() {
  std::string newest;
  std::error_code error;
  for (const fs::directory_entry& version : fs::directory_iterator("/usr/lib/postgresql", error)) {
    const std::string bin = version.path() / "bin";
    if (fs::exists(bin + "/postgres") && fs::exists(bin + "/initdb")) {
      newest = std::max(newest, bin);
    }
  }
  return newest;
}

const passwd* User() {
  for (const char* const name : kUsers) {
    if (const passwd* const user = getpwnam(name); user != nullptr) {
      return user;
    }
  }
  return nullptr;
}

// Its output goes to `log`. It ends with this process.
pid_t Spawn(const std::vector<std::string>& command, const std::string& log) {
  std::vector<char*> arguments;
  for (const std::string& argument : command) {
    arguments.push_back(const_cast<char*>(argument.c_str()));
  }
  arguments.push_back(nullptr);
  const pid_t pid = fork();
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGINT);
    const int output = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
    dup2(output, STDOUT_FILENO);
    dup2(output, STDERR_FILENO);
    execvp(arguments[0], arguments.data());
    _exit(127);
  }
  return pid;
}

int WaitFor(pid_t pid) {
  int status = 0;
  waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

}  // namespace

std::string PostgresServer::WhyNot() {
  if (Programs().empty()) {
    return "PostgreSQL is not installed (deploy/install-deps.sh test)";
  }
  return geteuid() == 0 && User() == nullptr ? "there is no user but root for PostgreSQL to run as" : "";
}

PostgresServer& PostgresServer::OfThisProgram() {
  static PostgresServer server;
  return server;
}

PostgresServer::PostgresServer(std::string host, std::vector<std::string> before)
    : host_(std::move(host)), before_(std::move(before)) {
  if (geteuid() == 0) {
    EXPECT_EQ(chown(folder_.path().c_str(), User()->pw_uid, User()->pw_gid), 0);
  }
  const std::string log = folder_.path() + "-initdb.log";
  EXPECT_EQ(WaitFor(Spawn(AsUser({Programs() + "/initdb", "-D", folder_.path() + "/data", "-U", "tester", "-A", "trust",
                                  "-E", "UTF8", "--locale=C", "-N"}),
                          log)),
            0);
  fs::remove(log);
  std::ofstream(folder_.path() + "/data/pg_hba.conf", std::ios::app) << "host all all 10.0.0.0/8 trust\n";
  port_ = FreePort();
  Start();
}

PostgresServer::~PostgresServer() {
  if (pid_ > 0) {
    kill(pid_, SIGINT);
    WaitFor(pid_);
  }
  fs::remove(folder_.path() + "-server.log");
}

// Root gives its rights away first.
std::vector<std::string> PostgresServer::AsUser(std::vector<std::string> command) const {
  if (geteuid() != 0) {
    return command;  // `before` is root's
  }
  std::vector<std::string> whole = before_;
  whole.insert(whole.end(), {"setpriv", absl::StrCat("--reuid=", User()->pw_uid), "--clear-groups",
                             absl::StrCat("--regid=", User()->pw_gid), "--pdeathsig", "INT"});
  whole.insert(whole.end(), command.begin(), command.end());
  return whole;
}

void PostgresServer::Start() {
  ASSERT_LE(pid_, 0);
  pid_ = Spawn(AsUser({Programs() + "/postgres", "-D", folder_.path() + "/data", "-h", host_, "-p", absl::StrCat(port_),
                       "-k", folder_.path(), "-c", "fsync=off", "-c", "shared_buffers=16MB"}),
               folder_.path() + "-server.log");
  for (int attempt = 0; attempt < 600; ++attempt) {
    try {
      pqxx::connection(AddressOf("postgres"));
      return;
    } catch (const pqxx::broken_connection&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }
  FAIL() << "PostgreSQL does not start";
}

void PostgresServer::Kill() {
  kill(pid_, SIGQUIT);  // it ends at once, without a checkpoint, and takes its processes along
  WaitFor(pid_);
  pid_ = -1;
}

std::string PostgresServer::AddressOf(const std::string& database, const std::string& role) const {
  return absl::StrCat("postgresql://", role, "@", host_, ":", port_, "/", database);
}

std::string PostgresServer::NewDatabase() {
  ++databases_;
  Run("CREATE DATABASE " + last_database());
  return AddressOf(last_database());
}

std::string PostgresServer::last_database() const { return absl::StrCat("test", databases_); }

void PostgresServer::Run(const std::string& statement, const std::string& database) const {
  pqxx::connection connection(AddressOf(database));
  pqxx::nontransaction(connection).exec(statement);
}

}  // namespace wellspace::server
