// Values of the library as JSON: the output of the tool with --output json, and the answers of the console to its page.
#ifndef WELLSPACE_CLIENT_JSON_JSON_H_
#define WELLSPACE_CLIENT_JSON_JSON_H_

#include <nlohmann/json.hpp>
#include <string>

#include "absl/status/status.h"
#include "client/client.h"

namespace wellspace::client {

using Json = nlohmann::ordered_json;

// Times are RFC 3339 in UTC, durations seconds, names of states lower case. Absent: null.

// `json` as text that a terminal does not obey: control characters are escaped, bytes that are no UTF-8 replaced.
std::string JsonText(const Json& json, bool indented);

// code, reason and field (where the server gave one), message.
Json ErrorJson(const absl::Status& status);
// dimension, rho, criterion, max_circumradius, edge_length, gradation, size_boxes, min_dihedral, surface (the fields of
// SurfaceParameters), pump_weights, keep_vertices, domain_low, domain_high, margin, merge_distance, periodic_axes,
// max_vertices, threads.
Json ParametersJson(const MeshOptions& parameters);
// name, state, parameters, labels, ttl_seconds, create_time, expire_time, revision, committed_points, segment_count,
// seed_count, faces (a name, or null without segments), crossings (likewise), snap_distance, triangle_count, solids (a
// name, or null without triangles), crease_angle and weld (likewise), size_count, stored_bytes, vertex_count,
// simplex_count, last_operation.
Json SessionJson(const Session& session);
// sequence, phase, vertices, estimated_vertices, simplices, fraction.
Json ProgressJson(const Progress& progress);
// name, state, parameters, progress, error, create_time, start_time, end_time, mesh_revision.
Json OperationJson(const Operation& operation);
// Every field of ServerInfo.
Json ServerInfoJson(const ServerInfo& info);

// "open", "running" and so on.
const char* StateName(SessionState state);
const char* StateName(OperationState state);
// "serving", "not serving" or "unknown".
const char* HealthName(Health health);
// As --criterion has it.
const char* CriterionName(Criterion criterion);
// "2026-01-31T23:59:59Z".
std::string TimeText(absl::Time time);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_JSON_JSON_H_
