#include "server/jobs/jobs.h"

#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <tuple>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

constexpr char kJob[] = "the job";

constexpr uint64_t kNoBound = std::numeric_limits<uint64_t>::max();  // of memory

}  // namespace

Job::Job(JobPool& pool, JobRequest request)
    : pool_(pool),
      tenant_(std::move(request.tenant)),
      is_small_(request.is_small && pool.limits_.small_workers > 0),
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

void Job::ReleaseHeld() {
  MemoryReservation released;  // without the lock
  std::lock_guard lock(memory_mutex_);
  released = std::move(held_);
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
  std::lock_guard lock(memory_mutex_);
  if (bytes <= memory_.bytes() || memory_.Resize(bytes + bytes / 8) || memory_.Resize(bytes)) {
    return absl::OkStatus();
  }
  return pool_.memory_.Refusal(bytes, kJob);
}

uint64_t Job::PassingBytes() const {
  std::lock_guard lock(memory_mutex_);
  return held_.passing_bytes() + memory_.passing_bytes();
}

uint64_t Job::RunBytes() const {
  std::lock_guard lock(memory_mutex_);
  return memory_.bytes();
}

void Job::ReleaseAll() {
  MemoryReservation held;
  MemoryReservation memory;
  std::lock_guard lock(memory_mutex_);
  held = std::move(held_);
  memory = std::move(memory_);
}

JobPool::JobPool(const Limits& limits, MemoryBudget& memory) : limits_(limits), memory_(memory) {
  memory_.SetReleaseListener([this] {
    std::lock_guard lock(mutex_);
    Dispatch();
  });
  std::lock_guard lock(mutex_);
  for (size_t i = 0; i < Workers(); ++i) {
    StartThread();
  }
}

JobPool::~JobPool() {
  memory_.SetReleaseListener(nullptr);
  std::map<std::string, Line> dropped;
  std::deque<std::shared_ptr<Job>> not_begun;
  std::unique_lock lock(mutex_);
  stopping_ = true;
  dropped.swap(lines_);
  turns_.clear();
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
  const auto drop = [](const std::shared_ptr<Job>& job) {
    job->Cancel();
    job->work_ = nullptr;
    job->ReleaseAll();
  };
  for (const auto& [tenant, line] : dropped) {
    std::for_each(line.begin(), line.end(), drop);
  }
  std::for_each(not_begun.begin(), not_begun.end(), drop);
}

JobPool::Submission JobPool::Submit(JobRequest request) {
  const std::shared_ptr<Job> job(new Job(*this, std::move(request)));
  grpc::Status refusal;
  {
    std::lock_guard lock(mutex_);
    const auto known = jobs_of_.find(job->tenant_);
    const int of_tenant = known == jobs_of_.end() ? 0 : PartOf(known->second, *job);
    if (stopping_ || !HasPlaceFor(*job)) {
      refusal = MakeError(v1::ERROR_REASON_QUEUE_FULL,
                          absl::StrCat("this server runs ", running_ + running_small_, " jobs and has ", InLine(),
                                       " more in line, which is all that it takes; try again later"));
    } else if (of_tenant >= limits_.max_per_tenant) {
      refusal = MakeError(v1::ERROR_REASON_QUOTA_EXCEEDED,
                          absl::StrCat(of_tenant, " jobs of this tenant run or are in line; it may have ",
                                       limits_.max_per_tenant, "; try again later"));
    } else {
      ++PartOf(jobs_of_[job->tenant_], *job);
      small_jobs_ += job->is_small_ ? 1 : 0;
      job->sequence_ = next_sequence_++;
      Enter(job);
      Dispatch();
      return Submission{.job = job, .refusal = {}};
    }
  }
  job->work_ = nullptr;
  job->ReleaseAll();
  return Submission{.job = nullptr, .refusal = std::move(refusal)};
}

bool JobPool::HasPlaceFor(const Job& job) const {
  const size_t small = small_jobs_;
  return job.is_small_
             ? small < static_cast<size_t>(limits_.small_workers) + limits_.max_queued
             : InLine() + running_ + running_small_ - small < static_cast<size_t>(limits_.workers) + limits_.max_queued;
}

void JobPool::Cancel(const std::shared_ptr<Job>& job) {
  job->Cancel();
  Job::Work dropped;  // freed without the lock: it may hold much
  {
    std::lock_guard lock(mutex_);
    switch (job->state_) {
      case Job::State::kQueued:
        dropped = std::exchange(job->work_, nullptr);
        Leave(*job);
        EndOf(*job);
        break;
      case Job::State::kWaiting:  // it unwinds, whether there is a worker for it or not
        Leave(*job);
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

JobPool::Load JobPool::GetLoad() const {
  std::lock_guard lock(mutex_);
  return Load{.running = running_ + running_small_, .queued = static_cast<int>(InLine())};
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

absl::Status JobPool::Reserve(Job& job, uint64_t bytes) {
  WELLSPACE_RETURN_IF_ERROR(job.context_.Check());
  const uint64_t lasting = memory_.lasting();
  {
    MemoryReservation spare;  // released without the locks
    std::lock_guard lock(job.memory_mutex_);
    const uint64_t own = job.memory_.bytes() - job.memory_.passing_bytes();
    if (bytes > memory_.limit() - std::min(lasting - std::min(lasting, own), memory_.limit())) {
      return memory_.Refusal(bytes, kJob);
    }
    if (bytes <= job.memory_.bytes()) {
      spare = job.memory_.Split(job.memory_.bytes() - bytes);
      return absl::OkStatus();
    }
  }
  std::unique_lock lock(mutex_);
  if (std::exchange(job.is_refused_, false)) {
    return memory_.Refusal(bytes, kJob);
  }
  job.wanted_bytes_ = bytes;
  if (job.is_small_ ? TakeWanted(job, kNoBound) : Claimant() == nullptr && TakeWanted(job, RoomForTree())) {
    return absl::OkStatus();
  }
  return WaitInLine(job, lock);
}

absl::Status JobPool::WaitInLine(Job& job, std::unique_lock<std::mutex>& lock) {
  if (stopping_) {
    return job.context_.Check();
  }
  job.state_ = Job::State::kWaiting;
  job.passed_over_ = 0;
  Enter(job.shared_from_this());
  --RunningLike(job);
  ++blocked_;
  if (threads_.size() - blocked_ < Workers()) {
    StartThread();
  }
  Dispatch();
  job.wake_.wait(lock, [&job] { return job.state_ == Job::State::kRunning; });
  --blocked_;
  wake_.notify_all();  // a thread may be one too many now
  WELLSPACE_RETURN_IF_ERROR(job.context_.Check());
  if (std::exchange(job.is_refused_, false)) {
    return memory_.Refusal(job.wanted_bytes_, kJob);
  }
  return absl::OkStatus();
}

void JobPool::Dispatch() {
  while (running_ < limits_.workers && !turns_.empty() && StartNext()) {
  }
  while (running_small_ < limits_.small_workers && StartSmall()) {
  }
  if (jobs_of_.empty()) {
    idle_.notify_all();
  }
}

bool JobPool::StartSmall() {
  for (const std::string& tenant : turns_) {
    for (const std::shared_ptr<Job>& job : lines_.at(tenant)) {
      if (job->is_small_ && (job->state_ == Job::State::kQueued || TakeWanted(*job, kNoBound))) {
        Start(std::shared_ptr<Job>(job), /*small_worker=*/true);  // the line may go
        return true;
      }
    }
  }
  return false;
}

bool JobPool::StartNext() {
  const uint64_t room_for_tree = RoomForTree();
  if (const std::shared_ptr<Job> claimant = Claimant(); claimant != nullptr) {
    if (StartFirstOf(claimant->tenant_, room_for_tree)) {
      return true;
    }
    if (running_ + running_small_ > 0) {
      return false;
    }
    claimant->passed_over_ = 0;  // what it waits for is no job's: others go on
  }
  for (const std::string& tenant : std::list<std::string>(turns_)) {
    if (StartFirstOf(tenant, room_for_tree)) {
      CountPassing();
      return true;
    }
  }
  if (StartOneWithATree()) {
    CountPassing();
    return true;
  }
  const std::shared_ptr<Job> victim = VictimOfDeadlock();
  if (victim == nullptr) {
    return false;
  }
  victim->is_refused_ = true;
  Start(victim);
  return true;
}

bool JobPool::StartFirstOf(const std::string& tenant, uint64_t room_for_tree) {
  const std::shared_ptr<Job> job = lines_.at(tenant).front();
  if (job->state_ == Job::State::kWaiting && !TakeWanted(*job, room_for_tree)) {
    return false;
  }
  Start(job);
  return true;
}

bool JobPool::StartOneWithATree() {
  for (const auto& [sequence, job] : begun_) {
    if (job->state_ == Job::State::kWaiting && TakeWanted(*job, 0)) {
      Start(job);
      return true;
    }
  }
  return false;
}

void JobPool::Start(const std::shared_ptr<Job>& job, bool small_worker) {
  Leave(*job);
  job->has_small_worker_ = small_worker;
  if (lines_.contains(job->tenant_)) {  // whose next job comes after those of others
    turns_.remove(job->tenant_);
    turns_.push_back(job->tenant_);
  }
  if (job->state_ == Job::State::kWaiting) {
    Resume(*job);
    return;
  }
  job->state_ = Job::State::kRunning;
  ++RunningLike(*job);
  const absl::Duration waited = SinceBoot() - job->submitted_;
  Begun& begun = job->is_small_ ? counters_.small : counters_.others;
  ++begun.jobs;
  begun.waited += waited;
  begun.longest = std::max(begun.longest, waited);
  started_.push_back(job);
  wake_.notify_all();
}

void JobPool::Resume(Job& job) {
  job.state_ = Job::State::kRunning;
  ++RunningLike(job);
  job.wake_.notify_one();
}

bool JobPool::TakeWanted(Job& job, uint64_t room_for_tree) {
  std::lock_guard lock(job.memory_mutex_);
  const bool begins = job.memory_.bytes() == 0;
  if ((begins && job.wanted_bytes_ > room_for_tree) || !job.memory_.Resize(job.wanted_bytes_)) {
    return false;
  }
  job.has_all_ = !begins;
  return true;
}

uint64_t JobPool::RoomForTree() const {
  struct Waiting {
    uint64_t needs;
    uint64_t frees;
  };
  std::vector<Waiting> waiting;
  uint64_t trees = 0;   // of runs that may want more
  uint64_t ending = 0;  // what those have that will not
  for (const auto& [sequence, job] : begun_) {
    const uint64_t frees = job->PassingBytes();
    if (job->state_ != Job::State::kWaiting) {
      (job->has_all_ ? ending : trees) += frees;
    } else if (const uint64_t has = job->RunBytes(); has > 0) {
      waiting.push_back({.needs = job->wanted_bytes_ - has, .frees = frees});
    }
  }
  std::ranges::sort(waiting, {}, &Waiting::needs);
  uint64_t room = memory_.limit() - memory_.reserved() + ending;
  uint64_t most = kNoBound;
  for (const Waiting& job : waiting) {
    if (job.needs > room + trees) {
      return kNoBound;
    }
    most = std::min(most, room - std::min(room, job.needs));
    room += job.frees;
  }
  return most;
}

void JobPool::CountPassing() {
  for (const auto& [tenant, line] : lines_) {
    if (line.front()->state_ == Job::State::kWaiting) {
      ++line.front()->passed_over_;
    }
  }
}

std::shared_ptr<Job> JobPool::Claimant() const {
  std::shared_ptr<Job> claimant;
  for (const auto& [tenant, line] : lines_) {
    const std::shared_ptr<Job>& first = line.front();
    if (first->state_ == Job::State::kWaiting && first->passed_over_ >= kMostPassing &&
        (claimant == nullptr || first->sequence_ < claimant->sequence_)) {
      claimant = first;
    }
  }
  return claimant;
}

std::shared_ptr<Job> JobPool::VictimOfDeadlock() const {
  if (running_ + running_small_ > 0) {
    return nullptr;
  }
  const uint64_t passing = memory_.passing();
  uint64_t in_line = 0;
  std::shared_ptr<Job> youngest;
  bool youngest_waits = false;
  for (const auto& [tenant, line] : lines_) {
    for (const std::shared_ptr<Job>& job : line) {
      const uint64_t frees = job->PassingBytes();
      in_line += frees;
      const bool waits = job->state_ == Job::State::kWaiting && frees > 0;
      if (youngest == nullptr || std::tie(waits, job->sequence_) > std::tie(youngest_waits, youngest->sequence_)) {
        youngest = job;
        youngest_waits = waits;
      }
    }
  }
  return passing <= in_line ? youngest : nullptr;
}

void JobPool::Enter(const std::shared_ptr<Job>& job) {
  Line& line = lines_[job->tenant_];
  if (line.empty()) {
    turns_.push_back(job->tenant_);
  }
  const auto younger = std::find_if(
      line.begin(), line.end(), [&](const std::shared_ptr<Job>& other) { return other->sequence_ > job->sequence_; });
  line.insert(younger, job);
}

void JobPool::Leave(const Job& job) {
  const auto line = lines_.find(job.tenant_);
  std::erase_if(line->second, [&job](const std::shared_ptr<Job>& other) { return other.get() == &job; });
  if (line->second.empty()) {
    lines_.erase(line);
    turns_.remove(job.tenant_);
  }
}

void JobPool::EndOf(Job& job) {
  job.state_ = Job::State::kDone;
  small_jobs_ -= job.is_small_ ? 1 : 0;
  const auto of_tenant = jobs_of_.find(job.tenant_);
  --PartOf(of_tenant->second, job);
  if (of_tenant->second.small + of_tenant->second.others == 0) {
    jobs_of_.erase(of_tenant);
  }
}

size_t JobPool::InLine() const {
  size_t count = 0;
  for (const auto& [tenant, line] : lines_) {
    count += line.size();
  }
  return count;
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
    const std::shared_ptr<Job> job = std::move(started_.front());
    started_.pop_front();
    begun_.emplace(job->sequence_, job);
    Job::Work work = std::exchange(job->work_, nullptr);
    lock.unlock();
    work(*job);
    work = nullptr;
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
  ended_threads_.splice(ended_threads_.end(), threads_, self);
  wake_.notify_all();
}

}  // namespace wellspace::server
