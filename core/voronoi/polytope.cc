#include "core/voronoi/polytope.h"

#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

namespace wellspace::core {
namespace {

constexpr double kUnit = 0x1p-53;  // relative rounding error
constexpr uint16_t kNoNodeIndex = std::numeric_limits<uint16_t>::max();

// Solves normal_j . x = offset_j. Returns the determinant; x is valid unless that is zero.
template <int D>
double Solve(const std::array<const Plane<D>*, D>& planes, Point<D>& x) {
  static_assert(D == 2 || D == 3);
  if constexpr (D == 2) {
    const Point<2>& a = planes[0]->normal;
    const Point<2>& b = planes[1]->normal;
    const double determinant = a[0] * b[1] - a[1] * b[0];
    const double inverse = 1 / determinant;
    x[0] = (planes[0]->offset * b[1] - planes[1]->offset * a[1]) * inverse;
    x[1] = (planes[1]->offset * a[0] - planes[0]->offset * b[0]) * inverse;
    return determinant;
  } else {
    const auto cross = [](const Point<3>& a, const Point<3>& b) {
      return Point<3>{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    const Point<3> bc = cross(planes[1]->normal, planes[2]->normal);
    const Point<3> ca = cross(planes[2]->normal, planes[0]->normal);
    const Point<3> ab = cross(planes[0]->normal, planes[1]->normal);
    const double determinant = Dot<3>(planes[0]->normal, bc);
    const double inverse = 1 / determinant;
    for (int i = 0; i < 3; ++i) {
      x[i] = (planes[0]->offset * bc[i] + planes[1]->offset * ca[i] + planes[2]->offset * ab[i]) * inverse;
    }
    return determinant;
  }
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
  }
  nodes_.resize(1 << D);
  for (int corner = 0; corner < (1 << D); ++corner) {
    CellNode<D>& node = nodes_[corner];
    for (int axis = 0; axis < D; ++axis) {
      const int face = FaceIndex(axis, ((corner >> axis) & 1) != 0);
      node.x[axis] = planes_[face].offset;
      node.planes[axis] = static_cast<uint16_t>(face);
      node.neighbours[axis] = static_cast<uint16_t>(corner ^ (1 << axis));
    }
    node.radius_sq = NormSq<D>(node.x);
    node.slack = 16 * kUnit * std::sqrt(node.radius_sq);
    node.reach = std::sqrt(node.radius_sq) + node.slack;
  }
  UpdateReach();
}

template <int D>
bool Polytope<D>::Cut(VertexId u, const Point<D>& position) {
  Plane<D> plane;
  plane.vertex = u;
  plane.normal = Difference<D>(position, site_);
  const double length_sq = NormSq<D>(plane.normal);
  if (length_sq > CutLimitSq()) {
    return false;
  }
  plane.offset = 0.5 * length_sq;
  plane.length = std::sqrt(length_sq);
  plane.source.generator = position;

  excess_.resize(nodes_.size());
  is_removed_.resize(nodes_.size());
  removed_.clear();
  for (size_t i = 0; i < nodes_.size(); ++i) {
    excess_[i] = Dot<D>(nodes_[i].x, plane.normal) - plane.offset;
    is_removed_[i] = IsCutOff(nodes_[i], excess_[i], plane) ? 1 : 0;
    if (is_removed_[i] != 0) {
      removed_.push_back(static_cast<uint16_t>(i));
    }
  }
  if (removed_.empty()) {
    return false;
  }
  ++cuts_;
  const auto index = static_cast<uint16_t>(planes_.size());
  planes_.push_back(plane);
  MakeNewNodes(index);
  DropRemovedNodes();
  UpdateReach();
  return true;
}

// The sign of excess = x . w - c, where the computed value differs from the exact one by at most slack |w| + 8 u c: the
// error of x is in slack (twice that of a coordinate, and sqrt(D) < 2), w has one rounding a coordinate, the product D
// + 1 more, c D + 3, the difference one; 16 u |x| of the slack pays for those of the product.
template <int D>
bool Polytope<D>::IsCutOff(const CellNode<D>& node, double excess, const Plane<D>& plane) {
  const double error = node.slack * plane.length + 8 * kUnit * plane.offset;
  if (excess > error) {
    return true;
  }
  if (excess < -error) {
    return false;
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

// One new node on each edge between a node that stays and one that goes.
template <int D>
void Polytope<D>::MakeNewNodes(uint16_t plane) {
  const auto first_new = static_cast<uint16_t>(nodes_.size());
  for (const uint16_t removed : removed_) {
    for (int k = 0; k < D; ++k) {
      const uint16_t kept = nodes_[removed].neighbours[k];
      if (is_removed_[kept] != 0) {
        continue;
      }
      const auto index = static_cast<uint16_t>(nodes_.size());
      CellNode<D> node;
      node.planes = nodes_[removed].planes;
      node.planes[k] = plane;
      node.neighbours.fill(kNoNodeIndex);
      node.neighbours[k] = kept;
      Place(node, kept, removed);
      for (uint16_t& back : nodes_[kept].neighbours) {
        if (back == removed) {
          back = index;
          break;
        }
      }
      nodes_.push_back(node);
      is_removed_.push_back(0);
    }
  }
  LinkNewNodes(plane, first_new);
}

// Computes a node's position and its error. With a_j = |n_j|, P = prod a_j and S = sum_j |c_j| P / a_j, the numerators
// are sums of products bounded by S, the determinant by sqrt(D) P; each factor carries at most one rounding (n) or D +
// 3 (c), each product and sum one more: at most 14 u for D <= 3. So, where |det| > 256 u P, a coordinate is wrong by at
// most 18 u (S + |x| P) / |det|; 32 is used. Where the determinant is less sure than that the node is put between the
// ends of its edge, and left to the exact stage.
template <int D>
void Polytope<D>::Place(CellNode<D>& node, uint16_t kept, uint16_t removed) {
  std::array<const Plane<D>*, D> planes;
  double product = 1;
  double sum = 0;
  for (int k = 0; k < D; ++k) {
    planes[k] = &planes_[node.planes[k]];
    product *= planes[k]->length;
    sum += std::abs(planes[k]->offset) / planes[k]->length;
  }
  const double determinant = std::abs(Solve<D>(planes, node.x));
  if (determinant > 256 * kUnit * product) {
    node.radius_sq = NormSq<D>(node.x);
    const double radius = std::sqrt(node.radius_sq);
    node.slack = 64 * kUnit * product * (sum + radius) / determinant + 16 * kUnit * radius;
    node.reach = radius + node.slack;
    return;
  }
  const double span = excess_[removed] - excess_[kept];
  const double t = span > 0 ? std::min(1.0, std::max(0.0, -excess_[kept] / span)) : 0.5;
  for (int i = 0; i < D; ++i) {
    node.x[i] = nodes_[kept].x[i] + t * (nodes_[removed].x[i] - nodes_[kept].x[i]);
  }
  node.radius_sq = std::max(nodes_[kept].radius_sq, nodes_[removed].radius_sq);
  node.reach = std::max(nodes_[kept].reach, nodes_[removed].reach);
  node.slack = std::numeric_limits<double>::infinity();
}

// Joins the new nodes along the edges of the new facet: two are joined if they share D - 2 planes beside the new one.
template <int D>
void Polytope<D>::LinkNewNodes(uint16_t plane, uint16_t first_new) {
  static_assert(D == 2 || D == 3);
  if (open_end_.size() < planes_.size()) {
    open_end_.resize(planes_.size(), End{kNoNodeIndex, 0});
  }
  int open = 0;
  for (auto index = first_new; index < nodes_.size(); ++index) {
    for (uint8_t slot = 0; slot < D; ++slot) {
      if (nodes_[index].planes[slot] == plane) {
        continue;
      }
      // The plane that the edge runs along beside the new one; in 2-D the new plane alone.
      uint16_t along = plane;
      for (int other = 0; other < D && D == 3; ++other) {
        if (other != slot && nodes_[index].planes[other] != plane) {
          along = nodes_[index].planes[other];
        }
      }
      End& end = open_end_[along];
      if (end.node == kNoNodeIndex) {
        end = {index, slot};
        ++open;
      } else {
        nodes_[index].neighbours[slot] = end.node;
        nodes_[end.node].neighbours[end.slot] = index;
        end.node = kNoNodeIndex;
        --open;
      }
    }
  }
  if (open != 0) {
    std::abort();  // exact decisions cannot leave an edge with one end
  }
}

// Moves nodes from the end into the places of removed ones.
template <int D>
void Polytope<D>::DropRemovedNodes() {
  for (const uint16_t hole : removed_) {
    while (!nodes_.empty() && is_removed_[nodes_.size() - 1] != 0) {
      nodes_.pop_back();
    }
    if (hole >= nodes_.size()) {
      return;
    }
    const auto last = static_cast<uint16_t>(nodes_.size() - 1);
    nodes_[hole] = nodes_[last];
    is_removed_[hole] = 0;
    nodes_.pop_back();
    for (const uint16_t neighbour : nodes_[hole].neighbours) {
      for (uint16_t& back : nodes_[neighbour].neighbours) {
        if (back == last) {
          back = hole;
          break;
        }
      }
    }
  }
}

template <int D>
void Polytope<D>::UpdateReach() {
  double reach = 0;
  for (const CellNode<D>& node : nodes_) {
    reach = std::max(reach, node.reach);
  }
  reach_sq_ = reach * reach;
}

template <int D>
bool Polytope<D>::Reaches(const Box<D>& cube) const {
  Point<D> low;
  Point<D> high;
  for (int i = 0; i < D; ++i) {
    low[i] = cube.low[i] - site_[i];
    high[i] = cube.high[i] - site_[i];
  }
  for (const CellNode<D>& node : nodes_) {
    double power = 0;
    for (int i = 0; i < D; ++i) {
      const double p = std::min(std::max(node.x[i], low[i]), high[i]);
      power += p * (p - 2 * node.x[i]);
    }
    // Where the sum is near zero the p that attains it is within 2 |x| of the site, so an error e of x moves it by at
    // most 4 |x| e.
    if (power <= 4 * node.slack * std::sqrt(node.radius_sq)) {
      return true;
    }
  }
  return false;
}

template class Polytope<2>;
template class Polytope<3>;

}  // namespace wellspace::core
