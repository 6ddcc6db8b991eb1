// Every method of every service asks who calls, before anything else.
#include "server/security/authenticator.h"

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/raw_call.h"
#include "tests/server/raw_http2.h"
#include "tests/server/service_harness.h"
#include "tests/server/service_methods.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {
namespace {

using ::testing::Ge;
using ::testing::HasSubstr;
using ::testing::SizeIs;

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
  grpc::Status CallEmpty(const std::string& path) { return CallUnary(harness_.channel(), path, "").status; }

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
  ASSERT_THAT(ServiceMethods(), SizeIs(Ge(19)));
  for (const google::protobuf::MethodDescriptor* method : ServiceMethods()) {
    const grpc::Status status = CallEmpty(PathOf(*method));
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED)
        << method->full_name() << ": " << status.error_message();
    EXPECT_EQ(CallUnary(harness_.channel(), PathOf(*method), "no message").status.error_code(),
              grpc::StatusCode::UNAUTHENTICATED)
        << method->full_name();
  }
}

// A client that streams is told before it has sent anything, any other as soon as it has sent its one request.
TEST_F(TokensWanted, EveryMethodAsksBeforeAnythingElse) {
  for (const google::protobuf::MethodDescriptor* method : ServiceMethods()) {
    RawConnection connection(harness_.server().address());
    connection.Send(ConnectionStart());
    connection.Send(BeginCall(1, PathOf(*method)));
    if (!method->client_streaming()) {
      connection.Send(Frame{.type = Frame::kData, .flags = Frame::kEndStream, .stream = 1, .payload = GrpcMessage("")});
    }
    EXPECT_EQ(connection.ReadStatus(1), grpc::StatusCode::UNAUTHENTICATED) << method->full_name();
  }
}

TEST_F(TokensWanted, HealthIsForAll) { EXPECT_TRUE(CallEmpty("/grpc.health.v1.Health/Check").ok()); }

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

TEST(NoDemands, EveryCallerIsTheTenantDefault) {
  ServiceHarness harness;
  TestCall call(harness.stub());
  call.Send(UnitCubeParameters());
  call.HalfClose();
  EXPECT_TRUE(call.Finish().ok());
  EXPECT_TRUE(harness.log().WaitFor("tenant=default"));
}

}  // namespace
}  // namespace wellspace::server
