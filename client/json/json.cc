#include "client/json/json.h"

#include <cstdint>

#include "absl/strings/str_format.h"
#include "client/rule_names.h"

namespace wellspace::client {
namespace {

Json OptionalTime(const std::optional<absl::Time>& time) {
  return time.has_value() ? Json(TimeText(*time)) : Json(nullptr);
}

template <typename Number>
Json OrNull(const std::optional<Number>& number) {
  return number.has_value() ? Json(*number) : Json(nullptr);
}

}  // namespace

const char* StateName(SessionState state) {
  switch (state) {
    case SessionState::kOpen:
      return "open";
    case SessionState::kRefining:
      return "refining";
    case SessionState::kReady:
      return "ready";
    default:
      return "unknown";  // of a newer server
  }
}

const char* CriterionName(Criterion criterion) {
  switch (criterion) {
    case Criterion::kRadiusEdge:
      return "radius-edge";
    case Criterion::kWellSpaced:
      return "well-spaced";
    default:
      return "unknown";  // of a newer server
  }
}

const char* StateName(OperationState state) {
  switch (state) {
    case OperationState::kQueued:
      return "queued";
    case OperationState::kRunning:
      return "running";
    case OperationState::kSucceeded:
      return "succeeded";
    case OperationState::kFailed:
      return "failed";
    case OperationState::kCancelled:
      return "cancelled";
    default:
      return "unknown";  // of a newer server
  }
}

std::string TimeText(absl::Time time) { return absl::FormatTime("%Y-%m-%d%ET%H:%M:%SZ", time, absl::UTCTimeZone()); }

std::string JsonText(const Json& json, bool indented) {
  const std::string text = json.dump(indented ? 2 : -1, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace);
  // Within strings, as nlohmann leaves them: DEL, and the control characters of Latin-1, U+0080 to U+009F.
  std::string escaped;
  for (size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<uint8_t>(text[i]);
    const auto next = static_cast<uint8_t>(i + 1 < text.size() ? text[i + 1] : 0);
    if (byte == 0x7f) {
      escaped += "\\u007f";
    } else if (byte == 0xc2 && next >= 0x80 && next < 0xa0) {
      absl::StrAppendFormat(&escaped, "\\u%04x", next);
      ++i;
    } else {
      escaped += text[i];
    }
  }
  return escaped;
}

Json ErrorJson(const absl::Status& status) {
  Json json;
  json["code"] = absl::StatusCodeToString(status.code());
  if (const std::string reason = ReasonOf(status); !reason.empty()) {
    json["reason"] = reason;
  }
  if (const std::string field = BlamedField(status); !field.empty()) {
    json["field"] = field;
  }
  json["message"] = std::string(status.message());
  return json;
}

Json ParametersJson(const MeshOptions& parameters) {
  Json json;
  json["dimension"] = parameters.dimension;
  json["rho"] = OrNull(parameters.rho);
  json["criterion"] = CriterionName(parameters.criterion);
  json["max_circumradius"] = OrNull(parameters.max_circumradius);
  json["edge_length"] = OrNull(parameters.edge_length);
  json["gradation"] = OrNull(parameters.gradation);
  json["size_boxes"] = Json::array();
  for (const SizeBox& box : parameters.size_boxes) {
    json["size_boxes"].push_back({{"low", box.low}, {"high", box.high}, {"max_circumradius", box.max_circumradius}});
  }
  json["min_dihedral"] = OrNull(parameters.min_dihedral);
  const SurfaceParameters& surface = parameters.surface_parameters;
  json["surface"] = {{"tolerance", OrNull(surface.tolerance)},
                     {"min_facet_angle", OrNull(surface.min_facet_angle)},
                     {"edge_length", OrNull(surface.edge_length)},
                     {"min_size", OrNull(surface.min_size)},
                     {"outside_rho", OrNull(surface.outside_rho)},
                     {"curvature_elements", OrNull(surface.curvature_elements)},
                     {"thickness_layers", OrNull(surface.thickness_layers)}};
  json["pump_weights"] = parameters.pump_weights;
  json["keep_vertices"] = parameters.keep_vertices;
  const bool has_domain = !parameters.domain_low.empty();
  json["domain_low"] = has_domain ? Json(parameters.domain_low) : Json(nullptr);
  json["domain_high"] = has_domain ? Json(parameters.domain_high) : Json(nullptr);
  json["margin"] = parameters.margin;
  json["merge_distance"] = OrNull(parameters.merge_distance);
  json["periodic_axes"] = parameters.periodic_axes;
  json["max_vertices"] = OrNull(parameters.max_vertices);
  json["threads"] = OrNull(parameters.threads);
  return json;
}

Json SessionJson(const Session& session) {
  Json json;
  json["name"] = session.name;
  json["state"] = StateName(session.state);
  json["parameters"] = ParametersJson(session.parameters);
  json["labels"] = session.labels;
  json["ttl_seconds"] = absl::ToDoubleSeconds(session.ttl);
  json["create_time"] = TimeText(session.create_time);
  json["expire_time"] = TimeText(session.expire_time);
  json["revision"] = session.revision;
  json["committed_points"] = session.committed_points;
  json["segment_count"] = session.segment_count;
  json["seed_count"] = session.seed_count;
  json["faces"] = session.faces.has_value() ? Json(FaceRuleName(*session.faces)) : Json(nullptr);
  json["crossings"] = session.faces.has_value() ? nlohmann::ordered_json(CrossingRuleName(session.crossings)) : nullptr;
  json["snap_distance"] = OrNull(session.snap_distance);
  json["triangle_count"] = session.triangle_count;
  json["solids"] = session.surface.has_value() ? Json(SolidRuleName(session.surface->solids)) : Json(nullptr);
  json["crease_angle"] = session.surface.has_value() ? OrNull(session.surface->crease_angle) : Json(nullptr);
  json["weld"] = session.surface.has_value() ? OrNull(session.surface->weld) : Json(nullptr);
  json["size_count"] = session.size_count;
  json["stored_bytes"] = session.stored_bytes;
  json["vertex_count"] = session.vertex_count;
  json["simplex_count"] = session.simplex_count;
  json["last_operation"] = session.last_operation.empty() ? Json(nullptr) : Json(session.last_operation);
  return json;
}

Json ProgressJson(const Progress& progress) {
  Json json;
  json["sequence"] = progress.sequence;
  json["phase"] = progress.phase;
  json["vertices"] = progress.vertices;
  json["estimated_vertices"] = progress.estimated_vertices;
  json["simplices"] = progress.simplices;
  json["fraction"] = progress.fraction;
  return json;
}

Json OperationJson(const Operation& operation) {
  Json json;
  json["name"] = operation.name;
  json["state"] = StateName(operation.state);
  json["parameters"] = ParametersJson(operation.parameters);
  json["progress"] = ProgressJson(operation.progress);
  json["error"] = operation.error.ok() ? Json(nullptr) : ErrorJson(operation.error);
  json["create_time"] = TimeText(operation.create_time);
  json["start_time"] = OptionalTime(operation.start_time);
  json["end_time"] = OptionalTime(operation.end_time);
  json["mesh_revision"] = operation.mesh_revision;
  return json;
}

Json ServerInfoJson(const ServerInfo& info) {
  Json json;
  json["version"] = info.version;
  json["dimensions"] = info.dimensions;
  json["max_points"] = info.max_points;
  json["max_vertices"] = info.max_vertices;
  json["max_request_bytes"] = info.max_request_bytes;
  json["workers"] = info.workers;
  json["max_queued_jobs"] = info.max_queued_jobs;
  json["running_jobs"] = info.running_jobs;
  json["queued_jobs"] = info.queued_jobs;
  json["max_sessions"] = info.max_sessions;
  json["max_sessions_per_tenant"] = info.max_sessions_per_tenant;
  json["default_ttl_seconds"] = absl::ToDoubleSeconds(info.default_ttl);
  json["max_ttl_seconds"] = absl::ToDoubleSeconds(info.max_ttl);
  json["stall_limit_seconds"] = absl::ToDoubleSeconds(info.stall_limit);
  json["max_memory_bytes"] = info.max_memory_bytes;
  json["max_stored_bytes_per_tenant"] = info.max_stored_bytes_per_tenant;
  json["stored_bytes"] = info.stored_bytes;
  return json;
}

const char* HealthName(Health health) {
  switch (health) {
    case Health::kServing:
      return "serving";
    case Health::kNotServing:
      return "not serving";
    default:
      return "unknown";
  }
}

}  // namespace wellspace::client
