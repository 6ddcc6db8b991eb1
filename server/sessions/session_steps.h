// What the structure of a session was made by.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_STEPS_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_STEPS_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/geometry/criterion.h"
#include "core/mesh_parameters.h"

namespace wellspace::server {

// A set of sizes at points that a session has, or has had.
struct SizesInUse {
  uint64_t number = 0;  // of its sets; 0: none
  uint64_t count = 0;   // samples

  bool operator==(const SizesInUse&) const = default;
};

// One change of the structure that succeeded. It takes in the points that were uploaded since the step before, and then
// refines, or adds the vertices of one AddVertices.
struct SessionStep {
  uint64_t uploads_end = 0;  // of the session's points, the first that was not taken in as an upload
  uint64_t end = 0;  // the first that is not in the structure after the step; those from uploads_end on were added
  std::shared_ptr<const core::MeshParameters> refined_with;  // null: vertices were added
  SizesInUse sizes;                                          // those of refined_with
};

// The steps of a session that succeeded, in their order. Structure and mesh are a function of these and of the points:
// Replay (server/sessions/replay.h) computes it. What did not succeed is no step. They are as well in the SessionLog.
//
// Thread safety: thread-compatible.
// Invariants: (1) the first step is a refinement; (2) steps[i].end <= steps[i + 1].uploads_end <= steps[i + 1].end.
class SessionSteps {
 public:
  // `points` of the session are meshed now, after a refinement with `parameters`.
  // `sizes` says which sizes at points `parameters` have, or, before ResolveSizes, will have.
  void NoteRefinement(uint64_t points, const core::MeshParameters& parameters, SizesInUse sizes);
  // Those before number `uploads_end` came by uploads, those up to `end` were added as vertices.
  //
  // REQUIRES:   there was a refinement.
  void NoteAddition(uint64_t uploads_end, uint64_t end);

  // Gives the refinements their sizes at points, which `find` has by the number of the set.
  void ResolveSizes(const std::function<std::shared_ptr<const core::SizeSamples>(uint64_t number)>& find);

  // The sets of sizes of all refinements, each once, ascending by number.
  std::vector<SizesInUse> sizes() const;

  const std::vector<SessionStep>& all() const { return steps_; }
  bool empty() const { return steps_.empty(); }
  // Of the session's points, those that the structure has.
  uint64_t points() const { return steps_.empty() ? 0 : steps_.back().end; }

 private:
  std::vector<SessionStep> steps_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_STEPS_H_
