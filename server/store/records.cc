#include "server/store/records.h"

#include "absl/strings/str_cat.h"
#include "server/store/mesh_snapshot.h"

namespace wellspace::server {

std::vector<store::v1::PointsFile> PointsFilesOf(const store::v1::SessionRecord& record) {
  std::vector<store::v1::PointsFile> files(record.points_files().begin(), record.points_files().end());
  if (files.empty() && record.points() > 0) {
    files.emplace_back().set_number(record.points_file());
  }
  return files;
}

void AddWork(const store::v1::UsageRecord& record, UsageByTenant& usage) {
  TenantUsage& sum = usage[record.tenant()];
  sum.meshes += record.meshes();
  sum.vertices += record.vertices();
  sum.processor_time_ns += record.processor_time_ns();
}

void AddWork(const store::v1::UsageRecord& more, store::v1::UsageRecord& sum) {
  sum.set_meshes(sum.meshes() + more.meshes());
  sum.set_vertices(sum.vertices() + more.vertices());
  sum.set_processor_time_ns(sum.processor_time_ns() + more.processor_time_ns());
}

void AddSession(const store::v1::SessionRecord& record, UsageByTenant& usage) {
  TenantUsage& sum = usage[record.tenant()];
  ++sum.sessions;
  if (record.has_stored_bytes()) {
    sum.stored_bytes += record.stored_bytes();
    return;
  }
  // Its points and its mesh: all that an earlier release has said of most.
  const uint64_t dimension = record.parameters().dimension();
  sum.stored_bytes += record.points() * dimension * sizeof(double) +
                      MeshSnapshot::LoadedBytes(dimension, record.mesh().vertices(), record.mesh().simplices());
}

int32_t DayOf(absl::Time time) {
  return static_cast<int32_t>(absl::ToCivilDay(time, absl::UTCTimeZone()) - absl::CivilDay(1970));
}

absl::Status AnsweredBefore(const std::string& request_id) {
  return absl::AlreadyExistsError(absl::StrCat("request ", request_id, " was answered before"));
}

absl::Status OwnedElsewhere(const std::string& session) {
  return absl::AbortedError(absl::StrCat(session, " has been taken over by another server"));
}

}  // namespace wellspace::server
