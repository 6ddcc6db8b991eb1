#include "tests/server/recorder.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/time/clock.h"
#include "grpcpp/grpcpp.h"
#include "proto/checksum.h"

namespace wellspace::server {
namespace {

constexpr int kDimension = 2;

}  // namespace

Recorder::Recorder(const std::vector<std::string>& addresses, int number, const std::atomic<bool>& is_over,
                   absl::Duration patience)
    : prefix_(absl::StrCat("client-", number, "-")), random_(number), is_over_(is_over), patience_(patience) {
  for (const std::string& address : addresses) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 20);
    arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 20);
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 50);
    arguments.SetInt("a channel of its own", number);
    const auto channel = grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
    servers_.push_back({.address = address,
                        .sessions = v1::SessionService::NewStub(channel),
                        .operations = v1::OperationService::NewStub(channel),
                        .queries = v1::QueryService::NewStub(channel)});
  }
}

bool Recorder::Try(const std::function<grpc::Status(grpc::ClientContext&)>& call, grpc::StatusCode expected) {
  const absl::Time deadline = absl::Now() + absl::Minutes(2);
  while (absl::Now() < deadline) {
    grpc::ClientContext context;
    context.set_wait_for_ready(servers_.size() == 1);
    const bool is_impatient = patience_ > absl::ZeroDuration();
    context.set_deadline(absl::ToChronoTime(absl::Now() + (is_impatient ? patience_ : absl::Minutes(1))));
    const grpc::Status status = call(context);
    if (status.error_code() == expected) {
      return true;
    }
    // The request of a process that died may still be under way for the moment in which its end is noticed.
    const bool is_busy = DetailsOf(status).reason == "SESSION_BUSY";
    // Of gRPC, for a call that came to a server while that shut down: without a reason.
    const bool is_shut_down = status.error_code() == grpc::StatusCode::CANCELLED && DetailsOf(status).reason.empty();
    // Of gRPC, too, for a stream that a proxy has broken off between two messages.
    const bool is_broken_off =
        status.error_code() == grpc::StatusCode::UNKNOWN && status.error_message() == "Stream removed";
    const bool is_late = status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED && is_impatient;
    if (status.error_code() != grpc::StatusCode::UNAVAILABLE && !is_busy && !is_shut_down && !is_broken_off &&
        !is_late) {
      ADD_FAILURE() << status.error_code() << " " << status.error_message() << " from " << server().address;
      return false;
    }
    if (!is_busy) {
      Turn(status);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  ADD_FAILURE() << "no call came through for two minutes";
  return false;
}

void Recorder::RouteBy(const google::protobuf::Message& request, grpc::ClientContext& context) {
  constexpr size_t kIdSize = 32;
  const std::string text = request.ShortDebugString();
  const std::string prefix = "\"sessions/";
  if (const size_t at = text.find(prefix); at != std::string::npos) {
    context.AddMetadata("wellspace-session", text.substr(at + prefix.size(), kIdSize));
  }
}

void Recorder::Turn(const grpc::Status& status) {
  const std::string named = DetailsOf(status).address;
  const auto found = std::ranges::find(servers_, named, &Server::address);
  redirected_ += found == servers_.end() ? 0 : 1;
  current_ = found == servers_.end() ? (current_ + 1) % servers_.size() : found - servers_.begin();
}

std::string Recorder::NextId() { return absl::StrCat(prefix_, next_id_++); }

void Recorder::Run() {
  while (!is_over_ && !::testing::Test::HasFailure()) {
    Live();
    ++lives_;
  }
}

void Recorder::CheckAll() {
  for (const Acknowledged& kept : kept_) {
    Expect(kept);
    if (kept.mesh_revision != 0) {
      EXPECT_EQ(Checksum(kept.name, kept.mesh_revision), kept.mesh_crc32c) << kept.name;
    }
  }
  for (const std::string& name : deleted_) {
    v1::GetSessionRequest request;
    request.set_name(name);
    v1::GetSessionResponse response;
    const auto get = [&](grpc::ClientContext& context) {
      RouteBy(request, context);
      return server().sessions->GetSession(&context, request, &response);
    };
    EXPECT_TRUE(Try(get, grpc::StatusCode::NOT_FOUND)) << name;
  }
}

std::optional<v1::Session> Recorder::Get(const std::string& name) {
  v1::GetSessionRequest request;
  request.set_name(name);
  const auto response = Ask(&Server::sessions, &v1::SessionService::Stub::GetSession, request);
  return response.has_value() ? std::optional<v1::Session>(response->session()) : std::nullopt;
}

void Recorder::Expect(const Acknowledged& known) {
  const std::optional<v1::Session> seen = Get(known.name);
  ASSERT_TRUE(seen.has_value());
  EXPECT_EQ(seen->committed_points(), known.points) << known.name;
  EXPECT_EQ(seen->revision(), known.revision) << known.name;
  EXPECT_EQ(seen->labels().at("label"), known.label) << known.name;
}

uint32_t Recorder::Checksum(const std::string& name, uint64_t revision) {
  uint32_t checksum = 0;
  Try([&](grpc::ClientContext& context) {
    v1::DownloadMeshRequest request;
    request.set_name(name);
    request.set_revision(revision);
    checksum = 0;
    RouteBy(request, context);
    const auto stream = server().sessions->DownloadMesh(&context, request);
    for (v1::DownloadMeshResponse response; stream->Read(&response);) {
      const std::string bytes = response.SerializeAsString();
      checksum = ExtendCrc32c(checksum, bytes.data(), bytes.size());
    }
    return stream->Finish();
  });
  return checksum;
}

bool Recorder::Create(Acknowledged& known) {
  v1::CreateSessionRequest request;
  *request.mutable_parameters() = UnitCubeParameters(kDimension);
  known.label = NextId();
  (*request.mutable_labels())["label"] = known.label;
  request.set_request_id(known.label);
  const auto response = Ask(&Server::sessions, &v1::SessionService::Stub::CreateSession, request);
  if (response.has_value()) {
    known.name = response->session().name();
    known.revision = response->session().revision();
    told_.push_back({.of = Acknowledgement::Of::kCreation,
                     .session = known.name,
                     .request_id = known.label,
                     .revision = known.revision});
  }
  return response.has_value();
}

bool Recorder::Upload(Acknowledged& known) {
  const std::vector<double> points = UniformPoints(20 + random_() % 500, kDimension, random_());
  v1::UploadPointsResponse response;
  const bool has_come = Try([&](grpc::ClientContext& context) {
    response.Clear();
    const auto stream = server().sessions->UploadPoints(&context, &response);
    stream->Write(UploadRequest(known.name, known.points, points));
    stream->WritesDone();
    return stream->Finish();
  });
  known.points += points.size() / kDimension;
  EXPECT_EQ(response.committed_points(), known.points);
  EXPECT_GT(response.revision(), known.revision);
  known.revision = response.revision();
  if (has_come) {
    told_.push_back({.session = known.name, .revision = known.revision});
  }
  return has_come;
}

bool Recorder::Add(Acknowledged& known) {
  const std::vector<double> points = UniformPoints(1 + random_() % 20, kDimension, random_());
  v1::AddVerticesRequest request;
  request.set_name(known.name);
  request.mutable_points()->Assign(points.begin(), points.end());
  request.set_request_id(NextId());
  const auto response = Ask(&Server::queries, &v1::QueryService::Stub::AddVertices, request);
  if (response.has_value()) {
    known.points += points.size() / kDimension;
    EXPECT_EQ(response->revision(), known.revision + 1) << "it was done once";
    known.revision = response->revision();
    told_.push_back({.session = known.name, .request_id = request.request_id(), .revision = known.revision});
  }
  return response.has_value();
}

bool Recorder::Refine(Acknowledged& known) {
  v1::StartRefinementRequest request;
  request.set_name(known.name);
  request.set_request_id(NextId());
  const auto started = Ask(&Server::operations, &v1::OperationService::Stub::StartRefinement, request);
  if (!started.has_value()) {
    return false;
  }
  told_.push_back({.of = Acknowledgement::Of::kOperation, .session = known.name, .request_id = request.request_id()});
  v1::GetOperationRequest get;
  get.set_name(started->operation().name());
  std::optional<v1::GetOperationResponse> seen;
  do {
    seen = Ask(&Server::operations, &v1::OperationService::Stub::GetOperation, get);
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
  told_.push_back({.session = known.name, .revision = known.revision});
  return true;
}

bool Recorder::Update(Acknowledged& known) {
  v1::UpdateSessionRequest request;
  request.mutable_session()->set_name(known.name);
  request.mutable_update_mask()->add_paths("labels");
  known.label = NextId();
  (*request.mutable_session()->mutable_labels())["label"] = known.label;
  request.set_request_id(known.label);
  const bool is_done = Ask(&Server::sessions, &v1::SessionService::Stub::UpdateSession, request).has_value();
  if (is_done) {
    told_.push_back({.session = known.name, .request_id = request.request_id()});
  }
  return is_done;
}

bool Recorder::Delete(const Acknowledged& known) {
  v1::DeleteSessionRequest request;
  request.set_name(known.name);
  request.set_request_id(NextId());
  const bool is_done = Ask(&Server::sessions, &v1::SessionService::Stub::DeleteSession, request).has_value();
  if (is_done) {
    told_.push_back({.of = Acknowledgement::Of::kDeletion, .session = known.name, .request_id = request.request_id()});
  }
  return is_done;
}

void Recorder::Live() {
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

Recorded RecordAmongFaults(const std::vector<std::string>& addresses, int clients, int faults,
                           const std::function<void(int)>& fault, absl::Duration patience) {
  std::atomic<bool> is_over = false;
  std::vector<std::unique_ptr<Recorder>> recorders;
  std::vector<std::jthread> threads;
  const absl::Cleanup end = [&] { is_over = true; };  // an exception, too, is no reason to wait for ever
  for (int i = 0; i < clients; ++i) {
    recorders.push_back(std::make_unique<Recorder>(addresses, i, is_over, patience));
    threads.emplace_back([recorder = recorders.back().get()] { recorder->Run(); });
  }
  for (int i = 0; i < faults && !::testing::Test::HasFailure(); ++i) {
    fault(i);
  }
  is_over = true;
  Recorded recorded;
  for (int i = 0; i < clients; ++i) {
    threads[i].join();
    recorded.lives += recorders[i]->lives();
    recorded.redirected += recorders[i]->redirected();
    recorded.told.insert(recorded.told.end(), recorders[i]->told().begin(), recorders[i]->told().end());
  }
  EXPECT_GT(recorded.lives, 0);
  for (const auto& recorder : recorders) {
    recorder->CheckAll();
  }
  return recorded;
}

Recorded RecordAmongFaults(const std::vector<std::string>& addresses, int clients, int count,
                           const std::vector<Fault>& faults, size_t servers, absl::Duration patience) {
  const uint32_t seed = std::random_device()();
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  std::minstd_rand random(seed);
  std::map<std::string, int> counts;
  Recorded recorded = RecordAmongFaults(
      addresses, clients, count,
      [&](int i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(200 + random() % 1000));
        const Fault& fault = faults[i % faults.size()];
        fault.strike(random() % servers);
        ++counts[fault.kind];
      },
      patience);
  recorded.faults = std::move(counts);
  for (const auto& [kind, number] : recorded.faults) {
    ::testing::Test::RecordProperty(absl::StrReplaceAll(kind, {{" ", "_"}}), number);
  }
  return recorded;
}

}  // namespace wellspace::server
