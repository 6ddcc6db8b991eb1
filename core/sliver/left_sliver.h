// A sliver that the repair has to leave, and why.
#ifndef WELLSPACE_CORE_SLIVER_LEFT_SLIVER_H_
#define WELLSPACE_CORE_SLIVER_LEFT_SLIVER_H_

#include <array>
#include <cstddef>
#include <cstdint>

namespace wellspace::core {

enum class SliverReason {
  kDemands,  // each place tried for a new vertex in its circumball breaks the criterion, a size or the smallest edge
  kAngle,    // a new vertex could keep the criteria, but each place tried for it leaves an angle that is too small
  kWork,     // the bound on operations was reached first
};
inline constexpr size_t kSliverReasons = 3;

struct LeftSliver {
  std::array<uint32_t, 4> vertices{};  // in the numbers of its owner
  double min_angle_deg = 0;            // its smallest dihedral angle
  SliverReason reason = SliverReason::kDemands;
};

// The most slivers that are named, the flattest ones.
inline constexpr size_t kMostNamedSlivers = 10;

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_LEFT_SLIVER_H_
