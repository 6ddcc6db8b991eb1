// The structure of a session, computed from its steps.
#ifndef WELLSPACE_SERVER_SESSIONS_REPLAY_H_
#define WELLSPACE_SERVER_SESSIONS_REPLAY_H_

#include <cstdint>
#include <memory>
#include <span>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/input/mesh_parameters.h"
#include "core/meshers/mesher.h"
#include "server/base/mesh_functions.h"
#include "server/inputs/feature_store.h"
#include "server/jobs/job.h"
#include "server/sessions/session_inputs.h"
#include "server/store/mesh_snapshot.h"
#include "server/store/point_store.h"

namespace wellspace::server {

// The mesher that the first refinement begins with: of the domain of `features`, or, if there are none, of a cloud.
//
// Errors:     those of `create_mesher`.
absl::StatusOr<std::unique_ptr<core::Mesher>> BeginMesh(const MesherFactory& create_mesher,
                                                        const core::MeshParameters& parameters,
                                                        std::span<const double> points, const FeatureStore& features,
                                                        core::RunContext& context);

// Memory of `mesher` with `count` more vertices, in bytes, for all but the most uneven clouds.
//
// Complexity: O(1).
uint64_t BytesWithVertices(const core::Mesher& mesher, uint64_t count);

// Adds the points from number `first` up to `end` to `mesher`, for which the context is asked for memory first.
//
// Errors:     those of Mesher::AddPoints and PointStore::Copy; those of the context's lender, which change nothing.
absl::Status AddPointsTo(core::Mesher& mesher, const PointStore& points, uint64_t first, uint64_t end,
                         core::RunContext& context);

// Takes the steps of `inputs` again, from the first on, in the work of `job` but apart from its context. `last_mesh` is
// the mesh of the last refinement among them.
//
// REQUIRES:   there are steps; nothing changes the inputs meanwhile.
// Guarantees: later results of the mesher are, to the bit, those that the first mesher, which the steps were made by,
//             would have had.
// Complexity: that of the steps. Reserves memory as the first refinement did.
// Errors:     those of the steps: RESOURCE_EXHAUSTED, CANCELLED, DEADLINE_EXCEEDED; INTERNAL: the mesh is not
//             `last_mesh`; DATA_LOSS.
absl::StatusOr<std::unique_ptr<core::Mesher>> Replay(const SessionInputs& inputs, const MeshSnapshot& last_mesh,
                                                     const MesherFactory& create_mesher, Job& job);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_REPLAY_H_
