// What a session does to take points out.
#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "proto/checksum.h"
#include "server/sessions/session.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

constexpr uint64_t kCopiedPoints = uint64_t{1} << 16;  // at a time

}  // namespace

absl::Status Session::CheckRemovableLocked(std::span<const uint64_t> numbers) const {
  if (numbers.empty()) {
    return absl::OkStatus();
  }
  const auto refusal = [&](const std::string& what) {
    return MakeError(v1::ERROR_REASON_INVALID_POINTS, what, "points");
  };
  const uint64_t count = PointCountLocked();
  if (numbers.back() >= count) {
    return refusal(absl::StrCat("points has ", numbers.back(), ", and no point of ", name_, " has this number; it has ",
                                count, ", from 0 on"));
  }
  if (const auto twice = std::ranges::adjacent_find(numbers); twice != numbers.end()) {
    return refusal(absl::StrCat("points has ", *twice, " twice; each number is accepted once"));
  }
  const std::span<const uint32_t> ends = features_.ends();
  if (const auto last = std::ranges::max_element(ends); last != ends.end() && numbers.front() <= *last) {
    return refusal(absl::StrCat("points has ", numbers.front(), ", but segments of ", name_, " end at points up to ",
                                *last, "; those behind can be removed"));
  }
  return absl::OkStatus();
}

absl::Status Session::BeginRemoval(std::span<const uint64_t> numbers, uint64_t expected_revision) {
  std::lock_guard change_lock(change_mutex_);
  WELLSPACE_RETURN_IF_ERROR(LoadInputs());
  std::lock_guard lock(mutex_);
  WELLSPACE_RETURN_IF_ERROR(CheckReadyForChangeLocked(expected_revision));
  if (is_uploading_) {
    return MakeError(v1::ERROR_REASON_SESSION_BUSY,
                     absl::StrCat("points are being uploaded to ", name_, "; wait for the end of the upload"));
  }
  WELLSPACE_RETURN_IF_ERROR(CheckRemovableLocked(numbers));
  BeginBusyLocked(Busy::kRemovingPoints);
  return absl::OkStatus();
}

absl::Status Session::CopyPointsWithout(std::span<const uint64_t> numbers, KeptPoints* kept) {
  const uint64_t count = points_->coordinate_count() / dimension_;
  if (points_->is_in_memory()) {
    const uint64_t bytes = (count - numbers.size()) * dimension_ * sizeof(double);
    WELLSPACE_ASSIGN_OR_RETURN(kept->memory, memory_.Reserve(bytes, "the points that are left of a session"));
  }
  kept->file = revision_ + 1;
  kept->store = log_.OpenPoints(name_, dimension_, kept->file, {});
  auto removed = numbers.begin();
  for (uint64_t first = 0; first < count; first += kCopiedPoints) {
    const uint64_t end = std::min(count, first + kCopiedPoints);
    WELLSPACE_ASSIGN_OR_RETURN(std::vector<double> block,
                               points_->Copy(first * dimension_, end * dimension_, core::RunContext()));
    auto to = block.begin();
    for (uint64_t point = first; point < end; ++point) {
      if (removed != numbers.end() && *removed == point) {
        ++removed;
      } else {
        to = std::copy_n(block.begin() + static_cast<std::ptrdiff_t>((point - first) * dimension_), dimension_, to);
      }
    }
    block.erase(to, block.end());
    WELLSPACE_RETURN_IF_ERROR(kept->store->Append(block));
    kept->crc32c = ExtendCrc32c(kept->crc32c, block.data(), block.size() * sizeof(double));
  }
  return kept->store->Synchronize();
}

absl::StatusOr<PointsLeft> Session::CommitRemoval(KeptPoints& kept, const AnswerTo<PointsLeft>& answer) {
  std::lock_guard change_lock(change_mutex_);
  const PointsLeft left{.points = kept.store->coordinate_count() / dimension_, .revision = kept.file};
  const std::optional<store::v1::AnswerRecord> answer_record = AnswerRecordOf(answer, left);
  const std::vector<SizesInUse> unused = UnusedSizesLocked({}, sizes_in_use_.number);
  WELLSPACE_RETURN_IF_ERROR(CommitState([&](SessionChange& change) {
    change.steps.emplace_back().mutable_removed();
    if (left.points > 0) {
      store::v1::StepRecord::Points& points = *change.steps.emplace_back().mutable_points();
      points.set_count(left.points);
      points.set_crc32c(kept.crc32c);
    }
    change.state->set_points(left.points);
    change.state->set_points_file(kept.file);
    change.state->set_revision(left.revision);
    change.state->set_is_ready(false);
    for (const SizesInUse& set : unused) {
      change.dropped_sizes.push_back(set.number);
    }
    change.answer = answer_record;
  }));
  std::lock_guard lock(mutex_);
  point_account_.Return(PointCountLocked() - left.points);
  for (const SizesInUse& set : unused) {
    point_account_.ReturnSizes(set.count);
  }
  std::swap(points_, kept.store);
  std::swap(points_file_, kept.file);
  committed_points_ = left.points;
  uncommitted_crc32c_ = 0;
  revision_ = left.revision;
  is_ready_ = false;
  steps_ = SessionSteps();
  work_.meshed_points = 0;
  ++structure_version_;
  return left;
}

absl::StatusOr<PointsLeft> Session::RemovePoints(std::span<const uint64_t> numbers, uint64_t expected_revision,
                                                 const AnswerTo<PointsLeft>& answer) {
  std::vector<uint64_t> ascending(numbers.begin(), numbers.end());
  std::ranges::sort(ascending);
  WELLSPACE_RETURN_IF_ERROR(BeginRemoval(ascending, expected_revision));
  WaitForQueries();
  KeptPoints kept;
  PointsLeft left{.points = committed_points_, .revision = revision_};
  const absl::Status status = RunGuarded([&]() -> absl::Status {
    if (!ascending.empty()) {
      WELLSPACE_RETURN_IF_ERROR(CopyPointsWithout(ascending, &kept));
      WELLSPACE_ASSIGN_OR_RETURN(left, CommitRemoval(kept, answer));
      DropMesher();
    }
    return absl::OkStatus();
  });
  {
    std::lock_guard lock(mutex_);
    EndBusyLocked();
  }
  // The store that the session has no more, or has not come to have.
  if (kept.store != nullptr) {
    kept.store = nullptr;
    log_.DropPoints(name_, kept.file);
  }
  NoteIdle();
  if (!status.ok()) {
    return status;
  }
  return left;
}

}  // namespace wellspace::server
