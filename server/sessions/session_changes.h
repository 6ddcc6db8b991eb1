// The changes of a session: the records that each writes, made of the state before.
#ifndef WELLSPACE_SERVER_SESSIONS_SESSION_CHANGES_H_
#define WELLSPACE_SERVER_SESSIONS_SESSION_CHANGES_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "absl/time/time.h"
#include "core/geometry/criterion.h"
#include "core/input/mesh_parameters.h"
#include "server/inputs/feature_store.h"
#include "server/sessions/session_state.h"
#include "server/store/records.h"
#include "wellspace/store/v1/records.pb.h"

namespace wellspace::server {

// Each function here is one transition: of the state before and of the request it makes the change that is
// committed. Apply (server/sessions/session_state.h) makes the state after it. None of them looks at anything else,
// so that they can be tested, and committed by any process that owns the session.
//
// Complexity: O(size of the record), and of the data. Errors: none, if not said otherwise.

constexpr size_t kKeptOperations = 100;

// Settings of a session that has not been shown yet.
struct SessionSettings {
  std::string tenant;
  std::string name;  // "sessions/{session}"
  core::MeshParameters parameters;
  std::map<std::string, std::string> labels;
  absl::Duration ttl;
  absl::Time create_time;
  uint64_t epoch = 0;  // of its owner
};
SessionChange CreationChange(const SessionSettings& settings);

// `labels` and `ttl` take the place of those before, where they are given.
SessionChange UpdateChange(const SessionState& state, const std::optional<std::map<std::string, std::string>>& labels,
                           std::optional<absl::Duration> ttl);

// The session and all that it has are no more.
SessionChange DeletionChange(const SessionState& state);

// Points that were appended behind those that the session has.
struct AppendedPoints {
  uint64_t end = 0;              // how many the session has with them
  uint32_t crc32c = 0;           // of those that are new
  store::v1::PointsFile file{};  // where those that are new lie
};

// `appended` are the session's. Where none are new, the change has no step, and its record is the state's.
SessionChange PointsChange(const SessionState& state, const AppendedPoints& appended);

// The session has `left` points, in this file, whose checksum is `crc32c`, and no structure.
struct PointsThatAreLeft {
  uint64_t points = 0;
  store::v1::PointsFile file{};  // its number is the revision after the change
  uint32_t crc32c = 0;
};
SessionChange RemovalChange(const SessionState& state, const PointsThatAreLeft& left);

// Appends the new rows of `part`, all but its first `known` of each kind; `after` is the summary of all of them.
SessionChange FeaturesChange(const SessionState& state, const FeaturePart& part, const FeatureCounts& known,
                             const FeatureSummary& after);

// Whether the session has `expected` where the same sizes are set once more. A client whose answer was lost repeats the
// call, with the revision that was right the first time.
bool IsRevisionOfSizes(const SessionState& state, uint64_t expected);
// `samples`, null for none, take the place of the sizes before. Sets that no step needs are dropped.
SessionChange SizesChange(const SessionState& state, const std::shared_ptr<const core::SizeSamples>& samples);

// An operation that is new: its record, and the change that it begins with. It takes the appended points.
store::v1::OperationRecord NewOperation(const SessionState& state, const core::MeshParameters& parameters, bool restart,
                                        absl::Time now);
SessionChange StartChange(const SessionState& state, const store::v1::OperationRecord& operation,
                          const AppendedPoints& appended);

// The usage of work that is done for the session's tenant. `new_vertices` absent: it has made no mesh.
store::v1::UsageRecord UsageOf(const SessionState& state, absl::Time now, absl::Duration processor_time,
                               std::optional<uint64_t> new_vertices);

// An operation that was started is from now on as `operation` says: it begins, is cancelled, fails or is parked.
SessionChange OperationChange(const SessionState& state, const store::v1::OperationRecord& operation);

// Other owners may take the session over for its operation, or may not any more.
SessionChange OfferChange(const SessionState& state, bool stands);

// An operation that has succeeded, as `operation` says, with the mesh of this record: all points are meshed.
SessionChange SuccessChange(const SessionState& state, const store::v1::OperationRecord& operation,
                            const store::v1::MeshRecord& mesh);

// `count` vertices were added at the last of the points that were `appended`, after all before were taken in up to
// number `uploads_end`.
SessionChange AdditionChange(const SessionState& state, const AppendedPoints& appended, uint64_t uploads_end,
                             uint64_t count);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SESSION_CHANGES_H_
