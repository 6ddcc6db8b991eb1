// Clients that are let in, over real connections, and changes of files under a running server.
#include "server/security/security.h"

#include <functional>
#include <utility>

#include "absl/time/clock.h"
#include "client/client.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/security/certificates.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

const std::string kToken(40, 'k');
const std::string kOtherToken(40, 'o');

// The end of a call by a client with `options`.
absl::Status Call(ServiceHarness& harness, const client::ConnectOptions& options) {
  absl::StatusOr<client::Client> client = client::Connect(harness.server().address(), options);
  return client.ok() ? client->EstimateMesh({}, {}).status() : client.status();
}

// Whether `done` becomes true within a minute of asking. The state that it asks for comes by itself, without any event.
bool Eventually(const std::function<bool()>& done) {
  const absl::Time end = absl::Now() + absl::Minutes(1);
  while (absl::Now() < end) {
    if (done()) {
      return true;
    }
  }
  return false;
}

class SecurityTest : public ::testing::Test {
 protected:
  void Start() {
    harness_ = std::make_unique<ServiceHarness>(FakeMesher, ServiceOptions(), Transport::kLoopback, FakeEstimator,
                                                core::Mesher::Create, security_);
  }

  // Certificates for a server and its clients.
  void UseTls(const Authority& authority) {
    const CertificateFiles server = authority.Issue("server");
    security_.tls.certificate = server.certificate;
    security_.tls.key = server.key;
  }

  void UseTokens(const std::string& lines) { security_.token_file = folder_.Write("tokens", lines); }

  void ReplaceTokens(const std::string& lines) {
    folder_.Write("tokens.new", lines);
    std::filesystem::rename(folder_.Path("tokens.new"), security_.token_file);
  }

  TemporaryFolder folder_;
  SecurityOptions security_;
  std::unique_ptr<ServiceHarness> harness_;
};

TEST_F(SecurityTest, TokensAreReadAgain) {
  security_.reload_interval = absl::Milliseconds(1);
  UseTokens(*MakeTokenLine("acme", kToken));
  Start();
  client::ConnectOptions options;
  options.token_file = folder_.Write("token", kToken + "\n");
  absl::StatusOr<client::Client> client = client::Connect(harness_->server().address(), options);
  ASSERT_TRUE(client.ok()) << client.status();
  EXPECT_TRUE(client->EstimateMesh({}, {}).ok());

  ReplaceTokens(*MakeTokenLine("beta", kOtherToken));
  ASSERT_TRUE(harness_->log().WaitFor("tokens=1 read again"));
  EXPECT_EQ(client->EstimateMesh({}, {}).status().code(), absl::StatusCode::kUnauthenticated);
  folder_.Write("token", kOtherToken + "\n");  // clients read theirs again, too
  EXPECT_TRUE(client->EstimateMesh({}, {}).ok());
  EXPECT_TRUE(harness_->log().WaitFor("tenant=beta"));

  // A bad file changes nothing, nor does a missing one.
  ReplaceTokens("beta " + kToken);
  ASSERT_TRUE(harness_->log().WaitFor("tokens stay as they were"));
  EXPECT_TRUE(client->EstimateMesh({}, {}).ok());
  std::filesystem::remove(security_.token_file);
  ASSERT_TRUE(harness_->log().WaitFor("tokens stay as they were", 2));
  EXPECT_TRUE(client->EstimateMesh({}, {}).ok());

  for (const char* secret : {"kkk", "ooo"}) {
    EXPECT_EQ(harness_->log().Count(secret), 0u);
  }
}

TEST_F(SecurityTest, TlsProvesTheServer) {
  const Authority authority(folder_, "authority");
  const Authority stranger(folder_, "stranger");
  UseTls(authority);
  Start();
  EXPECT_EQ(Call(*harness_, {.tls_ca = authority.certificate()}), absl::OkStatus());
  const absl::Status distrusted = Call(*harness_, {.tls_ca = stranger.certificate()});
  EXPECT_EQ(distrusted.code(), absl::StatusCode::kUnauthenticated);
  EXPECT_THAT(std::string(distrusted.message()), HasSubstr("certificate"));
  EXPECT_EQ(Call(*harness_, {.tls = true}).code(), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(Call(*harness_, {}).code(), absl::StatusCode::kUnavailable);
}

TEST_F(SecurityTest, TlsProvesTheServersName) {
  const Authority authority(folder_, "authority");
  UseTls(authority);
  // Of no name that a client can know it by.
  const std::string extensions = folder_.Write("other.ext", "subjectAltName=DNS:other.example\n");
  RunShell("openssl x509 -req -days 2 -in " + folder_.Path("server.csr") + " -CA " + authority.certificate() +
           " -CAkey " + folder_.Path("authority.key") + " -CAcreateserial -extfile " + extensions + " -out " +
           security_.tls.certificate);
  Start();
  EXPECT_FALSE(Call(*harness_, {.tls_ca = authority.certificate()}).ok());
}

TEST_F(SecurityTest, AClientCertificateNamesTheTenant) {
  const Authority authority(folder_, "authority");
  UseTls(authority);
  security_.tls.client_ca = authority.certificate();
  Start();
  const CertificateFiles alice = authority.Issue("alice", "alice@example.org");
  client::ConnectOptions options = {.tls_ca = authority.certificate()};
  const absl::Status nameless = Call(*harness_, options);
  EXPECT_EQ(nameless.code(), absl::StatusCode::kUnauthenticated);
  EXPECT_THAT(std::string(nameless.message()), HasSubstr("client certificate"));

  options.tls_certificate = alice.certificate;
  options.tls_key = alice.key;
  EXPECT_EQ(Call(*harness_, options), absl::OkStatus());
  EXPECT_TRUE(harness_->log().WaitFor("tenant=alice@example.org"));

  const CertificateFiles spaces = authority.Issue("spaces", "alice tenant=bob");
  options.tls_certificate = spaces.certificate;
  options.tls_key = spaces.key;
  EXPECT_EQ(Call(*harness_, options).code(), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(harness_->log().Count("tenant=bob"), 0u);
}

TEST_F(SecurityTest, CertificatesThatDoNotHoldAreRefusedInTheHandshake) {
  const Authority authority(folder_, "authority");
  const Authority stranger(folder_, "stranger");
  UseTls(authority);
  security_.tls.client_ca = authority.certificate();
  Start();
  for (const CertificateFiles& files : {stranger.Issue("foreign", "alice"), authority.Issue("old", "alice", -1)}) {
    const absl::Status status = Call(
        *harness_, {.tls_ca = authority.certificate(), .tls_certificate = files.certificate, .tls_key = files.key});
    EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
  }
  EXPECT_EQ(harness_->log().Count("tenant=alice"), 0u);
}

TEST_F(SecurityTest, TheHandshakeCanDemandCertificates) {
  const Authority authority(folder_, "authority");
  UseTls(authority);
  security_.tls.client_ca = authority.certificate();
  security_.tls.require_client_certificate = true;
  Start();
  EXPECT_EQ(Call(*harness_, {.tls_ca = authority.certificate()}).code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(harness_->log().Count("method="), 0u);  // it did not come that far
  const CertificateFiles alice = authority.Issue("alice", "alice");
  EXPECT_EQ(
      Call(*harness_, {.tls_ca = authority.certificate(), .tls_certificate = alice.certificate, .tls_key = alice.key}),
      absl::OkStatus());
}

TEST_F(SecurityTest, WithBothTheTokenNamesTheTenant) {
  const Authority authority(folder_, "authority");
  UseTls(authority);
  UseTokens(*MakeTokenLine("acme", kToken));
  security_.tls.client_ca = authority.certificate();
  Start();
  const CertificateFiles alice = authority.Issue("alice", "alice");
  client::ConnectOptions options = {.tls_ca = authority.certificate(), .token = kToken};
  EXPECT_EQ(Call(*harness_, options).code(), absl::StatusCode::kUnauthenticated);
  options.tls_certificate = alice.certificate;
  options.tls_key = alice.key;
  EXPECT_EQ(Call(*harness_, options), absl::OkStatus());
  EXPECT_TRUE(harness_->log().WaitFor("tenant=acme"));
  options.token = kOtherToken;
  EXPECT_EQ(Call(*harness_, options).code(), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(harness_->log().Count("tenant=alice"), 0u);
}

TEST_F(SecurityTest, CertificatesAreReadAgain) {
  const Authority before(folder_, "before");
  const Authority after(folder_, "after");
  UseTls(before);
  const CertificateFiles next = after.Issue("next");
  Start();
  absl::StatusOr<client::Client> client =
      client::Connect(harness_->server().address(), {.tls_ca = before.certificate()});
  ASSERT_TRUE(client->EstimateMesh({}, {}).ok());
  Replace(next.key, security_.tls.key);
  Replace(next.certificate, security_.tls.certificate);
  EXPECT_TRUE(Eventually([&] { return Call(*harness_, {.tls_ca = after.certificate()}).ok(); }));
  EXPECT_EQ(Call(*harness_, {.tls_ca = before.certificate()}).code(), absl::StatusCode::kUnauthenticated);
  EXPECT_TRUE(client->EstimateMesh({}, {}).ok()) << "a connection that was there has gone";
  EXPECT_TRUE(harness_->log().WaitFor("certificates read again"));
}

TEST_F(SecurityTest, AuthoritiesOfClientsAreReadAgain) {
  const Authority before(folder_, "before");
  const Authority after(folder_, "after");
  UseTls(before);
  security_.tls.client_ca = folder_.Path("clients.pem");
  Replace(before.certificate(), security_.tls.client_ca);
  security_.max_connection_age = absl::Milliseconds(200);
  Start();
  const CertificateFiles alice = before.Issue("alice", "alice");
  const CertificateFiles bob = after.Issue("bob", "bob");
  const client::ConnectOptions as_alice = {
      .tls_ca = before.certificate(), .tls_certificate = alice.certificate, .tls_key = alice.key};
  const client::ConnectOptions as_bob = {
      .tls_ca = before.certificate(), .tls_certificate = bob.certificate, .tls_key = bob.key};
  absl::StatusOr<client::Client> client = client::Connect(harness_->server().address(), as_alice);
  ASSERT_TRUE(client->EstimateMesh({}, {}).ok());
  EXPECT_FALSE(Call(*harness_, as_bob).ok());
  Replace(after.certificate(), security_.tls.client_ca);
  EXPECT_TRUE(Eventually([&] { return Call(*harness_, as_bob).ok(); }));
  EXPECT_FALSE(Call(*harness_, as_alice).ok());
  // Connections that were there get too old.
  EXPECT_TRUE(Eventually([&] { return !client->EstimateMesh({}, {}).ok(); }));
}

// Whatever is wrong with them, and in whatever order they come.
TEST_F(SecurityTest, BrokenFilesLeaveThePairThatWorksInUse) {
  const Authority authority(folder_, "authority");
  const Authority after(folder_, "after");
  UseTls(authority);
  security_.tls.client_ca = folder_.Path("clients.pem");
  Replace(authority.certificate(), security_.tls.client_ca);
  security_.reload_interval = absl::Milliseconds(1);
  const CertificateFiles alice = authority.Issue("alice", "alice");
  const CertificateFiles next = after.Issue("next");
  const client::ConnectOptions as_alice = {
      .tls_ca = authority.certificate(), .tls_certificate = alice.certificate, .tls_key = alice.key};
  Start();
  size_t count = 0;
  const auto expect_served = [&](const std::string& what) {
    ASSERT_TRUE(harness_->log().WaitFor("certificates stay as they were", ++count)) << what;
    EXPECT_EQ(Call(*harness_, as_alice), absl::OkStatus()) << what;
  };
  const std::string certificate = folder_.Read("server.pem");
  Replace(folder_.Write("empty", ""), security_.tls.certificate);
  expect_served("no certificate");
  Replace(folder_.Write("cut", certificate.substr(0, certificate.size() / 2)), security_.tls.certificate);
  expect_served("half a certificate");
  Replace(folder_.Write("zero", certificate + std::string(1, '\0') + certificate), security_.tls.certificate);
  expect_served("a zero byte");
  Replace(authority.Issue("old", "localhost", -1).certificate, security_.tls.certificate);
  expect_served("an expired certificate");
  Replace(next.certificate, security_.tls.certificate);
  expect_served("the next certificate without its key");
  Replace(folder_.Write("nonsense", "nonsense"), security_.tls.client_ca);
  expect_served("no authority");
  std::filesystem::remove(security_.tls.key);
  expect_served("no key");
  Replace(after.certificate(), security_.tls.client_ca);
  expect_served("still no key");
  // All of them right: these are in use from now on.
  Replace(next.key, security_.tls.key);
  ASSERT_TRUE(harness_->log().WaitFor("certificates read again"));
  EXPECT_FALSE(Call(*harness_, as_alice).ok());
  const CertificateFiles bob = after.Issue("bob", "bob");
  EXPECT_EQ(Call(*harness_, {.tls_ca = after.certificate(), .tls_certificate = bob.certificate, .tls_key = bob.key}),
            absl::OkStatus());
}

TEST_F(SecurityTest, SaysInTheLogWhichFilesDoNotFit) {
  const Authority authority(folder_, "authority");
  UseTls(authority);
  security_.reload_interval = absl::Milliseconds(1);
  Start();
  Replace(folder_.Path("authority.key"), security_.tls.key);
  EXPECT_TRUE(harness_->log().WaitFor("put right: " + security_.tls.key + ": not the key of"));
}

absl::Status StartOnAllAddresses(const SecurityOptions& security) {
  ServerOptions options;
  options.listen = "0.0.0.0:0";
  options.security = security;
  return Server::Start(options, std::make_shared<spdlog::logger>("none")).status();
}

TEST_F(SecurityTest, RemoteListenersNeedTlsAndADemandOnCallers) {
  const Authority authority(folder_, "authority");
  UseTokens(*MakeTokenLine("acme", kToken));
  absl::Status status = StartOnAllAddresses(security_);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("--tls-cert"));

  UseTls(authority);
  EXPECT_EQ(StartOnAllAddresses(security_), absl::OkStatus());
  security_.token_file = "";
  status = StartOnAllAddresses(security_);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("--token-file"));

  security_.tls.client_ca = authority.certificate();
  EXPECT_EQ(StartOnAllAddresses(security_), absl::OkStatus());
  SecurityOptions insecure;
  insecure.insecure_remote = true;
  EXPECT_EQ(StartOnAllAddresses(insecure), absl::OkStatus());
}

TEST_F(SecurityTest, DoesNotStartWithWrongFiles) {
  UseTokens("nonsense");
  absl::Status status = StartOnAllAddresses(security_);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr(security_.token_file + ": line 1"));
  security_.token_file = folder_.Path("none");
  EXPECT_EQ(StartOnAllAddresses(security_).code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace wellspace::server
