// Between messages and their bytes, for calls that read and write bytes themselves.
#ifndef WELLSPACE_SERVER_CALLS_WIRE_H_
#define WELLSPACE_SERVER_CALLS_WIRE_H_

#include "absl/status/status.h"
#include "google/protobuf/message.h"
#include "grpcpp/support/byte_buffer.h"

namespace wellspace::server {

// Reads `message` from `bytes`, which is left empty. gRPC, were it to do this for a stream, would take bytes that are
// no message for the end of the stream.
//
// Errors:     MALFORMED_REQUEST.
absl::Status ParseRequest(grpc::ByteBuffer* bytes, google::protobuf::Message* message);

grpc::ByteBuffer Serialize(const google::protobuf::Message& message);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_CALLS_WIRE_H_
