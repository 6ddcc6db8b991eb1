#include "server/store/usage_meter.h"

#include <utility>

namespace wellspace::server {

void UsageMeter::AddMesh(const std::string& tenant, uint64_t vertices) {
  store::v1::UsageRecord work;
  work.set_tenant(tenant);
  work.set_day(DayOf(clock_.wall()));
  work.set_meshes(1);
  work.set_vertices(vertices);
  Add(work);
}

void UsageMeter::AddTime(const std::string& tenant, absl::Duration processor_time) {
  store::v1::UsageRecord work;
  work.set_tenant(tenant);
  work.set_day(DayOf(clock_.wall()));
  work.set_processor_time_ns(absl::ToInt64Nanoseconds(processor_time));
  Add(work);
}

void UsageMeter::Add(const store::v1::UsageRecord& work) {
  const std::lock_guard lock(mutex_);
  const auto [place, is_new] = gathered_.try_emplace({work.tenant(), work.day()}, work);
  if (!is_new) {
    AddWork(work, place->second);
  }
}

bool UsageMeter::IsEmpty() const {
  const std::lock_guard lock(mutex_);
  return gathered_.empty();
}

absl::Status UsageMeter::Flush() {
  Gathered gathered;
  {
    const std::lock_guard lock(mutex_);
    gathered.swap(gathered_);
  }
  if (gathered.empty()) {
    return absl::OkStatus();
  }
  SessionChange change{.session = "", .epoch = log_.records().epoch()};
  for (const auto& [key, work] : gathered) {
    change.usage.push_back(work);
  }
  absl::Status written = log_.Commit(change);
  if (!written.ok()) {
    for (const auto& [key, work] : gathered) {
      Add(work);
    }
  }
  return written;
}

}  // namespace wellspace::server
