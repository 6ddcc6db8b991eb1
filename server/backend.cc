#include "server/backend.h"

#include <utility>
#include <vector>

#include "absl/time/clock.h"

namespace wellspace::server {
namespace {

// A lease that has run out is noticed at once by those who ask for the session; its memory is free this much later.
constexpr absl::Duration kExpiryInterval = absl::Seconds(1);

}  // namespace

Backend::Backend(const ServiceOptions& options, const Authenticator& authenticator, std::shared_ptr<spdlog::logger> log,
                 Mesher mesher, Estimator estimator, MesherFactory create_mesher)
    : options_(options),
      log_(std::move(log)),
      mesher_(std::move(mesher)),
      estimator_(std::move(estimator)),
      create_mesher_(std::move(create_mesher)),
      request_ids_(absl::Now),
      memory_(options_.max_memory_bytes),
      sessions_(options_, absl::Now),
      environment_{.options = options_,
                   .mesher = mesher_,
                   .estimator = estimator_,
                   .create_mesher = create_mesher_,
                   .authenticator = authenticator,
                   .memory = memory_,
                   .jobs = jobs_,
                   .background = background_,
                   .calls = calls_,
                   .sessions = sessions_,
                   .request_ids = request_ids_,
                   .log = *log_},
      jobs_({.workers = options_.workers,
             .max_queued = options_.max_queued_jobs,
             .max_per_tenant = options_.max_jobs_per_tenant},
            memory_) {
  ScheduleExpiry();
}

void Backend::ScheduleExpiry() {
  background_.PostAfter(kExpiryInterval, [this] {
    for (const std::shared_ptr<Session>& session : sessions_.RemoveExpired()) {
      log_->info("session={} expired", session->name());
    }
    ScheduleExpiry();
  });
}

}  // namespace wellspace::server
