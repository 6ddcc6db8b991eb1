// The credentials that a server demands of its peers, and how it comes by its own.
#ifndef WELLSPACE_SERVER_SECURITY_SECURITY_H_
#define WELLSPACE_SERVER_SECURITY_SECURITY_H_

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "grpcpp/server_builder.h"
#include "server/network/listen_address.h"
#include "server/security/authenticator.h"
#include "server/security/file_watch.h"
#include "server/security/tls.h"
#include "spdlog/logger.h"

namespace wellspace::server {

struct SecurityOptions {
  TlsOptions tls;
  std::string token_file;        // of TokenTable; empty: callers need no token
  bool insecure_remote = false;  // allows remote listeners without TLS, or without any demand on callers
  absl::Duration reload_interval = absl::Seconds(1);  // how often files are looked at

  // Clients with certificates are asked to connect anew after this time, so that clients that have expired or lost
  // their authority get no further. Calls under way are not disturbed.
  absl::Duration max_connection_age = absl::Hours(1);
};

// Certificates and tokens, read again when their files change.
//
// A file that has become unreadable or wrong is reported in the log, and the old contents stay in use: the tokens
// that were known, or all of certificates, key and authorities.
//
// Thread safety: thread-safe.
class Security {
 public:
  // Reads the files.
  //
  // Errors:     as of ReadTlsFiles; INVALID_ARGUMENT: the token file has a wrong line; NOT_FOUND and so on: it cannot
  //             be read.
  static absl::StatusOr<std::unique_ptr<Security>> Load(const SecurityOptions& options,
                                                        std::shared_ptr<spdlog::logger> log);

  const Authenticator& authenticator() const { return authenticator_; }

  // Whether connections may come to `address`.
  //
  // Errors:     FAILED_PRECONDITION, as of AddAcceptor.
  absl::Status CheckAddress(const ListenAddress& address) const;

  // Has `builder` take connections that come to `address`, from the object returned.
  //
  // Errors:     FAILED_PRECONDITION: other machines could reach it, in plain text or without having to say who they
  //             are, and nothing says that this is wanted.
  absl::StatusOr<std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor>> AddAcceptor(
      const ListenAddress& address, grpc::ServerBuilder& builder) const;

 private:
  Security(const SecurityOptions& options, std::shared_ptr<spdlog::logger> log);

  void Watch();
  absl::StatusOr<TokenTable> ReadTokens() const;
  void OnTokensChange();
  void OnTlsChange();

  const SecurityOptions options_;
  const std::shared_ptr<spdlog::logger> log_;
  Authenticator authenticator_;
  // Null: no TLS. gRPC asks the credentials as long as a server runs.
  std::shared_ptr<TlsSource> tls_source_;
  std::shared_ptr<grpc::ServerCredentials> tls_credentials_;
  FileWatch tls_watch_;
  FileWatch token_watch_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SECURITY_SECURITY_H_
