// Clients of a server: the calls that they make, the answers, and the state that they have to find after each crash.
#ifndef WELLSPACE_TESTS_SERVER_HISTORIES_SESSION_LIFE_H_
#define WELLSPACE_TESTS_SERVER_HISTORIES_SESSION_LIFE_H_

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/server/histories/simulated_server.h"
#include "tests/server/store/simulated_disk.h"
#include "tests/support/clouds.h"

namespace wellspace::server {

// A client's knowledge of an operation.
struct KnownOperation {
  enum class State { kUnderWay, kSucceeded, kFailed, kCancelled };

  uint64_t number = 0;
  State state = State::kUnderWay;
  uint64_t mesh_revision = 0;
  bool restart = false;
  int deaths = 0;  // of processes, in its work
};

// A client's knowledge of a session: a box or a domain in the plane, or the inside of a block in space.
struct KnownSession {
  std::string name;
  std::string label;
  size_t dimension = 2;
  int64_t ttl_seconds = 3600;
  uint64_t revision = 1;
  bool is_ready = false;
  std::vector<double> points;
  std::vector<uint32_t> segment_ends;
  size_t triangles = 0;  // of the block
  std::vector<double> sizes;
  uint64_t mesh_revision = 0;  // 0: none
  std::string mesh;            // its download; empty: not seen yet
  bool has_structure = false;
  std::vector<KnownOperation> operations;

  bool IsBusy() const;
  size_t point_count() const { return points.size() / dimension; }
  size_t size_count() const { return sizes.size() / (dimension + 1); }
};

// By a number of the clients'.
using World = std::map<int, KnownSession>;

// The figures of it that GetSession and ListOperations show, as text.
std::string TextOf(const World& world);

// Clients of one server, each with one call after the other. A client whose call is not answered, since the server has
// died, makes the call again, with the same request_id, once the server is there again.
//
// Thread safety: none.
class SessionLife {
 public:
  static constexpr int kSessions = 3;
  static constexpr int kBlock = kSessions - 1;  // the number of the one in space

  // REQUIRES:   `disk` is new, and outlives this.
  SessionLife(SimulatedDisk& disk, const Plant& plant)
      : disk_(disk), server_(disk, plant), is_planted_(plant.during != Step::kLook) {}

  // Starts the server. Returns the fault; empty: all is as it should be, or the disk has died.
  std::string Start();
  // Does one thing to the session of this number, if that can be done to it now. Returns the fault, or "".
  std::string Do(Step step, int number, test::SplitMix64& random);
  // One of them, drawn.
  std::string DoAnything(test::SplitMix64& random);
  // Ends the process as a crash does, starts the machine and the server again, with crashes meanwhile, and looks at all
  // that clients were answered. Returns the fault, or "".
  std::string Restart(SimulatedDisk::Loss loss, test::SplitMix64& random);
  // Lets all operations come to their end, and looks at all; then at the folder, as check-data does.
  std::string CheckWhole();

  SimulatedServer& server() { return server_; }
  const World& world() const { return world_; }

 private:
  // A change: its call, which may be made again, and the world when it was made.
  struct Change {
    Step step = Step::kLook;
    // Returns the fault of the answer, if there is any. The client's new knowledge goes into `*after`.
    std::function<std::string(World* after, bool* is_answered)> call;
    World after;
  };

  std::string Make(Change change);
  Change CreateOf(int number);
  Change UpdateOf(int number, int64_t ttl_seconds);
  Change UploadOf(int number, bool breaks_off, test::SplitMix64& random);
  Change RemovePointsOf(int number, test::SplitMix64& random);
  // Segments of one in the plane, triangles of the block.
  Change AddFeaturesOf(int number);
  Change AddTrianglesOf(int number);
  Change SetSizesOf(int number, test::SplitMix64& random);
  // Of `known`, which is the world, or that after points have come.
  Change RefineOf(World known, int number, bool restart);
  Change CancelOf(int number);
  Change AddVerticesOf(World known, int number, test::SplitMix64& random);
  Change DeleteOf(int number);
  // `change`, with an upload beside it that goes on: it takes the points that have come.
  Change BesideUpload(Step step, int number, test::SplitMix64& random);
  // The change of this step; nothing, if it cannot be made now.
  std::optional<Change> ChangeOf(Step step, int number, test::SplitMix64& random);

  std::string Expire(int number);
  // Makes the last call with a request_id once more, which was answered.
  std::string Repeat();
  // The job whose turn it is.
  std::string Work();
  std::string EndWork(int number, const v1::Operation& ended);
  // The world in which the operation under way of the session has succeeded.
  World Succeeded(int number) const;

  // The world as the server shows it.
  std::string Look(std::string* problem);
  // Takes the world that the server shows for the only one, if it is one of those that may be.
  std::string Find();
  // Takes the names that the server has given, and has the operations watched that are under way.
  std::string TakeNames();
  // Whether all that was sent is there: points, segments, triangles, sizes, meshes; and no file besides.
  std::string CheckContents();
  std::string CheckMesh(KnownSession& session);
  std::string CheckInputs(const KnownSession& session);
  std::string CheckFolder();

  SimulatedDisk& disk_;
  SimulatedServer server_;
  const bool is_planted_;             // then clients have to find the fault
  World world_;                       // after the last change that was answered
  std::vector<World> candidates_;     // besides, those that may be there after a crash
  std::optional<Change> unanswered_;  // that is made again after a crash
  std::optional<Change> repeated_;    // the last one with a request_id that was answered
  std::map<int, std::string> names_;  // of the sessions, as the server has last shown them
  uint64_t salt_ = 0;                 // makes each change another
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_HISTORIES_SESSION_LIFE_H_
