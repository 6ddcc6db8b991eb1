// The records of a server whose sessions end with it.
#ifndef WELLSPACE_SERVER_STORE_MEMORY_RECORDS_H_
#define WELLSPACE_SERVER_STORE_MEMORY_RECORDS_H_

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/store/records.h"

namespace wellspace::server {

// Keeps the answers, the usage, and of a session its epoch and its record's part in that: a Session has its state.
//
// Thread safety: that of Records.
class MemoryRecords : public Records {
 public:
  bool is_durable() const override { return false; }
  uint64_t epoch() const override { return kFirstEpoch; }
  absl::StatusOr<StoredSessions> Load() override { return StoredSessions(); }
  absl::StatusOr<std::optional<StoredSession>> Take(const std::string& session) override;
  absl::Status Apply(const SessionChange& change, Survives survives) override;
  absl::StatusOr<std::optional<store::v1::AnswerRecord>> FindAnswer(const AnswerKey& request) override;
  void Forget(std::span<const AnswerKey> answers) override;
  absl::StatusOr<std::vector<store::v1::StepRecord::Features>> ReadFeatures(const std::string& /*session*/) override {
    return std::vector<store::v1::StepRecord::Features>();
  }
  absl::StatusOr<std::vector<StoredSizes>> ReadSizes(const std::string& /*session*/) override {
    return std::vector<StoredSizes>();
  }
  absl::StatusOr<UsageByTenant> ReadUsage(const UsageRange& range) override;
  absl::StatusOr<std::optional<store::v1::SessionRecord>> ReadRecord(const std::string& /*session*/) override {
    return std::optional<store::v1::SessionRecord>();
  }
  absl::StatusOr<Census> ReadCensus() override { return Census{.sessions = {}, .oldest_epoch = kFirstEpoch}; }

 private:
  static constexpr uint64_t kFirstEpoch = 1;

  struct Kept {
    uint64_t epoch = 0;
    store::v1::SessionRecord record{};  // tenant and stored bytes alone
  };

  std::mutex mutex_;
  // Guarded by mutex_.
  uint64_t last_epoch_ = kFirstEpoch;
  std::unordered_map<std::string, Kept> sessions_;                                  // by name
  std::map<std::pair<std::string, std::string>, store::v1::AnswerRecord> answers_;  // by tenant and request_id
  std::map<std::pair<std::string, int32_t>, store::v1::UsageRecord> usage_;         // by tenant and day
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_MEMORY_RECORDS_H_
