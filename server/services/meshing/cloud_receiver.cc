#include "server/services/meshing/cloud_receiver.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {

template <typename Request>
absl::Status CloudReceiver::Accept(Request* request) {
  FeaturePart part;
  switch (request->request_case()) {
    case Request::kParameters:
      return AcceptParameters(request->parameters());
    case Request::kPoints:
      return AcceptPoints(request->mutable_points());
    case Request::kSegments:
      part.mutable_segments()->Swap(request->mutable_segments());
      return AcceptFeatures(part, "segments");
    case Request::kFaces:
      part.mutable_faces()->Swap(request->mutable_faces());
      return AcceptFeatures(part, "faces");
    case Request::kTriangles:
      part.mutable_triangles()->Swap(request->mutable_triangles());
      return AcceptFeatures(part, "triangles");
    case Request::kSurface:
      part.mutable_surface()->Swap(request->mutable_surface());
      return AcceptFeatures(part, "surface");
    case Request::kSizeSamples:
      return AcceptSizes(request->mutable_size_samples());
    case Request::REQUEST_NOT_SET:
      break;
  }
  return MakeError(
      v1::ERROR_REASON_EMPTY_REQUEST,
      "a request has neither parameters, points, segments, faces, triangles, surface nor sizes; set one of them",
      "request");
}

template absl::Status CloudReceiver::Accept(v1::MeshPointsRequest*);
template absl::Status CloudReceiver::Accept(v1::EstimateMeshRequest*);

absl::Status CloudReceiver::AcceptEnd() {
  if (!has_parameters_) {
    return MakeError(v1::ERROR_REASON_PARAMETERS_MISSING,
                     "the stream ended before any request; send the parameters first", "parameters");
  }
  return ValidateFor(features_.InputOf({}), parameters_);
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

absl::Status CloudReceiver::CheckCount(uint64_t count, const char* what) const {
  return count <= options_.max_points ? absl::OkStatus()
                                      : MakeError(v1::ERROR_REASON_TOO_MANY_POINTS,
                                                  absl::StrCat("at least ", count, " ", what,
                                                               "; this server accepts at most ", options_.max_points));
}

absl::Status CloudReceiver::AcceptFeatures(const FeaturePart& part, const char* field) {
  if (!has_parameters_) {
    return MakeError(v1::ERROR_REASON_PARAMETERS_MISSING,
                     absl::StrCat(field, " came before the parameters; send the parameters first"), "parameters");
  }
  const FeatureCounts first = features_.counts();
  WELLSPACE_RETURN_IF_ERROR(CheckFeatures(part, first, parameters_.dimension));
  const FeatureCounts all = first + CountsOf(part);
  WELLSPACE_RETURN_IF_ERROR(CheckCount(all.segments, "segments"));
  WELLSPACE_RETURN_IF_ERROR(CheckCount(all.triangles, "triangles"));
  WELLSPACE_RETURN_IF_ERROR(CheckCount(all.seeds, "seeds"));
  features_.Append(part);
  return absl::OkStatus();
}

absl::Status CloudReceiver::AcceptSizes(v1::SizeSamples* chunk) {
  if (!has_parameters_) {
    return MakeError(v1::ERROR_REASON_PARAMETERS_MISSING,
                     "size_samples came before the parameters; send the parameters first", "parameters");
  }
  WELLSPACE_RETURN_IF_ERROR(CheckSizes(*chunk, sizes_.count(), parameters_.dimension, "size_samples"));
  WELLSPACE_RETURN_IF_ERROR(CheckCount(sizes_.count() + chunk->sizes_size(), "samples of sizes"));
  sizes_.Append(chunk);
  return absl::OkStatus();
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
  WELLSPACE_RETURN_IF_ERROR(CheckCount(total, "points"));
  points_.Append(chunk->mutable_coordinates());
  point_count_ = total;
  return absl::OkStatus();
}

}  // namespace wellspace::server
