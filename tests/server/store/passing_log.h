// A session log that hands all on to another one, for tests that change some of it.
#ifndef WELLSPACE_TESTS_SERVER_STORE_PASSING_LOG_H_
#define WELLSPACE_TESTS_SERVER_STORE_PASSING_LOG_H_

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/store/session_log.h"

namespace wellspace::server {

// Thread safety: that of the other one.
class PassingLog : public SessionLog {
 public:
  // REQUIRES:   `log` outlives this.
  explicit PassingLog(SessionLog& log) : log_(log) {}

  bool is_durable() const override { return log_.is_durable(); }
  absl::StatusOr<StoredSessions> Load() override { return log_.Load(); }
  absl::Status Commit(const SessionChange& change, Survives survives) override { return log_.Commit(change, survives); }
  void Forget(std::span<const AnswerKey> answers) override { log_.Forget(answers); }
  absl::StatusOr<std::vector<store::v1::StepRecord::Features>> ReadFeatures(const std::string& session) override {
    return log_.ReadFeatures(session);
  }
  absl::StatusOr<std::vector<StoredSizes>> ReadSizes(const std::string& session) override {
    return log_.ReadSizes(session);
  }
  std::unique_ptr<PointStore> OpenPoints(const std::string& session, int dimension, uint64_t number,
                                         std::vector<store::v1::StepRecord::Points> committed) override {
    return log_.OpenPoints(session, dimension, number, std::move(committed));
  }
  void DropPoints(const std::string& session, uint64_t number) override { log_.DropPoints(session, number); }
  absl::StatusOr<std::shared_ptr<MeshSnapshot>> KeepMesh(const std::string& session, uint64_t revision, core::Mesh mesh,
                                                         const core::RunContext& context) override {
    return log_.KeepMesh(session, revision, std::move(mesh), context);
  }
  absl::StatusOr<Garbage> RemoveGarbage() override { return log_.RemoveGarbage(); }
  std::shared_ptr<MeshSnapshot> FindMesh(const std::string& session, const store::v1::SessionRecord& record) override {
    return log_.FindMesh(session, record);
  }

 private:
  SessionLog& log_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_STORE_PASSING_LOG_H_
