// The receiving half of a call whose request is a stream.
#ifndef WELLSPACE_SERVER_CALLS_REQUEST_STREAM_H_
#define WELLSPACE_SERVER_CALLS_REQUEST_STREAM_H_

#include <mutex>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "grpcpp/support/byte_buffer.h"
#include "server/calls/stall_watch.h"
#include "server/wire/errors.h"

namespace wellspace::server {

// Makes of `Base`, a Call whose reactor reads bytes, one that is handed the requests. A client that takes longer than
// options.upload_stall_limit over one of them is dropped with DEADLINE_EXCEEDED: the memory that is set aside for what
// it may send is wanted by others.
//
// Thread safety: thread-safe, as Call.
// Invariants: as of Call, and one read is in flight at most.
template <typename Base>
class RequestStream : public Base {
 public:
  void OnReadDone(bool ok) final;

 protected:
  using Base::Base;

  // The following are called with mutex_ held, and want it to be held when they are called.

  // `bytes` has the next request; it may be taken apart. To end in ReadNext, or in the end of the call.
  virtual void OnRequest(grpc::ByteBuffer* bytes) = 0;
  // The client has sent all.
  virtual void OnRequestsEnd() = 0;

  void ReadNext();

 private:
  // On the background thread, when a read may have taken too long.
  void CheckStall();

  // Guarded by mutex_.
  grpc::ByteBuffer request_;  // of the read in flight
  StallWatch stall_{this->environment().background, this->environment().options.upload_stall_limit};
};

template <typename Base>
void RequestStream<Base>::ReadNext() {
  stall_.Begin(this->WeakCall(&RequestStream::CheckStall));
  this->StartRead(&request_);
}

template <typename Base>
void RequestStream<Base>::OnReadDone(bool ok) {
  std::lock_guard lock(this->mutex_);
  stall_.End();
  if (this->ending()) {
    return;
  }
  if (ok) {
    OnRequest(&request_);
  } else if (!this->context()->IsCancelled()) {
    OnRequestsEnd();
  }
  // Otherwise the client is gone, and OnCancel ends the call, at the latest right after this.
}

template <typename Base>
void RequestStream<Base>::CheckStall() {
  std::lock_guard lock(this->mutex_);
  if (!this->ending() && stall_.IsStalled(this->WeakCall(&RequestStream::CheckStall))) {
    this->End(MakeError(v1::ERROR_REASON_SENDER_STALLED,
                        absl::StrCat("the client has sent nothing for ", absl::FormatDuration(stall_.limit()),
                                     "; send faster, or use a session, whose upload can go on where it ended")));
  }
}

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_CALLS_REQUEST_STREAM_H_
