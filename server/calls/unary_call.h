// Calls of one request and one response.
#ifndef WELLSPACE_SERVER_CALLS_UNARY_CALL_H_
#define WELLSPACE_SERVER_CALLS_UNARY_CALL_H_

#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "google/protobuf/message.h"
#include "grpcpp/support/server_callback.h"
#include "server/calls/call.h"
#include "server/calls/request_ids.h"
#include "server/calls/routing_metadata.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {

// Thread safety and invariants: as of Call.
class UnaryCall final : public Call<grpc::ServerUnaryReactor> {
 public:
  UnaryCall(const CallEnvironment& environment, grpc::CallbackServerContext* context) : Call(environment, context) {}

  // Serves a call that `handler` answers at once: absl::Status handler(const Caller&, Response&).
  template <typename Response, typename Handler>
  static grpc::ServerUnaryReactor* Serve(const CallEnvironment& environment, grpc::CallbackServerContext* context,
                                         Response* response, const Handler& handler) {
    const auto call = std::make_shared<UnaryCall>(environment, context);
    Begin(call);
    if (call->is_admitted_) {
      call->EndWith(RunGuarded([&] { return handler(call->caller(), *response); }));
    }
    return call.get();
  }

  // Serves a call that changes the session `key`, or none: absl::Status handler(const Caller&, const Request&,
  // Response&). Where the session log takes its time, it is asked on a thread that may wait for it, one call of a
  // session after the other.
  template <typename Request, typename Response, typename Handler>
  static grpc::ServerUnaryReactor* ServeChange(const CallEnvironment& environment, grpc::CallbackServerContext* context,
                                               const Request* request, Response* response, const std::string& key,
                                               const Handler& handler) {
    const auto call = std::make_shared<UnaryCall>(environment, context);
    Begin(call);
    if (call->is_admitted_) {
      Change(environment, key, *request, [call, response, handler](const Request& copy) {
        Response answer;
        absl::Status status = RunGuarded([&] { return handler(call->caller(), copy, answer); });
        call->EndWith({std::move(status), answer.SerializeAsString()}, *response);
      });
    }
    return call.get();
  }

  // As above, for a request with a request_id: `handler`, which is given it as its third argument, is asked once,
  // however often the call is repeated.
  template <typename Request, typename Response, typename Handler>
  static grpc::ServerUnaryReactor* ServeOnce(const CallEnvironment& environment, grpc::CallbackServerContext* context,
                                             const Request* request, Response* response, const std::string& key,
                                             const Handler& handler) {
    const auto call = std::make_shared<UnaryCall>(environment, context);
    Begin(call);
    if (call->is_admitted_) {
      const auto work = [&](const IdentifiedRequest& identified, const RequestIds::Done& done) {
        Change(environment, key, *request, [call, handler, identified, done](const Request& copy) {
          Response answer;
          absl::Status status = RunGuarded([&] { return handler(call->caller(), copy, identified, answer); });
          done({std::move(status), answer.SerializeAsString()});
        });
      };
      environment.request_ids.Once(
          call->caller().tenant, request->request_id(), *request, work,
          [call, response](const RequestIds::Answer& answer) { call->EndWith(answer, *response); });
    }
    return call.get();
  }

 private:
  void OnBegin() override { is_admitted_ = true; }

  // Runs `work` with `request`, at once or, with a copy of it, on a thread that may wait.
  template <typename Request, typename Work>
  static void Change(const CallEnvironment& environment, const std::string& key, const Request& request,
                     const Work& work) {
    if (environment.session_log.is_durable()) {
      environment.blocking.Run(key, [work, copy = std::make_shared<const Request>(request)] { work(*copy); });
    } else {
      work(request);
    }
  }

  void EndWith(absl::Status status) {
    std::lock_guard lock(mutex_);
    End(std::move(status));
  }

  void EndWith(const RequestIds::Answer& answer, google::protobuf::Message& response) {
    std::lock_guard lock(mutex_);
    if (ending()) {
      return;  // the response is gRPC's already
    }
    if (answer.status.ok()) {
      response.ParseFromString(answer.response);
      if (const auto* made = dynamic_cast<const v1::CreateSessionResponse*>(&response)) {
        const std::string& name = made->session().name();
        context()->AddInitialMetadata(kSessionMetadata, name.substr(name.find('/') + 1));
      }
    }
    End(answer.status);
  }

  bool is_admitted_ = false;  // set before the call is known to others
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_CALLS_UNARY_CALL_H_
