// Requests that a client may send in one call, through the server's checks and into the mesher.
//
// Input: requests, each as its length in two bytes, low one first, and that many bytes of a serialized
// MeshPointsRequest.
#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "server/calls/wire.h"
#include "server/services/meshing/cloud_receiver.h"
#include "server/wire/errors.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/mesh_check.h"
#include "wellspace/v1/errors.pb.h"
#include "wellspace/v1/meshing.pb.h"

namespace wellspace::fuzz {
namespace {

// Small, so that short inputs reach the limits.
const server::ServiceOptions kOptions = {.max_threads = 2, .max_points = 16, .max_vertices = 500};

void RequireError(const absl::Status& refusal) {
  const grpc::Status status = server::ToGrpcStatus(refusal);
  Require(status.error_code() == grpc::StatusCode::INVALID_ARGUMENT ||
              status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED,
          "a refusal is an INVALID_ARGUMENT or a RESOURCE_EXHAUSTED:", status.error_message());
  google::rpc::Status details;
  google::rpc::ErrorInfo info;
  v1::ErrorReason reason;
  Require(details.ParseFromString(status.error_details()) && details.details_size() > 0 &&
              details.details(0).UnpackTo(&info) && v1::ErrorReason_Parse(info.reason(), &reason),
          "a refusal carries its reason:", status.error_message());
}

void RequireInvariants(const server::CloudReceiver& receiver) {
  Require(receiver.point_count() <= kOptions.max_points, "max_points is kept");
  if (receiver.has_parameters()) {
    const core::MeshParameters& parameters = receiver.parameters();
    const absl::Status valid = core::ValidateParameters(parameters);
    Require(valid.ok(), "accepted parameters are valid:", valid.ToString());
    Require(parameters.threads <= kOptions.max_threads, "max_threads is kept");
    Require(parameters.max_vertices >= 1 && parameters.max_vertices <= kOptions.max_vertices, "max_vertices is kept");
  }
}

// As the network may bring it.
grpc::ByteBuffer InSlices(std::string_view message) {
  constexpr size_t kSliceBytes = 7;
  std::vector<grpc::Slice> slices;
  for (; !message.empty(); message.remove_prefix(slices.back().size())) {
    slices.emplace_back(message.data(), std::min(kSliceBytes, message.size()));
  }
  return {slices.data(), slices.size()};
}

// Feeds the requests to `receiver` and collects the coordinates in `sent`. False when the call ended with an error.
bool ReceiveAll(ByteReader& bytes, server::CloudReceiver& receiver, std::vector<double>& sent) {
  while (!bytes.empty()) {
    grpc::ByteBuffer buffer = InSlices(bytes.TakeBlock());
    v1::MeshPointsRequest request;
    if (const absl::Status status = server::ParseRequest(&buffer, &request); !status.ok()) {
      RequireError(status);
      return false;
    }
    sent.insert(sent.end(), request.points().coordinates().begin(), request.points().coordinates().end());
    if (const absl::Status status = receiver.Accept(&request); !status.ok()) {
      RequireError(status);
      return false;
    }
    RequireInvariants(receiver);
  }
  if (const absl::Status status = receiver.AcceptEnd(); !status.ok()) {
    RequireError(status);
    return false;
  }
  return true;
}

}  // namespace
}  // namespace wellspace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace wellspace;
  fuzz::ByteReader bytes(data, size);
  server::CloudReceiver receiver(fuzz::kOptions);
  std::vector<double> sent;
  if (!fuzz::ReceiveAll(bytes, receiver, sent)) {
    return 0;
  }
  fuzz::Require(receiver.has_parameters(), "a complete call has parameters");
  receiver.FlattenSizes(core::RunContext());
  server::NumberChunks chunks = receiver.TakePoints();
  fuzz::Require(chunks.count() == receiver.point_count() * receiver.parameters().dimension, "coordinates are counted");
  const std::vector<double> points = chunks.Flatten(core::RunContext());
  fuzz::Require(points.size() == sent.size() &&
                    (sent.empty() || std::memcmp(points.data(), sent.data(), sent.size() * sizeof(double)) == 0),
                "points arrive in order and to the bit");
  fuzz::RequireMeshOrRefusal(receiver.parameters(), points);
  return 0;
}
