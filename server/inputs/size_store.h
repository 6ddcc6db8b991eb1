// Sizes at points as they come, of one call or of a session.
#ifndef WELLSPACE_SERVER_INPUTS_SIZE_STORE_H_
#define WELLSPACE_SERVER_INPUTS_SIZE_STORE_H_

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/geometry/criterion.h"
#include "server/inputs/number_chunks.h"
#include "server/store/records.h"
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

// The records of `samples`, which are some: several records, if they are many, each made when it is asked for.
StoredSizes RecordsOf(uint64_t number, std::shared_ptr<const core::SizeSamples> samples, int dimension);
// The samples of these records, which are freed as they are read.
std::shared_ptr<const core::SizeSamples> SamplesOf(std::vector<store::v1::SizesRecord> records);

// Samples that grow at the end.
//
// Thread safety: thread-compatible.
// Invariants: appended samples have passed CheckSizes.
class SizeStore {
 public:
  // Takes over the samples of `chunk`. The measure is from now on its.
  void Append(v1::SizeSamples* chunk);

  // Sizes alone, whose points come later, by SetPoints.
  void Append(v1::VertexSizes* chunk);
  // Sets the points of the samples: count() x dimension, row-major.
  template <typename Coordinates>
  void SetPoints(const Coordinates& points) {
    vertices_.assign(points.begin(), points.end());
  }

  uint64_t count() const { return sizes_.count(); }
  // Of its sizes.
  uint64_t bytes() const { return points_.bytes() + sizes_.bytes() + vertices_.size() * sizeof(double); }

  // Hands over the samples; null if there are none, or the run is cancelled. Leaves this empty.
  //
  // Complexity: O(samples): they are copied, and freed as they are.
  std::shared_ptr<const core::SizeSamples> Take(const core::RunContext& context);

 private:
  NumberChunks points_;
  NumberChunks sizes_;
  std::vector<double> vertices_;  // of SetPoints
  core::SizeMeasure measure_ = core::SizeMeasure::kCircumradius;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_INPUTS_SIZE_STORE_H_
