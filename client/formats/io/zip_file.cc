#include "client/formats/io/zip_file.h"

#include <minizip/unzip.h>
#include <minizip/zip.h>
#include <zlib.h>

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/io/compression.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"

namespace wellspace::formats {
namespace {

// Members of this size or more, compressed or not, want the fields of zip64. Deflate lengthens data it cannot compress
// by far less than the difference to 2^32.
constexpr uint64_t kZip64Bytes = 0xff00'0000;

constexpr uLong kEncrypted = 1;  // flag

// For unzLocateFile.
constexpr int kCaseSensitive = 1;

// Turns minizip's origin of a seek into a position. False when it lies outside the file.
bool Seek(ZPOS64_T offset, int origin, uint64_t size, uint64_t& position) {
  const uint64_t base = origin == ZLIB_FILEFUNC_SEEK_SET ? 0 : origin == ZLIB_FILEFUNC_SEEK_CUR ? position : size;
  if (offset > size - std::min(base, size)) {
    return false;
  }
  position = base + offset;
  return true;
}

}  // namespace

struct ZipWriter::Archive {
  explicit Archive(OutputFile& file) : output(file) {}

  OutputFile& output;
  uint64_t position = 0;
  zipFile zip = nullptr;

  static Archive& Of(voidpf opaque) { return *static_cast<Archive*>(opaque); }

  // Errors of the file are kept there; minizip need not know.
  static uLong Write(voidpf opaque, voidpf /*stream*/, const void* bytes, uLong size) {
    Archive& self = Of(opaque);
    const std::string_view text(static_cast<const char*>(bytes), size);
    // minizip goes back only to complete the header of a member.
    const size_t replaced = std::min<uint64_t>(size, self.output.size() - self.position);
    if (replaced > 0) {
      self.output.Overwrite(self.position, text.substr(0, replaced));
    }
    self.output.Write(text.substr(replaced));
    self.position += size;
    return size;
  }

  zlib_filefunc64_def Functions() {
    zlib_filefunc64_def functions{};
    functions.zopen64_file = [](voidpf opaque, const void*, int) { return opaque; };
    functions.zread_file = [](voidpf, voidpf, void*, uLong) { return uLong{0}; };
    functions.zwrite_file = Write;
    functions.ztell64_file = [](voidpf opaque, voidpf) -> ZPOS64_T { return Of(opaque).position; };
    functions.zseek64_file = [](voidpf opaque, voidpf, ZPOS64_T offset, int origin) -> long {
      return Seek(offset, origin, Of(opaque).output.size(), Of(opaque).position) ? 0 : -1;
    };
    functions.zclose_file = [](voidpf, voidpf) { return 0; };
    functions.zerror_file = [](voidpf, voidpf) { return 0; };
    functions.opaque = this;
    return functions;
  }
};

ZipWriter::ZipWriter(OutputFile& output) : archive_(std::make_unique<Archive>(output)) {
  zlib_filefunc64_def functions = archive_->Functions();
  archive_->zip = zipOpen2_64("", APPEND_STATUS_CREATE, nullptr, &functions);
  if (archive_->zip == nullptr) {
    status_ = absl::ResourceExhaustedError("minizip could not begin an archive");
  }
}

ZipWriter::~ZipWriter() {
  if (archive_->zip != nullptr) {
    zipClose(archive_->zip, nullptr);
  }
}

void ZipWriter::Note(int result, const char* what) {
  if (status_.ok() && !archive_->output.status().ok()) {
    status_ = archive_->output.status();
  }
  if (status_.ok() && result != ZIP_OK) {
    status_ = absl::ResourceExhaustedError(absl::StrCat("minizip could not ", what, ": error ", result));
  }
}

void ZipWriter::Begin(const std::string& name, uint64_t size) {
  EndMember();
  if (!status_.ok()) {
    return;
  }
  zip_fileinfo info{};
  info.tmz_date.tm_year = 1980;  // the first that the format knows
  info.tmz_date.tm_mday = 1;
  Note(zipOpenNewFileInZip64(archive_->zip, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED,
                             kCompressionLevel, size >= kZip64Bytes ? 1 : 0),
       "begin a member");
  in_member_ = status_.ok();
}

void ZipWriter::Write(std::string_view bytes) {
  constexpr size_t kPieceBytes = 1 << 20;  // a request to stop is heard after each
  while (status_.ok() && !bytes.empty()) {
    const std::string_view piece = bytes.substr(0, kPieceBytes);
    Note(zipWriteInFileInZip(archive_->zip, piece.data(), static_cast<unsigned>(piece.size())), "compress");
    bytes.remove_prefix(piece.size());
  }
}

void ZipWriter::EndMember() {
  if (std::exchange(in_member_, false)) {
    Note(zipCloseFileInZip(archive_->zip), "end a member");
  }
}

absl::Status ZipWriter::Finish() {
  EndMember();
  if (status_.ok()) {
    Note(zipClose(std::exchange(archive_->zip, nullptr), nullptr), "end the archive");
  }
  return status_;
}

struct ZipReader::Archive {
  explicit Archive(InputFile input) : file(std::move(input)) {}

  InputFile file;
  uint64_t size = 0;
  uint64_t position = 0;
  unzFile zip = nullptr;
  absl::Status status;  // of the first read that failed

  static Archive& Of(voidpf opaque) { return *static_cast<Archive*>(opaque); }

  // The bytes read last from the file: minizip asks for headers byte by byte.
  std::vector<char> block;
  uint64_t block_begin = 0;

  // The bytes at `position` that are in the block, after reading it anew if there are none; empty at the end and on
  // errors.
  std::string_view BytesAtPosition() {
    constexpr size_t kBlockBytes = 1 << 16;
    if (position < block_begin || position - block_begin >= block.size()) {
      block.resize(kBlockBytes);
      block_begin = position;
      const absl::StatusOr<size_t> got = file.ReadAt(position, block.data(), block.size());
      status.Update(got.status());
      block.resize(got.ok() ? *got : 0);
    }
    return std::string_view(block.data(), block.size()).substr(position - block_begin);
  }

  static uLong Read(voidpf opaque, voidpf /*stream*/, void* buffer, uLong size) {
    Archive& self = Of(opaque);
    uLong total = 0;
    while (total < size) {
      const std::string_view bytes = self.BytesAtPosition().substr(0, size - total);
      if (bytes.empty()) {
        break;
      }
      bytes.copy(static_cast<char*>(buffer) + total, bytes.size());
      total += bytes.size();
      self.position += bytes.size();
    }
    return total;
  }

  zlib_filefunc64_def Functions() {
    zlib_filefunc64_def functions{};
    functions.zopen64_file = [](voidpf opaque, const void*, int) { return opaque; };
    functions.zread_file = Read;
    functions.zwrite_file = [](voidpf, voidpf, const void*, uLong) { return uLong{0}; };
    functions.ztell64_file = [](voidpf opaque, voidpf) -> ZPOS64_T { return Of(opaque).position; };
    functions.zseek64_file = [](voidpf opaque, voidpf, ZPOS64_T offset, int origin) -> long {
      return Seek(offset, origin, Of(opaque).size, Of(opaque).position) ? 0 : -1;
    };
    functions.zclose_file = [](voidpf, voidpf) { return 0; };
    functions.zerror_file = [](voidpf opaque, voidpf) { return Of(opaque).status.ok() ? 0 : 1; };
    functions.opaque = this;
    return functions;
  }
};

ZipReader::ZipReader(InputFile file) : archive_(std::make_unique<Archive>(std::move(file))) {}

ZipReader::~ZipReader() {
  if (archive_->zip != nullptr) {
    unzClose(archive_->zip);
  }
}

absl::StatusOr<std::unique_ptr<ZipReader>> ZipReader::Open(InputFile file) {
  const std::optional<uint64_t> size = file.size();
  std::unique_ptr<ZipReader> reader(new ZipReader(std::move(file)));
  Archive& archive = *reader->archive_;
  if (!size.has_value()) {
    return absl::InvalidArgumentError(
        absl::StrCat(archive.file.name(), ": expected a regular file, since the table of a zip archive is at its end"));
  }
  archive.size = *size;
  zlib_filefunc64_def functions = archive.Functions();
  archive.zip = unzOpen2_64("", &functions);
  if (!archive.status.ok()) {
    return archive.status;
  }
  if (archive.zip == nullptr) {
    return absl::InvalidArgumentError(absl::StrCat(archive.file.name(), ": expected a zip archive"));
  }
  return reader;
}

absl::Status ZipReader::Error(std::string_view message) const {
  if (!archive_->status.ok()) {
    return archive_->status;
  }
  return absl::InvalidArgumentError(
      absl::StrCat(archive_->file.name(), ": ", member_, ": ", absl::string_view(message.data(), message.size())));
}

bool ZipReader::Has(const std::string& name) const {
  return unzLocateFile(archive_->zip, name.c_str(), kCaseSensitive) == UNZ_OK;
}

absl::StatusOr<uint64_t> ZipReader::Begin(const std::string& name) {
  unzCloseCurrentFile(archive_->zip);
  member_ = name;
  const int located = unzLocateFile(archive_->zip, name.c_str(), kCaseSensitive);
  if (located == UNZ_END_OF_LIST_OF_FILE) {
    return absl::InvalidArgumentError(
        absl::StrCat(archive_->file.name(), ": expected a member ", Quote(name), ", and there is none"));
  }
  unz_file_info64 info{};
  if (located != UNZ_OK ||
      unzGetCurrentFileInfo64(archive_->zip, &info, nullptr, 0, nullptr, 0, nullptr, 0) != UNZ_OK) {
    return Error("the table of the archive is damaged");
  }
  if ((info.flag & kEncrypted) != 0 || (info.compression_method != 0 && info.compression_method != Z_DEFLATED)) {
    return Error("expected a member that is stored or deflated, and not encrypted");
  }
  const bool is_stored = info.compression_method == 0;
  if (info.compressed_size > archive_->size ||
      (is_stored ? info.uncompressed_size != info.compressed_size
                 : info.uncompressed_size / kMaxExpansion > info.compressed_size)) {
    return Error(absl::StrCat("cannot have ", info.compressed_size, " bytes compressed and ", info.uncompressed_size,
                              " bytes otherwise in a file of ", archive_->size));
  }
  if (unzOpenCurrentFile(archive_->zip) != UNZ_OK) {
    return Error("the header of the member is damaged");
  }
  return info.uncompressed_size;
}

absl::StatusOr<size_t> ZipReader::Read(char* buffer, size_t size) {
  const int got = unzReadCurrentFile(archive_->zip, buffer,
                                     static_cast<unsigned>(std::min<size_t>(size, std::numeric_limits<int>::max())));
  if (got < 0) {
    return Error("cannot be decompressed: its bytes are damaged");
  }
  if (got == 0 && unzCloseCurrentFile(archive_->zip) == UNZ_CRCERROR) {
    return Error("its checksum is wrong: its bytes are damaged");
  }
  return static_cast<size_t>(got);
}

}  // namespace wellspace::formats
