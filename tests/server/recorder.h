// A client that notes acknowledged data, and compares.
#ifndef WELLSPACE_TESTS_SERVER_RECORDER_H_
#define WELLSPACE_TESTS_SERVER_RECORDER_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "gtest/gtest.h"
#include "tests/server/merged_history.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {

// Makes each call again, with the same request_id, until a server has answered it: of several servers, the one that has
// the session, or any.
//
// Thread safety: thread-compatible.
class Recorder {
 public:
  // `addresses`: of servers that share their sessions. `is_over`: when it is to end. `patience`: with one call, which
  // is made again behind it; zero: a call that is not answered in a minute is a failure.
  Recorder(const std::vector<std::string>& addresses, int number, const std::atomic<bool>& is_over,
           absl::Duration patience = absl::ZeroDuration());

  // Lives of sessions, one after the other, until the end.
  void Run();

  int lives() const { return lives_; }
  // Calls that went to another server than the one before, since that one had said where the session is.
  int redirected() const { return redirected_; }
  const std::vector<Acknowledgement>& told() const { return told_; }

  // Expects all acknowledged data to be there in the end.
  void CheckAll();

 private:
  struct Server {
    std::string address;
    std::unique_ptr<v1::SessionService::Stub> sessions;
    std::unique_ptr<v1::OperationService::Stub> operations;
    std::unique_ptr<v1::QueryService::Stub> queries;
  };
  struct Acknowledged {
    std::string name;
    std::string label;
    uint64_t points = 0;
    uint64_t revision = 0;
    uint64_t mesh_revision = 0;
    uint32_t mesh_crc32c = 0;
  };

  // Makes a call again until it has reached a server that lives, and has the session, and ended so. Any other error
  // than a server's death is a failure.
  bool Try(const std::function<grpc::Status(grpc::ClientContext&)>& call,
           grpc::StatusCode expected = grpc::StatusCode::OK);
  // Tells a proxy the session that a request is about.
  static void RouteBy(const google::protobuf::Message& request, grpc::ClientContext& context);
  // Asks another server from now on: the one that `status` names, if any.
  void Turn(const grpc::Status& status);

  template <typename Request, typename Response, typename Stub>
  std::optional<Response> Ask(std::unique_ptr<Stub> Server::*stub,
                              grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                              const Request& request) {
    Response response;
    const bool has_come = Try([&](grpc::ClientContext& context) {
      response.Clear();
      RouteBy(request, context);
      return ((*(server().*stub)).*method)(&context, request, &response);
    });
    return has_come ? std::optional<Response>(response) : std::nullopt;
  }

  const Server& server() const { return servers_[current_]; }
  std::string NextId();
  std::optional<v1::Session> Get(const std::string& name);
  void Expect(const Acknowledged& known);
  // Of all chunks of the mesh.
  uint32_t Checksum(const std::string& name, uint64_t revision);
  bool Create(Acknowledged& known);
  bool Upload(Acknowledged& known);
  bool Add(Acknowledged& known);
  bool Refine(Acknowledged& known);
  bool Update(Acknowledged& known);
  bool Delete(const Acknowledged& known);
  void Live();

  const std::string prefix_;
  std::minstd_rand random_;
  const std::atomic<bool>& is_over_;
  const absl::Duration patience_;
  std::vector<Server> servers_;
  size_t current_ = 0;  // of servers_: the one that is asked
  uint64_t next_id_ = 0;
  int lives_ = 0;
  int redirected_ = 0;
  std::vector<Acknowledged> kept_;
  std::vector<std::string> deleted_;
  std::vector<Acknowledgement> told_;
};

// What clients have done that go on while there are faults.
struct Recorded {
  int lives = 0;
  int redirected = 0;
  std::map<std::string, int> faults{};  // by their kinds
  std::vector<Acknowledgement> told{};  // of all clients
};

// Has `clients` clients of `addresses` live sessions, and calls fault(i) for i from 0 to `faults` - 1 meanwhile, until
// the first failure. Expects all acknowledged data to be there in the end. `patience`: see Recorder.
Recorded RecordAmongFaults(const std::vector<std::string>& addresses, int clients, int faults,
                           const std::function<void(int)>& fault, absl::Duration patience = absl::ZeroDuration());

// Something that happens to one of several servers, or to all.
struct Fault {
  std::string kind;
  std::function<void(size_t which)> strike;
};

// The same with `count` faults, of each kind in turn, each a moment after the one before, of a server that is drawn.
// Prints what is drawn with, if anything fails.
Recorded RecordAmongFaults(const std::vector<std::string>& addresses, int clients, int count,
                           const std::vector<Fault>& faults, size_t servers,
                           absl::Duration patience = absl::ZeroDuration());

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_RECORDER_H_
