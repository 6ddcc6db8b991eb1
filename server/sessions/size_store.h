// Sizes at points as they come, of one call or of a session.
#ifndef WELLSPACE_SERVER_SESSIONS_SIZE_STORE_H_
#define WELLSPACE_SERVER_SESSIONS_SIZE_STORE_H_

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "core/geometry/criterion.h"
#include "wellspace/store/v1/records.pb.h"
#include "wellspace/v1/mesh.pb.h"
#include "wellspace/v1/sessions.pb.h"

namespace wellspace::server {

// Refuses a chunk that is no list of sizes at points of `dimension`, and sizes that no mesh can have. `first` is the
// number of its first sample, `field` the name of the chunk in its request.
//
// Complexity: O(samples of the chunk).
// Errors:     INVALID_CHUNK_SHAPE; INVALID_SIZES, naming the sample.
absl::Status CheckSizes(const v1::SizeSamples& chunk, uint64_t first, int dimension, std::string_view field);
// The same of sizes of vertices, without points.
absl::Status CheckSizes(const v1::VertexSizes& chunk, uint64_t first, std::string_view field);

// What is written down of `samples`: several records, if they are many.
std::vector<store::v1::SizesRecord> RecordsOf(const core::SizeSamples& samples, int dimension);
// What was written down.
std::shared_ptr<const core::SizeSamples> SamplesOf(const std::vector<store::v1::SizesRecord>& records);

// Samples that grow at the end.
//
// Thread safety: thread-compatible.
// Invariants: what is appended has passed CheckSizes.
class SizeStore {
 public:
  // The measure is from now on that of `chunk`.
  void Append(const v1::SizeSamples& chunk);

  // Sizes alone, whose points come later, by SetPoints.
  void Append(const v1::VertexSizes& chunk);
  // Takes the points of the samples: count() x dimension, row-major.
  template <typename Coordinates>
  void SetPoints(const Coordinates& points) {
    samples_.points.assign(points.begin(), points.end());
  }

  uint64_t count() const { return samples_.sizes.size(); }
  uint64_t bytes() const { return samples_.bytes(); }

  // Hands over the samples; null if there are none. Leaves this empty.
  std::shared_ptr<const core::SizeSamples> Take();

 private:
  core::SizeSamples samples_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_SIZE_STORE_H_
