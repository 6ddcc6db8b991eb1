// What a session does with segments, seeds and the rules of faces.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/sessions/session.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// Where a request goes on with one kind of thing.
struct Place {
  const char* what;          // of several
  const char* offset_field;  // of the request
  const char* field;         // that has them
  uint64_t offset;           // as the request says
  uint64_t count;            // that come with it
  uint64_t committed;        // that the session has

  uint64_t known() const { return std::min(committed - offset, count); }
};

absl::Status CheckPlace(const Place& place, const std::string& session) {
  return place.offset <= place.committed
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_UPLOAD_GAP,
                         absl::StrCat(place.offset_field, " is ", place.offset, ", but ", session, " has ",
                                      place.committed, " ", place.what, "; go on at ", place.committed, " or before"),
                         place.offset_field);
}

// `equal`: how many of those that are known are those that the session has.
absl::Status CheckEqual(const Place& place, uint64_t equal, const std::string& session) {
  return equal == place.known()
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_UPLOAD_MISMATCH,
                         absl::StrCat(place.what, "[", place.offset + equal, "]: ", session,
                                      " has another there; send the same again, or add others at ", place.committed),
                         place.field);
}

// Refuses a request whose segments or seeds leave a gap, or are others than `features` of `session` have. `*segments`
// and `*seeds` become how many of them it has already.
absl::Status CheckRepeatedFeatures(const v1::AddSegmentsRequest& request, const FeatureStore& features,
                                   const std::string& session, uint64_t* segments, uint64_t* seeds) {
  const Place segment_place{.what = "segments",
                            .offset_field = "segment_offset",
                            .field = "segments.ends",
                            .offset = request.segment_offset(),
                            .count = static_cast<uint64_t>(request.segments().ends_size()) / 2,
                            .committed = features.segment_count()};
  const Place seed_place{.what = "seeds",
                         .offset_field = "seed_offset",
                         .field = "faces.seeds",
                         .offset = request.seed_offset(),
                         .count = static_cast<uint64_t>(request.faces().seeds_size()),
                         .committed = features.seed_count()};
  WELLSPACE_RETURN_IF_ERROR(CheckPlace(segment_place, session));
  WELLSPACE_RETURN_IF_ERROR(CheckPlace(seed_place, session));
  *segments = segment_place.known();
  *seeds = seed_place.known();
  WELLSPACE_RETURN_IF_ERROR(
      CheckEqual(segment_place, features.CountEqual(segment_place.offset, *segments, request.segments()), session));
  return CheckEqual(seed_place, features.CountEqual(seed_place.offset, *seeds, request.faces()), session);
}

}  // namespace

absl::Status Session::AddSegments(const v1::AddSegmentsRequest& request, uint64_t expected_revision) {
  return RetryWithRoom(FeatureStore::BytesOf(request.segments().ends_size() / 2, request.faces().seeds_size()),
                       [&] { return TryToAddSegments(request, expected_revision); });
}

absl::Status Session::TryToAddSegments(const v1::AddSegmentsRequest& request, uint64_t expected_revision) {
  WELLSPACE_RETURN_IF_ERROR(CheckSegments(request.segments(), request.segment_offset()));
  WELLSPACE_RETURN_IF_ERROR(CheckFaces(request.faces(), request.seed_offset()));
  if (dimension_ != 2) {
    return NotInThePlane(request.has_segments() || !request.has_faces() ? "segments" : "faces", dimension_);
  }
  std::lock_guard change_lock(change_mutex_);
  WELLSPACE_RETURN_IF_ERROR(LoadInputs());
  uint64_t known_segments = 0;
  uint64_t known_seeds = 0;
  const uint64_t all_segments = request.segments().ends_size() / 2;
  const uint64_t all_seeds = request.faces().seeds_size();
  {
    std::lock_guard lock(mutex_);
    WELLSPACE_RETURN_IF_ERROR(CheckReadyForChangeLocked(expected_revision));
    WELLSPACE_RETURN_IF_ERROR(CheckRepeatedFeatures(request, features_, name_, &known_segments, &known_seeds));
    if (known_segments == all_segments && known_seeds == all_seeds &&
        !(request.has_faces() && features_.HasOtherRules(request.faces()))) {
      return absl::OkStatus();
    }
    if (work_.mesh != nullptr) {
      return MakeError(v1::ERROR_REASON_DOMAIN_FIXED,
                       absl::StrCat(name_,
                                    " has been refined; segments and faces can be added only before the first "
                                    "refinement: create another session for this domain"));
    }
    WELLSPACE_RETURN_IF_ERROR(point_account_.TakeFeatures(all_segments - known_segments, all_seeds - known_seeds));
  }
  const FeatureSummary before = features_.Summary();
  const absl::Status status = RunGuarded([&] {
    {
      std::lock_guard lock(mutex_);
      features_.Append(request.segments(), known_segments);
      if (request.has_faces()) {
        features_.Append(request.faces(), known_seeds);
      }
    }
    return CommitFeatures(request, known_segments, known_seeds);
  });
  std::lock_guard lock(mutex_);
  if (!status.ok()) {
    features_.TakeBack(before);
    point_account_.ReturnFeatures(all_segments - known_segments, all_seeds - known_seeds);
    return status;
  }
  feature_summary_ = features_.Summary();
  ++revision_;
  return absl::OkStatus();
}

absl::Status Session::CommitFeatures(const v1::AddSegmentsRequest& request, uint64_t known_segments,
                                     uint64_t known_seeds) {
  return CommitState([&](SessionChange& change) {
    store::v1::StepRecord::Features& step = *change.steps.emplace_back().mutable_features();
    *step.mutable_segments() = request.segments();
    step.mutable_segments()->mutable_ends()->ExtractSubrange(0, static_cast<int>(2 * known_segments), nullptr);
    if (request.segments().markers_size() != 0) {
      step.mutable_segments()->mutable_markers()->ExtractSubrange(0, static_cast<int>(known_segments), nullptr);
    }
    if (request.segments().groups_size() != 0) {
      step.mutable_segments()->mutable_groups()->ExtractSubrange(0, static_cast<int>(known_segments), nullptr);
    }
    if (request.has_faces()) {
      *step.mutable_faces() = request.faces();
      step.mutable_faces()->mutable_seeds()->DeleteSubrange(0, static_cast<int>(known_seeds));
    }
    SetFeatures(features_.Summary(), *change.state);
    change.state->set_revision(change.state->revision() + 1);
  });
}

v1::AddSegmentsResponse Session::CommittedSegments() const {
  v1::AddSegmentsResponse message;
  std::lock_guard lock(mutex_);
  message.set_segment_count(feature_summary_.segments);
  message.set_seed_count(feature_summary_.seeds);
  message.set_revision(revision_);
  return message;
}

}  // namespace wellspace::server
