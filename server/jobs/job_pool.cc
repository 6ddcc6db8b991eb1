#include "server/jobs/job_pool.h"

#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/jobs/memory_admission.h"
#include "server/wire/errors.h"

namespace wellspace::server {

JobPool::JobPool(const Limits& limits, MemoryBudget& memory, OnTime on_time)
    : limits_(limits), memory_(memory), on_time_(std::move(on_time)) {
  memory_.SetReleaseListener([this] {
    std::lock_guard lock(mutex_);
    Dispatch();
  });
  std::lock_guard lock(mutex_);
  for (size_t i = 0; i < Workers() && limits_.run_by == RunBy::kOwnThreads; ++i) {
    StartThread();
  }
}

JobPool::~JobPool() {
  memory_.SetReleaseListener(nullptr);
  std::map<uint64_t, std::shared_ptr<Job>> dropped;
  std::deque<std::shared_ptr<Job>> not_begun;
  std::unique_lock lock(mutex_);
  stopping_ = true;
  queue_ = FairQueue();
  alone_.clear();
  dropped.swap(queued_);
  not_begun.swap(started_);
  for (const auto& [sequence, job] : begun_) {
    job->Cancel();
    if (job->state_ == Job::State::kWaiting) {
      Resume(*job);
    }
  }
  wake_.notify_all();
  wake_.wait(lock, [this] { return threads_.empty(); });
  lock.unlock();
  for (std::thread& thread : ended_threads_) {
    thread.join();
  }
  const auto drop = [](Job& job) {
    job.Cancel();
    job.work_ = nullptr;
    job.ReleaseAll();
  };
  for (const auto& [sequence, job] : dropped) {
    drop(*job);
  }
  for (const std::shared_ptr<Job>& job : not_begun) {
    drop(*job);
  }
}

absl::StatusOr<std::shared_ptr<Job>> JobPool::Submit(JobRequest request) {
  const std::shared_ptr<Job> job(new Job(*this, std::move(request)));
  absl::Status refusal;
  {
    std::lock_guard lock(mutex_);
    refusal = CheckPlaceFor(*job);
    if (refusal.ok()) {
      ++PartOf(jobs_of_[job->tenant_], *job);
      small_jobs_ += job->is_small_ ? 1 : 0;
      job->sequence_ = next_sequence_++;
      if (job->is_alone_) {
        alone_.insert(job->sequence_);
      }
      AddToQueue(job);
      Dispatch();
      return job;
    }
  }
  job->work_ = nullptr;
  job->ReleaseAll();
  return refusal;
}

absl::Status JobPool::CheckPlaceFor(const Job& job) const {
  const size_t small = small_jobs_;
  const size_t all = queue_.size() + running_ + running_small_;
  const bool has_place = job.is_small_ ? small < static_cast<size_t>(limits_.small_workers) + limits_.max_queued
                                       : all - small < static_cast<size_t>(limits_.workers) + limits_.max_queued;
  if (stopping_ || !has_place) {
    return MakeError(v1::ERROR_REASON_QUEUE_FULL,
                     absl::StrCat("this server runs ", running_ + running_small_, " jobs and has ", queue_.size(),
                                  " more in line, which is all that it takes; try again later"));
  }
  const auto known = jobs_of_.find(job.tenant_);
  const Share share = known == jobs_of_.end() ? Share() : known->second;
  if (const int of_tenant = job.is_small_ ? share.small : share.others; of_tenant >= limits_.max_per_tenant) {
    return MakeError(v1::ERROR_REASON_QUOTA_EXCEEDED,
                     absl::StrCat(of_tenant, " jobs of this tenant run or are in line; it may have ",
                                  limits_.max_per_tenant, "; try again later"));
  }
  return absl::OkStatus();
}

void JobPool::Cancel(const std::shared_ptr<Job>& job) {
  job->Cancel();
  Job::Work dropped;  // freed without the lock: it may hold much
  {
    std::lock_guard lock(mutex_);
    switch (job->state_) {
      case Job::State::kQueued:
        dropped = std::exchange(job->work_, nullptr);
        RemoveFromQueue(*job);
        EndOf(*job);
        break;
      case Job::State::kWaiting:  // it unwinds, whether there is a worker for it or not
        RemoveFromQueue(*job);
        Resume(*job);
        break;
      case Job::State::kRunning:
      case Job::State::kDone:
        return;
    }
    Dispatch();
  }
  if (dropped != nullptr) {
    dropped = nullptr;
    job->ReleaseAll();
  }
}

JobPool::Room JobPool::GetRoom() const {
  std::lock_guard lock(mutex_);
  Room room;
  if (stopping_ || !alone_.empty()) {
    return room;
  }
  room.jobs = std::max(0, limits_.workers - running_ - static_cast<int>(queue_.size()));
  for (const auto& [tenant, share] : jobs_of_) {
    if (std::max(share.small, share.others) >= limits_.max_per_tenant) {
      room.full_tenants.push_back(tenant);
    }
  }
  return room;
}

JobPool::Load JobPool::GetLoad() const {
  std::lock_guard lock(mutex_);
  return Load{.running = running_ + running_small_, .queued = static_cast<int>(queue_.size())};
}

JobPool::Counters JobPool::GetCounters() const {
  std::lock_guard lock(mutex_);
  return counters_;
}

bool JobPool::WaitUntilIdle(absl::Duration timeout) {
  const auto deadline = std::chrono::steady_clock::now() + absl::ToChronoNanoseconds(timeout);
  std::unique_lock lock(mutex_);
  return idle_.wait_until(lock, deadline, [this] { return jobs_of_.empty(); });
}

absl::Status JobPool::MemoryRefusal(uint64_t bytes) const { return memory_.Refusal(bytes, "the job"); }

absl::Status JobPool::Reserve(Job& job, uint64_t bytes) {
  WELLSPACE_RETURN_IF_ERROR(job.context_.Check());
  if (!FitsBesideSessions(bytes, job.KeptBytes(), memory_.lasting() - memory_.yielding(), memory_.limit())) {
    return MemoryRefusal(bytes);
  }
  if (job.ShrinkTo(bytes)) {
    return absl::OkStatus();
  }
  std::unique_lock lock(mutex_);
  if (std::exchange(job.is_refused_, false)) {
    return MemoryRefusal(bytes);
  }
  job.wanted_bytes_ = bytes;
  const bool is_given =
      job.is_small_ ? job.TakeWanted(kNoBound) : queue_.FindStarved() == nullptr && job.TakeWanted(GetRoomForTree());
  return is_given ? absl::OkStatus() : WaitInQueue(job, lock);
}

absl::Status JobPool::WaitInQueue(Job& job, std::unique_lock<std::mutex>& lock) {
  if (stopping_) {
    return job.context_.Check();
  }
  job.state_ = Job::State::kWaiting;
  AddToQueue(job.shared_from_this());
  --RunningLike(job);
  ++blocked_;
  if (threads_.size() - blocked_ < Workers()) {
    StartThread();
  }
  Dispatch();
  WaitFor(job, lock);
  --blocked_;
  wake_.notify_all();  // a thread may be one too many now
  WELLSPACE_RETURN_IF_ERROR(job.context_.Check());
  if (std::exchange(job.is_refused_, false)) {
    return MemoryRefusal(job.wanted_bytes_);
  }
  return absl::OkStatus();
}

void JobPool::WaitFor(Job& job, std::unique_lock<std::mutex>& lock) {
  while (true) {
    job.wake_.wait(lock, [&job] { return job.state_ == Job::State::kRunning || job.is_to_make_room_; });
    if (!std::exchange(job.is_to_make_room_, false)) {
      return;
    }
    const uint64_t room = job.state_ == Job::State::kRunning ? 0 : RoomFor(job);
    if (room > 0) {
      lock.unlock();
      (void)memory_.MakeRoom(room, MemoryBudget::Want::kAsMuchAsPossible);  // released memory is dispatched
      lock.lock();
    }
    is_making_room_ = false;
    Dispatch();
  }
}

void JobPool::Dispatch() {
  if (!alone_.empty() && started_.empty() && begun_.empty()) {
    Job& alone = *queued_.at(*alone_.begin());  // whatever it is behind
    Start(alone, alone.is_small_);
  }
  while (running_ < limits_.workers && !queue_.empty() && StartNext()) {
  }
  while (running_small_ < limits_.small_workers && StartSmall()) {
  }
  if (running_ < limits_.workers || running_small_ < limits_.small_workers) {
    (void)AskForRoom();
  }
  if (jobs_of_.empty()) {
    idle_.notify_all();
  }
}

bool JobPool::StartSmall() {
  const std::optional<uint64_t> small =
      queue_.FindSmall([this](const QueuedJob& queued) { return Admit(queued, kNoBound); });
  if (small.has_value()) {
    Start(*queued_.at(*small), /*small_worker=*/true);
  }
  return small.has_value();
}

bool JobPool::StartNext() {
  const uint64_t room_for_tree = GetRoomForTree();
  const Starved starved = StartStarved(room_for_tree);
  if (starved != Starved::kNone) {
    return starved == Starved::kStarted;
  }
  const std::optional<uint64_t> next =
      queue_.FindFirst([&](const QueuedJob& queued) { return Admit(queued, room_for_tree); });
  if (next.has_value()) {
    Start(*queued_.at(*next));
  }
  if (next.has_value() || StartOneWithATree()) {
    queue_.CountSkips();
    return true;
  }
  return RefuseVictim();
}

JobPool::Starved JobPool::StartStarved(uint64_t room_for_tree) {
  const QueuedJob* starved = queue_.FindStarved();
  if (starved == nullptr) {
    return Starved::kNone;
  }
  Job& job = *queued_.at(starved->sequence);
  if (Admit(*starved, room_for_tree)) {
    Start(job);
    return Starved::kStarted;
  }
  if (running_ + running_small_ > 0) {
    return Starved::kHoldsUp;
  }
  queue_.ForgetSkips(job.tenant_, job.sequence_);  // no job holds the memory that it waits for: others go on
  return Starved::kNone;
}

bool JobPool::StartOneWithATree() {
  for (const auto& [sequence, job] : begun_) {
    if (job->state_ == Job::State::kWaiting && job->TakeWanted(/*room_for_tree=*/0)) {
      Start(*job);
      return true;
    }
  }
  return false;
}

uint64_t JobPool::RoomFor(const Job& job) const {
  const JobMemory memory = job.GetMemory();
  if (!memory.is_waiting) {
    return 0;
  }
  const uint64_t unreserved = memory_.limit() - memory_.reserved();
  const uint64_t missing = memory.wanted - std::min(memory.wanted, memory.run);
  const uint64_t room_for_tree = memory.run > 0 || job.is_small_ ? kNoBound : GetRoomForTree();
  if (missing > room_for_tree) {  // the memory that jobs with trees wait for has to be free besides
    return unreserved + (missing - room_for_tree);
  }
  return missing > unreserved ? missing : 0;
}

bool JobPool::AskForRoom() {
  if (is_making_room_ || !memory_.CanMakeRoom()) {
    return is_making_room_;
  }
  const auto ask = [this](Job& job) {
    if (RoomFor(job) == 0) {
      return false;
    }
    job.is_to_make_room_ = true;
    is_making_room_ = true;
    job.wake_.notify_one();
    return true;
  };
  const QueuedJob* starved = queue_.FindStarved();
  if (starved != nullptr && ask(*queued_.at(starved->sequence))) {
    return true;
  }
  return std::ranges::any_of(queued_, [&](const auto& queued) { return ask(*queued.second); });
}

bool JobPool::RefuseVictim() {
  if (running_ + running_small_ > 0 || AskForRoom()) {
    return false;
  }
  const uint64_t passing = memory_.passing();
  std::vector<JobMemory> queued;
  for (const auto& [sequence, job] : queued_) {
    queued.push_back(job->GetMemory());
  }
  const std::optional<uint64_t> victim = VictimOfDeadlock(passing, queued);
  if (victim.has_value()) {
    Job& job = *queued_.at(*victim);
    job.is_refused_ = true;
    Start(job);
  }
  return victim.has_value();
}

bool JobPool::Admit(const QueuedJob& queued, uint64_t room_for_tree) {
  if (queued.waits_for_memory) {
    return queued_.at(queued.sequence)->TakeWanted(room_for_tree);
  }
  return alone_.empty();
}

void JobPool::Start(Job& job, bool small_worker) {
  queue_.Start(job.tenant_, job.sequence_);
  std::shared_ptr<Job> started = std::move(queued_.extract(job.sequence_).mapped());
  job.has_small_worker_ = small_worker;
  if (job.state_ == Job::State::kWaiting) {
    Resume(job);
    return;
  }
  job.state_ = Job::State::kRunning;
  ++RunningLike(job);
  const absl::Duration waited = SinceBoot() - job.submitted_;
  Begun& begun = job.is_small_ ? counters_.small : counters_.others;
  ++begun.jobs;
  begun.waited += waited;
  begun.longest = std::max(begun.longest, waited);
  started_.push_back(std::move(started));
  wake_.notify_all();
}

void JobPool::Resume(Job& job) {
  job.state_ = Job::State::kRunning;
  ++RunningLike(job);
  job.wake_.notify_one();
}

uint64_t JobPool::GetRoomForTree() const {
  std::vector<JobMemory> begun;
  for (const auto& [sequence, job] : begun_) {
    begun.push_back(job->GetMemory());
  }
  return RoomForTree(memory_.limit() - memory_.reserved(), begun);
}

void JobPool::AddToQueue(const std::shared_ptr<Job>& job) {
  queue_.Add({.sequence = job->sequence_,
              .tenant = job->tenant_,
              .is_small = job->is_small_,
              .waits_for_memory = job->state_ == Job::State::kWaiting});
  queued_.emplace(job->sequence_, job);
}

void JobPool::RemoveFromQueue(const Job& job) {
  queue_.Remove(job.tenant_, job.sequence_);
  queued_.erase(job.sequence_);
}

void JobPool::EndOf(Job& job) {
  job.state_ = Job::State::kDone;
  alone_.erase(job.sequence_);
  small_jobs_ -= job.is_small_ ? 1 : 0;
  const auto of_tenant = jobs_of_.find(job.tenant_);
  --PartOf(of_tenant->second, job);
  if (of_tenant->second.small + of_tenant->second.others == 0) {
    jobs_of_.erase(of_tenant);
  }
}

void JobPool::StartThread() {
  for (std::thread& thread : ended_threads_) {
    thread.join();  // it has let go of the lock for the last time
  }
  ended_threads_.clear();
  const auto self = threads_.emplace(threads_.end());
  *self = std::thread([this, self] { RunWorker(self); });
}

void JobPool::RunWorker(std::list<std::thread>::iterator self) {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return stopping_ || !started_.empty() || HasSurplusThread(); });
    if (started_.empty()) {
      break;
    }
    RunFirst(lock);
  }
  ended_threads_.splice(ended_threads_.end(), threads_, self);
  wake_.notify_all();
}

void JobPool::RunFirst(std::unique_lock<std::mutex>& lock) {
  const std::shared_ptr<Job> job = std::move(started_.front());
  started_.pop_front();
  begun_.emplace(job->sequence_, job);
  Job::Work work = std::exchange(job->work_, nullptr);
  lock.unlock();
  job->TakeProcessorTime();
  work(*job);
  work = nullptr;
  if (on_time_ != nullptr) {
    on_time_(job->tenant_, job->TakeProcessorTime());
  }
  if (memory_.is_limited()) {
    malloc_trim(0);  // others may have its memory once the system has it
  }
  job->ReleaseAll();
  lock.lock();
  begun_.erase(job->sequence_);
  --RunningLike(*job);
  EndOf(*job);
  Dispatch();
}

bool JobPool::RunNext() {
  std::unique_lock lock(mutex_);
  if (started_.empty()) {
    return false;
  }
  RunFirst(lock);
  return true;
}

}  // namespace wellspace::server
