// Sizes at points as messages. Private to this folder.
#ifndef WELLSPACE_CLIENT_GRPC_SIZE_MESSAGES_H_
#define WELLSPACE_CLIENT_GRPC_SIZE_MESSAGES_H_

#include <cstddef>

#include "client/types.h"
#include "wellspace/v1/mesh.pb.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::client {

// Makes `chunk` hold the samples from number `first` on, as many as a message of 1 MiB holds. Returns the
// number after the last. Samples with other than `dimension` coordinates for each size go as they are, in one message:
// the server refuses them.
size_t FillSizes(const SizeSamples& samples, int dimension, size_t first, v1::SizeSamples& chunk);

// The same of sizes of vertices.
size_t FillSizes(const VertexSizes& sizes, size_t first, v1::VertexSizes& chunk);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_GRPC_SIZE_MESSAGES_H_
