#include "server/embedded_server.h"

#include <algorithm>
#include <cstdlib>
#include <iostream>

#include "server/base/resources.h"
#include "server/server.h"
#include "spdlog/sinks/null_sink.h"

namespace wellspace::server {
namespace {

// Without a listener nothing can fail but for want of memory, threads or file descriptors, for which there is no
// remedy.
template <typename T>
T ValueOrAbort(absl::StatusOr<T> value) {
  if (!value.ok()) {
    std::cerr << "embedded server: " << value.status() << std::endl;
    std::abort();
  }
  return *std::move(value);
}

std::unique_ptr<Server> StartWithoutListener(int workers) {
  ServerOptions options;
  options.service.workers = std::max(1, workers);
  options.service.max_threads = ReadResources().processors;
  // The process's own machine is the limit: no other user is to be protected.
  options.service.max_points = core::kMaxVertices;
  options.service.max_vertices = core::kMaxVertices;
  auto log = std::make_shared<spdlog::logger>("embedded", std::make_shared<spdlog::sinks::null_sink_mt>());
  return ValueOrAbort(Server::Start(options, std::move(log)));
}

}  // namespace

class EmbeddedServer::Impl {
 public:
  explicit Impl(int workers) : server_(StartWithoutListener(workers)) {}

  Server& server() { return *server_; }

 private:
  std::unique_ptr<Server> server_;
};

EmbeddedServer::EmbeddedServer(int workers) : impl_(std::make_unique<Impl>(workers)) {}

EmbeddedServer::~EmbeddedServer() = default;

std::shared_ptr<grpc::Channel> EmbeddedServer::Channel() { return ValueOrAbort(impl_->server().InProcessChannel()); }

}  // namespace wellspace::server
