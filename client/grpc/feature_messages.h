// The features that bound domains as messages: segments and faces, triangles and solids. Private to this folder.
#ifndef WELLSPACE_CLIENT_GRPC_FEATURE_MESSAGES_H_
#define WELLSPACE_CLIENT_GRPC_FEATURE_MESSAGES_H_

#include <cstddef>
#include <optional>

#include "client/types.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::client {

// A rule of a newer server is none.
std::optional<FaceRule> FaceRuleFromProto(v1::FaceRule rule);
// Every rule but those that move something is kRefuse.
CrossingRule CrossingRuleFromProto(v1::CrossingRule rule);

// Makes `chunk` hold the segments from number `first` on, as many as a message of about 256 KiB holds. Returns the
// number after the last.
//
// REQUIRES:   first is the number of a segment.
size_t FillSegments(const Features& features, size_t first, v1::SegmentChunk& chunk);

// The same of seeds; the rules are in every message. REQUIRES: first is at most the number of seeds.
size_t FillFaces(const Features& features, size_t first, v1::FaceOptions& options);

// The same of triangles, and of the options of solids.
size_t FillTriangles(const SurfaceFeatures& surface, size_t first, v1::TriangleChunk& chunk);
size_t FillSurface(const SurfaceFeatures& surface, size_t first, v1::SurfaceOptions& options);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_GRPC_FEATURE_MESSAGES_H_
