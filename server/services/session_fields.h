// Checks fields of requests about sessions and operations.
#ifndef WELLSPACE_SERVER_SERVICES_SESSION_FIELDS_H_
#define WELLSPACE_SERVER_SERVICES_SESSION_FIELDS_H_

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/input/mesh_parameters.h"
#include "google/protobuf/duration.pb.h"
#include "google/protobuf/map.h"
#include "server/base/options.h"
#include "server/sessions/session.h"
#include "wellspace/v1/mesh.pb.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {

using Labels = std::map<std::string, std::string>;

// `field` is the path of the labels in their request.
//
// Errors:     INVALID_REQUEST.
absl::StatusOr<Labels> LabelsFromProto(const google::protobuf::Map<std::string, std::string>& message,
                                       const std::string& field);

// `message` null: the default of the server.
//
// Errors:     INVALID_REQUEST.
absl::StatusOr<absl::Duration> TtlFromProto(const google::protobuf::Duration* message, const std::string& field,
                                            const ServiceOptions& options);

// How many to list for a request of `page_size`, null: absent.
//
// Errors:     INVALID_REQUEST.
absl::StatusOr<size_t> PageSizeFromProto(const int32_t* page_size);

// The same of the request.
template <typename Request>
absl::StatusOr<size_t> PageSizeOf(const Request& request) {
  const int32_t page_size = request.page_size();
  return PageSizeFromProto(request.has_page_size() ? &page_size : nullptr);
}

// The revision that was sent in `field`; 0: none was.
//
// Errors:     INVALID_REQUEST for a 0 that was sent: no revision is 0.
absl::StatusOr<uint64_t> RevisionFromProto(bool is_sent, uint64_t revision, const std::string& field);

// The same of `expected_revision` of the request.
template <typename Request>
absl::StatusOr<uint64_t> ExpectedRevisionOf(const Request& request) {
  return RevisionFromProto(request.has_expected_revision(), request.expected_revision(), "expected_revision");
}

// Refuses a partition that no mesh has.
//
// Errors:     INVALID_REQUEST, with the path of the first wrong field; so the following.
absl::Status CheckPartition(const v1::MeshPartition& partition);
// Refuses one that a mesh of so many simplices does not have.
absl::Status CheckPartitionOf(uint64_t simplices, const v1::MeshPartition& partition);

// The position of `token` in `list`; empty if it is.
//
// Errors:     INVALID_REQUEST.
absl::StatusOr<std::string> PositionFromProto(const std::string& token, const std::string& list);
// The same where positions are numbers; 0 if it is empty.
absl::StatusOr<uint64_t> NumberFromProto(const std::string& token, const std::string& list);

// Refuses a name of a tenant, which may be absent, that no tenant has.
//
// Errors:     INVALID_REQUEST.
absl::Status CheckTenant(const std::string& tenant);

// Refuses parameters that are too large to be sent with every answer about their session.
//
// Errors:     INVALID_PARAMETERS.
absl::Status CheckParametersSize(const core::MeshParameters& parameters);

// The parameters of a refinement of `session` that is asked for with `message`.
//
// Errors:     INVALID_PARAMETERS, also for another dimension or domain than the session's.
absl::StatusOr<core::MeshParameters> ParametersForSession(const v1::MeshParameters& message,
                                                          const ServiceOptions& options, const Session& session);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_SESSION_FIELDS_H_
