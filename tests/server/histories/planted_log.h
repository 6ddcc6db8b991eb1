// A session log around another one, with faults that a test plants.
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

// What a server is at: a call, or the work of an operation.
enum class Step {
  kStart,
  kCreate,
  kUpdate,
  kUpload,
  kBrokenUpload,
  kRemovePoints,
  kAddSegments,
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
  kLook,
};

// What is wrong with the server, for as long as it is at `during`.
struct Plant {
  Step during = Step::kLook;
  bool omits_points_synchronize = false;  // PointStore::Synchronize is not called
  std::string omits_synchronize{};        // of files and folders whose paths end so, the disk does nothing
  bool answers_before_commit = false;     // what is committed is committed when the step is over
  bool removes_files_first = false;       // of what a change gives up, before it is committed
};

// As a test wants it. With the plant of a default constructor, the log that it is around.
//
// Thread safety: that of the log that it is around.
class PlantedLog final : public PassingLog {
 public:
  // `step` says what the server is at. REQUIRES: `disk` outlives this.
  PlantedLog(std::unique_ptr<SessionLog> log, SimulatedDisk& disk, std::string root, Plant plant,
             std::function<Step()> step)
      : PassingLog(*log),
        log_(std::move(log)),
        disk_(disk),
        root_(std::move(root)),
        plant_(std::move(plant)),
        step_(std::move(step)) {}

  // Commits what has waited for the end of the step.
  void EndStep();

  absl::StatusOr<StoredSessions> Load() override;
  absl::Status Commit(const SessionChange& change, Survives survives) override;
  std::unique_ptr<PointStore> OpenPoints(const std::string& session, int dimension, uint64_t number,
                                         std::vector<store::v1::StepRecord::Points> committed) override;

 private:
  // Removes the files that `change` gives up.
  void RemoveFilesOf(const SessionChange& change);

  const std::unique_ptr<SessionLog> log_;
  SimulatedDisk& disk_;
  const std::string root_;
  const Plant plant_;
  const std::function<Step()> step_;
  std::map<std::string, store::v1::SessionRecord> states_;  // by session, as they were last given
  std::vector<std::pair<SessionChange, Survives>> late_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_HISTORIES_PLANTED_LOG_H_
