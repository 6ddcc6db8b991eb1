// Pages that show a mesh: one HTML file that a browser shows without any network.
#ifndef WELLSPACE_CLIENT_VIEWER_PAGE_H_
#define WELLSPACE_CLIENT_VIEWER_PAGE_H_

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "client/formats/io/output_file.h"
#include "client/formats/mesh.h"

namespace wellspace::viewer {

// So many bytes an array of a page may have: browsers have no longer texts than twice that.
inline constexpr uint64_t kMaxArrayBytes = uint64_t{1} << 28;

struct PageOptions {
  std::string name;  // of the mesh; any bytes
  int up = 2;        // the axis that points upwards at first
};

// The page without a mesh, which is at the place of kMeshMark. client/viewer/build.mjs makes it.
std::string_view EmptyPage();
inline constexpr std::string_view kMeshMark = "<!--wellspace:mesh-->";

// Whether a page can show `mesh`.
//
// Errors:     INVALID_ARGUMENT: it is neither 2-D nor 3-D, has no simplices, or a coordinate above 1e150;
//             RESOURCE_EXHAUSTED: an array is larger than kMaxArrayBytes.
absl::Status CheckMesh(const formats::MeshView& mesh);

// Writes the page of `mesh`: its shape as JSON and its arrays in base64, as docs/view.md defines.
//
// REQUIRES:   CheckMesh; indices are of vertices, parts have the facets that there are, regions are of `regions`.
// Guarantees: (1) names have no effect as markup, whatever they are; (2) the same mesh makes the same page, and so does
//             `Mesh.plot` of the Python package; (3) numbers keep their bits.
// Complexity: O(bytes of the mesh); memory of one piece of an array, and of the regions of simplices.
// Errors:     those of `file`, which keeps them.
void WritePage(const formats::MeshView& mesh, const PageOptions& options, formats::OutputFile& file);

}  // namespace wellspace::viewer

#endif  // WELLSPACE_CLIENT_VIEWER_PAGE_H_
