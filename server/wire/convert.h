// Between the messages of wellspace.v1 and the types of the core.
#ifndef WELLSPACE_SERVER_WIRE_CONVERT_H_
#define WELLSPACE_SERVER_WIRE_CONVERT_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/meshers/mesher.h"
#include "google/protobuf/duration.pb.h"
#include "google/protobuf/timestamp.pb.h"
#include "server/base/options.h"
#include "wellspace/v1/mesh.pb.h"
#include "wellspace/v1/meshing.pb.h"

namespace wellspace::server {

// Translates and validates the parameters of a call; defaults and limits of the server are filled in.
//
// Guarantees: core::ValidateParameters of the result is ok, and 1 <= threads <= options.max_threads, 1 <=
//             max_vertices <= options.max_vertices.
// Errors:     INVALID_PARAMETERS with the path of the first wrong field.
absl::StatusOr<core::MeshParameters> ParametersFromProto(const v1::MeshParameters& message,
                                                         const ServiceOptions& options);
// The parameters of a message that ParametersToProto has made, whatever the limits of the server are now.
//
// Errors:     INVALID_PARAMETERS: it has demands that this version does not know, which must not be left out.
absl::StatusOr<core::MeshParameters> ParametersFromRecord(const v1::MeshParameters& message);

// Refuses valid parameters that such an input does not have; see core::ValidateDomainParameters and
// core::ValidateSpaceParameters. Its points are not looked at.
//
// Errors:     INVALID_PARAMETERS with the path of the first wrong field.
absl::Status ValidateFor(const core::Input& input, const core::MeshParameters& parameters);

// The parameters with every default that does not depend on points filled in.
v1::MeshParameters ParametersToProto(const core::MeshParameters& parameters);

google::protobuf::Timestamp TimeToProto(absl::Time time);

// The metadata of `mesh`, to be followed by `chunk_count` chunks. `with_boundary`: as the request says.
v1::MeshMetadata MetadataToProto(const core::Mesh& mesh, uint64_t chunk_count, bool with_boundary = false);
// Reduces metadata with boundary to those without.
void ClearBoundary(v1::MeshMetadata& metadata);

v1::EstimateMeshResponse EstimateToProto(const core::MeshEstimate& estimate);

// REQUIRES:   finite.
google::protobuf::Duration DurationToProto(absl::Duration duration);

v1::Phase PhaseToProto(core::Phase phase);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_WIRE_CONVERT_H_
