// Arrays of VTK in base64, plain and in blocks, against known texts; every cut of one is refused.
#include "client/formats/vtk/vtk_array.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/io/output_file.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::formats {
namespace {

using ::testing::HasSubstr;

std::string Base64(std::string_view bytes) {
  std::string text;
  AppendBase64(bytes, text);
  return text;
}

std::string Words(std::initializer_list<uint64_t> words) {
  std::string bytes;
  for (const uint64_t word : words) {
    bytes.append(reinterpret_cast<const char*>(&word), sizeof(word));
  }
  return bytes;
}

// The text of an array of `count` words, as VtkArrayWriter writes it.
std::string Encode(uint64_t count) {
  TemporaryFolder folder;
  {
    absl::StatusOr<OutputFile> file = OutputFile::Create(folder.Path("array"));
    VtkArrayWriter writer(*file, count * sizeof(uint64_t));
    for (uint64_t i = 0; i < count; ++i) {
      writer.Add<uint64_t>(i * i);
    }
    EXPECT_TRUE(writer.Finish().ok());
    EXPECT_TRUE(file->Commit().ok());
  }
  return folder.Read("array");
}

constexpr VtkEncoding kCompressed = {.compressor = VtkCompressor::kZlib, .big_endian = false, .header_word_bytes = 8};
constexpr VtkEncoding kPlain = {.compressor = VtkCompressor::kNone, .big_endian = false, .header_word_bytes = 8};

TEST(Base64Test, KnownTexts) {
  EXPECT_EQ(Base64(""), "");
  EXPECT_EQ(Base64("f"), "Zg==");
  EXPECT_EQ(Base64("fo"), "Zm8=");
  EXPECT_EQ(Base64("foo"), "Zm9v");
  EXPECT_EQ(Base64("\xff\xfe\xfd"), "//79");
  EXPECT_EQ(*DecodeBase64(" Zm9v\n Zg==Zm8= "),
            "foof"
            "fo");
}

TEST(Base64Test, RefusesWhatIsNone) {
  for (const char* text : {"Z", "Zg", "Zg=", "=", "Zg=v", "Zm9v!", "Z===", "Zm=9"}) {
    EXPECT_FALSE(DecodeBase64(text).ok()) << text;
  }
}

TEST(VtkArrayTest, BlocksReadBack) {
  constexpr uint64_t kPerBlock = VtkArrayWriter::kBlockBytes / sizeof(uint64_t);
  for (const uint64_t count : {uint64_t{0}, uint64_t{1}, kPerBlock - 1, kPerBlock, kPerBlock + 1, 3 * kPerBlock}) {
    const absl::StatusOr<std::string> bytes = DecodeVtkArray(Encode(count), kCompressed);
    ASSERT_TRUE(bytes.ok()) << bytes.status();
    ASSERT_EQ(bytes->size(), count * sizeof(uint64_t));
    for (uint64_t i = 0; i < count; ++i) {
      ASSERT_EQ(LoadWord<uint64_t>(*bytes, i, false), i * i);
    }
  }
}

TEST(VtkArrayTest, LoadsWordsOfEitherByteOrder) {
  EXPECT_EQ(LoadWord<uint16_t>("\x01\x02\x03\x04", 1, false), 0x0403);
  EXPECT_EQ(LoadWord<uint16_t>("\x01\x02\x03\x04", 1, true), 0x0304);
}

TEST(VtkArrayTest, PlainArrayWithOneOrTwoBase64Streams) {
  const std::string header = Words({4});
  EXPECT_EQ(*DecodeVtkArray(Base64(header + "data"), kPlain), "data");
  EXPECT_EQ(*DecodeVtkArray(Base64(header) + Base64("data"), kPlain), "data");
  EXPECT_EQ(*DecodeVtkArray("  ", kPlain), "");
}

// Sizes that lie must neither be believed nor allocated.
TEST(VtkArrayTest, RefusesSizesThatLie) {
  const auto message = [](const std::string& bytes, const VtkEncoding& encoding) {
    const absl::StatusOr<std::string> result = DecodeVtkArray(Base64(bytes), encoding);
    EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(result.status().message());
  };
  constexpr uint64_t kHuge = ~uint64_t{0};
  EXPECT_THAT(message("abc", kPlain), HasSubstr("inside its header"));
  EXPECT_THAT(message(Words({kHuge}), kPlain), HasSubstr("says that it has"));
  EXPECT_THAT(message(Words({1, 8}), kCompressed), HasSubstr("inside its header"));
  EXPECT_THAT(message(Words({kHuge, 8, 8}), kCompressed), HasSubstr("blocks"));
  EXPECT_THAT(message(Words({1, 8, 0, kHuge}), kCompressed), HasSubstr("block 0 says that it has"));
  EXPECT_THAT(message(Words({1, kHuge, 0, 3}) + "abc", kCompressed), HasSubstr("block 0 cannot become"));
  EXPECT_THAT(message(Words({1, 8, 0, 3}) + "abc", kCompressed), HasSubstr("does not decompress"));
}

TEST(VtkArrayTest, RefusesEveryCut) {
  const std::string text = Encode(100);
  ASSERT_TRUE(DecodeVtkArray(text, kCompressed).ok());
  for (size_t size = 1; size < text.size(); ++size) {
    EXPECT_FALSE(DecodeVtkArray(text.substr(0, size), kCompressed).ok()) << size;
  }
}

}  // namespace
}  // namespace wellspace::formats
