// The binary form of data arrays in VTK's XML files: blocks, each compressed by zlib, LZ4 or xz, or not at all. Inline
// it is base64; appended, base64 or the bytes.
//
// Compressed:   base64(header) base64(blocks); header: number of blocks, bytes of a block, bytes of the last block if
//               that is shorter (else 0), then the compressed bytes of each block.
// Uncompressed: base64(header data); header: number of bytes.
#ifndef WELLSPACE_CLIENT_FORMATS_VTK_VTK_ARRAY_H_
#define WELLSPACE_CLIENT_FORMATS_VTK_VTK_ARRAY_H_

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/io/output_file.h"

namespace wellspace::formats {

// Compresses one array, block by block, and writes it.
//
// Memory: two blocks where the output is seekable; otherwise the compressed array, whose header has to come first.
// Thread safety: thread-compatible.
class VtkArrayWriter {
 public:
  // Bytes are compressed in blocks of this size; every type's size divides it.
  static constexpr size_t kBlockBytes = 1 << 19;

  // The array will have `bytes` bytes. REQUIRES: `output` outlives this, and only this writes to it before Finish.
  VtkArrayWriter(OutputFile& output, uint64_t bytes);

  // REQUIRES:   no more than `bytes` are added.
  template <typename T>
  void Add(T value) {
    const size_t size = block_.size();
    block_.resize(size + sizeof(T));
    std::memcpy(block_.data() + size, &value, sizeof(T));
    if (block_.size() == kBlockBytes) {
      CompressBlock();
    }
  }

  // Completes header and blocks. Header words are UInt64, bytes in the machine's order.
  //
  // Errors:     the first of all so far; INTERNAL when fewer bytes were added than announced.
  absl::Status Finish();

 private:
  void CompressBlock();
  // base64 of whole groups of three bytes of `pending_`, and of all at the end.
  void Send(bool is_end);
  std::string Header() const;

  OutputFile& output_;
  const uint64_t bytes_;
  const uint64_t header_offset_;
  std::string block_;
  std::string pending_;  // compressed, not yet written
  std::vector<uint64_t> compressed_sizes_;
  uint64_t added_ = 0;
  absl::Status status_;
};

enum class VtkCompressor { kNone, kZlib, kLz4, kLzma };

// The encoding of its arrays that a file declares.
struct VtkEncoding {
  VtkCompressor compressor = VtkCompressor::kNone;
  bool big_endian = false;
  int header_word_bytes = 4;  // 4 or 8

  bool is_compressed() const { return compressor != VtkCompressor::kNone; }
};

// The bytes of one array. Sizes in `text` are checked against the bytes there before anything is allocated by them.
//
// Errors:     INVALID_ARGUMENT, a message without a location.
absl::StatusOr<std::string> DecodeVtkArray(std::string_view text, const VtkEncoding& encoding);

// The same of the array that `data` starts with, whatever follows it: bytes, or base64 without blanks.
absl::StatusOr<std::string> DecodeAppendedVtkArray(std::string_view data, bool is_base64, const VtkEncoding& encoding);

// The words of type T in `bytes`, swapped when the file is of the other byte order. REQUIRES: sizeof(T) * (i + 1) <=
// bytes.size().
template <typename T>
T LoadWord(std::string_view bytes, size_t i, bool big_endian) {
  char word[sizeof(T)];
  for (size_t k = 0; k < sizeof(T); ++k) {
    word[big_endian ? sizeof(T) - 1 - k : k] = bytes[sizeof(T) * i + k];
  }
  T value;
  std::memcpy(&value, word, sizeof(T));
  return value;
}

// base64 of `bytes`, appended to `text`.
void AppendBase64(std::string_view bytes, std::string& text);

// Reverses AppendBase64, also for the concatenation of several outputs; blanks and ends of lines are skipped.
absl::StatusOr<std::string> DecodeBase64(std::string_view text);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_VTK_VTK_ARRAY_H_
