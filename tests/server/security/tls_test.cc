// Certificates and keys that are taken, and what is said of the others.
#include "server/security/tls.h"

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/security/certificates.h"

namespace wellspace::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class ReadTlsFilesTest : public ::testing::Test {
 protected:
  ReadTlsFilesTest() : authority_(folder_, "authority"), server_(authority_.Issue("server")) {
    options_ = {
        .certificate = server_.certificate, .key = server_.key, .client_ca = "", .require_client_certificate = false};
  }

  void ExpectWrong(const std::string& file, const std::string& what) {
    const absl::Status status = ReadTlsFiles(options_).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr(file));
    EXPECT_THAT(std::string(status.message()), HasSubstr(what));
  }

  TemporaryFolder folder_;
  Authority authority_;
  CertificateFiles server_;
  TlsOptions options_;
};

TEST_F(ReadTlsFilesTest, TakesWhatFits) {
  EXPECT_TRUE(options_.enabled());
  EXPECT_EQ(ReadTlsFiles(options_).status(), absl::OkStatus());
  options_.client_ca = authority_.certificate();
  options_.require_client_certificate = true;
  EXPECT_EQ(ReadTlsFiles(options_).status(), absl::OkStatus());
  EXPECT_THAT(options_.Files(), ElementsAre(server_.certificate, server_.key, authority_.certificate()));
  EXPECT_FALSE(TlsOptions().enabled());
}

TEST_F(ReadTlsFilesTest, TakesAChain) {
  options_.certificate =
      folder_.Write("chain.pem", absl::StrCat(folder_.Read("server.pem"), folder_.Read("authority.pem")));
  EXPECT_EQ(ReadTlsFiles(options_).status(), absl::OkStatus());
}

TEST_F(ReadTlsFilesTest, MissesFiles) {
  options_.key = "";
  ExpectWrong("", "--tls-key");
  options_.key = folder_.Path("none.key");
  const absl::Status status = ReadTlsFiles(options_).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr(options_.key));
}

TEST_F(ReadTlsFilesTest, MissesTheAuthorityOfDemandedCertificates) {
  options_.require_client_certificate = true;
  ExpectWrong("", "--tls-client-ca");
}

TEST_F(ReadTlsFilesTest, SaysWhatIsNoCertificate) {
  options_.certificate = server_.key;
  ExpectWrong(server_.key, "expected certificates");
  options_.certificate = folder_.Write("cut.pem", folder_.Read("server.pem").substr(0, 200));
  ExpectWrong(options_.certificate, "expected certificates");
  options_.certificate = server_.certificate;
  options_.client_ca = folder_.Write("empty.pem", "");
  ExpectWrong(options_.client_ca, "expected certificates");
}

TEST_F(ReadTlsFilesTest, SaysWhatIsNoKey) {
  options_.key = server_.certificate;
  ExpectWrong(server_.certificate, "expected a private key");
  options_.key = folder_.Path("encrypted.key");
  RunShell(absl::StrCat("openssl ec -aes128 -passout pass:secret -in ", server_.key, " -out ", options_.key));
  ASSERT_THAT(folder_.Read("encrypted.key"), HasSubstr("BEGIN"));
  ExpectWrong(options_.key, "without a password");
}

TEST_F(ReadTlsFilesTest, SaysWhoseKeyItIsNot) {
  options_.key = authority_.Issue("other").key;
  ExpectWrong(options_.key, server_.certificate);
}

TEST_F(ReadTlsFilesTest, SaysWhatHasExpired) {
  const CertificateFiles old = authority_.Issue("old", "localhost", -1);
  options_.certificate = old.certificate;
  options_.key = old.key;
  ExpectWrong(old.certificate, "expired");
}

}  // namespace
}  // namespace wellspace::server
