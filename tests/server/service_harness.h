// A server in the test's process with a mesher of the test's choice, and a client that speaks the protocol message by
// message.
#ifndef WELLSPACE_TESTS_SERVER_SERVICE_HARNESS_H_
#define WELLSPACE_TESTS_SERVER_SERVICE_HARNESS_H_

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/meshers/mesher.h"
#include "grpcpp/grpcpp.h"
#include "server/server.h"
#include "wellspace/v1/meshing.grpc.pb.h"

namespace wellspace::server {

// Something that happens once and can be waited for.
class Event {
 public:
  void Set();
  // False when it did not happen for a minute: the test has failed.
  bool Wait();
  bool IsSet() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable set_changed_;
  bool set_ = false;
};

// No mesh, but the arrays of one: the points, then the corners of the box; a simplex per vertex; every input point its
// own vertex.
core::Mesh MakeFakeMesh(const core::MeshParameters& parameters, std::span<const double> points);
absl::StatusOr<core::Mesh> FakeMesher(const core::MeshParameters& parameters, const core::Input& input,
                                      core::RunContext& context);

// A mesher that sets `started` and then works until its context is cancelled.
Mesher EndlessMesher(Event& started);

// As many vertices as points, and so on.
absl::StatusOr<core::MeshEstimate> FakeEstimator(const core::MeshParameters& parameters, const core::Input& input,
                                                 core::RunContext& context);

// The details of an error.
struct ErrorDetails {
  std::string reason;  // without the prefix ERROR_REASON_
  std::string field;
  bool may_retry = false;
  std::string address;  // of the server that has the session
};
ErrorDetails DetailsOf(const grpc::Status& status);
// Of the server as clients see it.
ErrorDetails DetailsOf(const absl::Status& status);

// The place of a phase in the order in which they come, which is not that of their numbers.
int PlaceOf(v1::Phase phase);

// Parameters of a call in dimension 3 or another, with the unit cube as domain.
v1::MeshParameters UnitCubeParameters(int dimension = 3);

// Points within the unit cube; always the same ones.
std::vector<double> RandomPoints(size_t count, int dimension = 3);

// One call of MeshPoints on the client's side.
class TestCall {
 public:
  explicit TestCall(v1::MeshingService::Stub& stub, std::optional<absl::Duration> timeout = std::nullopt,
                    const std::string& token = "");
  // Cancels the call if Finish was not called.
  ~TestCall();

  bool Send(const v1::MeshParameters& parameters);
  bool Send(const std::vector<double>& coordinates);
  void HalfClose() { stream_->WritesDone(); }
  void Cancel() { context_.TryCancel(); }
  // Reads the next response, which is kept in the members below, too. False at the end of the stream.
  bool Read(v1::MeshPointsResponse* response);

  // Reads all that is still to come and returns the status.
  grpc::Status Finish();

  std::vector<v1::ProgressEvent> events;
  std::vector<v1::MeshMetadata> metadata;
  std::vector<v1::MeshChunk> chunks;

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::MeshPointsRequest, v1::MeshPointsResponse>> stream_;
  bool finished_ = false;
};

// The arrays that the chunks of `call` add up to.
std::vector<double> PointsOf(const TestCall& call);
std::vector<uint32_t> SimplicesOf(const TestCall& call);
std::vector<uint32_t> InputVerticesOf(const TestCall& call);

// The log of the server, line by line.
class LogLines {
 public:
  void Add(std::string line);
  // Waits until `count` lines contain `part`; false when a minute passes.
  bool WaitFor(const std::string& part, size_t count = 1);
  size_t Count(const std::string& part) const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable added_;
  std::vector<std::string> lines_;
};

enum class Transport { kInProcess, kLoopback };

class ServiceHarness {
 public:
  explicit ServiceHarness(Mesher mesher = FakeMesher, const ServiceOptions& options = {},
                          Transport transport = Transport::kInProcess, Estimator estimator = FakeEstimator,
                          MesherFactory create_mesher = core::Mesher::Create, const SecurityOptions& security = {},
                          std::unique_ptr<SessionLog> session_log = nullptr);

  Server& server() { return *server_; }
  LogLines& log() { return *log_; }
  v1::MeshingService::Stub& stub() { return *stub_; }
  std::shared_ptr<grpc::Channel> channel() { return channel_; }

  v1::GetServerInfoResponse Info();
  // The time from now until no job runs or waits.
  absl::Duration TimeUntilIdle();

 private:
  std::shared_ptr<LogLines> log_ = std::make_shared<LogLines>();
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::MeshingService::Stub> stub_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_SERVICE_HARNESS_H_
