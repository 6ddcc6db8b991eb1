// The real server among clients that compress their requests: it inflates nothing, of any size.
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/client.h"
#include "gmock/gmock.h"
#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/grpcpp.h"
#include "gtest/gtest.h"
#include "tests/server/daemon.h"
#include "tests/server/raw_call.h"
#include "tests/server/service_methods.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

constexpr grpc_compression_algorithm kAlgorithms[] = {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE};

// The server's memory without any work, and some room; far less than one bomb inflated.
constexpr uint64_t kMostMemory = uint64_t{128} << 20;
constexpr size_t kBombMiB = 192;

// Zeros, of which the client holds one MiB, and compresses them to a thousandth.
grpc::ByteBuffer Bomb() {
  const grpc::Slice zeros(std::string(size_t{1} << 20, '\0'));
  const std::vector<grpc::Slice> slices(kBombMiB, zeros);
  return {slices.data(), slices.size()};
}

class CompressedRequests : public ::testing::Test {
 protected:
  ~CompressedRequests() override {
    EXPECT_EQ(MeshTriangle(daemon_.Client()), absl::OkStatus());
    daemon_.Stop();
  }

  std::shared_ptr<grpc::Channel> ChannelThatCompresses(grpc_compression_algorithm algorithm,
                                                       const std::string& address) {
    grpc::ChannelArguments arguments;
    arguments.SetCompressionAlgorithm(algorithm);
    return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
  }

  static void ExpectRefused(const std::shared_ptr<grpc::Channel>& channel, const std::string& path) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(1));
    const grpc::Status status = CallUnary(channel, path, std::string(2000, '\0'), context).status;
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED) << path << ": " << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr("ompression algorithm")) << path;
  }

  Daemon daemon_{{"--admin-listen", "127.0.0.1:0"}};
};

TEST_F(CompressedRequests, OfAClientThatCompressesByDefaultAreRefusedByEveryMethod) {
  for (const grpc_compression_algorithm algorithm : kAlgorithms) {
    const std::shared_ptr<grpc::Channel> channel = ChannelThatCompresses(algorithm, daemon_.address());
    for (const google::protobuf::MethodDescriptor* method : ServiceMethods()) {
      ExpectRefused(channel, PathOf(*method));
    }
    ExpectRefused(channel, "/grpc.health.v1.Health/Check");
    ExpectRefused(channel, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo");
  }
}

TEST_F(CompressedRequests, AreRefusedByTheListenerOfChannelz) {
  const std::string line = daemon_.process().ReadLine();
  ASSERT_THAT(line, HasSubstr("admin on "));
  for (const grpc_compression_algorithm algorithm : kAlgorithms) {
    ExpectRefused(ChannelThatCompresses(algorithm, line.substr(line.rfind(' ') + 1)),
                  "/grpc.channelz.v1.Channelz/GetServers");
  }
}

TEST_F(CompressedRequests, AreNotInflated) {
  for (const grpc_compression_algorithm algorithm : kAlgorithms) {
    grpc::GenericStub stub(ChannelThatCompresses(algorithm, daemon_.address()));
    for (const std::string path : {"/wellspace.v1.SessionService/GetSession", "/wellspace.v1.MeshingService/MeshPoints",
                                   "/grpc.health.v1.Health/Check"}) {
      grpc::ClientContext context;
      context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(1));
      grpc::CompletionQueue queue;
      grpc::ByteBuffer response;
      grpc::Status status;
      const auto call = stub.PrepareUnaryCall(&context, path, Bomb(), &queue);
      call->StartCall();
      call->Finish(&response, &status, nullptr);
      void* tag = nullptr;
      bool ok = false;
      ASSERT_TRUE(queue.Next(&tag, &ok));
      EXPECT_EQ(status.error_code(), grpc::StatusCode::UNIMPLEMENTED) << path << ": " << status.error_message();
    }
  }
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  EXPECT_LT(daemon_.process().PeakMemory(), kMostMemory);
#endif
}

}  // namespace
}  // namespace wellspace::server
