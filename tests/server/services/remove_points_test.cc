// RemovePoints: points that are taken out of sessions.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/data_folder.h"
#include "server/store/durable_log.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

// A server that keeps sessions in a folder, or, with `false`, in memory.
class RemovePointsTest : public ::testing::TestWithParam<bool> {
 protected:
  RemovePointsTest() { Start(); }

  void Start() {
    std::unique_ptr<SessionLog> log;
    if (GetParam()) {
      log = OpenDurableLog({.folder = folder_.path()}).value();
    }
    service_.emplace(FakeMesher, options_, Transport::kInProcess, FakeEstimator, core::Mesher::Create,
                     SecurityOptions(), std::move(log));
    calls_.emplace(service_->channel());
  }

  void Restart() {
    calls_.reset();
    service_.reset();
    Start();
  }

  SessionCalls& calls() { return *calls_; }

  std::string SessionWith(const std::vector<double>& points) {
    std::string name = calls().Create(2).name();
    calls().Upload(name, 0, points);
    return name;
  }

  v1::RemovePointsResponse Remove(const std::string& name, const std::vector<uint64_t>& points,
                                  grpc::Status* status = nullptr, const std::string& request_id = "",
                                  uint64_t expected_revision = 0) {
    v1::RemovePointsRequest request;
    request.set_name(name);
    request.mutable_points()->Assign(points.begin(), points.end());
    request.set_request_id(request_id);
    if (expected_revision != 0) {
      request.set_expected_revision(expected_revision);
    }
    return calls().RemovePoints(request, status);
  }

  grpc::Status Add(const std::string& name, const std::vector<double>& points) {
    grpc::ClientContext context;
    v1::AddVerticesRequest request;
    request.set_name(name);
    request.mutable_points()->Assign(points.begin(), points.end());
    v1::AddVerticesResponse response;
    return calls().queries().AddVertices(&context, request, &response);
  }

  std::string MeshOf(const std::string& name) { return calls().MeshBytes(name); }

  TestFolder folder_;
  ServiceOptions options_{.workers = 2};
  std::optional<ServiceHarness> service_;
  std::optional<SessionCalls> calls_;
};

INSTANTIATE_TEST_SUITE_P(All, RemovePointsTest, ::testing::Bool(),
                         [](const auto& kind) { return kind.param ? "InAFolder" : "InMemory"; });

// `points` without those of the numbers i for which i % 7 is 3, and those numbers in no order.
std::vector<double> EverySeventhLess(const std::vector<double>& points, std::vector<uint64_t>* numbers) {
  std::vector<double> kept;
  for (size_t i = 0; i < points.size() / 2; ++i) {
    if (i % 7 == 3) {
      numbers->insert(numbers->begin() + static_cast<std::ptrdiff_t>(numbers->size() / 2), i);
    } else {
      kept.insert(kept.end(), {points[2 * i], points[2 * i + 1]});
    }
  }
  return kept;
}

TEST_P(RemovePointsTest, TheNextMeshIsThatOfTheOthersToTheBit) {
  const std::vector<double> points = UniformPoints(400, 2, 5);
  const std::string name = SessionWith({points.begin(), points.begin() + 700});
  calls().Refine(name);
  ASSERT_TRUE(Add(name, {points.begin() + 700, points.end()}).ok());
  calls().Refine(name);
  const std::string before = MeshOf(name);
  std::vector<uint64_t> numbers;
  const std::vector<double> kept = EverySeventhLess(points, &numbers);
  const v1::Session session = calls().Get(name);
  const v1::RemovePointsResponse left = Remove(name, numbers);
  EXPECT_EQ(left.committed_points(), kept.size() / 2);
  EXPECT_EQ(left.revision(), session.revision() + 1);
  EXPECT_EQ(calls().Get(name).state(), v1::Session::STATE_OPEN);
  EXPECT_EQ(calls().Get(name).committed_points(), kept.size() / 2);
  EXPECT_EQ(MeshOf(name), before) << "until the next refinement";
  calls().Refine(name);
  const std::string fresh = SessionWith(kept);
  calls().Refine(fresh);
  EXPECT_EQ(MeshOf(name), MeshOf(fresh));
  EXPECT_TRUE(Add(name, {0.25, 0.75}).ok()) << "there is a structure again";
  EXPECT_EQ(calls().Upload(name, 0, kept).committed_points(), kept.size() / 2 + 1) << "numbered anew";
}

TEST_P(RemovePointsTest, UntilTheNextRefinementThereIsTheLastMeshAndNoStructure) {
  const std::string name = SessionWith(UniformPoints(100, 2, 6));
  const uint64_t revision = calls().Refine(name).mesh_revision();
  Remove(name, {0, 99});
  const grpc::Status added = Add(name, {0.25, 0.75});
  EXPECT_EQ(DetailsOf(added).reason, "MESH_NOT_READY");
  EXPECT_THAT(added.error_message(), HasSubstr("before points were removed"));
  v1::LocateRequest locate;
  locate.set_name(name);
  locate.mutable_points()->Add(0.5);
  locate.mutable_points()->Add(0.5);
  grpc::ClientContext context;
  v1::LocateResponse located;
  EXPECT_TRUE(calls().queries().Locate(&context, locate, &located).ok());
  EXPECT_EQ(located.revision(), revision);
  EXPECT_EQ(calls().SetSizes({SizesRequest(name, {0.5, 0.5}, {0.05})}).size_count(), 1u);
  const uint64_t refined = calls().Refine(name).mesh_revision();
  EXPECT_GT(refined, revision);
}

TEST_P(RemovePointsTest, AllPointsMayGo) {
  const std::vector<double> points = UniformPoints(50, 2, 7);
  const std::string name = SessionWith(points);
  calls().Refine(name);
  std::vector<uint64_t> all(50);
  for (size_t i = 0; i < all.size(); ++i) {
    all[i] = i;
  }
  EXPECT_EQ(Remove(name, all).committed_points(), 0u);
  calls().Upload(name, 0, points);
  calls().Refine(name);
  const std::string fresh = SessionWith(points);
  calls().Refine(fresh);
  EXPECT_EQ(MeshOf(name), MeshOf(fresh));
}

TEST_P(RemovePointsTest, WhatCannotBeRemovedIsNamedAndNothingIsRemoved) {
  const std::string name = SessionWith(UniformPoints(10, 2, 8));
  const uint64_t revision = calls().Get(name).revision();
  const auto expect_refused = [&](const std::vector<uint64_t>& points, const std::string& what) {
    grpc::Status status;
    Remove(name, points, &status);
    const ErrorDetails details = DetailsOf(status);
    EXPECT_EQ(details.reason, "INVALID_POINTS");
    EXPECT_EQ(details.field, "points");
    EXPECT_THAT(status.error_message(), HasSubstr(what));
    EXPECT_EQ(calls().Get(name).revision(), revision);
  };
  expect_refused({3, 10}, "points has 10, and no point");
  expect_refused({UINT64_MAX}, "points has 18446744073709551615, and no point");
  expect_refused({4, 2, 4}, "points has 4 twice");
  EXPECT_EQ(Remove(name, {}).revision(), revision) << "nothing to do is no change";
  grpc::Status status;
  Remove(name, {1}, &status, "", revision + 1);
  EXPECT_EQ(DetailsOf(status).reason, "REVISION_MISMATCH");
  Remove("sessions/0", {1}, &status);
  EXPECT_EQ(DetailsOf(status).reason, "SESSION_NOT_FOUND");
}

TEST_P(RemovePointsTest, PointsThatBoundTheDomainStay) {
  v1::CreateSessionRequest create;
  create.mutable_parameters()->set_dimension(2);
  const std::string name = calls().Create(create).name();
  const std::vector<double> frame = FramePoints();
  const uint64_t count = frame.size() / 2;
  calls().Upload(name, 0, frame);
  calls().AddSegments({FrameRequest(name)});
  calls().Refine(name);
  const std::string before = MeshOf(name);
  ASSERT_TRUE(Add(name, {0.5, 0.5}).ok());
  grpc::Status status;
  Remove(name, {count - 1}, &status);
  EXPECT_EQ(DetailsOf(status).reason, "INVALID_POINTS");
  EXPECT_THAT(status.error_message(), HasSubstr("end at points up to"));
  EXPECT_EQ(Remove(name, {count}).committed_points(), count);
  calls().Refine(name);
  EXPECT_EQ(MeshOf(name), before);
}

TEST_P(RemovePointsTest, ARepeatedRequestRemovesOnce) {
  const std::string name = SessionWith(UniformPoints(10, 2, 9));
  const v1::RemovePointsResponse first = Remove(name, {0, 1}, nullptr, "once");
  EXPECT_EQ(Remove(name, {0, 1}, nullptr, "once").SerializeAsString(), first.SerializeAsString());
  if (GetParam()) {
    Restart();
    EXPECT_EQ(Remove(name, {0, 1}, nullptr, "once").SerializeAsString(), first.SerializeAsString());
  }
  EXPECT_EQ(calls().Get(name).committed_points(), 8u);
  grpc::Status status;
  Remove(name, {0}, &status, "once");
  EXPECT_EQ(DetailsOf(status).reason, "REQUEST_ID_REUSED");
}

TEST_P(RemovePointsTest, WhatIsRemovedIsNotCountedAnyMore) {
  options_.max_points = 10;
  Restart();
  const std::string name = SessionWith(UniformPoints(10, 2, 10));
  grpc::Status status;
  calls().Upload(name, 10, {0.5, 0.5}, &status);
  EXPECT_EQ(DetailsOf(status).reason, "TOO_MANY_POINTS");
  Remove(name, {4});
  EXPECT_EQ(calls().Upload(name, 9, {0.5, 0.5}).committed_points(), 10u);
}

TEST_P(RemovePointsTest, FilesThatAreNeededNoMoreGo) {
  if (!GetParam()) {
    return;  // there are none
  }
  const DataPaths paths{folder_.path()};
  const std::string name = SessionWith(UniformPoints(100, 2, 11));
  store::v1::PointsFile last;
  last.set_number(1);
  last.set_epoch(1);
  for (int i = 0; i < 3; ++i) {
    store::v1::PointsFile file;
    file.set_number(Remove(name, {0, 5}).revision());
    file.set_epoch(i + 1);  // each process has the next one
    EXPECT_FALSE(PosixFileSystem().Open(paths.points(name, last), FileSystem::Mode::kRead).ok());
    EXPECT_TRUE(PosixFileSystem().Open(paths.points(name, file), FileSystem::Mode::kRead).ok());
    last = file;
    Restart();
    EXPECT_EQ(calls().Get(name).committed_points(), 98u - 2 * i);
  }
  calls().Delete(name);
  Restart();
  EXPECT_FALSE(PosixFileSystem().Open(paths.points(name, last), FileSystem::Mode::kRead).ok());
}

}  // namespace
}  // namespace wellspace::server
