// Several servers that share their sessions: calls go to the one that has the session, by the addresses that the others
// name, and never where they must not.
#include "client/grpc/servers.h"

#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/address.h"
#include "client/client.h"
#include "client/error_details.h"
#include "gmock/gmock.h"
#include "google/protobuf/descriptor.h"
#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "tests/client/cli/closed_port.h"
#include "tests/client/grpc/replica.h"
#include "tests/server/security/certificates.h"
#include "tests/support/temporary_folder.h"
#include "wellspace/v1/operations.pb.h"
#include "wellspace/v1/queries.pb.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::client {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;

constexpr char kSession[] = "sessions/one";
constexpr char kOperation[] = "sessions/one/operations/two";
constexpr char kElsewhereReason[] = "ERROR_REASON_SESSION_ELSEWHERE";

constexpr RetryPolicy kQuick = {.max_attempts = 4,
                                .max_first_attempts = 2,
                                .initial_backoff = absl::Milliseconds(1),
                                .multiplier = 2,
                                .max_backoff = absl::Milliseconds(4)};

v1::Session MakeSession() {
  v1::Session session;
  session.set_name(kSession);
  session.mutable_parameters()->set_dimension(2);
  session.set_committed_points(3);
  return session;
}

// A mesh of three points.
std::vector<std::string> MeshMessages() {
  v1::DownloadMeshResponse first;
  v1::MeshMetadata& metadata = *first.mutable_metadata();
  metadata.set_dimension(2);
  for (int axis = 0; axis < 2; ++axis) {
    metadata.mutable_domain()->add_low(0);
    metadata.mutable_domain()->add_high(1);
  }
  metadata.set_vertex_count(3);
  metadata.set_revision(5);
  metadata.set_chunk_count(1);
  const std::vector<double> points = {0, 0, 1, 0, 0, 1};
  v1::DownloadMeshResponse second;
  second.mutable_chunk()->mutable_points()->Assign(points.begin(), points.end());
  second.mutable_chunk()->set_crc32c(Crc32c(points.data(), points.size() * sizeof(double)));
  return {first.SerializeAsString(), second.SerializeAsString()};
}

// The right answer to each call on a session.
Answer Right(const Heard& heard) {
  v1::GetSessionResponse session;
  *session.mutable_session() = MakeSession();
  v1::UploadPointsResponse uploaded;
  uploaded.set_committed_points(3);
  v1::StartRefinementResponse operation;
  operation.mutable_operation()->set_name(kOperation);
  v1::WatchOperationResponse ended;
  *ended.mutable_operation() = operation.operation();
  v1::LocateResponse located;
  located.set_revision(5);
  v1::TransferValuesResponse transferred;
  transferred.mutable_start()->set_revision(5);
  // Answers of one operation or one session have it in field 1, all of them.
  const std::map<std::string, std::vector<std::string>> messages = {
      {"GetSession", {session.SerializeAsString()}},
      {"UpdateSession", {session.SerializeAsString()}},
      {"UploadPoints", {uploaded.SerializeAsString()}},
      {"DownloadMesh", MeshMessages()},
      {"StartRefinement", {operation.SerializeAsString()}},
      {"GetOperation", {operation.SerializeAsString()}},
      {"CancelOperation", {operation.SerializeAsString()}},
      {"WatchOperation", {ended.SerializeAsString()}},
      {"Locate", {located.SerializeAsString()}},
      {"TransferValues", {transferred.SerializeAsString()}},
      {"ApproximateNearestNeighbors", {}},
      {"ClippedVoronoiCells", {}},
      {"VoronoiCells", {}},
  };
  const auto found = messages.find(heard.method);
  return {found == messages.end() ? std::vector<std::string>{""} : found->second, grpc::Status::OK};
}

Replica::Behaviour SaysElsewhere(const std::string& address) {
  return [address](const Heard&) { return Answer{{}, Elsewhere(address)}; };
}

// Two servers; a client of the first that opens channels to any address that is one of theirs.
class ServersTest : public ::testing::Test {
 protected:
  ServersTest() : second_(Right), first_(SaysElsewhere(second_.address())) {}

  client::Client Client(const RetryPolicy& policy = kQuick) {
    return client::Client(MakeConnection(first_.Channel(), policy, [this](const std::string& address) {
      opened_.push_back(address);
      return absl::StatusOr<std::shared_ptr<grpc::Channel>>(address == first_.address() ? first_.Channel()
                                                                                        : second_.Channel());
    }));
  }

  Replica second_;
  Replica first_;
  std::vector<std::string> opened_;  // addresses
};

using AnyCall = std::function<absl::Status(Client& client)>;

std::vector<AnyCall> CallsOnASession() {
  static const std::vector<double> points = {0, 0, 1, 0, 0, 1};
  return {
      [](Client& client) { return client.GetSession(kSession).status(); },
      [](Client& client) { return client.UpdateSession(kSession, {.labels = Labels(), .ttl = {}}).status(); },
      [](Client& client) {
        SpanSource source(2, points);
        return client.UploadPoints(kSession, source, 0).status();
      },
      [](Client& client) { return client.RemovePoints(kSession, std::vector<uint64_t>{0}).status(); },
      [](Client& client) { return client.AddSegments(kSession, {}, FeatureOffset{}).status(); },
      [](Client& client) { return client.AddTriangles(kSession, {}, SurfaceOffset{}).status(); },
      [](Client& client) { return client.SetSizes(kSession, {}).status(); },
      [](Client& client) {
        MeshCollector mesh;
        return client.DownloadMesh(kSession, mesh);
      },
      [](Client& client) {
        Mesh mesh;
        return client.UpdateMesh(kSession, mesh);
      },
      [](Client& client) { return client.StartRefinement(kSession).status(); },
      [](Client& client) { return client.GetOperation(kOperation).status(); },
      [](Client& client) { return client.ListOperations(kSession).status(); },
      [](Client& client) { return client.CancelOperation(kOperation).status(); },
      [](Client& client) { return client.WatchOperation(kOperation).status(); },
      [](Client& client) {
        return client.ApproximateNearestNeighbors(kSession, {}, [](const auto&) { return absl::OkStatus(); });
      },
      [](Client& client) {
        return client.ClippedVoronoiCells(kSession, {}, 2, [](const CellBatch&) { return absl::OkStatus(); });
      },
      [](Client& client) {
        return client.VoronoiCells(kSession, {}, [](const CellBatch&) { return absl::OkStatus(); });
      },
      [](Client& client) { return client.Locate(kSession, {}).status(); },
      [](Client& client) {
        return client.TransferValues(kSession, std::vector<double>{1}, {.from_revision = 1}).status();
      },
      [](Client& client) { return client.AddVertices(kSession, {}).status(); },
      [](Client& client) { return client.DeleteSession(kSession); },
  };
}

// The calls of the API about a session: all of these services but for two.
std::set<std::string> MethodsOnASession() {
  std::set<std::string> names;
  for (const char* service : {"SessionService", "OperationService", "QueryService"}) {
    const google::protobuf::ServiceDescriptor* descriptor =
        google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(absl::StrCat("wellspace.v1.", service));
    for (int i = 0; i < descriptor->method_count(); ++i) {
      names.insert(descriptor->method(i)->name());
    }
  }
  names.erase("CreateSession");
  names.erase("ListSessions");
  return names;
}

TEST_F(ServersTest, EveryCallGoesWhereTheSessionIs) {
  std::set<std::string> done;
  for (const AnyCall& call : CallsOnASession()) {
    client::Client client = Client();
    for (const size_t at_first : {1, 0}) {  // the second call goes straight there
      const absl::Status status = call(client);
      const std::vector<Heard> heard = second_.heard();
      ASSERT_TRUE(status.ok()) << status << (heard.empty() ? "" : heard.back().method);
      EXPECT_EQ(first_.NewCalls(), at_first) << heard.back().method;
      EXPECT_GE(second_.NewCalls(), 1u);
      done.insert(heard.back().method);
    }
  }
  EXPECT_THAT(done, IsSupersetOf(MethodsOnASession()));
  // A proxy learns from each which session it is about, whether it is called by its name or by that of an operation.
  EXPECT_THAT(first_.heard(), Each(Field(&Heard::session, "one")));
  EXPECT_THAT(second_.heard(), Each(Field(&Heard::session, "one")));
}

TEST_F(ServersTest, OtherSessionsStayAtTheFirst) {
  client::Client client = Client();
  ASSERT_TRUE(client.GetSession(kSession).ok());
  first_.Become(Right);
  first_.NewCalls();
  second_.NewCalls();
  EXPECT_TRUE(client.GetSession("sessions/other").ok());
  EXPECT_TRUE(client.ListSessions().ok());
  EXPECT_EQ(first_.NewCalls(), 2u);
  EXPECT_EQ(second_.NewCalls(), 0u);
  EXPECT_THAT(opened_, ::testing::SizeIs(1));
  EXPECT_EQ(first_.heard().back().session, "") << "a list is about no session";
}

// As long as two servers send a client to and fro it goes on, in bounds.
TEST_F(ServersTest, ARedirectLoopEnds) {
  second_.Become(SaysElsewhere(first_.address()));
  const absl::Status status = Client().GetSession(kSession).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(ReasonOf(status), kElsewhereReason);
  EXPECT_EQ(first_.NewCalls() + second_.NewCalls(), 4u * 5) << "four in a row, then the wait of a failure";
  EXPECT_THAT(opened_, ::testing::SizeIs(2)) << "a channel for each address";
}

TEST_F(ServersTest, ARedirectLoopKeepsTheDeadline) {
  second_.Become(SaysElsewhere(first_.address()));
  RetryPolicy patient = kQuick;
  patient.max_attempts = 1'000'000;
  CallOptions call;
  call.timeout = absl::Milliseconds(200);
  const absl::Duration begin = SinceBoot();
  EXPECT_FALSE(Client(patient).GetSession(kSession, call).ok());
  EXPECT_LT(SinceBoot() - begin, absl::Seconds(20)) << "on a busy machine";
}

// As between the death of a server and the end of its lease.
TEST_F(ServersTest, AServerThatIsGoneIsGivenUp) {
  client::Client client = Client();
  ASSERT_TRUE(client.GetSession(kSession).ok());
  second_.Shutdown();
  first_.NewCalls();
  int left = 2;
  first_.Become([this, &left](const Heard& heard) {
    return left-- > 0 ? Answer{{}, Elsewhere(second_.address())} : Right(heard);
  });
  const absl::StatusOr<Session> session = client.GetSession(kSession);
  ASSERT_TRUE(session.ok()) << session.status();
  EXPECT_EQ(first_.NewCalls(), 3u);
  ASSERT_TRUE(client.GetSession(kSession).ok());
  EXPECT_EQ(first_.NewCalls(), 1u) << "it has the session now";
}

TEST_F(ServersTest, AServerThatStaysAwayIsNamed) {
  second_.Shutdown();
  const absl::Status status = Client().GetSession(kSession).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), HasSubstr(absl::StrCat("so it was at ", second_.address())));
  EXPECT_EQ(first_.NewCalls(), 4u) << "once for each of the attempts that fail";
}

TEST_F(ServersTest, WhoDoesNotKnowWhereIsAskedAgain) {
  int left = 2;
  first_.Become([&left](const Heard& heard) { return left-- > 0 ? Answer{{}, Elsewhere("")} : Right(heard); });
  ASSERT_TRUE(Client().GetSession(kSession).ok());
  EXPECT_EQ(first_.NewCalls(), 3u);
  EXPECT_EQ(second_.NewCalls(), 0u);
  first_.Become(SaysElsewhere(""));
  const absl::Status status = Client().GetSession(kSession).status();
  EXPECT_EQ(ReasonOf(status), kElsewhereReason);
  EXPECT_EQ(OwnerAddressOf(status), "");
  EXPECT_EQ(first_.NewCalls(), 4u);
}

// The server to which a call went straight has lost the session, or its database, and knows no more.
TEST_F(ServersTest, TheFirstIsAskedWhereARememberedOneFails) {
  for (const grpc::Status& failure : {Elsewhere(""), grpc::Status(grpc::StatusCode::UNAVAILABLE, "stopping")}) {
    first_.Become(SaysElsewhere(second_.address()));
    second_.Become(Right);
    client::Client client = Client();
    ASSERT_TRUE(client.GetSession(kSession).ok());
    first_.Become(Right);
    second_.Become([&failure](const Heard&) { return Answer{{}, failure}; });
    first_.NewCalls();
    second_.NewCalls();
    EXPECT_TRUE(client.GetSession(kSession).ok());
    EXPECT_EQ(second_.NewCalls(), 1u);
    EXPECT_EQ(first_.NewCalls(), 1u);
  }
}

// It stands still, and the deadline of a call passes at it: the next call asks where the session is now.
TEST_F(ServersTest, AServerThatStandsStillIsForgotten) {
  client::Client client = Client();
  ASSERT_TRUE(client.GetSession(kSession).ok());
  second_.Become([](const Heard&) {
    return Answer{{}, grpc::Status(grpc::StatusCode::DEADLINE_EXCEEDED, "Deadline Exceeded")};
  });
  EXPECT_TRUE(absl::IsDeadlineExceeded(client.GetSession(kSession).status()));
  first_.Become(Right);
  first_.NewCalls();
  EXPECT_TRUE(client.GetSession(kSession).ok());
  EXPECT_EQ(first_.NewCalls(), 1u);
}

TEST_F(ServersTest, ErrorsOfTheOwnerAreTheCalls) {
  second_.Become([](const Heard&) { return Answer{{}, grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, "wrong")}; });
  client::Client client = Client();
  EXPECT_EQ(client.GetSession(kSession).status(), absl::InvalidArgumentError("wrong"));
  EXPECT_EQ(second_.NewCalls(), 1u);
}

// A watch goes on after the last event, wherever that came from.
TEST_F(ServersTest, AWatchGoesOnAtTheOwner) {
  first_.Become([this](const Heard&) {
    v1::WatchOperationResponse event;
    event.mutable_progress()->set_sequence(7);
    return Answer{{event.SerializeAsString()}, Elsewhere(second_.address())};
  });
  int events = 0;
  ASSERT_TRUE(Client().WatchOperation(kOperation, [&events](const Progress&) { ++events; }).ok());
  EXPECT_EQ(events, 1);
  v1::WatchOperationRequest request;
  ASSERT_TRUE(request.ParseFromString(second_.heard().back().first_request));
  EXPECT_EQ(request.after_sequence(), 7u);
}

TEST_F(ServersTest, ADownloadGoesOnAtTheOwner) {
  first_.Become([this](const Heard&) { return Answer{{MeshMessages().front()}, Elsewhere(second_.address())}; });
  MeshCollector collector;
  const absl::Status status = Client().DownloadMesh(kSession, collector);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(collector.mesh().points.size(), 6u);
  v1::DownloadMeshRequest request;
  ASSERT_TRUE(request.ParseFromString(second_.heard().back().first_request));
  EXPECT_EQ(request.revision(), 5u) << "the one that it had begun";
}

// The first has committed nothing: what was expected of the session still is.
TEST_F(ServersTest, TheExpectedRevisionGoesAlong) {
  CallOptions call;
  call.expected_revision = 9;
  client::Client client = Client();
  ASSERT_TRUE(client.AddSegments(kSession, {}, FeatureOffset{}, call).ok());
  v1::AddSegmentsRequest segments;
  ASSERT_TRUE(segments.ParseFromString(second_.heard().back().first_request));
  EXPECT_EQ(segments.expected_revision(), 9u);
  // The session moves between the look at it and the upload.
  first_.Become([this](const Heard& heard) {
    return heard.method == "GetSession" ? Right(heard) : Answer{{}, Elsewhere(second_.address())};
  });
  const std::vector<double> points = {0, 0, 1, 0, 0, 1};
  SpanSource source(2, points);
  client = Client();
  ASSERT_TRUE(client.UploadPoints(kSession, source, 0, nullptr, call).ok());
  v1::UploadPointsRequest upload;
  ASSERT_TRUE(upload.ParseFromString(second_.heard().back().first_request));
  EXPECT_EQ(upload.expected_revision(), 9u);
}

// A change that may have been done is repeated elsewhere with the same id.
TEST_F(ServersTest, TheRequestIdGoesAlong) {
  ASSERT_TRUE(Client().StartRefinement(kSession).ok());
  v1::StartRefinementRequest first;
  v1::StartRefinementRequest second;
  ASSERT_TRUE(first.ParseFromString(first_.heard().back().first_request));
  ASSERT_TRUE(second.ParseFromString(second_.heard().back().first_request));
  EXPECT_NE(first.request_id(), "");
  EXPECT_EQ(first.request_id(), second.request_id());
}

TEST_F(ServersTest, OnlyAddressesAreFollowed) {
  for (const std::string address : {"unix:/run/other.sock",
                                    "unix:///run/other.sock",
                                    "unix-abstract:x",
                                    "dns:///a.example:1",
                                    "ipv4:127.0.0.1:1",
                                    "http://a.example:1",
                                    "a.example",
                                    "a.example:0",
                                    "a.example:65536",
                                    "a.example:http",
                                    ":1",
                                    "::1:7233",
                                    "[::1]",
                                    "[::1:1",
                                    "[a.example]:1",
                                    "[fe80::1%eth0]:1",
                                    "a b:1",
                                    "a.example:1/x",
                                    "a,b:1",
                                    "user@host:1",
                                    "\x1b[2J:1",
                                    "h\xc3\xb6:1"}) {
    SCOPED_TRACE(address);
    first_.Become(SaysElsewhere(address));
    const absl::Status status = Client().GetSession(kSession).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
    EXPECT_THAT(std::string(status.message()), AllOf(HasSubstr("expected the HOST:PORT"), Not(HasSubstr("\x1b"))));
    EXPECT_EQ(first_.NewCalls(), 1u);
  }
  first_.Become(SaysElsewhere(std::string(3000, 'a') + ":1"));
  const absl::Status status = Client().GetSession(kSession).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_LT(status.message().size(), 1000u);
  EXPECT_TRUE(opened_.empty());
}

TEST_F(ServersTest, AddressesAreFollowed) {
  for (const std::string address :
       {"a.example:7233", "mesh-1:1", "a_b:65535", "10.0.0.1:80", "[::1]:1", "[fd00::7]:1"}) {
    first_.Become(SaysElsewhere(address));
    EXPECT_TRUE(Client().GetSession(kSession).ok()) << address;
    EXPECT_EQ(opened_.back(), address);
  }
}

// A server that names one address after the other has a client keep but few channels.
TEST_F(ServersTest, ServersAreBounded) {
  int named = 0;
  first_.Become([&named](const Heard&) { return Answer{{}, Elsewhere(absl::StrCat("a.example:", ++named))}; });
  client::Client client = Client();
  for (int i = 0; i < 65; ++i) {
    ASSERT_TRUE(client.GetSession(absl::StrCat("sessions/", i)).ok());
  }
  EXPECT_EQ(opened_.size(), 65u);
  first_.NewCalls();
  ASSERT_TRUE(client.GetSession("sessions/64").ok());
  EXPECT_EQ(first_.NewCalls(), 0u);
  ASSERT_TRUE(client.GetSession("sessions/0").ok());
  EXPECT_EQ(first_.NewCalls(), 1u) << "it was forgotten";
}

TEST(SessionIdOf, IsThatOfTheSession) {
  EXPECT_EQ(SessionIdOf(kSession), "one");
  EXPECT_EQ(SessionIdOf(kOperation), "one");
  EXPECT_EQ(SessionIdOf("sessions/0123abc"), "0123abc");
  for (const std::string none : {"", "one", "sessions", "sessions/", "sessions//operations/1", "sessions/a b",
                                 "sessions/a\n", "sessions/\xc3\xb6", "Sessions/one"}) {
    EXPECT_EQ(SessionIdOf(none), "") << none;
  }
  EXPECT_EQ(SessionIdOf(absl::StrCat("sessions/", std::string(129, 'a'))), "");
}

// A name with bytes that metadata cannot carry is the server's to refuse.
TEST_F(ServersTest, AnyNameCanBeAskedFor) {
  first_.Become(Right);
  EXPECT_TRUE(Client().GetSession("sessions/\x01\n").ok());
  EXPECT_EQ(first_.heard().back().session, "");
}

// By the network, as Connect opens it.
TEST(Connect, FollowsWithTheSameToken) {
  Replica second(Right);
  Replica first(SaysElsewhere(second.address()));
  client::Client client = Connect(first.address(), {.token = "secret"}).value();
  const absl::StatusOr<Session> session = client.GetSession(kSession);
  ASSERT_TRUE(session.ok()) << session.status();
  EXPECT_EQ(first.heard().back().authorization, "Bearer secret");
  EXPECT_EQ(second.heard().back().authorization, "Bearer secret");
}

TEST(Connect, TakesTheTokenNowhereInPlainText) {
  Replica first(SaysElsewhere("mesh.example:7233"));
  const absl::Status status = Connect(first.address(), {.token = "secret"}).value().GetSession(kSession).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr("the session is at another server, mesh.example:7233"), HasSubstr("in plain text")));
}

std::shared_ptr<grpc::ServerCredentials> TlsOf(const server::CertificateFiles& files) {
  const auto read = [](const std::string& path) {
    std::ifstream file(path);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  grpc::SslServerCredentialsOptions options;
  options.pem_key_cert_pairs.push_back({read(files.key), read(files.certificate)});
  return grpc::SslServerCredentials(options);
}

// A server that is named has to show a certificate of the authorities that the first is believed for.
TEST(Connect, TrustsNoOneElseByTls) {
  const TemporaryFolder folder;
  const server::Authority authority(folder, "authority");
  const server::Authority stranger(folder, "stranger");
  const server::CertificateFiles files = authority.Issue("server");
  Replica trusted(Right, "127.0.0.1:0", TlsOf(files));
  Replica strange(Right, "127.0.0.1:0", TlsOf(stranger.Issue("strange")));
  Replica plain(Right);
  Replica first(SaysElsewhere(trusted.address()), "127.0.0.1:0", TlsOf(files));
  const ConnectOptions options = {.tls_ca = authority.certificate(), .token = "secret"};
  EXPECT_TRUE(Connect(first.address(), options).value().GetSession(kSession).ok());
  EXPECT_EQ(trusted.heard().back().authorization, "Bearer secret");
  CallOptions call;
  call.timeout = absl::Seconds(2);
  for (Replica* other : {&strange, &plain}) {
    first.Become(SaysElsewhere(other->address()));
    const absl::Status status = Connect(first.address(), options).value().GetSession(kSession, call).status();
    EXPECT_FALSE(status.ok());
    EXPECT_THAT(std::string(status.message()), HasSubstr(other->address()));
    EXPECT_EQ(other->NewCalls(), 0u);
  }
}

// The loopback of another machine is none of this one's.
TEST(Connect, FollowsNoOneToTheLoopbackFromElsewhere) {
  Replica second(Right);
  Replica first(SaysElsewhere(second.address()), "0.0.0.0:0");
  const absl::Status status = Connect(first.address("0.0.0.0")).value().GetSession(kSession).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("loopback"));
  EXPECT_EQ(second.NewCalls(), 0u);
}

TEST(Connect, FollowsNoOneWhereThatIsOff) {
  Replica second(Right);
  int left = 1;
  Replica first([&](const Heard& heard) {
    return left-- > 0 ? Answer{{}, Elsewhere(second.address())} : Right(heard);
  });
  ConnectOptions options;
  options.follow = false;
  EXPECT_TRUE(Connect(first.address(), options).value().GetSession(kSession).ok());
  EXPECT_EQ(first.NewCalls(), 2u);
  EXPECT_EQ(second.NewCalls(), 0u);
  EXPECT_EQ(first.heard().back().session, "one") << "a proxy wants it";
}

TEST(Connect, SaysWhereNobodyAnswers) {
  const ClosedPort closed;
  Replica first(SaysElsewhere(closed.address()));
  CallOptions call;
  call.timeout = absl::Seconds(1);
  const absl::Status status = Connect(first.address()).value().GetSession(kSession, call).status();
  EXPECT_THAT(std::string(status.message()), HasSubstr(closed.address()));
}

TEST(TargetOf, IsNoFile) {
  EXPECT_EQ(TargetOf("unix:7233"), "dns:///unix:7233");
  EXPECT_EQ(TargetOf("127.0.0.1:1"), "dns:///127.0.0.1:1");
  EXPECT_EQ(TargetOf("[::1]:1"), "[::1]:1");
}

// Behind the address may be another server by then.
TEST_F(ServersTest, ADrainIsAskedForOnce) {
  first_.Become([](const Heard&) { return Answer{{}, grpc::Status(grpc::StatusCode::UNAVAILABLE, "gone")}; });
  EXPECT_TRUE(absl::IsUnavailable(Client().DrainServer().status()));
  EXPECT_EQ(first_.heard().size(), 1);
  EXPECT_TRUE(absl::IsUnavailable(Client().GetUsage().status()));
  EXPECT_GT(first_.heard().size(), 2) << "other calls are repeated";
}

}  // namespace
}  // namespace wellspace::client
