// A mesh that is brought up to date by the differences of a stream.
#ifndef WELLSPACE_CLIENT_GRPC_DELTA_RECEIVER_H_
#define WELLSPACE_CLIENT_GRPC_DELTA_RECEIVER_H_

#include <cstdint>

#include "absl/status/status.h"
#include "client/types.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::client {

// Takes for each difference its metadata, then its parts in their order; with the last of them the mesh is that which
// the difference makes. Nothing is believed unchecked: checksums are those of the whole arrays.
//
// Thread safety: thread-compatible.
// Invariants: the mesh is whole at all times, and of the revision that it names.
class DeltaReceiver {
 public:
  // REQUIRES:   `mesh` outlives this.
  explicit DeltaReceiver(Mesh& mesh) : mesh_(mesh) {}

  // The stream broke off, and another follows: the differences since mesh.revision, the first from next_part() on.
  void Continue() { expects_metadata_ = true; }

  // Errors:     of both: DATA_LOSS, naming the fault: the answer is damaged, or the mesh is not the one that the
  //             server has had at its revision. A whole download helps.
  absl::Status SetMetadata(const v1::MeshMetadata& metadata);
  absl::Status AddPart(const v1::MeshDelta& part);

  // Whether nothing is missing of the last difference that was begun.
  bool IsWhole() const { return next_part_ == 0 && !is_begun_; }
  // Of the difference that is under way: the revision that it leads to, 0 for none, and the first part that is missing.
  uint64_t revision() const { return is_begun_ ? header_.revision : 0; }
  uint64_t next_part() const { return next_part_; }
  uint64_t part_count() const { return header_.chunk_count; }

 private:
  // Whether the parts so far can be of meshes as large as these.
  absl::Status CheckSizes() const;
  // Makes the mesh that of the difference.
  absl::Status Apply();

  Mesh& mesh_;
  bool expects_metadata_ = true;
  bool is_begun_ = false;
  MeshHeader header_;
  v1::MeshChecksums checksums_;
  v1::MeshDelta delta_;  // the parts that have come
  uint64_t next_part_ = 0;
};

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_GRPC_DELTA_RECEIVER_H_
