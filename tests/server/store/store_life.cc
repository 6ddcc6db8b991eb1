#include "tests/server/store/store_life.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/check_data.h"
#include "server/store/data_folder.h"
#include "server/store/memory_mesh.h"

namespace wellspace::server {
namespace {

constexpr uint64_t kChunkBytes = 400;  // so that small meshes have several

std::string TextOfFeatures(const std::vector<store::v1::StepRecord::Features>& features) {
  std::string text;
  for (const store::v1::StepRecord::Features& step : features) {
    absl::StrAppend(&text, step.ShortDebugString(), "\n");
  }
  return text;
}

std::vector<store::v1::StepRecord::Features> FeaturesOf(const LifeState::Session& session) {
  std::vector<store::v1::StepRecord::Features> features;
  for (const store::v1::StepRecord& step : session.steps) {
    if (step.has_features()) {
      features.push_back(step.features());
    }
  }
  return features;
}

std::string TextOfSizes(const std::vector<StoredSizes>& sets) {
  std::string text;
  for (const StoredSizes& set : sets) {
    absl::StrAppend(&text, set.number, ":\n");
    for (const store::v1::SizesRecord& part : set.parts) {
      absl::StrAppend(&text, part.ShortDebugString(), "\n");
    }
  }
  return text;
}

std::vector<StoredSizes> SizesOf(const LifeState::Session& session) {
  std::vector<StoredSizes> sets;
  for (const auto& [ignored, set] : session.sizes) {
    sets.push_back(set);
  }
  return sets;
}

// `state` has points in `file` from now on, behind those that it has.
void NameFile(const store::v1::PointsFile& file, store::v1::SessionRecord& state) {
  std::vector<store::v1::PointsFile> files = PointsFilesOf(state);
  if (files.empty() || files.back().number() != file.number() || files.back().epoch() != file.epoch()) {
    files.push_back(file);
    files.back().set_first(state.points());
    state.mutable_points_files()->Assign(files.begin(), files.end());
  }
}

DurableLogOptions OptionsOf(SimulatedDisk& disk, int& failures) {
  return {.folder = StoreLife::kFolder,
          .files = &disk.files(),
          .on_failure = [&failures](const absl::Status&) { ++failures; },
          .tables = {.vfs = disk.vfs(), .is_exclusive = true, .checkpoint_pages = 15},
          .max_mesh_chunk_bytes = kChunkBytes};
}

}  // namespace

std::string TextOf(const LifeState& state) {
  StoredSessions stored;
  for (const auto& [number, session] : state.sessions) {
    StoredSession& one = stored.sessions.emplace_back();
    one.state = session.state;
    for (const store::v1::StepRecord& step : session.steps) {
      if (!step.has_features()) {
        one.steps.push_back(step);
      }
    }
    for (const auto& [ignored, operation] : session.operations) {
      one.operations.push_back(operation);
    }
  }
  for (const auto& [ignored, answer] : state.answers) {
    stored.answers.push_back(answer);
  }
  return TextOf(stored);
}

absl::Status StoreLife::Open() {
  WELLSPACE_ASSIGN_OR_RETURN(log_, OpenDurableLog(OptionsOf(disk_, failures_)));
  return absl::OkStatus();
}

void StoreLife::Close() {
  open_.clear();
  log_.reset();
  late_.reset();
  forgotten_.clear();
}

absl::Status StoreLife::DoAnything(test::SplitMix64& random) {
  return Do(static_cast<Action>(random.Below(kActions)), random.Below(4));
}

absl::Status StoreLife::Do(Action action, uint64_t number) {
  ++salt_;
  const bool is_there = state().sessions.contains(number);
  if (action == Action::kForget || action == Action::kSweep) {
    if (action == Action::kSweep) {
      return log_->RemoveGarbage().status();
    }
    LifeState next = state();
    if (next.answers.empty()) {
      return absl::OkStatus();
    }
    const auto [tenant, request_id] = next.answers.begin()->first;
    forgotten_.insert({tenant, request_id});
    log_->records().Forget(std::vector<AnswerKey>{{tenant, request_id}});
    SessionChange change{.session = SessionName(number), .answer = NextAnswer()};
    next.answers[{"tenant", change.answer->request_id()}] = *change.answer;
    return Commit(std::move(change), std::move(next));
  }
  if (is_there == (action == Action::kCreate)) {
    return absl::OkStatus();
  }
  switch (action) {
    case Action::kCreate:
      return Create(number);
    case Action::kUpload:
      return Upload(number);
    case Action::kRemove:
      return Remove(number);
    case Action::kSucceed:
      return Succeed(number);
    default:
      return Change(number, action);
  }
}

store::v1::PointsFile StoreLife::NextFile() const {
  store::v1::PointsFile file;
  file.set_number(salt_);
  file.set_epoch(log_->records().epoch());
  return file;
}

store::v1::AnswerRecord StoreLife::NextAnswer() {
  return MakeAnswer("tenant", absl::StrCat(salt_), std::string(salt_ % 7 * 10, 'a'));
}

absl::Status StoreLife::Create(uint64_t number) {
  LifeState next = state();
  SessionChange change{
      .session = SessionName(number), .is_creation = true, .state = MakeState(number, salt_), .answer = NextAnswer()};
  next.sessions[number].state = *change.state;
  next.answers[{"tenant", change.answer->request_id()}] = *change.answer;
  WELLSPACE_RETURN_IF_ERROR(Commit(std::move(change), std::move(next)));
  Open_& open = open_[number];
  open.file = NextFile();
  open.points = log_->files().OpenPoints({.session = SessionName(number), .dimension = 3, .next = open.file});
  return absl::OkStatus();
}

absl::Status StoreLife::Upload(uint64_t number) {
  PointStore& store = *open_.at(number).points;
  LifeState next = state();
  LifeState::Session& session = next.sessions.at(number);
  std::vector<double> coordinates(3 * (1 + salt_ % 100));
  for (size_t i = 0; i < coordinates.size(); ++i) {
    coordinates[i] = static_cast<double>(salt_ * 1000 + i);
  }
  const auto give_up = [&](const absl::Status& status) {
    store.Truncate(session.state.points() * 3);
    return status;
  };
  for (const size_t cut : {size_t{0}, coordinates.size() / 2}) {
    const size_t end = cut == 0 ? coordinates.size() / 2 : coordinates.size();
    if (absl::Status status = store.Append({coordinates.data() + cut, end - cut}); !status.ok()) {
      return give_up(status);
    }
  }
  if (salt_ % 5 == 0) {
    return give_up(absl::OkStatus());  // the upload breaks off
  }
  if (absl::Status status = store.Synchronize(); !status.ok()) {
    return give_up(status);
  }
  SessionChange change{.session = SessionName(number)};
  change.steps = {MakePointsStep(session.state.points(), coordinates, 3)};
  session.points.insert(session.points.end(), coordinates.begin(), coordinates.end());
  NameFile(open_.at(number).file, session.state);
  session.state.set_points(session.points.size() / 3);
  session.state.set_revision(salt_);
  session.steps.push_back(change.steps[0]);
  change.state = session.state;
  const uint64_t before = state().sessions.at(number).state.points();
  const absl::Status status = Commit(std::move(change), std::move(next));
  if (!status.ok()) {
    store.Truncate(before * 3);
  }
  return status;
}

absl::Status StoreLife::Remove(uint64_t number) {
  LifeState next = state();
  LifeState::Session& session = next.sessions.at(number);
  const store::v1::PointsFile file = NextFile();
  std::vector<store::v1::PointsFile> dropped = {file};
  std::unique_ptr<PointStore> store =
      log_->files().OpenPoints({.session = SessionName(number), .dimension = 3, .next = file});
  std::vector<double> kept;
  for (size_t i = 0; i < session.points.size(); i += 3) {
    if (i / 3 % 4 != salt_ % 4) {
      kept.insert(kept.end(), session.points.begin() + i, session.points.begin() + i + 3);
    }
  }
  const auto make = [&]() -> absl::Status {
    WELLSPACE_RETURN_IF_ERROR(store->Append(kept));
    WELLSPACE_RETURN_IF_ERROR(store->Synchronize());
    if (salt_ % 5 == 0) {
      return absl::OkStatus();  // no change names it
    }
    SessionChange change{.session = SessionName(number)};
    change.steps.emplace_back().mutable_removed();
    if (!kept.empty()) {
      change.steps.push_back(MakePointsStep(0, kept, 3));
    }
    session.steps.insert(session.steps.end(), change.steps.begin(), change.steps.end());
    session.points = kept;
    session.state.set_points(kept.size() / 3);
    session.state.set_points_file(salt_);
    session.state.clear_points_files();
    if (!kept.empty()) {
      *session.state.add_points_files() = file;
    }
    session.state.set_revision(salt_);
    change.state = session.state;
    std::vector<store::v1::PointsFile> before = PointsFilesOf(state().sessions.at(number).state);
    WELLSPACE_RETURN_IF_ERROR(Commit(std::move(change), std::move(next)));
    std::swap(store, open_.at(number).points);
    dropped = std::move(before);
    dropped.push_back(std::exchange(open_.at(number).file, file));
    return absl::OkStatus();
  };
  const absl::Status status = make();
  store = nullptr;
  for (const store::v1::PointsFile& one : dropped) {
    log_->files().DropPoints(SessionName(number), one);
  }
  return status;
}

absl::Status StoreLife::Succeed(uint64_t number) {
  LifeState next = state();
  LifeState::Session& session = next.sessions.at(number);
  const MeshShape shape{.vertices = static_cast<uint32_t>(3 + salt_ % 40),
                        .simplices = static_cast<uint32_t>(salt_ % 50),
                        .has_weights = salt_ % 3 == 0,
                        .has_moved = salt_ % 2 == 0,
                        .salt = static_cast<uint32_t>(salt_)};
  // Of a revision that an operation without success may have had, too.
  const uint64_t revision = session.state.mesh().revision() + 1;
  WELLSPACE_ASSIGN_OR_RETURN(const std::shared_ptr<MeshSnapshot> mesh,
                             log_->files().KeepMesh(SessionName(number), revision, log_->records().epoch(),
                                                    MakeMesh(shape), core::RunContext()));
  if (salt_ % 4 == 0) {
    mesh->MakeObsolete();  // no change names it
    return absl::OkStatus();
  }
  SessionChange change{.session = SessionName(number)};
  change.steps.emplace_back().mutable_refined()->set_points(session.state.points());
  change.operations.emplace_back().set_number(1);
  change.operations.back().set_mesh_revision(salt_);
  session.steps.push_back(change.steps[0]);
  session.operations[1] = change.operations[0];
  *session.state.mutable_mesh() = mesh->record();
  session.mesh = shape;
  change.state = session.state;
  const absl::Status status = Commit(std::move(change), std::move(next));
  if (status.ok()) {
    std::shared_ptr<MeshSnapshot>& last = open_.at(number).mesh;
    if (last != nullptr) {
      last->MakeObsolete();
    }
    last = mesh;
  } else {
    mesh->MakeObsolete();
  }
  return status;
}

absl::Status StoreLife::Change(uint64_t number, Action action) {
  LifeState next = state();
  LifeState::Session& session = next.sessions.at(number);
  SessionChange change{.session = SessionName(number)};
  auto survives = Survives::kPowerLoss;
  if (action == Action::kUpdate || action == Action::kTouch) {
    (*session.state.mutable_labels())["label"] = absl::StrCat(salt_);
    survives = action == Action::kTouch ? Survives::kProcessDeath : survives;
  } else if (action == Action::kAddFeatures) {
    store::v1::StepRecord& step = change.steps.emplace_back();
    const bool is_segment = salt_ % 2 == 0;
    for (uint64_t corner = 0; corner < (is_segment ? 2 : 3); ++corner) {
      (is_segment ? step.mutable_features()->mutable_segments()->mutable_ends()
                  : step.mutable_features()->mutable_triangles()->mutable_corners())
          ->Add(static_cast<uint32_t>(salt_ + corner));
    }
    session.steps.push_back(step);
    session.state.set_segments(session.state.segments() + (is_segment ? 1 : 0));
    session.state.set_triangles(session.state.triangles() + (is_segment ? 0 : 1));
  } else if (action == Action::kSetSizes) {
    // The second set before this one goes.
    change.sizes = StoredSizes{.number = salt_, .parts = {}};
    for (int part = 0; part < 2; ++part) {
      change.sizes->parts.emplace_back().mutable_samples()->add_sizes(static_cast<double>(salt_) + part);
    }
    if (session.sizes.size() > 1) {
      change.dropped_sizes = {session.sizes.begin()->first};
      session.sizes.erase(session.sizes.begin());
    }
    session.sizes[salt_] = *change.sizes;
    session.state.set_sizes(salt_);
    session.state.set_size_count(2);
  } else if (action == Action::kStart || action == Action::kFail) {
    store::v1::OperationRecord& operation = change.operations.emplace_back();
    operation.set_number(salt_ % 5);
    operation.set_create_time_ns(static_cast<int64_t>(salt_));
    session.operations[operation.number()] = operation;
    if (action == Action::kFail) {
      change.dropped_operations = {(salt_ + 1) % 5};
      session.operations.erase((salt_ + 1) % 5);
    }
  } else if (action == Action::kDelete) {
    change.is_deletion = true;
    next.sessions.erase(number);
  }
  if (action != Action::kDelete) {
    session.state.set_revision(salt_);
    change.state = session.state;
  }
  if (action != Action::kTouch) {
    change.answer = NextAnswer();
    next.answers[{"tenant", change.answer->request_id()}] = *change.answer;
  }
  const absl::Status status = Commit(std::move(change), std::move(next), survives);
  if (status.ok() && action == Action::kDelete) {
    log_->files().DropPoints(SessionName(number), open_.at(number).file);
    open_.erase(number);
  }
  return status;
}

absl::Status StoreLife::Commit(SessionChange change, LifeState next, Survives survives) {
  for (const auto& answer : forgotten_) {
    next.answers.erase(answer);
  }
  for (auto& [number, session] : next.sessions) {
    if (SessionName(number) == change.session) {
      WELLSPACE_ASSIGN_OR_RETURN(session.applied, Apply(session.applied, change));
    }
  }
  states_.push_back(std::move(next));
  const absl::Status status = CommitToLog(std::move(change), survives);
  if (status.ok()) {
    forgotten_.clear();
    Acknowledge(survives);
  } else if (status.code() == absl::StatusCode::kResourceExhausted) {
    states_.pop_back();  // nothing has changed
  }
  return status;
}

void StoreLife::Acknowledge(Survives survives) {
  ++acknowledgments_;
  acknowledged_ = states_.size() - 1;
  if (survives == Survives::kPowerLoss) {
    durable_acknowledged_ = acknowledged_;
  }
}

absl::Status StoreLife::CommitToLog(SessionChange change, Survives survives) {
  change.epoch = log_->records().epoch();
  if (bugs_.answers_before_commit) {
    if (late_.has_value()) {
      WELLSPACE_RETURN_IF_ERROR(log_->Commit(late_->first, late_->second));
    }
    late_ = {std::move(change), survives};
    return absl::OkStatus();
  }
  if (bugs_.answers_in_another_transaction && change.answer.has_value()) {
    SessionChange answer{.session = change.session, .epoch = change.epoch, .answer = std::move(change.answer)};
    change.answer.reset();
    WELLSPACE_RETURN_IF_ERROR(log_->Commit(change, survives));
    return log_->Commit(answer, survives);
  }
  return log_->Commit(change, survives);
}

std::string StoreLife::Restart(SimulatedDisk::Loss loss, test::SplitMix64& random) {
  // Whatever the ends of its objects do no longer reaches the disk.
  if (!disk_.is_dead()) {
    disk_.DieAt(disk_.operations());
  }
  Close();
  while (true) {
    disk_.Restart(loss, random.Next());
    const bool crashes_again = random.Below(3) == 0;
    if (crashes_again) {
      disk_.DieAt(disk_.operations() + random.Below(30));
    }
    const absl::Status opened = Open();
    if (opened.ok() && !disk_.is_dead()) {
      break;
    }
    if (!disk_.is_dead()) {
      return absl::StrCat("the log cannot be opened: ", opened.ToString());
    }
    Close();
  }
  disk_.DieAt(UINT64_MAX);
  const std::string problem = FindState(loss == SimulatedDisk::Loss::kProcess ? acknowledged_ : durable_acknowledged_);
  return problem.empty() ? Check() : problem;
}

// Takes the state that was found for the only one.
std::string StoreLife::FindState(size_t least) {
  const auto stored = log_->records().Load();
  if (!stored.ok()) {
    return absl::StrCat("the records cannot be read: ", stored.status().ToString());
  }
  const std::string found = TextOf(*stored);
  for (size_t i = least; i < states_.size(); ++i) {
    if (TextOf(states_[i]) == found) {
      states_ = {LifeState(states_[i])};
      acknowledged_ = 0;
      durable_acknowledged_ = 0;
      for (const auto& [number, session] : states_[0].sessions) {
        std::vector<store::v1::StepRecord::Points> committed;
        for (const store::v1::StepRecord& step : session.steps) {
          if (step.has_removed()) {
            committed.clear();
          }
          if (step.has_points()) {
            committed.push_back(step.points());
          }
        }
        Open_& open = open_[number];
        open.file = NextFile();
        open.points = log_->files().OpenPoints({.session = SessionName(number),
                                                .dimension = 3,
                                                .files = PointsFilesOf(session.state),
                                                .committed = committed,
                                                .next = open.file});
        open_[number].mesh = log_->files().FindMesh(session.state);
      }
      return "";
    }
  }
  return absl::StrCat("found is\n", found, "which is none of ", states_.size() - least,
                      " states, of which the first is\n", TextOf(states_[least]), "and the last is\n",
                      TextOf(states_.back()));
}

std::string StoreLife::Check() {
  const auto stored = log_->records().Load();
  if (!stored.ok()) {
    return absl::StrCat("the records cannot be read: ", stored.status().ToString());
  }
  if (TextOf(*stored) != TextOf(states_[acknowledged_])) {
    return absl::StrCat("there is\n", TextOf(*stored), "and there should be\n", TextOf(states_[acknowledged_]));
  }
  const std::string problem = CheckFiles(states_[acknowledged_], *stored);
  return problem.empty() ? CheckFolder(states_[acknowledged_]) : problem;
}

std::string StoreLife::CheckWhole() {
  Close();
  const auto report =
      CheckData(kFolder, {.files = &disk_.files(), .tables = {.vfs = disk_.vfs(), .is_exclusive = true}});
  if (!report.ok() || !report->is_whole()) {
    return absl::StrCat("check-data: ", report.status().ToString(), report.ok() ? report->problems[0] : "");
  }
  if (const absl::Status opened = Open(); !opened.ok()) {
    return opened.ToString();
  }
  return FindState(acknowledged_);
}

std::string StoreLife::CheckFiles(const LifeState& expected, const StoredSessions& stored) {
  const core::RunContext context;
  for (const StoredSession& found : stored.sessions) {
    const auto& [number, session] = *std::ranges::find_if(
        expected.sessions, [&](const auto& entry) { return SessionName(entry.first) == found.state.name(); });
    const absl::StatusOr<SessionState> again = StateOf(found);
    if (!again.ok() || TextOf(*again) != TextOf(session.applied)) {
      return absl::StrCat("the state of ", found.state.name(), ": ", again.status().ToString());
    }
    const auto features = log_->records().ReadFeatures(found.state.name());
    if (!features.ok() || TextOfFeatures(*features) != TextOfFeatures(FeaturesOf(session))) {
      return absl::StrCat("features of ", found.state.name(), ": ", features.status().ToString());
    }
    const auto sizes = log_->records().ReadSizes(found.state.name());
    if (!sizes.ok() || TextOfSizes(*sizes) != TextOfSizes(SizesOf(session))) {
      return absl::StrCat("sizes of ", found.state.name(), ": ", sizes.status().ToString());
    }
    const auto points = open_.at(number).points->Copy(0, session.points.size(), context);
    if (!points.ok() || *points != session.points) {
      return absl::StrCat("points of ", found.state.name(), ": ", points.status().ToString());
    }
    if (!session.mesh.has_value()) {
      continue;
    }
    const auto mesh = DownloadOf(*log_->files().FindMesh(found.state), true);
    const auto loaded = log_->files().FindMesh(found.state)->Load(context);
    const core::Mesh made = MakeMesh(*session.mesh);
    if (!mesh.ok() || !loaded.ok() || loaded->points != made.points || loaded->simplices != made.simplices) {
      return absl::StrCat("the mesh of ", found.state.name(), ": ", mesh.status().ToString());
    }
  }
  return "";
}

std::string StoreLife::CheckFolder(const LifeState& expected) {
  const auto sweep = log_->RemoveGarbage();
  if (!sweep.ok() || !sweep->unknown.empty()) {
    return absl::StrCat("garbage: ", sweep.status().ToString(), sweep.ok() ? sweep->unknown[0] : "");
  }
  const DataPaths paths{kFolder};
  for (const std::string& name : disk_.List(paths.files())) {
    bool is_named = false;
    for (const auto& [number, session] : expected.sessions) {
      std::vector<std::string> named = FilesOf(paths, session.state);
      named.push_back(paths.points(session.state.name(), open_.at(number).file));
      is_named |= std::ranges::find(named, paths.files() + "/" + name) != named.end();
    }
    if (!is_named) {
      return absl::StrCat("a file too many: ", name);
    }
  }
  return "";
}

}  // namespace wellspace::server
