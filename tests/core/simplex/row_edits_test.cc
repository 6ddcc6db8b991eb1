// Rows that are changed in place, and the rows of slots: both against copies that are made anew.
#include "core/simplex/row_edits.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/simplex/slot_rows.h"
#include "tests/support/clouds.h"

namespace wellspace::core {
namespace {

using test::SplitMix64;

// The rows after `edits`, one by one.
HugeVector<uint32_t> Spliced(size_t width, const std::vector<RowEdit>& edits, const HugeVector<uint32_t>& added,
                             const HugeVector<uint32_t>& rows) {
  HugeVector<uint32_t> out;
  size_t from = 0;
  size_t taken = 0;
  for (const RowEdit& edit : edits) {
    out.insert(out.end(), rows.begin() + from * width, rows.begin() + edit.at * width);
    out.insert(out.end(), added.begin() + taken * width, added.begin() + (taken + edit.added) * width);
    from = edit.at + edit.dropped;
    taken += edit.added;
  }
  out.insert(out.end(), rows.begin() + from * width, rows.end());
  return out;
}

TEST(RowEditsTest, SpliceGivesTheRowsOfACopy) {
  const uint64_t seed = test::Seed(11);
  SCOPED_TRACE(seed);
  SplitMix64 random(seed);
  for (int round = 0; round < 300; ++round) {
    const size_t width = 1 + random.Next() % 3;
    const size_t count = random.Next() % 60;
    HugeVector<uint32_t> rows(count * width);
    std::ranges::generate(rows, [&] { return static_cast<uint32_t>(random.Next()); });
    std::vector<RowEdit> edits;
    size_t fresh = 0;
    for (size_t at = random.Next() % 8; at <= count; at += random.Next() % 12) {
      const uint64_t dropped = std::min<uint64_t>(random.Next() % 4, count - at);
      AppendEdit({at, dropped, random.Next() % 4}, edits);
      at += dropped + 1;
    }
    for (const RowEdit& edit : edits) {
      fresh += edit.added;
    }
    HugeVector<uint32_t> added(fresh * width);
    std::ranges::generate(added, [&] { return static_cast<uint32_t>(random.Next()); });
    const HugeVector<uint32_t> expected = Spliced(width, edits, added, rows);
    SpliceRows<uint32_t>(width, edits, added, rows);
    ASSERT_EQ(rows, expected) << round;
  }
}

TEST(RowEditsTest, EditsWithNoRowBetweenAreOne) {
  std::vector<RowEdit> edits;
  AppendEdit({3, 1, 0}, edits);
  AppendEdit({4, 0, 2}, edits);
  AppendEdit({5, 1, 1}, edits);
  EXPECT_EQ(edits, (std::vector<RowEdit>{{3, 1, 2}, {5, 1, 1}}));
}

TEST(SlotRowsTest, RowsAreThoseOfTakenSlots) {
  const uint64_t seed = test::Seed(12);
  SCOPED_TRACE(seed);
  SplitMix64 random(seed);
  SlotRows rows;
  std::vector<bool> is_taken;
  HugeVector<uint32_t> listed;  // the numbers of what the slots hold, in their order
  std::vector<uint32_t> held;
  uint32_t next = 0;
  for (int i = 0; i < 3000; ++i) {
    is_taken.push_back(random.Next() % 8 != 0);
    held.push_back(next++);
    rows.Push(is_taken.back());
  }
  const auto list = [&] {
    HugeVector<uint32_t> all;
    for (size_t slot = 0; slot < is_taken.size(); ++slot) {
      if (is_taken[slot]) {
        all.push_back(held[slot]);
      }
    }
    return all;
  };
  listed = list();
  for (int round = 0; round < 50; ++round) {
    std::vector<uint32_t> changed;
    for (uint32_t slot = random.Next() % 700; slot < is_taken.size() + 100; slot += 1 + random.Next() % 700) {
      changed.push_back(slot);
    }
    is_taken.resize(std::max<size_t>(is_taken.size(), changed.back() + 1), false);
    held.resize(is_taken.size());
    HugeVector<uint32_t> added;
    for (const uint32_t slot : changed) {
      is_taken[slot] = random.Next() % 2 == 0;
      held[slot] = next++;
      if (is_taken[slot]) {
        added.push_back(held[slot]);
      }
    }
    const std::vector<RowEdit> edits = rows.Change(changed, [&](uint32_t slot) { return bool{is_taken[slot]}; });
    SpliceRows<uint32_t>(1, edits, added, listed);
    ASSERT_EQ(listed, list()) << round;
    ASSERT_EQ(rows.rows(), listed.size());
    ASSERT_EQ(rows.slots(), is_taken.size());
    for (const uint32_t slot : changed) {
      ASSERT_EQ(rows.RowOf(slot), std::count(is_taken.begin(), is_taken.begin() + slot, true)) << slot;
    }
  }
}

}  // namespace
}  // namespace wellspace::core
