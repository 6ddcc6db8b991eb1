#include "server/metrics_endpoint.h"

#include <exception>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/listen_address.h"

namespace wellspace::server {

absl::StatusOr<std::unique_ptr<MetricsEndpoint>> MetricsEndpoint::Start(const std::string& listen,
                                                                        const Metrics& metrics) {
  WELLSPACE_ASSIGN_OR_RETURN(ListenAddress address, ParseListenAddress(listen));
  if (address.host == "localhost") {
    address.host = "127.0.0.1";  // the HTTP server takes addresses only
  }
  // A client that is slow to ask holds one of the threads until the timeout.
  const std::vector<std::string> options = {"listening_ports",    address.ToString(),
                                            "num_threads",        "4",
                                            "request_timeout_ms", "5000",
                                            "enable_keep_alive",  "no"};
  std::unique_ptr<prometheus::Exposer> exposer;
  try {
    exposer = std::make_unique<prometheus::Exposer>(options);
  } catch (const std::exception&) {
    return absl::UnavailableError(
        absl::StrCat("cannot serve metrics on ", listen, "; is the port in use, or the address not of this machine?"));
  }
  for (const std::shared_ptr<prometheus::Collectable>& collectable : metrics.Collectables()) {
    exposer->RegisterCollectable(collectable);
  }
  address.port = static_cast<uint16_t>(exposer->GetListeningPorts().front());
  return std::unique_ptr<MetricsEndpoint>(new MetricsEndpoint(std::move(exposer), address.ToString()));
}

}  // namespace wellspace::server
