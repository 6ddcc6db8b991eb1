#include "server/jobs/job.h"

#include <utility>

#include "absl/cleanup/cleanup.h"
#include "core/base/processor_time.h"
#include "server/jobs/job_pool.h"

namespace wellspace::server {

Job::Job(JobPool& pool, JobRequest request)
    : pool_(pool),
      tenant_(std::move(request.tenant)),
      is_small_(request.is_small && pool.limits_.small_workers > 0),
      is_alone_(request.is_alone),
      of_call_(request.of_call),
      held_(std::move(request.held)),
      work_(std::move(request.work)) {
  if (pool_.memory_.is_limited()) {
    memory_ = pool_.memory_.ReserveNothing();
    context_.SetMemoryLender(this);
  }
}

void Job::Cancel() {
  context_.Cancel();
  std::lock_guard lock(apart_mutex_);
  if (apart_ != nullptr) {
    apart_->Cancel();
  }
}

absl::Status Job::RunApart(const std::function<absl::Status(core::RunContext&)>& run) {
  core::RunContext apart;
  if (context_.HasMemoryLender()) {
    apart.SetMemoryLender(this);
  }
  {
    std::lock_guard lock(apart_mutex_);
    apart_ = &apart;
    if (context_.IsCancelled()) {
      apart.Cancel();
    }
  }
  const absl::Cleanup end = [this] {  // after an exception, too
    std::lock_guard lock(apart_mutex_);
    apart_ = nullptr;
  };
  return run(apart);
}

absl::Duration Job::TakeProcessorTime() {
  const absl::Duration now = core::ProcessorTime();
  return now - std::exchange(time_taken_until_, now);
}

void Job::GiveMemory(MemoryReservation memory) {
  std::lock_guard lock(memory_mutex_);
  if (memory.bytes() > 0) {
    memory_ = std::move(memory);
  }
}

MemoryReservation Job::TakeMemory(uint64_t bytes) {
  std::lock_guard lock(memory_mutex_);
  return memory_.Split(bytes);
}

absl::Status Job::Reserve(uint64_t bytes) { return pool_.Reserve(*this, bytes); }

absl::Status Job::Allow(uint64_t bytes) {
  uint64_t missing = 0;
  if (TryToAllow(bytes, &missing) ||
      (pool_.memory_.MakeRoom(missing, MemoryBudget::Want::kAllOrNothing) && TryToAllow(bytes, &missing))) {
    return absl::OkStatus();
  }
  return pool_.MemoryRefusal(bytes);
}

bool Job::TryToAllow(uint64_t bytes, uint64_t* missing) {
  std::lock_guard lock(memory_mutex_);
  if (bytes <= memory_.bytes() || memory_.Resize(bytes + bytes / 8) || memory_.Resize(bytes)) {
    return true;
  }
  *missing = bytes - memory_.bytes();
  return false;
}

bool Job::TakeWanted(uint64_t room_for_tree) {
  std::lock_guard lock(memory_mutex_);
  const bool is_tree = memory_.bytes() == 0;
  if ((is_tree && wanted_bytes_ > room_for_tree) || !memory_.Resize(wanted_bytes_)) {
    return false;
  }
  has_all_ = !is_tree;
  return true;
}

JobMemory Job::GetMemory() const {
  std::lock_guard lock(memory_mutex_);
  return JobMemory{.sequence = sequence_,
                   .is_waiting = state_ == State::kWaiting,
                   .has_all = has_all_,
                   .wanted = wanted_bytes_,
                   .run = memory_.bytes(),
                   .freed = held_.passing_bytes() + memory_.passing_bytes(),
                   .of_call = of_call_};
}

uint64_t Job::KeptBytes() const {
  std::lock_guard lock(memory_mutex_);
  return memory_.kept_bytes();
}

bool Job::ShrinkTo(uint64_t bytes) {
  MemoryReservation spare;  // released without the lock
  std::lock_guard lock(memory_mutex_);
  if (bytes > memory_.bytes()) {
    return false;
  }
  spare = memory_.Split(memory_.bytes() - bytes);
  return true;
}

void Job::ReleaseAll() {
  MemoryReservation held;
  MemoryReservation memory;
  std::lock_guard lock(memory_mutex_);
  held = std::move(held_);
  memory = std::move(memory_);
}

}  // namespace wellspace::server
