#include "server/observability/call_observer.h"

#include <algorithm>
#include <array>
#include <random>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"
#include "google/protobuf/message.h"
#include "grpcpp/support/byte_buffer.h"
#include "server/base/clock.h"
#include "server/log/log_fields.h"
#include "server/network/connections.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

using grpc::experimental::InterceptionHookPoints;

constexpr char kRequestId[] = "x-request-id";
constexpr size_t kMaxRequestId = 64;
constexpr std::string_view kHealth = "/grpc.health.v1.Health/";
constexpr std::string_view kChannelz = "grpc.channelz.v1.Channelz";
// https://www.w3.org/TR/trace-context/: version-trace-parent-flags, in lower-case hexadecimal digits.
constexpr std::string_view kTraceparentShape = "00-00000000000000000000000000000000-0000000000000000-00";

// The overhead of a call on its connection, in bytes: frames of the call's beginning and end, of each header, of
// each message. Records of TLS, each of 22 bytes more, are about as long as frames.
constexpr uint64_t kHeadersOverhead = 512;
constexpr uint64_t kHeaderOverhead = 16;
constexpr uint64_t kMostHeaders = 16 << 10;  // peers are told to send 8 KiB
constexpr uint64_t kMessageOverhead = 256;
constexpr uint64_t kBytesPerOverhead = 16;

// Methods of wellspace.v1 whose requests the services read as bytes.
constexpr std::array<std::string_view, 11> kReadAsBytes = {
    "AddSegments",         "AddTriangles", "ApproximateNearestNeighbors",
    "ClippedVoronoiCells", "DownloadMesh", "EstimateMesh",
    "MeshPoints",          "SetSizes",     "TransferValues",
    "UploadPoints",        "VoronoiCells"};

// How many bytes a request has that an interceptor is shown, which does not learn its type. A test sends one to each
// method.
using MessageBytes = uint64_t (*)(const void*);
MessageBytes MessageBytesOf(const CallMetrics::Method& method) {
  if (!std::string_view(method.service).starts_with("wellspace.v1.")) {
    return [](const void*) { return uint64_t{0}; };  // gRPC's own, whose requests are names
  }
  if (std::ranges::find(kReadAsBytes, method.name) != kReadAsBytes.end()) {
    return [](const void* message) -> uint64_t { return static_cast<const grpc::ByteBuffer*>(message)->Length(); };
  }
  return [](const void* message) -> uint64_t {
    return static_cast<const google::protobuf::Message*>(message)->ByteSizeLong();
  };
}

// The value of metadata `key`; empty if the client did not send it.
std::string_view Metadata(const grpc::ServerContextBase& context, const char* key) {
  const auto found = context.client_metadata().find(key);
  return found == context.client_metadata().end() ? std::string_view()
                                                  : std::string_view(found->second.data(), found->second.size());
}

bool IsRequestId(std::string_view text) {
  return !text.empty() && text.size() <= kMaxRequestId && std::all_of(text.begin(), text.end(), [](char c) {
    return absl::ascii_isalnum(c) || c == '-' || c == '_' || c == '.';
  });
}

bool IsTraceparent(std::string_view text) {
  return text.size() == kTraceparentShape.size() &&
         std::equal(text.begin(), text.end(), kTraceparentShape.begin(), [](char c, char shape) {
           return shape == '-' ? c == '-' : absl::ascii_isdigit(c) || (c >= 'a' && c <= 'f');
         });
}

// A call that ended with one of these has found a fault of the server.
bool IsServerFault(grpc::StatusCode code) {
  return code == grpc::StatusCode::INTERNAL || code == grpc::StatusCode::UNKNOWN || code == grpc::StatusCode::DATA_LOSS;
}

std::string RandomHex() {
  std::random_device random;
  return absl::StrFormat("%08x", random());
}

}  // namespace

// One call.
class CallObserver::Interceptor final : public grpc::experimental::Interceptor {
 public:
  Interceptor(CallObserver& observer, grpc::experimental::ServerRpcInfo& info)
      : observer_(observer),
        method_(observer.metrics_.Of(info.method())),
        path_(info.method()),
        streams_requests_(info.type() == grpc::experimental::ServerRpcInfo::Type::CLIENT_STREAMING ||
                          info.type() == grpc::experimental::ServerRpcInfo::Type::BIDI_STREAMING),
        message_bytes_(MessageBytesOf(method_)),
        context_(info.server_context()),
        start_(SinceBoot()),
        began_(Connections::Clock::now()) {
    // gRPC reads metadata and certificates into the context when they are first asked for, and not thread-safely: here,
    // before anything else knows of the call.
    tenant_ = observer_.tenant_of_(*context_);
    FindPeer();
    const std::string_view request_id = Metadata(*context_, kRequestId);
    request_id_ = IsRequestId(request_id) ? std::string(request_id) : observer_.MakeRequestId();
    if (const std::string_view traceparent = Metadata(*context_, "traceparent"); IsTraceparent(traceparent)) {
      traceparent_ = traceparent;
    }
    method_.started->Increment();
    observer_.Add(context_, this);
  }

  ~Interceptor() override {
    if (connection_ != nullptr) {
      const bool is_short = Connections::Clock::now() - began_ < Connections::kWindow;
      observer_.connections_.CallEnded(*connection_,
                                       {.is_known = !tenant_.empty(),
                                        .is_wasted = is_short && (is_cancelled_ || !has_message_),
                                        .is_unfinished = is_cancelled_ || (streams_requests_ && !has_succeeded_)});
    }
    observer_.Remove(context_);
  }

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    if (peer_.empty()) {
      FindPeer();
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_MESSAGE) &&
        methods->GetRecvMessage() != nullptr) {
      method_.received->Increment();
      has_message_ = true;
      ClaimMessage(kMessageOverhead + BytesOf(methods->GetRecvMessage()));
    }
    // A synchronous call, as reflection's, would wait here.
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::POST_RECV_CLOSE) &&
        dynamic_cast<grpc::CallbackServerContext*>(context_) != nullptr) {
      is_cancelled_ = context_->IsCancelled();
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_MESSAGE)) {
      method_.sent->Increment();
      Claim(kMessageOverhead);  // the peer opens its windows for what it has read
    }
    if (methods->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      methods->GetSendTrailingMetadata()->emplace(kRequestId, request_id_);
      const grpc::Status status = ServersStatus(methods->GetSendStatus());
      methods->ModifySendStatus(status);
      has_succeeded_ = status.ok();
      End(status);
    }
    methods->Proceed();
  }

  void Note(const LogFields& fields) {
    std::lock_guard lock(mutex_);
    notes_.Add(fields);
  }

 private:
  // gRPC ends a call whose only request is no message with UNIMPLEMENTED, without asking its handler, who would have
  // asked who calls. So does channelz, where it is not served.
  //
  // gRPC's own health service says UNKNOWN, and in no other case, when the client of a Watch is gone.
  grpc::Status ServersStatus(const grpc::Status& status) const {
    if (status.error_code() == grpc::StatusCode::UNKNOWN && path_.starts_with(kHealth)) {
      return {grpc::StatusCode::CANCELLED, "the client cancelled the call or is gone"};
    }
    if (status.error_code() != grpc::StatusCode::UNIMPLEMENTED || !method_.is_known || method_.service == kChannelz) {
      return status;
    }
    return ToGrpcStatus(
        tenant_.empty()
            ? MakeError(v1::ERROR_REASON_UNAUTHENTICATED, "this server wants to know who calls")
            : MakeError(v1::ERROR_REASON_MALFORMED_REQUEST,
                        absl::StrCat("the request is not one message of ", method_.service, ".", method_.name)));
  }

  // A synchronous call has a peer once its metadata have come, which is the first event that is intercepted; any other
  // from the beginning.
  void FindPeer() {
    peer_ = context_->peer();
    connection_ = observer_.connections_.CallBegan(peer_, !tenant_.empty());
    uint64_t headers = kHeadersOverhead + path_.size();
    for (const auto& [name, value] : context_->client_metadata()) {
      headers += kHeaderOverhead + name.size() + value.size();
    }
    Claim(std::min(headers, kMostHeaders));
  }

  // Bytes of the connection, of those that came, are this call's.
  void Claim(uint64_t bytes) {
    if (connection_ != nullptr) {
      Connections::Claim(*connection_, bytes);
    }
  }

  void ClaimMessage(uint64_t bytes) {
    if (connection_ != nullptr && !tenant_.empty()) {
      Connections::ClaimMessage(*connection_, bytes);
    } else {
      Claim(bytes);
    }
  }

  // The bytes that came for a message, with those that frames and TLS add.
  uint64_t BytesOf(const void* message) const {
    const uint64_t bytes = message_bytes_(message);
    return bytes + bytes / kBytesPerOverhead;
  }

  void End(const grpc::Status& status) {
    const double seconds = absl::ToDoubleSeconds(SinceBoot() - start_);
    method_.Handled(status.error_code(), seconds);
    const auto level = IsServerFault(status.error_code()) ? spdlog::level::err : spdlog::level::info;
    if (!observer_.log_.should_log(level)) {
      return;
    }
    const std::string_view path = std::string_view(path_).substr(1);
    const size_t slash = std::min(path.find('/'), path.size());
    LogFields fields;
    fields.Add("event", "call").Add("request_id", request_id_);
    fields.Add("tenant", tenant_).Add("peer", peer_);
    fields.Add("service", path.substr(0, slash)).Add("method", path.substr(std::min(slash + 1, path.size())));
    fields.Add("code", absl::StatusCodeToString(static_cast<absl::StatusCode>(status.error_code())));
    fields.Add("seconds", seconds);
    {
      std::lock_guard lock(mutex_);
      fields.Add(notes_);
    }
    if (!traceparent_.empty()) {
      fields.Add("traceparent", traceparent_);
    }
    if (!status.ok()) {
      fields.Add("message", status.error_message());
    }
    observer_.log_.log(level, "{}", fields.text());
  }

  CallObserver& observer_;
  const CallMetrics::Method& method_;
  const std::string path_;  // "/service/method"
  const bool streams_requests_;
  const MessageBytes message_bytes_;
  grpc::ServerContextBase* const context_;
  const absl::Duration start_;  // since boot
  const Connections::Clock::time_point began_;
  std::string peer_;
  std::shared_ptr<Connections::Connection> connection_;  // null: not from the network
  std::atomic<bool> has_message_ = false;
  std::atomic<bool> is_cancelled_ = false;
  std::atomic<bool> has_succeeded_ = false;
  std::string tenant_;
  std::string request_id_;
  std::string traceparent_;  // empty: none
  std::mutex mutex_;
  LogFields notes_;  // guarded by mutex_
};

class CallObserver::Factory final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit Factory(CallObserver& observer) : observer_(observer) {}

  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) override {
    return new Interceptor(observer_, *info);
  }

 private:
  CallObserver& observer_;
};

CallObserver::CallObserver(spdlog::logger& log, const CallMetrics& metrics, Connections& connections,
                           TenantOf tenant_of)
    : log_(log),
      metrics_(metrics),
      connections_(connections),
      tenant_of_(std::move(tenant_of)),
      request_id_prefix_(RandomHex()) {}

CallObserver::~CallObserver() = default;

std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> CallObserver::MakeInterceptors() {
  return std::make_unique<Factory>(*this);
}

void CallObserver::Note(const grpc::ServerContextBase* context, const LogFields& fields) {
  std::lock_guard lock(mutex_);
  if (const auto found = calls_.find(context); found != calls_.end()) {
    found->second->Note(fields);
  }
}

size_t CallObserver::InFlight() const {
  std::lock_guard lock(mutex_);
  return calls_.size();
}

void CallObserver::Add(const grpc::ServerContextBase* context, Interceptor* call) {
  std::lock_guard lock(mutex_);
  calls_.emplace(context, call);
}

void CallObserver::Remove(const grpc::ServerContextBase* context) {
  std::lock_guard lock(mutex_);
  calls_.erase(context);
}

std::string CallObserver::MakeRequestId() { return absl::StrCat(request_id_prefix_, "-", next_request_++); }

}  // namespace wellspace::server
