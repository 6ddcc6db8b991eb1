// Methods of Session about the points that are uploaded to it.
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "proto/checksum.h"
#include "server/sessions/session.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// Checks that an upload to `session`, which has `count` points, begins at `offset` with no gap before it.
absl::Status CheckNoGap(uint64_t offset, uint64_t count, const std::string& session) {
  return offset <= count ? absl::OkStatus()
                         : MakeError(v1::ERROR_REASON_UPLOAD_GAP,
                                     absl::StrCat("point_offset is ", offset, ", but ", session, " has ", count,
                                                  " points; go on at ", count, " or before"),
                                     "point_offset");
}

// Checks that `coordinates` are those that `session` has from point `first` on, whose points are `points`.
absl::Status CheckRepeatedPoints(const PointStore& points, int dimension, uint64_t first,
                                 std::span<const double> coordinates, const std::string& session) {
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t equal, points.CountEqual(first * dimension, coordinates));
  if (equal == coordinates.size()) {
    return absl::OkStatus();
  }
  const uint64_t other = first * dimension + equal;
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<double> known, points.Copy(other, other + 1, core::RunContext()));
  const uint64_t point = first + equal / dimension;
  return MakeError(
      v1::ERROR_REASON_UPLOAD_MISMATCH,
      absl::StrCat("points[", point, "]: coordinate ", equal % dimension, " is ", coordinates[equal], "; ", session,
                   " has this point already, with ", known[0], "; send the same again, or add other points at ",
                   points.coordinate_count() / dimension),
      "points.coordinates");
}

}  // namespace

absl::Status Session::CheckPrefix(const Prefix& prefix) const {
  absl::MutexLock lock(&mutex_);
  WELLSPACE_RETURN_IF_ERROR(CheckIdle(occupancy_, *state_));
  WELLSPACE_RETURN_IF_ERROR(CheckNoGap(prefix.end, stores_.point_count(), name()));
  WELLSPACE_ASSIGN_OR_RETURN(const uint32_t checksum,
                             stores_.points->Checksum(prefix.first * dimension(), prefix.end * dimension()));
  return checksum == prefix.crc32c
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_UPLOAD_MISMATCH,
                         absl::StrCat(name(), " has other points from number ", prefix.first, " up to ", prefix.end,
                                      " than those that this upload goes on after: their checksum is ", checksum,
                                      ", not ", prefix.crc32c, "; add these points at ", stores_.point_count(),
                                      ", or to another session"),
                         "checked_crc32c");
}

absl::Status Session::Append(uint64_t offset, std::span<const double> coordinates, uint64_t expected_revision) {
  {
    absl::MutexLock lock(&mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckReady(occupancy_, *state_, stores_.point_count(), expected_revision));
    if (coordinates.size() % dimension() != 0) {
      return MakeError(v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
                       absl::StrCat("the chunk at point ", offset, " has ", coordinates.size(),
                                    " coordinates; expected a multiple of the dimension ", dimension()),
                       "points.coordinates");
    }
    const uint64_t count = stores_.point_count();  // those that are not committed yet, too
    WELLSPACE_RETURN_IF_ERROR(CheckNoGap(offset, count, name()));
    const uint64_t known = std::min<uint64_t>(count - offset, coordinates.size() / dimension());
    WELLSPACE_RETURN_IF_ERROR(
        CheckRepeatedPoints(*stores_.points, dimension(), offset, coordinates.first(known * dimension()), name()));
    coordinates = coordinates.subspan(known * dimension());
    if (coordinates.empty()) {
      return absl::OkStatus();
    }
    WELLSPACE_RETURN_IF_ERROR(CheckPoints(BoxOf(*state_), dimension(), count, coordinates));
    WELLSPACE_RETURN_IF_ERROR(account_.Take(coordinates.size() / dimension()));
    PointStore& points = *stores_.points;
    if (absl::Status appended = RunGuarded([&] { return points.Append(coordinates); }); !appended.ok()) {
      account_.Return(coordinates.size() / dimension());
      return appended;
    }
    stores_.new_crc32c = ExtendCrc32c(stores_.new_crc32c, coordinates.data(), coordinates.size_bytes());
  }
  return log_.is_durable() ? absl::OkStatus() : CommitPoints();
}

uint64_t Session::UncommittedBytes() const {
  absl::MutexLock lock(&mutex_);
  return (stores_.point_count() - state_->record.points()) * dimension() * sizeof(double);
}

absl::Status Session::CommitPoints() {
  absl::MutexLock change_lock(&change_mutex_);
  AppendedPoints appended;
  std::shared_ptr<PointStore> points;
  uint32_t crc32c = 0;
  {
    absl::MutexLock lock(&mutex_);
    // While points are removed, all that are left are copied, and committed then.
    if (stores_.point_count() == state_->record.points() || occupancy_.busy == Busy::kRemovingPoints) {
      return absl::OkStatus();
    }
    appended = stores_.appended();
    points = stores_.points;
    crc32c = std::exchange(stores_.new_crc32c, 0);  // from now on, of the points behind these
  }
  // An exception must not leave points behind without their checksum.
  absl::Status status = RunGuarded([&]() -> absl::Status {
    change_mutex_.AssertHeld();
    WELLSPACE_RETURN_IF_ERROR(points->Synchronize());
    SessionChange change = PointsChange(*state(), appended);
    return Make(change, [] {});
  });
  if (status.ok()) {
    return status;
  }
  absl::MutexLock lock(&mutex_);
  if (occupancy_.busy == Busy::kAddingVertices || occupancy_.busy == Busy::kReplaying) {
    stores_.new_crc32c = crc32c;  // others read the points now; the next change tries to commit these, too
    return status;
  }
  account_.Return(stores_.point_count() - state_->record.points());
  stores_.points->Truncate(state_->record.points() * dimension());
  stores_.new_crc32c = 0;
  return status;
}

}  // namespace wellspace::server
