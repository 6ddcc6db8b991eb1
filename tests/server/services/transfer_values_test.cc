// Fields that are carried from an earlier mesh of a session to its last one, and the earlier mesh that is kept for it.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
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
using Start = v1::TransferValuesRequest::Start;

// A mesh as a client has it.
struct ClientMesh {
  uint64_t revision = 0;
  std::vector<double> points;
  std::vector<uint32_t> simplices;
};

// The answer to one call.
struct Answer {
  grpc::Status status;
  std::vector<v1::TransferValuesResponse::Start> starts;
  std::vector<double> values;
};

class TransferValuesTest : public ::testing::TestWithParam<bool> {  // whether the server has a folder
 protected:
  TransferValuesTest() { StartServer({}); }

  void StartServer(const ServiceOptions& options) {
    calls_.reset();
    harness_.reset();
    std::unique_ptr<SessionLog> log;
    if (GetParam()) {
      log = OpenDurableLog({.folder = folder_.path()}).value();
    }
    harness_.emplace(core::MeshPoints, options, Transport::kInProcess, core::EstimateMesh, core::Mesher::Create,
                     SecurityOptions(), std::move(log));
    calls_.emplace(harness_->channel());
  }

  std::string CreateRefined(int dimension = 2, size_t count = 300) {
    std::string name = calls_->Create(dimension).name();
    calls_->Upload(name, 0, UniformPoints(count, dimension, 3));
    calls_->Refine(name);
    points_ = count;
    return name;
  }

  // More points, and the mesh of them.
  void RefineFurther(const std::string& name, int dimension = 2) {
    calls_->Upload(name, points_, UniformPoints(60, dimension, 40 + points_));
    points_ += 60;
    calls_->Refine(name);
  }

  ClientMesh Download(const std::string& name) {
    const class Download all = calls_->DownloadMesh(name);
    ClientMesh mesh;
    mesh.revision = all.metadata.at(0).revision();
    for (const v1::MeshChunk& chunk : all.chunks) {
      mesh.points.insert(mesh.points.end(), chunk.points().begin(), chunk.points().end());
      mesh.simplices.insert(mesh.simplices.end(), chunk.simplices().begin(), chunk.simplices().end());
    }
    return mesh;
  }

  static Start From(const std::string& name, uint64_t revision, v1::FieldPlace place = v1::FIELD_PLACE_VERTICES,
                    uint32_t components = 1) {
    Start start;
    start.set_name(name);
    start.set_from_revision(revision);
    start.set_place(place);
    start.set_components(components);
    return start;
  }

  Answer Transfer(const std::optional<Start>& start, const std::vector<double>& values, size_t part = 1000) {
    std::vector<v1::TransferValuesRequest> requests;
    if (start.has_value()) {
      *requests.emplace_back().mutable_start() = *start;
    }
    for (size_t begin = 0; begin < values.size(); begin += part) {
      const size_t end = std::min(values.size(), begin + part);
      requests.emplace_back().mutable_values()->mutable_values()->Assign(values.begin() + begin, values.begin() + end);
    }
    return Send(requests);
  }

  Answer Send(const std::vector<v1::TransferValuesRequest>& requests) {
    grpc::ClientContext context;
    const auto stream = calls_->queries().TransferValues(&context);
    std::jthread sender([&] {
      for (const v1::TransferValuesRequest& request : requests) {
        if (!stream->Write(request)) {
          return;
        }
      }
      stream->WritesDone();
    });
    Answer answer;
    v1::TransferValuesResponse response;
    while (stream->Read(&response)) {
      EXPECT_LE(response.ByteSizeLong(), size_t{1} << 20);
      if (response.has_start()) {
        EXPECT_TRUE(answer.values.empty());
        answer.starts.push_back(response.start());
      }
      answer.values.insert(answer.values.end(), response.values().values().begin(), response.values().values().end());
    }
    sender.join();
    answer.status = stream->Finish();
    return answer;
  }

  void ExpectRefused(const Answer& answer, grpc::StatusCode code, const std::string& reason,
                     const std::string& message) {
    EXPECT_EQ(answer.status.error_code(), code) << answer.status.error_message();
    EXPECT_EQ(DetailsOf(answer.status).reason, reason) << answer.status.error_message();
    EXPECT_THAT(answer.status.error_message(), HasSubstr(message));
    EXPECT_TRUE(answer.starts.empty());
  }

  // `revision` 0: of the last mesh.
  grpc::Status Locate(const std::string& name, uint64_t revision, uint64_t* found = nullptr) {
    v1::LocateRequest request;
    request.set_name(name);
    request.add_points(0.5);
    request.add_points(0.5);
    if (revision != 0) {
      request.set_revision(revision);
    }
    v1::LocateResponse response;
    grpc::ClientContext context;
    const grpc::Status status = calls_->queries().Locate(&context, request, &response);
    EXPECT_TRUE(!status.ok() || revision == 0 || response.revision() == revision);
    if (found != nullptr) {
      *found = response.revision();
    }
    return status;
  }

  TestFolder folder_;
  std::optional<ServiceHarness> harness_;
  std::optional<SessionCalls> calls_;
  size_t points_ = 0;
};

INSTANTIATE_TEST_SUITE_P(All, TransferValuesTest, ::testing::Bool(),
                         [](const auto& made) { return made.param ? "InAFolder" : "InMemory"; });

TEST_P(TransferValuesTest, LinearFunctionsComeBackOnTheNewMesh) {
  const std::string name = CreateRefined();
  const ClientMesh before = Download(name);
  RefineFurther(name);
  const Answer answer = Transfer(From(name, before.revision, v1::FIELD_PLACE_VERTICES, 2), before.points, 77);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  const ClientMesh after = Download(name);
  ASSERT_GT(after.points.size(), before.points.size());
  ASSERT_EQ(answer.starts.size(), 1u);
  EXPECT_EQ(answer.starts[0].revision(), after.revision);
  EXPECT_EQ(answer.starts[0].row_count(), after.points.size() / 2);
  EXPECT_EQ(answer.starts[0].outside_count(), 0u);
  ASSERT_EQ(answer.values.size(), after.points.size());
  for (size_t i = 0; i < after.points.size(); ++i) {
    EXPECT_NEAR(answer.values[i], after.points[i], 1e-14);
  }
}

TEST_P(TransferValuesTest, MeansKeepTheIntegral) {
  const std::string name = CreateRefined();
  const ClientMesh before = Download(name);
  RefineFurther(name);
  std::vector<double> values(before.simplices.size() / 3);
  for (size_t i = 0; i < values.size(); ++i) {
    values[i] = std::sin(static_cast<double>(i));
  }
  Start start = From(name, before.revision, v1::FIELD_PLACE_SIMPLICES);
  EXPECT_TRUE(Transfer(start, values).status.ok());
  start.set_conservative(true);
  const Answer answer = Transfer(start, values);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  const ClientMesh after = Download(name);
  const auto mass = [](const ClientMesh& mesh, const std::vector<double>& field, bool of_sizes) {
    double sum = 0;
    for (size_t t = 0; t < field.size(); ++t) {
      const double* a = &mesh.points[2 * mesh.simplices[3 * t]];
      const double* b = &mesh.points[2 * mesh.simplices[3 * t + 1]];
      const double* c = &mesh.points[2 * mesh.simplices[3 * t + 2]];
      const double area = ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
      sum += area * (of_sizes ? std::abs(field[t]) : field[t]);
    }
    return sum;
  };
  ASSERT_EQ(answer.values.size(), after.simplices.size() / 3);
  EXPECT_NEAR(mass(after, answer.values, false), mass(before, values, false), 1e-12 * mass(before, values, true));
}

TEST_P(TransferValuesTest, TheEarlierMeshThatAClientHasIsKept) {
  const std::string name = CreateRefined();
  const ClientMesh first = Download(name);
  RefineFurther(name);  // a mesh that no client has
  RefineFurther(name);
  EXPECT_TRUE(Locate(name, first.revision).ok());
  EXPECT_TRUE(Transfer(From(name, first.revision, v1::FIELD_PLACE_VERTICES, 2), first.points).status.ok());
  const ClientMesh second = Download(name);
  EXPECT_TRUE(Transfer(From(name, second.revision, v1::FIELD_PLACE_VERTICES, 2), second.points).values == second.points)
      << "from the last mesh to itself";
  RefineFurther(name);
  ExpectRefused(Transfer(From(name, first.revision), {}), grpc::StatusCode::FAILED_PRECONDITION, "MESH_NOT_KEPT",
                absl::StrCat("the mesh of revision ", first.revision, " is not kept"));
  EXPECT_THAT(Transfer(From(name, first.revision), {}).status.error_message(),
              HasSubstr(absl::StrCat("and that of ", second.revision)));
  EXPECT_EQ(DetailsOf(Locate(name, first.revision)).reason, "REVISION_MISMATCH");
  EXPECT_TRUE(Locate(name, second.revision).ok());
}

TEST_P(TransferValuesTest, AMeshThatPointsWereLocatedInIsKept) {
  const std::string name = CreateRefined();
  uint64_t first = 0;
  uint64_t second = 0;
  ASSERT_TRUE(Locate(name, 0, &first).ok());
  RefineFurther(name);
  EXPECT_TRUE(Locate(name, first).ok());
  EXPECT_TRUE(Locate(name, 0, &second).ok());
  EXPECT_GT(second, first);
}

TEST_P(TransferValuesTest, AMeshOfWhichPartsWereDownloadedIsKept) {
  const std::string name = CreateRefined();
  v1::DownloadMeshRequest request;
  request.set_name(name);
  request.mutable_partition()->set_parts(2);
  const class Download part = calls_->DownloadMesh(request);
  ASSERT_TRUE(part.status.ok()) << part.status.error_message();
  RefineFurther(name);
  EXPECT_TRUE(Locate(name, part.metadata.at(0).revision()).ok());
}

TEST_P(TransferValuesTest, ErrorsNameTheirCause) {
  const std::string name = CreateRefined();
  const ClientMesh mesh = Download(name);
  const auto invalid = [&](const Answer& answer, const std::string& message) {
    ExpectRefused(answer, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", message);
  };
  const size_t vertices = mesh.points.size() / 2;
  std::vector<double> values(vertices, 1);
  invalid(Transfer(std::nullopt, values), "the first message has no start");
  ExpectRefused(Send({}), grpc::StatusCode::INVALID_ARGUMENT, "EMPTY_REQUEST", "the stream ended before any request");
  invalid(Transfer(From(name, 0), values), "start.from_revision is 0; revisions begin with 1");
  invalid(Transfer(From(name, mesh.revision, v1::FIELD_PLACE_UNSPECIFIED), values), "start.place is 0");
  invalid(Transfer(From(name, mesh.revision, static_cast<v1::FieldPlace>(7)), values), "start.place is 7");
  for (const uint32_t components : {0u, 65u, 0xffff'ffffu}) {
    invalid(Transfer(From(name, mesh.revision, v1::FIELD_PLACE_VERTICES, components), values),
            absl::StrCat("start.components is ", components, "; expected 1 to 64"));
  }
  Start start = From(name, mesh.revision);
  start.set_conservative(true);
  invalid(Transfer(start, values), "start.conservative is for values of simplices");
  start = From(name, mesh.revision);
  start.set_revision(0);
  invalid(Transfer(start, values), "start.revision is 0");
  start.set_revision(mesh.revision + 1);
  ExpectRefused(Transfer(start, values), grpc::StatusCode::ABORTED, "REVISION_MISMATCH",
                absl::StrCat("start.revision is ", mesh.revision + 1));
  ExpectRefused(Transfer(From(name, mesh.revision + 1), values), grpc::StatusCode::FAILED_PRECONDITION, "MESH_NOT_KEPT",
                absl::StrCat("has that of revision ", mesh.revision, " alone"));
  ExpectRefused(Transfer(From("sessions/none", 1), values), grpc::StatusCode::NOT_FOUND, "SESSION_NOT_FOUND", "");
  ExpectRefused(Transfer(From(calls_->Create(2).name(), 1), values), grpc::StatusCode::FAILED_PRECONDITION,
                "MESH_NOT_READY", "no mesh yet");
  values.push_back(1);
  invalid(Transfer(From(name, mesh.revision), values), absl::StrCat("there are more than ", vertices, " values"));
  values.resize(vertices - 1);
  invalid(Transfer(From(name, mesh.revision), values),
          absl::StrCat("there are ", vertices - 1, " values; expected ", vertices));
  values.resize(vertices, 1);
  for (const double wrong : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    values[17] = wrong;
    invalid(Transfer(From(name, mesh.revision), values), "values[17]: component 0 is");
  }
  v1::TransferValuesRequest twice;
  *twice.mutable_start() = From(name, mesh.revision);
  invalid(Send({twice, twice}), "there is a start in a message that is not the first");
}

TEST_P(TransferValuesTest, MeansAreOfThePlaneAndOfSpace) {
  const std::string name = CreateRefined(4, 10);
  const ClientMesh mesh = Download(name);
  Start start = From(name, mesh.revision, v1::FIELD_PLACE_SIMPLICES);
  const std::vector<double> values(mesh.simplices.size() / 5, 2);
  EXPECT_EQ(Transfer(start, values).values, values);
  start.set_conservative(true);
  ExpectRefused(Transfer(start, values), grpc::StatusCode::INVALID_ARGUMENT, "INVALID_REQUEST", "in 4-D");
}

TEST_P(TransferValuesTest, ValuesOfEveryExponentComeBack) {
  const std::string name = CreateRefined(2, 50);
  const ClientMesh before = Download(name);
  RefineFurther(name);
  const size_t vertices = before.points.size() / 2;
  std::vector<double> values(64 * vertices);
  for (size_t i = 0; i < values.size(); ++i) {
    values[i] = std::ldexp(i % 2 == 0 ? 1.5 : -1.5, static_cast<int>(i * 37 % 2098) - 1074);
  }
  const Answer answer = Transfer(From(name, before.revision, v1::FIELD_PLACE_VERTICES, 64), values);
  ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
  EXPECT_TRUE(std::ranges::all_of(answer.values, [](double x) { return std::isfinite(x); }));
  EXPECT_TRUE(std::equal(values.begin(), values.end(), answer.values.begin())) << "vertices of both meshes";
}

TEST_P(TransferValuesTest, WithoutMemoryForItTheEarlierMeshIsGivenUp) {
  if (GetParam()) {
    return;  // a file takes none
  }
  StartServer({.max_memory_bytes = kProcessMemoryBytes + (uint64_t{600} << 20), .max_sessions_per_tenant = 500});
  // Its mesh has more bytes than a message may have, which is what others want at once.
  const std::string name = CreateRefined(2, 200'000);
  const ClientMesh first = Download(name);
  RefineFurther(name);
  const Start start = From(name, first.revision, v1::FIELD_PLACE_VERTICES, 2);
  ASSERT_TRUE(Transfer(start, first.points, 100'000).status.ok());
  // Points of other sessions take what there is, until nothing is left.
  const std::vector<double> points = UniformPoints(200'000, 2, 9);
  grpc::Status status;
  std::vector<std::string> others;
  while (status.ok() && others.size() < 400) {
    others.push_back(calls_->Create(2).name());
    calls_->Upload(others.back(), 0, points, &status);
  }
  EXPECT_EQ(DetailsOf(status).reason, "MEMORY_LIMIT") << others.size();
  for (size_t i = 0; i < 10 && i < others.size(); ++i) {
    calls_->Delete(others[i]);  // a call needs some
  }
  ExpectRefused(Transfer(start, {}), grpc::StatusCode::FAILED_PRECONDITION, "MESH_NOT_KEPT", "alone");
}

TEST_P(TransferValuesTest, ClientsThatGoEndTheCall) {
  const std::string name = CreateRefined(3, 3000);
  const ClientMesh mesh = Download(name);
  for (const bool half_closes : {false, true}) {
    grpc::ClientContext context;
    const auto stream = calls_->queries().TransferValues(&context);
    v1::TransferValuesRequest request;
    *request.mutable_start() = From(name, mesh.revision, v1::FIELD_PLACE_VERTICES, 3);
    ASSERT_TRUE(stream->Write(request));
    request.mutable_values()->mutable_values()->Assign(mesh.points.begin(), mesh.points.end());
    ASSERT_TRUE(stream->Write(request));
    if (half_closes) {
      stream->WritesDone();
    }
    context.TryCancel();
    v1::TransferValuesResponse response;
    while (stream->Read(&response)) {
    }
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  RefineFurther(name, 3);  // the session is as it was
  EXPECT_TRUE(Transfer(From(name, mesh.revision, v1::FIELD_PLACE_VERTICES, 3), mesh.points).status.ok());
}

TEST_P(TransferValuesTest, AfterARestartTheEarlierMeshIsGone) {
  if (!GetParam()) {
    return;
  }
  const std::string name = CreateRefined();
  const ClientMesh first = Download(name);
  RefineFurther(name);
  const ClientMesh second = Download(name);
  StartServer({});
  ExpectRefused(Transfer(From(name, first.revision), {}), grpc::StatusCode::FAILED_PRECONDITION, "MESH_NOT_KEPT", "");
  EXPECT_EQ(Transfer(From(name, second.revision, v1::FIELD_PLACE_VERTICES, 2), second.points).values, second.points);
}

}  // namespace
}  // namespace wellspace::server
