// The server inside the calling process: the same code as wellspaced, without a listener.
#ifndef WELLSPACE_SERVER_EMBEDDED_SERVER_H_
#define WELLSPACE_SERVER_EMBEDDED_SERVER_H_

#include <memory>

namespace grpc {
class Channel;
}

namespace wellspace::server {

// Thread safety: thread-safe.
class EmbeddedServer {
 public:
  // `workers` jobs run at once.
  explicit EmbeddedServer(int workers);
  // Cancels what runs and waits for it.
  ~EmbeddedServer();
  EmbeddedServer(const EmbeddedServer&) = delete;
  EmbeddedServer& operator=(const EmbeddedServer&) = delete;

  // A channel to this server; outlives nothing: destroy it, and all stubs made of it, before the server.
  std::shared_ptr<grpc::Channel> Channel();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_EMBEDDED_SERVER_H_
