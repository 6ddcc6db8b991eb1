#include "server/security/authenticator.h"

#include <iterator>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "core/base/status_macros.h"
#include "grpc/grpc_security_constants.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

constexpr char kMetadataKey[] = "authorization";
constexpr std::string_view kScheme = "bearer ";

absl::Status Unauthenticated(const std::string& message) {
  return MakeError(v1::ERROR_REASON_UNAUTHENTICATED, message);
}

absl::StatusOr<Caller> CallerByCertificate(const grpc::AuthContext& peer) {
  if (!peer.IsPeerAuthenticated()) {
    return Unauthenticated("this server wants a client certificate, and the connection has none");
  }
  const std::vector<grpc::string_ref> names = peer.FindPropertyValues(GRPC_X509_CN_PROPERTY_NAME);
  std::string name = names.size() == 1 ? std::string(names[0].data(), names[0].size()) : "";
  if (!IsTenantName(name)) {
    return Unauthenticated(
        "the client certificate names no tenant: the common name of its subject must be 1 to 64 letters, digits, '.', "
        "'_', '@' "
        "and '-', the first a letter or a digit");
  }
  return Caller{.tenant = std::move(name)};
}

absl::StatusOr<Caller> CallerByToken(const TokenTable& tokens, const grpc::ServerContextBase& context) {
  const auto [first, last] = context.client_metadata().equal_range(kMetadataKey);
  if (first == last) {
    return Unauthenticated("this server wants a token, in the metadata `authorization: Bearer TOKEN`");
  }
  const std::string_view value(first->second.data(), first->second.size());
  if (std::next(first) != last || !absl::StartsWithIgnoreCase({value.data(), value.size()}, kScheme.data())) {
    return Unauthenticated("the metadata `authorization` is not one `Bearer TOKEN`");
  }
  std::optional<Caller> caller = tokens.CallerOf(value.substr(kScheme.size()));
  if (!caller.has_value()) {
    return Unauthenticated("this server does not know the token");
  }
  return *std::move(caller);
}

}  // namespace

absl::StatusOr<Caller> Authenticator::Authenticate(const grpc::ServerContextBase& context) const {
  const Demands demands = GetDemands();
  Caller caller;
  if (demands.client_certificate) {
    WELLSPACE_ASSIGN_OR_RETURN(caller, CallerByCertificate(*context.auth_context()));
  }
  if (demands.tokens != nullptr) {
    WELLSPACE_ASSIGN_OR_RETURN(caller, CallerByToken(*demands.tokens, context));
  }
  return caller;
}

void Authenticator::SetDemands(Demands demands) {
  std::lock_guard lock(mutex_);
  demands_ = std::move(demands);
}

void Authenticator::SetTokens(std::shared_ptr<const TokenTable> tokens) {
  std::lock_guard lock(mutex_);
  demands_.tokens = std::move(tokens);
}

Authenticator::Demands Authenticator::GetDemands() const {
  std::lock_guard lock(mutex_);
  return demands_;
}

}  // namespace wellspace::server
