#include "tests/server/histories/planted_log.h"

#include <algorithm>

#include "core/base/status_macros.h"
#include "server/store/data_folder.h"

namespace wellspace::server {
namespace {

// Points whose synchronisation is left out where `omits` says so.
class PlantedPoints final : public PointStore {
 public:
  PlantedPoints(std::unique_ptr<PointStore> points, std::function<bool()> omits)
      : points_(std::move(points)), omits_(std::move(omits)) {}

  bool is_in_memory() const override { return points_->is_in_memory(); }
  uint64_t coordinate_count() const override { return points_->coordinate_count(); }
  absl::Status Append(std::span<const double> coordinates) override { return points_->Append(coordinates); }
  void Truncate(uint64_t count) override { points_->Truncate(count); }
  absl::Status Synchronize() override { return omits_() ? absl::OkStatus() : points_->Synchronize(); }
  absl::StatusOr<uint64_t> CountEqual(uint64_t first, std::span<const double> coordinates) const override {
    return points_->CountEqual(first, coordinates);
  }
  absl::StatusOr<uint32_t> Checksum(uint64_t first, uint64_t end) const override {
    return points_->Checksum(first, end);
  }
  absl::StatusOr<std::vector<double>> Copy(uint64_t first, uint64_t end,
                                           const core::RunContext& context) const override {
    return points_->Copy(first, end, context);
  }

 private:
  const std::unique_ptr<PointStore> points_;
  const std::function<bool()> omits_;
};

}  // namespace

absl::StatusOr<StoredSessions> PlantedRecords::Load() {
  WELLSPACE_ASSIGN_OR_RETURN(StoredSessions stored, PassingRecords::Load());
  for (const StoredSession& session : stored.sessions) {
    states_[session.state.name()] = session.state;
  }
  if (plant_.hides_answers) {
    stored.answers.clear();
  }
  return stored;
}

absl::Status PlantedRecords::Apply(const SessionChange& change, Survives survives) {
  const bool is_planted = step_() == plant_.during;
  if (is_planted && plant_.removes_files_first) {
    RemoveFilesOf(change);
  }
  if (change.is_deletion) {
    states_.erase(change.session);
  } else if (change.state.has_value()) {
    states_[change.session] = *change.state;
  }
  if (is_planted && plant_.answers_before_commit) {
    late_.emplace_back(change, survives);
    return absl::OkStatus();
  }
  return PassingRecords::Apply(change, survives);
}

void PlantedRecords::EndStep() {
  for (const auto& [change, survives] : std::exchange(late_, {})) {
    PassingRecords::Apply(change, survives).IgnoreError();
  }
}

void PlantedRecords::RemoveFilesOf(const SessionChange& change) {
  const auto known = states_.find(change.session);
  if (known == states_.end() || !(change.is_deletion || change.state.has_value())) {
    return;
  }
  const DataPaths paths{root_};
  std::vector<std::string> given_up = FilesOf(paths, known->second);
  if (!change.is_deletion) {
    const std::vector<std::string> kept = FilesOf(paths, *change.state);
    std::erase_if(given_up, [&](const std::string& path) { return std::ranges::find(kept, path) != kept.end(); });
  }
  for (const std::string& path : given_up) {
    disk_.files().Remove(path).IgnoreError();
  }
}

std::unique_ptr<PointStore> PlantedFiles::OpenPoints(SessionPoints points) {
  return std::make_unique<PlantedPoints>(PassingFiles::OpenPoints(std::move(points)), [this] {
    return plant_.omits_points_synchronize && step_() == plant_.during;
  });
}

}  // namespace wellspace::server
