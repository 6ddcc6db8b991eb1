#include "server/store/point_file.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "proto/checksum.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

static_assert(std::endian::native == std::endian::little, "the file has the bytes of memory");

constexpr uint64_t kReadBlock = uint64_t{1} << 17;  // coordinates: 1 MiB

absl::Status Damaged(const std::string& path, const std::string& what) {
  return MakeError(v1::ERROR_REASON_FILE_DAMAGED, absl::StrCat(path, ": ", what));
}

}  // namespace

PointFile::PointFile(FileSystem& files, std::shared_ptr<StoreHealth> health, std::shared_ptr<WrittenFiles> written,
                     std::string path, int dimension, std::vector<store::v1::StepRecord::Points> committed,
                     std::unique_ptr<FilesInUse::Use> use)
    : files_(files),
      health_(std::move(health)),
      written_(std::move(written)),
      path_(std::move(path)),
      use_(std::move(use)) {
  for (const store::v1::StepRecord::Points& points : committed) {
    const uint64_t count = points.count() * dimension;
    pieces_.push_back({.first = committed_count_, .end = committed_count_ + count, .crc32c = points.crc32c()});
    committed_count_ += count;
  }
  coordinate_count_ = committed_count_;
  has_new_name_ = committed_count_ == 0;
}

absl::StatusOr<std::shared_ptr<File>> PointFile::OpenToAppend() {
  auto mode = FileSystem::Mode::kWrite;
  {
    const std::lock_guard lock(mutex_);
    if (unsynchronised_ != nullptr) {
      return unsynchronised_;
    }
    if (has_new_name_) {
      mode = FileSystem::Mode::kCreateOrWrite;
    }
  }
  auto opened = written_->Open(files_, path_, mode);
  if (!opened.ok()) {
    return opened.status().code() == absl::StatusCode::kNotFound ? Damaged(path_, "the file is missing")
                                                                 : health_->OfOpen(opened.status());
  }
  std::shared_ptr<File> file = *std::move(opened);
  if (!is_cut_) {
    const absl::StatusOr<uint64_t> size = file->Size();
    if (!size.ok()) {
      return health_->OfWrite(size.status());
    }
    const uint64_t committed = committed_count_ * sizeof(double);
    if (*size < committed) {
      return Damaged(path_, absl::StrCat("the file has ", *size, " bytes, and should have ", committed, " at least"));
    }
    if (*size > committed) {
      if (const absl::Status cut = file->Truncate(committed); !cut.ok()) {
        return health_->OfWrite(cut);
      }
    }
    is_cut_ = true;
  }
  return file;
}

absl::Status PointFile::Append(std::span<const double> coordinates) {
  if (coordinates.empty()) {
    return absl::OkStatus();
  }
  WELLSPACE_RETURN_IF_ERROR(health_->CheckRoom());
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<File> file, OpenToAppend());
  const absl::Status written =
      file->WriteAt(coordinate_count_ * sizeof(double),
                    {reinterpret_cast<const char*>(coordinates.data()), coordinates.size_bytes()});
  {
    // Also after an error: some may have been written. After the write, so that no Synchronize has missed it.
    const std::lock_guard lock(mutex_);
    unsynchronised_ = file;
    ++appends_;
  }
  if (!written.ok()) {
    return health_->OfWrite(written);
  }
  coordinate_count_ += coordinates.size();
  return absl::OkStatus();
}

void PointFile::Truncate(uint64_t count) {
  coordinate_count_ = std::min(coordinate_count_, count);  // bytes beyond are written over, or cut by the next start
  const std::lock_guard lock(mutex_);
  std::erase_if(pieces_, [&](const Piece& piece) { return piece.end > count; });
}

absl::Status PointFile::Synchronize() {
  WELLSPACE_RETURN_IF_ERROR(health_->Check());
  std::shared_ptr<File> file;
  uint64_t appends = 0;
  bool has_new_name = false;
  {
    const std::lock_guard lock(mutex_);
    file = unsynchronised_;
    appends = appends_;
    has_new_name = has_new_name_;
  }
  if (file == nullptr) {
    return absl::OkStatus();
  }
  if (const absl::Status synchronised = file->Synchronize(); !synchronised.ok()) {
    return health_->Fail(synchronised);
  }
  if (has_new_name) {
    if (const absl::Status synchronised = written_->folder().Synchronize(); !synchronised.ok()) {
      return health_->Fail(synchronised);
    }
  }
  const std::lock_guard lock(mutex_);
  has_new_name_ = false;
  if (appends_ == appends) {
    unsynchronised_ = nullptr;
  }
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<File>> PointFile::OpenToRead() const {
  auto file = files_.Open(path_, FileSystem::Mode::kRead);
  if (!file.ok()) {
    return ErrorOfRead(file.status());
  }
  return *std::move(file);
}

absl::Status PointFile::ReadBlocks(const File& file, uint64_t first, uint64_t end, const Take& take) const {
  std::vector<double> block(std::min(kReadBlock, end - first));
  while (first < end) {
    const std::span<double> part(block.data(), std::min(kReadBlock, end - first));
    const absl::StatusOr<uint64_t> count =
        file.ReadAt(first * sizeof(double), {reinterpret_cast<char*>(part.data()), part.size_bytes()});
    if (!count.ok()) {
      return ErrorOfRead(count.status());
    }
    if (*count < part.size_bytes()) {
      return Damaged(path_, absl::StrCat("the file ends at byte ", first * sizeof(double) + *count,
                                         ", and should have ", coordinate_count_ * sizeof(double), " bytes at least"));
    }
    WELLSPACE_RETURN_IF_ERROR(take(part));
    first += part.size();
  }
  return absl::OkStatus();
}

std::vector<PointFile::Piece>::iterator PointFile::PieceOf(uint64_t coordinate) const {
  return std::ranges::upper_bound(pieces_, coordinate, {}, &Piece::end);
}

absl::Status PointFile::CheckPieces(const File& file, uint64_t first, uint64_t end) const {
  std::vector<Piece> unchecked;
  {
    const std::lock_guard lock(mutex_);
    for (auto piece = PieceOf(first); piece != pieces_.end() && piece->first < end; ++piece) {
      if (!piece->is_checked) {
        unchecked.push_back(*piece);
      }
    }
  }
  for (const Piece& piece : unchecked) {
    uint32_t checksum = 0;
    WELLSPACE_RETURN_IF_ERROR(ReadBlocks(file, piece.first, piece.end, [&](std::span<const double> block) {
      checksum = ExtendCrc32c(checksum, block.data(), block.size_bytes());
      return absl::OkStatus();
    }));
    if (checksum != piece.crc32c) {
      return Damaged(path_, absl::StrCat("the bytes from ", piece.first * sizeof(double), " to ",
                                         piece.end * sizeof(double), " are not those that were written"));
    }
    const std::lock_guard lock(mutex_);
    const auto same = PieceOf(piece.first);
    if (same != pieces_.end() && same->first == piece.first && same->end == piece.end) {
      same->is_checked = true;
    }
  }
  return absl::OkStatus();
}

absl::Status PointFile::Read(uint64_t first, uint64_t end, const Take& take) const {
  if (first >= end) {
    return absl::OkStatus();  // there may be no file yet
  }
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<File> file, OpenToRead());
  WELLSPACE_RETURN_IF_ERROR(CheckPieces(*file, first, end));
  return ReadBlocks(*file, first, end, take);
}

absl::StatusOr<uint64_t> PointFile::CountEqual(uint64_t first, std::span<const double> coordinates) const {
  uint64_t equal = 0;
  bool has_ended = false;
  WELLSPACE_RETURN_IF_ERROR(Read(first, first + coordinates.size(), [&](std::span<const double> block) {
    if (has_ended) {
      return absl::OkStatus();
    }
    const std::span<const double> other = coordinates.subspan(equal, block.size());
    const auto is_same = [](double a, double b) { return std::memcmp(&a, &b, sizeof(a)) == 0; };
    equal += std::mismatch(block.begin(), block.end(), other.begin(), is_same).first - block.begin();
    has_ended = std::memcmp(block.data(), other.data(), block.size_bytes()) != 0;
    return absl::OkStatus();
  }));
  return equal;
}

absl::StatusOr<uint32_t> PointFile::Checksum(uint64_t first, uint64_t end) const {
  uint32_t checksum = 0;
  WELLSPACE_RETURN_IF_ERROR(Read(first, end, [&](std::span<const double> block) {
    checksum = ExtendCrc32c(checksum, block.data(), block.size_bytes());
    return absl::OkStatus();
  }));
  return checksum;
}

absl::StatusOr<std::vector<double>> PointFile::Copy(uint64_t first, uint64_t end,
                                                    const core::RunContext& context) const {
  std::vector<double> coordinates;
  coordinates.reserve(end - first);
  WELLSPACE_RETURN_IF_ERROR(Read(first, end, [&](std::span<const double> block) {
    coordinates.insert(coordinates.end(), block.begin(), block.end());
    return context.Check();
  }));
  return coordinates;
}

}  // namespace wellspace::server
