// Changes that wait are applied together, so that they cost one synchronisation of the disk.
#ifndef WELLSPACE_SERVER_STORE_CHANGE_QUEUE_H_
#define WELLSPACE_SERVER_STORE_CHANGE_QUEUE_H_

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "server/store/records.h"

namespace wellspace::server {

// Whether it is not known, after this error, what is on the disk, or the store cannot be reached: no other change would
// fare better.
inline bool IsFailure(const absl::Status& status) { return absl::IsUnavailable(status) || absl::IsDataLoss(status); }

// Applies changes in groups: those that wait are one transaction. Where it fails, each is tried alone, so that a change
// which is refused costs itself only.
//
// Thread safety: thread-safe; one group is applied at a time.
class ChangeQueue {
 public:
  // Applies `changes`, and forgets `answers`, in one transaction: all or nothing.
  using ApplyTogether = std::function<absl::Status(std::span<const SessionChange* const> changes,
                                                   std::span<const AnswerKey> answers, Survives survives)>;

  // `after_group` is called once a group is answered, before the next one.
  ChangeQueue(ApplyTogether apply, std::function<void()> after_group)
      : apply_(std::move(apply)), after_group_(std::move(after_group)) {}

  // As Records::Apply and Records::Forget.
  absl::Status Apply(const SessionChange& change, Survives survives);
  void Forget(std::span<const AnswerKey> answers);

 private:
  // A change, and the thread that waits for it.
  struct Waiting {
    const SessionChange* change = nullptr;
    Survives survives = Survives::kPowerLoss;
    uint64_t bytes = 0;
    bool is_done = false;
    absl::Status status{};
    std::condition_variable changed{};
  };

  std::vector<Waiting*> TakeBatch();
  void ApplyBatch(std::span<Waiting* const> batch, std::vector<AnswerKey> forgotten);
  absl::Status ApplyAll(std::span<Waiting* const> batch, std::span<const AnswerKey> forgotten);

  const ApplyTogether apply_;
  const std::function<void()> after_group_;
  std::mutex mutex_;
  // Guarded by mutex_.
  std::deque<Waiting*> queue_;  // the thread of the first commits for those behind it, too
  std::vector<AnswerKey> forgotten_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_CHANGE_QUEUE_H_
