// The angles of a triangulation's tetrahedra, which the repair of slivers keeps from one run to the next.
#ifndef WELLSPACE_CORE_SLIVER_KNOWN_COSINES_H_
#define WELLSPACE_CORE_SLIVER_KNOWN_COSINES_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/geometry/exact_measure.h"
#include "core/sliver/tetrahedron.h"
#include "core/sliver/triangulation.h"
#include "core/sliver/vertex_carrier.h"

namespace wellspace::core {

// In the place of the cosine of a tetrahedron that is not meshed: below every limit.
inline constexpr double kUncountedCosine = -1;

// The cosine by which a tetrahedron of a triangulation is a sliver or not.
template <VertexCarrier Carrier>
double CountedCosine(const Carrier& carrier, const Simplex<3>& corners) {
  return carrier.IsMeshed(corners) ? FlatnessOf(MeasureTetrahedron(corners)) : kUncountedCosine;
}

// The cosine of each tetrahedron's smallest dihedral angle. Between two runs those that come are listed, so that the
// next run measures these alone.
//
// Thread safety: thread-compatible.
// Invariants: (1) after a run that has ended well, the cosine of each tetrahedron that is in, and not listed, is its
//             counted one; and those that are slivers are listed, too.
class KnownCosines {
 public:
  double Of(SimplexId s) const { return cosine_[Index(s)]; }
  // REQUIRES:   s < simplex_limit of the last GrowTo.
  void Set(SimplexId s, double cosine) { cosine_[Index(s)] = cosine; }
  void GrowTo(uint32_t simplex_limit) { cosine_.resize(simplex_limit, kUncountedCosine); }
  // That of all simplices, free numbers included.
  const HugeVector<double>& all() const { return cosine_; }

  // Simplices have come between two runs.
  void NoteCreated(std::span<const SimplexId> created) {
    if (are_known_) {
      to_look_at_.insert(to_look_at_.end(), created.begin(), created.end());
    }
  }

  // Begins a run: the simplices whose cosine is above `flat_cosine`, ascending. Until EndRun, nothing is known to
  // another run. `measured` grows by the number of tetrahedra that are measured.
  //
  // Complexity: the first time, and for a carrier that does not mesh all, a measure for every simplex; then one for
  //             each that has come since, and for another bound than the last a look at each number.
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  // Threads:    uses `threads` where all are measured.
  template <VertexCarrier Carrier>
  absl::StatusOr<std::vector<SimplexId>> BeginRun(const Triangulation<3>& triangulation, const Carrier& carrier,
                                                  double flat_cosine, int threads, const RunContext& context,
                                                  uint64_t& measured);

  // Ends a run with `slivers` left.
  void EndRun(std::span<const SimplexId> slivers) {
    to_look_at_.assign(slivers.begin(), slivers.end());
    are_known_ = true;
  }

  uint64_t MemoryBytes() const { return cosine_.size() * sizeof(double) + to_look_at_.size() * sizeof(SimplexId); }

 private:
  // Simplices that one thread measures one after the other.
  static constexpr size_t kBlock = 1 << 14;

  template <VertexCarrier Carrier>
  absl::Status MeasureAll(const Triangulation<3>& triangulation, const Carrier& carrier, int threads,
                          const RunContext& context);

  HugeVector<double> cosine_;          // by simplex
  std::vector<SimplexId> to_look_at_;  // that have come since the last run, or are its slivers; in any order
  double flat_cosine_ = 0;             // of the last run
  bool are_known_ = false;             // since the last run has ended well
};

template <VertexCarrier Carrier>
absl::Status KnownCosines::MeasureAll(const Triangulation<3>& triangulation, const Carrier& carrier, int threads,
                                      const RunContext& context) {
  ThreadTeam team(threads);
  return team.TryForEach((cosine_.size() + kBlock - 1) / kBlock, [&](size_t block) {
    const size_t end = std::min(cosine_.size(), (block + 1) * kBlock);
    for (size_t i = block * kBlock; i < end; ++i) {
      const SimplexId s{static_cast<uint32_t>(i)};
      cosine_[i] = triangulation.IsIn(s) ? CountedCosine(carrier, triangulation.Corners(s)) : kUncountedCosine;
    }
    return context.Check();
  });
}

template <VertexCarrier Carrier>
absl::StatusOr<std::vector<SimplexId>> KnownCosines::BeginRun(const Triangulation<3>& triangulation,
                                                              const Carrier& carrier, double flat_cosine, int threads,
                                                              const RunContext& context, uint64_t& measured) {
  std::vector<SimplexId> slivers;
  const bool are_known = Carrier::kMeshesAll && are_known_;
  const bool is_other_bound = flat_cosine != flat_cosine_;
  flat_cosine_ = flat_cosine;
  are_known_ = false;
  GrowTo(triangulation.simplex_limit());
  const auto is_sliver = [&](SimplexId s) { return triangulation.IsIn(s) && Of(s) > flat_cosine; };
  if (!are_known) {
    measured += cosine_.size();
    WELLSPACE_RETURN_IF_ERROR(MeasureAll(triangulation, carrier, threads, context));
  } else {
    std::ranges::sort(to_look_at_);
    to_look_at_.erase(std::unique(to_look_at_.begin(), to_look_at_.end()), to_look_at_.end());
    for (size_t k = 0; k < to_look_at_.size(); ++k) {
      if (k % kBlock == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      if (const SimplexId s = to_look_at_[k]; triangulation.IsIn(s)) {
        ++measured;
        Set(s, CountedCosine(carrier, triangulation.Corners(s)));
        if (Of(s) > flat_cosine) {
          slivers.push_back(s);
        }
      }
    }
    if (!is_other_bound) {
      return slivers;
    }
    slivers.clear();
  }
  for (size_t i = 0; i < cosine_.size(); ++i) {
    if (const SimplexId s{static_cast<uint32_t>(i)}; is_sliver(s)) {
      slivers.push_back(s);
    }
  }
  return slivers;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_KNOWN_COSINES_H_
