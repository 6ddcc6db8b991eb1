// Transport security of a listener.
#ifndef WELLSPACE_SERVER_TLS_H_
#define WELLSPACE_SERVER_TLS_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "grpcpp/security/server_credentials.h"

namespace wellspace::server {

// Paths of PEM files.
struct TlsOptions {
  std::string certificate;  // the server's own, then those between it and its authority; empty: plain text
  std::string key;          // of the server's certificate, not encrypted
  std::string client_ca;    // authorities whose client certificates are taken; empty: clients are not asked for any
  // A client without a certificate does not get through the handshake. Otherwise it gets as far as its first call, which is told what is
  // missing.
  bool require_client_certificate = false;

  bool enabled() const { return !certificate.empty() || !key.empty() || !client_ca.empty(); }
  std::vector<std::string> Files() const;
};

// Whether connections can be made with these files.
//
// Errors:     INVALID_ARGUMENT: a file is missing among the options, or has not what it should have: certificates that are valid now, the
//             key of the first; the message names the file. NOT_FOUND and so on: a file cannot be read.
absl::Status CheckTlsFiles(const TlsOptions& options);

// Credentials of a listener: TLS 1.2 with forward secrecy and authenticated encryption, or TLS 1.3. The files are read again when they
// have changed, within about `reload_interval` (at least a second); connections that are there stay.
//
// REQUIRES:   CheckTlsFiles(options) is OK.
std::shared_ptr<grpc::ServerCredentials> MakeTlsCredentials(const TlsOptions& options, absl::Duration reload_interval);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_TLS_H_
