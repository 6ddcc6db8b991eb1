#include "client/cli/server_link.h"

#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/connection.h"
#include "client/error_details.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {

absl::StatusOr<std::unique_ptr<ServerLink>> ServerLink::Open(const ServerChoice& choice) {
  std::unique_ptr<ServerLink> link(new ServerLink(choice));
  if (choice.address.empty()) {
    link->server_ = std::make_unique<server::EmbeddedServer>(/*workers=*/1);
    link->client_.emplace(client::MakeConnection(link->server_->Channel()));
    return link;
  }
  client::ConnectOptions connect = choice.connect;
  if (!connect.token_file.empty()) {
    connect.token.clear();  // of the environment
  }
  WELLSPACE_ASSIGN_OR_RETURN(client::Client client, client::Connect(choice.address, connect));
  link->client_.emplace(std::move(client));
  return link;
}

absl::Status ServerLink::Explain(const absl::Status& status) const {
  const client::ConnectOptions& connect = choice_.connect;
  if (absl::IsUnauthenticated(status) && !client::ReasonOf(status).empty() && connect.token.empty() &&
      connect.token_file.empty()) {
    return client::WithMessage(status, absl::StrCat(status.message(), "; give --token-file, or set WELLSPACE_TOKEN"));
  }
  if (choice_.address.empty() || !absl::IsUnavailable(status)) {
    return status;
  }
  const bool may_want_tls = !connect.tls && connect.tls_ca.empty() && connect.tls_certificate.empty() &&
                            absl::StrContains(status.message(), "Socket closed");
  return client::WithMessage(status, absl::StrCat("server ", choice_.address, ": ", status.message(),
                                                  may_want_tls ? "; if it wants TLS, give --tls or --tls-ca" : ""));
}

}  // namespace wellspace::cli
