// The common part of reader and writer of Gmsh's MSH. Private to client/formats.
#ifndef WELLSPACE_CLIENT_FORMATS_MSH_MSH_H_
#define WELLSPACE_CLIENT_FORMATS_MSH_MSH_H_

#include <cstdint>

namespace wellspace::formats {

// Types of elements, of first order and of second order.
inline constexpr int32_t kMshLine = 1;
inline constexpr int32_t kMshTriangle = 2;
inline constexpr int32_t kMshTetrahedron = 4;
inline constexpr int32_t kMshPoint = 15;
inline constexpr int32_t kMshSecondLine = 8;
inline constexpr int32_t kMshSecondTriangle = 9;
inline constexpr int32_t kMshSecondTetrahedron = 11;

// The name of the data of nodes that are weights.
inline constexpr char kMshWeights[] = "weights";

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MSH_MSH_H_
