// Points in a file come back as they came; what was not committed is cut off, and flipped bits are found.
#include "server/store/point_file.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>
#include <thread>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

class PointFileTest : public ::testing::Test {
 protected:
  static constexpr uint64_t kPlaces = 2;

  PointFileTest() {
    std::iota(all_.begin(), all_.end(), 0.0);
    all_[0] = -0.0;
    all_[1] = std::numeric_limits<double>::denorm_min();
  }

  std::unique_ptr<PointFile> Open(std::vector<store::v1::StepRecord::Points> committed = {}) {
    return std::make_unique<PointFile>(PosixFileSystem(), health_, written_, path_, 2, std::move(committed));
  }

  // Two pieces: the first 200 000 coordinates, and the next 100 000.
  std::vector<store::v1::StepRecord::Points> Write() {
    std::vector<store::v1::StepRecord::Points> committed;
    const auto file = Open();
    for (const auto& [first, end] : {std::pair(0, 200'000), std::pair(200'000, 300'000)}) {
      const std::vector<double> part(all_.begin() + first, all_.begin() + end);
      EXPECT_TRUE(file->Append(part).ok());
      committed.push_back(MakePointsStep(first / 2, part, 2).points());
    }
    EXPECT_TRUE(file->Append(std::vector<double>(1000, 7)).ok()) << "garbage of an upload that breaks off";
    EXPECT_TRUE(file->Synchronize().ok());
    return committed;
  }

  const TestFolder folder_;
  const std::string path_ = folder_.path() + "/a.points";
  std::vector<absl::Status> failures_;
  const std::shared_ptr<StoreHealth> health_ =
      std::make_shared<StoreHealth>([this](const absl::Status& cause) { failures_.push_back(cause); });
  const std::shared_ptr<WrittenFiles> written_ =
      std::make_shared<WrittenFiles>(*PosixFileSystem().OpenFolder(folder_.path()), kPlaces);
  std::vector<double> all_ = std::vector<double>(500'000);
  const core::RunContext context_;
};

TEST_F(PointFileTest, GivesBackWhatCameInAnyPieces) {
  const auto file = Open();
  size_t at = 0;
  for (size_t piece = 0; at < all_.size(); piece = piece * 3 + 1) {  // 0, 1, 4, … beyond a block
    const size_t count = std::min(piece, all_.size() - at);
    ASSERT_TRUE(file->Append({all_.data() + at, count}).ok());
    at += count;
    if (piece % 2 == 0) {
      ASSERT_TRUE(file->Synchronize().ok());
    }
  }
  EXPECT_FALSE(file->is_in_memory());
  EXPECT_EQ(file->coordinate_count(), all_.size());
  for (const size_t first : {size_t{0}, size_t{1}, size_t{131'071}, size_t{131'072}, size_t{400'001}, all_.size()}) {
    const auto copy = file->CopyFrom(first, context_);
    ASSERT_TRUE(copy.ok()) << copy.status();
    EXPECT_TRUE(std::equal(copy->begin(), copy->end(), all_.begin() + static_cast<std::ptrdiff_t>(first), all_.end()));
    EXPECT_EQ(*file->Checksum(first, all_.size()), Crc32c(all_.data() + first, (all_.size() - first) * sizeof(double)));
  }
}

// Each keeps its descriptor until it is synchronised.
TEST_F(PointFileTest, NoMoreAreOpenThanThereArePlaces) {
  std::vector<std::unique_ptr<PointFile>> files;
  for (uint64_t i = 0; i <= kPlaces; ++i) {
    files.push_back(std::make_unique<PointFile>(PosixFileSystem(), health_, written_, path_ + std::to_string(i), 2,
                                                std::vector<store::v1::StepRecord::Points>()));
  }
  const std::vector<double> points(10);
  for (uint64_t i = 0; i < kPlaces; ++i) {
    ASSERT_TRUE(files[i]->Append(points).ok()) << i;
  }
  const absl::Status refused = files[kPlaces]->Append(points);
  EXPECT_EQ(ReasonOf(refused), "DISK_FULL") << refused;
  EXPECT_EQ(files[kPlaces]->coordinate_count(), 0u);
  ASSERT_TRUE(files[0]->Append(points).ok()) << "it has a place";
  ASSERT_TRUE(files[0]->Synchronize().ok());
  EXPECT_TRUE(files[kPlaces]->Append(points).ok());
  files.pop_back();
  EXPECT_TRUE(files[0]->Append(points).ok());
  EXPECT_TRUE(failures_.empty());
}

TEST_F(PointFileTest, ComparesBitByBit) {
  const auto file = Open();
  ASSERT_TRUE(file->Append(all_).ok());
  std::vector<double> other = all_;
  EXPECT_EQ(*file->CountEqual(0, other), all_.size());
  other[300'000] = std::nextafter(other[300'000], 0);
  EXPECT_EQ(*file->CountEqual(0, other), 300'000u);
  EXPECT_EQ(*file->CountEqual(7, std::span(other).subspan(7)), 299'993u);
  other[0] = 0.0;
  EXPECT_EQ(*file->CountEqual(0, other), 0u) << "0 is not -0";
}

TEST_F(PointFileTest, CopyingCanBeCancelled) {
  const auto file = Open();
  ASSERT_TRUE(file->Append(all_).ok());
  core::RunContext cancelled;
  cancelled.Cancel();
  EXPECT_EQ(file->CopyFrom(0, cancelled).status().code(), absl::StatusCode::kCancelled);
}

TEST_F(PointFileTest, OpensWithWhatWasCommittedAndCutsOffTheRest) {
  const auto committed = Write();
  const auto file = Open(committed);
  EXPECT_EQ(file->coordinate_count(), 300'000u);
  EXPECT_EQ(std::filesystem::file_size(path_), 301'000 * sizeof(double)) << "reading changes nothing";
  EXPECT_EQ(file->CopyFrom(0, context_)->size(), 300'000u);
  ASSERT_TRUE(file->Append({all_.data() + 300'000, 2}).ok());
  EXPECT_EQ(std::filesystem::file_size(path_), 300'002 * sizeof(double));
  EXPECT_EQ(*file->CountEqual(0, {all_.data(), 300'002}), 300'002u);
}

TEST_F(PointFileTest, TakesBackWhatWasNotCommitted) {
  const auto file = Open(Write());
  ASSERT_TRUE(file->Append(std::vector<double>(10, 5)).ok());
  file->Truncate(300'000);
  EXPECT_EQ(file->coordinate_count(), 300'000u);
  ASSERT_TRUE(file->Append({all_.data() + 300'000, 4}).ok());
  EXPECT_EQ(*file->CountEqual(299'998, {all_.data() + 299'998, 6}), 6u);
}

TEST_F(PointFileTest, AFlippedBitIsFoundAndNamedAndCostsItsPieceAlone) {
  const auto committed = Write();
  FlipBit(path_, 250'000 * sizeof(double) + 3, 6);
  const auto file = Open(committed);
  EXPECT_TRUE(file->Copy(0, 200'000, context_).ok());
  for (const absl::Status& status :
       {file->Copy(299'000, 300'000, context_).status(), file->CountEqual(200'001, std::vector<double>(3)).status(),
        file->Checksum(0, 300'000).status()}) {
    EXPECT_EQ(ReasonOf(status), "FILE_DAMAGED");
    EXPECT_THAT(std::string(status.message()), HasSubstr(path_ + ": the bytes from 1600000 to 2400000"));
  }
  FlipBit(path_, 250'000 * sizeof(double) + 3, 6);
  EXPECT_TRUE(file->Copy(299'000, 300'000, context_).ok()) << "mended meanwhile";
  EXPECT_TRUE(failures_.empty()) << "the damage is that of one session";
}

TEST_F(PointFileTest, ThePiecesOfARangeAreFoundAmongMany) {
  std::vector<store::v1::StepRecord::Points> committed;
  const auto file = Open();
  const auto append = [&](uint64_t end) {
    const uint64_t first = file->coordinate_count();
    const std::vector<double> part(all_.begin() + first, all_.begin() + end);
    EXPECT_TRUE(file->Append(part).ok());
    committed.push_back(MakePointsStep(first / 2, part, 2).points());
  };
  for (uint64_t end = 0; end <= 200; end += 10) {
    append(end);  // the first one is empty
    append(end);
  }
  ASSERT_TRUE(file->Synchronize().ok());
  for (uint64_t damaged = 0; damaged < 200; damaged += 10) {
    FlipBit(path_, 8 * damaged + 5, 1);
    for (uint64_t first = 0; first < 200; first += 5) {
      const uint64_t end = std::min<uint64_t>(first + 15, 200);
      const bool has_some = first < damaged + 10 && damaged < end;
      const auto reader = Open(committed);
      EXPECT_EQ(reader->Copy(first, end, context_).ok(), !has_some) << damaged << " " << first;
    }
    FlipBit(path_, 8 * damaged + 5, 1);
  }
  const auto reader = Open(committed);
  EXPECT_TRUE(reader->Copy(0, 200, context_).ok());
  FlipBit(path_, 0, 1);
  EXPECT_TRUE(reader->Copy(0, 200, context_).ok()) << "each piece is checked once";
}

TEST_F(PointFileTest, AFileThatIsMissingOrTooShortIsDamaged) {
  const auto committed = Write();
  std::filesystem::resize_file(path_, 299'999 * sizeof(double));
  for (int i = 0; i < 2; ++i) {
    const auto file = Open(committed);
    EXPECT_EQ(ReasonOf(file->CopyFrom(0, context_).status()), "FILE_DAMAGED");
    const absl::Status appended = file->Append(std::vector<double>{1, 2});
    EXPECT_EQ(ReasonOf(appended), "FILE_DAMAGED");
    EXPECT_THAT(std::string(appended.message()), HasSubstr(path_));
    EXPECT_EQ(file->coordinate_count(), 300'000u);
    std::filesystem::remove(path_);
  }
  EXPECT_FALSE(std::filesystem::exists(path_)) << "no file with a gap was made in its place";
}

int OpenDescriptors() {
  int count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    ++count;
  }
  return count;
}

TEST_F(PointFileTest, HasADescriptorOnlyUntilItIsSynchronised) {
  const int before = OpenDescriptors();
  const auto file = Open();
  ASSERT_TRUE(file->Append(all_).ok());
  EXPECT_EQ(OpenDescriptors(), before + 1);
  ASSERT_TRUE(file->Synchronize().ok());
  ASSERT_TRUE(file->CopyFrom(0, context_).ok());
  EXPECT_EQ(OpenDescriptors(), before);
}

TEST_F(PointFileTest, IsSynchronisedBesideItsWriterAndReaders) {
  const auto file = Open();
  std::atomic<bool> is_over = false;
  std::atomic<int> failed = 0;
  std::thread synchroniser([&] {
    while (!is_over) {
      failed += file->Synchronize().ok() ? 0 : 1;
    }
  });
  for (size_t at = 0; at < 20'000; at += 100) {
    failed += file->Append({all_.data() + at, 100}).ok() ? 0 : 1;
    failed += *file->CountEqual(at / 2, {all_.data() + at / 2, 100}) == 100 ? 0 : 1;
  }
  is_over = true;
  synchroniser.join();
  EXPECT_EQ(failed, 0);
  EXPECT_TRUE(file->Synchronize().ok());
  EXPECT_EQ(*file->CountEqual(0, {all_.data(), 20'000}), 20'000u);
}

TEST_F(PointFileTest, WritesNothingAfterAFailure) {
  const auto file = Open();
  ASSERT_TRUE(file->Append({all_.data(), 2}).ok());
  health_->Fail(absl::UnavailableError("another file")).IgnoreError();
  EXPECT_EQ(ReasonOf(file->Append({all_.data(), 2})), "STORE_FAILED");
  EXPECT_EQ(ReasonOf(file->Synchronize()), "STORE_FAILED");
  EXPECT_EQ(file->coordinate_count(), 2u);
  EXPECT_TRUE(file->CopyFrom(0, context_).ok()) << "reads go on";
}

}  // namespace
}  // namespace wellspace::server
