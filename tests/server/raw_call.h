// Calls of services whose messages are not packaged: bytes in, bytes out.
#ifndef WELLSPACE_TESTS_SERVER_RAW_CALL_H_
#define WELLSPACE_TESTS_SERVER_RAW_CALL_H_

#include <memory>
#include <string>

#include "grpcpp/grpcpp.h"

namespace wellspace::server {

grpc::ByteBuffer BufferOf(const std::string& bytes);
std::string BytesOf(const grpc::ByteBuffer& buffer);

struct RawAnswer {
  grpc::Status status;
  std::string response;  // empty unless the status is OK
};

// The unary call of `path`, "/package.Service/Method".
RawAnswer CallUnary(const std::shared_ptr<grpc::Channel>& channel, const std::string& path, const std::string& request,
                    grpc::ClientContext& context);
RawAnswer CallUnary(const std::shared_ptr<grpc::Channel>& channel, const std::string& path, const std::string& request);

// Of grpc.health.v1: the request has the name of the service as field 1, the response the status as field 1.
std::string HealthRequest(const std::string& service);
inline constexpr char kServing[] = "\x08\x01";
inline constexpr char kNotServing[] = "\x08\x02";

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_RAW_CALL_H_
