#include "server/store/check_data.h"

#include <map>
#include <memory>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/data_folder.h"
#include "server/store/files_in_use.h"
#include "server/store/joined_points.h"
#include "server/store/mesh_file.h"
#include "server/store/point_file.h"
#include "server/store/store_health.h"
#include "server/store/write_ahead_log.h"

namespace wellspace::server {
namespace {

// A session that a server has changed in each of so many looks is taken as it is then.
constexpr int kMostLooks = 10;

class SessionCheck {
 public:
  SessionCheck(const DataPaths& paths, FileSystem& files, SessionTables& tables, const StoredSession& session)
      : paths_(paths), files_(files), tables_(tables), session_(session), state_(session.state) {}

  std::vector<std::string> Run() {
    CheckPoints();
    CheckFeatures();
    CheckSizes();
    CheckOperations();
    CheckMesh();
    return std::move(problems_);
  }

 private:
  template <typename... Parts>
  void Add(const Parts&... parts) {
    problems_.push_back(absl::StrCat(paths_.database(), ": session '", state_.name(), "': ", parts...));
  }
  void Add(const absl::Status& status) {
    if (!status.ok()) {
      problems_.emplace_back(status.message());
    }
  }

  void CheckPoints() {
    std::vector<store::v1::StepRecord::Points> committed;
    uint64_t points = 0;
    for (const store::v1::StepRecord& step : session_.steps) {
      if (step.has_removed()) {
        committed.clear();
        points = 0;
      }
      if (step.has_points()) {
        if (step.points().first() != points) {
          Add("points ", step.points().first(), " come behind ", points);
        }
        points += step.points().count();
        committed.push_back(step.points());
      }
    }
    if (points != state_.points()) {
      Add("there are ", state_.points(), " points, and ", points, " in its steps");
      return;
    }
    if (committed.empty()) {
      return;
    }
    const std::vector<store::v1::PointsFile> points_files = PointsFilesOf(state_);
    const auto open = [&](const store::v1::PointsFile& file, bool /*is_written*/,
                          std::vector<store::v1::StepRecord::Points> of_file) {
      return std::make_unique<PointFile>(files_, std::make_shared<StoreHealth>(nullptr), /*written=*/nullptr,
                                         paths_.points(state_.name(), file), state_.parameters().dimension(),
                                         std::move(of_file));
    };
    const std::unique_ptr<PointStore> store = JoinPoints({.session = state_.name(),
                                                          .dimension = state_.parameters().dimension(),
                                                          .files = points_files,
                                                          .committed = std::move(committed),
                                                          .next = points_files.back()},
                                                         open);
    Add(store->Checksum(0, store->coordinate_count()).status());
  }

  void CheckFeatures() {
    const auto features = tables_.ReadFeatures(state_.name());
    if (!features.ok()) {
      Add(features.status());
      return;
    }
    uint64_t segments = 0;
    uint64_t triangles = 0;
    uint64_t seeds = 0;
    for (const store::v1::StepRecord::Features& step : *features) {
      segments += step.segments().ends_size() / 2;
      triangles += step.triangles().corners_size() / 3;
      seeds += step.faces().seeds_size() + step.surface().seeds_size();
    }
    if (segments != state_.segments() || triangles != state_.triangles() || seeds != state_.seeds()) {
      Add("there are ", state_.segments(), " segments, ", state_.triangles(), " triangles and ", state_.seeds(),
          " seeds, and ", segments, ", ", triangles, " and ", seeds, " in its steps");
    }
  }

  void CheckSizes() {
    const auto sets = tables_.ReadSizes(state_.name());
    if (!sets.ok()) {
      Add(sets.status());
      return;
    }
    std::map<uint64_t, uint64_t> counts;
    for (const StoredSizes& set : *sets) {
      for (const store::v1::SizesRecord& part : set.parts) {
        counts[set.number] += part.samples().sizes_size();
      }
    }
    const auto check = [&](uint64_t number, uint64_t count) {
      if (number != 0 && counts[number] != count) {
        Add("there are ", count, " sizes in set ", number, ", and ", counts[number], " in its records");
      }
    };
    check(state_.sizes(), state_.size_count());
    // Those before the structure began anew are not needed any more.
    std::map<uint64_t, uint64_t> needed;
    for (const store::v1::StepRecord& step : session_.steps) {
      if (step.refined().begins() || step.has_removed()) {
        needed.clear();
      }
      needed[step.refined().sizes()] = step.refined().size_count();
    }
    for (const auto& [number, count] : needed) {
      check(number, count);
    }
  }

  void CheckOperations() {
    for (const store::v1::OperationRecord& operation : session_.operations) {
      if (operation.number() >= state_.next_operation()) {
        Add("operation ", operation.number(), " is there before its time; the next one is ", state_.next_operation());
      }
    }
  }

  void CheckMesh() {
    if (state_.has_mesh()) {
      const std::string path = paths_.mesh(state_.name(), state_.mesh().revision(), state_.mesh().epoch());
      const auto in_use = std::make_shared<FilesInUse>(files_);
      Add(MeshFile(files_, state_.mesh(), in_use->Take(path, /*is_written=*/false)).Check());
    }
  }

  const DataPaths& paths_;
  FileSystem& files_;
  SessionTables& tables_;
  const StoredSession& session_;
  const store::v1::SessionRecord& state_;
  std::vector<std::string> problems_;
};

// Whether a server has changed, or deleted, the session since it was read.
bool HasChanged(SessionTables& tables, const store::v1::SessionRecord& state) {
  const auto now = tables.ReadState(state.name());
  // Bytes of records with labels may differ; these are the fields that a problem may be about.
  return now.ok() &&
         (!now->has_value() || (*now)->revision() != state.revision() || (*now)->points() != state.points() ||
          (*now)->segments() != state.segments() || (*now)->triangles() != state.triangles() ||
          (*now)->next_operation() != state.next_operation() || (*now)->sizes() != state.sizes() ||
          (*now)->mesh().revision() != state.mesh().revision() || (*now)->mesh().epoch() != state.mesh().epoch());
}

void Count(const StoredSessions& stored, DataReport& report) {
  report.answers = stored.answers.size();
  for (const StoredSession& session : stored.sessions) {
    ++report.sessions;
    report.steps += session.steps.size();
    report.operations += session.operations.size();
    report.points += session.state.points();
    report.meshes += session.state.has_mesh() ? 1 : 0;
    report.file_bytes +=
        session.state.points() * session.state.parameters().dimension() * sizeof(double) + session.state.mesh().size();
  }
}

}  // namespace

absl::StatusOr<DataReport> CheckData(const std::string& folder, const CheckDataOptions& options) {
  const DataPaths paths{folder};
  FileSystem& files = *options.files;
  WELLSPACE_RETURN_IF_ERROR(DataFolder::CheckNotPaired(paths, files));
  DataReport report;
  WELLSPACE_ASSIGN_OR_RETURN(report.unknown, FindUnknown(paths, files));
  // Before SQLite looks at it, and reads no more of it than it takes for whole.
  WELLSPACE_ASSIGN_OR_RETURN(const std::string log_damage, FindLogDamage(files, paths.database()));
  SessionTablesOptions read_only = options.tables;
  read_only.is_read_only = true;
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<SessionTables> tables,
                             SessionTables::Open(paths.database(), read_only));
  WELLSPACE_ASSIGN_OR_RETURN(report.problems, tables->CheckFile());
  if (!log_damage.empty()) {
    report.problems.push_back(log_damage);
  }
  WELLSPACE_ASSIGN_OR_RETURN(StoredSessions stored, tables->Load(&report.problems));
  Count(stored, report);
  for (int round = 1; !stored.sessions.empty(); ++round) {
    std::set<std::string> changed;  // names
    for (const StoredSession& session : stored.sessions) {
      std::vector<std::string> problems = SessionCheck(paths, files, *tables, session).Run();
      if (!problems.empty() && round < kMostLooks && HasChanged(*tables, session.state)) {
        changed.insert(session.state.name());
      } else {
        report.problems.insert(report.problems.end(), problems.begin(), problems.end());
      }
    }
    if (changed.empty()) {
      break;
    }
    std::vector<std::string> told;  // damaged records, which are in the report
    WELLSPACE_ASSIGN_OR_RETURN(stored, tables->Load(&told));
    std::erase_if(stored.sessions, [&](const StoredSession& s) { return !changed.contains(s.state.name()); });
  }
  return report;
}

}  // namespace wellspace::server
