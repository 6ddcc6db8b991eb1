// Transport security of a listener.
#ifndef WELLSPACE_SERVER_SECURITY_TLS_H_
#define WELLSPACE_SERVER_SECURITY_TLS_H_

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "grpcpp/security/server_credentials.h"

namespace wellspace::server {

// Paths of PEM files.
struct TlsOptions {
  std::string certificate;  // the server's own, then those between it and its authority; empty: plain text
  std::string key;          // of the server's certificate, not encrypted
  std::string client_ca;    // authorities whose client certificates are taken; empty: clients are not asked for any
  // A client without a certificate does not get through the handshake. Otherwise it gets as far as its first call,
  // which is told the missing part.
  bool require_client_certificate = false;

  bool enabled() const { return !certificate.empty() || !key.empty() || !client_ca.empty(); }
  std::vector<std::string> Files() const;
};

// The contents of these files, in PEM.
struct TlsMaterial {
  std::string certificate;
  std::string key;
  std::string client_ca;  // empty: none
};

// Reads the files, if connections can be made with them.
//
// Errors:     INVALID_ARGUMENT: a file is missing among the options, or has not the right contents: certificates that
//             are valid now, the key of the first; the message names the file. NOT_FOUND and so on: a file cannot be
//             read.
absl::StatusOr<TlsMaterial> ReadTlsFiles(const TlsOptions& options);

// The certificate, the key and the client CA of new connections, replaced at once while a server runs.
//
// Thread safety: thread-safe.
class TlsSource {
 public:
  explicit TlsSource(TlsMaterial material) : material_(std::make_shared<const TlsMaterial>(std::move(material))) {}

  std::shared_ptr<const TlsMaterial> Get() const;
  void Set(TlsMaterial material);

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const TlsMaterial> material_;  // guarded by mutex_
};

// Credentials of a listener: TLS 1.2 with forward secrecy and authenticated encryption, or TLS 1.3, with what `source`
// has at each handshake. Connections that are there stay when it changes. Of `options` only the demand on clients
// counts.
//
// gRPC's own watch of files was rejected: between a new certificate and its key, and as long as a file is wrong, it
// fails all handshakes.
std::shared_ptr<grpc::ServerCredentials> MakeTlsCredentials(const TlsOptions& options,
                                                            std::shared_ptr<const TlsSource> source);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SECURITY_TLS_H_
