// Lines of the log: text and JSON of the same fields.
#include "server/log.h"

#include <optional>
#include <random>
#include <string>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "nlohmann/json.hpp"
#include "server/log_fields.h"

namespace wellspace::server {
namespace {

using ::testing::ContainsRegex;

TEST(LogFields, WritesPlainValuesBareAndOthersAsJsonStrings) {
  LogFields fields;
  fields.Add("event", "call").Add("points", uint64_t{18'446'744'073'709'551'615u}).Add("seconds", 0.25);
  fields.Add("message", "a \"b\"\nc=d").Add("empty", "").Add("id", "12").Add("peer", "ipv4:127.0.0.1:80");
  EXPECT_EQ(fields.text(),
            R"(event=call points=18446744073709551615 seconds=0.250000 message="a \"b\"\nc=d" empty="" id="12" )"
            "peer=ipv4:127.0.0.1:80");
}

TEST(LogFields, AppendsThoseOfOthers) {
  EXPECT_EQ(LogFields().Add("a", "b").Add(LogFields().Add("c", uint64_t{1})).Add(LogFields()).text(), "a=b c=1");
  EXPECT_EQ(LogFields().Add(LogFields().Add("c", uint64_t{1})).text(), "c=1");
}

// Any bytes survive, as far as they are UTF-8, and keep to their field and line.
TEST(LogFields, RandomValuesSurviveTheTripToJson) {
  constexpr std::string_view kAlphabet = "a0-1.9e= \"\\\n\r\t\x01{}[],:\x7f\xc3\xbc";
  std::mt19937 random(7);
  for (int round = 0; round < 2000; ++round) {
    std::string value;
    for (size_t length = random() % 8; value.size() < length;) {
      value += kAlphabet[random() % (kAlphabet.size() - 2)];
    }
    if (random() % 4 == 0) {
      value += "\xc3\xbc";
    }
    const std::string text = LogFields().Add("first", value).Add("second", uint64_t{7}).text();
    EXPECT_EQ(text.find('\n'), std::string::npos);
    const std::optional<std::string> members = ToJsonMembers(text);
    ASSERT_TRUE(members.has_value()) << text;
    const nlohmann::json object = nlohmann::json::parse(absl::StrCat("{", *members, "}"));
    EXPECT_EQ(object.size(), 2u) << text;
    EXPECT_EQ(object["first"], value) << text;
    EXPECT_EQ(object["second"], 7) << text;
  }
}

TEST(LogFields, BytesThatAreNoTextAreReplaced) {
  EXPECT_EQ(LogFields().Add("a", "x\xff").text(), "a=\"x\xef\xbf\xbd\"");
}

TEST(LogFields, OtherLinesAreNotTakenForFields) {
  for (const char* line : {"", "stopped", "a", "=b", "A=b", "a=", "a= b=c", "a=b  c=d", "a=b ", "a=\"b", "a=\"b\"c",
                           "a=b=c", "call=1 chunk=2 made", "a=\\"}) {
    EXPECT_EQ(ToJsonMembers(line), std::nullopt) << line;
  }
}

std::string Format(LogFormat format, const std::string& payload) {
  spdlog::memory_buf_t line;
  // As a logger does: formatters are cloned for sinks.
  MakeLogFormatter(format)->clone()->format(spdlog::details::log_msg("test", spdlog::level::warn, payload), line);
  return std::string(line.data(), line.size());
}

TEST(LogFormat, TextHasTimeLevelAndTheLine) {
  EXPECT_THAT(Format(LogFormat::kText, "event=stopped"),
              ContainsRegex("^[0-9-]{10}T[0-9:]{8}\\.[0-9]{3}[+-][0-9:]+ warning event=stopped\n$"));
}

TEST(LogFormat, JsonHasTheFieldsOrTheMessage) {
  const nlohmann::json fields =
      nlohmann::json::parse(Format(LogFormat::kJson, "event=call seconds=0.5 message=\"a b\""));
  EXPECT_THAT(fields["time"].get<std::string>(), ContainsRegex("^[0-9-]{10}T[0-9:]{8}\\.[0-9]{3}Z$"));
  EXPECT_EQ(fields["level"], "warning");
  EXPECT_EQ(fields["event"], "call");
  EXPECT_EQ(fields["seconds"], 0.5);
  EXPECT_EQ(fields["message"], "a b");
  const nlohmann::json message = nlohmann::json::parse(Format(LogFormat::kJson, "a \"quoted\"\nmessage"));
  EXPECT_EQ(message["message"], "a \"quoted\"\nmessage");
  EXPECT_EQ(message.size(), 3u);
}

}  // namespace
}  // namespace wellspace::server
