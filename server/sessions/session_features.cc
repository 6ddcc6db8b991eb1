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
  WELLSPACE_RETURN_IF_ERROR(CheckSegments(request.segments(), request.segment_offset()));
  WELLSPACE_RETURN_IF_ERROR(CheckFaces(request.faces(), request.seed_offset()));
  if (dimension() != 2) {
    return NotInThePlane(request.has_segments() || !request.has_faces() ? "segments" : "faces", dimension());
  }
  absl::MutexLock change_lock(&change_mutex_);
  WELLSPACE_RETURN_IF_ERROR(LoadInputs());
  uint64_t known_segments = 0;
  uint64_t known_seeds = 0;
  const uint64_t all_segments = request.segments().ends_size() / 2;
  const uint64_t all_seeds = request.faces().seeds_size();
  FeatureSummary before;
  {
    absl::MutexLock lock(&mutex_);
    const FeatureStore& features = *stores_.features;
    WELLSPACE_RETURN_IF_ERROR(CheckReady(occupancy_, *state_, stores_.point_count(), expected_revision));
    WELLSPACE_RETURN_IF_ERROR(CheckRepeatedFeatures(request, features, name(), &known_segments, &known_seeds));
    if (known_segments == all_segments && known_seeds == all_seeds &&
        !(request.has_faces() && features.HasOtherRules(request.faces()))) {
      return absl::OkStatus();
    }
    if (CheckMesh(*state_).ok()) {
      return MakeError(v1::ERROR_REASON_DOMAIN_FIXED,
                       absl::StrCat(name(),
                                    " has been refined; segments and faces can be added only before the first "
                                    "refinement: create another session for this domain"));
    }
    WELLSPACE_RETURN_IF_ERROR(account_.TakeFeatures(all_segments - known_segments, all_seeds - known_seeds));
    before = features.Summary();
  }
  absl::Status status = RunGuarded([&] {
    SessionChange change;
    {
      absl::MutexLock lock(&mutex_);
      FeatureStore& features = *stores_.features;
      features.Append(request.segments(), known_segments);
      if (request.has_faces()) {
        features.Append(request.faces(), known_seeds);
      }
      change = FeaturesChange(*state_, request, known_segments, known_seeds, features.Summary());
    }
    change_mutex_.AssertHeld();
    return Make(change, [] {});
  });
  if (!status.ok()) {
    absl::MutexLock lock(&mutex_);
    stores_.features->TakeBack(before);
    account_.ReturnFeatures(all_segments - known_segments, all_seeds - known_seeds);
  }
  return status;
}

}  // namespace wellspace::server
