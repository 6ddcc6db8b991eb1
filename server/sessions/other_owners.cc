#include "server/sessions/other_owners.h"

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/base/clock.h"
#include "server/sessions/occupancy.h"
#include "server/sessions/session_registry.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// One piece of work of the thread.
class Turn {
 public:
  explicit Turn(std::atomic<int64_t>& begun_at) : begun_at_(begun_at) {
    begun_at_ = absl::ToInt64Nanoseconds(SinceBoot());
  }
  ~Turn() { begun_at_ = 0; }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  std::atomic<int64_t>& begun_at_;
};

absl::Status Unknown(const std::string& name) {
  return MakeError(v1::ERROR_REASON_STORE_FAILED,
                   absl::StrCat("it takes long to find out which server has ", name, "; try again"));
}

}  // namespace

void OtherOwners::Start() {
  if (records_.is_shared()) {
    thread_.emplace();
    thread_->PostAfter(kBetweenLooks, [this] { LookAgain(); });
  }
}

bool OtherOwners::IsLate() const {
  const int64_t begun_at = begun_at_;
  return begun_at != 0 && SinceBoot() - absl::Nanoseconds(begun_at) > kMostWait;
}

absl::Status OtherOwners::Find(const std::string& tenant, const std::string& name) {
  if (!thread_.has_value()) {
    return NoSuchSession(name);
  }
  return Ask(name, [this, tenant, name] { return LookFor(tenant, name); });
}

absl::StatusOr<std::set<std::string>> OtherOwners::ListOffered() {
  if (!thread_.has_value()) {
    return std::set<std::string>();
  }
  const auto offered = std::make_shared<std::set<std::string>>();  // the thread may be late
  WELLSPACE_RETURN_IF_ERROR(Ask("what is offered", [this, offered] {
    const Turn turn(begun_at_);
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> names, records_.ListOffered());
    offered->insert(names.begin(), names.end());
    return absl::OkStatus();
  }));
  return *offered;
}

absl::Status OtherOwners::Ask(const std::string& what, const std::function<absl::Status()>& ask) {
  if (IsLate()) {
    return Unknown(what);
  }
  struct Question {
    std::promise<absl::Status> found;
    std::atomic<bool> is_given_up = false;  // so that no line of them grows
  };
  const auto question = std::make_shared<Question>();
  std::future<absl::Status> answer = question->found.get_future();
  thread_->Post([ask, question] {
    if (!question->is_given_up) {
      question->found.set_value(RunGuarded(ask));
    }
  });
  if (answer.wait_for(absl::ToChronoMilliseconds(kMostWait)) != std::future_status::ready) {
    question->is_given_up = true;
    return Unknown(what);
  }
  return answer.get();
}

void OtherOwners::LookAgain() {
  const auto look = [this] {
    const Turn turn(begun_at_);
    for (const std::string& name : std::exchange(left_, {})) {
      const absl::StatusOr<std::optional<SessionOwner>> owner = records_.FindOwner(name);
      if (!owner.ok() || (owner->has_value() && (*owner)->is_self && !TakeOne(name).ok())) {
        left_.push_back(name);
      }
    }
    WELLSPACE_RETURN_IF_ERROR(TakeOrphans());
    return TakeWork();
  };
  RunGuarded(look).IgnoreError();  // the next look is soon
  thread_->PostAfter(kBetweenLooks, [this] { LookAgain(); });
}

absl::Status OtherOwners::LookFor(const std::string& tenant, const std::string& name) {
  const Turn turn(begun_at_);
  WELLSPACE_ASSIGN_OR_RETURN(const std::optional<SessionOwner> owner, records_.FindOwner(name));
  const bool is_of_any = tenant == SessionRegistry::kAnyTenant;
  if (!owner.has_value() || !(is_of_any || owner->tenant == tenant)) {
    return NoSuchSession(name);
  }
  if (owner->is_self) {
    return TakeOne(name);
  }
  if (owner->lives) {
    return Elsewhere(name, owner->address);
  }
  WELLSPACE_RETURN_IF_ERROR(TakeOrphans());
  // It is here by now, or another was first.
  WELLSPACE_ASSIGN_OR_RETURN(const std::optional<SessionOwner> next, records_.FindOwner(name));
  if (!next.has_value()) {
    return NoSuchSession(name);
  }
  if (next->is_self) {
    return absl::OkStatus();
  }
  return next->lives ? Elsewhere(name, next->address) : Unknown(name);
}

absl::Status OtherOwners::TakeOrphans() {
  WELLSPACE_ASSIGN_OR_RETURN(std::vector<StoredSession> taken, records_.TakeOrphans());
  TakeAll(std::move(taken), From::kDead);
  return absl::OkStatus();
}

absl::Status OtherOwners::TakeWork() {
  const RoomForWork room = get_room_();
  if (room.sessions > 0) {
    WELLSPACE_ASSIGN_OR_RETURN(std::vector<StoredSession> taken, records_.TakeOffered(room));
    TakeAll(std::move(taken), From::kBusy);
  }
  return absl::OkStatus();
}

void OtherOwners::TakeAll(std::vector<StoredSession> taken, From from) {
  if (!taken.empty()) {
    for (std::string& name : take_in_(std::move(taken), from)) {
      left_.push_back(std::move(name));
    }
  }
}

// At a new epoch: what was under way when it left the registry is not to come in between.
absl::Status OtherOwners::TakeOne(const std::string& name) {
  if (is_here_(name)) {
    return absl::OkStatus();  // it was taken in before this turn
  }
  WELLSPACE_ASSIGN_OR_RETURN(std::optional<StoredSession> taken, records_.Take(name));
  if (!taken.has_value()) {
    return NoSuchSession(name);
  }
  std::vector<StoredSession> one;
  one.push_back(*std::move(taken));
  return take_in_(std::move(one), From::kDead).empty() ? absl::OkStatus() : Unknown(name);
}

}  // namespace wellspace::server
