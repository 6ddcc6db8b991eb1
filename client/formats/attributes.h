// Numbers that points or simplices have beside all else: an intensity, a colour, an id, a solution.
#ifndef WELLSPACE_CLIENT_FORMATS_ATTRIBUTES_H_
#define WELLSPACE_CLIENT_FORMATS_ATTRIBUTES_H_

#include <span>
#include <string>
#include <vector>

namespace wellspace::formats {

// One number of every point, or of every simplex.
struct Attribute {
  std::string name;
  std::vector<double> values;  // NaN: missing. Whole numbers beyond 2^53 are rounded.

  bool operator==(const Attribute&) const = default;
};

// Names of attributes as files of meshes have them: no two are the same, none is that of other data of a mesh, and none
// has characters that the syntax of a format may use; "_" takes their place.
std::vector<std::string> NamesToWrite(std::span<const Attribute> attributes);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_ATTRIBUTES_H_
