// The real programs with TLS, certificates and tokens: what an operator and a user do, and what neither must be able
// to.
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/client/cli/process.h"
#include "tests/server/daemon.h"
#include "tests/server/security/certificates.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;

constexpr int kExitUnauthenticated = 6;
constexpr char kCloud[] = "x,y\n0,0\n1,0\n0.5,0.75\n";

std::string BinFolder() { return std::getenv("WELLSPACE_BIN_DIR"); }

class SecuredWellspaced : public ::testing::Test {
 protected:
  SecuredWellspaced() : authority_(folder_, "authority"), server_(authority_.Issue("server")) {}

  // Makes a random token as docs/security.md says, and returns the path of its file.
  std::string MakeToken(const std::string& name, const std::string& tenant) {
    const std::string file = folder_.Path(name);
    const std::string output = RunShell(absl::StrCat("openssl rand -hex 32 > ", file, " && ", BinFolder(),
                                                     "/wellspaced hash-token ", tenant, " < ", file, " >> ", Tokens()));
    EXPECT_EQ(output, "");
    return file;
  }
  std::string Tokens() const { return folder_.Path("tokens"); }

  std::vector<std::string> TlsFlags() const { return {"--tls-cert", server_.certificate, "--tls-key", server_.key}; }

  // `wellspace mesh` of a small cloud, at the server.
  RunResult Mesh(const Daemon& daemon, const std::vector<std::string>& flags,
                 const std::vector<std::string>& environment = {}) {
    std::vector<std::string> arguments = {
        "mesh", "-", "--input-format", "csv", "-o", folder_.Path("mesh.vtu"), "--server", daemon.address()};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return RunWellspace(arguments, {.input = kCloud, .environment = environment});
  }

  // The output of `openssl s_client` about the server.
  std::string SClient(const Daemon& daemon, const std::string& flags) const {
    return RunShell(absl::StrCat("openssl s_client -connect ", daemon.address(), " -CAfile ", authority_.certificate(),
                                 " ", flags, " < /dev/null"));
  }

  TemporaryFolder folder_;
  const Authority authority_;
  const CertificateFiles server_;
};

TEST_F(SecuredWellspaced, MeshesForThoseWhoHaveTheToken) {
  const std::string token = MakeToken("token", "acme");
  const std::string other = folder_.Write("other", std::string(64, 'f') + "\n");
  std::vector<std::string> flags = TlsFlags();
  flags.insert(flags.end(), {"--token-file", Tokens(), "--log-level", "debug"});
  const std::string log = folder_.Path("log");
  std::string secret = folder_.Read("token");
  secret.pop_back();
  {
    Daemon daemon(flags, log);
    const std::string& ca = authority_.certificate();
    RunResult run = Mesh(daemon, {"--tls-ca", ca, "--token-file", token});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    run = Mesh(daemon, {}, {"WELLSPACE_TLS_CA=" + ca, "WELLSPACE_TOKEN=" + secret});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    run = Mesh(daemon, {"--tls-ca", ca});
    EXPECT_EQ(run.exit_code, kExitUnauthenticated);
    EXPECT_THAT(run.err, HasSubstr("authorization: Bearer TOKEN"));
    run = Mesh(daemon, {"--tls-ca", ca, "--token-file", other});
    EXPECT_EQ(run.exit_code, kExitUnauthenticated);
    EXPECT_THAT(run.err, Not(HasSubstr("ffff")));
    run = Mesh(daemon, {"--tls", "--token-file", token});
    EXPECT_EQ(run.exit_code, kExitUnauthenticated);
    EXPECT_THAT(run.err, HasSubstr("certificate"));
    daemon.Stop();
  }
  const std::string lines = folder_.Read("log");
  EXPECT_THAT(lines, HasSubstr("acme"));
  EXPECT_THAT(lines, HasSubstr("UNAUTHENTICATED"));
  const std::string hash = folder_.Read("tokens").substr(std::string("acme sha256:").size(), 16);
  for (const std::string& hidden : {secret, std::string("ffff"), hash, std::string("PRIVATE")}) {
    EXPECT_THAT(lines, Not(HasSubstr(hidden)));
  }
}

TEST_F(SecuredWellspaced, MeshesForThoseWhoHaveACertificate) {
  std::vector<std::string> flags = TlsFlags();
  flags.insert(flags.end(), {"--tls-client-ca", authority_.certificate()});
  const CertificateFiles alice = authority_.Issue("alice", "alice");
  Daemon daemon(flags);
  const std::string& ca = authority_.certificate();
  RunResult run = Mesh(daemon, {"--tls-ca", ca, "--tls-cert", alice.certificate, "--tls-key", alice.key});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  run = Mesh(daemon, {"--tls-ca", ca});
  EXPECT_EQ(run.exit_code, kExitUnauthenticated);
  EXPECT_THAT(run.err, HasSubstr("client certificate"));
}

TEST_F(SecuredWellspaced, SpeaksModernTlsOnly) {
  Daemon daemon(TlsFlags());
  const auto connect = [&](const std::string& flags) { return SClient(daemon, "-brief " + flags); };
  for (const char* flags : {"-tls1_3", "-tls1_2", "-tls1_2 -cipher ECDHE+AESGCM"}) {
    const std::string output = connect(absl::StrCat(flags, " -alpn h2 -verify_return_error"));
    EXPECT_THAT(output, HasSubstr("CONNECTION ESTABLISHED")) << flags;
    EXPECT_THAT(output, HasSubstr("Verification: OK")) << flags;
  }
  EXPECT_THAT(connect("-tls1_3"), HasSubstr("TLSv1.3"));
  // SECLEVEL=0 has the client offer versions that its own defaults forbid.
  for (const char* flags :
       {"-tls1 -cipher ALL:@SECLEVEL=0", "-tls1_1 -cipher ALL:@SECLEVEL=0", "-tls1_2 -cipher AES128-SHA",
        "-tls1_2 -cipher AES128-GCM-SHA256", "-tls1_2 -cipher ECDHE-ECDSA-AES128-SHA",
        "-tls1_2 -cipher aNULL:@SECLEVEL=0", "-tls1_2 -cipher NULL:@SECLEVEL=0", "-tls1_2 -cipher 3DES:RC4:@SECLEVEL=0",
        "-tls1_2 -cipher DHE"}) {
    const std::string output = connect(flags);
    EXPECT_THAT(output, Not(HasSubstr("CONNECTION ESTABLISHED"))) << flags;
  }
}

TEST_F(SecuredWellspaced, AgreesOnHttp2AndNothingElse) {
  Daemon daemon(TlsFlags());
  for (const char* version : {"-tls1_2", "-tls1_3"}) {
    EXPECT_THAT(SClient(daemon, absl::StrCat(version, " -alpn http/1.1,h2")), HasSubstr("ALPN protocol: h2"));
    const std::string other = SClient(daemon, absl::StrCat(version, " -alpn http/1.1"));
    EXPECT_THAT(other, Not(HasSubstr("ALPN protocol"))) << version;
  }
}

TEST_F(SecuredWellspaced, TheHandshakeDemandsCertificatesIfAsked) {
  const CertificateFiles alice = authority_.Issue("alice", "alice");
  const CertificateFiles old = authority_.Issue("old", "alice", -1);
  const Authority stranger(folder_, "stranger");
  const CertificateFiles foreign = stranger.Issue("foreign", "alice");
  std::vector<std::string> flags = TlsFlags();
  flags.insert(flags.end(), {"--tls-client-ca", authority_.certificate(), "--tls-require-client-cert"});
  Daemon daemon(flags);
  // In TLS 1.2 a client learns during the handshake that it is refused.
  const auto connect = [&](const std::string& shown) { return SClient(daemon, "-brief -tls1_2 -alpn h2 " + shown); };
  const auto show = [](const CertificateFiles& files) {
    return absl::StrCat("-cert ", files.certificate, " -key ", files.key);
  };
  EXPECT_THAT(connect(show(alice)), HasSubstr("CONNECTION ESTABLISHED"));
  for (const std::string& shown : {std::string(), show(old), show(foreign)}) {
    EXPECT_THAT(connect(shown), Not(HasSubstr("CONNECTION ESTABLISHED"))) << shown;
  }
}

TEST_F(SecuredWellspaced, PlainTextOnTheLoopbackCanWantTokens) {
  const std::string token = MakeToken("token", "acme");
  Daemon daemon({"--token-file", Tokens()});
  EXPECT_EQ(Mesh(daemon, {"--token-file", token}).exit_code, 0);
  EXPECT_EQ(Mesh(daemon, {}).exit_code, kExitUnauthenticated);
}

TEST_F(SecuredWellspaced, AServerWithoutTlsIsToldFromOneThatIsAway) {
  Daemon daemon;
  const RunResult run = Mesh(daemon, {"--tls-ca", authority_.certificate()});
  EXPECT_EQ(run.exit_code, kExitUnauthenticated);
  EXPECT_THAT(run.err, HasSubstr("speaks no TLS"));
}

TEST_F(SecuredWellspaced, ATokenDoesNotLeaveTheMachineInPlainText) {
  const std::string token = MakeToken("token", "acme");
  const std::vector<std::string> info = {"server", "info", "--server", "192.0.2.1:7233", "--token-file", token};
  const RunResult run = RunWellspace(info, {});
  EXPECT_NE(run.exit_code, 0);
  EXPECT_THAT(run.err, HasSubstr("--insecure-remote"));
}

TEST_F(SecuredWellspaced, HashesTokens) {
  const std::string token = MakeToken("token", "acme");
  EXPECT_THAT(folder_.Read("tokens"), MatchesRegex("acme sha256:[0-9a-f]{64}\n"));
  const std::string weak =
      RunShell(absl::StrCat("echo hunter2 | ", BinFolder(), "/wellspaced hash-token acme; echo $?"));
  EXPECT_THAT(weak, HasSubstr("openssl rand"));
  EXPECT_THAT(weak, ::testing::EndsWith("\n2\n"));
  EXPECT_THAT(weak, Not(HasSubstr("hunter2")));
  const std::string lost = RunShell(absl::StrCat("echo 0123456789abcdef0123456789abcdef0123456789abcdef | ",
                                                 BinFolder(), "/wellspaced hash-token acme 2>&1 >/dev/full; echo $?"));
  EXPECT_EQ(lost, "wellspaced: the line could not be written to standard output\n1\n");
  EXPECT_EQ(Subprocess("wellspaced", {"hash-token"}).Wait(), 2);
}

TEST_F(SecuredWellspaced, FailsWhenWhatItPrintsGetsLost) {
  for (const char* option : {"--help", "--version"}) {
    EXPECT_EQ(RunShell(absl::StrCat(BinFolder(), "/wellspaced ", option, " 2>&1 >/dev/full; echo $?")),
              "wellspaced: the text could not be written to standard output\n1\n");
  }
}

TEST_F(SecuredWellspaced, DoesNotStartWithFilesThatDoNotFit) {
  const CertificateFiles other = authority_.Issue("other");
  EXPECT_EQ(Subprocess("wellspaced", {"--tls-cert", server_.certificate, "--tls-key", other.key}).Wait(), 1);
  EXPECT_EQ(Subprocess("wellspaced", {"--tls-cert", server_.certificate}).Wait(), 1);
  EXPECT_EQ(Subprocess("wellspaced", {"--token-file", server_.certificate}).Wait(), 1);
}

}  // namespace
}  // namespace wellspace::server
