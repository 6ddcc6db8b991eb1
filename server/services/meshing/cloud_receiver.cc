#include "server/services/meshing/cloud_receiver.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {

void PointChunks::Append(google::protobuf::RepeatedField<double>* coordinates) {
  if (coordinates->empty()) {
    return;  // endless empty chunks must not cost memory
  }
  coordinate_count_ += coordinates->size();
  chunks_.emplace_back().Swap(coordinates);
}

std::vector<double> PointChunks::Copy() const {
  std::vector<double> coordinates;
  coordinates.reserve(coordinate_count_);
  for (const google::protobuf::RepeatedField<double>& chunk : chunks_) {
    coordinates.insert(coordinates.end(), chunk.begin(), chunk.end());
  }
  return coordinates;
}

std::vector<double> PointChunks::Flatten(const core::RunContext& context) {
  std::vector<double> coordinates;
  coordinates.reserve(coordinate_count_);
  while (!chunks_.empty() && !context.IsCancelled()) {
    coordinates.insert(coordinates.end(), chunks_.front().begin(), chunks_.front().end());
    chunks_.pop_front();
  }
  coordinate_count_ = 0;
  return coordinates;
}

template <typename Request>
absl::Status CloudReceiver::Accept(Request* request) {
  switch (request->request_case()) {
    case Request::kParameters:
      return AcceptParameters(request->parameters());
    case Request::kPoints:
      return AcceptPoints(request->mutable_points());
    case Request::kSegments:
      return AcceptFeatures(request->segments(), "segments");
    case Request::kFaces:
      return AcceptFeatures(request->faces(), "faces");
    case Request::REQUEST_NOT_SET:
      break;
  }
  return MakeError(v1::ERROR_REASON_EMPTY_REQUEST,
                   "a request has neither parameters, points, segments nor faces; set one of them", "request");
}

template absl::Status CloudReceiver::Accept(v1::MeshPointsRequest*);
template absl::Status CloudReceiver::Accept(v1::EstimateMeshRequest*);

absl::Status CloudReceiver::AcceptEnd() const {
  if (!has_parameters_) {
    return MakeError(v1::ERROR_REASON_PARAMETERS_MISSING,
                     "the stream ended before any request; send the parameters first", "parameters");
  }
  return absl::OkStatus();
}

absl::Status CloudReceiver::AcceptParameters(const v1::MeshParameters& message) {
  if (has_parameters_) {
    return MakeError(v1::ERROR_REASON_PARAMETERS_REPEATED,
                     "the parameters came a second time; send them once, in the first request", "parameters");
  }
  WELLSPACE_ASSIGN_OR_RETURN(parameters_, ParametersFromProto(message, options_));
  has_parameters_ = true;
  return absl::OkStatus();
}

template <typename Part>
absl::Status CloudReceiver::AcceptFeatures(const Part& part, const char* field) {
  if (!has_parameters_) {
    return MakeError(v1::ERROR_REASON_PARAMETERS_MISSING,
                     absl::StrCat(field, " came before the parameters; send the parameters first"), "parameters");
  }
  if (parameters_.dimension != 2) {
    return MakeError(
        v1::ERROR_REASON_INVALID_SEGMENTS,
        absl::StrCat(field, " bound domains in 2-D alone, and parameters.dimension is ", parameters_.dimension), field);
  }
  return features_.Accept(part);
}

absl::Status CloudReceiver::AcceptPoints(v1::PointChunk* chunk) {
  if (!has_parameters_) {
    return MakeError(v1::ERROR_REASON_PARAMETERS_MISSING,
                     "points came before the parameters; send the parameters first", "parameters");
  }
  const int count = chunk->coordinates_size();
  if (count % parameters_.dimension != 0) {
    return MakeError(v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
                     absl::StrCat("the chunk after point ", point_count_, " has ", count,
                                  " coordinates; expected a multiple of the dimension ", parameters_.dimension),
                     "points.coordinates");
  }
  const uint64_t total = point_count_ + count / parameters_.dimension;
  if (total > options_.max_points) {
    return MakeError(v1::ERROR_REASON_TOO_MANY_POINTS,
                     absl::StrCat("at least ", total, " points; this server accepts at most ", options_.max_points));
  }
  points_.Append(chunk->mutable_coordinates());
  point_count_ = total;
  return absl::OkStatus();
}

}  // namespace wellspace::server
