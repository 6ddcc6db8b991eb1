// Meshes that are brought up to date, from a server that is real, by a connection that breaks when a test wants it.
#include <algorithm>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gtest/gtest.h"
#include "tests/client/grpc/fake_server.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "tests/support/same_mesh.h"

namespace wellspace::client {
namespace {

void ExpectSame(const Mesh& a, const Mesh& b) {
  test::ExpectSameMesh(a, b);
  EXPECT_EQ(a.revision, b.revision);
  EXPECT_EQ(a.statistics.simplices, b.statistics.simplices);
  EXPECT_EQ(a.statistics.seconds, b.statistics.seconds);
}

// A session of a server; downloads go by another server, which hands them on.
class UpdatesTest : public ::testing::Test {
 protected:
  UpdatesTest() {
    server_.sessions.download = [this](grpc::ServerContext&, const v1::DownloadMeshRequest& request,
                                       grpc::ServerWriter<v1::DownloadMeshResponse>& writer) {
      return HandOn(request, writer);
    };
  }

  grpc::Status HandOn(const v1::DownloadMeshRequest& request, grpc::ServerWriter<v1::DownloadMeshResponse>& writer) {
    requests_.push_back(request);
    v1::DownloadMeshRequest changed = request;
    if (is_old_) {
      changed.clear_since_revision();
    }
    grpc::ClientContext context;
    const auto stream = calls_.sessions().DownloadMesh(&context, changed);
    v1::DownloadMeshResponse response;
    for (int message = 0; stream->Read(&response); ++message) {
      if (message == break_at_) {
        context.TryCancel();
        stream->Finish();
        return Broken();
      }
      if (change_ != nullptr) {
        change_(response);
      }
      bytes_ += response.ByteSizeLong() + 5;  // gRPC's prefix of a message
      writer.Write(response);
    }
    return stream->Finish();
  }

  // A session with points in the unit cube, refined.
  std::string Refined(int dimension, size_t points) {
    std::string name = calls_.Create(dimension).name();
    calls_.Upload(name, 0, server::UniformPoints(points, dimension, 1));
    calls_.Refine(name);
    return name;
  }

  void Add(const std::string& name, int dimension, size_t points, uint64_t seed) {
    const uint64_t offset = calls_.Get(name).committed_points();
    calls_.Upload(name, offset, server::UniformPoints(points, dimension, seed));
    EXPECT_EQ(calls_.Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  }

  Mesh Whole(const std::string& name) {
    MeshCollector collector;
    bytes_ = 0;
    const absl::Status status = server_.Client().DownloadMesh(name, collector);
    EXPECT_TRUE(status.ok()) << status;
    requests_.clear();
    return std::move(collector.mesh());
  }

  void Update(const std::string& name, Mesh& mesh) {
    bytes_ = 0;
    requests_.clear();
    const absl::Status status = server_.Client().UpdateMesh(name, mesh);
    EXPECT_TRUE(status.ok()) << status;
  }

  server::ServiceHarness harness_;
  server::SessionCalls calls_{harness_.channel()};
  FakeServer server_;
  std::vector<v1::DownloadMeshRequest> requests_;
  uint64_t bytes_ = 0;
  bool is_old_ = false;  // it does not know of differences
  int break_at_ = -1;    // which message of each call does not come
  std::function<void(v1::DownloadMeshResponse&)> change_;
};

TEST_F(UpdatesTest, TenPointsTakeThreePercentOfTheBytes) {
  for (const auto& [dimension, points] : {std::pair(2, 8000), {3, 2000}}) {
    const std::string name = Refined(dimension, points);
    Mesh mesh = Whole(name);
    const size_t simplices = mesh.simplices.size() / (dimension + 1);
    EXPECT_GT(simplices, 12'000);
    Add(name, dimension, 10, 2);
    const Mesh whole = Whole(name);
    const uint64_t whole_bytes = bytes_;
    Update(name, mesh);
    ExpectSame(mesh, whole);
    EXPECT_EQ(requests_.size(), 1);
    EXPECT_LE(static_cast<double>(bytes_), 0.03 * static_cast<double>(whole_bytes));
    std::cout << dimension << "-D: " << bytes_ << " of " << whole_bytes << " bytes ("
              << 100.0 * static_cast<double>(bytes_) / static_cast<double>(whole_bytes) << " %), " << simplices
              << " simplices\n";
  }
}

TEST_F(UpdatesTest, AChainOfHundredIsTheWholeDownloadToTheBit) {
  const std::string name = Refined(3, 200);
  const Mesh first = Whole(name);
  Mesh mesh = first;
  for (uint64_t step = 0; step < 100; ++step) {
    Add(name, 3, 1, 100 + step);
    Update(name, mesh);
    EXPECT_EQ(requests_.size(), 1) << step;
  }
  ExpectSame(mesh, Whole(name));
}

TEST_F(UpdatesTest, SeveralDifferencesComeInOneCall) {
  const std::string name = Refined(2, 2000);
  Mesh mesh = Whole(name);
  for (uint64_t step = 0; step < 10; ++step) {
    Add(name, 2, 2, 100 + step);
  }
  const Mesh whole = Whole(name);
  Update(name, mesh);
  ExpectSame(mesh, whole);
  EXPECT_EQ(requests_.size(), 1);
  Update(name, mesh);  // nothing has changed since
  ExpectSame(mesh, whole);
  EXPECT_LT(bytes_, 3000);
}

TEST_F(UpdatesTest, GoesOnWhereTheConnectionBrokeOff) {
  const std::string name = Refined(2, 2000);
  const Mesh before = Whole(name);
  for (uint64_t step = 0; step < 3; ++step) {
    Add(name, 2, 2, 100 + step);
  }
  const Mesh whole = Whole(name);
  break_at_ = 2;  // each call brings metadata and a part
  Mesh mesh = before;
  Update(name, mesh);
  ExpectSame(mesh, whole);
  EXPECT_GT(requests_.size(), 3);
  EXPECT_TRUE(std::ranges::all_of(requests_, [](const auto& request) { return request.since_revision() > 0; }));
  EXPECT_TRUE(std::ranges::any_of(requests_, [](const auto& request) { return request.next_chunk() == 1; }));
  break_at_ = -1;
}

TEST_F(UpdatesTest, DownloadsAllWhereTheServerDoesNotKnowWhatHasChanged) {
  const std::string name = Refined(2, 500);
  Mesh mesh = Whole(name);
  v1::StartRefinementRequest restart;
  restart.set_name(name);
  restart.set_restart(true);
  calls_.Refine(restart);
  Update(name, mesh);
  ASSERT_EQ(requests_.size(), 2);
  EXPECT_GT(requests_[0].since_revision(), 0);
  EXPECT_EQ(requests_[1].since_revision(), 0);
  ExpectSame(mesh, Whole(name));
}

TEST_F(UpdatesTest, DownloadsAllOfAServerThatIsTooOld) {
  const std::string name = Refined(2, 500);
  Mesh mesh = Whole(name);
  Add(name, 2, 2, 5);
  is_old_ = true;
  Update(name, mesh);
  EXPECT_EQ(requests_.size(), 1);
  ExpectSame(mesh, Whole(name));
}

TEST_F(UpdatesTest, DownloadsAllForAMeshThatIsNotWhatItWas) {
  const std::string name = Refined(2, 500);
  const Mesh before = Whole(name);
  Add(name, 2, 2, 5);
  const Mesh whole = Whole(name);
  Mesh moved = before;
  moved.points[20] += 1e-9;
  Mesh shorter = before;
  shorter.simplices.resize(30);
  Mesh without_boundary = before;
  without_boundary.facets.clear();
  without_boundary.vertex_tags.clear();
  for (Mesh* mesh : {&moved, &shorter, &without_boundary}) {
    Update(name, *mesh);
    EXPECT_EQ(requests_.size(), 2);
    ExpectSame(*mesh, whole);
  }
  Mesh empty;
  Update(name, empty);
  EXPECT_EQ(requests_.size(), 1);
  ExpectSame(empty, whole);
}

TEST_F(UpdatesTest, DownloadsAllWhereADifferenceIsDamaged) {
  const std::string name = Refined(2, 500);
  const Mesh before = Whole(name);
  Add(name, 2, 2, 5);
  const Mesh whole = Whole(name);
  const std::vector<std::function<void(v1::MeshDelta&)>> damages = {
      [](v1::MeshDelta& delta) { delta.mutable_simplices()->Add(3); },
      [](v1::MeshDelta& delta) { delta.mutable_points()->Clear(); },
      [](v1::MeshDelta& delta) { delta.mutable_kept_simplices()->add_kept(1); },
      [](v1::MeshDelta& delta) { delta.mutable_kept_simplices()->add_skipped(-5); },
      [](v1::MeshDelta& delta) { delta.mutable_kept_simplices()->mutable_kept()->Set(0, uint64_t{1} << 63); },
      [](v1::MeshDelta& delta) { delta.mutable_kept_simplices()->mutable_skipped()->Set(0, -1); },
      [](v1::MeshDelta& delta) { delta.mutable_changed_points()->Add(4'000'000'000); },
      [](v1::MeshDelta& delta) { delta.set_index(7); },
  };
  for (const auto& damage : damages) {
    change_ = [&](v1::DownloadMeshResponse& response) {
      if (response.has_delta() && response.delta().points_size() > 0) {
        damage(*response.mutable_delta());
      }
    };
    Mesh mesh = before;
    Update(name, mesh);
    EXPECT_EQ(requests_.size(), 2);
    ExpectSame(mesh, whole);
  }
}

TEST_F(UpdatesTest, LeavesTheMeshAsItWasOnAnError) {
  const std::string name = Refined(2, 500);
  Mesh mesh = Whole(name);
  const Mesh before = mesh;
  calls_.Delete(name);
  EXPECT_EQ(server_.Client().UpdateMesh(name, mesh).code(), absl::StatusCode::kNotFound);
  ExpectSame(mesh, before);
  mesh.revision += 100;  // of no mesh that there was
  const std::string other = Refined(2, 500);
  const absl::Status status = server_.Client().UpdateMesh(other, mesh);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
  EXPECT_EQ(BlamedField(status), "since_revision");
}

}  // namespace
}  // namespace wellspace::client
