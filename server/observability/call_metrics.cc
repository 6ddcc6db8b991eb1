#include "server/observability/call_metrics.h"

#include "absl/strings/str_cat.h"
#include "google/protobuf/descriptor.h"

namespace wellspace::server {
namespace {

constexpr char kUnknown[] = "unknown";

// The values of grpc_code, by number of the status.
constexpr std::array<std::string_view, 17> kCodeLabels = {
    "OK",       "Canceled",       "Unknown",          "InvalidArgument",   "DeadlineExceeded",
    "NotFound", "AlreadyExists",  "PermissionDenied", "ResourceExhausted", "FailedPrecondition",
    "Aborted",  "OutOfRange",     "Unimplemented",    "Internal",          "Unavailable",
    "DataLoss", "Unauthenticated"};

// From a unary call to one that meshes for an hour.
const prometheus::Histogram::BucketBoundaries kBuckets = {0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5,  1,
                                                          2.5,   5,    10,    30,   60,  300,  1800, 3600};

size_t IndexOf(grpc::StatusCode code) {
  const auto index = static_cast<size_t>(code);
  return index < kCodeLabels.size() ? index : static_cast<size_t>(grpc::StatusCode::UNKNOWN);
}

std::string PathOf(std::string_view service, std::string_view method) {
  return absl::StrCat("/", std::string(service), "/", std::string(method));
}

const char* TypeLabel(bool client_streams, bool server_streams) {
  if (client_streams) {
    return server_streams ? "bidi_stream" : "client_stream";
  }
  return server_streams ? "server_stream" : "unary";
}

}  // namespace

struct CallMetrics::Families {
  explicit Families(prometheus::Registry& registry)
      : started(prometheus::BuildCounter()
                    .Name("grpc_server_started_total")
                    .Help("Calls that have begun.")
                    .Register(registry)),
        handled(prometheus::BuildCounter()
                    .Name("grpc_server_handled_total")
                    .Help("Calls that have ended, by status code.")
                    .Register(registry)),
        received(prometheus::BuildCounter()
                     .Name("grpc_server_msg_received_total")
                     .Help("Messages received from clients.")
                     .Register(registry)),
        sent(prometheus::BuildCounter()
                 .Name("grpc_server_msg_sent_total")
                 .Help("Messages sent to clients.")
                 .Register(registry)),
        seconds(prometheus::BuildHistogram()
                    .Name("grpc_server_handling_seconds")
                    .Help("From the begin of a call to its status, in seconds.")
                    .Register(registry)) {}

  prometheus::Family<prometheus::Counter>& started;
  prometheus::Family<prometheus::Counter>& handled;
  prometheus::Family<prometheus::Counter>& received;
  prometheus::Family<prometheus::Counter>& sent;
  prometheus::Family<prometheus::Histogram>& seconds;
};

void CallMetrics::Method::Handled(grpc::StatusCode code, double duration_seconds) const {
  handled[IndexOf(code)]->Increment();
  seconds->Observe(duration_seconds);
}

CallMetrics::CallMetrics(prometheus::Registry& registry, const std::vector<std::string>& services) {
  const Families families(registry);
  for (const std::string& name : services) {
    const auto* service = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(name);
    for (int i = 0; service != nullptr && i < service->method_count(); ++i) {
      const google::protobuf::MethodDescriptor& method = *service->method(i);
      AddMethod(families, name, method.name(), method.client_streaming(), method.server_streaming());
    }
  }
  // gRPC's own service has no descriptor.
  AddMethod(families, "grpc.health.v1.Health", "Check", false, false);
  AddMethod(families, "grpc.health.v1.Health", "Watch", false, true);
  AddMethod(families, kUnknown, kUnknown, true, true);
}

void CallMetrics::AddMethod(const Families& families, const std::string& service, const std::string& name,
                            bool client_streams, bool server_streams) {
  const prometheus::Labels labels = {
      {"grpc_type", TypeLabel(client_streams, server_streams)}, {"grpc_service", service}, {"grpc_method", name}};
  auto method = std::make_unique<Method>();
  method->service = service;
  method->name = name;
  method->is_known = name != kUnknown;
  method->started = &families.started.Add(labels);
  method->received = &families.received.Add(labels);
  method->sent = &families.sent.Add(labels);
  method->seconds = &families.seconds.Add(labels, kBuckets);
  for (size_t code = 0; code < kCodeLabels.size(); ++code) {
    prometheus::Labels with_code = labels;
    with_code["grpc_code"] = std::string(kCodeLabels[code]);
    method->handled[code] = &families.handled.Add(with_code);
  }
  methods_.emplace(PathOf(service, name), std::move(method));
}

const CallMetrics::Method& CallMetrics::Of(std::string_view path) const {
  const auto found = methods_.find(path);
  return *(found != methods_.end() ? found : methods_.find(PathOf(kUnknown, kUnknown)))->second;
}

}  // namespace wellspace::server
