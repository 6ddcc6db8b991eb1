#include "server/observability/work_observer.h"

#include "server/log/log_fields.h"
#include "server/wire/errors.h"
#include "server/wire/hidden_folders.h"

namespace wellspace::server {

void WorkObserver::OnMesh(uint64_t vertices, uint64_t simplices) {
  counters_.vertices_made += vertices;
  counters_.simplices_made += simplices;
}

void WorkObserver::OnRefinement(const RefinementReport& report) {
  OnMesh(report.vertices, report.simplices);
  const google::rpc::Status seen = StatusToProto(report.status);  // as clients see it
  const auto code = static_cast<absl::StatusCode>(seen.code());
  LogFields fields;
  fields.Add("event", "refinement").Add("operation", report.operation).Add("tenant", report.tenant);
  fields.Add("code", absl::StatusCodeToString(code));
  fields.Add("seconds", absl::ToDoubleSeconds(report.duration)).Add("points", report.points);
  fields.Add("vertices", report.vertices);
  if (report.replayed_steps > 0) {
    fields.Add("replayed_steps", report.replayed_steps);
  }
  if (!report.status.ok()) {
    fields.Add("message", seen.message());
    if (const std::string cause(report.status.message()); WithoutFolders(cause) != cause) {
      fields.Add("cause", cause);
    }
  }
  log_.log(code == absl::StatusCode::kInternal ? spdlog::level::err : spdlog::level::info, "{}", fields.text());
}

void WorkObserver::OnStructureGivenUp(const StructureReport& report) {
  ++counters_.structures_given_up;
  LogFields fields;
  fields.Add("event", "structure_given_up").Add("session", report.session).Add("tenant", report.tenant);
  fields.Add("bytes", report.bytes).Add("idle_seconds", absl::ToDoubleSeconds(report.idle));
  log_.info("{}", fields.text());
}

}  // namespace wellspace::server
