#include "server/store/change_queue.h"

#include <utility>

namespace wellspace::server {
namespace {

// Of one transaction: enough that a synchronisation costs each little, and few enough that none waits for long.
constexpr size_t kMaxBatch = 256;
constexpr uint64_t kMaxBatchBytes = uint64_t{8} << 20;

uint64_t BytesOf(const SessionChange& change) {
  uint64_t bytes = change.answer.has_value() ? change.answer->ByteSizeLong() : 0;
  for (const store::v1::StepRecord& step : change.steps) {
    bytes += step.ByteSizeLong();
  }
  if (change.sizes.has_value()) {
    bytes += change.sizes->in_turn.bytes;
    for (const store::v1::SizesRecord& part : change.sizes->parts) {
      bytes += part.ByteSizeLong();
    }
  }
  return bytes;
}

}  // namespace

// The first call in the queue commits all that wait, while others come and wait behind. Then the next one is first.
absl::Status ChangeQueue::Apply(const SessionChange& change, Survives survives) {
  Waiting waiting{.change = &change, .survives = survives, .bytes = BytesOf(change)};
  std::unique_lock lock(mutex_);
  queue_.push_back(&waiting);
  waiting.changed.wait(lock, [&] { return waiting.is_done || queue_.front() == &waiting; });
  if (waiting.is_done) {
    return waiting.status;
  }
  const std::vector<Waiting*> batch = TakeBatch();
  std::vector<AnswerKey> forgotten = std::exchange(forgotten_, {});
  lock.unlock();

  ApplyBatch(batch, std::move(forgotten));

  lock.lock();
  for (Waiting* other : batch) {
    other->is_done = true;
    if (other != &waiting) {
      other->changed.notify_one();  // under the lock: it ends, with its condition variable, when the lock is free
    }
  }
  // All but the first leave the queue; that keeps the others waiting.
  queue_.erase(queue_.begin() + 1, queue_.begin() + static_cast<std::ptrdiff_t>(batch.size()));
  lock.unlock();

  after_group_();

  lock.lock();
  queue_.pop_front();
  if (!queue_.empty()) {
    queue_.front()->changed.notify_one();
  }
  return waiting.status;
}

std::vector<ChangeQueue::Waiting*> ChangeQueue::TakeBatch() {
  std::vector<Waiting*> batch;
  uint64_t bytes = 0;
  for (Waiting* waiting : queue_) {
    bytes += waiting->bytes;
    if (batch.size() == kMaxBatch || (!batch.empty() && bytes > kMaxBatchBytes)) {
      break;
    }
    batch.push_back(waiting);
  }
  return batch;
}

void ChangeQueue::ApplyBatch(std::span<Waiting* const> batch, std::vector<AnswerKey> forgotten) {
  const absl::Status status = ApplyAll(batch, forgotten);
  for (Waiting* waiting : batch) {
    waiting->status = status;
  }
  if (status.ok()) {
    return;
  }
  if (batch.size() > 1 && !IsFailure(status)) {
    // One of them may be at fault: each for itself, then.
    for (Waiting* const& waiting : batch) {
      waiting->status = ApplyAll({&waiting, 1}, forgotten);
      if (waiting->status.ok()) {
        forgotten.clear();
      }
    }
  }
  const std::lock_guard lock(mutex_);
  forgotten_.insert(forgotten_.begin(), forgotten.begin(), forgotten.end());
}

absl::Status ChangeQueue::ApplyAll(std::span<Waiting* const> batch, std::span<const AnswerKey> forgotten) {
  std::vector<const SessionChange*> changes;
  bool survives_power_loss = false;
  for (const Waiting* waiting : batch) {
    changes.push_back(waiting->change);
    survives_power_loss |= waiting->survives == Survives::kPowerLoss;
  }
  return apply_(changes, forgotten, survives_power_loss ? Survives::kPowerLoss : Survives::kProcessDeath);
}

void ChangeQueue::Forget(std::span<const AnswerKey> answers) {
  const std::lock_guard lock(mutex_);
  forgotten_.insert(forgotten_.end(), answers.begin(), answers.end());
}

}  // namespace wellspace::server
