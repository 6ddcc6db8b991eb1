// What a session does with the points that are uploaded to it.
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

bool Session::BeginUpload() {
  std::lock_guard lock(mutex_);
  return !std::exchange(is_uploading_, true);
}

void Session::EndUpload() {
  std::lock_guard lock(mutex_);
  is_uploading_ = false;
}

absl::Status Session::CheckPrefix(const Prefix& prefix) const {
  std::lock_guard lock(mutex_);
  WELLSPACE_RETURN_IF_ERROR(CheckOpenLocked());
  WELLSPACE_RETURN_IF_ERROR(CheckIdleLocked());
  WELLSPACE_RETURN_IF_ERROR(CheckNoGap(prefix.end, point_account_.points(), name_));
  WELLSPACE_ASSIGN_OR_RETURN(const uint32_t checksum,
                             points_->Checksum(prefix.first * dimension_, prefix.end * dimension_));
  return checksum == prefix.crc32c
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_UPLOAD_MISMATCH,
                         absl::StrCat(name_, " has other points from number ", prefix.first, " up to ", prefix.end,
                                      " than those that this upload goes on after: their checksum is ", checksum,
                                      ", not ", prefix.crc32c, "; add these points at ", point_account_.points(),
                                      ", or to another session"),
                         "checked_crc32c");
}

absl::Status Session::Append(uint64_t offset, std::span<const double> coordinates, uint64_t expected_revision) {
  std::lock_guard lock(mutex_);
  WELLSPACE_RETURN_IF_ERROR(CheckReadyForChangeLocked(expected_revision));
  if (coordinates.size() % dimension_ != 0) {
    return MakeError(v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
                     absl::StrCat("the chunk at point ", offset, " has ", coordinates.size(),
                                  " coordinates; expected a multiple of the dimension ", dimension_),
                     "points.coordinates");
  }
  WELLSPACE_RETURN_IF_ERROR(CheckNoGap(offset, point_account_.points(), name_));
  const uint64_t count = point_account_.points();  // those that are not committed yet, too
  const uint64_t known = std::min<uint64_t>(count - offset, coordinates.size() / dimension_);
  WELLSPACE_RETURN_IF_ERROR(
      CheckRepeatedPoints(*points_, dimension_, offset, coordinates.first(known * dimension_), name_));
  coordinates = coordinates.subspan(known * dimension_);
  if (coordinates.empty()) {
    return absl::OkStatus();
  }
  WELLSPACE_RETURN_IF_ERROR(CheckPoints(BoxLocked(), dimension_, count, coordinates));
  WELLSPACE_RETURN_IF_ERROR(point_account_.Take(coordinates.size() / dimension_));
  if (absl::Status appended = RunGuarded([&] { return points_->Append(coordinates); }); !appended.ok()) {
    point_account_.Return(coordinates.size() / dimension_);
    return appended;
  }
  if (log_.is_durable()) {
    uncommitted_crc32c_ = ExtendCrc32c(uncommitted_crc32c_, coordinates.data(), coordinates.size_bytes());
    return absl::OkStatus();
  }
  NotePointsLocked(PointCountLocked());
  return absl::OkStatus();
}

void Session::DropUncommittedLocked() {
  point_account_.Return(PointCountLocked() - committed_points_);
  points_->Truncate(committed_points_ * dimension_);
  uncommitted_crc32c_ = 0;
}

uint64_t Session::UncommittedBytes() const {
  std::lock_guard lock(mutex_);
  return (PointCountLocked() - committed_points_) * dimension_ * sizeof(double);
}

absl::Status Session::CommitPoints() {
  std::lock_guard change_lock(change_mutex_);
  uint64_t end = 0;
  uint32_t crc32c = 0;
  {
    std::lock_guard lock(mutex_);
    // While points are removed, all that are left are copied, and committed then.
    if (!HasUncommittedLocked() || busy_ == Busy::kRemovingPoints) {
      return absl::OkStatus();
    }
    end = PointCountLocked();
    crc32c = std::exchange(uncommitted_crc32c_, 0);  // from now on, of the points behind these
  }
  absl::Status status = points_->Synchronize();
  if (status.ok()) {
    status = CommitState([&](SessionChange& change) { AddPointsTo(change, end, crc32c); });
  }
  std::lock_guard lock(mutex_);
  if (!status.ok()) {
    if (busy_ == Busy::kAddingVertices || busy_ == Busy::kReplaying) {
      uncommitted_crc32c_ = crc32c;  // others read the points now; the next change tries to commit these, too
    } else {
      DropUncommittedLocked();
    }
    return status;
  }
  NotePointsLocked(end);
  return absl::OkStatus();
}

v1::UploadPointsResponse Session::Committed() const {
  v1::UploadPointsResponse message;
  std::lock_guard lock(mutex_);
  message.set_committed_points(committed_points_);
  message.set_revision(revision_);
  return message;
}

}  // namespace wellspace::server
