#include "client/formats/vtk/vtk_array.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "absl/strings/str_cat.h"
#include "client/formats/io/compression.h"
#include "client/formats/io/number.h"

namespace wellspace::formats {
namespace {

static_assert(std::endian::native == std::endian::little,
              "files are written, and words loaded, for little-endian machines");

constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

constexpr uint8_t kSkip = 64;
constexpr uint8_t kPadding = 65;
constexpr uint8_t kInvalid = 66;

constexpr std::array<uint8_t, 256> MakeDecodeTable() {
  std::array<uint8_t, 256> table{};
  for (uint8_t& entry : table) {
    entry = kInvalid;
  }
  for (size_t i = 0; i < kAlphabet.size(); ++i) {
    table[static_cast<uint8_t>(kAlphabet[i])] = static_cast<uint8_t>(i);
  }
  for (const char space : {' ', '\t', '\r', '\n'}) {
    table[static_cast<uint8_t>(space)] = kSkip;
  }
  table['='] = kPadding;
  return table;
}

constexpr std::array<uint8_t, 256> kDecodeTable = MakeDecodeTable();

uint64_t LoadHeaderWord(std::string_view bytes, size_t i, const VtkEncoding& encoding) {
  return encoding.header_word_bytes == 8 ? LoadWord<uint64_t>(bytes, i, encoding.big_endian)
                                         : LoadWord<uint32_t>(bytes, i, encoding.big_endian);
}

// The array that `bytes` starts with, if it is not compressed.
absl::StatusOr<std::string> TakeUncompressed(std::string_view bytes, const VtkEncoding& encoding) {
  const size_t header = encoding.header_word_bytes;
  if (bytes.size() < header) {
    return bytes.empty() ? absl::StatusOr<std::string>(std::string())
                         : absl::InvalidArgumentError("the array ends inside its header");
  }
  const uint64_t size = LoadHeaderWord(bytes, 0, encoding);
  if (size > bytes.size() - header) {
    return absl::InvalidArgumentError(
        absl::StrCat("the array says that it has ", size, " bytes, and has ", bytes.size() - header));
  }
  return std::string(bytes.substr(header, size));
}

// How many characters of base64 so many bytes are.
uint64_t Base64Size(uint64_t bytes) { return (bytes + 2) / 3 * 4; }

// Of base64 that starts with a header of `bytes` bytes, in `text`: these, and behind them what shares a group with
// them.
absl::StatusOr<std::string> DecodeBase64Start(std::string_view text, uint64_t bytes) {
  if (bytes > text.size() || Base64Size(bytes) > text.size()) {
    return absl::InvalidArgumentError("the array ends inside its header");
  }
  absl::StatusOr<std::string> start = DecodeBase64(text.substr(0, Base64Size(bytes)));
  return !start.ok() || start->size() >= bytes ? start : absl::InvalidArgumentError("the array ends inside its header");
}

absl::StatusOr<std::string> Decompress(std::string_view bytes, const VtkEncoding& encoding) {
  const uint64_t word = encoding.header_word_bytes;
  if (bytes.size() < 3 * word) {
    return bytes.empty() ? absl::StatusOr<std::string>(std::string())
                         : absl::InvalidArgumentError("the array ends inside its header");
  }
  const uint64_t blocks = LoadHeaderWord(bytes, 0, encoding);
  const uint64_t block_bytes = LoadHeaderWord(bytes, 1, encoding);
  const uint64_t last_block_bytes = LoadHeaderWord(bytes, 2, encoding);
  if (blocks > bytes.size() / word - 3) {
    return absl::InvalidArgumentError(absl::StrCat("the array says that it has ", blocks, " blocks, and is shorter"));
  }
  uint64_t position = (3 + blocks) * word;
  std::string data;
  for (uint64_t block = 0; block < blocks; ++block) {
    const uint64_t compressed = LoadHeaderWord(bytes, 3 + block, encoding);
    const bool is_short = block + 1 == blocks && last_block_bytes != 0;
    const uint64_t size = is_short ? last_block_bytes : block_bytes;
    if (compressed > bytes.size() - position) {
      return absl::InvalidArgumentError(
          absl::StrCat("block ", block, " says that it has ", compressed, " bytes, and is shorter"));
    }
    const std::string_view block_text = bytes.substr(position, compressed);
    const absl::StatusOr<std::string> inflated =
        encoding.compressor == VtkCompressor::kLz4    ? InflateLz4(block_text, size)
        : encoding.compressor == VtkCompressor::kLzma ? InflateXz(block_text, size)
                                                      : InflateZlib(block_text, size);
    if (!inflated.ok()) {
      return absl::Status(inflated.status().code(), absl::StrCat("block ", block, " ", inflated.status().message()));
    }
    data += *inflated;
    position += compressed;
  }
  return data;
}

}  // namespace

void AppendBase64(std::string_view bytes, std::string& text) {
  const size_t begin = text.size();
  text.resize(begin + (bytes.size() + 2) / 3 * 4);
  char* out = text.data() + begin;
  const auto byte = [&bytes](size_t i) { return static_cast<uint32_t>(static_cast<uint8_t>(bytes[i])); };
  size_t i = 0;
  for (; i + 3 <= bytes.size(); i += 3) {
    const uint32_t triple = byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2);
    *out++ = kAlphabet[triple >> 18];
    *out++ = kAlphabet[triple >> 12 & 63];
    *out++ = kAlphabet[triple >> 6 & 63];
    *out++ = kAlphabet[triple & 63];
  }
  if (const size_t left = bytes.size() - i; left > 0) {
    const uint32_t triple = byte(i) << 16 | (left == 2 ? byte(i + 1) << 8 : 0);
    *out++ = kAlphabet[triple >> 18];
    *out++ = kAlphabet[triple >> 12 & 63];
    *out++ = left == 2 ? kAlphabet[triple >> 6 & 63] : '=';
    *out++ = '=';
  }
}

absl::StatusOr<std::string> DecodeBase64(std::string_view text) {
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  uint32_t group = 0;
  int digits = 0;
  int padding = 0;
  for (const char c : text) {
    const uint8_t digit = kDecodeTable[static_cast<uint8_t>(c)];
    if (digit == kSkip) {
      continue;
    }
    if (digit == kInvalid || (digit == kPadding && digits + padding < 2) || (digit != kPadding && padding > 0)) {
      return absl::InvalidArgumentError(absl::StrCat("expected base64, got ", Quote(std::string_view(&c, 1))));
    }
    if (digit == kPadding) {
      ++padding;
    } else {
      group = group << 6 | digit;
      ++digits;
    }
    if (digits + padding == 4) {
      group <<= 6 * padding;
      for (int k = 0; k < 3 - padding; ++k) {
        bytes.push_back(static_cast<char>(group >> (16 - 8 * k) & 255));
      }
      group = 0;
      digits = padding = 0;
    }
  }
  if (digits + padding != 0) {
    return absl::InvalidArgumentError("base64 ends inside a group of four digits");
  }
  return bytes;
}

VtkArrayWriter::VtkArrayWriter(OutputFile& output, uint64_t bytes)
    : output_(output), bytes_(bytes), header_offset_(output.size()) {
  block_.reserve(std::min<uint64_t>(bytes, kBlockBytes));
  if (output_.IsSeekable()) {
    compressed_sizes_.resize((bytes + kBlockBytes - 1) / kBlockBytes);
    output_.Write(Header());  // its place
    compressed_sizes_.clear();
  }
}

std::string VtkArrayWriter::Header() const {
  std::vector<uint64_t> words = {compressed_sizes_.size(), kBlockBytes, bytes_ % kBlockBytes};
  words.insert(words.end(), compressed_sizes_.begin(), compressed_sizes_.end());
  std::string text;
  AppendBase64({reinterpret_cast<const char*>(words.data()), words.size() * sizeof(uint64_t)}, text);
  return text;
}

void VtkArrayWriter::Send(bool is_end) {
  // A multiple of three bytes at a time, so that only the last piece is padded.
  constexpr size_t kPieceBytes = 3 << 16;
  const size_t end = is_end ? pending_.size() : pending_.size() / 3 * 3;
  std::string text;
  for (size_t begin = 0; begin < end; begin += kPieceBytes) {
    text.clear();
    AppendBase64(std::string_view(pending_).substr(begin, std::min(kPieceBytes, end - begin)), text);
    output_.Write(text);
  }
  pending_.erase(0, end);
}

void VtkArrayWriter::CompressBlock() {
  added_ += block_.size();
  if (status_.ok() && !output_.status().ok()) {
    status_ = output_.status();
  }
  if (status_.ok()) {
    const size_t begin = pending_.size();
    uLongf size = compressBound(block_.size());
    pending_.resize(begin + size);
    const int result = compress2(reinterpret_cast<Bytef*>(pending_.data() + begin), &size,
                                 reinterpret_cast<const Bytef*>(block_.data()), block_.size(), kCompressionLevel);
    if (result != Z_OK) {
      status_ = absl::ResourceExhaustedError(absl::StrCat("zlib could not compress a block: ", zError(result)));
    }
    pending_.resize(begin + size);
    compressed_sizes_.push_back(size);
    if (output_.IsSeekable()) {
      Send(/*is_end=*/false);
    }
  }
  block_.clear();
}

absl::Status VtkArrayWriter::Finish() {
  if (!block_.empty()) {
    CompressBlock();
  }
  if (status_.ok() && added_ != bytes_) {
    status_ = absl::InternalError(absl::StrCat("an array of ", bytes_, " bytes got ", added_));
  }
  if (!status_.ok()) {
    return status_;
  }
  if (output_.IsSeekable()) {
    Send(/*is_end=*/true);
    output_.Overwrite(header_offset_, Header());
  } else {
    output_.Write(Header());
    Send(/*is_end=*/true);
  }
  return output_.status();
}

absl::StatusOr<std::string> DecodeVtkArray(std::string_view text, const VtkEncoding& encoding) {
  absl::StatusOr<std::string> bytes = DecodeBase64(text);
  if (!bytes.ok()) {
    return bytes;
  }
  return encoding.is_compressed() ? Decompress(*bytes, encoding) : TakeUncompressed(*bytes, encoding);
}

absl::StatusOr<std::string> DecodeAppendedVtkArray(std::string_view data, bool is_base64, const VtkEncoding& encoding) {
  const uint64_t word = encoding.header_word_bytes;
  if (data.size() < (encoding.is_compressed() ? 3 * word : word)) {
    return absl::InvalidArgumentError("the array ends inside its header");
  }
  if (!is_base64) {
    return encoding.is_compressed() ? Decompress(data, encoding) : TakeUncompressed(data, encoding);
  }
  // Nothing but its header tells where an array ends; that of a compressed one is base64 by itself.
  absl::StatusOr<std::string> start = DecodeBase64Start(data, encoding.is_compressed() ? 3 * word : word);
  if (!start.ok()) {
    return start;
  }
  if (!encoding.is_compressed()) {
    const uint64_t size = LoadHeaderWord(*start, 0, encoding);
    const bool is_apart = start->size() == word && data.substr(0, Base64Size(word)).back() == '=';
    const uint64_t characters = size > data.size() ? data.size() + 1
                                : is_apart         ? Base64Size(word) + Base64Size(size)
                                                   : Base64Size(word + size);
    return characters > data.size()
               ? absl::InvalidArgumentError(absl::StrCat("the array says that it has ", size, " bytes, and is shorter"))
               : DecodeVtkArray(data.substr(0, characters), encoding);
  }
  const uint64_t blocks = LoadHeaderWord(*start, 0, encoding);
  if (blocks > data.size() / word) {
    return absl::InvalidArgumentError(absl::StrCat("the array says that it has ", blocks, " blocks, and is shorter"));
  }
  const uint64_t header = (3 + blocks) * word;
  start = DecodeBase64Start(data, header);
  if (!start.ok()) {
    return start;
  }
  uint64_t compressed = 0;
  for (uint64_t block = 0; block < blocks && compressed <= data.size(); ++block) {
    compressed += std::min<uint64_t>(LoadHeaderWord(*start, 3 + block, encoding), data.size() + 1);
  }
  const uint64_t characters = Base64Size(header) + Base64Size(compressed);
  return characters > data.size() ? absl::InvalidArgumentError(absl::StrCat("the blocks of the array have ", compressed,
                                                                            " bytes, and are shorter"))
                                  : DecodeVtkArray(data.substr(0, characters), encoding);
}

}  // namespace wellspace::formats
