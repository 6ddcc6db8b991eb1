// Random lives of the server's services, sessions and store on a disk that loses power: answered changes are
// there afterwards, and each other one is there wholly or not at all.
#include <array>
#include <iostream>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "tests/server/histories/session_life.h"
#include "tests/server/store/simulated_disk.h"
#include "tests/support/amount.h"
#include "tests/support/clouds.h"

namespace wellspace::server {
namespace {

using Loss = SimulatedDisk::Loss;
constexpr std::array kLosses = {Loss::kProcess, Loss::kAll, Loss::kSome, Loss::kSome};

// One life with some crashes. Returns the fault after one of them; empty: all is well.
std::string RunHistory(uint64_t seed, const Plant& plant = {}) {
  test::SplitMix64 random(seed);
  SimulatedDisk disk;
  SessionLife life(disk, plant);
  const uint64_t crashes = 1 + random.Below(3);
  for (uint64_t crash = 0; crash < crashes; ++crash) {
    disk.DieAt(disk.operations() + random.Below(300));
    std::string problem = crash == 0 ? life.Start() : "";
    for (int step = 0; step < 40 && problem.empty() && !disk.is_dead(); ++step) {
      problem = life.DoAnything(random);
    }
    if (problem.empty()) {
      problem = life.Restart(kLosses[random.Below(kLosses.size())], random);
    }
    if (!problem.empty()) {
      return absl::StrCat("crash ", crash, ", at ", disk.failed_operation(), ": ", problem);
    }
  }
  return life.CheckWhole();
}

// Of so many histories, how many go wrong. It ends when `enough` have.
int CountProblems(uint64_t first_seed, int histories, const Plant& plant, std::string& first_problem,
                  int enough = 1 << 30) {
  int count = 0;
  for (int i = 0; i < histories && count < enough; ++i) {
    const std::string problem = RunHistory(first_seed + i, plant);
    if (!problem.empty() && count++ == 0) {
      first_problem = absl::StrCat("seed ", first_seed + i, ": ", problem);
    }
  }
  return count;
}

TEST(SessionHistories, NothingThatWasAnsweredIsLost) {
  const int histories = test::Amount("WELLSPACE_HISTORIES", 1000);
  const uint64_t seed = test::Seed(20261129);
  std::cout << histories << " histories from WELLSPACE_SEED=" << seed << " on\n";
  std::string problem;
  EXPECT_EQ(CountProblems(seed, histories, {}, problem), 0) << problem;
}

// Requests that were answered by a process before, which this one does not know of, are decided where their changes are
// committed.
TEST(SessionHistories, WhatAnotherProcessHasAnsweredIsNotDoneAgain) {
  const int histories = test::Amount("WELLSPACE_HISTORIES", 1000) / 2;
  const uint64_t seed = test::Seed(20261130);
  std::string problem;
  EXPECT_EQ(CountProblems(seed, histories, {.hides_answers = true}, problem), 0) << problem;
}

constexpr std::array kScript = {
    Step::kCreate,
    Step::kUpload,
    Step::kAddFeatures,
    Step::kSetSizes,
    Step::kRefine,
    Step::kWork,
    Step::kAddVertices,
    Step::kUpdate,
    Step::kRefine,
    Step::kCancel,
    Step::kUpload,
    Step::kRefine,
    Step::kWork,
    Step::kSetSizes,
    Step::kRemovePoints,
    Step::kRefineBesideUpload,
    Step::kWork,
    Step::kSweep,
    Step::kAddVerticesBesideUpload,
    Step::kBrokenUpload,
    Step::kRefine,
    Step::kWork,
    Step::kExpire,
    Step::kCreate,
    Step::kUpload,
    Step::kRefine,
    Step::kWork,
    Step::kDelete,
};

// Of the block: the differences from the script above.
constexpr std::array kBlockScript = {
    Step::kCreate, Step::kUpload, Step::kAddFeatures,  Step::kAddFeatures, Step::kRefine, Step::kWork,   Step::kUpload,
    Step::kRefine, Step::kWork,   Step::kRemovePoints, Step::kRefine,      Step::kWork,   Step::kDelete,
};

// Goes through `script` with session `number` until the disk dies.
std::string RunScript(std::span<const Step> script, int number, SimulatedDisk& disk, SessionLife& life,
                      test::SplitMix64& random) {
  std::string problem = life.Start();
  for (size_t step = 0; step < script.size() && problem.empty() && !disk.is_dead(); ++step) {
    const std::string before = TextOf(life.world());
    problem = life.Do(script[step], number, random);
    if (problem.empty() && !disk.is_dead() && script[step] != Step::kSweep && TextOf(life.world()) == before) {
      problem = absl::StrCat("step ", step, " of the script changes nothing");
    }
  }
  return problem;
}

// Lives as `script` says, with each operation of the disk as the last one; how many there are.
uint64_t EndAtEveryOperation(std::span<const Step> script, int number) {
  uint64_t operation = 0;
  for (bool has_died = true; has_died; ++operation) {
    for (const Loss loss : {Loss::kProcess, Loss::kAll, Loss::kSome}) {
      SimulatedDisk disk;
      disk.DieAt(operation);
      SessionLife life(disk, {});
      test::SplitMix64 random(17);
      std::string problem = RunScript(script, number, disk, life, random);
      has_died = disk.is_dead();
      const std::string at = has_died ? disk.failed_operation() : "the end";
      if (problem.empty()) {
        problem = life.Restart(loss, random);
      }
      if (problem.empty()) {
        problem = life.CheckWhole();
      }
      EXPECT_EQ(problem, "") << "operation " << operation << ", " << at;
      if (!problem.empty()) {
        return operation;
      }
    }
  }
  return operation;
}

// Every operation of one life, whatever else is drawn.
TEST(SessionHistories, EveryOperationMayBeTheLast) { EXPECT_GT(EndAtEveryOperation(kScript, 0), 150u); }

TEST(SessionHistories, EveryOperationOfABlockMayBeTheLast) {
  EXPECT_GT(EndAtEveryOperation(kBlockScript, SessionLife::kBlock), 60u);
}

// A history follows from its seed, so that one that goes wrong can be run again.
TEST(SessionHistories, AreTheSameEachTime) {
  const auto run = [](uint64_t seed) {
    test::SplitMix64 random(seed);
    SimulatedDisk disk;
    SessionLife life(disk, {});
    std::string text = life.Start();
    for (int step = 0; step < 40; ++step) {
      text += life.DoAnything(random);
    }
    text += TextOf(life.world());
    disk.DieAt(disk.operations());
    return absl::StrCat(text, disk.operations());
  };
  for (uint64_t seed = 0; seed < 5; ++seed) {
    EXPECT_EQ(run(seed), run(seed));
  }
}

struct PlantedFault {
  const char* name;
  Plant plant;
};

class SessionHistoriesWith : public ::testing::TestWithParam<PlantedFault> {};

TEST_P(SessionHistoriesWith, AreFound) {
  std::string problem;
  EXPECT_GT(CountProblems(1, 3000, GetParam().plant, problem, 1), 0);
  std::cout << problem.substr(0, 300) << "\n";
}

std::string NameOf(const ::testing::TestParamInfo<PlantedFault>& of) { return of.param.name; }

// Those of server/sessions.
INSTANTIATE_TEST_SUITE_P(
    OmittedSynchronizeOfSessions, SessionHistoriesWith,
    ::testing::Values(
        PlantedFault{"CommitPoints", {.during = Step::kUpload, .omits_points_synchronize = true}},
        PlantedFault{"CommitPointsOfABrokenUpload", {.during = Step::kBrokenUpload, .omits_points_synchronize = true}},
        PlantedFault{"CommitStart", {.during = Step::kRefineBesideUpload, .omits_points_synchronize = true}},
        PlantedFault{"CopyPointsWithout", {.during = Step::kRemovePoints, .omits_points_synchronize = true}},
        PlantedFault{"CommitAddition", {.during = Step::kAddVertices, .omits_points_synchronize = true}},
        PlantedFault{"CommitAdditionBesideAnUpload",
                     {.during = Step::kAddVerticesBesideUpload, .omits_points_synchronize = true}}),
    NameOf);

// Those of server/store, by the files and folders that they are of.
INSTANTIATE_TEST_SUITE_P(
    OmittedSynchronizeOfTheStore, SessionHistoriesWith,
    ::testing::Values(PlantedFault{"PointsOfAnUpload", {.during = Step::kUpload, .omits_synchronize = ".points"}},
                      PlantedFault{"FolderOfPoints", {.during = Step::kUpload, .omits_synchronize = "/files"}},
                      PlantedFault{"FolderOfPointsThatAreLeft",
                                   {.during = Step::kRemovePoints, .omits_synchronize = "/files"}},
                      PlantedFault{"Mesh", {.during = Step::kWork, .omits_synchronize = ".tmp"}},
                      PlantedFault{"FolderOfMesh", {.during = Step::kWork, .omits_synchronize = "/files"}}),
    NameOf);

INSTANTIATE_TEST_SUITE_P(
    AnswerBeforeCommit, SessionHistoriesWith,
    ::testing::Values(PlantedFault{"Create", {.during = Step::kCreate, .answers_before_commit = true}},
                      PlantedFault{"Update", {.during = Step::kUpdate, .answers_before_commit = true}},
                      PlantedFault{"Upload", {.during = Step::kUpload, .answers_before_commit = true}},
                      PlantedFault{"RemovePoints", {.during = Step::kRemovePoints, .answers_before_commit = true}},
                      PlantedFault{"AddFeatures", {.during = Step::kAddFeatures, .answers_before_commit = true}},
                      PlantedFault{"SetSizes", {.during = Step::kSetSizes, .answers_before_commit = true}},
                      PlantedFault{"StartRefinement", {.during = Step::kRefine, .answers_before_commit = true}},
                      PlantedFault{"EndOfRefinement", {.during = Step::kWork, .answers_before_commit = true}},
                      PlantedFault{"CancelOperation", {.during = Step::kCancel, .answers_before_commit = true}},
                      PlantedFault{"AddVertices", {.during = Step::kAddVertices, .answers_before_commit = true}},
                      PlantedFault{"Delete", {.during = Step::kDelete, .answers_before_commit = true}}),
    NameOf);

INSTANTIATE_TEST_SUITE_P(
    FilesRemovedBeforeTheirRow, SessionHistoriesWith,
    ::testing::Values(PlantedFault{"Delete", {.during = Step::kDelete, .removes_files_first = true}},
                      PlantedFault{"Expiry", {.during = Step::kExpire, .removes_files_first = true}},
                      PlantedFault{"PointsOfBefore", {.during = Step::kRemovePoints, .removes_files_first = true}},
                      PlantedFault{"MeshOfBefore", {.during = Step::kWork, .removes_files_first = true}}),
    NameOf);

}  // namespace
}  // namespace wellspace::server
