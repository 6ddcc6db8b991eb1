// Records and files that hand all on to those of another log, for tests that change some of it.
#ifndef WELLSPACE_TESTS_SERVER_STORE_PASSING_LOG_H_
#define WELLSPACE_TESTS_SERVER_STORE_PASSING_LOG_H_

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/store/session_log.h"

namespace wellspace::server {

// Thread safety: that of the other ones.
class PassingRecords : public Records {
 public:
  explicit PassingRecords(std::shared_ptr<SessionLog> log) : log_(std::move(log)) {}

  bool is_durable() const override { return log_->is_durable(); }
  uint64_t epoch() const override { return log_->records().epoch(); }
  absl::StatusOr<StoredSessions> Load() override { return records().Load(); }
  absl::StatusOr<std::optional<StoredSession>> Take(const std::string& session) override {
    return records().Take(session);
  }
  absl::StatusOr<std::optional<store::v1::AnswerRecord>> FindAnswer(const AnswerKey& request) override {
    return records().FindAnswer(request);
  }
  absl::Status Apply(const SessionChange& change, Survives survives) override {
    return records().Apply(change, survives);
  }
  void Forget(std::span<const AnswerKey> answers) override { records().Forget(answers); }
  absl::StatusOr<std::vector<store::v1::StepRecord::Features>> ReadFeatures(const std::string& session) override {
    return records().ReadFeatures(session);
  }
  absl::StatusOr<std::vector<StoredSizes>> ReadSizes(const std::string& session) override {
    return records().ReadSizes(session);
  }
  absl::StatusOr<std::optional<store::v1::SessionRecord>> ReadRecord(const std::string& session) override {
    return records().ReadRecord(session);
  }
  absl::StatusOr<UsageByTenant> ReadUsage(const UsageRange& range) override { return records().ReadUsage(range); }
  absl::StatusOr<Census> ReadCensus() override { return records().ReadCensus(); }

 private:
  Records& records() { return log_->records(); }

  const std::shared_ptr<SessionLog> log_;
};

// Thread safety: that of the other ones.
class PassingFiles : public Files {
 public:
  explicit PassingFiles(std::shared_ptr<SessionLog> log) : log_(std::move(log)) {}

  std::unique_ptr<PointStore> OpenPoints(SessionPoints points) override {
    return files().OpenPoints(std::move(points));
  }
  void DropPoints(const std::string& session, const store::v1::PointsFile& file) override {
    files().DropPoints(session, file);
  }
  absl::StatusOr<std::shared_ptr<MeshSnapshot>> KeepMesh(const std::string& session, uint64_t revision, uint64_t epoch,
                                                         core::Mesh mesh, const core::RunContext& context) override {
    return files().KeepMesh(session, revision, epoch, std::move(mesh), context);
  }
  std::shared_ptr<MeshSnapshot> FindMesh(const store::v1::SessionRecord& record) override {
    return files().FindMesh(record);
  }
  void RemoveAll(const store::v1::SessionRecord& deleted) override { files().RemoveAll(deleted); }
  absl::StatusOr<Garbage> RemoveGarbage(const ReadCensus& read) override { return files().RemoveGarbage(read); }

 private:
  Files& files() { return log_->files(); }

  const std::shared_ptr<SessionLog> log_;
};

// A log around `log` whose records are made of it and of `arguments`.
template <typename RecordsAround, typename... Arguments>
std::unique_ptr<SessionLog> LogAround(const std::shared_ptr<SessionLog>& log, Arguments&&... arguments) {
  return std::make_unique<SessionLog>(std::make_unique<RecordsAround>(log, std::forward<Arguments>(arguments)...),
                                      std::make_unique<PassingFiles>(log));
}

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_STORE_PASSING_LOG_H_
