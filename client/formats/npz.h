// The members of a .npz that holds a mesh: a zip archive of .npy arrays, as numpy.savez writes it. Private to this
// folder.
#ifndef WELLSPACE_CLIENT_FORMATS_NPZ_H_
#define WELLSPACE_CLIENT_FORMATS_NPZ_H_

namespace wellspace::formats {

inline constexpr char kNpzPoints[] = "points.npy";        // vertex_count x dimension
inline constexpr char kNpzWeights[] = "weights.npy";      // vertex_count, of regular triangulations only
inline constexpr char kNpzSimplices[] = "simplices.npy";  // simplex_count x (dimension + 1), indices of points

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_NPZ_H_
