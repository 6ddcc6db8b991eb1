// Compressed blocks give their bytes back, and damaged ones are refused.
#include "client/formats/io/compression.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace wellspace::formats {
namespace {

using std::string_literals::operator""s;

using Inflate = absl::StatusOr<std::string> (*)(std::string_view, uint64_t);

// 20 times these ten bytes, as Python's zlib and lzma compress them; and by hand as LZ4: ten literals, a reference ten
// bytes back of 185, five literals.
const std::string kText = [] {
  std::string text;
  for (int i = 0; i < 20; ++i) {
    text += "wellspace ";
  }
  return text;
}();
const std::string kZlib = "\x78\x9c\x2b\x4f\xcd\xc9\x29\x2e\x48\x4c\x4e\x55\x28\x1f\xd2\x2c\x00\x91\x0a\x4d\x81"s;
const std::string kXz =
    "\xfd\x37\x7a\x58\x5a\x00\x00\x01\x69\x22\xde\x36\x02\x00\x21\x01\x16\x00\x00\x00\x74\x2f\xe5\xa3"
    "\xe0\x00\xc7\x00\x10\x5d\x00\x3b\x99\x49\xee\x92\x7a\x38\xfa\xae\x2e\xab\x30\xb1\x62\xe0\x00\x00"
    "\x07\xa3\x3c\xf3\x00\x01\x28\xc8\x01\x00\x00\x00\xf9\x97\x73\x49\x3e\x30\x0d\x8b\x02\x00\x00\x00"
    "\x00\x01\x59\x5a"s;
const std::string kLz4 = "\xafwellspace \x0a\x00\xa6\x50pace "s;

struct Case {
  const char* name;
  Inflate inflate;
  std::string compressed;
};
const std::vector<Case> kCases = {{"zlib", InflateZlib, kZlib}, {"xz", InflateXz, kXz}, {"LZ4", InflateLz4, kLz4}};

TEST(CompressionTest, GivesTheBytesBack) {
  for (const Case& one : kCases) {
    const absl::StatusOr<std::string> bytes = one.inflate(one.compressed, kText.size());
    ASSERT_TRUE(bytes.ok()) << one.name << bytes.status();
    EXPECT_EQ(*bytes, kText) << one.name;
  }
  EXPECT_EQ(*InflateLz4("\x50hello", 5), "hello");
  EXPECT_EQ(*InflateLz4("\x1f"s + "a\x01\x00\xff\xff\x00"s, 1 + 19 + 510), std::string(530, 'a'));
}

TEST(CompressionTest, RefusesOtherSizesAndCutData) {
  for (const Case& one : kCases) {
    for (const uint64_t size : {kText.size() - 1, kText.size() + 1, size_t{0}, ~size_t{0}, size_t{1} << 40}) {
      EXPECT_EQ(one.inflate(one.compressed, size).status().code(), absl::StatusCode::kInvalidArgument)
          << one.name << size;
    }
    for (size_t size = 0; size < one.compressed.size(); ++size) {
      EXPECT_FALSE(one.inflate(one.compressed.substr(0, size), kText.size()).ok()) << one.name << size;
    }
    if (one.inflate != InflateZlib) {  // which does not look at bytes behind its end
      EXPECT_FALSE(one.inflate(one.compressed + '\x10', kText.size()).ok()) << one.name;
    }
  }
  for (const std::string& wrong :
       {"\x10"s + "a\x02\x00"s, "\x10"s + "a\x00\x00"s, "\xf0\xff"s, "\x1f"s + "a\x01\x00\xff"s}) {
    EXPECT_FALSE(InflateLz4(wrong, 100).ok());
  }
}

}  // namespace
}  // namespace wellspace::formats
