// Segments and faces as messages. Private to this folder.
#ifndef WELLSPACE_CLIENT_GRPC_FEATURE_MESSAGES_H_
#define WELLSPACE_CLIENT_GRPC_FEATURE_MESSAGES_H_

#include <cstddef>

#include "client/types.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::client {

// Makes `chunk` hold the segments from number `first` on, as many as a message of about 256 KiB holds. Returns the
// number after the last.
//
// REQUIRES:   first is the number of a segment.
size_t FillSegments(const Features& features, size_t first, v1::SegmentChunk& chunk);

// The same of seeds; the rules are in every message. REQUIRES: first is at most the number of seeds.
size_t FillFaces(const Features& features, size_t first, v1::FaceOptions& options);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_GRPC_FEATURE_MESSAGES_H_
