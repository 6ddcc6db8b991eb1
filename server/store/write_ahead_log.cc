#include "server/store/write_ahead_log.h"

#include <bit>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "proto/checksum.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// The log, in bytes. All numbers of its headers have the highest byte first.
constexpr uint64_t kLogHeaderBytes = 32;
constexpr uint64_t kFrameHeaderBytes = 24;
constexpr uint32_t kLogMagic = 0x377f0682;  // its lowest bit: the words of checksums have the highest byte first
constexpr uint32_t kLogFormat = 3'007'000;

// The mark: these, then the salts, the frames and whether the database has them, then a CRC32C of all that; the lowest
// byte first.
constexpr std::array<char, 8> kMarkMagic = {'W', 's', 'M', 'a', 'r', 'k', '1', '\n'};
static_assert(std::endian::native == std::endian::little, "the mark has the bytes of memory");

// A server that begins the log anew in each of so many looks has a bad one.
constexpr int kMostLogLooks = 10;

uint32_t NumberAt(std::span<const char> bytes, size_t at, bool is_big_endian = true) {
  uint32_t number = 0;
  std::memcpy(&number, bytes.data() + at, sizeof(number));
  return is_big_endian ? __builtin_bswap32(number) : number;
}

// SQLite's checksum of a multiple of eight bytes, begun with that of the bytes before.
using LogChecksum = std::array<uint32_t, 2>;
LogChecksum Extend(LogChecksum checksum, std::span<const char> bytes, bool is_big_endian) {
  for (size_t at = 0; at + 8 <= bytes.size(); at += 8) {
    checksum[0] += NumberAt(bytes, at, is_big_endian) + checksum[1];
    checksum[1] += NumberAt(bytes, at + 4, is_big_endian) + checksum[0];
  }
  return checksum;
}

struct LogHeader {
  bool has_any_byte = false;  // that is not 0
  bool is_whole = false;
  bool is_big_endian = false;
  uint32_t page_bytes = 0;
  std::array<uint32_t, 2> salts{};
  LogChecksum checksum{};
};

LogHeader ParseHeader(std::span<const char> bytes) {
  LogHeader header;
  for (const char byte : bytes) {
    header.has_any_byte |= byte != 0;
  }
  const uint32_t magic = NumberAt(bytes, 0);
  header.is_big_endian = (magic & 1) != 0;
  header.page_bytes = NumberAt(bytes, 8);
  header.salts = {NumberAt(bytes, 16), NumberAt(bytes, 20)};
  header.checksum = Extend({}, bytes.first(24), header.is_big_endian);
  header.is_whole = (magic & ~1u) == kLogMagic && NumberAt(bytes, 4) == kLogFormat &&
                    std::has_single_bit(header.page_bytes) && header.page_bytes >= 512 && header.page_bytes <= 65'536 &&
                    header.checksum == LogChecksum{NumberAt(bytes, 24), NumberAt(bytes, 28)};
  return header;
}

class LogWalk {
 public:
  LogWalk(const File& file, const LogHeader& header)
      : file_(file),
        header_(header),
        frame_(kFrameHeaderBytes + header.page_bytes),
        before_(header.checksum),
        stored_before_(header.checksum) {}

  // Goes on to the next frame. False: the file has none.
  absl::StatusOr<bool> Next() {
    stored_before_ = stored_;
    const uint64_t offset = kLogHeaderBytes + number_ * frame_.size();
    WELLSPACE_ASSIGN_OR_RETURN(const uint64_t count, file_.ReadAt(offset, frame_));
    if (count < frame_.size()) {
      return false;
    }
    ++number_;
    stored_ = {NumberAt(frame_, 16), NumberAt(frame_, 20)};
    return true;
  }

  // Whether the frame is the one that was written behind all those before.
  bool IsWhole() {
    if (!IsBehind(before_)) {
      return false;
    }
    before_ = stored_;
    return true;
  }
  // Whether it was written, whole, behind a frame that had the checksum that the one before has.
  bool IsWholeBehindOther() const { return IsBehind(stored_before_); }
  bool IsCommit() const { return NumberAt(frame_, 4) != 0; }
  uint64_t number() const { return number_; }  // counted from 1 on
  uint64_t frame_bytes() const { return frame_.size(); }

 private:
  bool IsBehind(const LogChecksum& checksum) const {
    const std::span<const char> bytes(frame_);
    return NumberAt(bytes, 0) != 0 &&
           header_.salts == std::array<uint32_t, 2>{NumberAt(bytes, 8), NumberAt(bytes, 12)} &&
           Extend(Extend(checksum, bytes.first(8), header_.is_big_endian), bytes.subspan(kFrameHeaderBytes),
                  header_.is_big_endian) == stored_;
  }

  const File& file_;
  const LogHeader& header_;
  std::vector<char> frame_;
  uint64_t number_ = 0;
  LogChecksum before_;         // of the frames that are whole
  LogChecksum stored_before_;  // as the frame before has it
  LogChecksum stored_ = before_;
};

// The damage at the end of the log, where the walk is at a bad frame; empty: a write was torn.
absl::StatusOr<std::string> LookBehind(LogWalk& walk) {
  const uint64_t bad = walk.number();
  int commits = 0;
  while (true) {
    WELLSPACE_ASSIGN_OR_RETURN(const bool has_frame, walk.Next());
    if (!has_frame) {
      return std::string();
    }
    if (!walk.IsWholeBehindOther()) {
      continue;
    }
    if (commits == 2) {
      return absl::StrCat("frame ", bad, ", at byte ", kLogHeaderBytes + (bad - 1) * walk.frame_bytes(),
                          ", is not what was written, and frame ", walk.number(), " behind it is");
    }
    commits += walk.IsCommit() ? 1 : 0;
  }
}

absl::StatusOr<std::string> LookAtFrames(const File& file, const LogHeader& header, uint32_t needed) {
  LogWalk walk(file, header);
  while (true) {
    WELLSPACE_ASSIGN_OR_RETURN(const bool has_frame, walk.Next());
    if (!has_frame) {
      return walk.number() < needed
                 ? absl::StrCat("it ends behind frame ", walk.number(), ", and ", needed, " were acknowledged")
                 : std::string();
    }
    if (walk.IsWhole()) {
      continue;
    }
    if (walk.number() <= needed) {
      return absl::StrCat("frame ", walk.number(), ", at byte ",
                          kLogHeaderBytes + (walk.number() - 1) * walk.frame_bytes(), ", is not what was written, and ",
                          needed, " frames were acknowledged");
    }
    return LookBehind(walk);
  }
}

// The damage of the log, by the mark that there is; empty: there is none.
absl::StatusOr<std::string> LookAtLog(FileSystem& files, const std::string& database,
                                      const std::optional<LogPosition>& mark) {
  const uint32_t needed = mark.has_value() && !mark->is_in_database ? mark->frames : 0;
  const std::string advice = absl::StrCat(
      "; if another program than wellspaced has opened the database since, it has taken the log over: "
      "remove ",
      MarkPathOf(database), " then");
  auto file = files.Open(LogPathOf(database), FileSystem::Mode::kRead);
  if (file.status().code() == absl::StatusCode::kNotFound) {
    return needed == 0 ? std::string()
                       : absl::StrCat("the file is missing, and ", needed, " frames of it were acknowledged", advice);
  }
  WELLSPACE_RETURN_IF_ERROR(file.status());
  std::array<char, kLogHeaderBytes> bytes{};
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t count, (*file)->ReadAt(0, bytes));
  if (count < bytes.size()) {
    return needed == 0
               ? std::string()
               : absl::StrCat("it ends at byte ", count, ", and ", needed, " frames of it were acknowledged", advice);
  }
  const LogHeader header = ParseHeader(bytes);
  if (!header.is_whole) {
    // Without a mark: it is written, and synchronised, before any frame is, and lies in one sector of a disk.
    WELLSPACE_ASSIGN_OR_RETURN(const uint64_t size, (*file)->Size());
    const bool was_written = !mark.has_value() && header.has_any_byte && size > kLogHeaderBytes;
    return needed > 0 || was_written ? std::string("its first 32 bytes are not what was written") : std::string();
  }
  if (!mark.has_value() || header.salts == mark->salts) {
    return LookAtFrames(**file, header, mark.has_value() ? mark->frames : 0);
  }
  return needed > 0 ? absl::StrCat("it is another one than that of which ", needed, " frames were acknowledged", advice)
                    : LookAtFrames(**file, header, 0);
}

}  // namespace

std::string LogPathOf(const std::string& database) { return database + "-wal"; }
std::string MarkPathOf(const std::string& database) { return database + "-mark"; }

absl::StatusOr<std::optional<LogPosition>> LogMark::Read(FileSystem& files, const std::string& database) {
  std::optional<LogPosition> mark;
  auto file = files.Open(MarkPathOf(database), FileSystem::Mode::kRead);
  if (file.status().code() == absl::StatusCode::kNotFound) {
    return mark;
  }
  WELLSPACE_RETURN_IF_ERROR(file.status());
  std::array<char, kBytes> bytes{};
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t count, (*file)->ReadAt(0, bytes));
  if (count == bytes.size() && std::memcmp(bytes.data(), kMarkMagic.data(), kMarkMagic.size()) == 0 &&
      NumberAt(bytes, 24, false) == Crc32c(bytes.data(), 24)) {
    mark = LogPosition{.salts = {NumberAt(bytes, 8, false), NumberAt(bytes, 12, false)},
                       .frames = NumberAt(bytes, 16, false),
                       .is_in_database = NumberAt(bytes, 20, false) != 0};
  }
  return mark;
}

absl::StatusOr<std::unique_ptr<LogMark>> LogMark::Open(FileSystem& files, const std::string& database) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::optional<LogPosition> before, Read(files, database));
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<File> file,
                             files.Open(MarkPathOf(database), FileSystem::Mode::kCreateOrWrite));
  std::unique_ptr<LogMark> mark(new LogMark(std::move(file)));
  if (!before.has_value()) {
    WELLSPACE_RETURN_IF_ERROR(mark->Write({.is_in_database = true}));
    WELLSPACE_RETURN_IF_ERROR(mark->Synchronize());
  }
  return mark;
}

absl::Status LogMark::Write(const LogPosition& position) {
  std::array<char, kBytes> bytes{};
  const std::array<uint32_t, 4> numbers = {position.salts[0], position.salts[1], position.frames,
                                           position.is_in_database ? 1u : 0u};
  std::memcpy(bytes.data(), kMarkMagic.data(), kMarkMagic.size());
  std::memcpy(bytes.data() + 8, numbers.data(), sizeof(numbers));
  const uint32_t checksum = Crc32c(bytes.data(), 24);
  std::memcpy(bytes.data() + 24, &checksum, sizeof(checksum));
  return file_->WriteAt(0, bytes);  // within one sector: all of it, or nothing
}

absl::StatusOr<std::string> FindLogDamage(FileSystem& files, const std::string& database) {
  std::string damage;
  for (int look = 0; look < kMostLogLooks; ++look) {
    WELLSPACE_ASSIGN_OR_RETURN(const std::optional<LogPosition> before, LogMark::Read(files, database));
    WELLSPACE_ASSIGN_OR_RETURN(damage, LookAtLog(files, database, before));
    if (damage.empty()) {
      return damage;
    }
    // The log may have been begun anew between the two looks; each time the mark is changed then.
    WELLSPACE_ASSIGN_OR_RETURN(const std::optional<LogPosition> after, LogMark::Read(files, database));
    if (before == after) {
      break;
    }
  }
  return absl::StrCat(LogPathOf(database), ": ", damage);
}

absl::Status CheckLog(FileSystem& files, const std::string& database) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::string damage, FindLogDamage(files, database));
  return damage.empty() ? absl::OkStatus()
                        : MakeError(v1::ERROR_REASON_FILE_DAMAGED,
                                    absl::StrCat(damage,
                                                 "; what was acknowledged since would be lost: restore a "
                                                 "back-up"));
}

}  // namespace wellspace::server
