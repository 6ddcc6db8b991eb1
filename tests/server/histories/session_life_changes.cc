// The changes that clients of SessionLife ask for.
#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "tests/server/histories/session_life.h"
#include "tests/server/histories/session_life_calls.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

constexpr size_t kMostPoints = 40;
constexpr size_t kMostSegments = 3;
constexpr size_t kBlockPoints = 8;
constexpr size_t kBlockTriangles = 12;

using State = KnownOperation::State;

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
  if (session.mesh_revision != 0 || first / 2 >= kMostSegments || session.point_count() < first + 2) {
    return false;
  }
  const int row = RowOf(session, first);
  return RowOf(session, first + 1) == row &&
         std::ranges::none_of(session.segment_ends, [&](uint32_t end) { return RowOf(session, end) == row; });
}

// Whether triangles of the block are left that may be added.
bool HasNextTriangle(const KnownSession& session) {
  return session.mesh_revision == 0 && session.triangles < kBlockTriangles && session.point_count() >= kBlockPoints;
}

// How many of the first points features are made of, or will be: these are not removed.
size_t KeptPoints(const KnownSession& session) {
  return session.dimension == 2 ? session.segment_ends.size() : kBlockPoints;
}

// `count` points behind those of `session`: of the block its corners before these.
std::vector<double> NextPoints(const KnownSession& session, size_t count, test::SplitMix64& random) {
  std::vector<double> points;
  if (session.dimension == 3) {
    points = session.points.empty() ? BlockPoints() : points;
    for (size_t i = 0; i < 3 * count; ++i) {
      points.push_back(0.8 * random.Unit() - 0.4);
    }
    return points;
  }
  for (size_t i = 0; i < count; ++i) {
    const std::array<double, 2> point = PointOf(session.point_count() + i, random);
    points.insert(points.end(), point.begin(), point.end());
  }
  return points;
}

// No points are added to the mesh of the block.
bool MustRestart(const KnownSession& session) { return session.dimension == 3 && session.mesh_revision != 0; }

bool MayRestart(const KnownSession& session, test::SplitMix64& random) {
  return MustRestart(session) || (session.mesh_revision != 0 && random.Below(3) == 0);
}

// Whether a mesh can be made of it.
bool IsComplete(const KnownSession& session) {
  return session.dimension == 2 ? session.point_count() >= 3 : session.triangles == kBlockTriangles;
}

}  // namespace

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
  const size_t count = session.point_count();
  if (session.IsBusy()) {
    return std::nullopt;
  }
  // An addition is a job behind those of operations, whose ends would be no step of their own. To the block none can be
  // made: it is begun anew with more points.
  const bool may_add = session.dimension == 2 && session.has_structure && count < kMostPoints &&
                       std::ranges::none_of(world_, [](const auto& one) { return one.second.IsBusy(); });
  switch (step) {
    case Step::kUpload:
    case Step::kBrokenUpload:
      return count < kMostPoints ? std::optional(UploadOf(number, step == Step::kBrokenUpload, random)) : std::nullopt;
    case Step::kRemovePoints:
      return count > KeptPoints(session) ? std::optional(RemovePointsOf(number, random)) : std::nullopt;
    case Step::kAddFeatures:
      return (session.dimension == 2 ? HasNextSegment(session) : HasNextTriangle(session))
                 ? std::optional(AddFeaturesOf(number))
                 : std::nullopt;
    case Step::kSetSizes:
      return SetSizesOf(number, random);
    case Step::kRefine:
      return IsComplete(session) ? std::optional(RefineOf(world_, number, MayRestart(session, random))) : std::nullopt;
    case Step::kAddVertices:
      return may_add ? std::optional(AddVerticesOf(world_, number, random)) : std::nullopt;
    case Step::kRefineBesideUpload:
    case Step::kAddVerticesBesideUpload:
      return IsComplete(session) && count < kMostPoints && (step == Step::kRefineBesideUpload || may_add)
                 ? std::optional(BesideUpload(step, number, random))
                 : std::nullopt;
    default:
      return std::nullopt;
  }
}

SessionLife::Change SessionLife::CreateOf(int number) {
  v1::CreateSessionRequest request;
  KnownSession session;
  if (number == kBlock) {
    session.dimension = 3;
    request.mutable_parameters()->set_dimension(3);
  } else {
    *request.mutable_parameters() = UnitCubeParameters(2);
  }
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
    const size_t offset = session.point_count();
    const std::vector<double> points = NextPoints(session, 1 + random.Below(8), random);
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
                    Differs("committed_points", answered.response.committed_points(), expected.point_count()),
                    Differs("revision", answered.response.revision(), expected.revision));
              },
          .after = std::move(after)};
}

SessionLife::Change SessionLife::RemovePointsOf(int number, test::SplitMix64& random) {
  World after = world_;
  KnownSession& session = after.at(number);
  const size_t least = KeptPoints(session);
  const size_t dimension = session.dimension;
  v1::RemovePointsRequest request;
  request.set_name(session.name);
  request.set_request_id(absl::StrCat("remove ", salt_));
  const auto end_of_least = session.points.begin() + static_cast<std::ptrdiff_t>(dimension * least);
  std::vector<double> kept(session.points.begin(), end_of_least);
  const uint64_t always = least + random.Below(session.point_count() - least);
  for (uint64_t point = least; point < session.point_count(); ++point) {
    if (point == always || random.Below(4) == 0) {
      request.add_points(point);
    } else {
      const auto from = session.points.begin() + static_cast<std::ptrdiff_t>(dimension * point);
      kept.insert(kept.end(), from, from + static_cast<std::ptrdiff_t>(dimension));
    }
  }
  session.points = std::move(kept);
  ++session.revision;
  session.is_ready = false;
  session.has_structure = false;
  return {.step = Step::kRemovePoints,
          .call =
              [this, number, request](World* known, bool* is_answered) {
                const auto answered = server_.RemovePoints(request);
                *is_answered = answered.is_ok;
                return answered.is_ok ? Differs("committed_points", answered.response.committed_points(),
                                                known->at(number).point_count())
                                      : ErrorOf("RemovePoints", answered);
              },
          .after = std::move(after)};
}

SessionLife::Change SessionLife::AddFeaturesOf(int number) {
  if (number == kBlock) {
    return AddTrianglesOf(number);
  }
  World after = world_;
  KnownSession& session = after.at(number);
  const auto first = static_cast<uint32_t>(session.segment_ends.size());
  session.segment_ends.insert(session.segment_ends.end(), {first, first + 1});
  ++session.revision;
  session.is_ready = false;
  return {.step = Step::kAddFeatures,
          .call =
              [this, number, request = SegmentsRequestOf(session, first / 2)](World* known, bool* is_answered) {
                const auto answered = server_.AddSegments(request);
                *is_answered = answered.is_ok;
                return answered.is_ok ? Differs("revision", answered.response.revision(), known->at(number).revision)
                                      : ErrorOf("AddSegments", answered);
              },
          .after = std::move(after)};
}

SessionLife::Change SessionLife::AddTrianglesOf(int number) {
  World after = world_;
  KnownSession& session = after.at(number);
  const size_t first = session.triangles;
  session.triangles = first == 0 ? kBlockTriangles / 2 : kBlockTriangles;
  ++session.revision;
  session.is_ready = false;
  return {.step = Step::kAddFeatures,
          .call =
              [this, number, request = TrianglesRequestOf(session, first)](World* known, bool* is_answered) {
                const auto answered = server_.AddTriangles(request);
                *is_answered = answered.is_ok;
                return answered.is_ok ? Differs("revision", answered.response.revision(), known->at(number).revision)
                                      : ErrorOf("AddTriangles", answered);
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
    for (size_t axis = 0; axis < session.dimension; ++axis) {
      session.sizes.push_back(random.Unit());
    }
    session.sizes.push_back(0.2 + 0.5 * random.Unit());
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
  const size_t offset = session.point_count();
  const std::vector<double> points = NextPoints(session, 1 + random.Below(8), random);
  session.points.insert(session.points.end(), points.begin(), points.end());
  session.is_ready = false;
  const std::vector requests = {UploadRequest(session.name, offset, points)};
  const bool refines = step == Step::kRefineBesideUpload;
  if (refines) {
    ++session.revision;  // of an addition, it grows with the added points
  }
  const Change beside = refines ? RefineOf(std::move(uploaded), number, MustRestart(session))
                                : AddVerticesOf(std::move(uploaded), number, random);
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
  const std::vector<double> points = NextPoints(session, 1 + random.Below(3), random);
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

}  // namespace wellspace::server
