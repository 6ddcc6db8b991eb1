#include "server/security/security.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace wellspace::server {
namespace {

std::vector<std::string> IfAny(const std::string& path) {
  return path.empty() ? std::vector<std::string>() : std::vector<std::string>{path};
}

}  // namespace

Security::Security(const SecurityOptions& options, std::shared_ptr<spdlog::logger> log)
    : options_(options),
      log_(std::move(log)),
      tls_watch_(options.tls.Files()),
      token_watch_(IfAny(options.token_file)) {}

absl::StatusOr<std::unique_ptr<Security>> Security::Load(const SecurityOptions& options,
                                                         std::shared_ptr<spdlog::logger> log) {
  std::unique_ptr<Security> security(new Security(options, std::move(log)));
  Authenticator::Demands demands;
  if (options.tls.enabled()) {
    WELLSPACE_ASSIGN_OR_RETURN(TlsMaterial material, ReadTlsFiles(options.tls));
    security->tls_source_ = std::make_shared<TlsSource>(std::move(material));
    security->tls_credentials_ = MakeTlsCredentials(options.tls, security->tls_source_);
    demands.client_certificate = !options.tls.client_ca.empty();
  }
  if (!options.token_file.empty()) {
    WELLSPACE_ASSIGN_OR_RETURN(TokenTable tokens, security->ReadTokens());
    demands.tokens = std::make_shared<const TokenTable>(std::move(tokens));
  }
  security->authenticator_.SetDemands(std::move(demands));
  security->Watch();
  return security;
}

void Security::Watch() {
  if (options_.tls.enabled()) {
    tls_watch_.Start(options_.reload_interval, [this] { OnTlsChange(); });
  }
  if (!options_.token_file.empty()) {
    token_watch_.Start(options_.reload_interval, [this] { OnTokensChange(); });
  }
}

absl::StatusOr<TokenTable> Security::ReadTokens() const {
  WELLSPACE_ASSIGN_OR_RETURN(const std::string text, ReadFile(options_.token_file));
  absl::StatusOr<TokenTable> tokens = TokenTable::Parse(text);
  if (!tokens.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(options_.token_file, ": ", tokens.status().message()));
  }
  return tokens;
}

void Security::OnTokensChange() {
  absl::StatusOr<TokenTable> tokens = ReadTokens();
  if (!tokens.ok()) {
    log_->error("tokens stay as they were: {}", std::string(tokens.status().message()));
    return;
  }
  const size_t count = tokens->size();
  authenticator_.SetTokens(std::make_shared<const TokenTable>(*std::move(tokens)));
  log_->info("tokens={} read again from {}", count, options_.token_file);
}

void Security::OnTlsChange() {
  absl::StatusOr<TlsMaterial> material = ReadTlsFiles(options_.tls);
  if (!material.ok()) {
    log_->error("certificates stay as they were until this is put right: {}", std::string(material.status().message()));
    return;
  }
  tls_source_->Set(*std::move(material));
  log_->info("certificates read again from {}", options_.tls.certificate);
}

absl::Status Security::CheckAddress(const ListenAddress& address) const {
  if (address.IsLoopback() || options_.insecure_remote) {
    return absl::OkStatus();
  }
  const std::string what =
      absl::StrCat("refuses to listen on ", address.ToString(), ": other machines could reach it, ");
  if (!options_.tls.enabled()) {
    return absl::FailedPreconditionError(
        absl::StrCat(what,
                     "in plain text; give --tls-cert and --tls-key, listen on 127.0.0.1 or [::1], or allow it with "
                     "--insecure-remote"));
  }
  if (options_.token_file.empty() && options_.tls.client_ca.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat(what,
                     "without having to say who they are; give --token-file or --tls-client-ca, listen on 127.0.0.1 or "
                     "[::1], or allow it with --insecure-remote"));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor>> Security::AddAcceptor(
    const ListenAddress& address, grpc::ServerBuilder& builder) const {
  WELLSPACE_RETURN_IF_ERROR(CheckAddress(address));
  if (!options_.tls.client_ca.empty()) {
    builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS,
                               static_cast<int>(absl::ToInt64Milliseconds(options_.max_connection_age)));
  }
  return builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
      options_.tls.enabled() ? tls_credentials_ : grpc::InsecureServerCredentials());
}

}  // namespace wellspace::server
