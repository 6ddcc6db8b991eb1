// Messages that are none, or of another type, to every method of the real server.
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/client.h"
#include "gmock/gmock.h"
#include "google/protobuf/io/coded_stream.h"
#include "google/protobuf/io/zero_copy_stream_impl_lite.h"
#include "gtest/gtest.h"
#include "server/base/options.h"
#include "tests/server/daemon.h"
#include "tests/server/raw_call.h"
#include "tests/server/raw_http2.h"
#include "tests/server/service_harness.h"
#include "tests/server/service_methods.h"
#include "wellspace/v1/admin.pb.h"

namespace wellspace::server {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::MethodDescriptor;
using ::testing::Ge;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

// Wire types of protocol buffers.
enum WireType : uint32_t { kVarint = 0, kFixed64 = 1, kBytes = 2, kGroup = 3, kEndGroup = 4, kFixed32 = 5 };

std::string Varint(uint64_t value) {
  std::string bytes;
  google::protobuf::io::StringOutputStream stream(&bytes);
  google::protobuf::io::CodedOutputStream(&stream).WriteVarint64(value);
  return bytes;
}

std::string Tag(int field, WireType type) { return Varint(static_cast<uint32_t>(field) << 3 | type); }

std::string Bytes(int field, const std::string& content) {
  return Tag(field, kBytes) + Varint(content.size()) + content;
}

// Bytes of field `field` that say they are `length`.
std::string BytesOfLength(int field, uint64_t length, const std::string& content) {
  return Tag(field, kBytes) + Varint(length) + content;
}

// Bytes that are no message of any type.
std::vector<std::string> NoMessages() {
  return {
      std::string(5, '\xff'),                      // a tag without end
      std::string(11, '\xff'),                     // a longer one
      std::string("\x00", 1),                      // the field 0
      std::string("\x0c", 1),                      // the end of a group that did not begin
      std::string("\x0b", 1),                      // a group without end
      std::string("\x0e", 1),                      // a wire type that there is not
      Tag(1, kVarint) + std::string(10, '\xff'),   // a number without end
      Tag(1000, kFixed64) + "1234",                // ends within a number
      BytesOfLength(1, 100, "abc"),                // ends within bytes
      BytesOfLength(1000, 0xffffffff, "abc"),      // more than any message has
      BytesOfLength(1, uint64_t{1} << 63, "abc"),  // more than there is
      std::string(100'000, '\x0b'),                // groups in groups in groups
  };
}

// `content` as the value of `path`, the fields from the request inwards.
std::string Wrap(const std::vector<const FieldDescriptor*>& path, std::string content) {
  for (auto field = path.rbegin(); field != path.rend(); ++field) {
    content = Bytes((*field)->number(), content);
  }
  return content;
}

// Calls `visit` for every field of `type` and of the messages within, with the path to it.
template <typename Visit>
void ForEachField(const Descriptor& type, const Visit& visit, std::vector<const FieldDescriptor*> path = {}) {
  constexpr size_t kMaxDepth = 4;
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& field = *type.field(i);
    visit(field, path);
    if (field.message_type() != nullptr && path.size() < kMaxDepth) {
      std::vector<const FieldDescriptor*> deeper = path;
      deeper.push_back(&field);
      ForEachField(*field.message_type(), visit, deeper);
    }
  }
}

class MalformedMessages : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    daemon_ = std::make_unique<Daemon>();
    channel_ = grpc::CreateChannel(daemon_->address(), grpc::InsecureChannelCredentials());
  }
  static void TearDownTestSuite() {
    if (daemon_ != nullptr) {
      daemon_->Stop();
    }
    channel_.reset();
    daemon_.reset();
  }

  ~MalformedMessages() override { EXPECT_EQ(MeshTriangle(daemon_->Client()), absl::OkStatus()); }

  // The end of a call of `method` with one message of these bytes.
  static grpc::Status Call(const MethodDescriptor& method, const std::string& bytes) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(1));
    return CallUnary(channel_, PathOf(method), bytes, context).status;
  }

  // Of bytes that protocol buffers do not read.
  static void ExpectMalformed(const MethodDescriptor& method, const std::string& bytes) {
    const std::unique_ptr<google::protobuf::Message> message = MakeMessage(*method.input_type());
    ASSERT_FALSE(message->ParseFromString(bytes)) << method.full_name();
    const grpc::Status status = Call(method, bytes);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT)
        << method.full_name() << ": " << status.error_message();
    EXPECT_EQ(DetailsOf(status).reason, "MALFORMED_REQUEST") << method.full_name();
  }

  // Of bytes that protocol buffers read, whatever they mean: the call succeeds or is refused with a reason. Here no
  // caller is an admin.
  static void ExpectHandled(const MethodDescriptor& method, const std::string& bytes) {
    const std::unique_ptr<google::protobuf::Message> message = MakeMessage(*method.input_type());
    ASSERT_TRUE(message->ParseFromString(bytes)) << method.full_name();
    const grpc::Status status = Call(method, bytes);
    if (!status.ok()) {
      const bool is_for_admins = method.service() == v1::GetUsageRequest::descriptor()->file()->service(0);
      EXPECT_EQ(status.error_code(),
                is_for_admins ? grpc::StatusCode::PERMISSION_DENIED : grpc::StatusCode::INVALID_ARGUMENT)
          << method.full_name() << ": " << status.error_message();
      EXPECT_THAT(DetailsOf(status).reason, Not(IsEmpty())) << method.full_name() << ": " << status.error_message();
    }
  }

  static std::unique_ptr<Daemon> daemon_;
  static std::shared_ptr<grpc::Channel> channel_;
};

std::unique_ptr<Daemon> MalformedMessages::daemon_;
std::shared_ptr<grpc::Channel> MalformedMessages::channel_;

TEST_F(MalformedMessages, BytesThatAreNoMessage) {
  ASSERT_THAT(ServiceMethods(), SizeIs(Ge(19)));
  for (const MethodDescriptor* method : ServiceMethods()) {
    for (const std::string& bytes : NoMessages()) {
      ExpectMalformed(*method, bytes);
    }
  }
}

TEST_F(MalformedMessages, PackedFieldsThatAreCutWithinANumber) {
  int fields = 0;
  for (const MethodDescriptor* method : ServiceMethods()) {
    ForEachField(*method->input_type(), [&](const FieldDescriptor& field, const auto& path) {
      if (!field.is_packed()) {
        return;
      }
      ++fields;
      ExpectMalformed(*method, Wrap(path, Bytes(field.number(), "12345\xff")));
      ExpectMalformed(*method, Wrap(path, BytesOfLength(field.number(), 1 << 30, "12345678")));
    });
  }
  EXPECT_GE(fields, 10);
}

TEST_F(MalformedMessages, TextThatIsNoUtf8) {
  int fields = 0;
  for (const MethodDescriptor* method : ServiceMethods()) {
    ForEachField(*method->input_type(), [&](const FieldDescriptor& field, const auto& path) {
      if (field.type() == FieldDescriptor::TYPE_STRING) {
        ++fields;
        ExpectMalformed(*method, Wrap(path, Bytes(field.number(), "a\xff\xfe")));
      }
    });
  }
  EXPECT_GE(fields, 15);
}

TEST_F(MalformedMessages, FieldsOfWrongWireTypesAreUnknownOnes) {
  for (const MethodDescriptor* method : ServiceMethods()) {
    ForEachField(*method->input_type(), [&](const FieldDescriptor& field, const auto& path) {
      const bool is_fixed64 = field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE;
      ExpectHandled(*method, Wrap(path, is_fixed64 ? Tag(field.number(), kFixed32) + "1234"
                                                   : Tag(field.number(), kFixed64) + "12345678"));
    });
    ExpectHandled(*method, Bytes(1000, std::string(1000, 'x')));
    ExpectHandled(*method, Tag((1 << 29) - 1, kVarint) + Varint(~uint64_t{0}));
  }
}

TEST_F(MalformedMessages, ValuesAtTheirLimits) {
  for (const MethodDescriptor* method : ServiceMethods()) {
    ForEachField(*method->input_type(), [&](const FieldDescriptor& field, const auto& path) {
      const std::string ones(8, '\xff');
      switch (field.cpp_type()) {
        case FieldDescriptor::CPPTYPE_DOUBLE:
          ExpectHandled(*method, Wrap(path, Tag(field.number(), kFixed64) + ones));
          ExpectHandled(*method, Wrap(path, Tag(field.number(), kFixed64) + std::string("\0\0\0\0\0\0\xf0\x7f", 8)));
          break;
        case FieldDescriptor::CPPTYPE_STRING:
          ExpectHandled(*method, Wrap(path, Bytes(field.number(), std::string(100'000, 'x'))));
          ExpectHandled(*method, Wrap(path, Bytes(field.number(), std::string("\0\n\x7f", 3))));
          break;
        case FieldDescriptor::CPPTYPE_MESSAGE:
          ExpectHandled(*method, Wrap(path, Bytes(field.number(), "")));
          break;
        default:
          if (field.type() != FieldDescriptor::TYPE_FIXED32) {
            for (const uint64_t value : {~uint64_t{0}, uint64_t{1} << 31, uint64_t{1} << 63}) {
              ExpectHandled(*method, Wrap(path, Tag(field.number(), kVarint) + Varint(value)));
            }
          }
      }
    });
  }
}

TEST_F(MalformedMessages, MessagesAboveTheLimit) {
  const std::string bytes = Bytes(1000, std::string(kMaxRequestBytes, 'x'));
  for (const MethodDescriptor* method : ServiceMethods()) {
    const grpc::Status status = Call(*method, bytes);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED)
        << method->full_name() << ": " << status.error_message();
  }
}

// A connection with a call of `method` whose data begin with these bytes.
RawConnection BeginWith(const std::string& address, const MethodDescriptor& method, const std::string& bytes,
                        bool half_closes) {
  RawConnection connection(address);
  EXPECT_TRUE(connection.Begin());
  connection.Send(BeginCall(1, PathOf(method)));
  connection.Send(Frame{
      .type = Frame::kData, .flags = half_closes ? Frame::kEndStream : uint8_t{0}, .stream = 1, .payload = bytes});
  return connection;
}

TEST_F(MalformedMessages, FramesThatLie) {
  constexpr uint8_t kCompressed = 1;
  const std::string compressed = GrpcMessage("abc", std::nullopt, kCompressed);
  const std::string cut = GrpcMessage("abc", 100);
  const std::string cut_in_its_frame("\0\0", 2);
  for (const MethodDescriptor* method : ServiceMethods()) {
    for (const std::string& bytes : {compressed, cut, cut_in_its_frame}) {
      RawConnection connection = BeginWith(daemon_->address(), *method, bytes, /*half_closes=*/true);
      EXPECT_EQ(connection.ReadStatus(1), grpc::StatusCode::INVALID_ARGUMENT) << method->full_name();
      EXPECT_TRUE(connection.IsAlive()) << method->full_name();
    }
    for (const uint32_t length : {0xffffffffu, kMaxRequestBytes + 1u}) {
      EXPECT_TRUE(BeginWith(daemon_->address(), *method, GrpcMessage("", length), /*half_closes=*/false).IsAlive())
          << method->full_name();
    }
  }
}

}  // namespace
}  // namespace wellspace::server
