// The members of a .npz that holds a mesh: a zip archive of .npy arrays, as numpy.savez writes it. Private to this
// folder.
#ifndef WELLSPACE_CLIENT_FORMATS_NUMPY_NPZ_H_
#define WELLSPACE_CLIENT_FORMATS_NUMPY_NPZ_H_

namespace wellspace::formats {

inline constexpr char kNpzPoints[] = "points.npy";        // vertex_count x dimension
inline constexpr char kNpzWeights[] = "weights.npy";      // vertex_count, of regular triangulations only
inline constexpr char kNpzSimplices[] = "simplices.npy";  // simplex_count x (dimension + 1), indices of points

// Only where the boundary is known; regions also where they are.
inline constexpr char kNpzOrigins[] = "vertex_origins.npy";         // vertex_count; numbers of input points, or below 0
inline constexpr char kNpzVertexTags[] = "vertex_tags.npy";         // vertex_count
inline constexpr char kNpzRegions[] = "regions.npy";                // simplex_count
inline constexpr char kNpzFacets[] = "facets.npy";                  // facet_count x dimension, indices of points
inline constexpr char kNpzFacetTags[] = "facet_tags.npy";           // facet_count
inline constexpr char kNpzFacetNames[] = "facet_names.npy";         // of the parts of the boundary, in UTF-32
inline constexpr char kNpzFacetNameTags[] = "facet_name_tags.npy";  // the tag of each name

// Only of meshes with creases, in 3-D.
inline constexpr char kNpzRidges[] = "ridges.npy";  // ridge_count x 2, indices of points

// Only of a mesh that is periodic along x, y or z: pairs of vertices, that on the low side first, by ascending such.
inline constexpr const char* kNpzPeriodic[] = {"periodic_x.npy", "periodic_y.npy", "periodic_z.npy"};

// Only of second order: `simplices` and `facets` have further columns, the nodes at the middles of edges in VTK's
// order, which are the last rows of `points` and of all data of vertices.
inline constexpr char kNpzMiddleEnds[] =
    "middle_ends.npy";  // middle nodes x 2: the ends of the edge of each, ascending

// Only of a part of a larger mesh.
inline constexpr char kNpzPart[] = "part.npy";             // part, parts, own vertices, own simplices
inline constexpr char kNpzVertexIds[] = "vertex_ids.npy";  // vertex_count; so the next two
inline constexpr char kNpzVertexOwners[] = "vertex_owners.npy";
inline constexpr char kNpzVertexRows[] = "vertex_rows.npy";
inline constexpr char kNpzSimplexIds[] = "simplex_ids.npy";        // simplex_count
inline constexpr char kNpzSimplexOwners[] = "simplex_owners.npy";  // simplex_count
inline constexpr char kNpzFacetIds[] = "facet_ids.npy";            // facet_count

// Only where regions are known.
inline constexpr char kNpzRegionIds[] = "region_ids.npy";      // a row for each region
inline constexpr char kNpzRegionNames[] = "region_names.npy";  // of these, in UTF-32

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_NUMPY_NPZ_H_
