#include "core/voronoi/node_columns.h"

#include <algorithm>
#include <limits>

#include "core/base/dimensions.h"

namespace wellspace::core {
namespace {

template <int D, size_t kWidth>
WELLSPACE_INLINE bool Excesses(std::vector<typename NodeColumns<D>::Group>& groups, const Point<D>& normal,
                               double offset, double length, double error) {
  using Lanes = typename Wide<kWidth>::Lanes;
  typename Wide<kWidth>::Mask any{};
  for (auto& group : groups) {
    for (size_t from = 0; from < kLanes; from += kWidth) {
      Lanes excess = LanesAt<kWidth>(group.x[0], from) * normal[0];
      for (int axis = 1; axis < D; ++axis) {
        excess += LanesAt<kWidth>(group.x[axis], from) * normal[axis];
      }
      excess -= offset;
      const Lanes most = excess + (LanesAt<kWidth>(group.slack, from) * length + error);
      LanesAt<kWidth>(group.excess, from) = excess;
      LanesAt<kWidth>(group.most, from) = most;
      any |= most >= 0;
    }
  }
  return IsAny<kWidth>(any);
}

template <int D, size_t kWidth>
WELLSPACE_INLINE void Most(const std::vector<typename NodeColumns<D>::Group>& groups, double slack,
                           double relative_error, CandidateColumns<D>& candidates) {
  using Lanes = typename Wide<kWidth>::Lanes;
  for (size_t from = 0; from < candidates.count; from += kWidth) {
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
    LanesAt<kWidth>(candidates.most, from) = (largest - offset) + (slack * length + relative_error * offset);
  }
}

template <int D, size_t kWidth>
WELLSPACE_INLINE bool IsReached(const std::vector<typename NodeColumns<D>::Group>& groups, const Point<D>& low,
                                const Point<D>& high) {
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
      // Where the sum is near zero the p that attains it is within 2 |x| of the site, so an error e of x moves it by at
      // most 4 |x| e.
      any |= power <= 4 * LanesAt<kWidth>(group.slack, from) * LanesAt<kWidth>(group.reach, from);
    }
  }
  return IsAny<kWidth>(any);
}

template <int D, size_t kWidth>
WELLSPACE_INLINE typename NodeColumns<D>::Largest LargestOf(const std::vector<typename NodeColumns<D>::Group>& groups) {
  using Lanes = typename Wide<kWidth>::Lanes;
  Lanes reach{};
  Lanes slack{};
  for (const auto& group : groups) {
    for (size_t from = 0; from < kLanes; from += kWidth) {
      const Lanes reaches = LanesAt<kWidth>(group.reach, from);
      const Lanes slacks = LanesAt<kWidth>(group.slack, from);
      reach = reach > reaches ? reach : reaches;
      slack = slack > slacks ? slack : slacks;
    }
  }
  typename NodeColumns<D>::Largest largest{reach[0], slack[0]};
  for (size_t lane = 1; lane < kWidth; ++lane) {
    largest = {std::max(largest.reach, reach[lane]), std::max(largest.slack, slack[lane])};
  }
  return largest;
}

template <int D>
WELLSPACE_AVX2 bool ExcessesAvx2(std::vector<typename NodeColumns<D>::Group>& groups, const Point<D>& normal,
                                 double offset, double length, double error) {
  return Excesses<D, 4>(groups, normal, offset, length, error);
}

template <int D>
WELLSPACE_AVX2 void MostAvx2(const std::vector<typename NodeColumns<D>::Group>& groups, double slack,
                             double relative_error, CandidateColumns<D>& candidates) {
  Most<D, 4>(groups, slack, relative_error, candidates);
}

template <int D>
WELLSPACE_AVX2 bool IsReachedAvx2(const std::vector<typename NodeColumns<D>::Group>& groups, const Point<D>& low,
                                  const Point<D>& high) {
  return IsReached<D, 4>(groups, low, high);
}

template <int D>
WELLSPACE_AVX2 typename NodeColumns<D>::Largest LargestOfAvx2(
    const std::vector<typename NodeColumns<D>::Group>& groups) {
  return LargestOf<D, 4>(groups);
}

}  // namespace

template <int D>
bool NodeColumns<D>::ComputeExcesses(const Point<D>& normal, double offset, double length, double error) {
  return unit_ == VectorUnit::kAvx2 ? ExcessesAvx2<D>(groups_, normal, offset, length, error)
                                    : Excesses<D, 2>(groups_, normal, offset, length, error);
}

template <int D>
void NodeColumns<D>::ComputeMost(double slack, double relative_error, CandidateColumns<D>& candidates) const {
  if (unit_ == VectorUnit::kAvx2) {
    MostAvx2<D>(groups_, slack, relative_error, candidates);
  } else {
    Most<D, 2>(groups_, slack, relative_error, candidates);
  }
}

template <int D>
bool NodeColumns<D>::Reaches(const Point<D>& low, const Point<D>& high) const {
  return unit_ == VectorUnit::kAvx2 ? IsReachedAvx2<D>(groups_, low, high) : IsReached<D, 2>(groups_, low, high);
}

template <int D>
typename NodeColumns<D>::Largest NodeColumns<D>::FindLargest() const {
  return unit_ == VectorUnit::kAvx2 ? LargestOfAvx2<D>(groups_) : LargestOf<D, 2>(groups_);
}

#define WELLSPACE_INSTANTIATE(D) template class NodeColumns<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
