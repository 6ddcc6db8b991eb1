// Sizes at points, on the scale of the computation.
#ifndef WELLSPACE_CORE_SCALED_SAMPLES_H_
#define WELLSPACE_CORE_SCALED_SAMPLES_H_

#include <cstdint>
#include <memory>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/domain.h"
#include "core/geometry/criterion.h"
#include "core/mesh_parameters.h"
#include "core/refine/sizing.h"

namespace wellspace::core {

// `size` on the scale of the computation. What is so large or small that doubles could not tell is no larger or smaller
// in the result than that: nothing of it is 0 or infinite, nor are squares of it.
double ScaledSize(double size, double scale);

// The samples that a mesher was last asked for, scaled and in a tree, which is built once for all its calls.
//
// Thread safety: thread-compatible.
template <int D>
class ScaledSamples {
 public:
  // Takes those of `parameters`, unless it has them. They may lie outside of what is meshed: from there, too, sizes
  // grow.
  //
  // REQUIRES:   ValidateParameters(parameters).ok().
  // Complexity: O(n log n) for n new samples.
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Take(const Domain<D>& domain, const MeshParameters& parameters, const RunContext& context);

  // Those of `parameters`, which are built here and now if they were not taken. Null for none.
  std::shared_ptr<const SampleTree<D>> Of(const Domain<D>& domain, const MeshParameters& parameters) const;

  // Whether those of `parameters` were taken.
  bool Has(const MeshParameters& parameters) const { return parameters.size_samples == taken_; }

  uint64_t MemoryBytes() const { return tree_ == nullptr ? 0 : SampleTree<D>::BytesFor(tree_->places().size()); }
  // What Take will hold.
  static uint64_t BytesFor(const MeshParameters& parameters) {
    return parameters.size_samples == nullptr ? 0 : SampleTree<D>::BytesFor(parameters.size_samples->sizes.size());
  }

 private:
  std::shared_ptr<const SizeSamples> taken_;  // what the tree is made of
  std::shared_ptr<const SampleTree<D>> tree_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SCALED_SAMPLES_H_
