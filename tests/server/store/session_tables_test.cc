// Rows of sessions are kept, read, copied and checked; flipped bits are found.
#include "server/store/session_tables.h"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class SessionTablesTest : public ::testing::Test {
 protected:
  std::unique_ptr<SessionTables> Open() {
    auto tables = SessionTables::Open(path_, {});
    EXPECT_TRUE(tables.ok()) << tables.status();
    if (!tables.ok()) {
      return nullptr;
    }
    epoch_ = (*tables)->NextEpoch().value();
    EXPECT_TRUE((*tables)->TakeAll(epoch_).ok());
    return *std::move(tables);
  }

  // As the owner that has opened them last; sessions that are not there yet are created.
  absl::Status Apply(SessionTables& tables, const std::vector<SessionChange>& changes,
                     const std::vector<AnswerKey>& forgotten = {}) const {
    std::vector<SessionChange> owned = changes;
    std::vector<const SessionChange*> pointers;
    for (SessionChange& change : owned) {
      change.epoch = epoch_;
      change.is_creation = change.state.has_value() && !tables.ReadState(change.session)->has_value();
      pointers.push_back(&change);
    }
    return tables.Apply(pointers, forgotten, Survives::kPowerLoss);
  }

  // A statement for the file, from outside.
  void Execute(const std::string& statement) {
    const auto database = SqliteDatabase::Open(path_, SQLITE_OPEN_READWRITE, nullptr);
    ASSERT_TRUE(database.ok());
    const absl::Status status = (*database)->Execute(statement);
    ASSERT_TRUE(status.ok()) << status;
  }

  const TestFolder folder_;
  const std::string path_ = folder_.path() + "/sessions.db";
  uint64_t epoch_ = 0;
};

store::v1::OperationRecord MakeOperation(uint64_t number, uint32_t attempts = 1) {
  store::v1::OperationRecord operation;
  operation.set_number(number);
  operation.set_attempts(attempts);
  return operation;
}

SessionChange MakeCreation(uint64_t number) {
  return {.session = SessionName(number),
          .state = MakeState(number),
          .steps = {MakePointsStep(0, {1, 2, 3}, 3)},
          .operations = {MakeOperation(1), MakeOperation(2)},
          .answer = MakeAnswer("tenant", absl::StrCat("create ", number), "created")};
}

TEST_F(SessionTablesTest, KeepWhatWasApplied) {
  std::string before;
  {
    const auto tables = Open();
    ASSERT_TRUE(Apply(*tables, {MakeCreation(2), MakeCreation(1)}).ok());
    SessionChange change{.session = SessionName(1), .state = MakeState(1, 7)};
    change.steps = {MakePointsStep(1, {4, 5, 6}, 3)};
    change.operations = {MakeOperation(2, 9), MakeOperation(3)};
    change.dropped_operations = {1, 77};
    ASSERT_TRUE(Apply(*tables, {change}).ok());
    const auto stored = tables->Load();
    ASSERT_TRUE(stored.ok()) << stored.status();
    ASSERT_EQ(stored->sessions.size(), 2u);
    EXPECT_EQ(stored->sessions[0].state.name(), SessionName(1)) << "in the order of their creation";
    EXPECT_EQ(stored->sessions[0].state.revision(), 7u);
    EXPECT_EQ(stored->sessions[0].steps.size(), 2u);
    EXPECT_EQ(stored->sessions[0].operations.size(), 2u);
    EXPECT_EQ(stored->sessions[0].operations[0].attempts(), 9u);
    EXPECT_EQ(stored->sessions[1].operations.size(), 2u);
    EXPECT_EQ(stored->answers.size(), 2u);
    before = TextOf(*stored);
  }
  const auto again = Open();
  EXPECT_EQ(TextOf(*again->Load()), before);
  EXPECT_THAT(*again->CheckFile(), IsEmpty());
  EXPECT_EQ((*again->ReadState(SessionName(1)))->revision(), 7u);
  EXPECT_FALSE(again->ReadState(SessionName(3))->has_value());
  EXPECT_EQ(again->ReadStates()->size(), 2u);
}

TEST_F(SessionTablesTest, ADeletionTakesAllButTheAnswer) {
  const auto tables = Open();
  ASSERT_TRUE(Apply(*tables, {MakeCreation(1), MakeCreation(2)}).ok());
  const SessionChange deletion{
      .session = SessionName(1), .answer = MakeAnswer("tenant", "delete", "deleted"), .is_deletion = true};
  ASSERT_TRUE(Apply(*tables, {deletion}).ok());
  EXPECT_TRUE(IsAnsweredBefore(Apply(*tables, {deletion})));
  EXPECT_TRUE(Apply(*tables, {{.session = SessionName(1), .is_deletion = true}}).ok()) << "there is nothing to delete";
  const auto stored = tables->Load();
  ASSERT_TRUE(stored.ok()) << stored.status();
  ASSERT_EQ(stored->sessions.size(), 1u);
  EXPECT_EQ(stored->sessions[0].state.name(), SessionName(2));
  EXPECT_EQ(stored->answers.size(), 3u);
  EXPECT_THAT(*tables->CheckFile(), IsEmpty());
}

TEST_F(SessionTablesTest, ForgetAnswers) {
  const auto tables = Open();
  ASSERT_TRUE(Apply(*tables, {MakeCreation(1), MakeCreation(2)}).ok());
  ASSERT_TRUE(Apply(*tables, {{.session = "", .answer = MakeAnswer("tenant", "create 1", "anew")}},
                    {{"tenant", "create 1"}, {"tenant", "create 2"}, {"other", "create 1"}})
                  .ok());
  const auto stored = tables->Load();
  ASSERT_EQ(stored->answers.size(), 1u);
  EXPECT_EQ(stored->answers[0].response(), "anew") << "answers are dropped before new ones come";
}

TEST_F(SessionTablesTest, FeaturesAreReadApart) {
  const auto tables = Open();
  SessionChange change = MakeCreation(1);
  for (uint32_t i = 0; i < 3; ++i) {
    store::v1::StepRecord step;
    step.mutable_features()->mutable_segments()->add_ends(i);
    change.steps.push_back(step);
    change.steps.push_back(MakePointsStep(1 + i, {1, 2, 3}, 3));
  }
  ASSERT_TRUE(Apply(*tables, {change, MakeCreation(2)}).ok());
  const auto features = tables->ReadFeatures(SessionName(1));
  ASSERT_TRUE(features.ok()) << features.status();
  ASSERT_EQ(features->size(), 3u);
  EXPECT_EQ(features->at(2).segments().ends(0), 2u);
  EXPECT_TRUE(tables->ReadFeatures(SessionName(2))->empty());
  EXPECT_TRUE(tables->ReadFeatures(SessionName(3))->empty());
  EXPECT_EQ(tables->Load()->sessions[0].steps.size(), 4u) << "those of points alone";
}

TEST_F(SessionTablesTest, SizesAreReadSetBySet) {
  const auto tables = Open();
  const auto make = [](uint64_t number, const std::vector<double>& sizes) {
    StoredSizes set{.number = number, .parts = {}};
    for (const double size : sizes) {
      set.parts.emplace_back().mutable_samples()->add_sizes(size);
    }
    return set;
  };
  SessionChange change = MakeCreation(1);
  change.sizes = make(7, {1, 2, 3});
  ASSERT_TRUE(Apply(*tables, {change, MakeCreation(2)}).ok());
  ASSERT_TRUE(Apply(*tables, {{.session = SessionName(1), .sizes = make(11, {4})}}).ok());
  auto sets = tables->ReadSizes(SessionName(1));
  ASSERT_TRUE(sets.ok()) << sets.status();
  ASSERT_EQ(sets->size(), 2u);
  EXPECT_EQ(sets->at(0).number, 7u);
  ASSERT_EQ(sets->at(0).parts.size(), 3u);
  EXPECT_EQ(sets->at(0).parts[2].samples().sizes(0), 3);
  EXPECT_EQ(sets->at(1).number, 11u);
  EXPECT_TRUE(tables->ReadSizes(SessionName(2))->empty());
  EXPECT_TRUE(tables->ReadSizes(SessionName(3))->empty());
  ASSERT_TRUE(Apply(*tables, {{.session = SessionName(1), .dropped_sizes = {7}}}).ok());
  sets = tables->ReadSizes(SessionName(1));
  ASSERT_EQ(sets->size(), 1u);
  EXPECT_EQ(sets->at(0).number, 11u);
  ASSERT_TRUE(Apply(*tables, {{.session = SessionName(1), .is_deletion = true}}).ok());
  ASSERT_TRUE(Apply(*tables, {MakeCreation(1)}, {{"tenant", "create 1"}}).ok());
  EXPECT_TRUE(tables->ReadSizes(SessionName(1))->empty()) << "they go with their session";
}

// All of a batch, or nothing.
TEST_F(SessionTablesTest, ABatchWithAFaultChangesNothing) {
  const auto tables = Open();
  ASSERT_TRUE(Apply(*tables, {MakeCreation(1)}).ok());
  const std::string before = TextOf(*tables->Load());
  const SessionChange fault{.session = SessionName(3), .operations = {MakeOperation(1)}};
  const absl::Status status = Apply(*tables, {MakeCreation(2), fault}, {{"tenant", "create 1"}});
  EXPECT_TRUE(IsOwnedElsewhere(status)) << "without an owner, as it is";
  EXPECT_THAT(std::string(status.message()), HasSubstr(SessionName(3)));
  EXPECT_EQ(TextOf(*tables->Load()), before);
  EXPECT_TRUE(Apply(*tables, {MakeCreation(2)}).ok());
}

TEST_F(SessionTablesTest, TheWriteAheadLogStaysSmall) {
  const auto tables = Open();
  SessionChange change = MakeCreation(1);
  change.answer->set_response(std::string(200'000, 'x'));
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(Apply(*tables, {change}, {{"tenant", "create 1"}}).ok());
    ASSERT_TRUE(tables->Checkpoint().ok());
    change.steps.clear();
  }
  EXPECT_LT(std::filesystem::file_size(path_ + "-wal"), 6u << 20) << "40 MB have been written";
}

TEST_F(SessionTablesTest, AFileOfANewerProgramIsRefused) {
  Open();
  Execute("PRAGMA user_version=4711");
  const absl::Status status = SessionTables::Open(path_, {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()),
              HasSubstr(absl::StrCat("version 4711, and this program knows versions up to ", SessionTables::kSchema)));
}

TEST_F(SessionTablesTest, AFileOfAnotherProgramIsRefused) {
  {
    const auto database = SqliteDatabase::Open(path_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
    ASSERT_TRUE((*database)->Execute("CREATE TABLE recipes(name)").ok());
  }
  EXPECT_EQ(SessionTables::Open(path_, {}).status().code(), absl::StatusCode::kFailedPrecondition);
  WriteFile(path_, std::string(10'000, 'x'));
  const absl::Status status = SessionTables::Open(path_, {}).status();
  EXPECT_EQ(ReasonOf(status), "FILE_DAMAGED");
  EXPECT_THAT(std::string(status.message()), HasSubstr(path_));
}

// Errors give advice, and not SQLite's words alone.
TEST_F(SessionTablesTest, ADatabaseThatCannotBeUsedIsToldInOurWords) {
  const std::string missing(SessionTables::Open(path_, {.is_read_only = true}).status().message());
  EXPECT_EQ(missing, path_ + ": the database is missing (SQLite 14: No such file or directory)");
  WriteFile(path_, "");
  const absl::Status empty = SessionTables::Open(path_, {.is_read_only = true}).status();
  EXPECT_EQ(ReasonOf(empty), "FILE_DAMAGED");
  EXPECT_EQ(empty.message(), path_ + ": the database is empty");
  ASSERT_TRUE(Apply(*Open(), {MakeCreation(1)}).ok());
  {
    const auto reader = *SqliteDatabase::Open(path_, SQLITE_OPEN_READONLY, nullptr);
    const std::string said(reader->Execute("DELETE FROM sessions").message());
    EXPECT_EQ(said, path_ +
                        ": the database cannot be written to; the user that the server runs as needs permission to "
                        "write it, and its folder (SQLite 8)");
  }
  const auto other = *SqliteDatabase::Open(path_, SQLITE_OPEN_READWRITE, nullptr);
  const auto held = *SqliteDatabase::Open(path_, SQLITE_OPEN_READWRITE, nullptr);
  ASSERT_TRUE(held->Execute("BEGIN IMMEDIATE").ok());
  EXPECT_EQ(other->Execute("BEGIN IMMEDIATE").message(),
            path_ + ": another program has the database locked (SQLite 5)");
  std::filesystem::create_directory(path_ + ".folder");
  const absl::Status folder = SqliteDatabase::Open(path_ + ".folder", SQLITE_OPEN_READWRITE, nullptr).status();
  EXPECT_THAT(std::string(folder.message()), HasSubstr("cannot be opened; the user that the server runs as"));
}

TEST_F(SessionTablesTest, ReadOnlyChangesNothing) {
  EXPECT_FALSE(SessionTables::Open(path_, {.is_read_only = true}).ok()) << "there is nothing";
  ASSERT_TRUE(Apply(*Open(), {MakeCreation(1)}).ok());
  const auto tables = SessionTables::Open(path_, {.is_read_only = true});
  ASSERT_TRUE(tables.ok()) << tables.status();
  EXPECT_EQ((*tables)->Load()->sessions.size(), 1u);
  EXPECT_FALSE(Apply(**tables, {MakeCreation(2)}).ok());
}

// A record is read as it was written, or as an error: whatever byte of the file is another. What no record is in (room
// that is left, texts of the schema) may be another, too.
TEST_F(SessionTablesTest, AFlippedBitIsFoundWhereverItChangesARecord) {
  {
    const auto tables = Open();
    SessionChange creation = MakeCreation(1);
    store::v1::StepRecord features;
    features.mutable_features()->mutable_segments()->add_ends(3);
    creation.steps.push_back(features);
    creation.sizes = StoredSizes{.number = 5, .parts = {}};
    creation.sizes->parts.emplace_back().mutable_samples()->add_sizes(0.5);
    ASSERT_TRUE(Apply(*tables, {creation, MakeCreation(2)}).ok());
  }
  const std::string before = TextOf(*Open()->Load());
  const std::string features = Open()->ReadFeatures(SessionName(1))->at(0).ShortDebugString();
  const uint64_t size = std::filesystem::file_size(path_);
  int found = 0;
  for (uint64_t byte = 0; byte < size; byte += 7) {
    FlipBit(path_, byte, static_cast<int>(byte % 8));
    const auto tables = SessionTables::Open(path_, {.is_read_only = true});
    const auto stored = tables.ok() ? (*tables)->Load() : tables.status();
    if (stored.ok()) {
      EXPECT_EQ(TextOf(*stored), before) << byte;
      if (const auto read = (*tables)->ReadFeatures(SessionName(1)); read.ok()) {
        ASSERT_EQ(read->size(), 1u) << byte;
        EXPECT_EQ(read->at(0).ShortDebugString(), features) << byte;
      }
      if (const auto read = (*tables)->ReadSizes(SessionName(1)); read.ok()) {
        ASSERT_EQ(read->size(), 1u) << byte;
        EXPECT_EQ(read->at(0).number, 5u) << byte;
        EXPECT_EQ(read->at(0).parts.at(0).samples().sizes(0), 0.5) << byte;
      }
    }
    found += stored.ok() ? 0 : 1;
    FlipBit(path_, byte, static_cast<int>(byte % 8));
  }
  EXPECT_GT(found, 100);
}

TEST_F(SessionTablesTest, ADamagedRecordIsNamed) {
  ASSERT_TRUE(Apply(*Open(), {MakeCreation(1), MakeCreation(2)}).ok());
  Execute(
      "UPDATE steps SET record = x'00' WHERE session = 1; UPDATE operations SET number = 9 WHERE number = 2;"
      "UPDATE answers SET request_id = 'x' WHERE request_id = 'create 2'; UPDATE sessions SET crc32c = 1 WHERE id = 2");
  const auto tables = Open();
  const auto stored = tables->Load();
  EXPECT_EQ(ReasonOf(stored.status()), "FILE_DAMAGED");
  EXPECT_THAT(std::string(stored.status().message()),
              HasSubstr("sessions.db: the record of session 'sessions/00000002'"));
  std::vector<std::string> problems;
  EXPECT_EQ(tables->Load(&problems)->sessions.size(), 1u);
  const std::string path = path_ + ": ";
  EXPECT_THAT(problems, ElementsAre(path + "the record of session 'sessions/00000002' is damaged",
                                    path + "step 0 of session 'sessions/00000001' is damaged",
                                    path + "step 0 is of session 2, which is not there",
                                    path + "operation 9 of session 'sessions/00000001' is damaged",
                                    path + "operation 1 is of session 2, which is not there",
                                    path + "operation 9 is of session 2, which is not there",
                                    path + "the answer to request 'x' is damaged"));
  EXPECT_EQ(ReasonOf(tables->ReadState(SessionName(2)).status()), "FILE_DAMAGED");
}

TEST_F(SessionTablesTest, BackUpCopiesAll) {
  const auto tables = Open();
  ASSERT_TRUE(Apply(*tables, {MakeCreation(1), MakeCreation(2)}).ok());
  const std::string copy = folder_.path() + "/copy.db";
  ASSERT_TRUE(tables->BackUp(copy, {}).ok());
  ASSERT_TRUE(Apply(*tables, {MakeCreation(3)}).ok());
  const auto copied = SessionTables::Open(copy, {});
  ASSERT_TRUE(copied.ok()) << copied.status();
  EXPECT_EQ((*copied)->Load()->sessions.size(), 2u);
}

}  // namespace
}  // namespace wellspace::server
