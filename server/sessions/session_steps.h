// The steps that have made the structure of a session.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_STEPS_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_STEPS_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/input/mesh_parameters.h"

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
  // Without sizes at points, which `sizes` names; null: vertices were added.
  std::shared_ptr<const core::MeshParameters> refined_with;
  SizesInUse sizes;
};

// The steps of a session that succeeded, in their order. Structure and mesh are a function of these, of the points, the
// features and the sizes: Replay (server/sessions/replay.h) computes it. A failed change is no step. The SessionLog
// has the steps, too.
//
// A value. Copies share all but the last steps, so that a session with many additions is as cheap to change as others.
//
// Thread safety: thread-compatible.
// Invariants: (1) the first step is a refinement; (2) the end of a step <= the uploads_end of the next one <= its end.
class SessionSteps {
 public:
  // `points` of the session are meshed now, after a refinement with `parameters` and `sizes`.
  void NoteRefinement(uint64_t points, std::shared_ptr<const core::MeshParameters> parameters, SizesInUse sizes);
  // Those before number `uploads_end` came by uploads, those up to `end` were added as vertices.
  //
  // REQUIRES:   there was a refinement.
  void NoteAddition(uint64_t uploads_end, uint64_t end);

  // The sets of sizes of all refinements, each once, ascending by number.
  std::vector<SizesInUse> sizes() const;

  // All of them. Complexity: O(steps).
  std::vector<SessionStep> all() const;
  size_t count() const { return blocks_.size() * kBlock + rest_.size(); }
  bool empty() const { return count() == 0; }
  // Of the session's points, those that the structure has.
  uint64_t points() const;

 private:
  using Block = std::vector<SessionStep>;
  static constexpr size_t kBlock = 256;  // steps

  void Add(SessionStep step);

  std::vector<std::shared_ptr<const Block>> blocks_;  // of kBlock steps each
  Block rest_;                                        // behind them, fewer than kBlock
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_STEPS_H_
