// The interface of a domain to the refinement, and the domain of a cloud: the box.
#ifndef WELLSPACE_CORE_REFINE_BOX_DOMAIN_H_
#define WELLSPACE_CORE_REFINE_BOX_DOMAIN_H_

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "core/base/ids.h"
#include "core/geometry/periodic_box.h"
#include "core/refine/cell_steps.h"
#include "core/refine/insertion.h"
#include "core/refine/step_rules.h"
#include "core/voronoi/extra_vertices.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// A domain is the meshed part of the box of a structure. Refinement and Rounds are templates on it, and know it by the
// names below alone; a domain pays for none that it does not need. A kind is a folder beside core/refine/plane, its
// name where refine.cc, rounds.cc and mesher_of.cc are instantiated, its MesherOf, and a branch of Mesher::Create.
// Where slivers are repaired, sliver_stage.cc is instantiated for it, with its carrier.
//
//   kDimension         int: of its points.
//   Place              The place of a new vertex, beside its position; Nowhere shows the functions.
//   Request            InsertionRequest<kDimension, Place>: an insertion that a cell asks for.
//   Rules              The faults of a cell and its requests, for the criteria of one run. step_rules() are
//                      the rules of the box; NearestFeatureSq(v, limit_sq, workspace) is how far v is from the nearest
//                      feature that it is not on, squared, if that is less than the limit, and else the limit.
//   Expected           The vertices that a batch expects to be inserted, for Rules. Made of their positions and
//                      requests, ExtraVertices<kDimension> and std::vector<Request>, which grow meanwhile.
//   Steps<Cells>       The steps of a vertex, with the functions of CellSteps, made of
//                      (const Rules&, VertexId, double edge_limit_sq, Cells&, StepWorkspace<kDimension>&).
//   kHasFeatures       bool: whether vertices keep away from features, so that NearestFeatureSq has to be asked.
//   kNotifiesAll       bool: whether all neighbours get a notice, so that notices are recorded only where they are
//                      wanted.
//   kAsksForDistances  bool: whether a request depends on all vertices near its point, and not on the cell alone.
//   kMayHaveImages     bool: whether vertices may have images, which are inserted with them; then there are
//                      HasImages(), whether some may in this domain, and ForEachImage(request, f), which calls
//                      f(position, place) for each image of the vertex that is asked for.
//   RulesFor(structure, step_rules, expected)
//                      The Rules of a run, with a null pointer; or for a record, with the vertices its batch expects.
//   LeastInRounds(least, vertices)
//                      How many vertices of a bucket are worth rounds, if it is `least` of them elsewhere, while there
//                      are so many vertices at all.
//   MakeRoom(n)        Makes room for n more vertices. Beside others that read, Added is called so often at most.
//   Added(place)       The vertex after the last has been inserted there.
//   AreInOrder(requests)
//                      Whether recorded requests, those of one vertex, would be the same now, as far as they depend on
//                      more than the vertices near to it.
//   MemoryBytes()      The memory that it takes beside the structure.
//
// A domain is a value; where it has much to know, a handle of that. Its functions but MakeRoom and Added are const, and
// may run at once; RulesFor, and the rules with expected vertices, beside Added, too.
//
// SpaceDomain shows further needs of a domain: a bound of its own for each node, which AssessNodes takes with every
// node; several points for one decision, which Steps return one after the other; and trial cells of points that are no
// vertices, which its rules compute by the structure.
template <typename T>
concept RefinedDomain = requires(T domain, const T& same, const typename T::Place& place,
                                 std::span<const typename T::Request> requests,
                                 const QueryStructure<T::kDimension>& structure, const StepRules<T::kDimension>& rules,
                                 const typename T::Expected* expected, size_t least, uint32_t vertices) {
  { T::kHasFeatures } -> std::convertible_to<bool>;
  { T::kNotifiesAll } -> std::convertible_to<bool>;
  { T::kAsksForDistances } -> std::convertible_to<bool>;
  { T::kMayHaveImages } -> std::convertible_to<bool>;
  { same.RulesFor(structure, rules, expected) } -> std::same_as<typename T::Rules>;
  { same.LeastInRounds(least, vertices) } -> std::same_as<size_t>;
  domain.MakeRoom(least);
  domain.Added(place);
  { same.AreInOrder(requests) } -> std::same_as<bool>;
  { same.MemoryBytes() } -> std::same_as<uint64_t>;
};

// The rules in a box.
//
// Thread safety: as StepRules.
template <int D>
class BoxRules {
 public:
  // REQUIRES:   `rules` outlives this.
  explicit BoxRules(const StepRules<D>& rules) : rules_(rules) {}

  const StepRules<D>& step_rules() const { return rules_; }
  double NearestFeatureSq(VertexId /*v*/, double limit_sq, Workspace<D>& /*workspace*/) const { return limit_sq; }

 private:
  const StepRules<D>& rules_;
};

// The box of a structure, whose faces are known to its cells and to StepRules. Nothing is kept but along which axes it
// is periodic.
//
// Thread safety: thread-safe.
template <int D>
class BoxDomain {
 public:
  static constexpr int kDimension = D;
  using Place = Nowhere;
  using Request = InsertionRequest<D, Place>;
  using Rules = BoxRules<D>;
  template <typename Cells>
  using Steps = CellSteps<D, Cells>;

  // Cells know of expected vertices, and the rules ask for no others.
  struct Expected {
    Expected(const ExtraVertices<D>& /*positions*/, const std::vector<Request>& /*requests*/) {}
  };

  static constexpr bool kHasFeatures = false;
  static constexpr bool kNotifiesAll = false;
  static constexpr bool kAsksForDistances = false;
  static constexpr bool kMayHaveImages = D <= 3;

  // The box is not periodic.
  BoxDomain() = default;

  // REQUIRES:   `periodic` is of the structure's box; each vertex that the structure has when the refinement begins, or
  //             that is added from outside, has its images there.
  explicit BoxDomain(const PeriodicBox<D>& periodic) requires(kMayHaveImages) : periodic_(periodic) {}

  bool HasImages() const requires(kMayHaveImages) { return periodic_.HasAxes(); }
  template <typename F>
  void ForEachImage(const Request& request, F f) const requires(kMayHaveImages) {
    periodic_.ForEachImage(request.point.position, [&](const Point<D>& at) { f(at, Place{}); });
  }

  Rules RulesFor(const QueryStructure<D>& /*structure*/, const StepRules<D>& rules,
                 const Expected* /*expected*/) const {
    return Rules(rules);
  }
  size_t LeastInRounds(size_t least, uint32_t /*vertices*/) const { return least; }
  void MakeRoom(size_t /*vertices*/) {}
  void Added(const Place& /*place*/) {}
  bool AreInOrder(std::span<const Request> /*requests*/) const { return true; }
  uint64_t MemoryBytes() const { return 0; }

 private:
  struct None {};

  [[no_unique_address]] std::conditional_t<kMayHaveImages, PeriodicBox<D>, None> periodic_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_BOX_DOMAIN_H_
