// The common part of readers and writers of TetGen's and Triangle's files. Private to client/formats.
#ifndef WELLSPACE_CLIENT_FORMATS_TETGEN_TETGEN_H_
#define WELLSPACE_CLIENT_FORMATS_TETGEN_TETGEN_H_

#include <string>
#include <vector>

namespace wellspace::formats {

// The comment ahead of the header of a .node whose attribute is the weight of its points.
inline constexpr char kWeightsComment[] = "weights";

// The first words of the comment ahead of the header of a .edge, .face or .poly of 0.1; then come tags,
// each with its name. Now every name has a comment of its own: see names.h.
inline constexpr char kBoundaryComment[] = "boundary:";
// The same ahead of the header of a .ele of 0.1 with several regions; then come ids, each with a name.
inline constexpr char kRegionsComment[] = "regions:";

// The files beside .node and .ele that have the boundary: .edge or .face, and up to 3-D .poly.
std::vector<std::string> BoundaryFilesOf(const std::string& path, int dimension);

// All files that a mesh in .node and .ele may have, whatever its dimension.
std::vector<std::string> TetgenFilesOf(const std::string& path);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_TETGEN_TETGEN_H_
