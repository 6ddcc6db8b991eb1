// A server whose memory is enough for one big session at a time: idle ones give up their structure for others, if they
// are durable.
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gtest/gtest.h"
#include "prometheus/text_serializer.h"
#include "server/store/durable_log.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

constexpr absl::Duration kLong = absl::Minutes(1);
constexpr size_t kPoints = 112'000;  // one session of as many fits, and not two
constexpr size_t kFew = 100'000;     // of two such sessions one has its mesh while the other has its tree

// A server, and the calls of two users.
class MemoryPressureTest : public ::testing::Test {
 protected:
  // Without memory: as much as they want.
  void Start(bool is_durable, uint64_t max_memory_bytes = 0) {
    std::unique_ptr<SessionLog> log;
    if (is_durable) {
      folder_.emplace();
      log = OpenDurableLog({.folder = folder_->path()}).value();
    }
    service_.emplace(core::MeshPoints, ServiceOptions{.workers = 2, .max_memory_bytes = max_memory_bytes},
                     Transport::kInProcess, FakeEstimator, core::Mesher::Create, SecurityOptions(), std::move(log));
    calls_.emplace(service_->channel());
  }

  ~MemoryPressureTest() override { Stop(); }

  void Stop() {
    calls_.reset();
    service_.reset();
    folder_.reset();
  }

  SessionCalls& calls() { return *calls_; }

  std::string SessionWithPoints(uint64_t seed, size_t count = kPoints) {
    std::string name = calls().Create(2).name();
    calls().Upload(name, 0, UniformPoints(count, 2, seed));
    return name;
  }

  v1::Operation Refine(const std::string& name) {
    Watch watch(calls().operations(), calls().Start(name).name(), std::nullopt, kLong);
    EXPECT_TRUE(watch.Finish().ok());
    return watch.operation.value_or(v1::Operation());
  }

  void Add(const std::string& name, uint64_t seed) {
    const grpc::Status status = TryToAdd(name, seed);
    EXPECT_TRUE(status.ok()) << status.error_message();
  }

  grpc::Status TryToAdd(const std::string& name, uint64_t seed) {
    grpc::ClientContext context;
    v1::AddVerticesRequest request;
    request.set_name(name);
    const std::vector<double> points = UniformPoints(50, 2, seed);
    request.mutable_points()->Assign(points.begin(), points.end());
    v1::AddVerticesResponse response;
    return calls().queries().AddVertices(&context, request, &response);
  }

  std::string CellsOf(const std::string& name) {
    grpc::ClientContext context;
    v1::VoronoiCellsRequest request;
    request.set_name(name);
    for (uint32_t vertex = 0; vertex < 100; ++vertex) {
      request.add_vertices(vertex);
    }
    const auto stream = calls().queries().VoronoiCells(&context, request);
    std::string cells;
    v1::VoronoiCellsResponse response;
    while (stream->Read(&response)) {
      cells += response.SerializeAsString();
    }
    const grpc::Status status = stream->Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
    return cells;
  }

  std::string MeshOf(const std::string& name) { return calls().MeshBytes(name); }

  size_t GivenUp() { return service_->log().Count("event=structure_given_up"); }

  // The value of a metric without labels.
  uint64_t ValueOf(const std::string& metric) {
    std::string text = "\n";
    for (const auto& collectable : service_->server().observability().metrics().Collectables()) {
      text += prometheus::TextSerializer().Serialize(collectable->Collect());
    }
    const size_t found = text.find("\n" + metric + " ");
    EXPECT_NE(found, std::string::npos) << metric;
    return static_cast<uint64_t>(std::stod(text.substr(found + metric.size() + 2)));
  }

  uint64_t Free() { return ValueOf("wellspace_memory_limit_bytes") - ValueOf("wellspace_memory_reserved_bytes"); }

  // Calls that take the memory that is free, until less is left than a message needs.
  std::vector<std::unique_ptr<TestCall>> Fill() {
    std::vector<std::unique_ptr<TestCall>> calls;
    for (uint64_t free = Free(); free >= kMessageBytes;) {
      calls.push_back(std::make_unique<TestCall>(service_->stub()));
      while (Free() == free) {
        std::this_thread::yield();
      }
      free = Free();
    }
    return calls;
  }

  void WaitUntilNoneWorks() {
    while (ValueOf("wellspace_memory_reserved_bytes") != ValueOf("wellspace_memory_lasting_bytes")) {
      std::this_thread::yield();
    }
  }

  std::optional<TestFolder> folder_;
  std::optional<ServiceHarness> service_;
  std::optional<SessionCalls> calls_;
};

TEST_F(MemoryPressureTest, BothUsersGoOnAndTheirMeshesAreThoseOfAServerWithMemory) {
  const auto live = [this] {
    std::vector<std::string> seen;
    const std::string first = SessionWithPoints(1);
    const std::string second = SessionWithPoints(2);
    for (const std::string& name : {first, second, first, second}) {
      const v1::Operation refined = Refine(name);
      EXPECT_EQ(refined.state(), v1::Operation::STATE_SUCCEEDED) << refined.error().message();
      seen.push_back(MeshOf(name));
      Add(name, seen.size());
    }
    for (const std::string& name : {first, second}) {
      seen.push_back(CellsOf(name));
      seen.push_back(std::to_string(calls().Get(name).revision()));
    }
    return seen;
  };
  Start(true);
  const std::vector<std::string> with_memory = live();
  EXPECT_EQ(GivenUp(), 0u);
  Stop();
  Start(true, kMinMemoryBytes);
  const std::vector<std::string> under_pressure = live();
  EXPECT_EQ(GivenUp(), 5u) << "at each turn but the first";
  EXPECT_EQ(ValueOf("wellspace_structures_given_up_total"), 5u);
  ASSERT_EQ(under_pressure.size(), with_memory.size());
  for (size_t i = 0; i < with_memory.size(); ++i) {
    EXPECT_TRUE(under_pressure[i] == with_memory[i]) << i;
  }
}

TEST_F(MemoryPressureTest, SessionsThatEndWithTheProcessGiveNothingUp) {
  Start(false, kMinMemoryBytes);
  const std::string first = SessionWithPoints(1);
  const std::string second = SessionWithPoints(2);
  EXPECT_EQ(Refine(first).state(), v1::Operation::STATE_SUCCEEDED);
  const v1::Operation refused = Refine(second);
  EXPECT_EQ(refused.state(), v1::Operation::STATE_FAILED);
  EXPECT_EQ(refused.error().code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << refused.error().message();
  EXPECT_EQ(GivenUp(), 0u);
  EXPECT_FALSE(CellsOf(first).empty());
}

TEST_F(MemoryPressureTest, BothAtOnceWaitForEachOther) {
  Start(true, kMinMemoryBytes);
  const std::vector<std::string> names = {SessionWithPoints(1, kFew), SessionWithPoints(2, kFew)};
  std::vector<std::string> operations;
  for (const std::string& name : names) {
    operations.push_back(calls().Start(name).name());
  }
  for (const std::string& operation : operations) {
    Watch watch(calls().operations(), operation, std::nullopt, kLong);
    EXPECT_TRUE(watch.Finish().ok());
    EXPECT_EQ(watch.operation->state(), v1::Operation::STATE_SUCCEEDED) << watch.operation->error().message();
  }
  // None is given up where one was past its peak before the other came to its own.
  EXPECT_LE(GivenUp(), 1u) << "the second goes on when the first has ended";
}

TEST_F(MemoryPressureTest, UploadsSegmentsAndCloudsHaveWhatIdleSessionsGiveUp) {
  Start(true, kMinMemoryBytes);
  const std::string idle = SessionWithPoints(1);
  EXPECT_EQ(Refine(idle).state(), v1::Operation::STATE_SUCCEEDED);
  const std::string cells = CellsOf(idle);
  v1::CreateSessionRequest create;
  create.mutable_parameters()->set_dimension(2);
  const std::string domain = calls().Create(create).name();
  size_t given_up = 0;
  const auto expect_room_for = [&](const char* what, const std::function<void()>& call) {
    SCOPED_TRACE(what);
    WaitUntilNoneWorks();
    EXPECT_TRUE(CellsOf(idle) == cells) << "it comes back";
    WaitUntilNoneWorks();
    EXPECT_GT(ValueOf("wellspace_memory_yielding_bytes"), 0u);
    const std::vector<std::unique_ptr<TestCall>> fill = Fill();
    EXPECT_EQ(GivenUp(), given_up);
    call();
    EXPECT_EQ(GivenUp(), ++given_up);
    EXPECT_EQ(ValueOf("wellspace_memory_yielding_bytes"), 0u);
  };
  expect_room_for("points", [&] { calls().Upload(domain, 0, FramePoints()); });
  expect_room_for("segments", [&] { calls().AddSegments({FrameRequest(domain)}); });
  expect_room_for("a cloud", [&] {
    TestCall call(service_->stub());
    EXPECT_TRUE(call.Send(UnitCubeParameters(2)));
    EXPECT_TRUE(call.Send(UniformPoints(100, 2, 1)));
    call.HalfClose();
    const grpc::Status status = call.Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
  });
}

TEST_F(MemoryPressureTest, ManyUsersAtOnceEndWithTheMeshesOfAServerWithMemory) {
  constexpr int kUsers = 3;
  constexpr size_t kPointsOfEach = 70'000;
  const auto live = [&](bool at_once) {
    std::vector<std::string> meshes(kUsers);
    const auto use = [&](int user) {
      const std::string name = calls().Create(2).name();
      calls().Upload(name, 0, UniformPoints(kPointsOfEach, 2, user));
      for (int turn = 0; turn < 2; ++turn) {
        while (Refine(name).state() != v1::Operation::STATE_SUCCEEDED) {
        }
        while (!TryToAdd(name, 10 * user + turn).ok()) {
        }
      }
      meshes[user] = MeshOf(name);
    };
    std::vector<std::thread> users;
    for (int user = 0; user < kUsers; ++user) {
      users.emplace_back(use, user);
      if (!at_once) {
        users.back().join();
      }
    }
    for (std::thread& user : users) {
      if (user.joinable()) {
        user.join();
      }
    }
    return meshes;
  };
  Start(true);
  const std::vector<std::string> with_memory = live(false);
  Stop();
  Start(true, kMinMemoryBytes);
  const std::vector<std::string> under_pressure = live(true);
  EXPECT_GT(GivenUp(), 0u);
  for (int user = 0; user < kUsers; ++user) {
    EXPECT_TRUE(under_pressure[user] == with_memory[user]) << user;
  }
}

}  // namespace
}  // namespace wellspace::server
