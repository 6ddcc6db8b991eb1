// Messages of the service from and to the types of the library. Private to this folder.
#ifndef WELLSPACE_CLIENT_GRPC_CONVERT_H_
#define WELLSPACE_CLIENT_GRPC_CONVERT_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/types.h"
#include "wellspace/v1/mesh.pb.h"
#include "wellspace/v1/meshing.pb.h"
#include "wellspace/v1/operations.pb.h"
#include "wellspace/v1/progress.pb.h"
#include "wellspace/v1/queries.pb.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::client {

void SetParameters(const MeshOptions& options, v1::MeshParameters* parameters);
void SetDuration(absl::Duration duration, google::protobuf::Duration* message);

MeshOptions OptionsFromProto(const v1::MeshParameters& parameters);
Progress ProgressFromProto(const v1::ProgressEvent& event);
MeshHeader HeaderFromProto(const v1::MeshMetadata& metadata);
ServerInfo InfoFromProto(const v1::GetServerInfoResponse& response);
// Errors:     DATA_LOSS for a dimension that no space has.
absl::StatusOr<Session> SessionFromProto(const v1::Session& message);
Operation OperationFromProto(const v1::Operation& message);
// UNSPECIFIED for kUnknown.
v1::Operation::State StateToProto(OperationState state);
absl::Duration DurationFromProto(const google::protobuf::Duration& message);

// Whether another page may follow that of `token`.
//
// Errors:     DATA_LOSS for the same page again, which would never end.
absl::Status CheckNextPage(const std::string& token, const std::string& next);
// Has a request for a list ask for `page`.
template <typename Request>
void SetPage(const PageOptions& page, Request& request) {
  if (page.page_size.has_value()) {
    request.set_page_size(*page.page_size);
  }
  request.set_page_token(page.page_token);
}

// Errors:     DATA_LOSS when the counts do not fit the arrays, or a number is none.
absl::StatusOr<CellBatch> CellsFromProto(const v1::VoronoiCellBatch& message);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_GRPC_CONVERT_H_
