// Bits of the write-ahead log that flip, and logs that are torn, cut or gone: all acknowledged data are there, or the
// start says that it is not.
#include "server/store/write_ahead_log.h"

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/back_up.h"
#include "server/store/check_data.h"
#include "server/store/durable_log.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr uint64_t kSessions = 12;
constexpr uint64_t kFrameBytes = 24 + 4096;

class WriteAheadLogTest : public ::testing::Test {
 protected:
  // Some sessions, each committed for itself; then all as a process leaves it that is killed.
  void Live(int checkpoint_pages = 1000, uint64_t sessions = kSessions) {
    const TestFolder live;
    auto log = OpenDurableLog({.folder = live.path(), .tables = {.checkpoint_pages = checkpoint_pages}});
    ASSERT_TRUE(log.ok()) << log.status();
    for (uint64_t number = 1; number <= sessions; ++number) {
      ASSERT_TRUE(CommitTo(**log, {.session = SessionName(number), .state = MakeState(number)}).ok());
    }
    text_ = TextOf(*(*log)->records().Load());
    Copy(live.path(), killed_.path());
  }

  static void Copy(const std::string& from, const std::string& to) {
    for (const char* name : {"/sessions.db", "/sessions.db-wal", "/sessions.db-mark"}) {
      std::filesystem::copy_file(from + name, to + name, std::filesystem::copy_options::overwrite_existing);
    }
    std::filesystem::create_directory(to + "/files");
  }

  // A folder as it was left, for one start.
  std::string Again() {
    tried_ = std::make_unique<TestFolder>();
    Copy(killed_.path(), tried_->path());
    return tried_->path();
  }

  // The error of a start on the folder; empty: all acknowledged data are there.
  std::string Start(const std::string& folder) {
    const auto log = OpenDurableLog({.folder = folder});
    if (!log.ok()) {
      EXPECT_EQ(ReasonOf(log.status()), "FILE_DAMAGED");
      return std::string(log.status().message());
    }
    EXPECT_EQ(TextOf(*(*log)->records().Load()), text_) << "taken back without a word";
    return "";
  }

  uint64_t LogBytes() const { return std::filesystem::file_size(killed_.path() + "/sessions.db-wal"); }

  const TestFolder killed_;
  std::string text_;
  std::unique_ptr<TestFolder> tried_;
};

TEST_F(WriteAheadLogTest, AFlippedBitIsRefusedWhereverItIs) {
  Live();
  ASSERT_EQ(Start(Again()), "");
  const uint64_t bytes = LogBytes();
  ASSERT_EQ((bytes - 32) % kFrameBytes, 0u);
  // 60 places all over the log, and each part of the header and of the last frame.
  std::vector<uint64_t> places;
  for (uint64_t i = 0; i < 60; ++i) {
    places.push_back(32 + i * (bytes - 32) / 60 + i * 37 % 97);
  }
  for (uint64_t at = 0; at < 32; at += 4) {
    places.push_back(at);
  }
  for (uint64_t at = 0; at < 32; at += 4) {
    places.push_back(bytes - kFrameBytes + at);
  }
  places.push_back(bytes - 1);
  for (const uint64_t place : places) {
    const std::string folder = Again();
    FlipBit(folder + "/sessions.db-wal", place, static_cast<int>(place % 8));
    const auto checked = CheckData(folder);
    ASSERT_TRUE(checked.ok()) << checked.status();
    EXPECT_THAT(checked->problems, Contains(StartsWith(folder + "/sessions.db-wal: "))) << place;
    EXPECT_EQ(ReasonOf(BackUp(folder, folder + ".copy").status()), "FILE_DAMAGED") << place;
    const std::string said = Start(folder);
    EXPECT_THAT(said, StartsWith(folder + "/sessions.db-wal: ")) << place;
    EXPECT_THAT(said, HasSubstr("restore a back-up"));
    if (place >= 32) {
      EXPECT_THAT(said, HasSubstr(absl::StrCat("frame ", (place - 32) / kFrameBytes + 1, ", at byte "))) << place;
    }
    EXPECT_EQ(std::filesystem::file_size(folder + "/sessions.db-wal"), bytes) << "it is left as it is";
  }
}

// A log that was begun anew some times, as that of each server is that has run for a while.
TEST_F(WriteAheadLogTest, AFlippedBitIsRefusedOrHarmlessInALaterLog) {
  int refused = 0;
  for (const uint64_t sessions : {20, 21, 22, 23, 24, 25}) {
    Live(/*checkpoint_pages=*/7, sessions);
    ASSERT_EQ(Start(Again()), "") << sessions;
    for (uint64_t place = 5; place < LogBytes(); place += 2063) {
      const std::string folder = Again();
      FlipBit(folder + "/sessions.db-wal", place, static_cast<int>(place % 8));
      refused += Start(folder).empty() ? 0 : 1;
    }
  }
  EXPECT_GT(refused, 50);
}

// As a release has left it that wrote no mark: the frames themselves show the damage.
TEST_F(WriteAheadLogTest, WithoutAMarkFramesBehindABadOneShowThatItIsNoTornTail) {
  Live();
  std::filesystem::remove(killed_.path() + "/sessions.db-mark");
  WriteFile(killed_.path() + "/sessions.db-mark", "");
  for (uint64_t frame = 0; frame + 6 < (LogBytes() - 32) / kFrameBytes; frame += 3) {
    for (const uint64_t byte : {1, 6, 9, 17, 500, 4000}) {
      const std::string folder = Again();
      std::filesystem::remove(folder + "/sessions.db-mark");
      FlipBit(folder + "/sessions.db-wal", 32 + frame * kFrameBytes + byte, 2);
      EXPECT_THAT(Start(folder), HasSubstr(absl::StrCat("frame ", frame + 1, ", at byte "))) << byte;
    }
  }
  const std::string folder = Again();
  std::filesystem::remove(folder + "/sessions.db-mark");
  FlipBit(folder + "/sessions.db-wal", 17, 2);
  EXPECT_THAT(Start(folder), HasSubstr("its first 32 bytes"));
}

TEST_F(WriteAheadLogTest, ALogThatIsCutOrGoneIsMissed) {
  Live();
  for (const uint64_t bytes : {LogBytes() - 1, LogBytes() / 2, uint64_t{40}, uint64_t{31}, uint64_t{0}}) {
    const std::string folder = Again();
    std::filesystem::resize_file(folder + "/sessions.db-wal", bytes);
    EXPECT_THAT(Start(folder), HasSubstr("were acknowledged")) << bytes;
  }
  const std::string folder = Again();
  std::filesystem::remove(folder + "/sessions.db-wal");
  EXPECT_THAT(Start(folder), HasSubstr("the file is missing, and "));
  EXPECT_TRUE(std::filesystem::remove(folder + "/sessions.db-mark"));
  const auto log = OpenDurableLog({.folder = folder});
  EXPECT_TRUE(log.ok()) << "as the message has advised: " << log.status();
}

// A write that was under way when the power went is no damage, whatever is there of it.
TEST_F(WriteAheadLogTest, WhatWasNotAcknowledgedMayBeTorn) {
  Live();
  const std::string folder = killed_.path();
  const std::string path = folder + "/sessions.db-wal";
  const std::string mark = BytesOfFile(folder + "/sessions.db-mark");
  const std::string before = text_;
  {
    const TestFolder longer;
    Copy(folder, longer.path());
    // The same log with one transaction more, of several frames; the mark does not need it yet.
    const auto tables = *SqliteDatabase::Open(longer.path() + "/sessions.db", SQLITE_OPEN_READWRITE, nullptr);
    ASSERT_TRUE(tables
                    ->Execute("PRAGMA wal_autocheckpoint=0; BEGIN; CREATE TABLE x(b); "
                              "INSERT INTO x VALUES(randomblob(30000)); COMMIT")
                    .ok());
    WriteFile(path, BytesOfFile(longer.path() + "/sessions.db-wal"));
  }
  ASSERT_EQ(BytesOfFile(folder + "/sessions.db-mark"), mark);
  const uint64_t frames = (LogBytes() - 32) / kFrameBytes;
  uint64_t torn = 0;
  for (uint64_t frame = frames - 1; frame > frames - 7; --frame, ++torn) {
    const std::string again = Again();
    FlipBit(again + "/sessions.db-wal", 32 + frame * kFrameBytes + 100, 1);
    EXPECT_EQ(Start(again), "") << frame;
  }
  EXPECT_EQ(torn, 6u);
}

// A mark that cannot be read needs nothing; it is made again.
TEST_F(WriteAheadLogTest, AMarkThatIsDamagedIsMadeAgain) {
  Live();
  for (uint64_t byte = 0; byte < LogMark::kBytes; ++byte) {
    const std::string folder = Again();
    FlipBit(folder + "/sessions.db-mark", byte, static_cast<int>(byte % 8));
    EXPECT_EQ(*LogMark::Read(PosixFileSystem(), folder + "/sessions.db"), std::nullopt) << byte;
    EXPECT_EQ(Start(folder), "") << byte;
    EXPECT_TRUE((*LogMark::Read(PosixFileSystem(), folder + "/sessions.db"))->is_in_database) << byte;
  }
}

TEST_F(WriteAheadLogTest, AServerThatHasEndedNeedsNone) {
  const TestFolder folder;
  {
    const auto log = *OpenDurableLog({.folder = folder.path()});
    ASSERT_TRUE(CommitTo(*log, {.session = SessionName(1), .state = MakeState(1)}).ok());
    const auto mark = *LogMark::Read(PosixFileSystem(), folder.path() + "/sessions.db");
    EXPECT_GT(mark->frames, 0u);
    EXPECT_FALSE(mark->is_in_database);
  }
  EXPECT_FALSE(std::filesystem::exists(folder.path() + "/sessions.db-wal"));
  EXPECT_TRUE((*LogMark::Read(PosixFileSystem(), folder.path() + "/sessions.db"))->is_in_database);
}

}  // namespace
}  // namespace wellspace::server
