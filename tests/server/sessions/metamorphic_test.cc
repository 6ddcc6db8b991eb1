// A session is a function of its steps: whatever the threads, the pieces in which its points come, restarts, structures
// that are given up, and operations that do not succeed, the same steps end with the same mesh.
#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "server/backend.h"
#include "server/network/connections.h"
#include "server/sessions/refinement.h"
#include "server/sessions/session_use.h"
#include "server/store/check_data.h"
#include "server/store/durable_log.h"
#include "spdlog/logger.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "tests/server/store/store_support.h"
#include "tests/support/amount.h"
#include "tests/support/seeded_test.h"

namespace wellspace::server {
namespace {

// Lives, and variations of each; the long test has many.
const int kLives = test::Amount("WELLSPACE_LIVES", 6);
const int kVariations = test::Amount("WELLSPACE_VARIATIONS", 6);

// A step of a life.
struct LifeStep {
  enum class Kind { kUpload, kAddTriangles, kRefine, kAdd, kSetSizes, kRemove } kind = Kind::kUpload;
  std::vector<double> points{};  // of kUpload, kAdd and kSetSizes
  double size = 0;               // of kRefine
  bool restart = false;          // of kRefine
  uint64_t one_of = 0;           // of kRemove: one point of so many goes
};

struct Life {
  int dimension = 2;
  bool is_block = false;  // the inside of BlockRequest, whose corners are the first points
  std::vector<LifeStep> steps;
};

std::vector<double> DrawPoints(test::SplitMix64& random, uint64_t count, const Life& life) {
  std::vector<double> points(count * life.dimension);
  const double low = life.is_block ? -0.45 : 0.05;
  std::ranges::generate(points, [&] { return low + 0.9 * random.Unit(); });
  return points;
}

Life DrawLife(test::SplitMix64& random, bool is_block) {
  Life life{.dimension = is_block || random.Below(3) == 0 ? 3 : 2, .is_block = is_block, .steps = {}};
  if (is_block) {
    life.steps.push_back({.kind = LifeStep::Kind::kUpload, .points = BlockPoints()});
    life.steps.push_back({.kind = LifeStep::Kind::kAddTriangles});
  }
  // No points are added to the mesh of the block: it is begun anew with those that have come.
  bool begins_anew = false;
  const auto upload = [&] {
    life.steps.push_back({.kind = LifeStep::Kind::kUpload, .points = DrawPoints(random, 1 + random.Below(60), life)});
    begins_anew = is_block;
  };
  const auto refine = [&] {
    life.steps.push_back({.kind = LifeStep::Kind::kRefine,
                          .size = random.Below(2) == 0 ? 0 : 0.15 + random.Unit(),
                          .restart = std::exchange(begins_anew, false)});
  };
  upload();
  refine();
  for (uint64_t i = 2 + random.Below(4); i > 0; --i) {
    switch (random.Below(6)) {
      case 0:
        upload();
        break;
      case 1:
        refine();
        break;
      case 2:
        life.steps.push_back({.kind = LifeStep::Kind::kRefine, .size = 0.3, .restart = true});
        break;
      case 3:
        life.steps.push_back({.kind = LifeStep::Kind::kSetSizes, .points = DrawPoints(random, random.Below(4), life)});
        break;
      case 4:
        life.steps.push_back({.kind = LifeStep::Kind::kRemove, .one_of = 2 + random.Below(8)});
        refine();  // nothing can be added before
        break;
      default:
        if (is_block) {
          upload();
          break;
        }
        life.steps.push_back({.kind = LifeStep::Kind::kAdd, .points = DrawPoints(random, 1 + random.Below(5), life)});
    }
  }
  refine();
  return life;
}

// A process of the server over a folder, without the network.
class Process {
 public:
  explicit Process(const std::string& folder)
      : backend_({.workers = 2}, authenticator_, observability_, logger_, OpenDurableLog({.folder = folder}).value(),
                 FakeMesher, FakeEstimator, core::Mesher::Create) {
    EXPECT_TRUE(backend_.Restore().ok());
  }

  const CallEnvironment& environment() const { return backend_.environment(); }

  // Does `work` on a worker, and waits for it.
  absl::Status Work(const std::function<absl::Status(Job&)>& work) {
    Event done;
    absl::Status status;
    const auto job = environment().jobs.Submit({.tenant = "a", .work = [&](Job& running) {
                                                  status = work(running);
                                                  done.Set();
                                                }});
    EXPECT_TRUE(job.ok() && done.Wait());
    return status;
  }

 private:
  const std::shared_ptr<spdlog::logger> logger_ = std::make_shared<spdlog::logger>("none");
  Authenticator authenticator_;
  Connections connections_{{}, logger_};
  Observability observability_{{}, logger_, connections_, [](const grpc::ServerContextBase&) { return ""; }};
  Backend backend_;
};

// Lives a life in a folder of its own.
class Living {
 public:
  // `random`: for the variations of the life; null: there are none.
  Living(const Life& life, test::SplitMix64* random) : life_(life), random_(random) { Restart(); }

  // Of the last mesh.
  uint32_t Hash() {
    session_ = process_->environment()
                   .sessions.Create({.tenant = "a", .parameters = Parameters(0), .labels = {}, .ttl = absl::Hours(1)})
                   .value();
    for (const LifeStep& step : life_.steps) {
      Disturb();
      switch (step.kind) {
        case LifeStep::Kind::kUpload:
          Upload(step.points);
          break;
        case LifeStep::Kind::kAddTriangles:
          AddTriangles();
          break;
        case LifeStep::Kind::kRefine:
          Refine(step.size, step.restart);
          break;
        case LifeStep::Kind::kSetSizes:
          SetSizes(step.points);
          break;
        case LifeStep::Kind::kAdd:
          Add(step.points);
          break;
        case LifeStep::Kind::kRemove:
          Remove(step.one_of);
          break;
      }
    }
    Disturb();
    return HashOf(*session_->meshes().last());
  }

  const std::string& what() const { return what_; }

  ~Living() {
    session_ = nullptr;
    process_.reset();
    const absl::StatusOr<DataReport> report = CheckData(folder_.path());
    EXPECT_TRUE(report.ok() && report->is_whole() && report->unknown.empty());
  }

 private:
  // Whether something that comes once in `n` times comes now.
  bool Draw(uint64_t n) { return random_ != nullptr && random_->Below(n) == 0; }

  core::MeshParameters Parameters(double size) {
    core::MeshParameters parameters{.dimension = life_.dimension};
    if (!life_.is_block) {
      parameters.domain_low.assign(life_.dimension, 0);
      parameters.domain_high.assign(life_.dimension, 1);
    }
    parameters.max_circumradius = size;
    parameters.threads = random_ == nullptr ? 1 : static_cast<int>(1 + random_->Below(3));
    return parameters;
  }

  void Restart() {
    const std::string name = session_ == nullptr ? "" : session_->name();
    session_ = nullptr;
    process_.reset();
    process_.emplace(folder_.path());
    if (!name.empty()) {
      session_ = process_->environment().sessions.Find("a", name).value();
    }
  }

  // Disturbances that leave nothing behind.
  void Disturb() {
    if (Draw(4)) {
      what_ += " restart";
      Restart();
    }
    if (Draw(3)) {
      what_ += " give-up";
      (void)session_->GiveUpMemory();  // nothing, where it has none
    }
    if (has_structure_ && Draw(4)) {
      what_ += " query";
      EXPECT_TRUE(process_->Work([&](Job& job) { return Query(job); }).ok());
    }
    if (Draw(4)) {
      what_ += " fail";
      Fail();
    }
  }

  absl::Status Query(Job& job) {
    const StructureUse use(session_);
    const absl::Status prepared = session_->PrepareStructure(0, process_->environment().create_mesher, job);
    uint64_t version = 0;
    return prepared.ok() ? session_->Query(&version, [](const core::Mesher&) { return absl::OkStatus(); }) : prepared;
  }

  // An operation that is cancelled at some moment, or fails since its mesh is too large.
  void Fail() {
    core::MeshParameters parameters = Parameters(0.01);
    parameters.max_vertices = 400 + random_->Below(1000);
    const std::shared_ptr<Operation> operation =
        StartRefinement(process_->environment(), session_, parameters, /*restart=*/Draw(3), 0).value();
    if (Draw(2)) {
      std::this_thread::sleep_for(std::chrono::microseconds(random_->Below(3000)));
      (void)CancelOperation(process_->environment(), *session_, *operation);
    }
    EXPECT_NE(End(*operation), v1::Operation::STATE_SUCCEEDED);
  }

  static v1::Operation::State End(const Operation& operation) {
    while (!operation.HasEnded()) {
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    return operation.Describe().state();
  }

  void Upload(const std::vector<double>& points) {
    const uint64_t first = session_->state()->record.points();
    const uint64_t count = points.size() / life_.dimension;
    for (uint64_t done = 0; done < count;) {
      const uint64_t again = random_ == nullptr ? 0 : random_->Below(done + 1);  // of those that it has
      const uint64_t end = random_ == nullptr ? count : done + 1 + random_->Below(count - done);
      const std::vector<double> piece(points.begin() + (done - again) * life_.dimension,
                                      points.begin() + end * life_.dimension);
      EXPECT_TRUE(session_->Append(first + done - again, piece, 0).ok());
      done = end;
      if (Draw(2)) {
        EXPECT_TRUE(session_->CommitPoints().ok());
      }
    }
    EXPECT_TRUE(session_->CommitPoints().ok());
  }

  // Those of the block, all at once or in pieces that overlap.
  void AddTriangles() {
    const v1::AddTrianglesRequest request = BlockRequest("");
    FeaturePart part;
    *part.mutable_triangles() = request.triangles();
    *part.mutable_surface() = request.surface();
    if (const uint64_t early = random_ == nullptr ? 0 : random_->Below(12); early > 0) {
      FeaturePart first = part;
      first.mutable_triangles()->mutable_corners()->Truncate(static_cast<int>(3 * early));
      first.mutable_triangles()->mutable_markers()->Truncate(static_cast<int>(early));
      EXPECT_TRUE(session_->AddFeatures(first, {}, 0).ok());
      Disturb();
    }
    EXPECT_TRUE(session_->AddFeatures(part, {}, 0).ok());
  }

  // A set of sizes, 0.04 at each point; none without any.
  void SetSizes(const std::vector<double>& points) {
    std::shared_ptr<core::SizeSamples> samples;
    if (!points.empty()) {
      samples = std::make_shared<core::SizeSamples>();
      samples->points = points;
      samples->sizes.assign(points.size() / life_.dimension, 0.04);
    }
    EXPECT_TRUE(session_->SetSizes(samples, 0).ok());
  }

  // All points at once, or the last of them first.
  void Remove(uint64_t one_of) {
    std::vector<uint64_t> numbers;
    const uint64_t first_free = life_.is_block ? BlockPoints().size() / 3 : 0;
    for (uint64_t i = first_free; i < session_->state()->record.points(); i += one_of) {
      numbers.push_back(i);
    }
    const uint64_t first = random_ == nullptr ? 0 : random_->Below(numbers.size() + 1);
    const std::span<const uint64_t> all(numbers);
    for (const std::span<const uint64_t> part : {all.subspan(first), all.first(first)}) {
      const absl::StatusOr<PointsLeft> left = session_->RemovePoints(part, 0);
      EXPECT_TRUE(left.ok()) << left.status();
      has_structure_ &= part.empty();
      if (Draw(3)) {
        what_ += " restart-of-removal";
        Restart();
      }
    }
  }

  void Refine(double size, bool restart) {
    std::shared_ptr<Operation> operation =
        StartRefinement(process_->environment(), session_, Parameters(size), restart, 0).value();
    if (Draw(4)) {
      what_ += " restart-within";
      const std::string name = operation->name();
      operation = nullptr;
      Restart();
      operation = session_->FindOperation(name).value();
    }
    EXPECT_EQ(End(*operation), v1::Operation::STATE_SUCCEEDED) << operation->Describe().error().message();
    has_structure_ = true;
  }

  void Add(const std::vector<double>& points) {
    const absl::Status added = process_->Work([&](Job& job) {
      const StructureUse use(session_);
      const absl::Status prepared = session_->PrepareStructure(0, process_->environment().create_mesher, job);
      return prepared.ok() ? session_->AddVertices(points, {}, 0, job.context()).status() : prepared;
    });
    EXPECT_TRUE(added.ok()) << added;
  }

  static uint32_t HashOf(const MeshSnapshot& mesh) {
    uint32_t crc32c = 0;
    for (uint64_t chunk = 0; chunk < mesh.ChunkCount(true).value(); ++chunk) {
      const std::string bytes = BytesOf(mesh.SerializeChunk(chunk, 2, true).value());
      crc32c = ExtendCrc32c(crc32c, bytes.data(), bytes.size());
    }
    return crc32c;
  }

  const Life& life_;
  test::SplitMix64* const random_;
  const TestFolder folder_;
  std::optional<Process> process_;
  std::shared_ptr<Session> session_;
  bool has_structure_ = false;  // that can be queried
  std::string what_;
};

class MetamorphicTest : public test::SeededTest {
 protected:
  MetamorphicTest() : SeededTest(20'261'128) {}
};

TEST_F(MetamorphicTest, TheSameStepsEndWithTheSameMesh) {
  std::set<uint32_t> hashes;
  for (int i = 0; i < kLives; ++i) {
    const Life life = DrawLife(random_, /*is_block=*/i % 3 == 2);
    const uint32_t undisturbed = Living(life, nullptr).Hash();
    hashes.insert(undisturbed);
    for (int variation = 0; variation < kVariations; ++variation) {
      Living living(life, &random_);
      const uint32_t hash = living.Hash();
      ASSERT_EQ(hash, undisturbed) << "life " << i << ", variation " << variation << ":" << living.what();
    }
  }
  EXPECT_EQ(hashes.size(), static_cast<size_t>(kLives)) << "other steps end with another mesh";
}

}  // namespace
}  // namespace wellspace::server
