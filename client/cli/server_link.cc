#include "client/cli/server_link.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "client/connection.h"

namespace wellspace::cli {

absl::StatusOr<std::unique_ptr<ServerLink>> ServerLink::Open(const ServerChoice& choice) {
  std::unique_ptr<ServerLink> link(new ServerLink(choice.address));
  if (choice.address.empty()) {
    link->server_ = std::make_unique<server::EmbeddedServer>(/*workers=*/1);
    link->client_.emplace(client::MakeConnection(link->server_->Channel()));
    return link;
  }
  client::ConnectOptions connect = choice.connect;
  if (!connect.token_file.empty()) {
    connect.token.clear();  // of the environment
  }
  absl::StatusOr<client::Client> client = client::Connect(choice.address, connect);
  if (!client.ok()) {
    return client.status();
  }
  link->client_.emplace(*std::move(client));
  return link;
}

absl::Status ServerLink::Explain(const absl::Status& status) const {
  if (address_.empty() || status.code() != absl::StatusCode::kUnavailable) {
    return status;
  }
  return absl::UnavailableError(absl::StrCat("server ", address_, ": ", status.message()));
}

}  // namespace wellspace::cli
