#include "server/sessions/work_offers.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "core/base/status_macros.h"
#include "server/base/clock.h"
#include "server/log/log_fields.h"
#include "server/sessions/session_registry.h"
#include "server/wire/errors.h"

namespace wellspace::server {

void WorkOffers::Look() {
  if (is_looking_.exchange(true)) {
    return;  // the database lets the last look wait
  }
  environment_.blocking.Run("", [this] {
    RunGuarded([this] {
      LookNow();
      return absl::OkStatus();
    }).IgnoreError();  // the next look is soon
    is_looking_ = false;
  });
}

void WorkOffers::LookNow() {
  std::vector<std::shared_ptr<Session>> offered;
  std::vector<Candidate> waiting;
  for (std::shared_ptr<Session>& session : environment_.sessions.All()) {
    if (session->IsOffered()) {
      offered.push_back(session);
    }
    if (std::optional<Session::Waiting> one = session->GetWaiting(); one.has_value()) {
      waiting.push_back({.session = std::move(session), .waiting = *std::move(one)});
    }
  }
  if (!offered.empty()) {
    Settle(offered).IgnoreError();  // likewise
  }
  std::ranges::stable_sort(waiting, {}, [](const Candidate& candidate) { return candidate.waiting.since; });
  Choose(waiting);
}

absl::Status WorkOffers::Settle(const std::vector<std::shared_ptr<Session>>& offered) {
  Records& records = environment_.session_log.records();
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> listed, records.ListOffered());
  const std::set<std::string> standing(listed.begin(), listed.end());
  for (const std::shared_ptr<Session>& session : offered) {
    if (standing.contains(session->name())) {
      continue;
    }
    WELLSPACE_ASSIGN_OR_RETURN(const std::optional<SessionOwner> owner, records.FindOwner(session->name()));
    if (!owner.has_value()) {
      GiveAway(session, "");  // its new owner has deleted it
    } else if (!owner->is_self) {
      GiveAway(session, owner->address);
    }  // else it is not offered yet, or not any more
  }
  return absl::OkStatus();
}

void WorkOffers::GiveAway(const std::shared_ptr<Session>& session, const std::string& address) {
  const std::shared_ptr<Job> job = session->GiveAway(address);
  if (!session->IsElsewhere() || !environment_.sessions.Remove(*session)) {
    return;  // this process has deleted it
  }
  ++given_;
  environment_.log.info(
      LogFields().Add("event", "work_given").Add("session", session->name()).Add("owner", address).text());
  if (job != nullptr) {
    environment_.background.Post([&environment = environment_, job] { environment.jobs.Cancel(job); });
  }
}

void WorkOffers::Choose(const std::vector<Candidate>& waiting) {
  const absl::Duration now = SinceBoot();
  std::map<std::string, absl::Duration> since;
  int place = 0;
  for (const auto& [session, one] : waiting) {
    const auto known = since_.find(one.operation);
    const absl::Duration began = known == since_.end() ? now : known->second;
    since.emplace(one.operation, began);
    const absl::Duration patience = one.has_structure ? kPatienceWithStructure : kPatience;
    const bool is_kept = place++ < environment_.options.keep_queued;
    if (is_kept ? one.is_offered : !one.is_offered && !one.is_read && now - began >= patience) {
      Set(session, !is_kept);
    }
  }
  since_ = std::move(since);
}

// All that one look has found are committed together.
void WorkOffers::Set(const std::shared_ptr<Session>& session, bool stands) {
  {
    const std::lock_guard lock(mutex_);
    if (!asked_.insert(session->name()).second) {
      return;  // the store lets it wait
    }
  }
  environment_.blocking.Run(session->name(), [this, session, stands] {
    const absl::Status set = RunGuarded([&] { return session->SetOffer(stands); });
    offered_ += set.ok() && stands ? 1 : 0;
    const std::lock_guard lock(mutex_);
    asked_.erase(session->name());
  });
}

}  // namespace wellspace::server
