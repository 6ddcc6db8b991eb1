// The sending half of a call whose answer is a stream.
#ifndef WELLSPACE_SERVER_CALLS_RESPONSE_STREAM_H_
#define WELLSPACE_SERVER_CALLS_RESPONSE_STREAM_H_

#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "grpc/grpc.h"
#include "server/calls/stall_watch.h"
#include "server/wire/errors.h"

namespace wellspace::server {

// Makes of `Base`, a Call whose reactor writes `Response`s, one that sends NextResponse's: each when the one
// before is on its way. Nothing is made for a client that does not read; one that takes longer than options.stall_limit
// over one response is dropped with DEADLINE_EXCEEDED.
//
// Thread safety: thread-safe, as Call.
// Invariants: as of Call, and one write is in flight at most.
template <typename Base, typename Response>
class ResponseStream : public Base {
 public:
  void OnWriteDone(bool ok) final;

 protected:
  using Base::Base;

  // The following are called with mutex_ held, and want it to be held when they are called.

  // The next response, or nothing: there is none yet, or the call was ended here, since all are sent.
  virtual std::optional<Response> NextResponse() = 0;

  // Writes the next response if there is one and no other is in flight. To be called whenever there may be one.
  void WriteNext();
  bool IsWriting() const final { return writing_; }

 private:
  // On the background thread, when a write may have taken too long.
  void CheckStall();

  // Guarded by mutex_.
  Response response_;  // of the write in flight
  bool writing_ = false;
  StallWatch stall_{this->environment().background, this->environment().options.stall_limit};
};

template <typename Base, typename Response>
void ResponseStream<Base, Response>::WriteNext() {
  if (writing_ || this->ending()) {
    return;
  }
  std::optional<Response> next = NextResponse();
  if (!next.has_value() || this->ending()) {
    return;
  }
  response_ = *std::move(next);
  writing_ = true;
  stall_.Begin(this->WeakCall(&ResponseStream::CheckStall));
  this->StartWrite(&response_);
}

template <typename Base, typename Response>
void ResponseStream<Base, Response>::OnWriteDone(bool ok) {
  std::lock_guard lock(this->mutex_);
  writing_ = false;
  stall_.End();
  if (this->ending()) {
    this->FinishNow();
  } else if (!ok) {
    this->End(absl::CancelledError("the client is gone"));
  } else {
    WriteNext();
  }
}

template <typename Base, typename Response>
void ResponseStream<Base, Response>::CheckStall() {
  std::lock_guard lock(this->mutex_);
  if (this->ending() || !stall_.IsStalled(this->WeakCall(&ResponseStream::CheckStall))) {
    return;
  }
  absl::Status status =
      MakeError(v1::ERROR_REASON_READER_STALLED,
                absl::StrCat("READER_STALLED: the client has not taken a message of the answer within ",
                             absl::FormatDuration(stall_.limit()), "; read it faster, or go on where it ended"));
  const std::string message = ToGrpcStatus(status).error_message();
  this->End(std::move(status));
  // Finish would wait behind the write. This sends code and message ahead of it, and ends the write. There are no
  // details then: clients know the reason by the beginning of the message.
  grpc_call_cancel_with_status(this->context()->c_call(), GRPC_STATUS_DEADLINE_EXCEEDED, message.c_str(), nullptr);
}

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_CALLS_RESPONSE_STREAM_H_
