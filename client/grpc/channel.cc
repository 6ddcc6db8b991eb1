#include "client/grpc/channel.h"

#include <algorithm>
#include <fstream>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/address.h"
#include "core/base/status_macros.h"
#include "grpcpp/create_channel.h"
#include "grpcpp/security/credentials.h"
#include "grpcpp/support/client_interceptor.h"

namespace wellspace::client {
namespace {

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream content;
  if (!(content << file.rdbuf())) {
    return absl::NotFoundError(absl::StrCat("cannot read ", path, ", or it is empty"));
  }
  return content.str();
}

absl::Status ReadPem(const std::string& path, std::string* content) {
  if (path.empty()) {
    return absl::OkStatus();
  }
  WELLSPACE_ASSIGN_OR_RETURN(std::string read, ReadFile(path));
  if (read.find("-----BEGIN ") == std::string::npos) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": expected PEM, which begins with -----BEGIN"));
  }
  *content = std::move(read);
  return absl::OkStatus();
}

bool UsesTls(const ConnectOptions& options) {
  return options.tls || !options.tls_ca.empty() || !options.tls_certificate.empty() || !options.tls_key.empty();
}

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> MakeCredentials(const ConnectOptions& options) {
  if (!UsesTls(options)) {
    return grpc::InsecureChannelCredentials();
  }
  if (options.tls_certificate.empty() != options.tls_key.empty()) {
    return absl::InvalidArgumentError("a client certificate wants its key, and a key its certificate");
  }
  grpc::SslCredentialsOptions ssl;
  for (const auto& [path, content] : {std::pair(&options.tls_ca, &ssl.pem_root_certs),
                                      {&options.tls_certificate, &ssl.pem_cert_chain},
                                      {&options.tls_key, &ssl.pem_private_key}}) {
    WELLSPACE_RETURN_IF_ERROR(ReadPem(*path, content));
  }
  return grpc::SslCredentials(ssl);
}

// The token that a call shows.
//
// Thread safety: immutable; the file is read by the thread that calls.
class TokenSource {
 public:
  // Errors:     INVALID_ARGUMENT: two tokens, or none that metadata could carry. NOT_FOUND: the file cannot be read.
  static absl::StatusOr<TokenSource> Make(const ConnectOptions& options) {
    if (!options.token.empty() && !options.token_file.empty()) {
      return absl::InvalidArgumentError("both a token and a file with a token; expected one of them");
    }
    TokenSource source(options);
    if (source.exists()) {
      if (absl::StatusOr<std::string> token = source.Read(); !token.ok()) {
        return token.status();
      }
    }
    return source;
  }

  bool exists() const { return !token_.empty() || !file_.empty(); }

  absl::StatusOr<std::string> Read() const {
    std::string token = token_;
    if (!file_.empty()) {
      WELLSPACE_ASSIGN_OR_RETURN(std::string content, ReadFile(file_));
      token = std::move(content);
    }
    absl::StripAsciiWhitespace(&token);
    if (token.empty() ||
        !std::all_of(token.begin(), token.end(), [](unsigned char c) { return absl::ascii_isgraph(c); })) {
      return absl::InvalidArgumentError(
          absl::StrCat(file_.empty() ? "the token" : file_, ": expected one token of visible characters of ASCII"));
    }
    return token;
  }

 private:
  explicit TokenSource(const ConnectOptions& options) : token_(options.token), file_(options.token_file) {}

  std::string token_;
  std::string file_;
};

// The knowledge of a channel about its server, for all its calls.
struct Way {
  TokenSource token;
  std::string host;
  std::optional<Proxy> proxy;
};

// Adds the token to a call's metadata; tells servers that cannot be trusted from those that cannot be reached, and by
// which proxy that was.
class CredentialsInterceptor final : public grpc::experimental::Interceptor {
 public:
  explicit CredentialsInterceptor(const Way& way) : way_(way) {}

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    using grpc::experimental::InterceptionHookPoints;
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_INITIAL_METADATA) && way_.token.exists()) {
      // Without a token that can be read, the server answers with its own error.
      if (const absl::StatusOr<std::string> token = way_.token.Read(); token.ok()) {
        methods->GetSendInitialMetadata()->emplace("authorization", absl::StrCat("Bearer ", *token));
      }
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_STATUS)) {
      Explain(*methods->GetRecvStatus());
    }
    methods->Proceed();
  }

 private:
  // gRPC knows only that it could not connect. Errors with details are the server's own.
  void Explain(grpc::Status& status) const {
    if (status.error_code() != grpc::StatusCode::UNAVAILABLE || !status.error_details().empty()) {
      return;
    }
    const bool is_untrusted = status.error_message().find("handshake failed") != std::string::npos;
    std::string message = status.error_message();
    if (is_untrusted) {
      message = absl::StrCat("the server's certificate is not trusted, or it speaks no TLS: ", message);
    }
    if (way_.proxy.has_value()) {
      absl::StrAppend(&message, "; the way there was by the proxy ", way_.proxy->address, ", as the environment's ",
                      way_.proxy->variable, " has it; to go without, set no_proxy=", way_.host);
    }
    status = grpc::Status(is_untrusted ? grpc::StatusCode::UNAUTHENTICATED : grpc::StatusCode::UNAVAILABLE, message);
  }

  const Way& way_;
};

class CredentialsInterceptorFactory final : public grpc::experimental::ClientInterceptorFactoryInterface {
 public:
  explicit CredentialsInterceptorFactory(Way way) : way_(std::move(way)) {}

  grpc::experimental::Interceptor* CreateClientInterceptor(grpc::experimental::ClientRpcInfo* /*info*/) override {
    return new CredentialsInterceptor(way_);
  }

 private:
  const Way way_;
};

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::Channel>> OpenChannel(const std::string& address, const ConnectOptions& options,
                                                           const grpc::ChannelArguments& arguments) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::string host, HostOf(address));
  WELLSPACE_ASSIGN_OR_RETURN(TokenSource token, TokenSource::Make(options));
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<grpc::ChannelCredentials> credentials, MakeCredentials(options));
  if (token.exists() && !UsesTls(options) && !options.insecure_remote && !IsLoopback(host)) {
    return absl::FailedPreconditionError(absl::StrCat("would send the token to ", address,
                                                      " in plain text; use TLS, or allow it with --insecure-remote"));
  }
  // A proxy's loopback is not this machine's.
  const bool is_direct = IsLoopback(host);
  grpc::ChannelArguments all_arguments = arguments;
  if (is_direct) {
    all_arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  }
  std::vector<std::unique_ptr<grpc::experimental::ClientInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(std::make_unique<CredentialsInterceptorFactory>(
      Way{std::move(token), host, is_direct ? std::nullopt : ProxyFor(host)}));
  return grpc::experimental::CreateCustomChannelWithInterceptors(TargetOf(address), credentials, all_arguments,
                                                                 std::move(interceptors));
}

}  // namespace wellspace::client
