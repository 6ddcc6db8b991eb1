// The work of operations.
#ifndef WELLSPACE_SERVER_SESSIONS_REFINEMENT_H_
#define WELLSPACE_SERVER_SESSIONS_REFINEMENT_H_

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "core/mesh_parameters.h"
#include "server/calls/call_environment.h"
#include "server/sessions/operation.h"
#include "server/sessions/session.h"

namespace wellspace::server {

// Starts an operation that refines `session` with `parameters`, on a worker: from its points the first time, from then
// on by what has changed.
//
// One that does not succeed leaves the session as it was: a mesher that it has changed is given up, and built again by
// Replay when the structure is next needed.
//
// Errors:     QUEUE_FULL, QUOTA_EXCEEDED (jobs); those of Session::StartOperation.
absl::StatusOr<std::shared_ptr<Operation>> StartRefinement(const CallEnvironment& environment,
                                                           const std::shared_ptr<Session>& session,
                                                           const core::MeshParameters& parameters,
                                                           uint64_t expected_revision);

// Ends an operation that waits; has one that runs end soon.
void CancelOperation(const CallEnvironment& environment, Session& session, Operation& operation);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_REFINEMENT_H_
