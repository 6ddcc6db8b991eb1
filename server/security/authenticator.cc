#include "server/security/authenticator.h"

#include <iterator>
#include <optional>
#include <string_view>
#include <vector>

#include "absl/strings/match.h"
#include "grpc/grpc_security_constants.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

constexpr char kMetadataKey[] = "authorization";
constexpr std::string_view kScheme = "bearer ";

grpc::Status Unauthenticated(const std::string& message) {
  return MakeError(v1::ERROR_REASON_UNAUTHENTICATED, message);
}

grpc::Status CheckCertificate(const grpc::AuthContext& peer, Caller* caller) {
  if (!peer.IsPeerAuthenticated()) {
    return Unauthenticated("this server wants a client certificate, and the connection has none");
  }
  const std::vector<grpc::string_ref> names = peer.FindPropertyValues(GRPC_X509_CN_PROPERTY_NAME);
  const std::string name = names.size() == 1 ? std::string(names[0].data(), names[0].size()) : "";
  if (!IsTenantName(name)) {
    return Unauthenticated(
        "the client certificate names no tenant: the common name of its subject must be 1 to 64 letters, digits, '.', "
        "'_', '@' "
        "and '-', the first a letter or a digit");
  }
  caller->tenant = name;
  return grpc::Status::OK;
}

grpc::Status CheckToken(const TokenTable& tokens, const grpc::ServerContextBase& context, Caller* caller) {
  const auto [first, last] = context.client_metadata().equal_range(kMetadataKey);
  if (first == last) {
    return Unauthenticated("this server wants a token, in the metadata `authorization: Bearer TOKEN`");
  }
  const std::string_view value(first->second.data(), first->second.size());
  if (std::next(first) != last || !absl::StartsWithIgnoreCase({value.data(), value.size()}, kScheme.data())) {
    return Unauthenticated("the metadata `authorization` is not one `Bearer TOKEN`");
  }
  std::optional<std::string> tenant = tokens.TenantOf(value.substr(kScheme.size()));
  if (!tenant.has_value()) {
    return Unauthenticated("this server does not know the token");
  }
  caller->tenant = *std::move(tenant);
  return grpc::Status::OK;
}

}  // namespace

grpc::Status Authenticator::Authenticate(const grpc::ServerContextBase& context, Caller* caller) const {
  const Demands demands = GetDemands();
  Caller found;
  if (demands.client_certificate) {
    if (grpc::Status status = CheckCertificate(*context.auth_context(), &found); !status.ok()) {
      return status;
    }
  }
  if (demands.tokens != nullptr) {
    if (grpc::Status status = CheckToken(*demands.tokens, context, &found); !status.ok()) {
      return status;
    }
  }
  *caller = std::move(found);
  return grpc::Status::OK;
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
