// Numbers of vertices of a mesh: the least one, by proof, and the expected one, by a formula. A hopeless demand is
// refused before any work.
#ifndef WELLSPACE_CORE_ESTIMATE_LEAST_VERTICES_H_
#define WELLSPACE_CORE_ESTIMATE_LEAST_VERTICES_H_

#include "core/estimate/domain_shape.h"
#include "core/geometry/box.h"
#include "core/refine/sizing.h"

namespace wellspace::core {

// No mesh of `box` that keeps `sizes` has fewer vertices.
//
// A place in a simplex is no farther from the nearest corner than the circumradius. So balls of that radius about the
// corners cover the simplex, and its solid angles, as parts of the whole, sum up to its volume over the ball's at
// least. The solid angles of all simplices at a vertex sum up to one at most: so many vertices there are. In 2-D a
// triangle has half a vertex, and none is larger than the equilateral one. Where one bound holds everywhere, coverings
// of space by equal balls have a least density, which is known in 3-D, and projections along axes are covered, too.
//
// Units:      a count; infinite where a double cannot have it. One in a hundred is left for rounding.
// REQUIRES:   sizes above 0.
// Complexity: O(regions^2).
// Source:     Coxeter, Few and Rogers 1959, for 3-D; docs/design/estimate.md.
template <int D>
double LeastVerticesForSizes(const Box<D>& box, const SizeField<D>& sizes);
// The bound for a domain in the plane, with the largest areas in its faces: of these the first bound holds for each
// alone, and no edge on a segment is longer than twice the circumradius beside it.
//
// Complexity: O(regions^2), and O(n log n) for n segments.
double LeastVerticesForSizes(const DomainShape& shape, const SizeField<2>& sizes);

// No mesh of `box` has fewer vertices that keeps `rho`, by either criterion: a thin box needs many.
//
// Units:      as above.
// Source:     docs/design/estimate.md has the proof.
template <int D>
double LeastVerticesForShape(const Box<D>& box, double rho);

// About how many vertices the sizes alone take, and the shape of the box alone.
//
// Complexity: O(regions).
// Source:     the model of docs/design/estimate.md, without points.
template <int D>
double TypicalVerticesForSizes(const Box<D>& box, const SizeField<D>& sizes);
double TypicalVerticesForSizes(const DomainShape& shape, const SizeField<2>& sizes);
template <int D>
double TypicalVerticesForShape(const Box<D>& box);

// The smallest size for which, when smaller ones are raised to it, at most about `vertices` are taken; the smallest
// side in the same way. At most the longest side of the box.
template <int D>
double SmallestSizeFor(const Box<D>& box, const SizeField<D>& sizes, double vertices);
// Largest areas are raised as sizes are.
double SmallestSizeFor(const DomainShape& shape, const SizeField<2>& sizes, double vertices);
template <int D>
double SmallestSideFor(const Box<D>& box, double vertices);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_ESTIMATE_LEAST_VERTICES_H_
