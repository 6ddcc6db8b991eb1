// The test of two triangles of a complex for contact: they meet where they share nothing, or come too near.
#ifndef WELLSPACE_CORE_FEATURES_TRIANGLE_CONTACT_H_
#define WELLSPACE_CORE_FEATURES_TRIANGLE_CONTACT_H_

#include <array>
#include <cstdint>

#include "core/geometry/point.h"

namespace wellspace::core {

// The corners of a triangle, by number and by place.
struct TriangleCorners {
  std::array<uint32_t, 3> names;
  std::array<Point<3>, 3> places;
};

struct TriangleContact {
  enum class Kind : uint8_t {
    kNone,
    kMeet,  // they have a point in common that is in no corner or side which they share
    kNear,  // a corner of one is too near to the other
  };
  Kind kind = Kind::kNone;
  Point<3> at{};        // where; of a kNear the corner; rounded
  double distance = 0;  // of a kNear; rounded

  bool operator==(const TriangleContact&) const = default;
};

// How two triangles, which have an area and not the same corners, come together; kNear if a corner of one, which the
// other does not have, is nearer to it than `least`.
//
// Guarantees: (1) whether they meet is exact; (2) symmetric.
// REQUIRES:   finite coordinates.
// Complexity: O(1): a few products in doubles where that is clear, for most pairs, else exact signs of nine
//             determinants at most.
// Errors:     none.
// Source:     two triangles meet iff a side of one meets the other; docs/design/surfaces.md.
TriangleContact FindContact(const TriangleCorners& one, const TriangleCorners& other, double least);

// The distance of `p` from a triangle; rounded.
double DistanceToTriangle(const Point<3>& p, const std::array<Point<3>, 3>& triangle);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_TRIANGLE_CONTACT_H_
