// Methods of Session that remove points.
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

// Refuses ascending `numbers` that are not all points of `session`, which has `count`, or of which features are made.
absl::Status CheckRemovable(std::span<const uint64_t> numbers, uint64_t count, const FeatureStore& features,
                            const std::string& session) {
  if (numbers.empty()) {
    return absl::OkStatus();
  }
  const auto refusal = [&](const std::string& what) {
    return MakeError(v1::ERROR_REASON_INVALID_POINTS, what, "points");
  };
  if (numbers.back() >= count) {
    return refusal(absl::StrCat("points has ", numbers.back(), ", and no point of ", session,
                                " has this number; it has ", count, ", from 0 on"));
  }
  if (const auto twice = std::ranges::adjacent_find(numbers); twice != numbers.end()) {
    return refusal(absl::StrCat("points has ", *twice, " twice; each number is accepted once"));
  }
  const std::span<const uint32_t> named = features.points();
  if (const auto last = std::ranges::max_element(named); last != named.end() && numbers.front() <= *last) {
    const char* const what = features.counts().triangles > 0 ? "triangles" : "segments";
    return refusal(absl::StrCat("points has ", numbers.front(), ", but ", what, " of ", session,
                                " end at points up to ", *last, "; those behind can be removed"));
  }
  return absl::OkStatus();
}

// Appends all points of `from` but those with these ascending `numbers` to `to`, and synchronises it. `*crc32c` becomes
// their checksum.
absl::Status CopyWithout(const PointStore& from, int dimension, std::span<const uint64_t> numbers, PointStore& to,
                         uint32_t* crc32c) {
  const uint64_t count = from.coordinate_count() / dimension;
  auto removed = numbers.begin();
  for (uint64_t first = 0; first < count; first += kCopiedPoints) {
    const uint64_t end = std::min(count, first + kCopiedPoints);
    WELLSPACE_ASSIGN_OR_RETURN(std::vector<double> block,
                               from.Copy(first * dimension, end * dimension, core::RunContext()));
    auto kept = block.begin();
    for (uint64_t point = first; point < end; ++point) {
      if (removed != numbers.end() && *removed == point) {
        ++removed;
      } else {
        kept = std::copy_n(block.begin() + static_cast<std::ptrdiff_t>((point - first) * dimension), dimension, kept);
      }
    }
    block.erase(kept, block.end());
    WELLSPACE_RETURN_IF_ERROR(to.Append(block));
    *crc32c = ExtendCrc32c(*crc32c, block.data(), block.size() * sizeof(double));
  }
  return to.Synchronize();
}

}  // namespace

// One RemovePoints: its parts, in their order.
class PointRemoval {
 public:
  // `numbers` are ascending.
  PointRemoval(Session& session, std::span<const uint64_t> numbers) : session_(session), numbers_(numbers) {}

  // Checks the request, before any point is copied, and makes the session Busy::kRemovingPoints.
  absl::Status Begin(uint64_t expected_revision);
  // Writes the points that are left to a store of their own, and commits that.
  absl::Status Remove(const AnswerTo<PointsLeft>& answer);
  // The session is free again. Returns the number of its points, and its revision.
  PointsLeft End();

 private:
  absl::Status Commit(const AnswerTo<PointsLeft>& answer);

  Session& session_;
  const std::span<const uint64_t> numbers_;
  SessionWork work_;  // of the session; the structure goes with its points
  PointsThatAreLeft left_;
  MemoryReservation memory_;           // that the copy takes besides, if it is in memory
  std::shared_ptr<PointStore> store_;  // of the points left; once the change is made, that of before; null: none
  std::vector<store::v1::PointsFile> store_files_;  // where it lies
};

absl::Status PointRemoval::Begin(uint64_t expected_revision) {
  absl::MutexLock change_lock(&session_.change_mutex_);
  WELLSPACE_RETURN_IF_ERROR(session_.LoadInputs());
  absl::MutexLock lock(&session_.mutex_);
  WELLSPACE_RETURN_IF_ERROR(
      CheckReady(session_.occupancy_, *session_.state_, session_.stores_.point_count(), expected_revision));
  if (session_.occupancy_.is_uploading) {
    return MakeError(v1::ERROR_REASON_SESSION_BUSY, absl::StrCat("points are being uploaded to ", session_.name(),
                                                                 "; wait for the end of the upload"));
  }
  WELLSPACE_RETURN_IF_ERROR(
      CheckRemovable(numbers_, session_.stores_.point_count(), *session_.stores_.features, session_.name()));
  session_.occupancy_.BeginBusy(Busy::kRemovingPoints);
  session_.mutex_.Await(absl::Condition(HasNoQueries, &session_.occupancy_));
  return absl::OkStatus();
}

absl::Status PointRemoval::Remove(const AnswerTo<PointsLeft>& answer) {
  const SessionInputs inputs = session_.inputs();
  const int dimension = session_.dimension();
  left_.points = inputs.point_count() - numbers_.size();
  left_.file.set_number(NextRevision(*inputs.state));
  left_.file.set_epoch(inputs.state->epoch);
  if (inputs.points->is_in_memory()) {
    const uint64_t bytes = left_.points * dimension * sizeof(double);
    WELLSPACE_ASSIGN_OR_RETURN(memory_, session_.memory_.Reserve(bytes, "the points that are left of a session"));
  }
  store_files_ = {left_.file};
  store_ = session_.log_.files().OpenPoints({.session = session_.name(), .dimension = dimension, .next = left_.file});
  WELLSPACE_RETURN_IF_ERROR(CopyWithout(*inputs.points, dimension, numbers_, *store_, &left_.crc32c));
  WELLSPACE_RETURN_IF_ERROR(Commit(answer));
  work_.mesher = nullptr;
  work_.memory.Release();
  return absl::OkStatus();
}

absl::Status PointRemoval::Commit(const AnswerTo<PointsLeft>& answer) {
  absl::MutexLock change_lock(&session_.change_mutex_);
  const std::shared_ptr<const SessionState> before = session_.state();
  SessionChange change = RemovalChange(*before, left_);
  change.answer = AnswerRecordOf(answer, PointsLeft{.points = left_.points, .revision = left_.file.number()});
  SizeSets unused;  // is freed without the lock
  return session_.Make(change, [&] {
    session_.mutex_.AssertHeld();
    Session::Stores& stores = session_.stores_;
    session_.account_.Return(session_.stores_.point_count() - left_.points);
    for (const uint64_t number : change.dropped_sizes) {
      auto set = stores.sizes.extract(number);
      session_.account_.ReturnSizes(set.mapped()->sizes.size());
      unused.insert(std::move(set));
    }
    std::swap(stores.points, store_);
    store_files_ = PointsFilesOf(before->record);
    store_files_.push_back(std::exchange(stores.file, left_.file));
    stores.new_crc32c = 0;
    work_ = session_.work_.TakeMesher();
  });
}

PointsLeft PointRemoval::End() {
  PointsLeft left;
  {
    absl::MutexLock lock(&session_.mutex_);
    session_.occupancy_.EndBusy(session_.clock_.since_boot());
    left = {.points = session_.state_->record.points(), .revision = session_.state_->record.revision()};
  }
  // The store that the session has no more, or has not come to have.
  if (std::exchange(store_, nullptr) != nullptr) {
    for (const store::v1::PointsFile& file : store_files_) {
      session_.log_.files().DropPoints(session_.name(), file);
    }
  }
  session_.NoteIdle();
  return left;
}

absl::StatusOr<PointsLeft> Session::RemovePoints(std::span<const uint64_t> numbers, uint64_t expected_revision,
                                                 const AnswerTo<PointsLeft>& answer) {
  std::vector<uint64_t> ascending(numbers.begin(), numbers.end());
  std::ranges::sort(ascending);
  PointRemoval removal(*this, ascending);
  WELLSPACE_RETURN_IF_ERROR(removal.Begin(expected_revision));
  const absl::Status status = RunGuarded([&] { return ascending.empty() ? absl::OkStatus() : removal.Remove(answer); });
  const PointsLeft left = removal.End();
  if (!status.ok()) {
    return status;
  }
  return left;
}

}  // namespace wellspace::server
