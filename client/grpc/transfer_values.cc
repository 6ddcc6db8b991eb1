// QueryService.TransferValues on the client's side.
#include <algorithm>
#include <cmath>
#include <thread>

#include "absl/strings/str_cat.h"
#include "client/grpc/convert.h"
#include "client/grpc/grpc_connection.h"
#include "client/grpc/mesh_values.h"
#include "core/base/status_macros.h"

namespace wellspace::client {
namespace {

using TransferStream = grpc::ClientReaderWriter<v1::TransferValuesRequest, v1::TransferValuesResponse>;

v1::TransferValuesRequest FirstRequest(const std::string& session, const TransferOptions& options) {
  v1::TransferValuesRequest request;
  v1::TransferValuesRequest::Start& start = *request.mutable_start();
  start.set_name(session);
  start.set_from_revision(options.from_revision);
  if (options.revision.has_value()) {
    start.set_revision(*options.revision);
  }
  start.set_place(options.place == FieldPlace::kVertices ? v1::FIELD_PLACE_VERTICES : v1::FIELD_PLACE_SIMPLICES);
  start.set_components(static_cast<uint32_t>(options.components));
  start.set_conservative(options.conservative);
  return request;
}

// Sends all and half-closes. Stops early when the call has ended; its status says why.
void SendValues(v1::TransferValuesRequest request, std::span<const double> values, size_t components,
                TransferStream& stream) {
  if (!stream.Write(request)) {
    return;
  }
  const size_t part = RowsOfARequest(components) * components;
  for (size_t done = 0; done < values.size(); done += part) {
    const std::span<const double> next = values.subspan(done, std::min(part, values.size() - done));
    request.mutable_values()->mutable_values()->Assign(next.begin(), next.end());
    if (!stream.Write(request)) {
      return;
    }
  }
  stream.WritesDone();
}

// Checks the answers, one after the other.
class ValuesReceiver {
 public:
  explicit ValuesReceiver(const TransferOptions& options) : options_(options) {}

  absl::Status Take(const v1::TransferValuesResponse& response) {
    if (response.has_start() == has_start_) {
      return Contradiction(has_start_ ? "a second start of values" : "values without a start");
    }
    if (response.has_start()) {
      return TakeStart(response.start());
    }
    const auto& values = response.values().values();
    if (static_cast<uint64_t>(values.size()) > wanted_ - result_.values.size()) {
      return Contradiction("more than ", wanted_, " values");
    }
    if (!std::ranges::all_of(values, [](double value) { return std::isfinite(value); })) {
      return Contradiction("a value that is not finite");
    }
    result_.values.insert(result_.values.end(), values.begin(), values.end());
    return absl::OkStatus();
  }

  absl::Status Finish(TransferredValues* result) {
    if (!has_start_ || result_.values.size() != wanted_) {
      return Contradiction(result_.values.size(), " of ", wanted_, " values");
    }
    *result = std::move(result_);
    return absl::OkStatus();
  }

 private:
  absl::Status TakeStart(const v1::TransferValuesResponse::Start& start) {
    if (start.revision() == 0 || (options_.revision.has_value() && *options_.revision != start.revision())) {
      return Contradiction("values on the mesh of revision ", start.revision(), ", not ",
                           options_.revision.value_or(0));
    }
    if (start.row_count() > uint64_t{1} << 40) {
      return Contradiction("values of ", start.row_count(), " rows");
    }
    has_start_ = true;
    wanted_ = start.row_count() * options_.components;
    result_.revision = start.revision();
    result_.outside_count = start.outside_count();
    return absl::OkStatus();
  }

  const TransferOptions& options_;
  TransferredValues result_;
  uint64_t wanted_ = 0;
  bool has_start_ = false;
};

}  // namespace

absl::StatusOr<TransferredValues> GrpcConnection::TransferValues(const std::string& session,
                                                                 std::span<const double> values,
                                                                 const TransferOptions& options,
                                                                 const CallOptions& call) {
  if (options.components == 0 || options.components > 64 || values.size() % options.components != 0) {
    return absl::InvalidArgumentError(absl::StrCat("there are ", values.size(), " values in rows of ",
                                                   options.components, "; expected whole rows of 1 to 64"));
  }
  TransferredValues result;
  const absl::Status status = RunOn(session, call, [&](const Server& server, Attempt& attempt) -> absl::Status {
    CallContext context(attempt);
    const std::unique_ptr<TransferStream> stream = server.queries->TransferValues(context.get());
    // Values go up while answers may come down: the server may fail the call before it has all.
    std::jthread sender([&] { SendValues(FirstRequest(session, options), values, options.components, *stream); });
    ValuesReceiver receiver(options);
    absl::Status damage;
    v1::TransferValuesResponse response;
    while (damage.ok() && stream->Read(&response)) {
      damage = receiver.Take(response);
    }
    if (!damage.ok()) {
      context.Cancel();
    }
    sender.join();
    const absl::Status ended = FromGrpcStatus(stream->Finish());
    if (!damage.ok()) {
      return attempt.Final(damage);
    }
    WELLSPACE_RETURN_IF_ERROR(ended);
    return attempt.Final(receiver.Finish(&result));
  });
  if (!status.ok()) {
    return status;
  }
  return result;
}

}  // namespace wellspace::client
