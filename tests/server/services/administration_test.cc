// Administration over real connections: who may, and what it tells of all tenants.
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/client.h"
#include "client/error_details.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/service_harness.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

const std::string kAcme(40, 'a');
const std::string kBeta(40, 'b');
const std::string kOps(40, 'o');

SecurityOptions WithAdmin(TemporaryFolder& folder) {
  SecurityOptions security;
  security.token_file =
      folder.Write("tokens", absl::StrCat(*MakeTokenLine("acme", kAcme), "\n", *MakeTokenLine("beta", kBeta), "\n",
                                          *MakeTokenLine("ops", kOps, /*is_admin=*/true)));
  return security;
}

class AdminServiceTest : public ::testing::Test {
 protected:
  explicit AdminServiceTest(Mesher mesher = FakeMesher)
      : harness_(std::move(mesher), OptionsOf(*this), Transport::kLoopback, FakeEstimator, core::Mesher::Create,
                 WithAdmin(folder_)),
        acme_(ClientWith(kAcme)),
        beta_(ClientWith(kBeta)),
        ops_(ClientWith(kOps)) {}

  static ServiceOptions OptionsOf(AdminServiceTest& self) {
    ServiceOptions options;
    options.grace = absl::Seconds(7);
    options.begin_drain = [&self] { ++self.drains_; };
    return options;
  }

  client::Client ClientWith(const std::string& token) {
    return client::Connect(harness_.server().address(), {.token = token}).value();
  }

  // A session of three points that has been refined; returns its operation.
  static client::Operation Refined(client::Client& client) {
    client::SessionOptions options;
    options.parameters.dimension = 2;
    options.parameters.domain_low = {0, 0};
    options.parameters.domain_high = {1, 1};
    const std::string session = client.CreateSession(options).value().name;
    const std::vector<double> points = {0.25, 0.25, 0.75, 0.25, 0.5, 0.75};
    client::SpanSource source(2, points);
    EXPECT_TRUE(client.UploadPoints(session, source).ok());
    return client.WatchOperation(client.StartRefinement(session).value().name).value();
  }

  std::string Listed(const client::OperationFilter& filter) {
    std::vector<std::string> lines;
    client::PageOptions page{.page_size = 1, .page_token = ""};
    do {
      const client::OwnedOperationPage listed = ops_.ListAllOperations(filter, page).value();
      EXPECT_THAT(listed.operations, SizeIs(::testing::Le(1)));
      for (const client::OwnedOperation& one : listed.operations) {
        lines.push_back(absl::StrCat(one.tenant, " ", one.operation.name));
      }
      page.page_token = listed.next_page_token;
    } while (!page.page_token.empty());
    return absl::StrJoin(lines, "\n");
  }

  int drains_ = 0;
  TemporaryFolder folder_;
  ServiceHarness harness_;
  client::Client acme_;
  client::Client beta_;
  client::Client ops_;
};

TEST_F(AdminServiceTest, IsForAdminsAlone) {
  const std::string operation = Refined(acme_).name;
  for (const absl::Status& status :
       {acme_.ListAllOperations().status(), acme_.CancelAnyOperation(operation).status(), acme_.DrainServer().status(),
        acme_.GetUsage().status(), acme_.GetUsage({.tenant = "acme"}).status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied) << status;
    EXPECT_EQ(client::ReasonOf(status), "ERROR_REASON_ADMIN_ONLY");
    EXPECT_THAT(std::string(status.message()), HasSubstr("hash-token --admin"));
  }
  EXPECT_EQ(drains_, 0);
}

TEST(AdminService, IsRefusedToAllWhereNoTokensAre) {
  ServiceOptions options;
  options.begin_drain = [] { FAIL() << "it must not be drained"; };
  ServiceHarness harness(FakeMesher, options, Transport::kLoopback);
  client::Client client = client::Connect(harness.server().address()).value();
  EXPECT_EQ(client.DrainServer().status().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(client.GetUsage().status().code(), absl::StatusCode::kPermissionDenied);
}

TEST_F(AdminServiceTest, ListsTheOperationsOfAllTenants) {
  const std::string first = Refined(acme_).name;
  const std::string second = Refined(beta_).name;
  const std::string third = acme_.StartRefinement(first.substr(0, first.find("/operations"))).value().name;
  EXPECT_EQ(acme_.WatchOperation(third)->state, client::OperationState::kSucceeded);
  EXPECT_EQ(Listed({}), absl::StrCat("acme ", first, "\nacme ", third, "\nbeta ", second));
  EXPECT_EQ(Listed({.tenant = "beta"}), absl::StrCat("beta ", second));
  EXPECT_EQ(Listed({.tenant = "acme", .state = client::OperationState::kSucceeded}),
            absl::StrCat("acme ", first, "\nacme ", third));
  EXPECT_EQ(Listed({.state = client::OperationState::kFailed}), "");
  EXPECT_EQ(Listed({.tenant = "nobody"}), "");
}

TEST_F(AdminServiceTest, RefusesWrongFieldsByTheirNames) {
  const auto field = [](const absl::Status& status) {
    return absl::StrCat(client::ReasonOf(status), " ", std::string(status.message()).substr(0, 12));
  };
  constexpr char kInvalid[] = "ERROR_REASON_INVALID_REQUEST ";
  EXPECT_EQ(field(ops_.ListAllOperations({.tenant = "a/b"}).status()), absl::StrCat(kInvalid, "tenant is \"a"));
  EXPECT_EQ(field(ops_.ListAllOperations({}, {.page_size = 0, .page_token = ""}).status()),
            absl::StrCat(kInvalid, "page_size is"));
  EXPECT_EQ(field(ops_.ListAllOperations({}, {.page_size = {}, .page_token = "00"}).status()),
            absl::StrCat(kInvalid, "page_token w"));
  EXPECT_EQ(field(ops_.CancelAnyOperation("sessions/one").status()), absl::StrCat(kInvalid, "name: \"sessi"));
  for (const char* day : {"2026", "2026-02-30", "2026-1-1", "yesterday", "2026-01-01T00"}) {
    EXPECT_EQ(field(ops_.GetUsage({.first_day = day}).status()), absl::StrCat(kInvalid, "first_day is")) << day;
  }
  EXPECT_EQ(field(ops_.GetUsage({.last_day = "0"}).status()), absl::StrCat(kInvalid, "last_day is "));
}

TEST_F(AdminServiceTest, CancelsWhatHasEndedWithoutAnError) {
  const std::string operation = Refined(acme_).name;
  EXPECT_EQ(ops_.CancelAnyOperation(operation)->state, client::OperationState::kSucceeded);
  EXPECT_EQ(ops_.CancelAnyOperation(operation + "0").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ops_.CancelAnyOperation("sessions/none/operations/1").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(beta_.CancelOperation(operation).status().code(), absl::StatusCode::kNotFound) << "it is no one else's";
}

TEST_F(AdminServiceTest, BeginsToDrainOnce) {
  EXPECT_EQ(ops_.DrainServer().value(), absl::Seconds(7));
  EXPECT_EQ(ops_.DrainServer().value(), absl::Seconds(7));
  EXPECT_EQ(drains_, 1);
}

TEST_F(AdminServiceTest, TellsTheWorkAndTheBytesOfEachTenant) {
  EXPECT_THAT(ops_.GetUsage()->usage, SizeIs(0));
  const client::Operation first = Refined(acme_);
  const std::string session = first.name.substr(0, first.name.find("/operations"));
  client::UsagePage told = ops_.GetUsage().value();
  ASSERT_THAT(told.usage, SizeIs(1));
  EXPECT_EQ(told.usage[0].tenant, "acme");
  EXPECT_EQ(told.usage[0].meshes, 1u);
  EXPECT_EQ(told.usage[0].vertices, first.progress.vertices);
  EXPECT_GT(told.usage[0].processor_time, absl::ZeroDuration());
  EXPECT_EQ(told.usage[0].sessions, 1u);
  EXPECT_EQ(told.usage[0].stored_bytes, acme_.GetSession(session)->stored_bytes);
  // The next mesh has vertices that the first one has, and others.
  client::RefinementOptions finer;
  finer.parameters = acme_.GetSession(session)->parameters;
  finer.parameters->max_circumradius = 0.1;
  const client::Operation second = acme_.WatchOperation(acme_.StartRefinement(session, finer).value().name).value();
  ASSERT_GT(second.progress.vertices, first.progress.vertices);
  Refined(beta_);
  told = ops_.GetUsage({}, {.page_size = 1, .page_token = ""}).value();
  ASSERT_THAT(told.usage, SizeIs(1));
  EXPECT_EQ(told.usage[0].meshes, 2u);
  EXPECT_EQ(told.usage[0].vertices, second.progress.vertices) << "each is counted once";
  EXPECT_EQ(told.usage[0].stored_bytes, acme_.GetSession(session)->stored_bytes);
  told = ops_.GetUsage({}, {.page_size = 1, .page_token = told.next_page_token}).value();
  ASSERT_THAT(told.usage, SizeIs(1));
  EXPECT_EQ(told.usage[0].tenant, "beta");
  EXPECT_EQ(told.next_page_token, "");
  ASSERT_TRUE(acme_.DeleteSession(session).ok());
  told = ops_.GetUsage({.tenant = "acme"}).value();
  EXPECT_EQ(told.usage.at(0).meshes, 2u) << "work was done, whatever becomes of it";
  EXPECT_EQ(told.usage.at(0).stored_bytes, 0u);
  EXPECT_THAT(ops_.GetUsage({.tenant = "acme", .last_day = "2020-01-01"})->usage, SizeIs(0));
  EXPECT_THAT(ops_.GetUsage({.tenant = "acme", .first_day = "2020-01-01"})->usage, SizeIs(1));
}

}  // namespace
}  // namespace wellspace::server
