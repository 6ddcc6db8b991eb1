// Work that no change of a session tells of: when it is written down, and what becomes of it where that fails.
#include "server/store/usage_meter.h"

#include <memory>
#include <utility>

#include "gtest/gtest.h"
#include "server/store/memory_files.h"
#include "server/store/memory_records.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// Records that count their changes, and refuse them while they are full.
class CountingRecords final : public MemoryRecords {
 public:
  absl::Status Apply(const SessionChange& change, Survives survives) override {
    ++changes;
    return is_full ? MakeError(v1::ERROR_REASON_DISK_FULL, "full") : MemoryRecords::Apply(change, survives);
  }

  int changes = 0;
  bool is_full = false;
};

class UsageMeterTest : public ::testing::Test {
 protected:
  UsageMeterTest() {
    auto records = std::make_unique<CountingRecords>();
    records_ = records.get();
    log_ = std::make_unique<SessionLog>(std::move(records), std::make_unique<MemoryFiles>());
  }

  CountingRecords* records_ = nullptr;
  std::unique_ptr<SessionLog> log_;
  absl::Time now_ = absl::UnixEpoch() + absl::Hours(47);
  const Clock clock_{.wall = [this] { return now_; }};
};

TEST_F(UsageMeterTest, AllThatCameIsOneChange) {
  UsageMeter meter(clock_, *log_);
  EXPECT_TRUE(meter.Flush().ok());
  EXPECT_EQ(records_->changes, 0) << "nothing came";
  for (int i = 0; i < 1000; ++i) {
    meter.AddMesh(i % 2 == 0 ? "even" : "odd", 3);
    meter.AddTime("odd", absl::Nanoseconds(5));
  }
  now_ += absl::Hours(1);
  meter.AddMesh("odd", 4);
  EXPECT_EQ(records_->changes, 0);
  ASSERT_TRUE(meter.Flush().ok());
  EXPECT_EQ(records_->changes, 1);
  EXPECT_TRUE(meter.IsEmpty());
  const UsageByTenant usage = records_->ReadUsage({}).value();
  EXPECT_EQ(usage.at("even").meshes, 500u);
  EXPECT_EQ(usage.at("even").vertices, 1500u);
  EXPECT_EQ(usage.at("odd").vertices, 1504u);
  EXPECT_EQ(usage.at("odd").processor_time_ns, 5000);
  EXPECT_EQ(records_->ReadUsage({.first_day = 2})->at("odd").vertices, 4u) << "of the next day";
}

TEST_F(UsageMeterTest, WhatCannotBeWrittenIsWrittenWithTheNext) {
  {
    UsageMeter meter(clock_, *log_);
    meter.AddMesh("tenant", 3);
    records_->is_full = true;
    EXPECT_FALSE(meter.Flush().ok());
    EXPECT_FALSE(meter.IsEmpty());
    meter.AddMesh("tenant", 4);
    records_->is_full = false;
  }
  EXPECT_EQ(records_->ReadUsage({})->at("tenant").vertices, 7u) << "the end of the meter writes it";
}

}  // namespace
}  // namespace wellspace::server
