#include "tests/core/guarantees.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "tests/support/brute_force.h"

namespace wellspace::test {
namespace {

using core::Box;
using core::CellNode;
using core::Criterion;
using core::Index;
using core::Insertion;
using core::MeshCriteria;
using core::Plane;
using core::PlaneKind;
using core::Point;
using core::Polytope;
using core::QueryStructure;
using core::Reason;
using core::VertexId;

constexpr double kNone = std::numeric_limits<double>::infinity();

// The clip of a cell relative to the longest edge of its bucket.
double ClipFactor(double rho) { return std::max(4.0, 1.25 * rho); }

// Definition 1 (2): nothing is pending whose edge is shorter than this times the one that asks. At vertices of faces,
// which may learn of a new vertex late, it is less, and in proportion to the reach of a cell.
constexpr double kGamma = 1 / std::numbers::sqrt2;
constexpr double kGammaOuter = 0.25 / std::numbers::sqrt2;
constexpr double kGammaFace = 0.5 / std::numbers::sqrt2;

// The error of a distance by the rounding of coordinates.
template <int D>
double Rounding(const Box<D>& box) {
  double largest = 0;
  for (int k = 0; k < D; ++k) {
    largest = std::max({largest, std::abs(box.low[k]), std::abs(box.high[k])});
  }
  return 0x1p-49 * largest;
}

// The nearest vertices that are sorted before the others are looked at.
constexpr std::ptrdiff_t kFirst = 48;

// The cell of `v` in the box: all vertices, from near to far, as long as they can cut it. Returns the distance to the
// nearest.
template <int D>
double WholeCell(const QueryStructure<D>& structure, VertexId v, std::vector<std::pair<double, uint32_t>>& others,
                 Polytope<D>& cell) {
  std::array<PlaneKind, 2 * D> kinds;
  kinds.fill(PlaneKind::kFace);
  cell.Reset(structure.point(v), structure.box(), kinds, core::TieRule::kKeep);
  others.clear();
  for (uint32_t u = 0; u < structure.vertex_count(); ++u) {
    if (VertexId{u} != v) {
      others.emplace_back(core::DistanceSq<D>(structure.point(VertexId{u}), structure.point(v)), u);
    }
  }
  const auto cut = [&](auto first, auto last) {
    std::sort(first, last);
    for (; first != last && first->first <= cell.CutLimitSq(); ++first) {
      cell.Cut(VertexId{first->second}, structure.point(VertexId{first->second}));
    }
  };
  const auto middle = others.begin() + std::min<std::ptrdiff_t>(kFirst, std::ssize(others));
  std::nth_element(others.begin(), middle, others.end());
  cut(others.begin(), middle);
  const auto last =
      std::partition(middle, others.end(), [&](const auto& other) { return other.first <= cell.CutLimitSq(); });
  cut(middle, last);
  return std::sqrt(others[0].first);
}

}  // namespace

template <int D>
double FeatureSize(const Box<D>& box, const std::vector<Point<D>>& features, const Point<D>& x) {
  double least = LocalFeatureSize<D>(box, features, x);
  for (int k = 0; k < D; ++k) {
    least = std::min(least, std::max(x[k] - box.low[k], box.high[k] - x[k]));
  }
  return least;
}

template <int D>
SizeConstants<D> SizeConstants<D>::Of(const MeshCriteria<D>& criteria) {
  const double rho = criteria.rho;
  const double own = criteria.criterion == Criterion::kWellSpaced ? 1 + 1 / rho : 1;
  SizeConstants constants;
  constants.away = own / (1 - 1 / rho);
  // touched[0] = own + touched[D-1] / rho; touched[k] = sqrt 2 touched[k-1] + 1.
  double factor = 1;
  double added = 0;
  for (int k = 1; k < D; ++k) {
    factor *= std::sqrt(2.0);
    added = std::sqrt(2.0) * added + 1;
  }
  if (!criteria.sizes.IsUnbounded()) {  // these may ask for more than the features do
    constants.away = kNone;
    factor = kNone;
  }
  const double most = factor < rho ? (factor * own + added) / (1 - factor / rho) : kNone;
  constants.touched[0] = own + most / rho;
  for (int k = 1; k < D; ++k) {
    constants.touched[k] = std::sqrt(2.0) * constants.touched[k - 1] + 1;
  }
  return constants;
}

template <int D>
PendingEdges ShortestPending(const QueryStructure<D>& structure, const MeshCriteria<D>& criteria) {
  PendingEdges pending;
  Polytope<D> cell;
  std::vector<std::pair<double, uint32_t>> others;
  for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
    const double nearest = WholeCell<D>(structure, VertexId{v}, others, cell);
    for (const CellNode<D>& node : cell.nodes()) {
      double edge = kNone;
      bool is_circumcenter = true;
      for (const uint16_t index : node.planes) {
        const Plane<D>& plane = cell.plane(index);
        if (plane.kind == PlaneKind::kBisector) {
          edge = std::min(edge, plane.length);
          continue;
        }
        is_circumcenter = false;
        if (((structure.faces(VertexId{v}) >> plane.face) & 1) == 0) {
          const double distance = structure.box().DistanceToFace(structure.point(VertexId{v}), plane.face);
          if (distance < pending.face.length) {
            pending.face = {distance, v};
          }
        }
      }
      if (criteria.criterion == Criterion::kWellSpaced) {
        edge = nearest;
      }
      PendingEdges::Edge& shortest = structure.faces(VertexId{v}) == 0 ? pending.inner : pending.outer;
      if (is_circumcenter && std::sqrt(node.radius_sq) > criteria.rho * edge * (1 + 1e-9) && edge < shortest.length) {
        shortest = {edge, v};
      }
    }
  }
  return pending;
}

template <int D>
GuaranteeChecker<D>::GuaranteeChecker(const QueryStructure<D>& before, const MeshCriteria<D>& criteria, int stride)
    : criteria_(criteria), stride_(stride), next_sample_(stride), constants_(SizeConstants<D>::Of(criteria)) {
  for (uint32_t v = 0; v < before.vertex_count(); ++v) {
    features_.push_back(before.point(VertexId{v}));
  }
  for (const Point<D>& p : features_) {
    origins_.push_back({FeatureSize<D>(before.box(), features_, p), true});
  }
}

template <int D>
template <typename... Text>
void GuaranteeChecker<D>::Expect(bool holds, const Insertion& insertion, const Text&... text) {
  if (!holds && violation_.empty()) {
    violation_ =
        absl::StrCat("vertex ", Index(insertion.vertex), ", added for vertex ", Index(insertion.near), ": ", text...);
  }
}

template <int D>
void GuaranteeChecker<D>::Observe(const QueryStructure<D>& structure, const Insertion& insertion) {
  Expect(Index(insertion.vertex) == origins_.size() && structure.vertex_count() == origins_.size() + 1, insertion,
         "one vertex a step");
  if (!violation_.empty()) {
    return;
  }
  CheckSize(structure, insertion);
  CheckPlace(structure, insertion);
  if (has_pending_) {
    CheckOrder(insertion);
  }
  has_pending_ = ++seen_.insertions >= next_sample_;
  if (has_pending_) {
    next_sample_ = seen_.insertions + std::max(stride_, seen_.insertions / 2);
    pending_ = ShortestPending<D>(structure, criteria_);
  }
}

// Definition 1 (1), and the empty ball.
template <int D>
void GuaranteeChecker<D>::CheckPlace(const QueryStructure<D>& structure, const Insertion& insertion) {
  const Point<D>& x = structure.point(insertion.vertex);
  const int faces = std::popcount(structure.faces(insertion.vertex));
  const double limit = std::sqrt(insertion.edge_limit_sq);
  const double edge = std::sqrt(insertion.edge_sq);
  const double radius = std::sqrt(insertion.empty_radius_sq);
  const double from_near = std::sqrt(core::DistanceSq<D>(x, structure.point(insertion.near)));
  const double from_other =
      insertion.other != core::kNoVertex ? std::sqrt(core::DistanceSq<D>(x, structure.point(insertion.other))) : kNone;
  const double slack = 1e-9 * from_near + Rounding<D>(structure.box());
  const bool encroaches = insertion.reason == Reason::kEncroachment;
  seen_.on_faces += faces > 0 ? 1 : 0;

  double nearest = kNone;
  for (uint32_t w = 0; w < Index(insertion.vertex); ++w) {
    nearest = std::min(nearest, core::DistanceSq<D>(x, structure.point(VertexId{w})));
  }
  nearest = std::sqrt(nearest);
  Expect(structure.box().Contains(x), insertion, "it is outside the box");
  Expect(nearest >= radius - slack, insertion, "its ball of radius ", radius, " holds a vertex at ", nearest);

  // The candidate was at least this far; each face that it was projected on takes a factor sqrt 2, or the box is thin.
  const double least = encroaches ? edge : criteria_.rho * edge;
  const int projections = encroaches ? faces - 1 : faces;
  const double thin = structure.box().ShortestSide() * std::pow(2.0, -0.5 * (D - 2));
  Expect(radius >= std::min(least * std::pow(2.0, -0.5 * projections), thin) - slack, insertion, "its distance ",
         radius, " is too small for ", least, " and ", projections, " projections");
  if (faces == 0) {
    // For a triangle it may be in the cell of the other end of the edge.
    const bool may_be_of_other =
        D == 2 && insertion.reason == Reason::kRatio && criteria_.criterion == Criterion::kRadiusEdge;
    const double from_site = may_be_of_other ? std::min(from_near, from_other) : from_near;
    Expect(std::abs(from_site - nearest) <= slack, insertion, "it is not in the cell, ", from_site, " instead of ",
           nearest, " away");
    Expect(from_near >= least - slack, insertion, "at ", from_near, " it is nearer than ", least);
  }
  const double most = std::sqrt(D) * ClipFactor(criteria_.rho) * limit;
  Expect(from_near <= most + std::sqrt(std::max(0.0, most * most - radius * radius)) + slack, insertion, "at ",
         from_near, " it is farther than a node can be, ", most);
  if (insertion.reason == Reason::kRatio && criteria_.criterion == Criterion::kRadiusEdge &&
      structure.faces(insertion.near) == 0) {
    Expect(edge >= kGamma * limit * (1 - 1e-9), insertion, "edge ", edge, " is of an earlier bucket than that of ",
           limit);
  }
  Expect(encroaches || edge <= limit * (1 + 1e-9), insertion, "edge ", edge, " is of a later bucket than that of ",
         limit);
}

template <int D>
void GuaranteeChecker<D>::CheckSize(const QueryStructure<D>& structure, const Insertion& insertion) {
  const Point<D>& x = structure.point(insertion.vertex);
  const int faces = std::popcount(structure.faces(insertion.vertex));
  Origin origin;
  const double radius = std::sqrt(insertion.empty_radius_sq);
  origin.feature_size = FeatureSize<D>(structure.box(), features_, x);
  origin.is_away = false;
  if (faces == 0 && insertion.reason == Reason::kRatio) {
    // The other end of the edge that asked: for well-spaced, the nearest vertex.
    VertexId other = insertion.other;
    if (criteria_.criterion == Criterion::kWellSpaced) {
      double nearest = kNone;
      for (uint32_t w = 0; w < Index(insertion.vertex); ++w) {
        const double distance = core::DistanceSq<D>(structure.point(insertion.near), structure.point(VertexId{w}));
        if (VertexId{w} != insertion.near && distance < nearest) {
          nearest = distance;
          other = VertexId{w};
        }
      }
    }
    origin.is_away = other != core::kNoVertex && origins_[std::max(Index(insertion.near), Index(other))].is_away;
  }
  const double ratio = origin.feature_size / radius;
  const double slack = 1 + 1e-9 + Rounding<D>(structure.box()) / radius;
  const double bound = origin.is_away ? constants_.away : constants_.touched[faces];
  seen_.away += origin.is_away ? 1 : 0;
  double& reached = origin.is_away ? seen_.reached : seen_.touched;
  reached = std::max(reached, ratio / bound);
  Expect(ratio <= bound * slack, insertion, "lfs = ", origin.feature_size, " is ", ratio, " times its distance ",
         radius, " from older vertices, the bound ", bound, ", on ", faces, " faces");
  for (uint32_t w = 0; w < Index(insertion.vertex); ++w) {
    const double distance = std::sqrt(core::DistanceSq<D>(x, structure.point(VertexId{w})));
    const double at = origins_[w].feature_size / distance;
    Expect(at <= (1 + bound) * slack, insertion, "vertex ", w, " with lfs = ", origins_[w].feature_size, " is only ",
           distance, " away; the bound is 1 + ", bound);
  }
  origins_.push_back(origin);
}

// Definition 1 (2): the edges that waited just before the insertion.
template <int D>
void GuaranteeChecker<D>::CheckOrder(const Insertion& insertion) {
  const double edge = std::min(std::sqrt(insertion.edge_sq), std::sqrt(insertion.edge_limit_sq));
  ++seen_.orders;
  const auto expect = [&](const PendingEdges::Edge& pending, double gamma, const char* what) {
    Expect(pending.length >= gamma * edge * (1 - 1e-9), insertion, "an edge of ", edge, " asked, while vertex ",
           pending.vertex, " was pending for ", what, " ", pending.length);
  };
  expect(pending_.inner, kGamma, "one of");
  expect(pending_.outer, kGammaOuter / ClipFactor(criteria_.rho), "one of");
  expect(pending_.face, kGammaFace, "a face at");
}

#define WELLSPACE_INSTANTIATE(D)                                                                \
  template double FeatureSize<D>(const Box<D>&, const std::vector<Point<D>>&, const Point<D>&); \
  template struct SizeConstants<D>;                                                             \
  template PendingEdges ShortestPending<D>(const QueryStructure<D>&, const MeshCriteria<D>&);   \
  template class GuaranteeChecker<D>
WELLSPACE_INSTANTIATE(2);
WELLSPACE_INSTANTIATE(3);
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::test
