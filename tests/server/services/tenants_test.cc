// Tenants and each other's sessions, over real connections.
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/time/clock.h"
#include "client/client.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/raw_call.h"
#include "tests/server/service_harness.h"
#include "tests/support/temporary_folder.h"
#include "wellspace/v1/operations.grpc.pb.h"
#include "wellspace/v1/queries.pb.h"
#include "wellspace/v1/sessions.grpc.pb.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

const std::string kAcme(40, 'a');
const std::string kBeta(40, 'b');

// That there are the tenants acme and beta.
SecurityOptions TwoTenants(TemporaryFolder& folder) {
  SecurityOptions security;
  security.token_file =
      folder.Write("tokens", absl::StrCat(*MakeTokenLine("acme", kAcme), "\n", *MakeTokenLine("beta", kBeta)));
  return security;
}

// A server with two tenants, of whom acme has a session with a mesh.
class TenantsTest : public ::testing::Test {
 protected:
  TenantsTest()
      : harness_(FakeMesher, {}, Transport::kLoopback, FakeEstimator, core::Mesher::Create, TwoTenants(folder_)),
        acme_(ClientWith(kAcme)),
        beta_(ClientWith(kBeta)) {
    session_ = acme_.CreateSession(Options(), First()).value().name;
    const std::vector<double> points = {0.25, 0.25, 0.75, 0.25, 0.5, 0.75};
    client::SpanSource source(2, points);
    EXPECT_TRUE(acme_.UploadPoints(session_, source).ok());
    operation_ = acme_.StartRefinement(session_).value().name;
    EXPECT_EQ(acme_.WatchOperation(operation_).value().state, client::OperationState::kSucceeded);
  }

  static client::SessionOptions Options() {
    client::SessionOptions options;
    options.parameters.dimension = 2;
    options.parameters.domain_low = {0, 0};
    options.parameters.domain_high = {1, 1};
    options.labels = {{"project", "secret"}};
    return options;
  }

  static client::CallOptions First() {
    client::CallOptions call;
    call.request_id = "first";
    return call;
  }

  client::Client ClientWith(const std::string& token) {
    return client::Connect(harness_.server().address(), {.token = token}).value();
  }

  // The end of one call of `method` about `name` by beta.
  grpc::Status CallAsBeta(const google::protobuf::MethodDescriptor& method, const std::string& name) {
    const std::unique_ptr<google::protobuf::Message> request(
        google::protobuf::MessageFactory::generated_factory()->GetPrototype(method.input_type())->New());
    SetName(*request, name);
    // These are looked at before the name.
    if (const auto* beta = request->GetDescriptor()->FindFieldByName("beta"); beta != nullptr) {
      request->GetReflection()->SetDouble(request.get(), beta, 1);
    }
    if (auto* transfer = dynamic_cast<v1::TransferValuesRequest*>(request.get()); transfer != nullptr) {
      transfer->mutable_start()->set_from_revision(1);
      transfer->mutable_start()->set_place(v1::FIELD_PLACE_VERTICES);
    }
    grpc::ClientContext context;
    context.AddMetadata("authorization", "Bearer " + kBeta);
    const std::string path = absl::StrCat("/", method.service()->full_name(), "/", method.name());
    return CallUnary(harness_.channel(), path, request->SerializeAsString(), context).status;
  }

  // Puts `name` into the request's field for the name.
  static void SetName(google::protobuf::Message& request, const std::string& name) {
    const google::protobuf::Reflection& reflection = *request.GetReflection();
    for (const char* field_name : {"name", "parent"}) {
      if (const auto* field = request.GetDescriptor()->FindFieldByName(field_name); field != nullptr) {
        reflection.SetString(&request, field, name);
        return;
      }
    }
    for (const char* field_name : {"session", "start"}) {
      if (const auto* field = request.GetDescriptor()->FindFieldByName(field_name); field != nullptr) {
        SetName(*reflection.MutableMessage(&request, field), name);
        return;
      }
    }
    FAIL() << request.GetDescriptor()->full_name();
  }

  // All methods that are about a session or an operation.
  static std::vector<const google::protobuf::MethodDescriptor*> Methods() {
    std::vector<const google::protobuf::MethodDescriptor*> methods;
    for (const google::protobuf::FileDescriptor* file :
         {v1::Session::descriptor()->file(), v1::Operation::descriptor()->file(),
          v1::VoronoiCellsRequest::descriptor()->file()}) {
      for (int i = 0; i < file->service(0)->method_count(); ++i) {
        const google::protobuf::MethodDescriptor* method = file->service(0)->method(i);
        if (method->name() != "CreateSession" && method->name() != "ListSessions") {
          methods.push_back(method);
        }
      }
    }
    return methods;
  }

  const std::string& NameFor(const google::protobuf::MethodDescriptor& method) const {
    return absl::EndsWith(method.name(), "Operation") ? operation_ : session_;
  }

  TemporaryFolder folder_;
  ServiceHarness harness_;
  client::Client acme_;
  client::Client beta_;
  std::string session_;
  std::string operation_;
};

// A name of the same form that no session has.
std::string Unused(std::string name) {
  char& letter = name[std::string("sessions/").size()];
  letter = letter == 'a' ? 'b' : 'a';
  return name;
}

TEST_F(TenantsTest, AnothersSessionIsAsIfThereWereNone) {
  const client::Session before = acme_.GetSession(session_).value();
  ASSERT_THAT(Methods(), SizeIs(20));
  for (const google::protobuf::MethodDescriptor* method : Methods()) {
    const std::string& name = NameFor(*method);
    const std::string unused = Unused(name);
    const grpc::Status status = CallAsBeta(*method, name);
    const grpc::Status none = CallAsBeta(*method, unused);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND)
        << method->full_name() << ": " << status.error_message();
    EXPECT_EQ(none.error_code(), status.error_code()) << method->full_name();
    EXPECT_EQ(absl::StrReplaceAll(none.error_message(), {{Unused(session_), session_}}), status.error_message());
    EXPECT_EQ(DetailsOf(status).reason, DetailsOf(none).reason);
  }
  const client::Session after = acme_.GetSession(session_).value();
  EXPECT_EQ(after.revision, before.revision);
  EXPECT_EQ(after.labels, before.labels);
  EXPECT_EQ(after.last_operation, before.last_operation);
  EXPECT_EQ(after.state, client::SessionState::kReady);
  EXPECT_TRUE(acme_.GetOperation(operation_).ok());
  EXPECT_EQ(acme_.DeleteSession(session_), absl::OkStatus());
}

TEST_F(TenantsTest, ListsHaveOnlyOnesOwn) {
  ASSERT_TRUE(acme_.CreateSession(Options()).ok());
  const client::SessionPage first = acme_.ListSessions({}, {.page_size = 1, .page_token = ""}).value();
  ASSERT_THAT(first.sessions, SizeIs(1));
  ASSERT_THAT(first.next_page_token, Not(IsEmpty()));
  EXPECT_THAT(beta_.ListSessions()->sessions, IsEmpty());
  EXPECT_THAT(beta_.ListSessions({{"project", "secret"}})->sessions, IsEmpty());
  // Another's place in a list leads to nothing.
  const absl::StatusOr<client::SessionPage> page =
      beta_.ListSessions({}, {.page_size = 1, .page_token = first.next_page_token});
  EXPECT_TRUE(!page.ok() || page->sessions.empty());
}

TEST_F(TenantsTest, RequestIdsAreOnesOwn) {
  const absl::StatusOr<client::Session> theirs = beta_.CreateSession(Options(), First());
  ASSERT_TRUE(theirs.ok()) << theirs.status();
  EXPECT_NE(theirs->name, session_);
  EXPECT_EQ(acme_.CreateSession(Options(), First())->name, session_);
  EXPECT_EQ(acme_.GetSession(theirs->name).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(TenantsTest, NamesHaveNothingInCommon) {
  const std::string other = acme_.CreateSession(Options()).value().name;
  const size_t prefix = std::string("sessions/").size();
  const std::string a = session_.substr(prefix);
  const std::string b = other.substr(prefix);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_GE(a.size(), 16u);
  int equal = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    equal += a[i] == b[i] ? 1 : 0;
  }
  EXPECT_LE(equal, static_cast<int>(a.size()) / 2);
}

// A server whose tenants may have two sessions, five points and one job each.
class QuotasTest : public ::testing::Test {
 protected:
  static ServiceOptions Options() {
    ServiceOptions options;
    options.workers = 2;
    options.max_sessions_per_tenant = 2;
    options.max_points_per_tenant = 5;
    options.max_jobs_per_tenant = 1;
    return options;
  }

  static std::unique_ptr<grpc::ClientContext> Showing(const std::string& token) {
    auto context = std::make_unique<grpc::ClientContext>();
    context->AddMetadata("authorization", "Bearer " + token);
    return context;
  }

  grpc::Status Create(const std::string& token, std::string* name) {
    v1::CreateSessionRequest request;
    *request.mutable_parameters() = UnitCubeParameters(2);
    v1::CreateSessionResponse response;
    const grpc::Status status = sessions_->CreateSession(Showing(token).get(), request, &response);
    *name = response.session().name();
    return status;
  }

  // Three points more.
  grpc::Status Upload(const std::string& token, const std::string& name) {
    const std::unique_ptr<grpc::ClientContext> context = Showing(token);
    v1::UploadPointsResponse response;
    const auto writer = sessions_->UploadPoints(context.get(), &response);
    v1::UploadPointsRequest request;
    request.set_name(name);
    for (const double x : {0.25, 0.25, 0.75, 0.25, 0.5, 0.75}) {
      request.mutable_points()->add_coordinates(x);
    }
    writer->Write(request);
    writer->WritesDone();
    return writer->Finish();
  }

  grpc::Status Start(const std::string& token, const std::string& name) {
    v1::StartRefinementRequest request;
    request.set_name(name);
    v1::StartRefinementResponse response;
    return operations_->StartRefinement(Showing(token).get(), request, &response);
  }

  static void ExpectQuota(const grpc::Status& status, const std::string& figures) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(DetailsOf(status).reason, "QUOTA_EXCEEDED") << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(figures));
  }
  static void ExpectServed(const grpc::Status& status) { EXPECT_TRUE(status.ok()) << status.error_message(); }

  TemporaryFolder folder_;
  Event started_;
  ServiceHarness harness_{EndlessMesher(started_), Options(),          Transport::kLoopback, FakeEstimator,
                          core::Mesher::Create,    TwoTenants(folder_)};
  const std::unique_ptr<v1::SessionService::Stub> sessions_ = v1::SessionService::NewStub(harness_.channel());
  const std::unique_ptr<v1::OperationService::Stub> operations_ = v1::OperationService::NewStub(harness_.channel());
};

TEST_F(QuotasTest, OfSessionsAreATenantsOwn) {
  std::string name;
  ExpectServed(Create(kAcme, &name));
  ExpectServed(Create(kAcme, &name));
  ExpectQuota(Create(kAcme, &name), "you have 2 sessions, and may have at most 2");
  ExpectServed(Create(kBeta, &name));
}

TEST_F(QuotasTest, OfPointsAreATenantsOwn) {
  std::string of_acme;
  std::string other_of_acme;
  std::string of_beta;
  ExpectServed(Create(kAcme, &of_acme));
  ExpectServed(Create(kAcme, &other_of_acme));
  ExpectServed(Create(kBeta, &of_beta));
  ExpectServed(Upload(kAcme, of_acme));
  ExpectQuota(Upload(kAcme, other_of_acme), "would have 6 points together; they may have at most 5");
  ExpectServed(Upload(kBeta, of_beta));
}

TEST_F(QuotasTest, OfJobsAreATenantsOwn) {
  std::string of_acme;
  std::string of_beta;
  ExpectServed(Create(kAcme, &of_acme));
  ExpectServed(Create(kBeta, &of_beta));
  TestCall running(harness_.stub(), std::nullopt, kAcme);
  running.Send(UnitCubeParameters());
  running.HalfClose();
  ASSERT_TRUE(started_.Wait());
  ExpectQuota(Start(kAcme, of_acme), "1 jobs of this tenant run or are in line; it may have 1");
  TestCall another(harness_.stub(), std::nullopt, kAcme);
  another.Send(UnitCubeParameters());
  another.HalfClose();
  ExpectQuota(another.Finish(), "1 jobs of this tenant run or are in line; it may have 1");
  ExpectServed(Start(kBeta, of_beta));
  v1::GetSessionRequest request;
  request.set_name(of_beta);
  v1::GetSessionResponse response;
  const absl::Time end = absl::Now() + absl::Minutes(1);
  do {  // while acme's job runs
    ExpectServed(sessions_->GetSession(Showing(kBeta).get(), request, &response));
  } while (response.session().state() != v1::Session::STATE_READY && absl::Now() < end);
  EXPECT_EQ(response.session().state(), v1::Session::STATE_READY);
}

}  // namespace
}  // namespace wellspace::server
