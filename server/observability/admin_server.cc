#include "server/observability/admin_server.h"

#include <chrono>
#include <mutex>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "grpcpp/ext/channelz_service_plugin.h"
#include "grpcpp/impl/server_builder_option.h"
#include "grpcpp/impl/server_builder_plugin.h"
#include "grpcpp/security/server_credentials.h"
#include "server/network/compression.h"
#include "server/network/listen_address.h"

namespace wellspace::server {
namespace {

constexpr std::string_view kChannelzPlugin = "channelz_service";

class WithoutChannelz final : public grpc::ServerBuilderOption {
 public:
  void UpdateArguments(grpc::ChannelArguments* /*arguments*/) override {}
  void UpdatePlugins(std::vector<std::unique_ptr<grpc::ServerBuilderPlugin>>* plugins) override {
    std::erase_if(*plugins, [](const auto& plugin) { return plugin->name() == kChannelzPlugin; });
  }
};

}  // namespace

void LeaveOutChannelz(grpc::ServerBuilder& builder) { builder.SetOption(std::make_unique<WithoutChannelz>()); }

absl::StatusOr<ListenAddress> AdminServer::AddressOf(const std::string& listen) {
  WELLSPACE_ASSIGN_OR_RETURN(ListenAddress address, ParseListenAddress(listen));
  if (!address.IsLoopback()) {
    return absl::FailedPreconditionError(absl::StrCat(
        "refuses to serve channelz on ", address.ToString(),
        ": it shows the addresses and certificates of all clients; take an address on 127.0.0.1 or [::1]"));
  }
  return address;
}

absl::StatusOr<std::unique_ptr<AdminServer>> AdminServer::Start(const std::string& listen, CallObserver& observer) {
  WELLSPACE_ASSIGN_OR_RETURN(ListenAddress address, AddressOf(listen));
  static std::once_flag once;
  std::call_once(once, grpc::channelz::experimental::InitChannelzService);
  grpc::ServerBuilder builder;
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  RefuseCompression(builder);
  int port = 0;
  builder.AddListeningPort(address.ToString(), grpc::InsecureServerCredentials(), &port);
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(observer.MakeInterceptors());
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  if (server == nullptr || port == 0) {
    return absl::UnavailableError(
        absl::StrCat("cannot serve channelz on ", listen, "; is the port in use, or the address not of this machine?"));
  }
  address.port = static_cast<uint16_t>(port);
  return std::unique_ptr<AdminServer>(new AdminServer(std::move(server), address.ToString()));
}

AdminServer::~AdminServer() {
  server_->Shutdown(std::chrono::system_clock::now());
  server_->Wait();
}

}  // namespace wellspace::server
