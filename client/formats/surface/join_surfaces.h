// Several files of triangles as one surface.
#ifndef WELLSPACE_CLIENT_FORMATS_SURFACE_JOIN_SURFACES_H_
#define WELLSPACE_CLIENT_FORMATS_SURFACE_JOIN_SURFACES_H_

#include <vector>

#include "client/formats/surface/surface.h"

namespace wellspace::formats {

// One surface of all triangles and seeds, in the order of the files. Each file's markers are others than those of the
// files before it: a marker is kept if it is not 0 and none of them has it, and is otherwise the next number above 0
// that no file has. Triangles without a name are named after their file, those with a name that another file has as
// well after both. Of triangles over equal corners in several files that of the first file stays, so that solids that
// touch share facets; a note counts the others. Solids are all bounded ones; one file stays as it is.
//
// Complexity: O(n + m log m) for n triangles and m markers.
// REQUIRES:   there is a surface; all have fewer than 2^32 points together.
Surface JoinSurfaces(std::vector<Surface> surfaces);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_SURFACE_JOIN_SURFACES_H_
