#include "core/voronoi/polytope.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "core/base/dimensions.h"

namespace wellspace::core {
namespace {

constexpr double kUnit = 0x1p-53;  // relative rounding error

// What |w|^2 / 2 contributes to the error of x . w - |w|^2 / 2, relative to itself; see Polytope::Cut.
template <int D>
constexpr double kOffsetError = (D + 5) * kUnit;

// A node in doubles, and a bound on |x - exact x|; infinite where there is none.
template <int D>
struct Placement {
  Point<D> x;
  double error = std::numeric_limits<double>::infinity();
};

// The meeting point of D planes by Cramer's rule, D <= 3.
//
// With a_j = |n_j|, P = prod a_j and S = sum_j |c_j| P / a_j, the numerators are sums of products bounded by S, the
// determinant by sqrt(D) P; each factor carries at most one rounding (n) or D + 3 (c), each product and sum one more: at
// most 14 u for D <= 3. So, where |det| > 256 u P, a coordinate is wrong by at most 18 u (S + |x| P) / |det|, and x by
// sqrt(D) < 2 times that; 64 u is used.
template <int D>
Placement<D> Meet(const std::array<const Plane<D>*, D>& planes) requires(D <= 3) {
  Placement<D> placed;
  double determinant = 0;
  double inverse = 0;
  if constexpr (D == 2) {
    const Point<2>& a = planes[0]->normal;
    const Point<2>& b = planes[1]->normal;
    determinant = a[0] * b[1] - a[1] * b[0];
    inverse = 1 / determinant;
    placed.x[0] = (planes[0]->offset * b[1] - planes[1]->offset * a[1]) * inverse;
    placed.x[1] = (planes[1]->offset * a[0] - planes[0]->offset * b[0]) * inverse;
  } else {
    const auto cross = [](const Point<3>& a, const Point<3>& b) {
      return Point<3>{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    const Point<3> bc = cross(planes[1]->normal, planes[2]->normal);
    const Point<3> ca = cross(planes[2]->normal, planes[0]->normal);
    const Point<3> ab = cross(planes[0]->normal, planes[1]->normal);
    determinant = Dot<3>(planes[0]->normal, bc);
    inverse = 1 / determinant;
    for (int i = 0; i < 3; ++i) {
      placed.x[i] = (planes[0]->offset * bc[i] + planes[1]->offset * ca[i] + planes[2]->offset * ab[i]) * inverse;
    }
  }
  double product = 1;
  double sum = 0;
  for (const Plane<D>* plane : planes) {
    product *= plane->length;
    sum += plane->distance;
  }
  if (std::abs(determinant) > 256 * kUnit * product) {
    placed.error = 64 * kUnit * product * (sum + std::sqrt(NormSq<D>(placed.x))) * std::abs(inverse);
  }
  return placed;
}

// The same by an approximate inverse and the residual, D > 3.
//
// Divide each plane by the length of its normal as computed, which is as good a scale as the exact one: A x = c, and let
// A*, c*, x* be the exact ones. The rows of A carry at most 3 u each (difference, quotient; with lengths a few u off 1),
// c at most (D + 6) u |c|, in norm. Let Y be any matrix and F = |Y A - I| in the Frobenius norm, computed with an error
// below (D + 1) u (|Y| |A| + sqrt(D)) < (2 D + 4) u |Y| |A|, |A| = sqrt(D), since sqrt(D) <= |Y| |A| + F; that of A* adds
// 3 u |Y| sqrt(D). If F* <= 1/2 then |A*^-1| <= 2 |Y|. The residual r = A x - c, computed with an error below (D + 2) u
// (|a_j| |x| + |c_j|) in each component, differs from A* x - c* by 3 u |x| + (D + 6) u |c_j| more; so |x - x*| <= 2 |Y|
// (|r| + (2 D + 10) u sqrt(D) (|x| + max |c|)).
template <int D>
Placement<D> Meet(const std::array<const Plane<D>*, D>& planes) requires(D > 3) {
  std::array<Point<D>, D> a;
  Point<D> c;
  double largest_offset = 0;
  for (int j = 0; j < D; ++j) {
    for (int i = 0; i < D; ++i) {
      a[j][i] = planes[j]->normal[i] / planes[j]->length;
    }
    c[j] = planes[j]->offset / planes[j]->length;
    largest_offset = std::max(largest_offset, std::abs(c[j]));
  }
  // Gauss and Jordan with row pivots turn the left half into I and the right half into Y.
  std::array<std::array<double, 2 * D>, D> m{};
  for (int j = 0; j < D; ++j) {
    std::copy(a[j].begin(), a[j].end(), m[j].begin());
    m[j][D + j] = 1;
  }
  for (int k = 0; k < D; ++k) {
    int pivot = k;
    for (int j = k + 1; j < D; ++j) {
      pivot = std::abs(m[j][k]) > std::abs(m[pivot][k]) ? j : pivot;
    }
    if (m[pivot][k] == 0) {
      return {};
    }
    std::swap(m[k], m[pivot]);
    const double inverse = 1 / m[k][k];
    for (int i = k; i < 2 * D; ++i) {
      m[k][i] *= inverse;
    }
    for (int j = 0; j < D; ++j) {
      const double factor = m[j][k];
      for (int i = k; i < 2 * D && j != k; ++i) {
        m[j][i] -= factor * m[k][i];
      }
    }
  }
  Placement<D> placed;
  double inverse_sq = 0;
  double defect_sq = 0;
  for (int i = 0; i < D; ++i) {
    placed.x[i] = 0;
    for (int j = 0; j < D; ++j) {
      placed.x[i] += m[i][D + j] * c[j];
      inverse_sq += m[i][D + j] * m[i][D + j];
      double entry = i == j ? -1 : 0;
      for (int k = 0; k < D; ++k) {
        entry += m[i][D + k] * a[k][j];
      }
      defect_sq += entry * entry;
    }
  }
  const double root = std::sqrt(static_cast<double>(D));
  const double inverse_norm = std::sqrt(inverse_sq);
  if (!(std::sqrt(defect_sq) + (2 * D + 8) * kUnit * root * inverse_norm < 0.5)) {
    return placed;
  }
  double residual_sq = 0;
  for (int j = 0; j < D; ++j) {
    const double r = Dot<D>(a[j], placed.x) - c[j];
    residual_sq += r * r;
  }
  // One more part in a hundred pays for the roundings of the bound itself.
  placed.error =
      2.02 * inverse_norm *
      (std::sqrt(residual_sq) + (2 * D + 10) * kUnit * root * (std::sqrt(NormSq<D>(placed.x)) + largest_offset));
  return placed;
}

}  // namespace

template <int D>
void Polytope<D>::Reset(const Point<D>& site, const Box<D>& bounds, const std::array<PlaneKind, 2 * D>& kinds,
                        TieRule rule) {
  site_ = site;
  rule_ = rule;
  cuts_ = 0;
  counters_ = {};
  planes_.assign(2 * D, {});
  for (int face = 0; face < 2 * D; ++face) {
    const int axis = face / 2;
    Plane<D>& plane = planes_[face];
    plane.kind = kinds[face];
    plane.face = static_cast<uint8_t>(face);
    plane.normal = {};
    plane.normal[axis] = 1;
    plane.length = 1;
    plane.source.axis = axis;
    plane.source.coordinate = bounds.FaceCoordinate(face);
    plane.offset = plane.source.coordinate - site[axis];
    plane.distance = std::abs(plane.offset);
  }
  nodes_.resize(1 << D);
  columns_.Resize(nodes_.size());
  for (int corner = 0; corner < (1 << D); ++corner) {
    CellNode<D>& node = nodes_[corner];
    for (int axis = 0; axis < D; ++axis) {
      const int face = FaceIndex(axis, ((corner >> axis) & 1) != 0);
      node.x[axis] = planes_[face].offset;
      node.planes[axis] = static_cast<uint16_t>(face);
      node.neighbours[axis] = static_cast<Index>(corner ^ (1 << axis));
    }
    node.radius_sq = NormSq<D>(node.x);
    node.slack = 16 * kUnit * std::sqrt(node.radius_sq);
    node.reach = std::sqrt(node.radius_sq) + node.slack;
    columns_.Set(corner, node.x, node.slack, node.reach);
  }
  UpdateReach();
}

template <int D>
void Polytope<D>::CopyFrom(const Polytope& other) {
  site_ = other.site_;
  rule_ = other.rule_;
  reach_sq_ = other.reach_sq_;
  largest_slack_ = other.largest_slack_;
  planes_ = other.planes_;
  nodes_ = other.nodes_;
  columns_ = other.columns_;
  cuts_ = other.cuts_;
  counters_ = other.counters_;
}

template <int D>
bool Polytope<D>::Cut(VertexId u, const Point<D>& position) {
  const Point<D> normal = Difference<D>(position, site_);
  const double length_sq = NormSq<D>(normal);
  if (length_sq > CutLimitSq()) {
    return false;
  }
  // The excess x . w - c of a node x, as computed, differs from the exact one by at most slack |w| + (D + 5) u c: the error
  // of x is in slack, w has one rounding a coordinate, the product D more, c D + 2, the difference one; 16 u |x| of the
  // slack pays for those of the product.
  const double length = std::sqrt(length_sq);
  const double offset = 0.5 * length_sq;
  const double offset_error = kOffsetError<D> * offset;
  if (!columns_.ComputeExcesses(normal, offset, length, offset_error)) {
    return false;
  }
  Plane<D> plane;
  plane.vertex = u;
  plane.normal = normal;
  plane.offset = offset;
  plane.length = length;
  plane.distance = 0.5 * length;
  plane.source.generator = position;
  removed_.resize(columns_.padded_count());
  const size_t exceeding = columns_.FindExceeding(removed_.data());
  size_t count = 0;
  for (size_t j = 0; j < exceeding; ++j) {
    const Index i = removed_[j];
    if (IsCutOff(nodes_[i], columns_.excess(i), nodes_[i].slack * length + offset_error, plane)) {
      removed_[count++] = i;
    }
  }
  removed_.resize(count);
  if (count == 0) {
    return false;
  }
  is_removed_.resize(std::max(is_removed_.size(), nodes_.size()), 0);
  for (const Index i : removed_) {
    is_removed_[i] = 1;
  }
  ++cuts_;
  const auto index = static_cast<uint16_t>(planes_.size());
  planes_.push_back(plane);
  FindCutEdges();
  MakeNewNodes(index);
  UpdateReach();
  return true;
}

// Whether a node is cut off whose excess may be above -error.
template <int D>
bool Polytope<D>::IsCutOff(const CellNode<D>& node, double excess, double error, const Plane<D>& plane) {
  if (excess > error) {
    return true;
  }
  std::array<PlaneSource<D>, D> sources;
  for (int k = 0; k < D; ++k) {
    sources[k] = planes_[node.planes[k]].source;
  }
  const ExactDecision decision = DecideCut<D>(site_, sources, plane.source.generator, rule_);
  ++counters_.exact;
  counters_.perturbed += decision.perturbed ? 1 : 0;
  return decision.sign == Sign::kPositive;
}

template <int D>
void Polytope<D>::FindCutEdges() {
  cut_edges_.resize(removed_.size() * D);
  size_t count = 0;
  for (const Index removed : removed_) {
    const CellNode<D>& node = nodes_[removed];
    for (uint8_t k = 0; k < D; ++k) {
      // No branch, since none could be foretold: about half of the neighbours are kept.
      const Index kept = node.neighbours[k];
      const auto& back = nodes_[kept].neighbours;
      uint8_t kept_slot = 0;
      for (uint8_t i = 1; i < D; ++i) {
        kept_slot = back[i] == removed ? i : kept_slot;
      }
      cut_edges_[count] = {node.planes, k, kept_slot, kept};
      count += is_removed_[kept] == 0 ? 1 : 0;
    }
  }
  cut_edges_.resize(count);
}

// One new node on each cut edge. They take the places of removed nodes, the last one that of the first, and what is left
// over goes to the end; so the nodes stay without holes.
template <int D>
void Polytope<D>::MakeNewNodes(uint16_t plane) {
  const size_t count = cut_edges_.size();
  const size_t old = nodes_.size();
  const size_t appended = count - std::min(count, removed_.size());
  for (size_t j = 0; j < appended; ++j) {
    nodes_.push_back(nodes_.back());  // any node: resize would be slower
  }
  columns_.Resize(nodes_.size());
  new_.resize(count);
  for (size_t j = 0; j < count; ++j) {
    const CutEdge& edge = cut_edges_[j];
    const Index index = j < appended ? static_cast<Index>(old + j) : removed_[count - 1 - j];
    new_[j] = index;
    CellNode<D>& node = nodes_[index];
    // The new plane takes its place among the others, which are in order.
    std::array<uint16_t, D - 1> others;
    size_t slot = 0;
    for (size_t k = 0; k < D - 1; ++k) {
      others[k] = edge.planes[k + (k >= edge.slot ? 1 : 0)];
      slot += planes_[others[k]].vertex < planes_[plane].vertex ? 1 : 0;
    }
    node.planes[slot] = plane;
    for (size_t k = 0; k < D - 1; ++k) {
      node.planes[k + (k >= slot ? 1 : 0)] = others[k];
    }
    node.neighbours.fill(kNoNode);
    node.neighbours[slot] = edge.kept;
    Place(node);
    columns_.Set(index, node.x, node.slack, node.reach);
    nodes_[edge.kept].neighbours[edge.kept_slot] = index;
  }
  LinkNewNodes(plane);
  if (count < removed_.size()) {
    FillHoles(count);
  }
  for (const Index i : removed_) {
    is_removed_[i] = 0;
  }
}

// Moves nodes from the end into the places of those removed nodes that have not been `filled` by new ones.
template <int D>
void Polytope<D>::FillHoles(size_t filled) {
  for (size_t i = 0; i < filled; ++i) {
    is_removed_[removed_[i]] = 0;
  }
  for (size_t i = filled; i < removed_.size(); ++i) {
    const Index hole = removed_[i];
    while (is_removed_[nodes_.size() - 1] != 0) {
      nodes_.pop_back();
    }
    if (hole >= nodes_.size()) {
      break;
    }
    const auto last = static_cast<Index>(nodes_.size() - 1);
    nodes_[hole] = nodes_[last];
    is_removed_[hole] = 0;
    nodes_.pop_back();
    columns_.Set(hole, nodes_[hole].x, nodes_[hole].slack, nodes_[hole].reach);
    for (const Index neighbour : nodes_[hole].neighbours) {
      for (Index& back : nodes_[neighbour].neighbours) {
        if (back == last) {
          back = hole;
          break;
        }
      }
    }
  }
  columns_.Resize(nodes_.size());
}

// Computes a node's position and its error; exactly where the planes are too nearly dependent for a bound.
template <int D>
void Polytope<D>::Place(CellNode<D>& node) const {
  std::array<const Plane<D>*, D> planes;
  for (int k = 0; k < D; ++k) {
    planes[k] = &planes_[node.planes[k]];
  }
  Placement<D> placed = Meet<D>(planes);
  if (!std::isfinite(placed.error)) {
    std::array<PlaneSource<D>, D> sources;
    for (int k = 0; k < D; ++k) {
      sources[k] = planes[k]->source;
    }
    placed.x = ExactMeetingPoint<D>(site_, sources);
    placed.error = 8 * kUnit * std::sqrt(NormSq<D>(placed.x));
  }
  node.x = placed.x;
  node.radius_sq = NormSq<D>(node.x);
  const double radius = std::sqrt(node.radius_sq);
  node.slack = placed.error + 16 * kUnit * radius;
  node.reach = radius + node.slack;
}

// Joins the new nodes along the edges of the new facet: two are joined if they share D - 2 planes beside the new one.
// Exact decisions leave no edge with one end.
template <int D>
void Polytope<D>::LinkNewNodes(uint16_t plane) {
  if constexpr (D <= 3) {
    // The other plane numbers the edges; in 2-D there is one edge, which runs along the new plane alone.
    if (open_end_.size() < planes_.size()) {
      open_end_.resize(planes_.size());
    }
    int open = 0;
    for (const Index index : new_) {
      for (uint8_t slot = 0; slot < D; ++slot) {
        if (nodes_[index].planes[slot] == plane) {
          continue;
        }
        uint16_t along = plane;
        for (int other = 0; other < D && D == 3; ++other) {
          if (other != slot && nodes_[index].planes[other] != plane) {
            along = nodes_[index].planes[other];
          }
        }
        End& end = open_end_[along];
        if (end.node == kNoNode) {
          end = {index, slot};
          ++open;
        } else {
          Join({index, slot}, end);
          end = {};
          --open;
        }
      }
    }
    if (open != 0) {
      std::abort();
    }
  } else {
    ridges_.clear();
    for (const Index index : new_) {
      for (uint8_t slot = 0; slot < D; ++slot) {
        if (nodes_[index].planes[slot] == plane) {
          continue;
        }
        static_assert(D <= 6);
        std::array<uint16_t, D - 2> along;
        int count = 0;
        for (int other = 0; other < D; ++other) {
          if (other != slot && nodes_[index].planes[other] != plane) {
            along[count++] = nodes_[index].planes[other];
          }
        }
        std::sort(along.begin(), along.end());
        Ridge ridge{0, {index, slot}};
        for (const uint16_t each : along) {
          ridge.planes = ridge.planes << 16 | each;
        }
        ridges_.push_back(ridge);
      }
    }
    std::sort(ridges_.begin(), ridges_.end(), [](const Ridge& a, const Ridge& b) { return a.planes < b.planes; });
    if (ridges_.size() % 2 != 0) {
      std::abort();
    }
    for (size_t i = 0; i < ridges_.size(); i += 2) {
      if (ridges_[i].planes != ridges_[i + 1].planes) {
        std::abort();
      }
      Join(ridges_[i].end, ridges_[i + 1].end);
    }
  }
}

template <int D>
void Polytope<D>::Join(End a, End b) {
  nodes_[a.node].neighbours[a.slot] = b.node;
  nodes_[b.node].neighbours[b.slot] = a.node;
}

template <int D>
void Polytope<D>::UpdateReach() {
  const auto [reach, slack] = columns_.FindLargest();
  reach_sq_ = reach * reach;
  largest_slack_ = slack;
}

// As in Cut, with the largest slack.
template <int D>
void Polytope<D>::Foretell(CandidateColumns<D>& candidates) const {
  columns_.ComputeMost(largest_slack_, kOffsetError<D>, candidates);
}

template <int D>
bool Polytope<D>::Reaches(const Box<D>& cube) const {
  return columns_.Reaches(Difference<D>(cube.low, site_), Difference<D>(cube.high, site_));
}

#define WELLSPACE_INSTANTIATE(D) template class Polytope<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
