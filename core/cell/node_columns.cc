#include "core/cell/node_columns.h"

#include <algorithm>
#include <limits>

#include "core/base/dimensions.h"
#include "core/base/simd/lane_bits.h"

namespace wellspace::core {
namespace {

// NodeColumns::BoundExcesses: a vector of candidates at a time, each against every node.
template <int D, size_t kWidth>
WELLSPACE_INLINE void BoundAll(std::span<const typename NodeColumns<D>::Group> groups, double slack,
                               double relative_error, size_t begin, Candidates<D>& candidates) {
  using Lanes = typename Wide<kWidth>::Lanes;
  for (size_t from = begin / kWidth * kWidth; from < candidates.count; from += kWidth) {
    Lanes w[D];
    for (int axis = 0; axis < D; ++axis) {
      w[axis] = LanesAt<kWidth>(candidates.w[axis], from);
    }
    Lanes largest = Lanes{} - std::numeric_limits<double>::infinity();
    for (const auto& group : groups) {
      for (size_t lane = 0; lane < kLanes; ++lane) {
        Lanes product = w[0] * group.x[0][lane];
        for (int axis = 1; axis < D; ++axis) {
          product += w[axis] * group.x[axis][lane];
        }
        largest = largest > product ? largest : product;
      }
    }
    const Lanes length_sq = LanesAt<kWidth>(candidates.length_sq, from);
    Lanes length;
    for (size_t lane = 0; lane < kWidth; ++lane) {
      length[lane] = __builtin_sqrt(length_sq[lane]);
    }
    const Lanes offset = 0.5 * length_sq;
    LanesAt<kWidth>(candidates.excess_bound, from) = (largest - offset) + (slack * length + relative_error * offset);
  }
}

// NodeColumns::Reaches: p is x, moved into the cube axis by axis; |p x|^2 - |x|^2 is the sum of p (p - 2 x).
template <int D, size_t kWidth>
WELLSPACE_INLINE bool IsReached(std::span<const typename NodeColumns<D>::Group> groups, const Point<D>& low,
                                const Point<D>& high, double doubt) {
  using Lanes = typename Wide<kWidth>::Lanes;
  typename Wide<kWidth>::Mask any{};
  for (const auto& group : groups) {
    for (size_t from = 0; from < kLanes; from += kWidth) {
      Lanes power{};
      for (int axis = 0; axis < D; ++axis) {
        const Lanes x = LanesAt<kWidth>(group.x[axis], from);
        const Lanes least = low[axis] + Lanes{};
        const Lanes most = high[axis] + Lanes{};
        Lanes p = x > least ? x : least;
        p = p < most ? p : most;
        power += p * (p - 2 * x);
      }
      any |= power <= doubt;
    }
  }
  return Bits<kWidth>(any) != 0;
}

// NodeColumns::FindLargest.
template <int D, size_t kWidth>
WELLSPACE_INLINE typename NodeColumns<D>::Largest Largest(std::span<const typename NodeColumns<D>::Group> groups) {
  using Lanes = typename Wide<kWidth>::Lanes;
  Lanes radius_sq{};
  Lanes slack{};
  for (const auto& group : groups) {
    for (size_t from = 0; from < kLanes; from += kWidth) {
      Lanes norm_sq = LanesAt<kWidth>(group.x[0], from) * LanesAt<kWidth>(group.x[0], from);
      for (int axis = 1; axis < D; ++axis) {
        norm_sq += LanesAt<kWidth>(group.x[axis], from) * LanesAt<kWidth>(group.x[axis], from);
      }
      const Lanes slacks = LanesAt<kWidth>(group.slack, from);
      radius_sq = radius_sq > norm_sq ? radius_sq : norm_sq;
      slack = slack > slacks ? slack : slacks;
    }
  }
  typename NodeColumns<D>::Largest largest{radius_sq[0], slack[0]};
  for (size_t lane = 1; lane < kWidth; ++lane) {
    largest = {std::max(largest.radius_sq, radius_sq[lane]), std::max(largest.slack, slack[lane])};
  }
  return largest;
}

template <int D>
WELLSPACE_AVX2 typename NodeColumns<D>::Largest LargestAvx2(std::span<const typename NodeColumns<D>::Group> groups) {
  return Largest<D, 4>(groups);
}

template <int D>
WELLSPACE_AVX2 void BoundAllAvx2(std::span<const typename NodeColumns<D>::Group> groups, double slack,
                                 double relative_error, size_t begin, Candidates<D>& candidates) {
  BoundAll<D, 4>(groups, slack, relative_error, begin, candidates);
}

template <int D>
WELLSPACE_AVX2 bool IsReachedAvx2(std::span<const typename NodeColumns<D>::Group> groups, const Point<D>& low,
                                  const Point<D>& high, double doubt) {
  return IsReached<D, 4>(groups, low, high, doubt);
}

}  // namespace

template <int D>
void NodeColumns<D>::BoundExcesses(double slack, double relative_error, size_t begin, Candidates<D>& candidates) const {
  if (unit_ == VectorUnit::kAvx2) {
    BoundAllAvx2<D>(groups(), slack, relative_error, begin, candidates);
  } else {
    BoundAll<D, 2>(groups(), slack, relative_error, begin, candidates);
  }
}

template <int D>
bool NodeColumns<D>::Reaches(const Point<D>& low, const Point<D>& high, double doubt) const {
  return unit_ == VectorUnit::kAvx2 ? IsReachedAvx2<D>(groups(), low, high, doubt)
                                    : IsReached<D, 2>(groups(), low, high, doubt);
}

template <int D>
typename NodeColumns<D>::Largest NodeColumns<D>::FindLargest() const {
  return unit_ == VectorUnit::kAvx2 ? LargestAvx2<D>(groups()) : core::Largest<D, 2>(groups());
}

template <int D>
void NodeColumns<D>::MakeRoom() {
  groups_.resize(2 * PaddedCount(count_) / kLanes);
  rows_.resize(groups_.size() * kLanes);
  excesses_.resize(groups_.size());
  found_.resize((groups_.size() * kLanes + kWordBits - 1) / kWordBits);
}

#define WELLSPACE_INSTANTIATE(D) template class NodeColumns<D>;
WELLSPACE_FOR_EACH_DIMENSION_ABOVE_3(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
