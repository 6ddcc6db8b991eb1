#include "client/error_details.h"

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace wellspace::client {
namespace {

template <typename Message>
std::optional<Message> DetailOf(const absl::Status& status) {
  Message message;
  const absl::optional<absl::Cord> payload =
      status.GetPayload(absl::StrCat("type.googleapis.com/", message.GetTypeName()));
  if (!payload.has_value() || !message.ParseFromString(std::string(*payload))) {
    return std::nullopt;
  }
  return message;
}

}  // namespace

std::string BlamedField(const absl::Status& status) {
  const std::optional<google::rpc::BadRequest> detail = DetailOf<google::rpc::BadRequest>(status);
  return detail.has_value() && !detail->field_violations().empty() ? detail->field_violations(0).field() : "";
}

std::string ReasonOf(const absl::Status& status) {
  const std::optional<google::rpc::ErrorInfo> detail = DetailOf<google::rpc::ErrorInfo>(status);
  return detail.has_value() ? detail->reason() : "";
}

std::string OwnerAddressOf(const absl::Status& status) {
  const std::optional<google::rpc::ErrorInfo> detail = DetailOf<google::rpc::ErrorInfo>(status);
  if (!detail.has_value() || detail->reason() != "ERROR_REASON_SESSION_ELSEWHERE") {
    return "";
  }
  const auto address = detail->metadata().find("address");
  return address == detail->metadata().end() ? "" : address->second;
}

std::optional<absl::Duration> RetryDelayOf(const absl::Status& status) {
  const std::optional<google::rpc::RetryInfo> detail = DetailOf<google::rpc::RetryInfo>(status);
  if (!detail.has_value()) {
    return std::nullopt;
  }
  return absl::Seconds(detail->retry_delay().seconds()) + absl::Nanoseconds(detail->retry_delay().nanos());
}

absl::Status WithMessage(const absl::Status& status, std::string_view message) {
  absl::Status other(status.code(), absl::string_view(message.data(), message.size()));
  status.ForEachPayload([&](absl::string_view type, const absl::Cord& payload) { other.SetPayload(type, payload); });
  return other;
}

void AddDetails(const google::rpc::Status& details, absl::Status& status) {
  for (const google::protobuf::Any& detail : details.details()) {
    status.SetPayload(detail.type_url(), absl::Cord(detail.value()));
  }
}

}  // namespace wellspace::client
