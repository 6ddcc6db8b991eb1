// The place of a vertex in a domain in space: on the surface, or in a solid. SpatialDomain keeps the places of
// vertices, and requests carry them.
#ifndef WELLSPACE_CORE_REFINE_SPACE_SPACE_PLACE_H_
#define WELLSPACE_CORE_REFINE_SPACE_SPACE_PLACE_H_

#include <cstdint>

#include "core/refine/insertion.h"

namespace wellspace::core {

struct SpacePlace {
  // A collar point is a vertex on a patch that stays where it is (acute_creases.h).
  enum class Kind : uint8_t { kSolid, kPatch, kCollar, kCurve, kCorner };

  Kind kind = Kind::kSolid;
  uint32_t number = 0;  // of the solid, patch, curve or corner; of a collar point that of its patch
  // On a curve the length of arc from its first point. In a solid a distance: nothing of the surface is nearer.
  double along = 0;

  bool IsOnSurface() const { return kind != Kind::kSolid; }
  bool IsOnCurve() const { return kind == Kind::kCurve || kind == Kind::kCorner; }
  // The name by which the refinement asks: whether the vertex is elsewhere than its cell asks for.
  bool IsOnFeature() const { return IsOnSurface(); }
};

using SpaceRequest = InsertionRequest<3, SpacePlace>;

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_SPACE_PLACE_H_
