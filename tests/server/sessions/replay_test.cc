// Failed changes leave nothing behind: a session is a function of its steps that succeeded.
#include <functional>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

// Calls of a mesher that change it, or its mesh.
enum class Call { kCreate, kAddPoints, kRefine, kExtract, kUpdate };

// The way in which a call is broken off.
enum class Way { kCancel, kFail, kThrow };

// Where it is: when a run in `phase` asks its lender for the `count`th time; phase kWaiting: before the
// call begins; phase kDone: when it has returned.
struct Break {
  Call call = Call::kRefine;
  core::Phase phase = core::Phase::kRefinement;
  int count = 1;
  Way way = Way::kCancel;
};

// The script of a server's meshers, and the place where they are broken off.
//
// Thread safety: thread-safe.
class Script {
 public:
  // The next call that comes there is broken off, and none after it; `then` is called before.
  void BreakOff(const Break& at, std::function<void()> then = nullptr) {
    std::lock_guard lock(mutex_);
    break_ = at;
    then_ = std::move(then);
    seen_ = 0;
  }
  bool IsBroken() const {
    std::lock_guard lock(mutex_);
    return !break_.has_value();
  }
  // Whether the run is to be broken off here.
  std::optional<Way> Look(Call call, core::Phase phase) {
    std::function<void()> then;
    {
      std::lock_guard lock(mutex_);
      if (!break_.has_value() || call != break_->call || phase != break_->phase || ++seen_ < break_->count) {
        return std::nullopt;
      }
      then = std::move(then_);
      then_ = nullptr;
    }
    if (then != nullptr) {
      then();
    }
    std::lock_guard lock(mutex_);
    return std::exchange(break_, std::nullopt)->way;
  }
  // Calls of Create.
  int created() const {
    std::lock_guard lock(mutex_);
    return created_;
  }
  void NoteCreated() {
    std::lock_guard lock(mutex_);
    ++created_;
  }

 private:
  mutable std::mutex mutex_;
  std::optional<Break> break_;
  std::function<void()> then_;
  int seen_ = 0;
  int created_ = 0;
};

// Lends all that is wanted, and breaks runs off where the script says so: the core asks in the middle of every phase.
class BreakingLender final : public core::MemoryLender {
 public:
  BreakingLender(Script& script, Call call, core::RunContext& context)
      : script_(script), call_(call), context_(context) {}

  absl::Status Reserve(uint64_t) override { return context_.Check(); }
  absl::Status Allow(uint64_t) override { return Meet(context_.Snapshot().phase); }
  absl::Status Meet(core::Phase phase) {
    const std::optional<Way> way = script_.Look(call_, phase);
    if (way == Way::kCancel) {
      context_.Cancel();
    } else if (way == Way::kFail) {
      return absl::ResourceExhaustedError("broken off");
    } else if (way == Way::kThrow) {
      throw std::bad_alloc();
    }
    return context_.Check();
  }

 private:
  Script& script_;
  const Call call_;
  core::RunContext& context_;
};

// Runs a call of the core with a context of its own.
template <typename Run>
auto Broken(Script& script, Call call, core::RunContext& context, const Run& run) -> decltype(run(context)) {
  core::RunContext inner;
  BreakingLender lender(script, call, inner);
  inner.SetMemoryLender(&lender);
  if (context.IsCancelled()) {
    inner.Cancel();
  }
  if (absl::Status status = lender.Meet(core::Phase::kWaiting); !status.ok()) {
    return status;
  }
  auto result = run(inner);
  if (absl::Status status = lender.Meet(core::Phase::kDone); !status.ok()) {
    return status;
  }
  return result;
}

class BreakableMesher final : public core::Mesher {
 public:
  BreakableMesher(std::unique_ptr<core::Mesher> mesher, Script& script) : mesher_(std::move(mesher)), script_(script) {}

  int dimension() const override { return mesher_->dimension(); }
  uint64_t vertex_count() const override { return mesher_->vertex_count(); }
  uint64_t memory_bytes() const override { return mesher_->memory_bytes(); }
  absl::Status Refine(const core::MeshParameters& parameters, core::RunContext& context) override {
    return Broken(script_, Call::kRefine, context,
                  [&](core::RunContext& inner) { return mesher_->Refine(parameters, inner); });
  }
  absl::StatusOr<std::vector<uint32_t>> AddPointsNear(std::span<const double> points, std::span<const uint32_t> near,
                                                      core::RunContext& context) override {
    return Broken(script_, Call::kAddPoints, context,
                  [&](core::RunContext& inner) { return mesher_->AddPointsNear(points, near, inner); });
  }
  absl::StatusOr<uint32_t> AddVertex(uint32_t near, std::span<const double> point) override {
    return mesher_->AddVertex(near, point);
  }
  absl::StatusOr<std::vector<double>> NearestNeighborDistances(std::span<const uint32_t> vertices) const override {
    return mesher_->NearestNeighborDistances(vertices);
  }
  absl::StatusOr<std::vector<core::Cell>> ClippedCells(std::span<const uint32_t> vertices, double beta) const override {
    return mesher_->ClippedCells(vertices, beta);
  }
  absl::StatusOr<core::Mesh> Extract(int threads, core::RunContext& context) override {
    return Broken(script_, Call::kExtract, context,
                  [&](core::RunContext& inner) { return mesher_->Extract(threads, inner); });
  }
  absl::Status Update(core::Mesh& mesh, int threads, core::RunContext& context,
                      std::optional<core::MovedRows>* simplices) override {
    return Broken(script_, Call::kUpdate, context,
                  [&](core::RunContext& inner) { return mesher_->Update(mesh, threads, inner, simplices); });
  }
  absl::StatusOr<core::MeshEstimate> Estimate(const core::MeshParameters& parameters,
                                              const core::RunContext& context) const override {
    return mesher_->Estimate(parameters, context);
  }

 private:
  const std::unique_ptr<core::Mesher> mesher_;
  Script& script_;
};

MesherFactory BreakableMeshers(Script& script) {
  return [&script](const core::MeshParameters& parameters, const core::Input& input,
                   core::RunContext& context) -> absl::StatusOr<std::unique_ptr<core::Mesher>> {
    script.NoteCreated();
    absl::StatusOr<std::unique_ptr<core::Mesher>> mesher =
        Broken(script, Call::kCreate, context,
               [&](core::RunContext& inner) { return core::Mesher::Create(parameters, input, inner); });
    if (!mesher.ok()) {
      return mesher.status();
    }
    return std::make_unique<BreakableMesher>(*std::move(mesher), script);
  };
}

// The arrays of a mesh as they came.
struct Arrays {
  std::vector<double> points;
  std::vector<uint32_t> simplices;
  std::vector<uint32_t> input_vertices;
  std::vector<uint32_t> facets;
  std::vector<int32_t> simplex_regions;

  bool operator==(const Arrays&) const = default;
};

class Replayed : public ::testing::Test {
 protected:
  static constexpr int kFirst = 400;
  static constexpr int kSecond = 150;
  static constexpr int kAdded = 30;
  static constexpr double kSize = 0.12;   // of the last refinement
  static constexpr double kFiner = 0.08;  // of the one that is broken off

  v1::MeshParameters Parameters() const {
    v1::MeshParameters parameters = UnitCubeParameters();
    if (!repairs_slivers_) {
      parameters.set_min_dihedral(0);
    }
    return parameters;
  }

  v1::Operation Refine(const std::string& name, std::optional<double> size = std::nullopt) {
    v1::StartRefinementRequest request;
    request.set_name(name);
    if (size.has_value()) {
      *request.mutable_parameters() = Parameters();
      request.mutable_parameters()->set_max_circumradius(*size);
    }
    Watch watch(calls_.operations(), calls_.Start(request).name());
    EXPECT_TRUE(watch.Finish().ok());
    return watch.operation.value_or(v1::Operation());
  }

  v1::AddVerticesResponse AddVertices(const std::string& name, const std::vector<double>& points,
                                      grpc::Status* status = nullptr) {
    v1::AddVerticesRequest request;
    request.set_name(name);
    request.mutable_points()->Add(points.begin(), points.end());
    grpc::ClientContext context;
    v1::AddVerticesResponse response;
    const grpc::Status ended = calls_.queries().AddVertices(&context, request, &response);
    if (status != nullptr) {
      *status = ended;
    } else {
      EXPECT_TRUE(ended.ok()) << ended.error_message();
    }
    return response;
  }

  // Of the first vertices, as bytes.
  std::string Cells(const std::string& name, grpc::Status* status = nullptr) {
    grpc::ClientContext context;
    v1::VoronoiCellsRequest request;
    request.set_name(name);
    for (uint32_t vertex = 0; vertex < 50; ++vertex) {
      request.add_vertices(vertex);
    }
    const auto stream = calls_.queries().VoronoiCells(&context, request);
    std::string cells;
    v1::VoronoiCellsResponse response;
    while (stream->Read(&response)) {
      cells += response.SerializeAsString();
    }
    const grpc::Status ended = stream->Finish();
    if (status != nullptr) {
      *status = ended;
    } else {
      EXPECT_TRUE(ended.ok()) << ended.error_message();
    }
    return cells;
  }

  Arrays MeshOf(const std::string& name) {
    Arrays arrays;
    const Download download = calls_.DownloadMesh(name, 0, 0, std::nullopt, /*with_boundary=*/true);
    EXPECT_TRUE(download.status.ok()) << download.status.error_message();
    for (const v1::MeshChunk& chunk : download.chunks) {
      arrays.points.insert(arrays.points.end(), chunk.points().begin(), chunk.points().end());
      arrays.simplices.insert(arrays.simplices.end(), chunk.simplices().begin(), chunk.simplices().end());
      arrays.input_vertices.insert(arrays.input_vertices.end(), chunk.input_vertices().begin(),
                                   chunk.input_vertices().end());
      arrays.facets.insert(arrays.facets.end(), chunk.facets().begin(), chunk.facets().end());
      arrays.simplex_regions.insert(arrays.simplex_regions.end(), chunk.simplex_regions().begin(),
                                    chunk.simplex_regions().end());
    }
    return arrays;
  }

  // A session with a mesh that was refined a second time.
  std::string Begin() {
    v1::CreateSessionRequest request;
    *request.mutable_parameters() = Parameters();
    const std::string name = calls_.Create(request).name();
    calls_.Upload(name, 0, UniformPoints(kFirst, 3, 1));
    EXPECT_EQ(Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
    calls_.Upload(name, kFirst, UniformPoints(kSecond, 3, 2));
    EXPECT_EQ(Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
    return name;
  }
  // The mesh after further changes.
  Arrays End(const std::string& name) {
    AddVertices(name, UniformPoints(kAdded, 3, 3));
    EXPECT_EQ(Refine(name, kSize).state(), v1::Operation::STATE_SUCCEEDED);
    return MeshOf(name);
  }

  // Breaks a refinement off at `at`, and expects the session to be as it was.
  void ExpectBrokenOff(const std::string& name, const Break& at) {
    v1::Session before = calls_.Get(name);
    script_.BreakOff(at);
    const v1::Operation operation = Refine(name, kFiner);
    ASSERT_TRUE(script_.IsBroken()) << "the refinement came there";
    EXPECT_EQ(operation.state(), at.way == Way::kCancel ? v1::Operation::STATE_CANCELLED : v1::Operation::STATE_FAILED);
    v1::Session after = calls_.Get(name);
    EXPECT_EQ(after.last_operation(), operation.name());
    for (v1::Session* session : {&before, &after}) {
      session->clear_expire_time();
      session->clear_last_operation();
    }
    EXPECT_EQ(after.DebugString(), before.DebugString());
  }

  bool repairs_slivers_ = true;
  Script script_;
  ServiceHarness harness_{
      core::MeshPoints, {.workers = 2}, Transport::kInProcess, FakeEstimator, BreakableMeshers(script_)};
  SessionCalls calls_{harness_.channel()};
};

constexpr Break kEverywhere[] = {
    {Call::kAddPoints, core::Phase::kWaiting, 1, Way::kCancel},
    {Call::kRefine, core::Phase::kWaiting, 1, Way::kCancel},
    {Call::kRefine, core::Phase::kRefinement, 1, Way::kCancel},
    {Call::kRefine, core::Phase::kRefinement, 5, Way::kCancel},
    {Call::kRefine, core::Phase::kRefinement, 5, Way::kFail},
    {Call::kRefine, core::Phase::kSlivers, 1, Way::kCancel},
    {Call::kRefine, core::Phase::kSlivers, 1, Way::kFail},
    {Call::kRefine, core::Phase::kDone, 1, Way::kCancel},
    {Call::kRefine, core::Phase::kDone, 1, Way::kThrow},
    {Call::kUpdate, core::Phase::kDone, 1, Way::kCancel},
};

TEST_F(Replayed, ARefinementThatIsBrokenOffAnywhereLeavesTheNextMeshAsItWouldHaveBeen) {
  const std::string undisturbed = Begin();
  const Arrays expected = End(undisturbed);
  for (const Break& at : kEverywhere) {
    SCOPED_TRACE(absl::StrCat("call ", static_cast<int>(at.call), " phase ", core::PhaseName(at.phase), " count ",
                              at.count, " way ", static_cast<int>(at.way)));
    const std::string name = Begin();
    ExpectBrokenOff(name, at);
    EXPECT_TRUE(End(name) == expected);
    calls_.Delete(name);
  }
}

// Where no slivers are repaired, the last mesh is brought up to date in part.
TEST_F(Replayed, SoWithoutRepairOfSlivers) {
  repairs_slivers_ = false;
  const Arrays expected = End(Begin());
  for (const Break& at : std::vector<Break>{{Call::kRefine, core::Phase::kRefinement, 3, Way::kCancel},
                                            {Call::kRefine, core::Phase::kDone, 1, Way::kFail},
                                            {Call::kUpdate, core::Phase::kSimplices, 1, Way::kCancel},
                                            {Call::kUpdate, core::Phase::kDone, 1, Way::kFail}}) {
    SCOPED_TRACE(absl::StrCat("call ", static_cast<int>(at.call), " phase ", core::PhaseName(at.phase)));
    const std::string name = Begin();
    ExpectBrokenOff(name, at);
    EXPECT_TRUE(End(name) == expected);
  }
}

TEST_F(Replayed, ManyThatAreBrokenOffLeaveNoMore) {
  const Arrays expected = End(Begin());
  const std::string name = Begin();
  for (const Break& at : kEverywhere) {
    ExpectBrokenOff(name, at);
  }
  EXPECT_TRUE(End(name) == expected);
}

TEST_F(Replayed, TheFirstOneLeavesNothingButThePoints) {
  const std::string undisturbed = calls_.Create().name();
  calls_.Upload(undisturbed, 0, UniformPoints(kFirst, 3, 1));
  Refine(undisturbed);
  const std::string name = calls_.Create().name();
  calls_.Upload(name, 0, UniformPoints(kFirst, 3, 1));
  for (const Break& at : std::vector<Break>{{Call::kCreate, core::Phase::kDone, 1, Way::kCancel},
                                            {Call::kRefine, core::Phase::kRefinement, 2, Way::kCancel},
                                            {Call::kExtract, core::Phase::kDone, 1, Way::kFail}}) {
    ExpectBrokenOff(name, at);
    grpc::Status status;
    Cells(name, &status);
    EXPECT_EQ(DetailsOf(status).reason, "MESH_NOT_READY") << status.error_message();
  }
  Refine(name);
  EXPECT_TRUE(MeshOf(name) == MeshOf(undisturbed));
}

TEST_F(Replayed, QueriesAndAdditionsHaveTheStructureBuiltAgain) {
  const std::string name = Begin();
  const std::string cells = Cells(name);
  const int created = script_.created();
  ExpectBrokenOff(name, {.count = 3});
  EXPECT_EQ(Cells(name), cells);
  EXPECT_EQ(script_.created(), created + 1) << "by replay";
  EXPECT_EQ(Cells(name), cells);
  EXPECT_EQ(script_.created(), created + 1) << "once";
  AddVertices(name, UniformPoints(kAdded, 3, 3));
  const std::string with_vertices = Cells(name);
  ExpectBrokenOff(name, {.count = 3});
  EXPECT_EQ(Cells(name), with_vertices);
  EXPECT_EQ(script_.created(), created + 2);

  const std::string undisturbed = Begin();
  EXPECT_EQ(AddVertices(undisturbed, UniformPoints(kAdded, 3, 3)).vertices_size(), kAdded);
  ExpectBrokenOff(name, {.count = 1});
  EXPECT_EQ(AddVertices(name, {0.5, 0.25, 0.125}).vertices(0),
            AddVertices(undisturbed, {0.5, 0.25, 0.125}).vertices(0));
}

// The replay that a query needs is broken off with it, and can be asked for again.
TEST_F(Replayed, AReplayThatIsBrokenOffLeavesNothingEither) {
  const Arrays expected = End(Begin());
  const std::string name = Begin();
  const std::string cells = Cells(name);
  ExpectBrokenOff(name, {.count = 3});
  script_.BreakOff({.call = Call::kExtract, .phase = core::Phase::kDone, .way = Way::kFail});
  grpc::Status status;
  Cells(name, &status);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
  EXPECT_EQ(calls_.Get(name).state(), v1::Session::STATE_READY);
  EXPECT_EQ(Cells(name), cells);
  EXPECT_TRUE(End(name) == expected);
}

// One query has the structure built, others wait for it without a worker, and changes of the session are refused.
TEST_F(Replayed, OthersWaitForAReplay) {
  const std::string name = Begin();
  const std::string cells = Cells(name);
  ExpectBrokenOff(name, {.count = 3});
  Event replays;
  Event go_on;
  script_.BreakOff({.call = Call::kExtract, .phase = core::Phase::kDone, .way = Way::kFail}, [&] {
    replays.Set();
    go_on.Wait();
  });
  grpc::Status status;
  std::thread first([&] { Cells(name, &status); });
  ASSERT_TRUE(replays.Wait());
  grpc::Status upload;
  calls_.Upload(name, kFirst + kSecond, {0.5, 0.5, 0.5}, &upload);
  EXPECT_EQ(DetailsOf(upload).reason, "SESSION_BUSY");
  calls_.Start(name, &upload);
  EXPECT_EQ(DetailsOf(upload).reason, "SESSION_BUSY");
  std::string second;
  std::thread other([&] { second = Cells(name); });
  EXPECT_TRUE(harness_.log().WaitFor("waits for the structure"));
  go_on.Set();
  first.join();
  other.join();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << "it was broken off";
  EXPECT_EQ(second, cells) << "the other has it built then";
}

TEST_F(Replayed, AnAdditionThatFailsLeavesWhatWaitsWaiting) {
  const auto upload_first = [this] {
    const std::string name = Begin();
    calls_.Upload(name, kFirst + kSecond, UniformPoints(50, 3, 7));
    return name;
  };
  const auto upload_rest = [this](const std::string& name) {
    calls_.Upload(name, kFirst + kSecond + 50, UniformPoints(50, 3, 8));
    EXPECT_EQ(Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
    return MeshOf(name);
  };
  const Arrays expected = upload_rest(upload_first());
  const std::vector<double> known = UniformPoints(1, 3, 1);
  const std::vector<std::vector<double>> bad = {{0.5, 1.5, 0.5},                          // outside
                                                {known[0], known[1], known[2] + 1e-15},   // too close
                                                {0.3, 0.3, 0.3, 0.3, 0.3, 0.3 + 1e-15}};  // to each other
  for (const std::vector<double>& points : bad) {
    const std::string name = upload_first();
    grpc::Status status;
    AddVertices(name, points, &status);
    EXPECT_EQ(DetailsOf(status).reason, "INVALID_POINTS") << status.error_message();
    EXPECT_TRUE(upload_rest(name) == expected);
  }
  const std::string name = upload_first();
  script_.BreakOff({.call = Call::kAddPoints, .phase = core::Phase::kWaiting, .count = 2});
  grpc::Status status;
  AddVertices(name, {0.5, 0.5, 0.5}, &status);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::CANCELLED) << status.error_message();
  EXPECT_TRUE(upload_rest(name) == expected);
}

// A mesher of a domain comes back with the segments, seeds and rules of the session.
TEST_F(Replayed, SoWithSegments) {
  const auto begin = [this] {
    v1::CreateSessionRequest request;
    request.mutable_parameters()->set_dimension(2);
    const std::string name = calls_.Create(request).name();
    calls_.Upload(name, 0, FramePoints());
    calls_.AddSegments({FrameRequest(name)});
    EXPECT_EQ(Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
    return name;
  };
  const auto refine = [this](const std::string& name, double size) {
    v1::StartRefinementRequest request;
    request.set_name(name);
    request.mutable_parameters()->set_dimension(2);
    request.mutable_parameters()->set_max_circumradius(size);
    Watch watch(calls_.operations(), calls_.Start(request).name());
    EXPECT_TRUE(watch.Finish().ok());
    return watch.operation.value_or(v1::Operation()).state();
  };
  const std::string undisturbed = begin();
  EXPECT_EQ(refine(undisturbed, 0.2), v1::Operation::STATE_SUCCEEDED);
  const Arrays expected = MeshOf(undisturbed);
  EXPECT_FALSE(expected.facets.empty());
  EXPECT_FALSE(expected.simplex_regions.empty());
  for (const Break& at : std::vector<Break>{{Call::kRefine, core::Phase::kRefinement, 1, Way::kCancel},
                                            {Call::kRefine, core::Phase::kDone, 1, Way::kFail},
                                            {Call::kUpdate, core::Phase::kDone, 1, Way::kCancel}}) {
    SCOPED_TRACE(absl::StrCat("call ", static_cast<int>(at.call), " phase ", core::PhaseName(at.phase)));
    const std::string name = begin();
    const int created = script_.created();
    script_.BreakOff(at);
    EXPECT_NE(refine(name, 0.1), v1::Operation::STATE_SUCCEEDED);
    EXPECT_TRUE(script_.IsBroken());
    EXPECT_EQ(refine(name, 0.2), v1::Operation::STATE_SUCCEEDED);
    EXPECT_EQ(script_.created(), created + 1) << "by replay";
    EXPECT_TRUE(MeshOf(name) == expected);
  }
}

// Points that the mesher refuses cost no replay: it takes all or none.
TEST_F(Replayed, PointsThatAreRefusedCostNoReplay) {
  const std::string name = Begin();
  const int created = script_.created();
  std::vector<double> near = UniformPoints(1, 3, 1);
  near[2] += 1e-15;
  calls_.Upload(name, kFirst + kSecond, near);
  EXPECT_EQ(Refine(name).state(), v1::Operation::STATE_FAILED);
  EXPECT_FALSE(Cells(name).empty());
  EXPECT_EQ(script_.created(), created);
}

TEST_F(Replayed, ParametersThatDidNotSucceedAreNotThoseOfTheSession) {
  const std::string name = Begin();
  const double before = calls_.Get(name).parameters().max_circumradius();
  ExpectBrokenOff(name, {.count = 1});
  EXPECT_EQ(calls_.Get(name).parameters().max_circumradius(), before);
  const v1::Operation again = Refine(name);
  EXPECT_EQ(again.state(), v1::Operation::STATE_SUCCEEDED);
  EXPECT_EQ(again.parameters().max_circumradius(), before) << "without parameters: the session's";
}

}  // namespace
}  // namespace wellspace::server
