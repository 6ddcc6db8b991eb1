#include "server/store/ballast.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"

namespace wellspace::server {
namespace {

constexpr uint64_t kBallastBlock = uint64_t{1} << 16;

// Bytes that a disk which compresses has to keep all of.
std::vector<char> MakeIncompressible(uint64_t size) {
  std::vector<char> bytes(size);
  uint64_t state = 0x9e3779b97f4a7c15;
  for (char& byte : bytes) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    byte = static_cast<char>(state >> 32);
  }
  return bytes;
}

}  // namespace

Ballast::Ballast(FileSystem& files, std::string path, uint64_t bytes)
    : files_(files), path_(std::move(path)), bytes_(bytes), is_whole_(bytes == 0) {}

absl::Status Ballast::Fill() {
  if (is_whole_.load(std::memory_order_acquire)) {
    return absl::OkStatus();
  }
  const std::lock_guard lock(mutex_);
  if (is_whole_.load(std::memory_order_relaxed)) {
    return absl::OkStatus();
  }
  WELLSPACE_RETURN_IF_ERROR(Write());
  is_whole_.store(true, std::memory_order_release);
  return absl::OkStatus();
}

absl::Status Ballast::Write() {
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<File> file, files_.Open(path_, FileSystem::Mode::kCreateOrWrite));
  WELLSPACE_ASSIGN_OR_RETURN(uint64_t size, file->Size());
  if (size == bytes_) {
    return absl::OkStatus();
  }
  const std::vector<char> block = MakeIncompressible(std::min(kBallastBlock, bytes_));
  for (size = std::min(size, bytes_); size < bytes_; size += block.size()) {
    const uint64_t count = std::min<uint64_t>(block.size(), bytes_ - size);
    if (const absl::Status written = file->WriteAt(size, {block.data(), count}); !written.ok()) {
      // Without the whole ballast, the little room that is left is free for deletions.
      file->Truncate(0).IgnoreError();
      return written;
    }
  }
  return file->Truncate(bytes_);  // it may have been larger
}

bool Ballast::GiveUp() {
  const std::lock_guard lock(mutex_);
  if (bytes_ == 0 || !is_whole_.load(std::memory_order_relaxed)) {
    return false;
  }
  is_whole_.store(false, std::memory_order_release);
  const auto file = files_.Open(path_, FileSystem::Mode::kWrite);
  return file.ok() && (*file)->Truncate(0).ok();
}

}  // namespace wellspace::server
