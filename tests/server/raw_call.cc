#include "tests/server/raw_call.h"

#include <future>
#include <utility>

#include "grpcpp/generic/generic_stub.h"
#include "gtest/gtest.h"

namespace wellspace::server {

grpc::ByteBuffer BufferOf(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

std::string BytesOf(const grpc::ByteBuffer& buffer) {
  grpc::Slice slice;
  EXPECT_TRUE(buffer.DumpToSingleSlice(&slice).ok());
  return std::string(reinterpret_cast<const char*>(slice.begin()), slice.size());
}

RawAnswer CallUnary(const std::shared_ptr<grpc::Channel>& channel, const std::string& path, const std::string& request,
                    grpc::ClientContext& context) {
  grpc::GenericStub stub(channel);
  const grpc::ByteBuffer request_buffer = BufferOf(request);
  grpc::ByteBuffer response;
  std::promise<grpc::Status> promise;
  stub.UnaryCall(&context, path, grpc::StubOptions(), &request_buffer, &response,
                 [&promise](grpc::Status status) { promise.set_value(std::move(status)); });
  RawAnswer answer{.status = promise.get_future().get(), .response = ""};
  if (answer.status.ok()) {
    answer.response = BytesOf(response);
  }
  return answer;
}

RawAnswer CallUnary(const std::shared_ptr<grpc::Channel>& channel, const std::string& path,
                    const std::string& request) {
  grpc::ClientContext context;
  return CallUnary(channel, path, request, context);
}

std::string HealthRequest(const std::string& service) {
  return service.empty() ? "" : std::string("\x0a") + static_cast<char>(service.size()) + service;
}

}  // namespace wellspace::server
