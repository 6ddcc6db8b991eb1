// The dimensions that the core is built for.
#ifndef WELLSPACE_CORE_BASE_DIMENSIONS_H_
#define WELLSPACE_CORE_BASE_DIMENSIONS_H_

namespace wellspace::core {

inline constexpr int kMinDimension = 2;
inline constexpr int kMaxDimension = 6;

}  // namespace wellspace::core

// Expands X(D) for every dimension: the explicit instantiations at the end of a source file. Headers declare templates
// whose definitions only that file has.
#define WELLSPACE_FOR_EACH_DIMENSION(X) X(2) X(3) WELLSPACE_FOR_EACH_DIMENSION_ABOVE_3(X)
// As above, for code that differs in the plane and in space.
#define WELLSPACE_FOR_EACH_DIMENSION_ABOVE_3(X) X(4) X(5) X(6)

#endif  // WELLSPACE_CORE_BASE_DIMENSIONS_H_
