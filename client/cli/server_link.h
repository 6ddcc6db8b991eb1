// The server that a command talks to: one with an address, or the one inside this process.
#ifndef WELLSPACE_CLIENT_CLI_SERVER_LINK_H_
#define WELLSPACE_CLIENT_CLI_SERVER_LINK_H_

#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/client.h"
#include "server/embedded_server.h"

namespace wellspace::cli {

struct ServerChoice {
  std::string address;  // HOST:PORT; empty: the embedded server
  client::ConnectOptions connect;
};

// Thread safety: thread-compatible; the client is thread-safe.
class ServerLink {
 public:
  // REQUIRES:   an Interrupt that is to be heard was made before.
  static absl::StatusOr<std::unique_ptr<ServerLink>> Open(const ServerChoice& choice);

  client::Client& client() { return *client_; }

  // `status`, with the server's address when it is about the connection, and the options that would help.
  absl::Status Explain(const absl::Status& status) const;

 private:
  explicit ServerLink(const ServerChoice& choice) : choice_(choice) {}

  const ServerChoice choice_;

  // In this order, so that the client goes before its server.
  std::unique_ptr<server::EmbeddedServer> server_;
  std::optional<client::Client> client_;
};

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_SERVER_LINK_H_
