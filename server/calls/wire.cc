#include "server/calls/wire.h"

#include "absl/strings/str_cat.h"
#include "grpcpp/support/proto_buffer_reader.h"
#include "grpcpp/support/proto_buffer_writer.h"
#include "server/wire/errors.h"

namespace wellspace::server {

absl::Status ParseRequest(grpc::ByteBuffer* bytes, google::protobuf::Message* message) {
  bool is_parsed = false;
  {
    grpc::ProtoBufferReader reader(bytes);
    is_parsed = reader.status().ok() && message->ParseFromZeroCopyStream(&reader);
  }
  bytes->Clear();
  return is_parsed ? absl::OkStatus()
                   : MakeError(v1::ERROR_REASON_MALFORMED_REQUEST,
                               absl::StrCat("a request is not a serialized ", message->GetTypeName()));
}

grpc::ByteBuffer Serialize(const google::protobuf::Message& message) {
  grpc::ByteBuffer bytes;
  const int size = static_cast<int>(message.ByteSizeLong());
  grpc::ProtoBufferWriter writer(&bytes, grpc::kProtoBufferWriterMaxBufferLength, size);
  message.SerializeToZeroCopyStream(&writer);
  return bytes;
}

}  // namespace wellspace::server
