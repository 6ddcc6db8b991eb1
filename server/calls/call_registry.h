// The calls that are under way, for a server that wants to stop.
#ifndef WELLSPACE_SERVER_CALLS_CALL_REGISTRY_H_
#define WELLSPACE_SERVER_CALLS_CALL_REGISTRY_H_

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>

#include "absl/time/time.h"

namespace wellspace::server {

// Numbers calls, admits them until closed, aborts the calls that stay.
//
// Thread safety: thread-safe. The functions given to Add run without any lock held.
class CallRegistry {
 public:
  struct Admission {
    uint64_t id = 0;        // for Remove and the log; unique
    bool admitted = false;  // false once closed: the call must end at once
  };

  // Registers a call, admitted or not; `abort` must be callable until Remove and do no harm after it.
  Admission Add(std::function<void()> abort);
  void Remove(uint64_t id);

  // From now on no call is admitted.
  void Close();

  // Aborts all calls that are registered.
  void AbortAll();

  // Waits until no call is registered, but not longer than `timeout`; says whether none is.
  bool WaitUntilEmpty(absl::Duration timeout);

 private:
  std::mutex mutex_;
  std::condition_variable empty_;
  // Guarded by mutex_.
  bool closed_ = false;
  uint64_t next_id_ = 1;
  std::map<uint64_t, std::function<void()>> calls_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_CALLS_CALL_REGISTRY_H_
