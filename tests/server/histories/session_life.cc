#include "tests/server/histories/session_life.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "server/store/check_data.h"
#include "server/store/data_folder.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

constexpr int64_t kShortTtl = 60;  // seconds; sessions that have it expire with the next Step::kExpire
constexpr size_t kMostPoints = 40;
constexpr size_t kMostSegments = 3;
constexpr int kMostDeaths = 3;  // in the work of one operation
constexpr char kLabel[] = "client";

using State = KnownOperation::State;

// What is wrong with a call that came back with an error while its server lived.
template <typename Response>
std::string ErrorOf(const char* call, const Answered<Response>& answered) {
  return answered.error.has_value() ? absl::StrCat(call, " ends with ", answered.error->error_message()) : "";
}

std::string Differs(const char* what, uint64_t found, uint64_t expected) {
  return found == expected ? "" : absl::StrCat(what, " is ", found, ", and should be ", expected);
}

constexpr int kRows = 32;

// Within the unit square, two in a row.
std::array<double, 2> PointOf(size_t number, test::SplitMix64& random) {
  const auto row = static_cast<double>(number / 2 % kRows);
  return {0.1 + 0.8 * random.Unit(), 0.1 + 0.8 * (row + 0.2 + 0.6 * random.Unit()) / kRows};
}

int RowOf(const KnownSession& session, size_t point) {
  return static_cast<int>((session.points[2 * point + 1] - 0.1) / 0.8 * kRows);
}

// Whether there may be a segment of the next two points: it crosses none if each has a row for itself.
bool HasNextSegment(const KnownSession& session) {
  const size_t first = session.segment_ends.size();
  if (session.mesh_revision != 0 || first / 2 >= kMostSegments || session.points.size() / 2 < first + 2) {
    return false;
  }
  const int row = RowOf(session, first);
  return RowOf(session, first + 1) == row &&
         std::ranges::none_of(session.segment_ends, [&](uint32_t end) { return RowOf(session, end) == row; });
}

std::vector<double> PointsFrom(size_t first, size_t count, test::SplitMix64& random) {
  std::vector<double> points;
  for (size_t i = 0; i < count; ++i) {
    const std::array<double, 2> point = PointOf(first + i, random);
    points.insert(points.end(), point.begin(), point.end());
  }
  return points;
}

v1::SetSizesRequest SizesRequestOf(const KnownSession& session) {
  v1::SetSizesRequest request;
  request.set_name(session.name);
  for (size_t i = 0; i < session.sizes.size(); i += 3) {
    request.mutable_samples()->add_points(session.sizes[i]);
    request.mutable_samples()->add_points(session.sizes[i + 1]);
    request.mutable_samples()->add_sizes(session.sizes[i + 2]);
  }
  return request;
}

// Those from number `first` on.
v1::AddSegmentsRequest SegmentsRequestOf(const KnownSession& session, size_t first) {
  v1::AddSegmentsRequest request;
  request.set_name(session.name);
  request.set_segment_offset(first);
  request.mutable_segments()->mutable_ends()->Add(session.segment_ends.begin() + static_cast<std::ptrdiff_t>(2 * first),
                                                  session.segment_ends.end());
  request.mutable_faces()->set_faces(v1::FACE_RULE_BOX);
  return request;
}

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
  std::string text =
      absl::StrCat(session.labels().at(kLabel), " ttl ", session.ttl().seconds(), " revision ", session.revision(),
                   " points ", session.committed_points(), " segments ", session.segment_count(), " sizes ",
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
                                  " points ", session.points.size() / 2, " segments ", session.segment_ends.size() / 2,
                                  " sizes ", session.sizes.size() / 3, " ",
                                  session.IsBusy()   ? "STATE_REFINING"
                                  : session.is_ready ? "STATE_READY"
                                                     : "STATE_OPEN",
                                  " operations");
  for (const KnownOperation& operation : session.operations) {
    absl::StrAppend(&text, TextOf(operation));
  }
  return absl::StrCat(text, "\n");
}

std::string OperationName(const KnownSession& session, uint64_t number) {
  return absl::StrCat(session.name, "/operations/", number);
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
  // Points, and what is made of them, more often than what takes all away.
  constexpr std::array kSteps = {
      Step::kUpload,
      Step::kUpload,
      Step::kBrokenUpload,
      Step::kRemovePoints,
      Step::kAddSegments,
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
    return Expire(number);
  }
  std::optional<Change> change = ChangeOf(step, number, random);
  return change.has_value() ? Make(*std::move(change)) : "";
}

std::optional<SessionLife::Change> SessionLife::ChangeOf(Step step, int number, test::SplitMix64& random) {
  const auto known = world_.find(number);
  if ((step == Step::kCreate) != (known == world_.end())) {
    return std::nullopt;
  }
  if (step == Step::kCreate) {
    return CreateOf(number);
  }
  const KnownSession& session = known->second;
  if (step == Step::kUpdate) {
    return UpdateOf(number, session.ttl_seconds);
  }
  if (step == Step::kDelete) {
    return DeleteOf(number);
  }
  if (step == Step::kCancel) {
    return session.IsBusy() ? std::optional(CancelOf(number)) : std::nullopt;
  }
  const size_t count = session.points.size() / 2;
  const size_t segments = session.segment_ends.size() / 2;
  if (session.IsBusy()) {
    return std::nullopt;
  }
  // An addition is a job behind those of operations, whose ends would be no step of their own.
  const bool may_add = session.has_structure && count < kMostPoints &&
                       std::ranges::none_of(world_, [](const auto& one) { return one.second.IsBusy(); });
  switch (step) {
    case Step::kUpload:
    case Step::kBrokenUpload:
      return count < kMostPoints ? std::optional(UploadOf(number, step == Step::kBrokenUpload, random)) : std::nullopt;
    case Step::kRemovePoints:
      return count > 2 * segments ? std::optional(RemovePointsOf(number, random)) : std::nullopt;
    case Step::kAddSegments:
      return HasNextSegment(session) ? std::optional(AddSegmentsOf(number)) : std::nullopt;
    case Step::kSetSizes:
      return SetSizesOf(number, random);
    case Step::kRefine:
      return count >= 3 ? std::optional(RefineOf(world_, number, session.mesh_revision != 0 && random.Below(3) == 0))
                        : std::nullopt;
    case Step::kAddVertices:
      return may_add ? std::optional(AddVerticesOf(world_, number, random)) : std::nullopt;
    case Step::kRefineBesideUpload:
    case Step::kAddVerticesBesideUpload:
      return count >= 3 && count < kMostPoints && (step == Step::kRefineBesideUpload || may_add)
                 ? std::optional(BesideUpload(step, number, random))
                 : std::nullopt;
    default:
      return std::nullopt;
  }
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
    is_answered = true;  // the client is gone; others see what has become of it
  }
  if (is_answered) {
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

SessionLife::Change SessionLife::CreateOf(int number) {
  v1::CreateSessionRequest request;
  *request.mutable_parameters() = UnitCubeParameters(2);
  KnownSession session;
  session.label = absl::StrCat(number, ".", salt_);
  (*request.mutable_labels())[kLabel] = session.label;
  request.mutable_ttl()->set_seconds(session.ttl_seconds);
  request.set_request_id(absl::StrCat("create ", salt_));
  World after = world_;
  after[number] = session;
  return {.step = Step::kCreate,
          .call =
              [this, number, request](World* known, bool* is_answered) {
                const auto answered = server_.Create(request);
                *is_answered = answered.is_ok;
                known->at(number).name = answered.response.session().name();
                return ErrorOf("CreateSession", answered);
              },
          .after = std::move(after)};
}

SessionLife::Change SessionLife::UpdateOf(int number, int64_t ttl_seconds) {
  World after = world_;
  KnownSession& session = after.at(number);
  session.label = absl::StrCat(number, ".", salt_);
  session.ttl_seconds = ttl_seconds;
  v1::UpdateSessionRequest request;
  request.mutable_session()->set_name(session.name);
  (*request.mutable_session()->mutable_labels())[kLabel] = session.label;
  request.mutable_session()->mutable_ttl()->set_seconds(ttl_seconds);
  request.set_request_id(absl::StrCat("update ", salt_));
  return {.step = Step::kUpdate,
          .call =
              [this, request](World* /*known*/, bool* is_answered) {
                const auto answered = server_.Update(request);
                *is_answered = answered.is_ok;
                return ErrorOf("UpdateSession", answered);
              },
          .after = std::move(after)};
}

SessionLife::Change SessionLife::UploadOf(int number, bool breaks_off, test::SplitMix64& random) {
  World after = world_;
  KnownSession& session = after.at(number);
  std::vector<v1::UploadPointsRequest> requests;
  for (uint64_t message = 0; message <= random.Below(3); ++message) {
    const size_t offset = session.points.size() / 2;
    const std::vector<double> points = PointsFrom(offset, 1 + random.Below(8), random);
    requests.push_back(UploadRequest(session.name, offset, points));
    session.points.insert(session.points.end(), points.begin(), points.end());
  }
  ++session.revision;
  session.is_ready = false;
  return {.step = breaks_off ? Step::kBrokenUpload : Step::kUpload,
          .call =
              [this, number, requests, breaks_off, is_again = false](World* known, bool* is_answered) mutable {
                // A client that comes again sends all to the end.
                const bool breaks = breaks_off && !std::exchange(is_again, true);
                const auto answered = server_.Upload(requests, breaks);
                if (breaks || !answered.is_ok) {
                  return breaks ? std::string() : ErrorOf("UploadPoints", answered);
                }
                *is_answered = true;
                const KnownSession& expected = known->at(number);
                return absl::StrCat(
                    Differs("committed_points", answered.response.committed_points(), expected.points.size() / 2),
                    Differs("revision", answered.response.revision(), expected.revision));
              },
          .after = std::move(after)};
}

SessionLife::Change SessionLife::RemovePointsOf(int number, test::SplitMix64& random) {
  World after = world_;
  KnownSession& session = after.at(number);
  const size_t least = session.segment_ends.size();  // segments are of the first points, two each
  v1::RemovePointsRequest request;
  request.set_name(session.name);
  request.set_request_id(absl::StrCat("remove ", salt_));
  std::vector<double> kept(session.points.begin(), session.points.begin() + static_cast<std::ptrdiff_t>(2 * least));
  const uint64_t always = least + random.Below(session.points.size() / 2 - least);
  for (uint64_t point = least; point < session.points.size() / 2; ++point) {
    if (point == always || random.Below(4) == 0) {
      request.add_points(point);
    } else {
      kept.insert(kept.end(), {session.points[2 * point], session.points[2 * point + 1]});
    }
  }
  session.points = std::move(kept);
  session.points_file = ++session.revision;
  session.is_ready = false;
  session.has_structure = false;
  return {.step = Step::kRemovePoints,
          .call =
              [this, number, request](World* known, bool* is_answered) {
                const auto answered = server_.RemovePoints(request);
                *is_answered = answered.is_ok;
                return answered.is_ok ? Differs("committed_points", answered.response.committed_points(),
                                                known->at(number).points.size() / 2)
                                      : ErrorOf("RemovePoints", answered);
              },
          .after = std::move(after)};
}

SessionLife::Change SessionLife::AddSegmentsOf(int number) {
  World after = world_;
  KnownSession& session = after.at(number);
  const auto first = static_cast<uint32_t>(session.segment_ends.size());
  session.segment_ends.insert(session.segment_ends.end(), {first, first + 1});
  ++session.revision;
  session.is_ready = false;
  return {.step = Step::kAddSegments,
          .call =
              [this, number, request = SegmentsRequestOf(session, first / 2)](World* known, bool* is_answered) {
                const auto answered = server_.AddSegments(request);
                *is_answered = answered.is_ok;
                return answered.is_ok ? Differs("revision", answered.response.revision(), known->at(number).revision)
                                      : ErrorOf("AddSegments", answered);
              },
          .after = std::move(after)};
}

SessionLife::Change SessionLife::SetSizesOf(int number, test::SplitMix64& random) {
  World after = world_;
  KnownSession& session = after.at(number);
  const bool had_none = session.sizes.empty();
  session.sizes.clear();
  const uint64_t count = had_none ? 1 + random.Below(3) : random.Below(3);
  for (uint64_t i = 0; i < count; ++i) {
    session.sizes.insert(session.sizes.end(), {random.Unit(), random.Unit(), 0.2 + 0.5 * random.Unit()});
  }
  v1::SetSizesRequest request = SizesRequestOf(session);
  // A client that makes the call again names the revision that was right the first time.
  if (count > 0) {
    request.set_expected_revision(session.revision);
  }
  ++session.revision;
  return {.step = Step::kSetSizes,
          .call =
              [this, number, request](World* known, bool* is_answered) {
                const auto answered = server_.SetSizes(request);
                *is_answered = answered.is_ok;
                return answered.is_ok ? Differs("revision", answered.response.revision(), known->at(number).revision)
                                      : ErrorOf("SetSizes", answered);
              },
          .after = std::move(after)};
}

SessionLife::Change SessionLife::RefineOf(World after, int number, bool restart) {
  KnownSession& session = after.at(number);
  const uint64_t operation = session.operations.size() + 1;
  session.operations.push_back({.number = operation, .restart = restart});
  v1::StartRefinementRequest request;
  request.set_name(session.name);
  request.set_restart(restart);
  request.set_request_id(absl::StrCat("refine ", salt_));
  return {.step = Step::kRefine,
          .call =
              [this, request, name = OperationName(session, operation)](World* /*known*/, bool* is_answered) {
                const auto answered = server_.Refine(request);
                *is_answered = answered.is_ok;
                if (!answered.is_ok) {
                  return ErrorOf("StartRefinement", answered);
                }
                if (answered.response.operation().name() != name) {
                  return absl::StrCat(answered.response.operation().name(), " was started, and not ", name);
                }
                server_.Watch(name);
                return std::string();
              },
          .after = std::move(after)};
}

SessionLife::Change SessionLife::BesideUpload(Step step, int number, test::SplitMix64& random) {
  World uploaded = world_;
  KnownSession& session = uploaded.at(number);
  const size_t offset = session.points.size() / 2;
  const std::vector<double> points = PointsFrom(offset, 1 + random.Below(8), random);
  session.points.insert(session.points.end(), points.begin(), points.end());
  session.is_ready = false;
  const std::vector requests = {UploadRequest(session.name, offset, points)};
  const bool refines = step == Step::kRefineBesideUpload;
  if (refines) {
    ++session.revision;  // of an addition, it grows with what is added
  }
  const Change beside =
      refines ? RefineOf(std::move(uploaded), number, false) : AddVerticesOf(std::move(uploaded), number, random);
  return {.step = step,
          .call =
              [this, requests, beside](World* known, bool* is_answered) {
                std::string problem;
                // Where the change was made before the server died, the upload comes too late.
                (void)server_.UploadBeside(requests, [&] { problem = beside.call(known, is_answered); });
                return problem;
              },
          .after = beside.after};
}

SessionLife::Change SessionLife::CancelOf(int number) {
  World after = world_;
  KnownSession& session = after.at(number);
  session.operations.back().state = State::kCancelled;
  return {
      .step = Step::kCancel,
      .call =
          [this, name = OperationName(session, session.operations.back().number)](World* /*known*/, bool* is_answered) {
            const auto answered = server_.CancelOperation(name);
            *is_answered = answered.is_ok;
            return ErrorOf("CancelOperation", answered);
          },
      .after = std::move(after)};
}

SessionLife::Change SessionLife::AddVerticesOf(World after, int number, test::SplitMix64& random) {
  KnownSession& session = after.at(number);
  const std::vector<double> points = PointsFrom(session.points.size() / 2, 1 + random.Below(3), random);
  v1::AddVerticesRequest request;
  request.set_name(session.name);
  request.mutable_points()->Assign(points.begin(), points.end());
  request.set_request_id(absl::StrCat("add ", salt_));
  session.points.insert(session.points.end(), points.begin(), points.end());
  ++session.revision;
  session.is_ready = false;
  return {.step = Step::kAddVertices,
          .call =
              [this, number, request](World* known, bool* is_answered) {
                const auto answered = server_.AddVertices(request);
                *is_answered = answered.is_ok;
                return answered.is_ok ? Differs("revision", answered.response.revision(), known->at(number).revision)
                                      : ErrorOf("AddVertices", answered);
              },
          .after = std::move(after)};
}

SessionLife::Change SessionLife::DeleteOf(int number) {
  World after = world_;
  v1::DeleteSessionRequest request;
  request.set_name(after.at(number).name);
  request.set_request_id(absl::StrCat("delete ", salt_));
  after.erase(number);
  return {.step = Step::kDelete,
          .call =
              [this, request](World* /*known*/, bool* is_answered) {
                const auto answered = server_.Delete(request);
                *is_answered = answered.is_ok;
                return ErrorOf("DeleteSession", answered);
              },
          .after = std::move(after)};
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
  std::vector<std::string> named;
  for (const auto& [number, session] : world_) {
    named.push_back(paths.points(session.name, session.points_file));
    if (session.mesh_revision != 0) {
      named.push_back(paths.mesh(session.name, session.mesh_revision));
    }
  }
  for (const std::string& name : disk_.List(paths.files())) {
    if (std::ranges::find(named, absl::StrCat(paths.files(), "/", name)) == named.end()) {
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
