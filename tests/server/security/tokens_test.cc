// Files of tokens: whose they are, and which line is wrong; no message shows a token.
#include "server/security/tokens.h"

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::string kToken(32, 'a');
// printf %s aaaa… | sha256sum
constexpr char kLine[] = "acme sha256:3ba3f5f43b92602683c19aee62a20342b084dd5971ddd33808d81a328879a547";

TEST(Tokens, ALineIsTheHashThatOtherToolsMake) {
  const absl::StatusOr<std::string> line = MakeTokenLine("acme", kToken);
  ASSERT_TRUE(line.ok()) << line.status();
  EXPECT_EQ(*line, kLine);
}

TEST(Tokens, KnowsWhoseTheyAre) {
  const std::string other(40, 'b');
  const std::string third(40, 'c');
  const absl::StatusOr<TokenTable> table =
      TokenTable::Parse(absl::StrCat("# tokens\n\n", kLine, "  # of the build machine\r\n",
                                     *MakeTokenLine("acme", other), "\n\t", *MakeTokenLine("e.v-i_l@corp", third)));
  ASSERT_TRUE(table.ok()) << table.status();
  EXPECT_EQ(table->size(), 3u);
  EXPECT_EQ(table->CallerOf(kToken)->tenant, "acme");
  EXPECT_EQ(table->CallerOf(other)->tenant, "acme");
  EXPECT_EQ(table->CallerOf(third)->tenant, "e.v-i_l@corp");
  for (const std::string& unknown :
       {std::string(), std::string(31, 'a'), std::string(33, 'a'), std::string(kLine), std::string(5000, 'a')}) {
    EXPECT_FALSE(table->CallerOf(unknown).has_value()) << unknown;
  }
}

TEST(Tokens, OneIsAnAdminsWhoseLineSaysSo) {
  const std::string other(40, 'b');
  const absl::StatusOr<TokenTable> table =
      TokenTable::Parse(absl::StrCat(kLine, "\n", *MakeTokenLine("acme", other, /*is_admin=*/true), " # of operators"));
  ASSERT_TRUE(table.ok()) << table.status();
  EXPECT_FALSE(table->CallerOf(kToken)->is_admin) << "it is of the same tenant";
  EXPECT_TRUE(table->CallerOf(other)->is_admin);
  EXPECT_EQ(table->CallerOf(other)->tenant, "acme");
}

TEST(Tokens, SaysWhichLineIsWrong) {
  const std::string good = absl::StrCat(kLine, "\n");
  for (const auto& [text, part] : {std::pair<std::string, std::string>{"", "no token"},
                                   {"# none\n", "no token"},
                                   {good + "acme", "line 2: expected"},
                                   {good + "acme sha256:12", "line 2: expected"},
                                   {good + "acme sha256:" + std::string(64, 'g'), "line 2: expected"},
                                   {good + "acme md5:" + std::string(64, 'a'), "line 2: expected"},
                                   {good + kLine + " more", "line 2: expected"},
                                   {good + kLine + " Admin", "line 2: expected"},
                                   {good + kLine + " admin admin", "line 2: expected"},
                                   {"\n\n-acme sha256:" + std::string(64, '0'), "line 3: a tenant's name"},
                                   {"a/b sha256:" + std::string(64, '0'), "line 1: a tenant's name"},
                                   {good + "evil" + std::string(kLine).substr(4), "line 2: the same token"}}) {
    const absl::Status status = TokenTable::Parse(text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr(part)) << text;
  }
}

TEST(Tokens, ATokenThatWasNotHashedStaysOutOfTheMessage) {
  const absl::Status status = TokenTable::Parse(absl::StrCat("acme ", kToken)).status();
  EXPECT_THAT(std::string(status.message()), Not(HasSubstr(kToken)));
}

TEST(Tokens, RefusesToHashWhatIsNoToken) {
  for (const std::string& token : {std::string(), std::string(31, 'a'), std::string(4097, 'a'), kToken + " ",
                                   kToken + "\n", kToken + "\x80", std::string(32, '\0')}) {
    const absl::Status status = MakeTokenLine("acme", token).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr("openssl rand -hex 32"));
  }
  EXPECT_FALSE(MakeTokenLine("", kToken).ok());
  EXPECT_FALSE(MakeTokenLine("two words", kToken).ok());
}

TEST(Tokens, NamesOfTenants) {
  EXPECT_TRUE(IsTenantName("a"));
  EXPECT_TRUE(IsTenantName(std::string(64, 'a')));
  for (const std::string& name : {std::string(), std::string(65, 'a'), std::string(".a"), std::string("a b"),
                                  std::string("a\n"), std::string("a\0b", 3), std::string("\xc3\xa4")}) {
    EXPECT_FALSE(IsTenantName(name)) << name;
  }
}

}  // namespace
}  // namespace wellspace::server
