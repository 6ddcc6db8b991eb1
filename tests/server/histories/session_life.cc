#include "tests/server/histories/session_life.h"

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "server/store/check_data.h"
#include "server/store/data_folder.h"
#include "tests/server/histories/session_life_calls.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

constexpr int kMostDeaths = 3;  // in the work of one operation

using State = KnownOperation::State;

std::string NameOf(State state) {
  constexpr std::array kNames = {"under way", "succeeded", "failed", "cancelled"};
  return kNames[static_cast<size_t>(state)];
}

State StateOf(const v1::Operation& operation) {
  switch (operation.state()) {
    case v1::Operation::STATE_SUCCEEDED:
      return State::kSucceeded;
    case v1::Operation::STATE_FAILED:
      return State::kFailed;
    case v1::Operation::STATE_CANCELLED:
      return State::kCancelled;
    default:
      return State::kUnderWay;
  }
}

std::string TextOf(const KnownOperation& operation) {
  return absl::StrCat(" ", operation.number, ":", NameOf(operation.state), ":", operation.mesh_revision);
}

std::string TextOf(const v1::Session& session, const v1::ListOperationsResponse& operations) {
  std::string text = absl::StrCat(session.labels().at(kLabel), " ttl ", session.ttl().seconds(), " revision ",
                                  session.revision(), " points ", session.committed_points(), " segments ",
                                  session.segment_count(), " triangles ", session.triangle_count(), " sizes ",
                                  session.size_count(), " ", v1::Session::State_Name(session.state()), " operations");
  for (const v1::Operation& operation : operations.operations()) {
    KnownOperation seen{.state = StateOf(operation), .mesh_revision = operation.mesh_revision()};
    (void)absl::SimpleAtoi(operation.name().substr(operation.name().rfind('/') + 1), &seen.number);
    absl::StrAppend(&text, TextOf(seen));
  }
  return absl::StrCat(text, "\n");
}

std::string TextOf(const KnownSession& session) {
  std::string text = absl::StrCat(session.label, " ttl ", session.ttl_seconds, " revision ", session.revision,
                                  " points ", session.point_count(), " segments ", session.segment_ends.size() / 2,
                                  " triangles ", session.triangles, " sizes ", session.size_count(), " ",
                                  session.IsBusy()   ? "STATE_REFINING"
                                  : session.is_ready ? "STATE_READY"
                                                     : "STATE_OPEN",
                                  " operations");
  for (const KnownOperation& operation : session.operations) {
    absl::StrAppend(&text, TextOf(operation));
  }
  return absl::StrCat(text, "\n");
}

// The world in which operations that have killed enough processes are given up.
World GivenUp(World world) {
  for (auto& [number, session] : world) {
    for (KnownOperation& operation : session.operations) {
      if (operation.state == State::kUnderWay && operation.deaths >= kMostDeaths) {
        operation.state = State::kFailed;
      }
    }
  }
  return world;
}

bool HasRequestId(Step step) {
  return step == Step::kCreate || step == Step::kUpdate || step == Step::kRemovePoints || step == Step::kRefine ||
         step == Step::kAddVertices || step == Step::kDelete;
}

}  // namespace

bool KnownSession::IsBusy() const {
  return std::ranges::any_of(operations,
                             [](const KnownOperation& operation) { return operation.state == State::kUnderWay; });
}

std::string TextOf(const World& world) {
  std::string text;
  for (const auto& [number, session] : world) {
    text += TextOf(session);
  }
  return text;
}

std::string SessionLife::Start() {
  const absl::Status started = server_.Start();
  return started.ok() || disk_.is_dead() ? "" : absl::StrCat("the server does not start: ", started.ToString());
}

std::string SessionLife::DoAnything(test::SplitMix64& random) {
  // Points, and work on them, more often than steps that take all away.
  constexpr std::array kSteps = {
      Step::kUpload,
      Step::kUpload,
      Step::kBrokenUpload,
      Step::kRemovePoints,
      Step::kAddFeatures,
      Step::kSetSizes,
      Step::kUpdate,
      Step::kRefine,
      Step::kRefine,
      Step::kRefine,
      Step::kWork,
      Step::kWork,
      Step::kWork,
      Step::kCancel,
      Step::kAddVertices,
      Step::kAddVertices,
      Step::kDelete,
      Step::kExpire,
      Step::kSweep,
      Step::kRefineBesideUpload,
      Step::kAddVerticesBesideUpload,
      Step::kRepeat,
      Step::kRepeat,
  };
  const auto number = static_cast<int>(random.Below(kSessions));
  return Do(world_.contains(number) ? kSteps[random.Below(kSteps.size())] : Step::kCreate, number, random);
}

std::string SessionLife::Do(Step step, int number, test::SplitMix64& random) {
  ++salt_;
  if (step == Step::kWork) {
    return Work();
  }
  if (step == Step::kSweep) {
    server_.Begin(step);
    server_.Sweep();
    server_.EndStep();
    return "";
  }
  if (step == Step::kExpire) {
    repeated_.reset();  // answers are forgotten after a while
    return Expire(number);
  }
  if (step == Step::kRepeat) {
    return Repeat();
  }
  std::optional<Change> change = ChangeOf(step, number, random);
  return change.has_value() ? Make(*std::move(change)) : "";
}

std::string SessionLife::Make(Change change) {
  server_.Begin(change.step);
  World after = change.after;
  bool is_answered = false;
  const std::string problem = change.call(&after, &is_answered);
  server_.EndStep();
  if (!problem.empty()) {
    return problem;
  }
  if (change.step == Step::kBrokenUpload && !disk_.is_dead()) {
    is_answered = true;  // the client is gone; others see the outcome
  }
  if (is_answered) {
    if (HasRequestId(change.step)) {
      repeated_ = change;
    }
    world_ = std::move(after);
    unanswered_.reset();
    return disk_.is_dead() || is_planted_ ? "" : server_.CheckStates();
  }
  if (!disk_.is_dead()) {
    return "a call is not answered";
  }
  unanswered_ = std::move(change);
  return "";
}

// The answer may have been lost on its way. The change must not be made again, whatever has come since.
std::string SessionLife::Repeat() {
  // The job of an addition would come behind those of operations, whose ends would be no step of their own.
  const auto is_busy = [](const auto& known) { return known.second.IsBusy(); };
  if (!repeated_.has_value() || (repeated_->step == Step::kAddVertices && std::ranges::any_of(world_, is_busy))) {
    return "";
  }
  server_.Begin(Step::kRepeat);
  World after = repeated_->after;
  bool is_answered = false;
  const std::string problem = repeated_->call(&after, &is_answered);
  server_.EndStep();
  if (!problem.empty() || disk_.is_dead()) {
    return problem;
  }
  return is_answered ? Find() : "a call that is repeated is not answered";
}

std::string SessionLife::Expire(int number) {
  if (!world_.contains(number)) {
    return "";
  }
  const std::string problem = Make(UpdateOf(number, kShortTtl));
  if (!problem.empty() || disk_.is_dead()) {
    return problem;
  }
  std::vector<World> worlds = {world_};
  for (const auto& [expiring, session] : world_) {
    if (session.ttl_seconds == kShortTtl && !session.IsBusy()) {
      for (size_t i = 0, count = worlds.size(); i < count; ++i) {
        worlds.push_back(worlds[i]);
        worlds.back().erase(expiring);
      }
    }
  }
  server_.Begin(Step::kExpire);
  server_.Pass(absl::Seconds(kShortTtl + 2));
  server_.EndStep();
  if (disk_.is_dead()) {
    candidates_ = std::move(worlds);
  } else {
    world_ = worlds.back();
  }
  return "";
}

World SessionLife::Succeeded(int number) const {
  World after = world_;
  KnownSession& session = after.at(number);
  KnownOperation& operation = session.operations.back();
  operation.state = State::kSucceeded;
  operation.mesh_revision = ++session.revision;
  session.mesh_revision = session.revision;
  session.mesh.clear();
  session.is_ready = true;
  session.has_structure = true;
  return after;
}

std::string SessionLife::EndWork(int number, const v1::Operation& ended) {
  if (ended.state() != v1::Operation::STATE_SUCCEEDED) {
    return absl::StrCat(ended.name(), " ends with ", ended.error().message());
  }
  World after = Succeeded(number);
  if (ended.mesh_revision() != after.at(number).mesh_revision) {
    return absl::StrCat(ended.name(),
                        Differs(": its mesh_revision", ended.mesh_revision(), after.at(number).mesh_revision));
  }
  world_ = std::move(after);
  return "";
}

std::string SessionLife::Work() {
  std::vector<int> busy;
  for (const auto& [number, session] : world_) {
    if (session.IsBusy()) {
      busy.push_back(number);
    }
  }
  if (busy.empty()) {
    return "";
  }
  while (!disk_.is_dead()) {
    server_.Begin(Step::kWork);
    const bool has_run = server_.RunJob();
    server_.EndStep();
    if (!has_run) {
      return "an operation is under way, and nothing works at it";
    }
    for (const int number : busy) {
      const KnownSession& session = world_.at(number);
      const auto ended = server_.EndOf(OperationName(session, session.operations.back().number));
      if (ended.has_value()) {
        const std::string problem = EndWork(number, *ended);
        return !problem.empty() || disk_.is_dead() ? problem : CheckMesh(world_.at(number));
      }
    }
    // It was the job of an operation that had been cancelled, or was deleted with its session.
  }
  for (const int number : busy) {
    ++world_.at(number).operations.back().deaths;
  }
  for (const int number : busy) {
    candidates_.push_back(Succeeded(number));
  }
  return "";
}

std::string SessionLife::Restart(SimulatedDisk::Loss loss, test::SplitMix64& random) {
  if (!disk_.is_dead()) {
    disk_.DieAt(disk_.operations());
  }
  server_.Kill();
  while (true) {
    disk_.Restart(loss, random.Next());
    if (random.Below(3) == 0) {
      disk_.DieAt(disk_.operations() + random.Below(40));
    }
    const absl::Status started = server_.Start();
    if (started.ok() && !disk_.is_dead()) {
      break;
    }
    if (!disk_.is_dead()) {
      return absl::StrCat("the server does not start: ", started.ToString());
    }
    server_.Kill();
  }
  disk_.DieAt(UINT64_MAX);
  std::string problem = Find();
  if (problem.empty() && !is_planted_) {
    problem = server_.CheckStates();
  }
  if (problem.empty()) {
    problem = CheckContents();
  }
  if (problem.empty() && unanswered_.has_value()) {
    Change again = *std::move(unanswered_);
    problem = Make(std::move(again));
    candidates_.clear();
    if (problem.empty()) {
      problem = Find();
    }
  }
  return problem;
}

std::string SessionLife::Look(std::string* problem) {
  const auto listed = server_.List();
  if (!listed.is_ok) {
    *problem = ErrorOf("ListSessions", listed);
    return "";
  }
  std::map<int, std::string> texts;
  for (const v1::Session& session : listed.response.sessions()) {
    const auto operations = server_.ListOperations(session.name());
    const auto label = session.labels().find(kLabel);
    int number = 0;
    if (!operations.is_ok || label == session.labels().end() ||
        !absl::SimpleAtoi(label->second.substr(0, label->second.find('.')), &number)) {
      *problem = absl::StrCat(session.name(), " has come from nowhere ", ErrorOf("ListOperations", operations));
      return "";
    }
    texts[number] += TextOf(session, operations.response);
    names_[number] = session.name();
  }
  std::string text;
  for (const auto& [number, one] : texts) {
    text += one;
  }
  return text;
}

std::string SessionLife::Find() {
  std::string problem;
  const std::string found = Look(&problem);
  if (!problem.empty()) {
    return problem;
  }
  std::vector<World> worlds = {world_};
  worlds.insert(worlds.end(), candidates_.begin(), candidates_.end());
  if (unanswered_.has_value()) {
    worlds.push_back(unanswered_->after);
  }
  candidates_.clear();
  for (const World& world : worlds) {
    for (World& may_be : std::array{world, GivenUp(world)}) {
      if (TextOf(may_be) == found) {
        world_ = std::move(may_be);
        return TakeNames();
      }
    }
  }
  return absl::StrCat("found is\n", found, "which is none of ", worlds.size(), ", of which the first is\n",
                      TextOf(worlds.front()), "and the last is\n", TextOf(worlds.back()));
}

std::string SessionLife::TakeNames() {
  for (auto& [number, session] : world_) {
    if (!session.name.empty() && session.name != names_.at(number)) {
      return absl::StrCat(session.name, " has become ", names_.at(number));
    }
    session.name = names_.at(number);
    if (session.IsBusy()) {
      server_.Watch(OperationName(session, session.operations.back().number));
    }
  }
  return "";
}

std::string SessionLife::CheckMesh(KnownSession& session) {
  const auto download = server_.Download(session.name);
  if (!download.is_ok) {
    return ErrorOf("DownloadMesh", download);
  }
  if (session.mesh.empty()) {
    session.mesh = download.response;
  }
  return session.mesh == download.response ? "" : absl::StrCat("the mesh of ", session.name, " is another");
}

std::string SessionLife::CheckInputs(const KnownSession& session) {
  const auto points = server_.Upload({UploadRequest(session.name, 0, session.points)});
  if (!points.is_ok) {
    return ErrorOf("UploadPoints", points);
  }
  std::string problem = Differs("the revision after points again", points.response.revision(), session.revision);
  if (!session.segment_ends.empty()) {
    const auto segments = server_.AddSegments(SegmentsRequestOf(session, 0));
    absl::StrAppend(&problem, segments.is_ok ? Differs("the revision after segments again",
                                                       segments.response.revision(), session.revision)
                                             : ErrorOf("AddSegments", segments));
  }
  if (session.triangles > 0) {
    const auto triangles = server_.AddTriangles(TrianglesRequestOf(session, 0));
    absl::StrAppend(&problem, triangles.is_ok ? Differs("the revision after triangles again",
                                                        triangles.response.revision(), session.revision)
                                              : ErrorOf("AddTriangles", triangles));
  }
  const auto sizes = server_.SetSizes(SizesRequestOf(session));
  absl::StrAppend(&problem, sizes.is_ok
                                ? Differs("the revision after sizes again", sizes.response.revision(), session.revision)
                                : ErrorOf("SetSizes", sizes));
  return problem;
}

std::string SessionLife::CheckContents() {
  for (auto& [number, session] : world_) {
    std::string problem = session.mesh_revision == 0 ? "" : CheckMesh(session);
    if (problem.empty() && !session.IsBusy()) {
      problem = CheckInputs(session);
    }
    if (!problem.empty()) {
      return absl::StrCat("session ", number, ": ", problem);
    }
  }
  return CheckFolder();
}

std::string SessionLife::CheckFolder() {
  const DataPaths paths{SimulatedServer::kFolder};
  const absl::StatusOr<Census> census = server_.ReadCensus();
  if (!census.ok()) {
    return census.status().ToString();
  }
  std::set<std::string> named;
  std::set<std::string> may_be_begun;      // where points are appended that no record names yet
  std::set<std::string> may_have_earlier;  // sessions with a mesh, of which the process may keep the one before
  for (const store::v1::SessionRecord& session : census->sessions) {
    const std::vector<std::string> files = FilesOf(paths, session);
    named.insert(files.begin(), files.end());
    const std::string id = session.name().substr(session.name().find('/') + 1);
    if (session.has_mesh()) {
      may_have_earlier.insert(id);
    }
    const std::vector<store::v1::PointsFile> points = PointsFilesOf(session);
    if (points.empty() || points.back().epoch() < census->oldest_epoch) {
      may_be_begun.insert(id);
    }
  }
  for (const std::string& name : disk_.List(paths.files())) {
    const bool is_begun = EpochOfName(name) == census->oldest_epoch && name.find(".points") != std::string::npos &&
                          may_be_begun.erase(name.substr(0, name.find('.'))) > 0;
    if (is_begun || named.contains(absl::StrCat(paths.files(), "/", name))) {
      continue;
    }
    const bool is_earlier = name.find(".mesh-") != std::string::npos &&
                            may_have_earlier.erase(name.substr(0, name.find('.'))) > 0;  // one at most
    if (!is_earlier) {
      return absl::StrCat("a file too many: ", name);
    }
  }
  return "";
}

std::string SessionLife::CheckWhole() {
  const auto is_busy = [](const auto& known) { return known.second.IsBusy(); };
  while (std::ranges::any_of(world_, is_busy)) {
    if (std::string problem = Work(); !problem.empty()) {
      return problem;
    }
  }
  while (server_.RunJob()) {  // of operations that were cancelled, whose sessions have files until then
  }
  server_.EndStep();
  std::string problem = Find();
  if (problem.empty()) {
    problem = CheckContents();
  }
  if (!problem.empty()) {
    return problem;
  }
  disk_.DieAt(disk_.operations());
  server_.Kill();
  disk_.Restart(SimulatedDisk::Loss::kProcess, 0);
  const auto report = CheckData(SimulatedServer::kFolder,
                                {.files = &disk_.files(), .tables = {.vfs = disk_.vfs(), .is_exclusive = true}});
  return report.ok() && report->is_whole()
             ? ""
             : absl::StrCat("check-data: ", report.status().ToString(), report.ok() ? report->problems[0] : "");
}

}  // namespace wellspace::server
