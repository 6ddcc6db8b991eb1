// Sizes at points, on the scale of the computation.
#ifndef WELLSPACE_CORE_INPUT_SCALED_SAMPLES_H_
#define WELLSPACE_CORE_INPUT_SCALED_SAMPLES_H_

#include <cstdint>
#include <memory>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/geometry/criterion.h"
#include "core/input/frame.h"
#include "core/input/mesh_parameters.h"
#include "core/refine/sizing.h"

namespace wellspace::core {

// `size` on the scale of the computation, clamped to the range in which doubles tell sizes apart: the result is neither
// 0 nor infinite, nor is its square.
double ScaledSize(double size, double scale);

// The samples that a mesher was last asked for, scaled and in a tree, which is built once for all its calls.
//
// Thread safety: thread-compatible.
template <int D>
class ScaledSamples {
 public:
  // Takes the samples of `parameters`, unless it has them. They may lie outside of the domain: from there, too, sizes
  // grow.
  //
  // REQUIRES:   ValidateParameters(parameters).ok().
  // Complexity: O(n log n) for n new samples.
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Take(const Frame<D>& frame, const MeshParameters& parameters, const RunContext& context);

  // The samples of `parameters`, which are built here and now if they were not taken. Null for none.
  std::shared_ptr<const SampleTree<D>> Of(const Frame<D>& frame, const MeshParameters& parameters) const;

  // Whether the samples of `parameters` were taken.
  bool Has(const MeshParameters& parameters) const { return parameters.size_samples == taken_; }

  uint64_t MemoryBytes() const { return tree_ == nullptr ? 0 : SampleTree<D>::BytesFor(tree_->places().size()); }
  // The memory of the samples that the tree is made of.
  uint64_t TakenBytes() const { return taken_ == nullptr ? 0 : taken_->bytes(); }
  // Memory of the samples that Take will hold. Unit: bytes.
  static uint64_t BytesFor(const MeshParameters& parameters) {
    return parameters.size_samples == nullptr ? 0 : SampleTree<D>::BytesFor(parameters.size_samples->sizes.size());
  }

 private:
  std::shared_ptr<const SizeSamples> taken_;  // the samples in the tree
  std::shared_ptr<const SampleTree<D>> tree_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_SCALED_SAMPLES_H_
