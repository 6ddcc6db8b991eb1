// The work of operations.
#ifndef WELLSPACE_SERVER_SESSIONS_REFINEMENT_H_
#define WELLSPACE_SERVER_SESSIONS_REFINEMENT_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "core/input/mesh_parameters.h"
#include "server/calls/call_environment.h"
#include "server/sessions/operation.h"
#include "server/sessions/session.h"

namespace wellspace::server {

// Starts an operation that refines `session` with `parameters`, on a worker: from its points the first time, from then
// on by the changes since the last. With `restart` again from its points.
//
// One that does not succeed leaves the session as it was: a mesher that it has changed is given up, and built again by
// Replay when the structure is next needed.
//
// Errors:     QUEUE_FULL, QUOTA_EXCEEDED (jobs); those of Session::StartOperation. The session is as it was.
absl::StatusOr<std::shared_ptr<Operation>> StartRefinement(const CallEnvironment& environment,
                                                           const std::shared_ptr<Session>& session,
                                                           const core::MeshParameters& parameters, bool restart,
                                                           uint64_t expected_revision,
                                                           const AnswerTo<v1::Operation>& answer = nullptr);

// An operation of an earlier process, and its session.
struct ResumedOperation {
  std::shared_ptr<Session> session;
  std::shared_ptr<Operation> operation;
};

// Has the work of these done again: at the start, and when sessions were taken over.
void ResumeRefinements(const CallEnvironment& environment, std::vector<ResumedOperation> resumed);

// Ends an operation that waits; has one that runs end soon.
//
// Errors:     those of Session::Cancel.
absl::Status CancelOperation(const CallEnvironment& environment, Session& session, Operation& operation);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_REFINEMENT_H_
