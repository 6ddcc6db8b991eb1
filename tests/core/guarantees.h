// The guarantees of docs/design/guarantees.md, checked at each insertion by looks at all vertices.
#ifndef WELLSPACE_TESTS_CORE_GUARANTEES_H_
#define WELLSPACE_TESTS_CORE_GUARANTEES_H_

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "core/refine/refine.h"

namespace wellspace::test {

// lfs of docs/design/guarantees.md: the least r such that two features that do not meet are within r of x. Features are
// the points that refinement began with, among them the corners, and the faces of the box.
template <int D>
double FeatureSize(const core::Box<D>& box, const std::vector<core::Point<D>>& features, const core::Point<D>& x);

// lfs(x) <= away r(x) for a vertex x that no face had a part in; lfs(x) <= touched[k] r(x) for one on k faces.
template <int D>
struct SizeConstants {
  double away = 0;
  std::array<double, D> touched{};

  static SizeConstants Of(const core::MeshCriteria<D>& criteria);
};

// The edges of Definition 1 (2): the shortest edge that a vertex asks for something by.
struct PendingEdges {
  struct Edge {
    double length = std::numeric_limits<double>::infinity();
    uint32_t vertex = 0;
  };
  Edge inner;  // of a simplex (radius-edge) or a vertex (well-spaced) that breaks rho, at a vertex that lies on no face
  Edge outer;  // the same at one that does
  Edge face;   // the distance of a vertex from a face that its cell touches
};

// The least of each over all vertices, from whole cells by brute force.
template <int D>
PendingEdges ShortestPending(const core::QueryStructure<D>& structure, const core::MeshCriteria<D>& criteria);

// An observer of refinements. The first guarantee that does not hold is kept in violation().
template <int D>
class GuaranteeChecker {
 public:
  // The extent of the checks: so that nothing is passed because there was nothing to check.
  struct Seen {
    int insertions = 0;
    int on_faces = 0;    // of these, points of faces
    int away = 0;        // of these, vertices that no face had a part in
    int orders = 0;      // insertions for which Definition 1 (2) was checked
    double reached = 0;  // the largest lfs(x) / (c r(x)) away from the boundary
    double touched = 0;  // the largest lfs(x) / (C_k r(x)) of the others
  };

  // Condition (2) is checked after each `stride` insertions; after half as many as there were so far, if that is more.
  GuaranteeChecker(const core::QueryStructure<D>& before, const core::MeshCriteria<D>& criteria, int stride);

  void Observe(const core::QueryStructure<D>& structure, const core::Insertion& insertion);

  const std::string& violation() const { return violation_; }
  const Seen& seen() const { return seen_; }

 private:
  struct Origin {
    double feature_size = 0;
    bool is_away = true;  // no face of the box had a part in it
  };

  void CheckPlace(const core::QueryStructure<D>& structure, const core::Insertion& insertion);
  void CheckSize(const core::QueryStructure<D>& structure, const core::Insertion& insertion);
  void CheckOrder(const core::Insertion& insertion);
  template <typename... Text>
  void Expect(bool holds, const core::Insertion& insertion, const Text&... text);

  const core::MeshCriteria<D> criteria_;
  const int stride_;
  int next_sample_;
  const SizeConstants<D> constants_;
  std::vector<core::Point<D>> features_;
  std::vector<Origin> origins_;
  PendingEdges pending_;
  bool has_pending_ = false;
  std::string violation_;
  Seen seen_;
};

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_CORE_GUARANTEES_H_
