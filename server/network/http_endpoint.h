// HTTP for the programs that look at a server: Prometheus, probes of Kubernetes, load balancers.
#ifndef WELLSPACE_SERVER_NETWORK_HTTP_ENDPOINT_H_
#define WELLSPACE_SERVER_NETWORK_HTTP_ENDPOINT_H_

#include <chrono>
#include <cstddef>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "server/base/file_descriptor.h"

namespace wellspace::server {

struct HttpAnswer {
  std::string status = "200 OK";  // code and reason
  std::string type = "text/plain";
  std::string body;
};

// The answer to GET and HEAD of a path, "/metrics" for example. Called on the thread of the endpoint, so it must
// not block.
using HttpRoutes = std::map<std::string, std::function<HttpAnswer()>, std::less<>>;

// Answers GET and HEAD of some paths over HTTP, on a thread of its own, until it is destroyed; other paths are not
// found.
//
// No client waits for another: all connections are served at once, each for kTimeout at most, and when there are
// kMostClients the oldest goes. An HTTP server with a thread for each client was rejected: a few requests that never
// come whole hold all.
class HttpEndpoint {
 public:
  static constexpr size_t kMostClients = 64;
  static constexpr size_t kMostRequestBytes = 8192;
  static constexpr std::chrono::seconds kTimeout{5};

  // Listens on `listen`, HOST:PORT with an address or "localhost"; port 0 takes a free one. REQUIRES: the objects that
  // `routes` read outlives this.
  //
  // Errors:     INVALID_ARGUMENT (listen), UNAVAILABLE (the address cannot be listened on).
  static absl::StatusOr<std::unique_ptr<HttpEndpoint>> Start(const std::string& listen, HttpRoutes routes);
  ~HttpEndpoint();
  HttpEndpoint(const HttpEndpoint&) = delete;
  HttpEndpoint& operator=(const HttpEndpoint&) = delete;

  // HOST:PORT with the port in use.
  const std::string& address() const { return address_; }

 private:
  struct Client;

  HttpEndpoint(std::vector<FileDescriptor> sockets, std::string address, HttpRoutes routes);

  void Run();
  void Accept(int socket);
  // Reads and writes without waiting; false when the client is done with.
  bool Serve(Client& client) const;
  std::string AnswerTo(const std::string& request) const;

  const std::vector<FileDescriptor> sockets_;
  const std::string address_;
  const HttpRoutes routes_;
  const FileDescriptor stop_;  // readable when the thread is to end
  std::list<Client> clients_;  // the thread's, the oldest first
  std::thread thread_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_NETWORK_HTTP_ENDPOINT_H_
