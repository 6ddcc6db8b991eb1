// A repeated request gets the first answer; which are remembered, for how long and in how much memory.
#include "server/calls/request_ids.h"

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "server/store/memory_records.h"
#include "tests/server/service_harness.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {
namespace {

class RequestIdsTest : public ::testing::Test {
 protected:
  // Asks, and answers with `answer` when it is the first time.
  RequestIds::Answer Ask(const std::string& id, const std::string& name, const RequestIds::Answer& answer,
                         const std::string& tenant = "a") {
    v1::DeleteSessionRequest request;
    request.set_name(name);
    RequestIds::Answer got;
    got.response = "never answered";
    ids_.Once(
        tenant, id, request,
        [&](const IdentifiedRequest&, const RequestIds::Done& done) {
          ++done_;
          done(answer);
        },
        [&](const RequestIds::Answer& given) { got = given; });
    return got;
  }

  absl::Duration now_ = absl::Hours(1);
  MemoryRecords records_;
  RequestIds ids_{[this] { return now_; }, records_};
  int done_ = 0;
};

RequestIds::Answer Ok(const std::string& response) { return {absl::OkStatus(), response}; }

TEST_F(RequestIdsTest, ARepeatedCallGetsTheFirstAnswer) {
  EXPECT_EQ(Ask("1", "x", Ok("first")).response, "first");
  EXPECT_EQ(Ask("1", "x", Ok("second")).response, "first");
  EXPECT_EQ(Ask("2", "x", Ok("other id")).response, "other id");
  EXPECT_EQ(Ask("1", "x", Ok("other tenant"), "b").response, "other tenant");
  EXPECT_EQ(done_, 3);
}

TEST_F(RequestIdsTest, NoIdIsNeverARepetition) {
  EXPECT_EQ(Ask("", "x", Ok("first")).response, "first");
  EXPECT_EQ(Ask("", "x", Ok("second")).response, "second");
}

TEST_F(RequestIdsTest, AnotherRequestWithTheSameIdIsRefused) {
  Ask("1", "x", Ok("first"));
  const absl::Status status = Ask("1", "y", Ok("second")).status;
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(DetailsOf(status).reason, "REQUEST_ID_REUSED");
  EXPECT_EQ(DetailsOf(status).field, "request_id");
  EXPECT_EQ(done_, 1);
}

TEST_F(RequestIdsTest, TheOrderOfLabelsIsNoOtherRequest) {
  v1::CreateSessionRequest forward;
  v1::CreateSessionRequest backward;
  for (int i = 0; i < 64; ++i) {
    (*forward.mutable_labels())[absl::StrCat("key", i)] = "value";
    (*backward.mutable_labels())[absl::StrCat("key", 63 - i)] = "value";
  }
  const auto work = [&](const IdentifiedRequest&, const RequestIds::Done& done) {
    ++done_;
    done(Ok("answer"));
  };
  ids_.Once("a", "1", forward, work, [](const RequestIds::Answer&) {});
  ids_.Once("a", "1", backward, work, [](const RequestIds::Answer& answer) { EXPECT_TRUE(answer.status.ok()); });
  EXPECT_EQ(done_, 1);
}

TEST_F(RequestIdsTest, WhatFailedMayBeTriedAgain) {
  EXPECT_FALSE(Ask("1", "x", {absl::AbortedError(""), ""}).status.ok());
  EXPECT_EQ(Ask("1", "x", Ok("second")).response, "second");
}

TEST_F(RequestIdsTest, AnswersAreForgottenAfterTheirTime) {
  Ask("1", "x", Ok("first"));
  now_ += RequestIds::kKeptFor;
  EXPECT_EQ(Ask("1", "x", Ok("second")).response, "first");
  now_ += absl::Nanoseconds(1);
  EXPECT_EQ(Ask("1", "x", Ok("third")).response, "third");
}

TEST_F(RequestIdsTest, TheOldestGoWhenThereAreTooMany) {
  for (size_t i = 0; i < RequestIds::kMaxPerTenant; ++i) {
    Ask(absl::StrCat(i), "x", Ok("first"));
  }
  EXPECT_EQ(Ask("0", "x", Ok("second")).response, "first");
  Ask("one more", "x", Ok("first"));
  EXPECT_EQ(Ask("1", "x", Ok("second")).response, "first");
  EXPECT_EQ(Ask("0", "x", Ok("second")).response, "second");
}

TEST_F(RequestIdsTest, AnswersTakeBoundedMemory) {
  const std::string large(RequestIds::kMaxBytesPerTenant / 4, 'x');
  for (int i = 0; i < 5; ++i) {
    Ask(absl::StrCat(i), "x", Ok(large));
  }
  EXPECT_EQ(Ask("4", "x", Ok("second")).response, large);
  EXPECT_EQ(Ask("0", "x", Ok("second")).response, "second");
}

TEST_F(RequestIdsTest, AnswersOfAnEarlierProcessAreGivenAgain) {
  v1::DeleteSessionRequest request;
  request.set_name("x");
  v1::CreateSessionResponse response;
  response.mutable_session()->set_name("sessions/1");
  std::vector<store::v1::AnswerRecord> written;
  ids_.Once(
      "a", "1", request,
      [&](const IdentifiedRequest& identified, const RequestIds::Done& done) {
        written.push_back(identified.Answer(response).value());
        done(Ok(response.SerializeAsString()));
      },
      [](const RequestIds::Answer&) {});
  RequestIds next([this] { return now_; }, records_);
  next.Restore(written);
  const auto ask = [&](const std::string& name) {
    request.set_name(name);
    RequestIds::Answer got;
    next.Once(
        "a", "1", request, [](const IdentifiedRequest&, const RequestIds::Done&) { ADD_FAILURE() << "done twice"; },
        [&](const RequestIds::Answer& answer) { got = answer; });
    return got;
  };
  EXPECT_EQ(ask("x").response, response.SerializeAsString());
  EXPECT_EQ(DetailsOf(ask("y").status).reason, "REQUEST_ID_REUSED");
}

// Two processes are asked: the second does not repeat a change that the first has committed, however its work ends.
TEST_F(RequestIdsTest, WhatAnotherProcessHasAnsweredIsGivenAgain) {
  RequestIds other([this] { return now_; }, records_);
  v1::CreateSessionResponse response;
  const auto commit = [&](const IdentifiedRequest& identified, const std::string& session) {
    response.mutable_session()->set_name(session);
    return records_.Apply(
        {.session = session, .epoch = records_.epoch(), .is_creation = true, .answer = identified.Answer(response)},
        Survives::kPowerLoss);
  };
  int created = 0;
  const auto ask = [&](RequestIds& ids, const std::string& label, const absl::Status& failure = absl::OkStatus()) {
    v1::CreateSessionRequest request;
    (*request.mutable_labels())["label"] = label;
    RequestIds::Answer got;
    ids.Once(
        "a", "1", request,
        [&](const IdentifiedRequest& identified, const RequestIds::Done& done) {
          const absl::Status status =
              failure.ok() ? commit(identified, absl::StrCat("sessions/", created + 1)) : failure;
          created += status.ok() ? 1 : 0;
          done({status, response.SerializeAsString()});
        },
        [&](const RequestIds::Answer& answer) { got = answer; });
    v1::CreateSessionResponse parsed;
    parsed.ParseFromString(got.response);
    return got.status.ok() ? parsed.session().name() : DetailsOf(got.status).reason;
  };
  EXPECT_EQ(ask(ids_, "x"), "sessions/1");
  EXPECT_EQ(ask(other, "y"), "REQUEST_ID_REUSED");
  EXPECT_EQ(ask(other, "x", absl::NotFoundError("deleted meanwhile")), "sessions/1");
  EXPECT_EQ(ask(other, "x"), "sessions/1");
  EXPECT_EQ(ask(ids_, "x"), "sessions/1");
  EXPECT_EQ(created, 1);
}

TEST_F(RequestIdsTest, ARequestWithoutAnIdHasNoAnswerToBeWritten) {
  EXPECT_FALSE(IdentifiedRequest().Answer(v1::DeleteSessionResponse()).has_value());
}

TEST_F(RequestIdsTest, TheLengthOfAnIdIsLimited) {
  EXPECT_TRUE(Ask(std::string(RequestIds::kMaxLength, 'x'), "x", Ok("")).status.ok());
  const absl::Status status = Ask(std::string(RequestIds::kMaxLength + 1, 'x'), "x", Ok("")).status;
  EXPECT_EQ(DetailsOf(status).reason, "INVALID_REQUEST");
  EXPECT_EQ(DetailsOf(status).field, "request_id");
}

TEST_F(RequestIdsTest, ACallThatRepeatsOneUnderWayGetsItsAnswer) {
  v1::DeleteSessionRequest request;
  RequestIds::Done first_is_done;
  std::vector<std::string> answers;
  const auto note = [&](const RequestIds::Answer& answer) { answers.push_back(answer.response); };
  ids_.Once(
      "a", "1", request, [&](const IdentifiedRequest&, RequestIds::Done done) { first_is_done = std::move(done); },
      note);
  ids_.Once(
      "a", "1", request, [&](const IdentifiedRequest&, const RequestIds::Done&) { ADD_FAILURE() << "done twice"; },
      note);
  EXPECT_TRUE(answers.empty());
  first_is_done(Ok("answer"));
  EXPECT_EQ(answers, std::vector<std::string>(2, "answer"));
}

}  // namespace
}  // namespace wellspace::server
