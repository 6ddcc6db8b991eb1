// Calls of gRPC's handlers without gRPC: in the thread of the test, one event at a time.
#ifndef WELLSPACE_TESTS_SERVER_HISTORIES_DIRECT_CALL_H_
#define WELLSPACE_TESTS_SERVER_HISTORIES_DIRECT_CALL_H_

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/server_callback.h"

namespace wellspace::server {

// A call as its client sees it, and the transport between the two.
//
// Thread safety: none.
// Invariants: the reactor is told of nothing while it calls: all is delivered by Deliver.
class DirectCall {
 public:
  virtual ~DirectCall() = default;
  DirectCall(const DirectCall&) = delete;
  DirectCall& operator=(const DirectCall&) = delete;

  // Tells the handler of the next thing that is due. False: there is nothing.
  virtual bool Deliver() = 0;
  // The client is gone.
  void Cancel() {
    if (!is_cancelled_ && !has_ended_) {
      is_cancelled_ = true;
      reactor_->OnCancel();
    }
  }

  // The handler is done with the call.
  bool has_ended() const { return has_ended_; }
  // Its end, as its client sees it; nothing: it has not, or its server had died before.
  const std::optional<grpc::Status>& status() const { return status_; }

 protected:
  // `is_alive`: whether the server's answers go out.
  explicit DirectCall(std::function<bool()> is_alive) : is_alive_(std::move(is_alive)) {}

  void Take(grpc::Status status) {
    is_finished_ = true;
    if (is_alive_()) {
      status_ = std::move(status);
    }
  }
  // The last thing that a handler is told.
  bool DeliverDone() {
    if (!is_finished_ || has_ended_) {
      return false;
    }
    has_ended_ = true;
    reactor_->OnDone();
    return true;
  }

  const std::function<bool()> is_alive_;
  grpc::CallbackServerContext context_;
  grpc::internal::ServerReactor* reactor_ = nullptr;
  bool is_cancelled_ = false;
  bool is_finished_ = false;
  bool has_ended_ = false;
  std::optional<grpc::Status> status_;
};

// One request, one response. `serve` is the handler.
template <typename Request, typename Response>
class DirectUnary final : public DirectCall, private grpc::ServerCallbackUnary {
 public:
  using Serve = std::function<grpc::ServerUnaryReactor*(grpc::CallbackServerContext*, const Request*, Response*)>;

  DirectUnary(std::function<bool()> is_alive, Request request, const Serve& serve)
      : DirectCall(std::move(is_alive)), request_(std::move(request)) {
    grpc::ServerUnaryReactor* reactor = serve(&context_, &request_, &response_);
    reactor_ = reactor;
    BindReactor(reactor);
  }

  bool Deliver() override { return DeliverDone(); }
  const Response& response() const { return response_; }

 private:
  void Finish(grpc::Status status) override { Take(std::move(status)); }
  void SendInitialMetadata() override {}
  grpc::internal::ServerReactor* reactor() override { return reactor_; }
  void CallOnDone() override {}

  const Request request_;
  Response response_;
};

// A stream of requests, and one response.
class DirectUpload final : public DirectCall, private grpc::ServerCallbackReader<grpc::ByteBuffer> {
 public:
  using Serve =
      std::function<grpc::ServerReadReactor<grpc::ByteBuffer>*(grpc::CallbackServerContext*, grpc::ByteBuffer*)>;

  // `breaks_off`: the client is gone when all requests have come.
  DirectUpload(std::function<bool()> is_alive, std::deque<grpc::ByteBuffer> requests, bool breaks_off,
               const Serve& serve)
      : DirectCall(std::move(is_alive)), requests_(std::move(requests)), breaks_off_(breaks_off) {
    grpc::ServerReadReactor<grpc::ByteBuffer>* reactor = serve(&context_, &response_);
    reactor_ = reactor;
    bound_ = reactor;
    BindReactor(reactor);
  }

  bool Deliver() override {
    if (wanted_ == nullptr) {
      return DeliverDone();
    }
    if (requests_.empty() && is_open_ && !is_finished_) {
      return false;
    }
    grpc::ByteBuffer* wanted = std::exchange(wanted_, nullptr);
    const bool comes = !requests_.empty() && !is_finished_;
    if (comes) {
      *wanted = std::move(requests_.front());
      requests_.pop_front();
    } else if (breaks_off_) {
      Cancel();
    }
    bound_->OnReadDone(comes);
    return true;
  }
  grpc::ByteBuffer& response() { return response_; }
  // Whether more requests may follow those that there are.
  void SetOpen(bool is_open) { is_open_ = is_open; }

 private:
  void Finish(grpc::Status status) override { Take(std::move(status)); }
  void SendInitialMetadata() override {}
  void Read(grpc::ByteBuffer* wanted) override { wanted_ = wanted; }
  grpc::internal::ServerReactor* reactor() override { return reactor_; }
  void CallOnDone() override {}

  std::deque<grpc::ByteBuffer> requests_;
  const bool breaks_off_;
  bool is_open_ = false;
  grpc::ByteBuffer response_;
  grpc::ServerReadReactor<grpc::ByteBuffer>* bound_ = nullptr;
  grpc::ByteBuffer* wanted_ = nullptr;  // of the read in flight
};

// One request, and a stream of responses.
template <typename Request, typename Response>
class DirectDownload final : public DirectCall, private grpc::ServerCallbackWriter<Response> {
 public:
  using Serve = std::function<grpc::ServerWriteReactor<Response>*(grpc::CallbackServerContext*, const Request*)>;

  DirectDownload(std::function<bool()> is_alive, Request request, const Serve& serve)
      : DirectCall(std::move(is_alive)), request_(std::move(request)) {
    bound_ = serve(&context_, &request_);
    reactor_ = bound_;
    this->BindReactor(bound_);
  }

  bool Deliver() override {
    if (!std::exchange(is_writing_, false)) {
      return DeliverDone();
    }
    bound_->OnWriteDone(true);
    return true;
  }
  // Those that have gone out.
  const std::vector<Response>& responses() const { return responses_; }

 private:
  void Finish(grpc::Status status) override { Take(std::move(status)); }
  void SendInitialMetadata() override {}
  void Write(const Response* response, grpc::WriteOptions /*options*/) override {
    is_writing_ = true;
    if (is_alive_()) {
      responses_.push_back(*response);
    }
  }
  void WriteAndFinish(const Response* response, grpc::WriteOptions options, grpc::Status status) override {
    Write(response, options);
    is_writing_ = false;
    Finish(std::move(status));
  }
  grpc::internal::ServerReactor* reactor() override { return reactor_; }
  void CallOnDone() override {}

  const Request request_;
  grpc::ServerWriteReactor<Response>* bound_ = nullptr;
  bool is_writing_ = false;
  std::vector<Response> responses_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_HISTORIES_DIRECT_CALL_H_
