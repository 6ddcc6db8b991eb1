// The client's side of a call that streams requests and has one answer. Private to this folder.
#ifndef WELLSPACE_CLIENT_GRPC_REQUEST_WRITER_H_
#define WELLSPACE_CLIENT_GRPC_REQUEST_WRITER_H_

#include <functional>
#include <memory>

#include "grpcpp/completion_queue.h"
#include "grpcpp/support/async_stream.h"
#include "grpcpp/support/status.h"

namespace wellspace::client {

// A grpc::ClientWriter but for one thing: that aborts the process when the answer is no message of its type.
//
// Thread safety: thread-compatible.
template <typename Request>
class RequestWriter {
 public:
  using Stream = grpc::ClientAsyncWriter<Request>;

  // `prepare` makes the call on the queue that it is given, without starting it.
  explicit RequestWriter(const std::function<std::unique_ptr<Stream>(grpc::CompletionQueue*)>& prepare)
      : stream_(prepare(&queue_)) {
    stream_->StartCall(nullptr);
    Wait();
  }

  // REQUIRES:   Finish has returned.
  ~RequestWriter() {
    queue_.Shutdown();
    while (Wait()) {
    }
  }
  RequestWriter(const RequestWriter&) = delete;
  RequestWriter& operator=(const RequestWriter&) = delete;

  // False when the call has ended; Finish says how.
  bool Write(const Request& request) {
    stream_->Write(request, nullptr);
    return Wait();
  }
  bool WritesDone() {
    stream_->WritesDone(nullptr);
    return Wait();
  }

  // Waits for the end of the call. The answer is there if it is OK. To be called once.
  grpc::Status Finish() {
    grpc::Status status;
    stream_->Finish(&status, nullptr);
    return !Wait() && status.ok()
               ? grpc::Status(grpc::StatusCode::DATA_LOSS, "the server's answer is damaged: no message")
               : status;
  }

 private:
  bool Wait() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.Next(&tag, &ok) && ok;
  }

  grpc::CompletionQueue queue_;
  const std::unique_ptr<Stream> stream_;
};

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_GRPC_REQUEST_WRITER_H_
