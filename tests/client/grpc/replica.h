// A server of any calls, one of several that share their sessions, that answers as a test says.
#ifndef WELLSPACE_TESTS_CLIENT_GRPC_REPLICA_H_
#define WELLSPACE_TESTS_CLIENT_GRPC_REPLICA_H_

#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/generic/async_generic_service.h"
#include "grpcpp/grpcpp.h"

namespace wellspace::client {

// The error of a server that has not the session; `address`: of the one that has it, "" if that is not known.
inline grpc::Status Elsewhere(const std::string& address) {
  google::rpc::ErrorInfo info;
  info.set_reason("ERROR_REASON_SESSION_ELSEWHERE");
  if (!address.empty()) {
    (*info.mutable_metadata())["address"] = address;
  }
  google::rpc::Status details;
  details.add_details()->PackFrom(info);
  return grpc::Status(grpc::StatusCode::UNAVAILABLE, "the session is elsewhere", details.SerializeAsString());
}

// One call as it came.
struct Heard {
  std::string method;   // without its service
  std::string session;  // of the metadata; "" for none
  std::string authorization;
  std::string first_request;
};

struct Answer {
  std::vector<std::string> messages;
  grpc::Status status;
};

// Thread safety: thread-safe.
class Replica final : public grpc::CallbackGenericService {
 public:
  // The answer to a call whose first request has come, the others being thrown away.
  using Behaviour = std::function<Answer(const Heard&)>;

  explicit Replica(Behaviour behaviour, const std::string& listen = "127.0.0.1:0",
                   const std::shared_ptr<grpc::ServerCredentials>& credentials = grpc::InsecureServerCredentials())
      : behaviour_(std::move(behaviour)) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort(listen, credentials, &port_);
    builder.RegisterCallbackGenericService(this);
    server_ = builder.BuildAndStart();
  }
  ~Replica() override { Shutdown(); }

  void Shutdown() { server_->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(30)); }

  std::string address(const std::string& host = "127.0.0.1") const { return host + ":" + std::to_string(port_); }
  // By the network: gRPC crashes in calls within a process to a server that has ended.
  std::shared_ptr<grpc::Channel> Channel() const {
    return grpc::CreateChannel(address(), grpc::InsecureChannelCredentials());
  }

  void Become(Behaviour behaviour) {
    std::lock_guard lock(mutex_);
    behaviour_ = std::move(behaviour);
  }

  std::vector<Heard> heard() const {
    std::lock_guard lock(mutex_);
    return heard_;
  }
  // How many calls came since this was asked last.
  size_t NewCalls() {
    std::lock_guard lock(mutex_);
    return heard_.size() - std::exchange(told_, heard_.size());
  }

 private:
  class Call final : public grpc::ServerGenericBidiReactor {
   public:
    Call(Replica& replica, Heard heard) : replica_(replica), heard_(std::move(heard)) { StartRead(&request_); }

    void OnReadDone(bool ok) override {
      if (std::exchange(is_answered_, true)) {
        if (ok) {
          StartRead(&request_);
        }
        return;
      }
      if (ok) {
        heard_.first_request = TextOf(request_);
        StartRead(&request_);
      }
      Answer answer = replica_.Hear(heard_);
      messages_.assign(answer.messages.begin(), answer.messages.end());
      status_ = std::move(answer.status);
      Send();
    }
    void OnWriteDone(bool ok) override { ok ? Send() : Finish(grpc::Status::CANCELLED); }
    void OnDone() override { delete this; }

   private:
    static std::string TextOf(const grpc::ByteBuffer& buffer) {
      std::vector<grpc::Slice> slices;
      buffer.Dump(&slices);
      std::string text;
      for (const grpc::Slice& slice : slices) {
        text.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
      }
      return text;
    }
    void Send() {
      if (messages_.empty()) {
        Finish(status_);
        return;
      }
      const grpc::Slice slice(messages_.front());
      messages_.pop_front();
      message_ = grpc::ByteBuffer(&slice, 1);
      StartWrite(&message_);
    }

    Replica& replica_;
    Heard heard_;
    bool is_answered_ = false;
    std::deque<std::string> messages_;
    grpc::Status status_;
    grpc::ByteBuffer request_;
    grpc::ByteBuffer message_;
  };

  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext* context) override {
    const auto metadata = [context](const char* key) {
      const auto found = context->client_metadata().find(key);
      return found == context->client_metadata().end() ? "" : std::string(found->second.data(), found->second.size());
    };
    const std::string& method = context->method();
    return new Call(*this, {.method = method.substr(method.rfind('/') + 1),
                            .session = metadata("wellspace-session"),
                            .authorization = metadata("authorization"),
                            .first_request = ""});
  }

  Answer Hear(const Heard& heard) {
    Behaviour behaviour;
    {
      std::lock_guard lock(mutex_);
      heard_.push_back(heard);
      behaviour = behaviour_;
    }
    return behaviour(heard);
  }

  mutable std::mutex mutex_;
  Behaviour behaviour_;       // guarded by mutex_
  std::vector<Heard> heard_;  // guarded by mutex_
  size_t told_ = 0;           // guarded by mutex_
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace wellspace::client

#endif  // WELLSPACE_TESTS_CLIENT_GRPC_REPLICA_H_
