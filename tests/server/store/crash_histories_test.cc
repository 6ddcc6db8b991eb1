// Random lives of a log on a disk that loses power: acknowledged changes are there afterwards, and each other change is
// there wholly or not at all.
#include <algorithm>
#include <array>
#include <chrono>
#include <iostream>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/back_up.h"
#include "server/store/check_data.h"
#include "server/store/data_folder.h"
#include "tests/server/store/simulated_disk.h"
#include "tests/server/store/store_life.h"
#include "tests/support/amount.h"
#include "tests/support/clouds.h"

namespace wellspace::server {
namespace {

using Loss = SimulatedDisk::Loss;
constexpr std::array kLosses = {Loss::kProcess, Loss::kAll, Loss::kSome, Loss::kSome};

struct Bugs {
  StoreLife::Bugs of_life{};
  std::vector<std::string> unsynchronised{};  // ends of paths
};

// One life with some crashes. Returns the fault after one of them; empty: all is well.
std::string RunHistory(SimulatedDisk& disk, uint64_t seed, const Bugs& bugs = {}) {
  test::SplitMix64 random(seed);
  disk.Clear();
  for (const std::string& end : bugs.unsynchronised) {
    disk.OmitSynchronize(end);
  }
  StoreLife life(disk, bugs.of_life);
  const uint64_t crashes = 1 + random.Below(3);
  for (uint64_t crash = 0; crash < crashes; ++crash) {
    disk.DieAt(disk.operations() + random.Below(crash == 0 ? 400 : 250));
    absl::Status status = life.log() == nullptr ? life.Open() : absl::OkStatus();
    for (int step = 0; step < 40 && status.ok() && !disk.is_dead(); ++step) {
      status = life.DoAnything(random);
      if (!status.ok() && !disk.is_dead()) {
        return absl::StrCat("a step fails: ", status.ToString());
      }
    }
    const std::string problem = life.Restart(kLosses[random.Below(kLosses.size())], random);
    if (!problem.empty()) {
      return absl::StrCat("after crash ", crash, ", at ", disk.failed_operation(), ": ", problem);
    }
  }
  return life.CheckWhole();
}

// Of so many histories, how many go wrong.
int CountProblems(uint64_t first_seed, int histories, const Bugs& bugs, std::string& first_problem) {
  SimulatedDisk disk;
  int count = 0;
  for (int i = 0; i < histories; ++i) {
    const std::string problem = RunHistory(disk, first_seed + i, bugs);
    if (!problem.empty() && count++ == 0) {
      first_problem = absl::StrCat("seed ", first_seed + i, ": ", problem);
    }
  }
  return count;
}

TEST(CrashHistories, NothingAcknowledgedIsLost) {
  const int histories = test::Amount("WELLSPACE_HISTORIES", 1000);
  const uint64_t seed = test::Seed(20261128);
  std::cout << histories << " histories from WELLSPACE_SEED=" << seed << " on\n";
  std::string problem;
  EXPECT_EQ(CountProblems(seed, histories, {}, problem), 0) << problem;
}

// Every operation of one life, whatever else is drawn.
TEST(CrashHistories, EveryOperationMayBeTheLast) {
  const std::vector<std::pair<StoreLife::Action, uint64_t>> script = {
      {StoreLife::Action::kCreate, 0},      {StoreLife::Action::kUpload, 0}, {StoreLife::Action::kStart, 0},
      {StoreLife::Action::kSucceed, 0},     {StoreLife::Action::kCreate, 1}, {StoreLife::Action::kUpload, 0},
      {StoreLife::Action::kAddFeatures, 1}, {StoreLife::Action::kTouch, 0},  {StoreLife::Action::kSucceed, 0},
      {StoreLife::Action::kUpdate, 1},      {StoreLife::Action::kForget, 0}, {StoreLife::Action::kSucceed, 1},
      {StoreLife::Action::kFail, 1},        {StoreLife::Action::kDelete, 0}, {StoreLife::Action::kSweep, 0},
      {StoreLife::Action::kUpload, 1},
  };
  SimulatedDisk disk;
  uint64_t operation = 0;
  for (bool has_died = true; has_died; ++operation) {
    for (const Loss loss : {Loss::kProcess, Loss::kAll, Loss::kSome}) {
      for (uint64_t seed = 0; seed < (loss == Loss::kSome ? 4u : 1u); ++seed) {
        disk.Clear();
        disk.DieAt(operation);
        StoreLife life(disk);
        absl::Status status = life.Open();
        for (size_t step = 0; step < script.size() && status.ok(); ++step) {
          status = life.Do(script[step].first, script[step].second);
        }
        has_died = disk.is_dead();
        const std::string at = has_died ? disk.failed_operation() : "the end";
        test::SplitMix64 random(seed * 1000 + operation);
        ASSERT_EQ(life.Restart(loss, random), "") << "operation " << operation << ", " << at << ", seed " << seed;
      }
    }
  }
  EXPECT_GT(operation, 150u);
}

// Backs a life up and loses power then. Returns the fault of the copy; empty: it is whole, and has all.
std::string LosePowerAfterBackUp(const std::string& unsynchronised, uint64_t seed) {
  SimulatedDisk disk;
  {
    StoreLife life(disk);
    absl::Status status = life.Open();
    for (const StoreLife::Action action : {StoreLife::Action::kCreate, StoreLife::Action::kUpload,
                                           StoreLife::Action::kUpload, StoreLife::Action::kSucceed}) {
      for (uint64_t number = 0; number < 3 && status.ok(); ++number) {
        status = life.Do(action, number);
      }
    }
    if (!status.ok()) {
      return status.ToString();
    }
  }
  if (!unsynchronised.empty()) {
    disk.OmitSynchronize(unsynchronised);
  }
  const CheckDataOptions options{.files = &disk.files(), .tables = {.vfs = disk.vfs(), .is_exclusive = true}};
  const auto backed_up = BackUp(StoreLife::kFolder, "/copy", options);
  if (!backed_up.ok()) {
    return absl::StrCat("the back-up fails: ", backed_up.status().ToString());
  }
  disk.Restart(seed % 2 == 0 ? Loss::kAll : Loss::kSome, seed);
  const auto report = CheckData("/copy", options);
  if (!report.ok() || !report->is_whole()) {
    return absl::StrCat("check-data: ", report.status().ToString(), report.ok() ? report->problems[0] : "");
  }
  const bool has_all = report->sessions == 3 && report->points > 0 && report->points == backed_up->points &&
                       report->meshes > 0 && report->meshes == backed_up->meshes;
  return has_all ? "" : "some are missing";
}

TEST(BackUp, OutlivesALossOfPower) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    EXPECT_EQ(LosePowerAfterBackUp("", seed), "") << seed;
  }
  for (const char* end : {"/copy", "/copy/files", "/copy/sessions.db", ".points", "/"}) {
    bool is_found = false;
    for (uint64_t seed = 0; seed < 20; ++seed) {
      is_found |= !LosePowerAfterBackUp(end, seed).empty();
    }
    EXPECT_TRUE(is_found) << "without the synchronisation of " << end;
  }
}

// Has a file that no session names set aside, and loses power then. Whether it is still there, in either place.
bool IsKeptOverALossOfPower(bool synchronises, uint64_t seed) {
  const DataPaths paths{StoreLife::kFolder};
  const std::string name = "abcdef.mesh-3";
  SimulatedDisk disk;
  {
    StoreLife life(disk);
    EXPECT_TRUE(life.Open().ok());
    const auto file = disk.files().Open(paths.files() + "/" + name, FileSystem::Mode::kCreateOrWrite);
    EXPECT_TRUE((*file)->Synchronize().ok() && disk.files().SynchronizeFolder(paths.files()).ok());
    if (!synchronises) {
      disk.OmitSynchronize(paths.root);
    }
    const auto garbage = life.log()->RemoveGarbage();
    EXPECT_TRUE(garbage.ok() && garbage->set_aside.size() == 1);
  }
  disk.Restart(seed % 2 == 0 ? Loss::kAll : Loss::kSome, seed);
  const std::vector<std::string> lost = disk.List(paths.lost());
  return disk.Has(paths.files() + "/" + name) ||
         std::ranges::any_of(lost, [&](const std::string& kept) { return kept.starts_with(name); });
}

TEST(LostFiles, OutliveALossOfPower) {
  bool is_found = false;
  for (uint64_t seed = 0; seed < 50; ++seed) {
    EXPECT_TRUE(IsKeptOverALossOfPower(/*synchronises=*/true, seed)) << seed;
    is_found |= !IsKeptOverALossOfPower(/*synchronises=*/false, seed);
  }
  EXPECT_TRUE(is_found) << "without the synchronisation of the folder that has lost/";
}

struct PlantedBug {
  const char* name;
  Bugs bugs;
};

class CrashHistoriesWith : public ::testing::TestWithParam<PlantedBug> {};

TEST_P(CrashHistoriesWith, AreFound) {
  std::string problem;
  EXPECT_GT(CountProblems(1, 300, GetParam().bugs, problem), 0);
  std::cout << problem.substr(0, 300) << "\n";
}

INSTANTIATE_TEST_SUITE_P(
    PlantedBugs, CrashHistoriesWith,
    ::testing::Values(PlantedBug{"AnswerBeforeCommit", {.of_life = {.answers_before_commit = true}}},
                      PlantedBug{"AnswerInAnotherTransaction", {.of_life = {.answers_in_another_transaction = true}}},
                      PlantedBug{"MeshNamedBeforeItsSynchronisation", {.unsynchronised = {".tmp"}}},
                      PlantedBug{"RenameWithoutItsFolder", {.unsynchronised = {"/files"}}},
                      PlantedBug{"PointsWithoutSynchronisation", {.unsynchronised = {".points"}}},
                      PlantedBug{"LogWithoutSynchronisation", {.unsynchronised = {"-wal"}}},
                      PlantedBug{"MarkWithoutSynchronisation", {.unsynchronised = {"-mark"}}},
                      PlantedBug{"DatabaseWithoutSynchronisation", {.unsynchronised = {".db"}}},
                      PlantedBug{"FolderWithoutTheNamesInIt", {.unsynchronised = {"/data"}}},
                      PlantedBug{"FolderWithoutItsName", {.unsynchronised = {"/"}}}),
    [](const auto& of) { return std::string(of.param.name); });

}  // namespace
}  // namespace wellspace::server
