// Requests that are compressed.
#ifndef WELLSPACE_SERVER_NETWORK_COMPRESSION_H_
#define WELLSPACE_SERVER_NETWORK_COMPRESSION_H_

#include "grpcpp/server_builder.h"

namespace wellspace::server {

// Has the server of `builder` end calls whose requests are compressed with UNIMPLEMENTED, before it looks at any of
// their messages, and send nothing compressed. gRPC would inflate a message as a whole before its size is compared with
// any limit: 1 MB of any client may be 1 GiB.
void RefuseCompression(grpc::ServerBuilder& builder);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_NETWORK_COMPRESSION_H_
