#include "server/backend.h"

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"
#include "server/log/log_fields.h"
#include "server/sessions/refinement.h"

namespace wellspace::server {
namespace {

// Calls about a session notice at once that its lease has run out; its memory is free this much later.
constexpr absl::Duration kExpiryInterval = absl::Seconds(1);

// Files that a fault, or a death of the process, has left are looked for as often.
constexpr absl::Duration kGarbageInterval = absl::Hours(1);

// Changes that wait for the disk at once: as many sessions can have theirs synchronised together.
constexpr size_t kBlockingThreads = 64;

// `mesh`, whose errors say which of an input's parts is to blame.
template <typename Function>
Function NamingParts(Function mesh) {
  return [mesh = std::move(mesh)](const core::MeshParameters& parameters, const core::Input& input,
                                  core::RunContext& context) {
    auto made = mesh(parameters, input, context);
    if (!made.ok() && input.surface.has_value()) {
      made = OfSurface(made.status());
    }
    return made;
  };
}

}  // namespace

Backend::Backend(const ServiceOptions& options, const Authenticator& authenticator, Observability& observability,
                 std::shared_ptr<spdlog::logger> log, std::unique_ptr<SessionLog> session_log, Mesher mesher,
                 Estimator estimator, MesherFactory create_mesher, const BackendDrive& drive)
    : options_(options),
      log_(std::move(log)),
      mesher_(NamingParts(std::move(mesher))),
      estimator_(NamingParts(std::move(estimator))),
      create_mesher_(NamingParts(std::move(create_mesher))),
      session_log_(std::move(session_log)),
      usage_(drive.clock, *session_log_),
      request_ids_(drive.clock.since_boot, session_log_->records()),
      memory_(options_.max_memory_bytes),
      sessions_(options_, memory_, drive.clock, *session_log_, drive.make_session_name,
                session_log_->records().is_shared()
                    ? std::optional(SessionRegistry::Others{
                          .find = [this](const std::string& tenant,
                                         const std::string& name) { return other_owners_.Find(tenant, name); },
                          .list_offered = [this] { return other_owners_.ListOffered(); }})
                    : std::nullopt),
      other_owners_(
          session_log_->records(),
          [this](const std::vector<StoredSession>& taken, OtherOwners::From from) {
            return TakeInOfOthers(taken, from);
          },
          [this](const std::string& name) {
            const std::shared_ptr<Session> session = sessions_.FindHere(name);
            return session != nullptr && !session->IsElsewhere();
          },
          [this] { return GetRoomForWork(); }),
      idle_sessions_(sessions_, memory_, observability.work()),
      environment_{.options = options_,
                   .mesher = mesher_,
                   .estimator = estimator_,
                   .create_mesher = create_mesher_,
                   .authenticator = authenticator,
                   .memory = memory_,
                   .jobs = jobs_,
                   .background = background_,
                   .blocking = blocking_,
                   .calls = calls_,
                   .sessions = sessions_,
                   .request_ids = request_ids_,
                   .session_log = *session_log_,
                   .usage = usage_,
                   .observability = observability,
                   .log = *log_},
      work_offers_(environment_),
      background_(drive.run_by),
      blocking_(drive.run_by == RunBy::kCaller ? 0 : kBlockingThreads),
      jobs_({.workers = options_.workers,
             .max_queued = options_.max_queued_jobs,
             .max_per_tenant = options_.max_jobs_per_tenant,
             .small_workers = options_.small_workers,
             .run_by = drive.run_by},
            memory_, [this](const std::string& tenant, absl::Duration time) { usage_.AddTime(tenant, time); }) {
  AddMetrics(observability.metrics());
  ScheduleExpiry();
  ScheduleUsage();
  if (session_log_->records().is_shared()) {
    ScheduleOffers();
  }
}

void Backend::AddMetrics(Metrics& metrics) {
  metrics.AddGauge("wellspace_workers", "Jobs that can run at once.",
                   [this] { return static_cast<double>(options_.workers); });
  metrics.AddGauge("wellspace_jobs_running", "Jobs that run.",
                   [this] { return static_cast<double>(jobs_.GetLoad().running); });
  metrics.AddGauge("wellspace_jobs_queued", "Jobs that wait for a worker or for memory.",
                   [this] { return static_cast<double>(jobs_.GetLoad().queued); });
  metrics.AddGauge("wellspace_jobs_queue_capacity", "Jobs that can wait; more are refused.",
                   [this] { return static_cast<double>(options_.max_queued_jobs); });
  const auto add_counters = [&](const std::string& kind, const std::string& what,
                                JobPool::Begun JobPool::Counters::*of) {
    metrics.AddCounter("wellspace_" + kind + "begun_total", what + " that were begun.",
                       [this, of] { return static_cast<double>((jobs_.GetCounters().*of).jobs); });
    metrics.AddCounter("wellspace_" + kind + "wait_seconds_total", what + ": time in line until they were begun.",
                       [this, of] { return absl::ToDoubleSeconds((jobs_.GetCounters().*of).waited); });
  };
  add_counters("small_jobs_", "Small jobs", &JobPool::Counters::small);
  add_counters("other_jobs_", "Jobs that are not small", &JobPool::Counters::others);
  const auto add_counter = [&](const std::string& name, const std::string& help, auto read) {
    metrics.AddCounter(name, help, [read] { return static_cast<double>(read()); });
  };
  add_counter("wellspace_operations_offered_total", "Operations in line that were offered to other servers.",
              [this] { return work_offers_.offered(); });
  add_counter("wellspace_operations_given_total", "Of these, those that another server has taken.",
              [this] { return work_offers_.given(); });
  add_counter("wellspace_operations_taken_total", "Operations that were taken from servers which had offered them.",
              [this] { return taken_operations_.load(); });
  metrics.AddGauge("wellspace_sessions", "Sessions of all tenants.",
                   [this] { return static_cast<double>(sessions_.Count()); });
  metrics.AddGauge("wellspace_stored_bytes",
                   "Points, segments, triangles, sizes and meshes that the sessions of all tenants keep.",
                   [this] { return static_cast<double>(sessions_.StoredBytes().all); });
  metrics.AddGauge("wellspace_stored_bytes_of_largest_tenant", "Of these, those of the tenant that keeps most.",
                   [this] { return static_cast<double>(sessions_.StoredBytes().most); });
  metrics.AddGauge("wellspace_stored_bytes_limit_per_tenant", "Most that one tenant may keep; 0: no limit.",
                   [this] { return static_cast<double>(options_.max_stored_bytes_per_tenant); });
  metrics.AddGauge("wellspace_memory_reserved_bytes", "Memory that jobs, sessions and calls have reserved.",
                   [this] { return static_cast<double>(memory_.reserved()); });
  metrics.AddGauge("wellspace_memory_lasting_bytes", "Of that, what sessions keep.",
                   [this] { return static_cast<double>(memory_.lasting()); });
  metrics.AddGauge("wellspace_memory_yielding_bytes", "Of what sessions keep, what they give up while they are idle.",
                   [this] { return static_cast<double>(memory_.yielding()); });
  metrics.AddGauge("wellspace_memory_limit_bytes", "Most that can be reserved; 0: no limit.",
                   [this] { return memory_.is_limited() ? static_cast<double>(memory_.limit()) : 0; });
}

absl::Status Backend::Restore() {
  WELLSPACE_ASSIGN_OR_RETURN(StoredSessions stored, session_log_->records().Load());
  request_ids_.Restore(std::move(stored.answers));
  std::vector<ResumedOperation> resumed;
  for (const StoredSession& one : stored.sessions) {
    WELLSPACE_RETURN_IF_ERROR(TakeIn(one, resumed));
  }
  if (session_log_->is_durable()) {
    log_->info(LogFields()
                   .Add("event", "restored")
                   .Add("sessions", static_cast<uint64_t>(sessions_.Count()))
                   .Add("operations", static_cast<uint64_t>(resumed.size()))
                   .text());
  }
  ResumeRefinements(environment_, std::move(resumed));
  if (session_log_->is_durable()) {
    RemoveGarbage();
  }
  other_owners_.Start();
  return absl::OkStatus();
}

absl::Status Backend::TakeIn(const StoredSession& stored, std::vector<ResumedOperation>& resumed) {
  absl::StatusOr<std::shared_ptr<Session>> session = sessions_.Restore(stored);
  if (!session.ok()) {  // others are not to suffer from it
    log_->error(LogFields()
                    .Add("event", "session_not_restored")
                    .Add("session", stored.state.name())
                    .Add("error", std::string(session.status().message()))
                    .text());
    return absl::OkStatus();
  }
  absl::StatusOr<std::shared_ptr<Operation>> operation = (*session)->ResumeOperation();
  if (!operation.ok()) {
    sessions_.Remove(**session);
    return operation.status();
  }
  if (*operation != nullptr) {
    resumed.push_back({.session = *std::move(session), .operation = *std::move(operation)});
  }
  return absl::OkStatus();
}

RoomForWork Backend::GetRoomForWork() const {
  JobPool::Room room = jobs_.GetRoom();
  return {.sessions = room.jobs, .full_tenants = std::move(room.full_tenants)};
}

std::vector<std::string> Backend::TakeInOfOthers(const std::vector<StoredSession>& stored, OtherOwners::From from) {
  std::vector<std::string> left;
  std::vector<ResumedOperation> resumed;
  for (const StoredSession& one : stored) {
    if (const absl::Status taken_in = TakeIn(one, resumed); !taken_in.ok()) {
      log_->warn(LogFields()
                     .Add("event", "session_not_taken_over")
                     .Add("session", one.state.name())
                     .Add("error", std::string(taken_in.message()))
                     .text());
      left.push_back(one.state.name());
    }
  }
  taken_operations_ += from == OtherOwners::From::kBusy ? resumed.size() : 0;
  log_->info(LogFields()
                 .Add("event", from == OtherOwners::From::kBusy ? "work_taken" : "taken_over")
                 .Add("sessions", static_cast<uint64_t>(stored.size() - left.size()))
                 .Add("operations", static_cast<uint64_t>(resumed.size()))
                 .text());
  ResumeRefinements(environment_, std::move(resumed));
  return left;
}

// Their tasks give work to the others.
Backend::~Backend() {
  other_owners_.Stop();
  background_.Stop();
}

void Backend::RemoveExpired() {
  std::vector<SessionChange> unlogged;
  {
    const std::lock_guard lock(unlogged_mutex_);
    unlogged.swap(unlogged_);
  }
  if (!unlogged.empty()) {
    blocking_.Run("", [this, deletions = std::move(unlogged)] { LogExpiries(deletions); });
  }
  for (const std::shared_ptr<Session>& session : sessions_.RemoveExpired()) {
    log_->info(LogFields().Add("event", "session_expired").Add("session", session->name()).text());
    const auto write_down = [this, session] {
      if (absl::IsResourceExhausted(session->LogExpiry())) {
        const std::lock_guard lock(unlogged_mutex_);
        unlogged_.push_back(DeletionChange(*session->state()));
      }
    };
    if (session_log_->is_durable()) {
      blocking_.Run(session->name(), write_down);
    } else {
      write_down();
    }
  }
}

void Backend::LogExpiries(const std::vector<SessionChange>& deletions) {
  const auto finds_no_room = [&](const SessionChange& deletion) {
    return absl::IsResourceExhausted(session_log_->Commit(deletion));
  };
  const auto first_left = std::ranges::find_if(deletions, finds_no_room);
  const std::lock_guard lock(unlogged_mutex_);
  unlogged_.insert(unlogged_.end(), first_left, deletions.end());
}

void Backend::RemoveGarbage() {
  blocking_.Run("", [this] {
    const absl::StatusOr<Garbage> garbage = session_log_->RemoveGarbage();
    if (!garbage.ok()) {
      log_->warn(LogFields().Add("event", "garbage_left").Add("error", std::string(garbage.status().message())).text());
      return;
    }
    for (const Garbage::SetAside& file : garbage->set_aside) {
      log_->warn(LogFields().Add("event", "file_set_aside").Add("path", file.from).Add("new_path", file.to).text());
    }
    for (const std::string& path : garbage->removed) {
      log_->info(LogFields().Add("event", "file_removed").Add("path", path).text());
    }
    for (const std::string& path : garbage->unknown) {
      log_->warn(LogFields().Add("event", "unknown_file").Add("path", path).text());
    }
  });
  background_.PostAfter(kGarbageInterval, [this] { RemoveGarbage(); });
}

void Backend::ScheduleOffers() {
  background_.PostAfter(WorkOffers::kBetweenLooks, [this] {
    work_offers_.Look();
    ScheduleOffers();
  });
}

void Backend::ScheduleUsage() {
  background_.PostAfter(UsageMeter::kBetweenFlushes, [this] {
    if (!usage_.IsEmpty()) {
      // Where it cannot be written now, it is tried again with what comes.
      blocking_.Run("", [this] { usage_.Flush().IgnoreError(); });
    }
    ScheduleUsage();
  });
}

void Backend::ScheduleExpiry() {
  background_.PostAfter(kExpiryInterval, [this] {
    RemoveExpired();
    ScheduleExpiry();
  });
}

}  // namespace wellspace::server
