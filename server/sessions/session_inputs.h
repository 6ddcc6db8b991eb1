// The inputs of a session, from which its structure is computed: points, features, sizes and steps.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_INPUTS_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_INPUTS_H_

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/criterion.h"
#include "core/input/mesh_parameters.h"
#include "server/inputs/feature_store.h"
#include "server/jobs/memory_budget.h"
#include "server/sessions/session_state.h"
#include "server/store/point_store.h"
#include "server/store/records.h"

namespace wellspace::server {

// The sizes at points that a session has, by the numbers of their sets.
using SizeSets = std::map<uint64_t, std::shared_ptr<const core::SizeSamples>>;

// The sets of `session` in `records`, which are to be `wanted`.
//
// Errors:     DATA_LOSS.
absl::StatusOr<SizeSets> ReadSizeSets(Records& records, const std::string& session,
                                      const std::vector<SizesInUse>& wanted);

// The inputs of a session, for the work that has the session to itself: nothing of them changes meanwhile.
//
// Thread safety: thread-compatible.
struct SessionInputs {
  std::shared_ptr<const SessionState> state;
  std::shared_ptr<const PointStore> points;
  std::shared_ptr<const FeatureStore> features;
  SizeSets sizes;
  Lasts lasts = Lasts::kSession;  // of the memory for results that are computed of them

  uint64_t point_count() const { return points->coordinate_count() / state->parameters->dimension; }
  // `parameters` with the sizes at points of this set; those of a step with its own; or those of an operation with the
  // sizes of now.
  core::MeshParameters With(const core::MeshParameters& parameters, uint64_t set) const {
    core::MeshParameters all = parameters;
    const auto found = sizes.find(set);
    all.size_samples = found == sizes.end() ? nullptr : found->second;
    return all;
  }
  core::MeshParameters ParametersOf(const SessionStep& step) const {
    return With(*step.refined_with, step.sizes.number);
  }
  core::MeshParameters ParametersOf(const core::MeshParameters& of_operation) const {
    return With(of_operation, state->sizes().number);
  }
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_INPUTS_H_
