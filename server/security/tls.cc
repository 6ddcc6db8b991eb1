#include "server/security/tls.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "grpc/grpc.h"
#include "grpc/grpc_security.h"
#include "server/security/file_watch.h"

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

// The content of a file in PEM. gRPC takes it as a C string, and would leave out what stands behind a zero byte.
absl::StatusOr<std::string> ReadPem(const std::string& path) {
  WELLSPACE_ASSIGN_OR_RETURN(std::string content, ReadFile(path));
  if (content.find('\0') != std::string::npos) {
    return Wrong(path, "expected PEM, which is text; the file has a zero byte");
  }
  return content;
}

// All certificates of the file at `path`, at least one.
absl::StatusOr<std::vector<Certificate>> ParseCertificates(const std::string& path, const std::string& content) {
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

absl::StatusOr<Key> ParseKey(const std::string& path, const std::string& content) {
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

absl::StatusOr<TlsMaterial> ReadTlsFiles(const TlsOptions& options) {
  if (options.certificate.empty() || options.key.empty()) {
    return absl::InvalidArgumentError("TLS wants both --tls-cert and --tls-key");
  }
  if (options.require_client_certificate && options.client_ca.empty()) {
    return absl::InvalidArgumentError("--tls-require-client-cert wants --tls-client-ca");
  }
  TlsMaterial material;
  WELLSPACE_ASSIGN_OR_RETURN(material.certificate, ReadPem(options.certificate));
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<Certificate> chain,
                             ParseCertificates(options.certificate, material.certificate));
  WELLSPACE_RETURN_IF_ERROR(CheckDates(options.certificate, *chain.front()));
  WELLSPACE_ASSIGN_OR_RETURN(material.key, ReadPem(options.key));
  WELLSPACE_ASSIGN_OR_RETURN(const Key key, ParseKey(options.key, material.key));
  if (X509_check_private_key(chain.front().get(), key.get()) != 1) {
    return Wrong(options.key, absl::StrCat("not the key of the first certificate in ", options.certificate));
  }
  if (!options.client_ca.empty()) {
    WELLSPACE_ASSIGN_OR_RETURN(material.client_ca, ReadPem(options.client_ca));
    WELLSPACE_RETURN_IF_ERROR(ParseCertificates(options.client_ca, material.client_ca).status());
  }
  return material;
}

std::shared_ptr<const TlsMaterial> TlsSource::Get() const {
  std::lock_guard lock(mutex_);
  return material_;
}

void TlsSource::Set(TlsMaterial material) {
  std::lock_guard lock(mutex_);
  material_ = std::make_shared<const TlsMaterial>(std::move(material));
}

namespace {

// gRPC's C++ has no credentials that ask at each handshake; its C has.
class SourcedCredentials final : public grpc::ServerCredentials {
 public:
  SourcedCredentials(grpc_ssl_client_certificate_request_type request, std::shared_ptr<const TlsSource> source)
      : source_(std::move(source)),
        credentials_(grpc_ssl_server_credentials_create_with_options(
            grpc_ssl_server_credentials_create_options_using_config_fetcher(request, &SourcedCredentials::Fetch,
                                                                            this))) {}
  ~SourcedCredentials() override { grpc_server_credentials_release(credentials_); }

  // Calls are authenticated by their handlers.
  void SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>& /*processor*/) override {}

 private:
  int AddPortToServer(const std::string& address, grpc_server* server) override {
    // These are the port's from now on, and it asks them for as long as the server runs.
    return grpc_server_add_http2_port(server, address.c_str(), credentials_);
  }

  // gRPC asks one at a time.
  static grpc_ssl_certificate_config_reload_status Fetch(void* self, grpc_ssl_server_certificate_config** config) {
    auto& credentials = *static_cast<SourcedCredentials*>(self);
    std::shared_ptr<const TlsMaterial> material = credentials.source_->Get();
    if (material == credentials.fetched_) {
      return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
    }
    const grpc_ssl_pem_key_cert_pair pair = {material->key.c_str(), material->certificate.c_str()};
    // gRPC wants authorities even if clients are asked for nothing, and then does not look at them.
    const std::string& client_ca = material->client_ca.empty() ? material->certificate : material->client_ca;
    *config = grpc_ssl_server_certificate_config_create(client_ca.c_str(), &pair, 1);
    credentials.fetched_ = std::move(material);
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
  }

  const std::shared_ptr<const TlsSource> source_;
  std::shared_ptr<const TlsMaterial> fetched_;
  grpc_server_credentials* const credentials_;
};

}  // namespace

std::shared_ptr<grpc::ServerCredentials> MakeTlsCredentials(const TlsOptions& options,
                                                            std::shared_ptr<const TlsSource> source) {
  grpc_ssl_client_certificate_request_type request = GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE;
  if (!options.client_ca.empty()) {
    request = options.require_client_certificate ? GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY
                                                 : GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY;
  }
  return std::make_shared<SourcedCredentials>(request, std::move(source));
}

}  // namespace wellspace::server
