// The scan of [HT08] Figure 6 with the paper's own order of leaves and vertices: the slow reference for ClippedVoronoi.
#ifndef WELLSPACE_CORE_VORONOI_REFERENCE_SCAN_H_
#define WELLSPACE_CORE_VORONOI_REFERENCE_SCAN_H_

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/cell/polytope.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// The distance d_v^U of [HT08] §6: the diameter of the smallest ball through the site v and a point p that holds none
// of the vertices U in its interior. With the site at the origin,
//
//   minimise |c|  over c in the box of centres with  c . u <= |u|^2 / 2 for all u in U,  c . p >= |p|^2 / 2.
//
// The paper has p on the ball's surface (c . p = |p|^2 / 2). That is no different: shrunk towards v a ball stays empty,
// its centre stays in the cell, which is convex and holds v, and at some moment its surface passes p. For a leaf q the
// point p is free in q.
//
// Lengths are in units of the coordinates. Nothing depends on how well the solver does but how tight the results are:
// each is a bound that any multipliers of the constraints prove (weak duality), with all rounding subtracted.
//
// Thread safety: thread-compatible.
// Invariants: a result never falls when a vertex is excluded, up to the tolerance of DiameterTo.
template <int D>
class EmptyBallProgram {
 public:
  // Balls through the origin with centres in `centres`.
  //
  // REQUIRES:   `centres` is bounded and holds the origin.
  explicit EmptyBallProgram(const Box<D>& centres);

  // From now on no ball may hold `u` in its interior.
  //
  // REQUIRES:   u != 0.
  // Complexity: O(1).
  void Exclude(const Point<D>& u);

  // The diameter of the smallest ball that `p` lies in; infinite if there is none.
  //
  // Guarantees: (1) never larger than the exact value, and infinite only where there is no ball; (2) no smaller than
  //             about 1 - 2^-40 times it.
  // Complexity: O(|U|) a pivot; a few times D pivots.
  // Errors:     none.
  // Source:     [HT08] §6; dual active set after Goldfarb and Idnani 1983: it starts at c = 0, which breaks one
  //             constraint, and |c| grows with every pivot to the one optimum of a strictly convex program.
  double DiameterTo(const Point<D>& p) const;

  // The diameter of the smallest ball that some point of `q` lies in; infinite if there is none.
  //
  // Guarantees: (1) as above; (2) no smaller than 1 - 2^-16 times the exact value, or the smallest diameter of balls
  //             that miss q by |x - p|^2 - |x|^2 <= 2^-24 |p| (|p| + 2 |x|), x their centre and p the point of q
  //             nearest to it; where 4000 pieces do not suffice, as it happens from 5-D on, the bound that they prove.
  // Complexity: two programs of the kind above a piece; a few pieces up to D = 3, up to thousands in 6 dimensions.
  // Errors:     none.
  // Source:     [HT08] §6, where this is "a quadratic program rather than a convex one". The conditions on c, sum_i
  //             phi_i(c_i) <= 0 with phi_i(c_i) the least p_i (p_i - 2 c_i) over q, is separable and concave. On a box
  //             of centres chords lie below the phi_i and make the program convex, with an optimum no larger; the box
  //             of the least optimum is split there, where the chords are farthest off, until that optimum keeps the
  //             constraint itself. After Falk and Soland 1969.
  double DiameterTo(const Box<D>& q) const;

  // How many convex programs have been solved.
  uint64_t solved() const { return solved_; }

 private:
  // normal . c >= offset, |normal| = 1.
  struct HalfSpace {
    Point<D> normal;
    double offset;
  };
  struct Optimum {
    double radius;  // at most the exact one
    Point<D> c;
  };
  struct Piece {
    Box<D> centres;
    Optimum optimum;
  };

  static HalfSpace Normalised(const Point<D>& normal, double offset);
  double SetRows(const Box<D>& centres, const HalfSpace& meets) const;
  static int MostBroken(std::span<const HalfSpace> rows, const Point<D>& c);
  Optimum Solve(const Box<D>& centres, const HalfSpace& meets) const;
  static double CertainBound(std::span<const HalfSpace> rows, std::span<const int> active,
                             std::span<const double> weights);
  Optimum Relax(const Box<D>& centres, const Box<D>& q) const;
  Piece PartOf(const Piece& whole, int axis, double split, bool high, double above, const Box<D>& q) const;

  Box<D> centres_;
  std::vector<HalfSpace> bisectors_;
  mutable std::vector<HalfSpace> rows_;  // scratch
  mutable uint64_t solved_ = 0;
};

// The findings of the reference, in their order.
template <int D>
struct ReferenceScan {
  struct Visit {
    NodeId leaf;
    double diameter;  // d_v^U(leaf), U as it was then
  };

  Polytope<D> cell;
  std::vector<Visit> leaves;        // as they were opened
  std::vector<VertexId> neighbors;  // [HT08]'s U, as they were added
  uint64_t programs = 0;            // convex programs solved
};

// The Voronoi cell of `v` in the box, clipped by the cube of half side `radius` about v, like
// QueryStructure::ClippedVoronoi, by the paper's scan: leaves and vertices are put into one queue and are taken in the
// order of d_v^U, U the vertices taken so far.
//
// The paper clips by the ball of radius t about v and knows no box. Here the centres of balls are confined to the box
// and the cube, so that d_v^U is finite for just the balls about points x of the clipped cell; the scan ends when no
// finite distance is queued. Since the cube holds the ball of its half side, the leaves that the paper's scan opens up
// to a clipping distance t <= radius are the visits with diameter < 2 t: a beginning of this scan. (The paper compares
// diameters with t_max = beta NN(v); for centres up to beta NN(v) away, as its Definition 2 has them, it must be twice
// that.)
//
// REQUIRES:   radius > 0.
// Guarantees: (1) the cell is that of ClippedVoronoi, up to the order of planes and nodes; (2) a leaf is opened only if
//             a ball about a point of the cell through v, empty of all vertices, reaches it ([HT08] Lemma 5), up to the
//             tolerance of EmptyBallProgram; (3) diameters of visits ascend, up to the same.
// Complexity: O(k log k) queue operations for k leaves and vertices met, a program or more each; measured, 30 to 130
//             times the time of ClippedVoronoi for D = 2 and 3. For tests.
// Errors:     none.
// Source:     [HT08] Figure 6. A distance in the queue was computed with an earlier U, so it can only have grown; it is
//             brought up to date when it comes first. Squares are neighbours through facets alone, as in
//             ClippedVoronoi.
template <int D>
ReferenceScan<D> ReferenceClippedVoronoi(const QueryStructure<D>& structure, VertexId v, double radius);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VORONOI_REFERENCE_SCAN_H_
