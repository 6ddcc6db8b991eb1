// The calls of SessionService over a channel.
#include <cmath>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

class SessionServiceTest : public ::testing::Test {
 protected:
  void ExpectError(grpc::StatusCode code, const std::string& reason, const std::string& field = "") {
    EXPECT_EQ(status_.error_code(), code) << status_.error_message();
    EXPECT_EQ(DetailsOf(status_).reason, reason) << status_.error_message();
    EXPECT_EQ(DetailsOf(status_).field, field) << status_.error_message();
  }

  ServiceHarness harness_{FakeMesher,
                          {.max_points = 1'000'000},
                          Transport::kInProcess,
                          FakeEstimator,
                          ScriptedMesher([](core::Phase, core::RunContext& context) { return context.Check(); })};
  SessionCalls calls_{harness_.channel()};
  grpc::Status status_;
};

v1::CreateSessionRequest CreateRequest() {
  v1::CreateSessionRequest request;
  *request.mutable_parameters() = UnitCubeParameters(2);
  return request;
}

TEST_F(SessionServiceTest, ANewSessionSaysWhatItIs) {
  v1::CreateSessionRequest request = CreateRequest();
  (*request.mutable_labels())["project"] = "wing";
  request.mutable_ttl()->set_seconds(60);
  const v1::Session session = calls_.Create(request);
  EXPECT_EQ(session.name().substr(0, 9), "sessions/");
  EXPECT_EQ(session.state(), v1::Session::STATE_OPEN);
  EXPECT_EQ(session.parameters().dimension(), 2);
  EXPECT_EQ(session.parameters().rho(), core::DefaultRho(2)) << "defaults are resolved";
  EXPECT_EQ(session.parameters().criterion(), v1::CRITERION_RADIUS_EDGE);
  EXPECT_GT(session.parameters().max_vertices(), 0u);
  EXPECT_EQ(session.labels().at("project"), "wing");
  EXPECT_EQ(session.ttl().seconds(), 60);
  EXPECT_NEAR(session.expire_time().seconds() - session.create_time().seconds(), 60, 5);
  EXPECT_EQ(session.revision(), 1u);
  EXPECT_EQ(session.committed_points(), 0u);
  EXPECT_EQ(session.last_operation(), "");
  EXPECT_EQ(calls_.Get(session.name()).name(), session.name());
}

TEST_F(SessionServiceTest, CreateRefusesWhatIsNotValid) {
  v1::CreateSessionRequest request;
  request.mutable_parameters()->set_dimension(7);
  calls_.Create(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_PARAMETERS", "parameters.dimension");

  request = CreateRequest();
  (*request.mutable_labels())[""] = "value";
  calls_.Create(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "labels");

  request = CreateRequest();
  (*request.mutable_labels())[std::string(64, 'k')] = "value";
  calls_.Create(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "labels");

  request = CreateRequest();
  (*request.mutable_labels())["key"] = std::string(256, 'v');
  calls_.Create(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "labels");

  request = CreateRequest();
  for (int i = 0; i < 65; ++i) {
    (*request.mutable_labels())[absl::StrCat(i)] = "value";
  }
  calls_.Create(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "labels");

  for (const auto& [seconds, nanos] : std::vector<std::pair<int64_t, int32_t>>{
           {0, 999'999'999}, {-5, 0}, {1, -1}, {1'000'000'000, 0}, {60, 1'000'000'000}}) {
    request = CreateRequest();
    request.mutable_ttl()->set_seconds(seconds);
    request.mutable_ttl()->set_nanos(nanos);
    calls_.Create(request, &status_);
    ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "ttl");
  }

  request = CreateRequest();
  for (int i = 0; i < 20'000; ++i) {
    v1::SizeBox* box = request.mutable_parameters()->add_size_boxes();
    box->mutable_low()->Resize(2, 0.25);
    box->mutable_high()->Resize(2, 0.75);
    box->set_max_circumradius(0.1);
  }
  calls_.Create(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_PARAMETERS", "parameters.size_boxes");
}

TEST_F(SessionServiceTest, LabelsMayHaveAsManyCharactersOfAnyLength) {
  v1::CreateSessionRequest request = CreateRequest();
  std::string key;
  for (int i = 0; i < 63; ++i) {
    key += "\xe2\x88\x87";  // nabla
  }
  (*request.mutable_labels())[key] = "";
  EXPECT_EQ(calls_.Create(request).labels_size(), 1);
}

TEST_F(SessionServiceTest, NamesThatNameNothing) {
  for (const char* name : {"", "sessions", "sessions/", "operations/1", "sessions/a/b", "/sessions/a"}) {
    calls_.Get(name, &status_);
    ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "name");
  }
  calls_.Get("sessions/00000000000000000000000000000000", &status_);
  ExpectError(grpc::StatusCode::NOT_FOUND, "SESSION_NOT_FOUND");
  calls_.Get("sessions/" + std::string(100'000, 'x'), &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "name");
}

TEST_F(SessionServiceTest, UpdateChangesWhatTheMaskNames) {
  v1::CreateSessionRequest create = CreateRequest();
  (*create.mutable_labels())["a"] = "1";
  const v1::Session session = calls_.Create(create);

  v1::UpdateSessionRequest request;
  request.mutable_session()->set_name(session.name());
  (*request.mutable_session()->mutable_labels())["b"] = "2";
  request.mutable_session()->mutable_ttl()->set_seconds(7);
  request.mutable_update_mask()->add_paths("ttl");
  v1::Session updated = calls_.Update(request);
  EXPECT_EQ(updated.ttl().seconds(), 7);
  EXPECT_TRUE(updated.labels().contains("a"));

  request.mutable_update_mask()->set_paths(0, "labels");
  request.mutable_session()->mutable_ttl()->set_seconds(8);
  updated = calls_.Update(request);
  EXPECT_EQ(updated.ttl().seconds(), 7);
  EXPECT_FALSE(updated.labels().contains("a"));
  EXPECT_TRUE(updated.labels().contains("b"));
  EXPECT_EQ(updated.revision(), session.revision()) << "neither points nor mesh have changed";

  request.mutable_update_mask()->set_paths(0, "revision");
  calls_.Update(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "update_mask");

  request.clear_update_mask();
  request.mutable_session()->clear_ttl();
  updated = calls_.Update(request);
  EXPECT_EQ(updated.ttl().seconds(), absl::ToInt64Seconds(ServiceOptions().default_ttl));
}

TEST_F(SessionServiceTest, ListsPageByPage) {
  std::vector<std::string> created;
  for (int i = 0; i < 7; ++i) {
    v1::CreateSessionRequest request = CreateRequest();
    (*request.mutable_labels())["parity"] = i % 2 == 0 ? "even" : "odd";
    created.push_back(calls_.Create(request).name());
  }
  std::vector<std::string> listed;
  v1::ListSessionsRequest request;
  request.set_page_size(3);
  std::string second_page;
  do {
    const v1::ListSessionsResponse page = calls_.List(request);
    EXPECT_LE(page.sessions_size(), 3);
    for (const v1::Session& session : page.sessions()) {
      listed.push_back(session.name());
    }
    request.set_page_token(page.next_page_token());
    second_page = second_page.empty() ? page.next_page_token() : second_page;
  } while (!request.page_token().empty());
  EXPECT_EQ(listed, created);

  request.clear_page_size();
  (*request.mutable_labels())["parity"] = "odd";
  EXPECT_EQ(calls_.List(request).sessions_size(), 3);
  request.set_page_token(second_page);
  calls_.List(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "page_token");
  request.set_page_token("0");
  calls_.List(request, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "page_token");
  request.clear_page_token();
  for (const int size : {0, -1}) {
    request.set_page_size(size);
    calls_.List(request, &status_);
    ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "page_size");
  }
}

TEST_F(SessionServiceTest, APageHasNoMoreThanAMessageMay) {
  constexpr int kSessions = 6;
  for (int i = 0; i < kSessions; ++i) {
    v1::CreateSessionRequest request = CreateRequest();
    for (int box = 0; box < 7000; ++box) {
      v1::SizeBox* size_box = request.mutable_parameters()->add_size_boxes();
      size_box->mutable_low()->Resize(2, 0.25);
      size_box->mutable_high()->Resize(2, 0.75);
      size_box->set_max_circumradius(0.1);
    }
    calls_.Create(request);
  }
  v1::ListSessionsRequest request;
  int listed = 0;
  do {
    const v1::ListSessionsResponse page = calls_.List(request);
    EXPECT_LE(page.ByteSizeLong(), size_t{kMaxResponseBytes});
    listed += page.sessions_size();
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  EXPECT_EQ(listed, kSessions);
}

TEST_F(SessionServiceTest, ADeletedSessionIsGone) {
  const v1::Session session = calls_.Create(2);
  calls_.Delete(session.name());
  calls_.Get(session.name(), &status_);
  ExpectError(grpc::StatusCode::NOT_FOUND, "SESSION_NOT_FOUND");
  calls_.Delete(session.name(), &status_);
  ExpectError(grpc::StatusCode::NOT_FOUND, "SESSION_NOT_FOUND");
  EXPECT_EQ(calls_.List({}).sessions_size(), 0);
}

TEST_F(SessionServiceTest, ARepeatedCallIsDoneOnce) {
  v1::CreateSessionRequest create = CreateRequest();
  create.set_request_id("create");
  const v1::Session session = calls_.Create(create);
  EXPECT_EQ(calls_.Create(create).name(), session.name());
  EXPECT_EQ(calls_.List({}).sessions_size(), 1);
  create.mutable_ttl()->set_seconds(5);
  calls_.Create(create, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "REQUEST_ID_REUSED", "request_id");

  v1::DeleteSessionRequest erase;
  erase.set_name(session.name());
  erase.set_request_id("delete");
  calls_.Delete(erase);
  calls_.Delete(erase);  // though it is gone
}

TEST_F(SessionServiceTest, ACallForAnotherRevisionChangesNothing) {
  const v1::Session session = calls_.Create(2);
  calls_.Upload(session.name(), 0, {0.25, 0.25, 0.75, 0.75});
  EXPECT_EQ(calls_.Get(session.name()).revision(), 2u);

  v1::UpdateSessionRequest update;
  update.mutable_session()->set_name(session.name());
  update.set_expected_revision(1);
  calls_.Update(update, &status_);
  ExpectError(grpc::StatusCode::ABORTED, "REVISION_MISMATCH");

  v1::UploadPointsRequest upload = UploadRequest(session.name(), 2, {0.5, 0.5});
  upload.set_expected_revision(1);
  calls_.Upload({upload}, &status_);
  ExpectError(grpc::StatusCode::ABORTED, "REVISION_MISMATCH");

  v1::DeleteSessionRequest erase;
  erase.set_name(session.name());
  erase.set_expected_revision(1);
  calls_.Delete(erase, &status_);
  ExpectError(grpc::StatusCode::ABORTED, "REVISION_MISMATCH");
  EXPECT_EQ(calls_.Get(session.name()).committed_points(), 2u);

  upload.set_expected_revision(2);
  EXPECT_EQ(calls_.Upload({upload, UploadRequest("", 3, {0.6, 0.5})}).revision(), 4u);
  erase.set_expected_revision(4);
  calls_.Delete(erase);
}

// No revision is 0: it would stand for any.
TEST_F(SessionServiceTest, ACallForRevisionZeroIsRefused) {
  const std::string name = calls_.Create(2).name();
  calls_.Upload(name, 0, {0.25, 0.25, 0.75, 0.75});
  calls_.Refine(name);
  const auto expect_refused = [this](const grpc::Status& status, const std::string& field) {
    status_ = status;
    ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", field);
    EXPECT_THAT(status.error_message(), ::testing::HasSubstr("is 0; revisions begin with 1")) << field;
  };
  const auto refused = [&](auto request, auto call, const std::string& field = "expected_revision") {
    grpc::Status status;
    call(request, &status);
    expect_refused(status, field);
  };
  const auto at_zero = [&name](auto request) {
    request.set_name(name);
    request.set_expected_revision(0);
    return request;
  };
  v1::UpdateSessionRequest update;
  update.mutable_session()->set_name(name);
  update.set_expected_revision(0);
  refused(update, [this](const auto& request, grpc::Status* status) { calls_.Update(request, status); });
  refused(at_zero(v1::DeleteSessionRequest()),
          [this](const auto& request, grpc::Status* status) { calls_.Delete(request, status); });
  refused(at_zero(v1::RemovePointsRequest()),
          [this](const auto& request, grpc::Status* status) { calls_.RemovePoints(request, status); });
  refused(at_zero(v1::StartRefinementRequest()),
          [this](const auto& request, grpc::Status* status) { calls_.Start(request, status); });
  refused(at_zero(v1::UploadPointsRequest()),
          [this](const auto& request, grpc::Status* status) { calls_.Upload({request}, status); });
  refused(at_zero(v1::AddSegmentsRequest()),
          [this](const auto& request, grpc::Status* status) { calls_.AddSegments({request}, status); });
  const auto set_sizes = [this](const auto& request, grpc::Status* status) { calls_.SetSizes({request}, status); };
  refused(at_zero(v1::SetSizesRequest()), set_sizes);
  v1::SetSizesRequest sizes;
  sizes.set_name(name);
  sizes.mutable_vertex_sizes()->set_mesh_revision(0);
  refused(sizes, set_sizes, "vertex_sizes.mesh_revision");
  const auto add = [this](const auto& request, grpc::Status* status) {
    grpc::ClientContext context;
    v1::AddVerticesResponse response;
    *status = calls_.queries().AddVertices(&context, request, &response);
  };
  refused(at_zero(v1::AddVerticesRequest()), add);
  v1::DownloadMeshRequest download;
  download.set_name(name);
  download.set_revision(0);
  expect_refused(calls_.DownloadMesh(download).status, "revision");
  download.clear_revision();
  download.set_since_revision(0);
  expect_refused(calls_.DownloadMesh(download).status, "since_revision");
  EXPECT_EQ(calls_.Get(name).committed_points(), 2u);
}

// "Sessions leaked by clients that died".
TEST_F(SessionServiceTest, AnUnusedSessionIsDeleted) {
  v1::CreateSessionRequest request = CreateRequest();
  request.mutable_ttl()->set_seconds(1);
  const v1::Session session = calls_.Create(request);
  EXPECT_TRUE(harness_.log().WaitFor(absl::StrCat("event=session_expired session=", session.name())));
  calls_.Get(session.name(), &status_);
  ExpectError(grpc::StatusCode::NOT_FOUND, "SESSION_NOT_FOUND");
}

TEST_F(SessionServiceTest, PointsComeInAnyPiecesAndAreNeverTakenTwice) {
  const v1::Session session = calls_.Create(2);
  const std::vector<double> points = UniformPoints(10, 2, 1);
  const auto piece = [&](size_t begin, size_t end) {
    return std::vector<double>(points.begin() + static_cast<std::ptrdiff_t>(2 * begin),
                               points.begin() + static_cast<std::ptrdiff_t>(2 * end));
  };
  v1::UploadPointsResponse response =
      calls_.Upload({UploadRequest(session.name(), 0, piece(0, 3)), UploadRequest("", 3, piece(3, 3)),
                     UploadRequest("", 3, piece(3, 4))});
  EXPECT_EQ(response.committed_points(), 4u);
  EXPECT_EQ(response.revision(), 3u);
  response = calls_.Upload(session.name(), 0, piece(0, 4));
  EXPECT_EQ(response.committed_points(), 4u) << "repeated";
  EXPECT_EQ(response.revision(), 3u);
  response = calls_.Upload(session.name(), 2, piece(2, 9));
  EXPECT_EQ(response.committed_points(), 9u) << "overlapping";
  calls_.Upload(session.name(), 10, piece(9, 10), &status_);
  ExpectError(grpc::StatusCode::OUT_OF_RANGE, "UPLOAD_GAP", "point_offset");
  calls_.Upload(session.name(), 9, piece(9, 10));
  EXPECT_EQ(calls_.Refine(session.name()).state(), v1::Operation::STATE_SUCCEEDED);
  EXPECT_EQ(calls_.Get(session.name()).committed_points(), 10u);
}

TEST_F(SessionServiceTest, WhatCameBeforeABadChunkIsCommitted) {
  const v1::Session session = calls_.Create(2);
  calls_.Upload({UploadRequest(session.name(), 0, {0.25, 0.25}), UploadRequest("", 1, {0.5, 0.5, 0.5})}, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_CHUNK_SHAPE", "points.coordinates");
  EXPECT_EQ(calls_.Get(session.name()).committed_points(), 1u);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1.5, -0.1}) {
    calls_.Upload({UploadRequest(session.name(), 1, {0.75, 0.25, 0.5, bad})}, &status_);
    ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_POINTS", "points.coordinates");
    EXPECT_NE(status_.error_message().find("points[2]: coordinate 1"), std::string::npos) << status_.error_message();
    EXPECT_EQ(calls_.Get(session.name()).committed_points(), 1u);
  }
}

TEST_F(SessionServiceTest, WhatWasReceivedIsCommittedThoughTheCallBreaksOff) {
  const v1::Session session = calls_.Create(2);
  {
    grpc::ClientContext context;
    v1::UploadPointsResponse response;
    const auto stream = calls_.sessions().UploadPoints(&context, &response);
    ASSERT_TRUE(stream->Write(UploadRequest(session.name(), 0, {0.25, 0.25})));
    while (calls_.Get(session.name()).committed_points() == 0) {
    }
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  EXPECT_EQ(calls_.Upload(session.name(), 1, {0.5, 0.5}).committed_points(), 2u);
}

// "Two clients upload 20 000 points each to one session at once: both are told OK, and it has some of either".
TEST_F(SessionServiceTest, TakesOneUploadAtATime) {
  const v1::Session session = calls_.Create(2);
  grpc::ClientContext context;
  v1::UploadPointsResponse response;
  const auto first = calls_.sessions().UploadPoints(&context, &response);
  ASSERT_TRUE(first->Write(UploadRequest(session.name(), 0, {0.25, 0.25})));
  while (calls_.Get(session.name()).committed_points() == 0) {
  }
  for (const uint64_t offset : {0, 1}) {
    calls_.Upload(session.name(), offset, {0.5, 0.5}, &status_);
    ExpectError(grpc::StatusCode::FAILED_PRECONDITION, "SESSION_BUSY");
  }
  EXPECT_EQ(calls_.Get(session.name()).committed_points(), 1u);
  ASSERT_TRUE(first->Write(UploadRequest("", 1, {0.75, 0.25})));
  first->WritesDone();
  EXPECT_TRUE(first->Finish().ok());
  EXPECT_EQ(response.committed_points(), 2u);
  EXPECT_EQ(calls_.Upload(session.name(), 2, {0.5, 0.5}).committed_points(), 3u) << "then it is free";
  calls_.Upload(session.name(), 9, {0.5, 0.5}, &status_);
  ExpectError(grpc::StatusCode::OUT_OF_RANGE, "UPLOAD_GAP", "point_offset");
  EXPECT_EQ(calls_.Upload(session.name(), 3, {0.5, 0.25}).committed_points(), 4u) << "after one that failed, too";
}

TEST_F(SessionServiceTest, AnUploadWaitsForOneThatEnds) {
  const v1::Session session = calls_.Create(2);
  grpc::ClientContext context;
  v1::UploadPointsResponse response;
  const auto first = calls_.sessions().UploadPoints(&context, &response);
  ASSERT_TRUE(first->Write(UploadRequest(session.name(), 0, {0.25, 0.25})));
  while (calls_.Get(session.name()).committed_points() == 0) {
  }
  std::thread second([&] { EXPECT_EQ(calls_.Upload(session.name(), 1, {0.5, 0.5}).committed_points(), 2u); });
  EXPECT_TRUE(harness_.log().WaitFor("waits for another upload"));
  context.TryCancel();
  EXPECT_FALSE(first->Finish().ok());
  second.join();
}

// "A resumed upload with another file is OK and ignored".
TEST_F(SessionServiceTest, AnUploadOfOtherPointsIsRefused) {
  const v1::Session session = calls_.Create(2);
  const std::vector<double> points = UniformPoints(10, 2, 1);
  calls_.Upload(session.name(), 0, points);
  const v1::Session before = calls_.Get(session.name());
  std::vector<double> other = points;
  other[2 * 7 + 1] = std::nextafter(other[2 * 7 + 1], 1.0);
  other.insert(other.end(), {0.5, 0.5});
  calls_.Upload(session.name(), 0, other, &status_);
  ExpectError(grpc::StatusCode::FAILED_PRECONDITION, "UPLOAD_MISMATCH", "points.coordinates");
  EXPECT_NE(status_.error_message().find("points[7]: coordinate 1"), std::string::npos) << status_.error_message();
  other.erase(other.begin(), other.begin() + 2 * 6);
  calls_.Upload(session.name(), 6, other, &status_);
  ExpectError(grpc::StatusCode::FAILED_PRECONDITION, "UPLOAD_MISMATCH", "points.coordinates");
  EXPECT_EQ(calls_.Get(session.name()).committed_points(), before.committed_points());
  EXPECT_EQ(calls_.Get(session.name()).revision(), before.revision());
  calls_.Upload(session.name(), 0, {-0.0, points[1]}, &status_);
  ExpectError(grpc::StatusCode::FAILED_PRECONDITION, "UPLOAD_MISMATCH", "points.coordinates");
  calls_.Upload(session.name(), 8, {other.end() - 6, other.end()});
  EXPECT_EQ(calls_.Get(session.name()).committed_points(), 11u) << "the same ones, and one more";
}

TEST_F(SessionServiceTest, AnUploadGoesOnAfterThePointsOfItsChecksumAlone) {
  const v1::Session session = calls_.Create(2);
  const std::vector<double> points = UniformPoints(100'000, 2, 1);  // more than a block
  for (const uint64_t begin : {0, 50'000}) {
    calls_.Upload(session.name(), begin, {points.begin() + 2 * begin, points.begin() + 2 * begin + 100'000});
  }
  const auto upload = [&](uint64_t from, uint64_t offset, uint32_t crc32c) {
    v1::UploadPointsRequest request = UploadRequest(session.name(), offset, {0.5, 0.5});
    request.set_checked_from(from);
    request.set_checked_crc32c(crc32c);
    return calls_.Upload({request}, &status_);
  };
  const auto checksum = [&](uint64_t from, uint64_t end) {
    return Crc32c(points.data() + 2 * from, (end - from) * 2 * sizeof(double));
  };
  upload(0, 100'000, checksum(0, 100'000) ^ 1);
  ExpectError(grpc::StatusCode::FAILED_PRECONDITION, "UPLOAD_MISMATCH", "checked_crc32c");
  upload(0, 100'000, checksum(0, 99'999));
  ExpectError(grpc::StatusCode::FAILED_PRECONDITION, "UPLOAD_MISMATCH", "checked_crc32c");
  upload(0, 100'001, checksum(0, 100'000));
  ExpectError(grpc::StatusCode::OUT_OF_RANGE, "UPLOAD_GAP", "point_offset");
  upload(100'001, 100'000, 0);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "checked_from");
  EXPECT_EQ(calls_.Get(session.name()).committed_points(), 100'000u);
  EXPECT_EQ(upload(12'345, 100'000, checksum(12'345, 100'000)).committed_points(), 100'001u);
  EXPECT_TRUE(status_.ok()) << status_.error_message();
  EXPECT_EQ(upload(100'000, 100'000, 0).committed_points(), 100'001u) << "no points have the checksum 0";
}

TEST_F(SessionServiceTest, AnUploadNeedsANameFirst) {
  calls_.Upload({}, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "EMPTY_REQUEST", "name");
  calls_.Upload({UploadRequest("", 0, {0.5, 0.5})}, &status_);
  ExpectError(grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "name");
}

TEST_F(SessionServiceTest, AnUploadIsLimited) {
  const v1::Session session = calls_.Create(2);
  for (uint64_t offset = 0; offset < 1'000'000; offset += 100'000) {
    calls_.Upload(session.name(), offset, std::vector<double>(200'000, 0.5));
  }
  calls_.Upload(session.name(), 1'000'000, {0.5, 0.5}, &status_);
  ExpectError(grpc::StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_POINTS");
}

TEST_F(SessionServiceTest, AStoppingServerTakesNoCalls) {
  Event started;
  ServiceHarness harness(EndlessMesher(started));
  SessionCalls calls(harness.channel());
  TestCall running(harness.stub());
  running.Send(UnitCubeParameters());
  running.HalfClose();
  ASSERT_TRUE(started.Wait());
  std::thread stop([&] { harness.server().Shutdown(absl::Seconds(2)); });
  do {
    calls.List({}, &status_);
  } while (status_.ok());
  EXPECT_EQ(status_.error_code(), grpc::StatusCode::UNAVAILABLE);
  running.Cancel();
  stop.join();
}

}  // namespace
}  // namespace wellspace::server
