#include "tests/server/merged_history.h"

#include <functional>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

// A session that is made at the first place, taken over by the second, changed there, and deleted.
struct History {
  using Of = DatabaseWrite::Of;

  std::vector<DatabaseWrite> writes = {
      {.of = Of::kSession, .place = "a", .session = "s", .epoch = 1, .owner = 1, .revision = 1},
      {.of = Of::kAnswer, .place = "a", .request_id = "create"},
      {.of = Of::kOperation, .place = "a", .session = "s", .epoch = 1, .owner = 1, .number = 7},
      {.of = Of::kAnswer, .place = "a", .request_id = "start"},
      {.of = Of::kSession, .place = "b", .session = "s", .epoch = 3, .owner = 2, .revision = 1},
      {.of = Of::kOperation, .place = "b", .session = "s", .epoch = 3, .owner = 2, .number = 7},
      {.of = Of::kRecord, .place = "b", .session = "s", .epoch = 3, .owner = 2},
      {.of = Of::kSession, .place = "b", .session = "s", .epoch = 3, .owner = 2, .revision = 2},
      {.of = Of::kDeletion, .place = "b", .session = "s", .epoch = 3, .owner = 2},
      {.of = Of::kAnswer, .place = "b", .request_id = "delete"},
  };
  std::vector<Acknowledgement> told = {
      {.of = Acknowledgement::Of::kCreation, .session = "s", .request_id = "create", .revision = 1},
      {.of = Acknowledgement::Of::kOperation, .session = "s", .request_id = "start"},
      {.of = Acknowledgement::Of::kChange, .session = "s", .revision = 2},
      {.of = Acknowledgement::Of::kDeletion, .session = "s", .request_id = "delete"},
  };
};

TEST(MergedHistory, AWholeOneIsRight) {
  const History history;
  EXPECT_EQ(CheckMergedHistory(history.writes, history.told), "");
}

struct Planted {
  const char* name;
  std::function<void(History&)> plant;
  const char* said;
};

class MergedHistoryFaults : public ::testing::TestWithParam<Planted> {};

TEST_P(MergedHistoryFaults, AreFound) {
  History history;
  GetParam().plant(history);
  EXPECT_THAT(CheckMergedHistory(history.writes, history.told), HasSubstr(GetParam().said));
}

INSTANTIATE_TEST_SUITE_P(
    Planted, MergedHistoryFaults,
    ::testing::Values(
        Planted{"LostSession", [](History& h) { h.told[2].session = "t"; }, "t is lost"},
        Planted{"LostRevision", [](History& h) { h.told[2].revision = 3; }, "revision 3 is lost"},
        Planted{"LostRequest", [](History& h) { h.writes.erase(h.writes.begin() + 3); }, "request start is lost"},
        Planted{"RevisionGoesBack", [](History& h) { h.writes[7].revision = 0; }, "goes back to 0"},
        Planted{"DeletionNobodyAskedFor", [](History& h) { h.told.pop_back(); }, "was deleted"},
        Planted{"DeletionUndone", [](History& h) { h.writes.erase(h.writes.begin() + 8); }, "is not deleted"},
        Planted{"AnsweredTwice", [](History& h) { h.writes.push_back(h.writes[3]); }, "answered twice"},
        Planted{"MadeTwice",
                [](History& h) {
                  h.writes.push_back(h.writes[0]);
                  h.writes.back().session = "t";
                },
                "t was made"},
        Planted{"BegunTwice", [](History& h) { h.writes[5].number = 8; }, "2 operations were begun"},
        Planted{"LateWrite", [](History& h) { std::swap(h.writes[2], h.writes[6]); }, "comes after one of 3"},
        Planted{"TwoOwnersOfAnEpoch", [](History& h) { h.writes[6].owner = 1; }, "both have epoch 3"},
        Planted{"AnothersWrite", [](History& h) { h.writes[6].place = "a"; }, "is written by a"},
        Planted{"WriteAfterDeletion", [](History& h) { std::swap(h.writes[6], h.writes[8]); }, "after its deletion"}),
    [](const ::testing::TestParamInfo<Planted>& planted) { return std::string(planted.param.name); });

}  // namespace
}  // namespace wellspace::server
