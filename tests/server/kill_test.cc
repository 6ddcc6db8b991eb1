// The real server, killed again and again among clients that go on: all that it has acknowledged is there.
#include <signal.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "grpcpp/grpcpp.h"
#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "server/store/check_data.h"
#include "server/store/data_folder.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "tests/server/store/store_support.h"
#include "tests/server/subprocess.h"
#include "tests/support/amount.h"

namespace wellspace::server {
namespace {

// Deaths of the process; the long test has a thousand.
const int kKills = test::Amount("WELLSPACE_KILLS", 25);
constexpr int kClients = 4;
constexpr int kDimension = 2;

// wellspaced over one folder and on one port, from one death to the next.
class MortalServer {
 public:
  explicit MortalServer(std::string folder) : folder_(std::move(folder)) { Start("127.0.0.1:0"); }

  const std::string& address() const { return address_; }

  void KillAndRestart() {
    process_->Signal(SIGKILL);
    process_->Wait();
    Start(address_);
  }

  int Stop() {
    process_->Signal(SIGTERM);
    return process_->Wait();
  }

 private:
  void Start(const std::string& listen) {
    process_.emplace("wellspaced",
                     std::vector<std::string>{"--data", folder_, "--listen", listen, "--log-level", "error",
                                              "--max-sessions-per-tenant", "1000000", "--max-sessions", "1000000"});
    const std::string line = process_->ReadLine();
    const std::string prefix = "listening on ";
    ASSERT_EQ(line.substr(0, prefix.size()), prefix) << "it does not start";
    address_ = line.substr(prefix.size());
  }

  const std::string folder_;
  std::string address_;
  std::optional<Subprocess> process_;
};

// One client, which notes acknowledged data, and compares.
class Recorder {
 public:
  Recorder(const std::string& address, int number, const std::atomic<bool>& is_over)
      : prefix_(absl::StrCat("client-", number, "-")), random_(number), is_over_(is_over) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 20);
    arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 20);
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 50);
    arguments.SetInt("a channel of its own", number);
    const auto channel = grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
    sessions_ = v1::SessionService::NewStub(channel);
    operations_ = v1::OperationService::NewStub(channel);
    queries_ = v1::QueryService::NewStub(channel);
  }

  // Lives of sessions, one after the other, until the end.
  void Run() {
    while (!is_over_ && !::testing::Test::HasFailure()) {
      Live();
      ++lives_;
    }
  }

  int lives() const { return lives_; }

  // Expects all acknowledged data to be there in the end.
  void CheckAll() {
    for (const Acknowledged& kept : kept_) {
      Expect(kept);
      if (kept.mesh_revision != 0) {
        EXPECT_EQ(Checksum(kept.name, kept.mesh_revision), kept.mesh_crc32c) << kept.name;
      }
    }
    for (const std::string& name : deleted_) {
      grpc::ClientContext context;
      v1::GetSessionRequest request;
      request.set_name(name);
      v1::GetSessionResponse response;
      EXPECT_EQ(sessions_->GetSession(&context, request, &response).error_code(), grpc::StatusCode::NOT_FOUND) << name;
    }
  }

 private:
  struct Acknowledged {
    std::string name;
    std::string label;
    uint64_t points = 0;
    uint64_t revision = 0;
    uint64_t mesh_revision = 0;
    uint32_t mesh_crc32c = 0;
  };

  // Makes a call again until it has reached a server that lives. Any other error than its death is a failure.
  bool Try(const std::function<grpc::Status(grpc::ClientContext&)>& call) {
    const absl::Time deadline = absl::Now() + absl::Minutes(2);
    while (absl::Now() < deadline) {
      grpc::ClientContext context;
      context.set_wait_for_ready(true);
      context.set_deadline(absl::ToChronoTime(absl::Now() + absl::Seconds(60)));
      const grpc::Status status = call(context);
      if (status.ok()) {
        return true;
      }
      // The request of a process that died may still be under way for the moment in which its end is noticed.
      const bool is_busy = DetailsOf(status).reason == "SESSION_BUSY";
      if (status.error_code() != grpc::StatusCode::UNAVAILABLE && !is_busy) {
        ADD_FAILURE() << status.error_code() << " " << status.error_message();
        return false;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    ADD_FAILURE() << "no call came through for two minutes";
    return false;
  }

  template <typename Request, typename Response, typename Stub>
  std::optional<Response> Ask(Stub& stub, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                              const Request& request) {
    Response response;
    const bool has_come = Try([&](grpc::ClientContext& context) {
      response.Clear();
      return (stub.*method)(&context, request, &response);
    });
    return has_come ? std::optional<Response>(response) : std::nullopt;
  }

  std::string NextId() { return absl::StrCat(prefix_, next_id_++); }

  std::optional<v1::Session> Get(const std::string& name) {
    v1::GetSessionRequest request;
    request.set_name(name);
    const auto response = Ask(*sessions_, &v1::SessionService::Stub::GetSession, request);
    return response.has_value() ? std::optional<v1::Session>(response->session()) : std::nullopt;
  }

  void Expect(const Acknowledged& known) {
    const std::optional<v1::Session> seen = Get(known.name);
    ASSERT_TRUE(seen.has_value());
    EXPECT_EQ(seen->committed_points(), known.points) << known.name;
    EXPECT_EQ(seen->revision(), known.revision) << known.name;
    EXPECT_EQ(seen->labels().at("label"), known.label) << known.name;
  }

  // Of all chunks of the mesh.
  uint32_t Checksum(const std::string& name, uint64_t revision) {
    uint32_t checksum = 0;
    Try([&](grpc::ClientContext& context) {
      v1::DownloadMeshRequest request;
      request.set_name(name);
      request.set_revision(revision);
      checksum = 0;
      const auto stream = sessions_->DownloadMesh(&context, request);
      for (v1::DownloadMeshResponse response; stream->Read(&response);) {
        const std::string bytes = response.SerializeAsString();
        checksum = ExtendCrc32c(checksum, bytes.data(), bytes.size());
      }
      return stream->Finish();
    });
    return checksum;
  }

  bool Create(Acknowledged& known) {
    v1::CreateSessionRequest request;
    *request.mutable_parameters() = UnitCubeParameters(kDimension);
    known.label = NextId();
    (*request.mutable_labels())["label"] = known.label;
    request.set_request_id(known.label);
    const auto response = Ask(*sessions_, &v1::SessionService::Stub::CreateSession, request);
    if (response.has_value()) {
      known.name = response->session().name();
      known.revision = response->session().revision();
    }
    return response.has_value();
  }

  bool Upload(Acknowledged& known) {
    const std::vector<double> points = UniformPoints(20 + random_() % 500, kDimension, random_());
    v1::UploadPointsResponse response;
    const bool has_come = Try([&](grpc::ClientContext& context) {
      response.Clear();
      const auto stream = sessions_->UploadPoints(&context, &response);
      stream->Write(UploadRequest(known.name, known.points, points));
      stream->WritesDone();
      return stream->Finish();
    });
    known.points += points.size() / kDimension;
    EXPECT_EQ(response.committed_points(), known.points);
    EXPECT_GT(response.revision(), known.revision);
    known.revision = response.revision();
    return has_come;
  }

  bool Add(Acknowledged& known) {
    const std::vector<double> points = UniformPoints(1 + random_() % 20, kDimension, random_());
    v1::AddVerticesRequest request;
    request.set_name(known.name);
    request.mutable_points()->Assign(points.begin(), points.end());
    request.set_request_id(NextId());
    const auto response = Ask(*queries_, &v1::QueryService::Stub::AddVertices, request);
    if (response.has_value()) {
      known.points += points.size() / kDimension;
      EXPECT_EQ(response->revision(), known.revision + 1) << "it was done once";
      known.revision = response->revision();
    }
    return response.has_value();
  }

  bool Refine(Acknowledged& known) {
    v1::StartRefinementRequest request;
    request.set_name(known.name);
    request.set_request_id(NextId());
    const auto started = Ask(*operations_, &v1::OperationService::Stub::StartRefinement, request);
    if (!started.has_value()) {
      return false;
    }
    v1::GetOperationRequest get;
    get.set_name(started->operation().name());
    std::optional<v1::GetOperationResponse> seen;
    do {
      seen = Ask(*operations_, &v1::OperationService::Stub::GetOperation, get);
      std::this_thread::sleep_for(std::chrono::milliseconds(3));
    } while (seen.has_value() && !seen->operation().has_end_time());
    if (!seen.has_value()) {
      return false;
    }
    if (seen->operation().state() == v1::Operation::STATE_FAILED) {
      return !is_over_;  // two processes were killed in its work: that is known, and changes nothing
    }
    EXPECT_EQ(seen->operation().state(), v1::Operation::STATE_SUCCEEDED);
    EXPECT_GT(seen->operation().mesh_revision(), known.revision);
    known.mesh_revision = known.revision = seen->operation().mesh_revision();
    known.mesh_crc32c = Checksum(known.name, known.mesh_revision);
    return true;
  }

  bool Update(Acknowledged& known) {
    v1::UpdateSessionRequest request;
    request.mutable_session()->set_name(known.name);
    request.mutable_update_mask()->add_paths("labels");
    known.label = NextId();
    (*request.mutable_session()->mutable_labels())["label"] = known.label;
    request.set_request_id(known.label);
    return Ask(*sessions_, &v1::SessionService::Stub::UpdateSession, request).has_value();
  }

  bool Delete(const Acknowledged& known) {
    v1::DeleteSessionRequest request;
    request.set_name(known.name);
    request.set_request_id(NextId());
    return Ask(*sessions_, &v1::SessionService::Stub::DeleteSession, request).has_value();
  }

  void Live() {
    Acknowledged known;
    bool goes_on = Create(known) && Upload(known) && Refine(known);
    for (int i = 0; goes_on && !is_over_ && i < 6; ++i) {
      switch (random_() % 4) {
        case 0:
          goes_on = Upload(known);
          break;
        case 1:
          goes_on = known.mesh_revision == 0 || Add(known);
          break;
        case 2:
          goes_on = Refine(known);
          break;
        default:
          goes_on = Update(known);
      }
      if (goes_on) {
        Expect(known);
        if (known.mesh_revision != 0) {
          EXPECT_EQ(Checksum(known.name, known.mesh_revision), known.mesh_crc32c);
        }
      }
    }
    if (goes_on && random_() % 2 == 0) {
      if (Delete(known)) {
        deleted_.push_back(known.name);
      }
    } else if (goes_on) {
      kept_.push_back(known);
    }
  }

  const std::string prefix_;
  std::minstd_rand random_;
  const std::atomic<bool>& is_over_;
  std::unique_ptr<v1::SessionService::Stub> sessions_;
  std::unique_ptr<v1::OperationService::Stub> operations_;
  std::unique_ptr<v1::QueryService::Stub> queries_;
  uint64_t next_id_ = 0;
  int lives_ = 0;
  std::vector<Acknowledged> kept_;
  std::vector<std::string> deleted_;
};

TEST(Kill, WhatWasAcknowledgedIsThere) {
  const uint32_t seed = std::random_device()();
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  std::minstd_rand random(seed);
  const TestFolder folder;
  MortalServer server(folder.path());
  std::atomic<bool> is_over = false;
  std::vector<std::unique_ptr<Recorder>> clients;
  std::vector<std::jthread> threads;
  const absl::Cleanup end = [&] { is_over = true; };  // an exception, too, is no reason to wait for ever
  for (int i = 0; i < kClients; ++i) {
    clients.push_back(std::make_unique<Recorder>(server.address(), i, is_over));
    threads.emplace_back([client = clients.back().get()] { client->Run(); });
  }
  for (int i = 0; i < kKills && !HasFailure(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 150));
    server.KillAndRestart();
  }
  is_over = true;
  int lives = 0;
  for (int i = 0; i < kClients; ++i) {
    threads[i].join();
    lives += clients[i]->lives();
  }
  EXPECT_GT(lives, 0);
  for (const auto& client : clients) {
    client->CheckAll();
  }
  EXPECT_EQ(server.Stop(), 0);
  const absl::StatusOr<DataReport> report = CheckData(folder.path());
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_TRUE(report->is_whole()) << report->problems[0];
  EXPECT_TRUE(report->unknown.empty()) << report->unknown[0];
  RecordProperty("sessions", lives);
}

}  // namespace
}  // namespace wellspace::server
