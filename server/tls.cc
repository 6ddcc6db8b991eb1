#include "server/tls.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <algorithm>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "grpcpp/security/tls_certificate_provider.h"
#include "grpcpp/security/tls_certificate_verifier.h"
#include "grpcpp/security/tls_credentials_options.h"
#include "server/file_watch.h"

namespace wellspace::server {
namespace {

template <typename T, void (*kFree)(T*)>
struct Free {
  void operator()(T* object) const { kFree(object); }
};
using Certificate = std::unique_ptr<X509, Free<X509, X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Free<EVP_PKEY, EVP_PKEY_free>>;
using Bio = std::unique_ptr<BIO, Free<BIO, BIO_free_all>>;

// An encrypted key is not asked for its password on the terminal.
int NoPassword(char* /*buffer*/, int /*size*/, int /*writes*/, void* /*unused*/) { return -1; }

absl::Status Wrong(const std::string& path, const std::string& what) {
  ERR_clear_error();
  return absl::InvalidArgumentError(absl::StrCat(path, ": ", what));
}

// All certificates of a file, at least one.
absl::StatusOr<std::vector<Certificate>> ReadCertificates(const std::string& path) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::string content, ReadFile(path));
  const Bio bio(BIO_new_mem_buf(content.data(), static_cast<int>(content.size())));
  std::vector<Certificate> certificates;
  while (X509* certificate = PEM_read_bio_X509(bio.get(), nullptr, NoPassword, nullptr)) {
    certificates.emplace_back(certificate);
  }
  const bool at_end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
  if (certificates.empty() || !at_end) {
    return Wrong(path, "expected certificates in PEM");
  }
  ERR_clear_error();
  return certificates;
}

absl::StatusOr<Key> ReadKey(const std::string& path) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::string content, ReadFile(path));
  const Bio bio(BIO_new_mem_buf(content.data(), static_cast<int>(content.size())));
  Key key(PEM_read_bio_PrivateKey(bio.get(), nullptr, NoPassword, nullptr));
  if (key == nullptr) {
    return Wrong(path, "expected a private key in PEM, without a password");
  }
  return key;
}

absl::Status CheckDates(const std::string& path, const X509& certificate) {
  if (X509_cmp_current_time(X509_get0_notBefore(&certificate)) > 0) {
    return Wrong(path, "the certificate is not valid yet");
  }
  if (X509_cmp_current_time(X509_get0_notAfter(&certificate)) < 0) {
    return Wrong(path, "the certificate has expired");
  }
  return absl::OkStatus();
}

}  // namespace

std::vector<std::string> TlsOptions::Files() const {
  std::vector<std::string> files;
  for (const std::string& file : {certificate, key, client_ca}) {
    if (!file.empty()) {
      files.push_back(file);
    }
  }
  return files;
}

absl::Status CheckTlsFiles(const TlsOptions& options) {
  if (options.certificate.empty() || options.key.empty()) {
    return absl::InvalidArgumentError("TLS wants both --tls-cert and --tls-key");
  }
  if (options.require_client_certificate && options.client_ca.empty()) {
    return absl::InvalidArgumentError("--tls-require-client-cert wants --tls-client-ca");
  }
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<Certificate> chain, ReadCertificates(options.certificate));
  WELLSPACE_RETURN_IF_ERROR(CheckDates(options.certificate, *chain.front()));
  WELLSPACE_ASSIGN_OR_RETURN(const Key key, ReadKey(options.key));
  if (X509_check_private_key(chain.front().get(), key.get()) != 1) {
    return Wrong(options.key, absl::StrCat("not the key of the first certificate in ", options.certificate));
  }
  if (!options.client_ca.empty()) {
    WELLSPACE_RETURN_IF_ERROR(ReadCertificates(options.client_ca).status());
  }
  return absl::OkStatus();
}

std::shared_ptr<grpc::ServerCredentials> MakeTlsCredentials(const TlsOptions& options, absl::Duration reload_interval) {
  using grpc::experimental::FileWatcherCertificateProvider;
  const auto seconds = static_cast<unsigned>(std::max<int64_t>(1, absl::ToInt64Seconds(reload_interval)));
  grpc::experimental::TlsServerCredentialsOptions credentials(
      std::make_shared<FileWatcherCertificateProvider>(options.key, options.certificate, options.client_ca, seconds));
  credentials.watch_identity_key_cert_pairs();
  credentials.set_cert_request_type(GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE);
  if (!options.client_ca.empty()) {
    credentials.watch_root_certs();
    credentials.set_cert_request_type(options.require_client_certificate
                                          ? GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY
                                          : GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  // The chain is verified by the handshake; a client has no host name to compare with.
  credentials.set_certificate_verifier(std::make_shared<grpc::experimental::NoOpCertificateVerifier>());
  credentials.set_check_call_host(false);
  return grpc::experimental::TlsServerCredentials(credentials);
}

}  // namespace wellspace::server
