// The common part of all calls that we serve with a reactor of our own: admission and an end.
#ifndef WELLSPACE_SERVER_CALLS_CALL_H_
#define WELLSPACE_SERVER_CALLS_CALL_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "grpcpp/server_context.h"
#include "server/calls/call_environment.h"
#include "server/calls/routing_metadata.h"
#include "server/log/log_fields.h"
#include "server/security/authenticator.h"
#include "server/wire/errors.h"
#include "server/wire/hidden_folders.h"

namespace wellspace::server {

// The reactor of one call. `Reactor` is gRPC's, for the kind of call.
//
// Lifetime:   held by itself until OnDone, and by whatever else may still call it: its job and tasks of the background
//             thread.
// Thread safety: thread-safe: reactions, workers, the background thread and Abort may come at the same time.
// Invariants: (1) Finish is called once, not while IsWriting(); (2) once ending() is true, no read, write, job or task
//             is started any more; (3) the lock order is this call's mutex, then the mutexes of its parts.
template <typename Reactor>
class Call : public Reactor, public std::enable_shared_from_this<Call<Reactor>> {
 public:
  // Begins to serve `call`, which deletes itself, and returns it. To be called once.
  static Reactor* Begin(std::shared_ptr<Call> call);

  // Ends the call with UNAVAILABLE, since the server stops.
  void Abort();

  void OnCancel() final;
  void OnDone() final;

 protected:
  Call(const CallEnvironment& environment, grpc::CallbackServerContext* context)
      : environment_(environment), context_(context) {}

  // The following are called with mutex_ held, and want it to be held when they are called.

  // The call is admitted: its first work.
  virtual void OnBegin() = 0;
  // A write is in flight: Finish has to wait for it. When it is done and ending() is true, FinishNow is to be called.
  virtual bool IsWriting() const { return false; }
  // The call ends: its work is to be cancelled, and its resources can go.
  virtual void OnEnd() {}
  // The figures of the call in the log, besides its end.
  virtual LogFields Figures() const { return {}; }

  // Ends the call with `status`: now, or when the write in flight is done. Only the first call counts. Clients see it
  // as ToGrpcStatus makes it.
  void End(absl::Status status);
  void FinishNow();
  bool ending() const { return ending_; }

  const CallEnvironment& environment() const { return environment_; }
  grpc::CallbackServerContext* context() const { return context_; }
  uint64_t id() const { return id_; }
  // Constant from Begin on.
  const Caller& caller() const { return caller_; }

  // Calls `reserve`, and `then`, if it has succeeded. Where it fails for want of `bytes`, idle sessions give up memory
  // on a thread that may wait, and it is called once more, with mutex_ held. Ends the call with its last error.
  void ReserveThen(uint64_t bytes, const std::function<absl::Status()>& reserve, const std::function<void()>& then);

  // This, held, as the class that derives from it.
  template <typename Derived>
  std::shared_ptr<Derived> SharedAs() {
    return std::static_pointer_cast<Derived>(this->shared_from_this());
  }

  // A function that calls `member` of this, without holding it: no longer once the call is gone.
  template <typename Derived>
  std::function<void()> WeakCall(void (Derived::*member)()) {
    return [weak = this->weak_from_this(), member] {
      if (const std::shared_ptr<Call> locked = weak.lock()) {
        (static_cast<Derived*>(locked.get())->*member)();
      }
    };
  }

  std::mutex mutex_;

 private:
  // A client whose deadline passes cancels its call a moment before the same deadline, counted from the arrival of the
  // request, passes here. Only the log tells the two apart.
  static constexpr absl::Duration kDeadlineSlack = absl::Milliseconds(100);

  const CallEnvironment& environment_;
  grpc::CallbackServerContext* const context_;  // valid until OnDone
  uint64_t id_ = 0;
  Caller caller_;

  // Guarded by mutex_.
  std::shared_ptr<Call> self_;
  bool ending_ = false;
  absl::Status final_status_;
};

template <typename Reactor>
Reactor* Call<Reactor>::Begin(std::shared_ptr<Call> call) {
  std::lock_guard lock(call->mutex_);
  call->self_ = call;
  const CallRegistry::Admission admission = call->environment_.calls.Add(call->WeakCall(&Call::Abort));
  call->id_ = admission.id;
  absl::StatusOr<Caller> caller = call->environment_.authenticator.Authenticate(*call->context_);
  if (!caller.ok()) {
    call->End(std::move(caller).status());
    return call.get();
  }
  call->caller_ = *std::move(caller);
  if (admission.admitted) {
    call->OnBegin();
  } else {
    call->End(MakeError(v1::ERROR_REASON_SERVER_STOPPING, "the server is stopping and takes no new calls"));
  }
  return call.get();
}

template <typename Reactor>
void Call<Reactor>::Abort() {
  std::lock_guard lock(mutex_);
  End(MakeError(v1::ERROR_REASON_SERVER_STOPPING, "the server stopped before the answer was delivered"));
}

template <typename Reactor>
void Call<Reactor>::OnCancel() {
  std::lock_guard lock(mutex_);
  const bool late = absl::FromChrono(context_->deadline()) <= absl::Now() + kDeadlineSlack;
  End(late ? absl::DeadlineExceededError("the deadline of the call passed")
           : absl::CancelledError("the client cancelled the call or is gone"));
}

template <typename Reactor>
void Call<Reactor>::End(absl::Status status) {
  if (ending_) {
    return;
  }
  ending_ = true;
  final_status_ = std::move(status);
  OnEnd();
  if (!IsWriting()) {
    FinishNow();
  }
}

template <typename Reactor>
void Call<Reactor>::ReserveThen(uint64_t bytes, const std::function<absl::Status()>& reserve,
                                const std::function<void()>& then) {
  absl::Status status = reserve();
  if (status.ok()) {
    then();
  } else if (!environment_.memory.CanMakeRoom()) {
    End(std::move(status));
  } else {
    environment_.blocking.Run("", [self = this->shared_from_this(), bytes, reserve, then] {
      (void)self->environment_.memory.MakeRoom(bytes, MemoryBudget::Want::kAllOrNothing);
      std::lock_guard lock(self->mutex_);
      if (self->ending()) {
        return;
      }
      if (absl::Status again = reserve(); !again.ok()) {
        self->End(std::move(again));
      } else {
        then();
      }
    });
  }
}

template <typename Reactor>
void Call<Reactor>::FinishNow() {
  LogFields figures = Figures();
  if (const std::string cause(final_status_.message()); WithoutFolders(cause) != cause) {
    figures.Add("cause", cause);
  }
  if (const SessionOwnerOf owner = OwnerOf(final_status_); !owner.address.empty()) {
    context_->AddTrailingMetadata(kSessionMetadata, owner.session);
    context_->AddTrailingMetadata(kOwnerMetadata, owner.address);
  }
  environment_.observability.calls().Note(context_, figures);
  this->Finish(ToGrpcStatus(final_status_));
}

template <typename Reactor>
void Call<Reactor>::OnDone() {
  std::shared_ptr<Call> self;
  {
    std::lock_guard lock(mutex_);
    self = std::move(self_);
  }
  environment_.calls.Remove(id_);
  // The last one to hold the call deletes it.
}

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_CALLS_CALL_H_
