// An operation: long work on a session, as its clients see it.
#ifndef WELLSPACE_SERVER_SESSIONS_OPERATION_H_
#define WELLSPACE_SERVER_SESSIONS_OPERATION_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "core/input/mesh_parameters.h"
#include "server/jobs/job.h"
#include "server/sessions/progress_pacer.h"
#include "wellspace/store/v1/records.pb.h"
#include "wellspace/v1/operations.pb.h"

namespace wellspace::server {

// State, events and end of one operation.
//
// Thread safety: thread-safe. Functions given to Watch run without any lock of this held, on the thread that made the
//                change.
// Invariants: (1) events are those of a ProgressPacer; (2) the last kKeptEvents are kept, once it has ended the last
// kEventsOfEnded; (3) of an operation that succeeded the last one is PHASE_DONE; (4) it ends once, and then nothing
// changes any more.
class Operation {
 public:
  static constexpr size_t kKeptEvents = 32;
  static constexpr size_t kEventsOfEnded = 8;

  // `name` is "sessions/{session}/operations/{number}"; `record` is that of NewOperation, or of Resumed; `parameters`
  // are its own, as the core takes them.
  Operation(std::string name, std::shared_ptr<const store::v1::OperationRecord> record,
            core::MeshParameters parameters);
  // The record for the next process, made of that in the log. An operation that had not ended waits for a worker again.
  static std::shared_ptr<const store::v1::OperationRecord> Resumed(
      std::shared_ptr<const store::v1::OperationRecord> record);

  const std::string& name() const { return name_; }
  uint64_t number() const { return number_; }
  // Without the sizes at points that it keeps to, which are the session's.
  const core::MeshParameters& parameters() const { return parameters_; }
  bool restart() const { return restart_; }
  v1::Operation Describe() const;
  // The same of one that is known by its record alone, with its last event if it has ended.
  static v1::Operation Describe(const std::string& name, const store::v1::OperationRecord& record);
  bool IsQueued() const;
  bool HasEnded() const;
  // Whether a client has asked for its end.
  bool IsCancelled() const;
  // Whether a process died while it worked at it.
  bool IsSuspect() const;
  // Whether more than one did: the next try decides whether it is to blame.
  bool RunsAlone() const;

  // The first kept event that is later than number `after`; nothing: there is none.
  std::optional<v1::ProgressEvent> EventAfter(std::optional<uint64_t> after) const;

  // Calls `on_change` after every event and after the end, until Unwatch; a call may still be on its way then.
  uint64_t Watch(std::function<void()> on_change);
  void Unwatch(uint64_t watch);

  // The job that does the work, or will. False, and nothing is changed, if the operation has ended already: the job is
  // to be cancelled.
  [[nodiscard]] bool SetJob(std::shared_ptr<Job> job);
  // Null before it is known, and again once the operation has ended. One that runs has a job.
  std::shared_ptr<Job> job() const;

  // Makes an event of the job's progress if one is due; false once it has ended. To be called every
  // ProgressPacer::kMinInterval; `now` is a time since boot.
  bool Tick(absl::Duration now);

  // The records for the log: of the operation as it is now, or as it is once Apply has taken the record.
  store::v1::OperationRecord Record() const;
  store::v1::OperationRecord RecordOfStart(absl::Time now) const;
  // The figures are those of the new mesh.
  store::v1::OperationRecord RecordOfSuccess(absl::Time now, uint64_t mesh_revision, uint64_t vertices,
                                             uint64_t simplices) const;
  // CANCELLED if that is the code of `status`, else FAILED.
  store::v1::OperationRecord RecordOfFailure(absl::Time now, const absl::Status& status) const;
  // A client has asked for its end.
  store::v1::OperationRecord RecordOfCancel() const;
  // It is left to the next process, which counts no death of this one.
  store::v1::OperationRecord RecordOfParking() const;

  // Of one that was written down: why its work is not done again; OK if it is.
  //
  // Errors:     CANCELLED: a client has asked for its end; WORK_CRASHED.
  absl::Status RefusalToResume() const;

  // For its session, which starts it at most once, and ends it once: from now on it is as `record` says, which one of
  // the functions above has made, and is written down. Where that ends it, returns the job that it had, if any; Notify
  // is to be called then, without any lock.
  std::shared_ptr<Job> Apply(std::shared_ptr<const store::v1::OperationRecord> record);
  void Notify() const;

 private:
  // The following want mutex_ to be held.
  core::Progress Snapshot() const;
  void Keep(v1::ProgressEvent event);

  const std::string name_;
  const core::MeshParameters parameters_;
  const uint64_t number_;
  const bool restart_;
  const uint32_t crashes_;  // of the processes that have had it, those that died in its work before this one

  mutable std::mutex mutex_;
  // Guarded by mutex_.
  std::shared_ptr<const store::v1::OperationRecord> record_;
  std::shared_ptr<Job> job_;
  ProgressPacer pacer_;
  std::deque<v1::ProgressEvent> events_;
  uint64_t next_watch_ = 1;
  std::map<uint64_t, std::function<void()>> watches_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_OPERATION_H_
