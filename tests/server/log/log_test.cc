// Lines of the log: text and JSON of the same fields.
#include "server/log/log.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <random>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "nlohmann/json.hpp"
#include "server/log/log_fields.h"
#include "server/log/log_writer.h"

namespace wellspace::server {
namespace {

using ::testing::ContainsRegex;
using ::testing::EndsWith;
using ::testing::SizeIs;

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

TEST(LogFields, LongValuesAreCut) {
  const size_t most = LogFields::kMaxValueBytes;
  EXPECT_EQ(LogFields().Add("a", std::string(most, 'x')).text(), "a=" + std::string(most, 'x'));
  const std::string cut = LogFields().Add("a", std::string(4'000'000, 'x')).text();
  EXPECT_EQ(cut, absl::StrCat("a=\"", std::string(most - 3, 'x'), "\xe2\x80\xa6\""));
  // Characters stay whole.
  for (size_t before = 0; before < 8; ++before) {
    std::string value(before, 'x');
    while (value.size() < 2 * most) {
      value += "\xf0\x9f\x98\x80";
    }
    const std::string text = LogFields().Add("a", value).text();
    EXPECT_EQ(text.find("\xef\xbf\xbd"), std::string::npos) << text;
    EXPECT_LE(text.size(), most + std::string("a=\"\"").size());
  }
  // Nor is a number cut to another one.
  EXPECT_THAT(LogFields().Add("a", std::string(300, '1')).text(), EndsWith("\xe2\x80\xa6\""));
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

// A pipe that nothing reads, and that is full.
class FullPipe {
 public:
  FullPipe() {
    EXPECT_EQ(pipe2(ends_, O_CLOEXEC), 0);
    const int flags = fcntl(ends_[1], F_GETFL);
    fcntl(ends_[1], F_SETFL, flags | O_NONBLOCK);
    const std::string bytes(4096, 'f');
    while (write(ends_[1], bytes.data(), bytes.size()) > 0) {
      filled_ += bytes.size();
    }
    fcntl(ends_[1], F_SETFL, flags);
  }
  ~FullPipe() {
    close(ends_[0]);
    // The end for writing stays open, as standard error does: a thread may be left behind that waits for it.
  }

  int descriptor() const { return ends_[1]; }

  // The text behind the bytes that have filled the pipe, as long as it has fewer than `lines` lines.
  std::string Read(size_t lines) {
    std::string text;
    while (std::count(text.begin(), text.end(), '\n') < static_cast<std::ptrdiff_t>(lines)) {
      char buffer[4096];
      const ssize_t got = read(ends_[0], buffer, sizeof(buffer));
      if (got <= 0) {
        break;
      }
      text.append(buffer, static_cast<size_t>(got));
      const size_t filler = std::min(filled_, text.size());
      text.erase(0, filler);
      filled_ -= filler;
    }
    return text;
  }

 private:
  int ends_[2] = {-1, -1};
  size_t filled_ = 0;
};

TEST(LogWriter, KeepsAsManyBytesAsItMayAndLosesTheOldestLines) {
  constexpr size_t kMostBytes = 10'000;
  FullPipe pipe;
  LogWriter writer(pipe.descriptor(), kMostBytes);
  constexpr size_t kLines = 1000;
  for (size_t i = 0; i < kLines; ++i) {
    writer.Write(absl::StrCat(std::string(100, 'x'), " ", i, "\n"));
    EXPECT_LE(writer.WaitingBytes(), kMostBytes);
  }
  EXPECT_GT(writer.LostLines(), kLines - kMostBytes / 100 - 2);
  const std::string text = pipe.Read(kLines - writer.LostLines());
  EXPECT_THAT(text, EndsWith(absl::StrCat(" ", kLines - 1, "\n")));
}

TEST(LogWriter, ALineAboveTheBoundIsLost) {
  FullPipe pipe;
  LogWriter writer(pipe.descriptor(), 100);
  writer.Write(std::string(1000, 'x'));
  EXPECT_EQ(writer.WaitingBytes(), 0u);
  EXPECT_EQ(writer.LostLines(), 1u);
}

TEST(LogWriter, EndsThoughNothingReads) {
  FullPipe pipe;
  const absl::Time begin = absl::Now();
  {
    LogWriter writer(pipe.descriptor());
    for (int i = 0; i < 100; ++i) {
      writer.Write(std::string(1000, 'x') + "\n");
    }
  }
  EXPECT_LT(absl::Now() - begin, absl::Minutes(1));
}

TEST(LogWriter, WritesAllThatWaitsBeforeItEnds) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  std::string expected;
  {
    LogWriter writer(ends[1]);
    for (int i = 0; i < 100; ++i) {
      const std::string line = absl::StrCat("line ", i, "\n");
      writer.Write(line);
      expected += line;
    }
  }
  close(ends[1]);
  std::string text(expected.size() + 1, '\0');
  text.resize(static_cast<size_t>(read(ends[0], text.data(), text.size())));
  close(ends[0]);
  EXPECT_EQ(text, expected);
}

TEST(Logger, AMessageWithoutEndIsCut) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  {
    const auto log = MakeLogger("info", LogFormat::kJson, std::make_shared<LogWriter>(ends[1]));
    log->info("{}", std::string(4'000'000, 'x'));
  }
  close(ends[1]);
  std::string text(2 * kMaxMessageBytes, '\0');
  text.resize(static_cast<size_t>(read(ends[0], text.data(), text.size())));
  close(ends[0]);
  EXPECT_THAT(nlohmann::json::parse(text)["message"].get<std::string>(), SizeIs(kMaxMessageBytes));
}

}  // namespace
}  // namespace wellspace::server
