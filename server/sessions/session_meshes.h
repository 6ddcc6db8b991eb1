// The meshes of a session that clients may ask for, and the products of them that are kept.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_MESHES_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_MESHES_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "core/partition/partition.h"
#include "server/jobs/job.h"
#include "server/jobs/memory_budget.h"
#include "server/sessions/mesh_cut.h"
#include "server/sessions/mesh_deltas.h"
#include "server/sessions/session_locator.h"
#include "server/store/mesh_snapshot.h"

namespace wellspace::server {

// The last mesh of a session, the one before it that clients have, and, of these, locators, cuts and differences. All
// but the last mesh may be given up for other work; locators and cuts are made again when they are asked for.
//
// Thread safety: thread-safe. Its lock is held for no longer than it takes to look, and may be taken under those of the
//                session; `check` is called without it.
class SessionMeshes {
 public:
  struct Options {
    std::string session;                  // its name, for errors
    bool are_files = false;               // meshes take no memory
    Lasts lasts = Lasts::kSession;        // how long memory is reserved for products
    std::function<absl::Status()> check;  // whether the session is open, and has a mesh
  };
  explicit SessionMeshes(Options options);

  // Values that are not kept any more, for the caller to free them without a lock.
  struct Dropped {
    std::shared_ptr<MeshSnapshot> earlier;
    std::vector<SessionLocator::Made> located;
    std::vector<SessionCuts::Made> cuts;
    std::vector<MeshDeltas::Delta> deltas;
    uint64_t bytes = 0;  // that they free, where they were given up
  };

  // The last mesh; null before the first.
  std::shared_ptr<MeshSnapshot> last() const;
  // Whether a call has it, too.
  bool IsRead() const;
  // The mesh of `revision`: the last one, or the one before it that was downloaded, or located points in, last. That is
  // kept while memory allows it.
  //
  // Errors:     those of `check`; MESH_NOT_KEPT, naming those that are.
  absl::StatusOr<std::shared_ptr<const MeshSnapshot>> Kept(uint64_t revision) const;
  // The differences that are known between the last mesh and those before.
  MeshDeltas& deltas() { return deltas_; }

  // `mesh` is the last one now, to which `delta`, if not null, leads. The one before is obsolete; it is kept as the
  // earlier one if clients have it, and its file is this owner's, whose `epoch` that is.
  [[nodiscard]] Dropped Replace(std::shared_ptr<MeshSnapshot> mesh, MeshDeltas::Delta delta, uint64_t epoch);
  // The first mesh, of a session that is restored.
  void Restore(std::shared_ptr<MeshSnapshot> mesh);

  // The mesh of `revision`, as Kept has it, for points to be located in: the kept one, or made by `job`. 0: the last.
  //
  // Errors:     those of `check`; REVISION_MISMATCH; those of MakeLocated.
  absl::StatusOr<std::shared_ptr<const LocatedMesh>> PrepareLocator(uint64_t revision, Job& job);
  // Whether PrepareLocator makes none.
  bool HasLocator(uint64_t revision) const;

  // The cut of `mesh`, a mesh of the session: the kept one, or made by `job`. `*is_at_work`: another job makes one
  // now, and the cut is null; to be tried again.
  //
  // Errors:     those of `check`, and of CutIntoParts.
  absl::StatusOr<std::shared_ptr<const MeshCut>> PrepareCut(const std::shared_ptr<const MeshSnapshot>& mesh,
                                                            const core::PartitionOptions& options, Job& job,
                                                            bool* is_at_work);
  // Whether PrepareCut would return a kept cut, and whether another job makes one now.
  bool HasCut(const MeshSnapshot& mesh, const core::PartitionOptions& options) const;
  bool IsCutting() const { return cuts_.IsMaking(); }

  // The part of the memory that is asked about.
  enum class Part { kEarlier, kAll };
  // The bytes that GiveUp would free.
  uint64_t SpareBytes(Part part) const;
  // Gives up values that no caller uses: the earlier mesh, unless it is a file, and its locator; of kAll also the
  // locator and the cuts of the last mesh, and all differences.
  [[nodiscard]] Dropped GiveUp(Part part);
  // The memory of the earlier mesh is other work's, if that wants it.
  void YieldEarlier();

 private:
  // Whether a client may have values on `mesh`, the last one: it was asked for.
  bool WasAskedFor(const MeshSnapshot& mesh) const;
  bool IsEarlierSpare() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Options options_;
  // These have locks of their own. No thread holds the session's turn of changes and wants one of the first three.
  SessionLocator locator_;          // of last_
  SessionLocator earlier_locator_;  // of earlier_
  SessionCuts cuts_{kMostCuts};
  MeshDeltas deltas_;

  mutable absl::Mutex mutex_;
  std::shared_ptr<MeshSnapshot> last_ ABSL_GUARDED_BY(mutex_);     // null: none yet
  std::shared_ptr<MeshSnapshot> earlier_ ABSL_GUARDED_BY(mutex_);  // a mesh before the last one; null: none
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_MESHES_H_
