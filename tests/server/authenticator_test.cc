#include "server/authenticator.h"

#include <future>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "grpcpp/generic/generic_stub.h"
#include "gtest/gtest.h"
#include "tests/formats/temporary_folder.h"
#include "tests/server/service_harness.h"
#include "wellspace/v1/operations.pb.h"
#include "wellspace/v1/queries.pb.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

const std::string kToken(40, 'k');

// A server that wants tokens.
class TokensWanted : public ::testing::Test {
 protected:
  TokensWanted() : harness_(FakeMesher, {}, Transport::kLoopback, FakeEstimator, core::Mesher::Create, Security()) {}

  SecurityOptions Security() {
    SecurityOptions security;
    security.token_file = folder_.Write("tokens", *MakeTokenLine("acme", kToken));
    return security;
  }

  // GetServerInfo with these values of `authorization`.
  grpc::Status Call(const std::vector<std::string>& authorizations) {
    grpc::ClientContext context;
    for (const std::string& value : authorizations) {
      context.AddMetadata("authorization", value);
    }
    v1::GetServerInfoResponse response;
    return harness_.stub().GetServerInfo(&context, v1::GetServerInfoRequest(), &response);
  }

  // One empty message to any method, whatever its kind.
  grpc::Status CallEmpty(const std::string& path) {
    grpc::GenericStub stub(harness_.channel());
    grpc::ClientContext context;
    const grpc::Slice nothing("");
    const grpc::ByteBuffer request(&nothing, 1);
    grpc::ByteBuffer response;
    std::promise<grpc::Status> promise;
    stub.UnaryCall(&context, path, grpc::StubOptions(), &request, &response,
                   [&promise](grpc::Status status) { promise.set_value(std::move(status)); });
    return promise.get_future().get();
  }

  TemporaryFolder folder_;
  ServiceHarness harness_;
};

TEST_F(TokensWanted, TakesTheTokenThatItKnows) {
  EXPECT_TRUE(Call({"Bearer " + kToken}).ok());
  EXPECT_TRUE(Call({"bearer " + kToken}).ok());
}

TEST_F(TokensWanted, RefusesEverythingElse) {
  const std::vector<std::vector<std::string>> wrong = {{},
                                                       {""},
                                                       {"Bearer"},
                                                       {"Bearer "},
                                                       {kToken},
                                                       {"Basic " + kToken},
                                                       {"Bearer  " + kToken},
                                                       {"Bearer " + kToken + "k"},
                                                       {"Bearer " + kToken.substr(1)},
                                                       {"Bearer " + std::string(5000, 'k')},
                                                       {"Bearer " + kToken, "Bearer " + kToken}};
  for (const std::vector<std::string>& authorizations : wrong) {
    const grpc::Status status = Call(authorizations);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << authorizations.size();
    EXPECT_EQ(DetailsOf(status).reason, "UNAUTHENTICATED");
    EXPECT_EQ(status.error_message().find("kkk"), std::string::npos) << "the message repeats the token";
  }
  EXPECT_EQ(harness_.log().Count("kkk"), 0u);
}

TEST_F(TokensWanted, EveryMethodOfEveryServiceAsks) {
  int methods = 0;
  for (const google::protobuf::FileDescriptor* file :
       {v1::MeshPointsRequest::descriptor()->file(), v1::Session::descriptor()->file(),
        v1::Operation::descriptor()->file(), v1::VoronoiCellsRequest::descriptor()->file()}) {
    ASSERT_GE(file->service_count(), 1) << file->name();
    for (int i = 0; i < file->service_count(); ++i) {
      const google::protobuf::ServiceDescriptor* service = file->service(i);
      for (int j = 0; j < service->method_count(); ++j) {
        const std::string path = absl::StrCat("/", service->full_name(), "/", service->method(j)->name());
        const grpc::Status status = CallEmpty(path);
        EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED) << path << ": " << status.error_message();
        ++methods;
      }
    }
  }
  EXPECT_GE(methods, 19);
}

TEST_F(TokensWanted, HealthIsForEverybody) { EXPECT_TRUE(CallEmpty("/grpc.health.v1.Health/Check").ok()); }

TEST_F(TokensWanted, AStreamIsRefusedBeforeItHasSentAll) {
  TestCall call(harness_.stub());
  call.Send(UnitCubeParameters());
  const grpc::Status status = call.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_THAT(status.error_message(), HasSubstr("authorization"));
  EXPECT_TRUE(harness_.log().WaitFor("code=UNAUTHENTICATED"));
}

TEST_F(TokensWanted, TheLogKnowsTheTenantAndNotTheToken) {
  grpc::ClientContext context;
  context.AddMetadata("authorization", "Bearer " + kToken);
  v1::EstimateMeshResponse response;
  const auto stream = harness_.stub().EstimateMesh(&context, &response);
  v1::EstimateMeshRequest request;
  *request.mutable_parameters() = UnitCubeParameters();
  stream->Write(request);
  stream->WritesDone();
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_TRUE(harness_.log().WaitFor("tenant=acme"));
  EXPECT_EQ(harness_.log().Count("kkk"), 0u);
}

TEST(NoDemands, EverybodyIsTheTenantDefault) {
  ServiceHarness harness;
  TestCall call(harness.stub());
  call.Send(UnitCubeParameters());
  call.HalfClose();
  EXPECT_TRUE(call.Finish().ok());
  EXPECT_TRUE(harness.log().WaitFor("tenant=default"));
}

}  // namespace
}  // namespace wellspace::server
