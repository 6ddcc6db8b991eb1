// Every method of the service, with any bytes for requests, against a server that works with the real mesher.
//
// Input: calls; each is a letter that chooses the method ('a' the first of MeshingService, then those of
// SessionService, OperationService, QueryService and AdminService in the order of their files), the number of its
// messages (modulo 4), and the messages: the length in two bytes, low one first, and that many bytes. In a message that
// is one of the method, names that begin with "sessions/0" are of the session made last.
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "google/protobuf/descriptor.h"
#include "google/protobuf/message.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/grpcpp.h"
#include "nlohmann/json.hpp"
#include "server/log/log_fields.h"
#include "server/server.h"
#include "spdlog/sinks/base_sink.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/scratch_folder.h"
#include "wellspace/v1/admin.pb.h"
#include "wellspace/v1/errors.pb.h"
#include "wellspace/v1/meshing.pb.h"
#include "wellspace/v1/operations.pb.h"
#include "wellspace/v1/queries.pb.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::fuzz {
namespace {

using google::protobuf::MethodDescriptor;

// Small, so that short inputs reach the limits, and nothing takes long.
const server::ServiceOptions kOptions = {.max_queued_jobs = 2,
                                         .max_jobs_per_tenant = 2,
                                         .max_threads = 2,
                                         .max_points = 16,
                                         .max_vertices = 300,
                                         .max_points_per_tenant = 24,
                                         .max_sessions = 3,
                                         .max_sessions_per_tenant = 2};
// Every call has it: it is that of an admin.
const std::string kToken(40, 't');
constexpr absl::Duration kDeadline = absl::Seconds(60);

// Requires of the log that its lines have fields.
class LogCheck final : public spdlog::sinks::base_sink<std::mutex> {
 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string_view line(message.payload.data(), message.payload.size());
    if (line.starts_with("event=")) {
      const std::optional<std::string> members = server::ToJsonMembers(line);
      Require(members.has_value() && nlohmann::json::accept(absl::StrCat("{", *members, "}")),
              "a line of the log has fields:", line);
    }
  }
  void flush_() override {}
};

std::vector<const MethodDescriptor*> FindMethods() {
  std::vector<const MethodDescriptor*> methods;
  for (const google::protobuf::FileDescriptor* file :
       {v1::MeshPointsRequest::descriptor()->file(), v1::Session::descriptor()->file(),
        v1::Operation::descriptor()->file(), v1::VoronoiCellsRequest::descriptor()->file(),
        v1::GetUsageRequest::descriptor()->file()}) {
    for (int i = 0; i < file->service(0)->method_count(); ++i) {
      methods.push_back(file->service(0)->method(i));
    }
  }
  return methods;
}

std::unique_ptr<google::protobuf::Message> MakeMessage(const google::protobuf::Descriptor* type) {
  return std::unique_ptr<google::protobuf::Message>(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(type)->New());
}

// The answer of a call.
struct Answer {
  grpc::Status status;
  std::vector<std::string> messages;
};

// A server, and the calls of one input.
class Service {
 public:
  Service() {
    static const auto log = std::make_shared<spdlog::logger>("fuzz", std::make_shared<LogCheck>());
    server::ServerOptions options;
    options.service = kOptions;
    static const std::string tokens =
        ScratchFolder::Get().Write("tokens", server::MakeTokenLine("default", kToken, /*is_admin=*/true).value());
    options.security.token_file = tokens;
    absl::StatusOr<std::unique_ptr<server::Server>> server = server::Server::Start(options, log);
    Require(server.ok(), "a server starts:", server.status().ToString());
    server_ = *std::move(server);
    channel_ = server_->InProcessChannel().value();
  }

  void Call(const MethodDescriptor& method, std::vector<std::string> messages) {
    bool is_readable = method.client_streaming() || messages.size() == 1;
    for (std::string& message : messages) {
      is_readable = Rename(*method.input_type(), message) && is_readable;
    }
    const Answer answer = Exchange(method, messages);
    RequireStatus(method, answer.status, is_readable);
    for (const std::string& bytes : answer.messages) {
      const std::unique_ptr<google::protobuf::Message> response = MakeMessage(method.output_type());
      Require(response->ParseFromString(bytes), "an answer is a", method.output_type()->full_name());
      Require(bytes.size() <= server::kMaxSentBytes, "an answer is not too large for its reader");
      if (method.output_type() == v1::CreateSessionResponse::descriptor()) {
        session_ = static_cast<const v1::CreateSessionResponse&>(*response).session().name();
      }
    }
  }

 private:
  // Puts the name of the session where `message` says so; false when it is no message of that type.
  bool Rename(const google::protobuf::Descriptor& type, std::string& message) const {
    const std::unique_ptr<google::protobuf::Message> request = MakeMessage(&type);
    if (!request->ParseFromString(message)) {
      return false;
    }
    if (RenameIn(*request)) {
      message = request->SerializeAsString();
    }
    return true;
  }

  bool RenameIn(google::protobuf::Message& request) const {
    const google::protobuf::Reflection& reflection = *request.GetReflection();
    for (const char* field_name : {"name", "parent"}) {
      if (const auto* field = request.GetDescriptor()->FindFieldByName(field_name); field != nullptr) {
        constexpr std::string_view kPlaceholder = "sessions/0";
        const std::string name = reflection.GetString(request, field);
        if (session_.empty() || !std::string_view(name).starts_with(kPlaceholder)) {
          return false;
        }
        reflection.SetString(&request, field, session_ + name.substr(kPlaceholder.size()));
        return true;
      }
    }
    const auto* session = request.GetDescriptor()->FindFieldByName("session");
    return session != nullptr && reflection.HasField(request, session) &&
           RenameIn(*reflection.MutableMessage(&request, session));
  }

  Answer Exchange(const MethodDescriptor& method, const std::vector<std::string>& messages) {
    grpc::CompletionQueue queue;
    const auto is_done = [&queue] {
      void* tag = nullptr;
      bool ok = false;
      return queue.Next(&tag, &ok) && ok;
    };
    grpc::ClientContext context;
    context.set_deadline(absl::ToChronoTime(absl::Now() + kDeadline));
    context.AddMetadata("authorization", absl::StrCat("Bearer ", kToken));
    grpc::GenericStub stub(channel_);
    const auto call =
        stub.PrepareCall(&context, absl::StrCat("/", method.service()->full_name(), "/", method.name()), &queue);
    call->StartCall(nullptr);
    bool goes_on = is_done();
    for (size_t i = 0; goes_on && i < messages.size(); ++i) {
      const grpc::Slice slice(messages[i]);
      call->Write(grpc::ByteBuffer(&slice, 1), nullptr);
      goes_on = is_done();
    }
    call->WritesDone(nullptr);
    is_done();
    Answer answer;
    for (grpc::ByteBuffer response; call->Read(&response, nullptr), is_done();) {
      grpc::Slice slice;
      Require(response.DumpToSingleSlice(&slice).ok(), "an answer has bytes");
      answer.messages.emplace_back(reinterpret_cast<const char*>(slice.begin()), slice.size());
    }
    call->Finish(&answer.status, nullptr);
    is_done();
    return answer;
  }

  static void RequireStatus(const MethodDescriptor& method, const grpc::Status& status, bool is_readable) {
    const std::string detail =
        absl::StrCat(method.full_name(), ": ", status.error_code(), ": ", status.error_message());
    if (status.ok()) {
      Require(is_readable, "only a request succeeds:", detail);
      return;
    }
    google::rpc::Status details;
    google::rpc::ErrorInfo info;
    v1::ErrorReason reason;
    const bool has_reason = details.ParseFromString(status.error_details()) && details.details_size() > 0 &&
                            details.details(0).UnpackTo(&info) && v1::ErrorReason_Parse(info.reason(), &reason);
    Require(has_reason, "errors have a reason:", detail);
    Require(status.error_code() != grpc::StatusCode::INTERNAL && status.error_code() != grpc::StatusCode::UNKNOWN &&
                status.error_code() != grpc::StatusCode::UNAUTHENTICATED &&
                status.error_code() != grpc::StatusCode::UNAVAILABLE,
            "requests find no fault of the server:", detail);
  }

  std::unique_ptr<server::Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::string session_;  // made last; empty: none
};

}  // namespace
}  // namespace wellspace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace wellspace::fuzz;
  static const std::vector<const MethodDescriptor*> methods = FindMethods();
  ByteReader bytes(data, size);
  Service service;
  while (!bytes.empty()) {
    const MethodDescriptor& method = *methods[static_cast<uint8_t>(bytes.Next() - 'a') % methods.size()];
    std::vector<std::string> messages(bytes.Next() % 4);
    for (std::string& message : messages) {
      message = bytes.TakeBlock();
    }
    if (!method.client_streaming() && messages.size() > 1) {
      messages.resize(1);  // the second one would not be taken
    }
    service.Call(method, std::move(messages));
  }
  return 0;
}
