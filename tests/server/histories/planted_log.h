// Records and files around those of a log, with faults that a test plants.
#ifndef WELLSPACE_TESTS_SERVER_HISTORIES_PLANTED_LOG_H_
#define WELLSPACE_TESTS_SERVER_HISTORIES_PLANTED_LOG_H_

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/store/session_log.h"
#include "tests/server/store/passing_log.h"
#include "tests/server/store/simulated_disk.h"

namespace wellspace::server {

// The step that a server is at: a call, or the work of an operation.
enum class Step {
  kStart,
  kCreate,
  kUpdate,
  kUpload,
  kBrokenUpload,
  kRemovePoints,
  kAddFeatures,
  kSetSizes,
  kRefine,
  kRefineBesideUpload,
  kWork,
  kCancel,
  kAddVertices,
  kAddVerticesBesideUpload,
  kDelete,
  kExpire,
  kSweep,
  kRepeat,
  kLook,
};

// A fault that is planted into the server, for as long as it is at `during`.
struct Plant {
  Step during = Step::kLook;
  bool omits_points_synchronize = false;  // PointStore::Synchronize is not called
  std::string omits_synchronize{};        // of files and folders whose paths end so, the disk does nothing
  bool answers_before_commit = false;     // a change is committed when the step is over
  bool removes_files_first = false;       // those that a change gives up, before it is committed
  // Whatever the server is at. As if another process had answered all requests: this one does not know of them.
  bool hides_answers = false;
};

// Records as a test wants them. With the plant of a default constructor, those of the log that they are around.
//
// Thread safety: that of the log that they are around.
class PlantedRecords final : public PassingRecords {
 public:
  // `step` returns the step that the server is at. REQUIRES: `disk` outlives this.
  PlantedRecords(std::shared_ptr<SessionLog> log, SimulatedDisk& disk, std::string root, Plant plant,
                 std::function<Step()> step)
      : PassingRecords(std::move(log)),
        disk_(disk),
        root_(std::move(root)),
        plant_(std::move(plant)),
        step_(std::move(step)) {}

  // Applies changes that have waited for the end of the step.
  void EndStep();

  absl::StatusOr<StoredSessions> Load() override;
  absl::Status Apply(const SessionChange& change, Survives survives) override;

 private:
  // Removes the files that `change` gives up.
  void RemoveFilesOf(const SessionChange& change);

  SimulatedDisk& disk_;
  const std::string root_;
  const Plant plant_;
  const std::function<Step()> step_;
  std::map<std::string, store::v1::SessionRecord> states_;  // by session, as they were last given
  std::vector<std::pair<SessionChange, Survives>> late_;
};

// Files whose points are not synchronised where the plant says so.
class PlantedFiles final : public PassingFiles {
 public:
  PlantedFiles(std::shared_ptr<SessionLog> log, Plant plant, std::function<Step()> step)
      : PassingFiles(std::move(log)), plant_(std::move(plant)), step_(std::move(step)) {}

  std::unique_ptr<PointStore> OpenPoints(SessionPoints points) override;

 private:
  const Plant plant_;
  const std::function<Step()> step_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_HISTORIES_PLANTED_LOG_H_
