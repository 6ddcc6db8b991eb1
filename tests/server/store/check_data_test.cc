// What check-data counts, and the damage that it names.
#include "server/store/check_data.h"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/durable_log.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class CheckDataTest : public ::testing::Test {
 protected:
  CheckDataTest() {
    log_ = *OpenDurableLog({.folder = folder_.path()});
    for (uint64_t number = 1; number <= 3; ++number) {
      AddSession(*log_, number);
    }
  }

  // Two pieces of points, a domain, an operation, a mesh and an answer.
  static void AddSession(SessionLog& log, uint64_t number) {
    const std::vector<double> points = {1, 2, 3, 4, 5, static_cast<double>(number)};
    SessionChange change{.session = SessionName(number), .state = MakeState(number, 1)};
    ASSERT_TRUE(CommitTo(log, change).ok());
    const auto store = log.files().OpenPoints({.session = change.session, .dimension = 3});
    ASSERT_TRUE(store->Append(points).ok());
    ASSERT_TRUE(store->Append(points).ok());
    ASSERT_TRUE(store->Synchronize().ok());
    change.steps = {MakePointsStep(0, points, 3), MakePointsStep(2, points, 3)};
    store::v1::StepRecord features;
    features.mutable_features()->mutable_segments()->mutable_ends()->Add(0);
    features.mutable_features()->mutable_segments()->mutable_ends()->Add(1);
    features.mutable_features()->mutable_faces()->add_seeds();
    change.steps.push_back(features);
    change.sizes = StoredSizes{.number = 2, .parts = {}};
    change.sizes->parts.emplace_back().mutable_samples()->add_sizes(0.5);
    change.operations.emplace_back().set_number(1);
    change.answer = MakeAnswer("tenant", change.session, "done");
    const auto mesh =
        log.files().KeepMesh(change.session, 2, /*epoch=*/0, MakeMesh({.vertices = 30}), core::RunContext());
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    change.state->set_points(4);
    change.state->set_segments(1);
    change.state->set_seeds(1);
    change.state->set_sizes(2);
    change.state->set_size_count(1);
    *change.state->mutable_mesh() = (*mesh)->record();
    ASSERT_TRUE(CommitTo(log, change).ok());
  }

  // Session 2 as it is after `change`.
  void Commit(const std::function<void(store::v1::SessionRecord& state)>& change) {
    store::v1::SessionRecord state = log_->records().Load()->sessions.at(1).state;
    change(state);
    ASSERT_TRUE(CommitTo(*log_, {.session = SessionName(2), .state = state}).ok());
  }

  std::vector<std::string> Problems() {
    const auto report = CheckData(folder_.path());
    EXPECT_TRUE(report.ok()) << report.status();
    return report.ok() ? report->problems : std::vector<std::string>();
  }

  const TestFolder folder_;
  const std::string files_ = folder_.path() + "/files/";
  std::unique_ptr<SessionLog> log_;
};

TEST_F(CheckDataTest, CountsWhatIsThere) {
  for (const bool is_served : {true, false}) {
    const auto report = CheckData(folder_.path());
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_THAT(report->problems, IsEmpty()) << is_served;
    EXPECT_TRUE(report->is_whole());
    EXPECT_THAT(report->unknown, IsEmpty());
    EXPECT_EQ(report->sessions, 3u);
    EXPECT_EQ(report->steps, 6u);
    EXPECT_EQ(report->operations, 3u);
    EXPECT_EQ(report->answers, 3u);
    EXPECT_EQ(report->points, 12u);
    EXPECT_EQ(report->meshes, 3u);
    EXPECT_EQ(report->file_bytes, 12 * 24 + 3 * std::filesystem::file_size(files_ + "00000001.mesh-2"));
    log_.reset();
  }
}

TEST_F(CheckDataTest, NamesDamagedAndMissingFilesAndThoseThatItDoesNotKnow) {
  FlipBit(files_ + "00000001.points", 50, 1);
  FlipBit(files_ + "00000002.mesh-2", 77, 1);
  std::filesystem::remove(files_ + "00000003.mesh-2");
  WriteFile(files_ + "notes.txt", "");
  const auto report = CheckData(folder_.path());
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_FALSE(report->is_whole());
  EXPECT_THAT(report->problems, ElementsAre(HasSubstr("00000001.points: the bytes from 48 to 96"),
                                            HasSubstr("00000002.mesh-2: chunk 0 of array 3"),
                                            HasSubstr("00000003.mesh-2: cannot be opened")));
  EXPECT_THAT(report->unknown, ElementsAre(files_ + "notes.txt"));
}

TEST_F(CheckDataTest, NamesRecordsThatDoNotFitTogether) {
  const std::string session = folder_.path() + "/sessions.db: session 'sessions/00000002': ";
  Commit([](store::v1::SessionRecord& state) { state.set_points(5); });
  EXPECT_THAT(Problems(), ElementsAre(session + "there are 5 points, and 4 in its steps"));
  Commit([](store::v1::SessionRecord& state) {
    state.set_points(4);
    state.set_seeds(2);
  });
  EXPECT_THAT(Problems(),
              ElementsAre(session + "there are 1 segments, 0 triangles and 2 seeds, and 1, 0 and 1 in its steps"));
  Commit([](store::v1::SessionRecord& state) {
    state.set_seeds(1);
    state.set_next_operation(1);
  });
  EXPECT_THAT(Problems(), ElementsAre(session + "operation 1 is there before its time; the next one is 1"));
  Commit([](store::v1::SessionRecord& state) {
    state.set_next_operation(2);
    state.set_size_count(3);
  });
  EXPECT_THAT(Problems(), ElementsAre(session + "there are 3 sizes in set 2, and 1 in its records"));
  Commit([](store::v1::SessionRecord& state) {
    state.set_size_count(1);
    state.mutable_mesh()->set_vertices(31);
  });
  EXPECT_THAT(Problems(), ElementsAre(HasSubstr("00000002.mesh-2: the directory is of another mesh")));
}

TEST_F(CheckDataTest, NamesDamageOfTheDatabase) {
  log_.reset();
  const std::string path = folder_.path() + "/sessions.db";
  FlipBit(path, BytesOfFile(path).find("tenant 1"), 1);  // within a record
  const auto report = CheckData(folder_.path());
  if (report.ok()) {
    EXPECT_THAT(report->problems, Contains(HasSubstr("sessions.db: ")));
  } else {
    EXPECT_EQ(ReasonOf(report.status()), "FILE_DAMAGED");
  }
}

TEST_F(CheckDataTest, WhatIsNoFolderIsAnError) {
  const absl::Status status = CheckData(folder_.path() + "/none").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("/none: cannot be listed"));
}

// As a process leaves it that was killed: much is in the write-ahead log alone.
TEST_F(CheckDataTest, ReadsAWriteAheadLogThatWasLeft) {
  const TestFolder copy;
  std::filesystem::copy(folder_.path(), copy.path(), std::filesystem::copy_options::recursive);
  std::filesystem::remove(copy.path() + "/sessions.db-shm");
  ASSERT_GT(std::filesystem::file_size(copy.path() + "/sessions.db-wal"), 0u);
  const auto report = CheckData(copy.path());
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_THAT(report->problems, IsEmpty());
  EXPECT_EQ(report->sessions, 3u);
}

}  // namespace
}  // namespace wellspace::server
