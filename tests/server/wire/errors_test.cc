// Errors as clients see them: code, reason, field and when to retry.
#include "server/wire/errors.h"

#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/meshers/mesher.h"
#include "google/protobuf/text_format.h"
#include "google/rpc/error_details.pb.h"
#include "gtest/gtest.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

// The details of `status` as they reach a client.
std::string Sent(const absl::Status& status) {
  google::rpc::Status details;
  EXPECT_TRUE(details.ParseFromString(ToGrpcStatus(status).error_details()));
  std::string text;
  google::protobuf::TextFormat::Printer printer;
  printer.SetSingleLineMode(true);
  printer.SetExpandAny(true);
  EXPECT_TRUE(printer.PrintToString(details, &text));
  return text;
}

TEST(MakeError, EveryReasonHasACode) {
  const google::protobuf::EnumDescriptor& reasons = *v1::ErrorReason_descriptor();
  EXPECT_GT(reasons.value_count(), 40);
  for (int i = 0; i < reasons.value_count(); ++i) {  // their numbers have gaps
    const int number = reasons.value(i)->number();
    if (number == v1::ERROR_REASON_UNSPECIFIED) {
      continue;
    }
    const auto reason = static_cast<v1::ErrorReason>(number);
    const grpc::Status status = ToGrpcStatus(MakeError(reason, "why"));
    EXPECT_EQ(status.error_message(), "why");
    EXPECT_EQ("ERROR_REASON_" + DetailsOf(status).reason, v1::ErrorReason_Name(reason));
    EXPECT_EQ(status.error_code() == grpc::StatusCode::INTERNAL, reason == v1::ERROR_REASON_INTERNAL);
  }
}

TEST(MakeError, OfAReasonWithTwoCodesTakesTheOneThatIsGiven) {
  const absl::Status status =
      MakeError(absl::StatusCode::kFailedPrecondition, v1::ERROR_REASON_REVISION_MISMATCH, "why", "revision");
  EXPECT_EQ(ToGrpcStatus(status).error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(DetailsOf(status).reason, "REVISION_MISMATCH");
  EXPECT_EQ(DetailsOf(status).field, "revision");
}

TEST(ToGrpcStatus, SendsReasonFieldAndRetry) {
  EXPECT_EQ(Sent(MakeError(v1::ERROR_REASON_UPLOAD_GAP, "gap", "point_offset")),
            "code: 11 message: \"gap\" "
            "details { [type.googleapis.com/google.rpc.ErrorInfo] "
            "{ reason: \"ERROR_REASON_UPLOAD_GAP\" domain: \"wellspace.v1\" } } "
            "details { [type.googleapis.com/google.rpc.BadRequest] "
            "{ field_violations { field: \"point_offset\" description: \"gap\" } } } ");
  EXPECT_EQ(Sent(MakeError(v1::ERROR_REASON_QUEUE_FULL, "full")),
            "code: 8 message: \"full\" "
            "details { [type.googleapis.com/google.rpc.ErrorInfo] "
            "{ reason: \"ERROR_REASON_QUEUE_FULL\" domain: \"wellspace.v1\" } } "
            "details { [type.googleapis.com/google.rpc.RetryInfo] { retry_delay { seconds: 1 } } } ");
}

TEST(ToGrpcStatus, SaysWhereASessionIs) {
  EXPECT_EQ(DetailsOf(SessionElsewhereError("x", "0123", "host:1")).address, "host:1");
  EXPECT_EQ(DetailsOf(SessionElsewhereError("x", "0123", "")).address, "");
  EXPECT_TRUE(DetailsOf(SessionElsewhereError("x", "0123", "host:1")).may_retry);
  const SessionOwnerOf owner = OwnerOf(SessionElsewhereError("x", "0123", "host:1"));
  EXPECT_EQ(owner.session, "0123");
  EXPECT_EQ(owner.address, "host:1");
  EXPECT_EQ(OwnerOf(SessionElsewhereError("x", "0123", "")).session, "");
}

TEST(ToGrpcStatus, RepeatsMemoryLimitsOnlyWhereItHelps) {
  EXPECT_EQ(DetailsOf(MemoryLimitError("x", true)).reason, "MEMORY_LIMIT");
  EXPECT_TRUE(DetailsOf(MemoryLimitError("x", true)).may_retry);
  EXPECT_FALSE(DetailsOf(MemoryLimitError("x", false)).may_retry);
}

// The core's error for a domain, by points, segments and faces that it makes.
ErrorDetails RefusalOf(const std::vector<uint32_t>& ends, const std::vector<int32_t>& markers,
                       const std::vector<core::FaceSeed>& seeds, core::FaceRule faces = core::FaceRule::kHoles) {
  const std::vector<double> points = {0, 0, 4, 0, 4, 4, 0, 4, 2, 1e-17};
  core::Features features;
  features.ends = ends;
  features.markers = markers;
  features.seeds = seeds;
  features.faces = faces;
  core::RunContext context;
  return DetailsOf(core::MeshPoints({.dimension = 2}, {points, features}, context).status());
}

TEST(ToGrpcStatus, ErrorsOfADomainNameWhatIsWrong) {
  const auto expect = [](const ErrorDetails& details, const std::string& field) {
    EXPECT_EQ(details.reason, "INVALID_SEGMENTS");
    EXPECT_EQ(details.field, field);
  };
  expect(RefusalOf({0, 1, 1, 2, 2, 7}, {}, {}), "segments.ends");
  expect(RefusalOf({0, 2, 1, 3, 1, 2}, {}, {}), "segments.ends");   // they cross
  expect(RefusalOf({0, 1, 1, 2, 2, 0}, {}, {}), "segments.ends");   // a point is too near
  expect(RefusalOf({2, 3, 3, 2}, {1, 2}, {}), "segments.markers");  // two on one
  expect(RefusalOf({2, 3}, {}, {}), "faces.faces");                 // nothing is enclosed
  expect(RefusalOf({2, 3}, {}, {}, core::FaceRule::kEvenOdd), "faces.faces");
  expect(RefusalOf({1, 2, 2, 3, 3, 1}, {}, {{.at = {4, 2}}}), "faces.seeds");
}

TEST(ToGrpcStatus, TellsErrorsOfTheCoreApart) {
  EXPECT_TRUE(ToGrpcStatus(absl::OkStatus()).ok());
  EXPECT_EQ(DetailsOf(absl::InvalidArgumentError("x")).reason, "INVALID_POINTS");
  EXPECT_EQ(DetailsOf(absl::InvalidArgumentError("x")).field, "points.coordinates");
  EXPECT_EQ(DetailsOf(absl::ResourceExhaustedError("x")).reason, "MESH_TOO_LARGE");
  EXPECT_EQ(DetailsOf(absl::FailedPreconditionError("x")).reason, "MESH_NOT_READY");
  EXPECT_EQ(DetailsOf(absl::UnknownError("x")).reason, "INTERNAL");
  EXPECT_EQ(ToGrpcStatus(absl::UnknownError("x")).error_code(), grpc::StatusCode::INTERNAL);
  EXPECT_EQ(ToGrpcStatus(absl::UnknownError("x")).error_message(), "internal error: x");
  for (const absl::Status& status : {absl::CancelledError("x"), absl::DeadlineExceededError("x")}) {
    const grpc::Status sent = ToGrpcStatus(status);
    EXPECT_EQ(static_cast<int>(sent.error_code()), static_cast<int>(status.code()));
    EXPECT_EQ(sent.error_message(), "x");
    EXPECT_EQ(sent.error_details(), "") << "neither has a reason";
  }
}

TEST(ToGrpcStatus, CutsAMessageThatRepeatsMuchOfTheRequest) {
  const grpc::Status status = ToGrpcStatus(MakeError(v1::ERROR_REASON_INVALID_REQUEST, std::string(5000, 'x'), "name"));
  EXPECT_LE(status.error_message().size(), 1024u);
  EXPECT_LE(status.error_details().size(), 2 * 1024u + 512) << "with the cut message, twice";
}

TEST(StatusToProto, IsWhatAClientWouldSee) {
  const absl::Status status = MakeError(v1::ERROR_REASON_UPLOAD_GAP, "gap", "point_offset");
  EXPECT_EQ(StatusToProto(status).SerializeAsString(), ToGrpcStatus(status).error_details());
  EXPECT_EQ(StatusToProto(absl::CancelledError("x")).code(), static_cast<int>(absl::StatusCode::kCancelled));
  EXPECT_EQ(StatusToProto(absl::CancelledError("x")).message(), "x");
}

TEST(RunGuarded, MakesErrorsOfExceptions) {
  EXPECT_TRUE(RunGuarded([] { return absl::OkStatus(); }).ok());
  EXPECT_EQ(DetailsOf(RunGuarded([]() -> absl::Status { throw std::bad_alloc(); })).reason, "OUT_OF_MEMORY");
  const absl::Status status = RunGuarded([]() -> absl::Status { throw std::runtime_error("why"); });
  EXPECT_EQ(DetailsOf(status).reason, "INTERNAL");
  EXPECT_EQ(status.message(), "internal error: why");
}

}  // namespace
}  // namespace wellspace::server
