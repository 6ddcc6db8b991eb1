// The work of a server with its log, and a model of the data that have to be there after a crash.
#ifndef WELLSPACE_TESTS_SERVER_STORE_STORE_LIFE_H_
#define WELLSPACE_TESTS_SERVER_STORE_STORE_LIFE_H_

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/sessions/session_state.h"
#include "server/store/durable_log.h"
#include "tests/server/store/simulated_disk.h"
#include "tests/server/store/store_support.h"
#include "tests/support/clouds.h"

namespace wellspace::server {

// All that was written down, as it should be.
struct LifeState {
  struct Session {
    store::v1::SessionRecord state;
    std::vector<store::v1::StepRecord> steps;  // those of features, too
    std::map<uint64_t, StoredSizes> sizes;     // by number
    std::map<uint64_t, store::v1::OperationRecord> operations;
    std::vector<double> points;
    std::optional<MeshShape> mesh;
    SessionState applied;  // Apply of its changes
  };

  std::map<uint64_t, Session> sessions;                                            // by number
  std::map<std::pair<std::string, std::string>, store::v1::AnswerRecord> answers;  // by tenant and request_id
};

// A server's work on a simulated disk, one change at a time. A restart has to find the state after one of its
// changes: after the last that was acknowledged, or after the one that was under way.
//
// Thread safety: none.
class StoreLife {
 public:
  enum class Action {
    kCreate,
    kUpload,
    kRemove,
    kUpdate,
    kTouch,
    kAddFeatures,
    kSetSizes,
    kStart,
    kSucceed,
    kFail,
    kDelete,
    kForget,
    kSweep,
  };
  static constexpr int kActions = 13;

  // Bugs that tests plant, to see that they are found.
  struct Bugs {
    bool answers_before_commit = false;
    bool answers_in_another_transaction = false;
  };

  explicit StoreLife(SimulatedDisk& disk) : StoreLife(disk, Bugs()) {}
  StoreLife(SimulatedDisk& disk, const Bugs& bugs) : disk_(disk), bugs_(bugs) {}

  // Opens the log. An error, if the disk fails.
  absl::Status Open();
  // Does something to the session of this number, if that can be done to it now. An error, if the disk fails.
  absl::Status Do(Action action, uint64_t number);
  // One of these, drawn.
  absl::Status DoAnything(test::SplitMix64& random);

  // Ends the process as a crash does, restarts the machine, and opens the log again, with crashes meanwhile, if
  // `crashes_again` is drawn. Returns the fault of the log that is found; empty: all is as it should be.
  std::string Restart(SimulatedDisk::Loss loss, test::SplitMix64& random);

  // Compares the log's records and files with the model. Returns the fault, or "".
  std::string Check();
  // The same, by CheckData, and by a start on the folder; the log is open again then.
  std::string CheckWhole();
  // The number of times that the log has said that it has failed for good.
  int failures() const { return failures_; }
  // The number of changes that it has acknowledged.
  int acknowledgments() const { return acknowledgments_; }
  SessionLog* log() { return log_.get(); }
  const LifeState& state() const { return states_[acknowledged_]; }

  static constexpr char kFolder[] = "/data";

 private:
  // The parts of a session that a server has in memory.
  struct Open_ {
    store::v1::PointsFile file;  // where points are appended
    std::unique_ptr<PointStore> points;
    std::shared_ptr<MeshSnapshot> mesh;
  };

  // The file that points of a session come to which is created, or opened, now.
  store::v1::PointsFile NextFile() const;
  absl::Status Create(uint64_t number);
  absl::Status Upload(uint64_t number);
  // Takes some points out.
  absl::Status Remove(uint64_t number);
  absl::Status Succeed(uint64_t number);
  absl::Status Change(uint64_t number, Action action);
  absl::Status Commit(SessionChange change, LifeState next, Survives survives = Survives::kPowerLoss);
  absl::Status CommitToLog(SessionChange change, Survives survives);
  void Acknowledge(Survives survives);
  store::v1::AnswerRecord NextAnswer();
  void Close();
  std::string FindState(size_t least);
  std::string CheckFiles(const LifeState& state, const StoredSessions& stored);
  std::string CheckFolder(const LifeState& state);

  SimulatedDisk& disk_;
  const Bugs bugs_;
  std::unique_ptr<SessionLog> log_;
  std::map<uint64_t, Open_> open_;
  // After each change; the last one may have failed.
  std::vector<LifeState> states_ = std::vector<LifeState>(1);
  size_t acknowledged_ = 0;                                  // of these, the last one that outlives the process
  size_t durable_acknowledged_ = 0;                          // and a loss of power
  std::set<std::pair<std::string, std::string>> forgotten_;  // answers, which the next change takes with it
  uint64_t salt_ = 0;                                        // makes each change another
  int failures_ = 0;
  int acknowledgments_ = 0;
  std::optional<std::pair<SessionChange, Survives>> late_;  // with answers_before_commit
};

// The text of all that is in it but the files.
std::string TextOf(const LifeState& state);

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_STORE_STORE_LIFE_H_
