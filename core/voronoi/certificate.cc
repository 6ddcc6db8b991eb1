#include "core/voronoi/certificate.h"

#include <algorithm>
#include <array>
#include <bit>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"

namespace wellspace::core {
namespace {

// 512 bits are kept inside the object: enough for most cells without any allocation.
using Integer = boost::multiprecision::number<
    boost::multiprecision::cpp_int_backend<512, 0, boost::multiprecision::signed_magnitude,
                                           boost::multiprecision::unchecked>,
    boost::multiprecision::et_off>;

template <int D>
using IntegerVector = std::array<Integer, D>;

// The exponent of a double's last bit that is set; the largest int for zero.
int LastBit(double value) {
  if (value == 0) {
    return std::numeric_limits<int>::max();
  }
  int exponent = 0;
  const auto mantissa = static_cast<int64_t>(std::ldexp(std::frexp(value, &exponent), 53));
  return exponent - 53 + std::countr_zero(static_cast<uint64_t>(mantissa));
}

// value / 2^exponent.
//
// REQUIRES:   exponent <= LastBit(value).
Integer ToInteger(double value, int exponent) {
  if (value == 0) {
    return 0;
  }
  int high = 0;
  const auto mantissa = static_cast<int64_t>(std::ldexp(std::frexp(value, &high), 53));
  const int shift = high - 53 - exponent;
  const Integer magnitude = std::abs(mantissa);
  const Integer scaled = shift >= 0 ? Integer(magnitude << shift) : Integer(magnitude >> -shift);
  return mantissa < 0 ? Integer(-scaled) : scaled;
}

// numerator / denominator * 2^exponent, within a relative error of 2^-50.
//
// REQUIRES:   denominator > 0.
double Rounded(const Integer& numerator, const Integer& denominator, int exponent) {
  if (numerator == 0) {
    return 0;
  }
  const Integer magnitude = abs(numerator);
  const int shift = static_cast<int>(msb(denominator)) - static_cast<int>(msb(magnitude)) + 60;
  const Integer quotient =
      shift >= 0 ? Integer((magnitude << shift) / denominator) : Integer(magnitude / (denominator << -shift));
  const auto head = static_cast<double>(static_cast<uint64_t>(quotient));  // at most 61 bits
  return std::ldexp(numerator < 0 ? -head : head, exponent - shift);
}

template <int D>
Integer Product(const IntegerVector<D>& a, const IntegerVector<D>& b) {
  Integer sum = a[0] * b[0];
  for (int i = 1; i < D; ++i) {
    sum += a[i] * b[i];
  }
  return sum;
}

// A plane relative to the site, in units of the grid: normal . y <= offset for y = 2 x, which makes bisectors integers:
// w . x <= |w|^2 / 2. The normal of a wall has length 1.
template <int D>
struct ExactPlane {
  IntegerVector<D> normal;
  Integer offset;
};

template <int D>
struct ExactNode {
  IntegerVector<D> numerator;  // y = 2 x = numerator / denominator
  Integer denominator;         // positive
  // The inverse of the matrix with the normals for rows, times the denominator: a step along columns[k] changes normal
  // k . y, and that of no other normal.
  std::array<IntegerVector<D>, D> columns;
  Point<D> x;  // each coordinate within a relative error of 2^-50
  double reach;
};

// Gauss and Jordan without fractions (Bareiss 1968): [A b I] becomes [d I, d A^-1 b, d A^-1], d = +-det A; every
// division is exact. Whether det A != 0.
template <int D>
bool Meet(const std::array<const ExactPlane<D>*, D>& planes, ExactNode<D>& node) {
  std::array<std::array<Integer, 2 * D + 1>, D> m;
  for (int row = 0; row < D; ++row) {
    std::copy(planes[row]->normal.begin(), planes[row]->normal.end(), m[row].begin());
    m[row][D] = planes[row]->offset;
    m[row][D + 1 + row] = 1;
  }
  Integer last = 1;
  for (int k = 0; k < D; ++k) {
    int pivot = k;
    while (pivot < D && m[pivot][k] == 0) {
      ++pivot;
    }
    if (pivot == D) {
      return false;
    }
    std::swap(m[pivot], m[k]);
    for (int row = 0; row < D; ++row) {
      if (row == k) {
        continue;
      }
      const Integer factor = m[row][k];
      for (Integer& entry : m[row]) {
        const auto column = &entry - m[row].data();
        entry = Integer(entry * m[k][k] - factor * m[k][column]) / last;
      }
    }
    last = m[k][k];
  }
  const int sign = last < 0 ? -1 : 1;
  node.denominator = sign * last;
  for (int i = 0; i < D; ++i) {
    node.numerator[i] = sign * m[i][D];
    for (int k = 0; k < D; ++k) {
      node.columns[k][i] = sign * m[i][D + 1 + k];
    }
  }
  return true;
}

// The walls that a cell begins with.
template <int D>
struct Walls {
  Box<D> bounds;
  std::array<PlaneKind, 2 * D> kinds;
};

template <typename... Parts>
absl::Status Violation(const Parts&... parts) {
  return absl::FailedPreconditionError(absl::StrCat(parts...));
}

template <int D>
class Certifier {
 public:
  Certifier(const QueryStructure<D>& structure, VertexId v, const Walls<D>& walls, const CellView<D>& cell)
      : structure_(structure), v_(v), site_(structure.point(v)), walls_(walls), cell_(cell) {}

  absl::Status Run() {
    WELLSPACE_RETURN_IF_ERROR(CheckPlanes());
    WELLSPACE_RETURN_IF_ERROR(CheckNodes());
    WELLSPACE_RETURN_IF_ERROR(CheckEdges());
    WELLSPACE_RETURN_IF_ERROR(CheckConesCoverOnce());
    return CheckBalls();
  }

 private:
  // Each plane is one that may justify a boundary: (2), and (3) for planes.
  absl::Status CheckPlanes() {
    if (cell_.site != site_) {
      return Violation("the cell's site is not where vertex ", Index(v_), " is");
    }
    for (int face = 0; face < 2 * D; ++face) {
      const double at = walls_.bounds.FaceCoordinate(face);
      if (face % 2 == 0 ? site_[face / 2] < at : site_[face / 2] > at) {
        return Violation("vertex ", Index(v_), " is beyond wall ", face, " of its cell");
      }
    }
    for (size_t i = 0; i < cell_.planes.size(); ++i) {
      const Plane<D>& plane = cell_.planes[i];
      const bool is_bisector = plane.kind == PlaneKind::kBisector;
      if (is_bisector != !plane.source.IsWall()) {
        return Violation("plane ", i, " says it is ", is_bisector ? "a bisector" : "a wall", ", its source not");
      }
      WELLSPACE_RETURN_IF_ERROR(is_bisector ? CheckBisector(i) : CheckWall(i));
      const double length = std::sqrt(NormSq<D>(plane.normal));
      if (!(std::abs(plane.length - length) <= 8 * kUnit * length)) {
        return Violation("plane ", i, " says its normal has length ", plane.length, ", not ", length);
      }
    }
    return absl::OkStatus();
  }

  absl::Status CheckBisector(size_t i) const {
    const Plane<D>& plane = cell_.planes[i];
    if (plane.vertex == v_ || Index(plane.vertex) >= structure_.vertex_count()) {
      return Violation("plane ", i, " is the bisector of ", Index(plane.vertex), ", which is no other vertex");
    }
    if (plane.source.generator != structure_.point(plane.vertex)) {
      return Violation("plane ", i, " is not the bisector of vertex ", Index(plane.vertex), ", but of another point");
    }
    const double offset = 0.5 * NormSq<D>(plane.normal);
    if (plane.normal != Difference<D>(plane.source.generator, site_) ||
        !(std::abs(plane.offset - offset) <= 16 * kUnit * offset)) {
      return Violation("plane ", i, " has not the normal and offset of the bisector of vertex ", Index(plane.vertex));
    }
    return absl::OkStatus();
  }

  absl::Status CheckWall(size_t i) const {
    const Plane<D>& plane = cell_.planes[i];
    if (plane.face >= 2 * D || plane.source.axis != plane.face / 2 || walls_.kinds[plane.face] != plane.kind ||
        walls_.bounds.FaceCoordinate(plane.face) != plane.source.coordinate) {
      return Violation("plane ", i, " (face ", int{plane.face}, " at ", plane.source.coordinate,
                       ") is neither that face of the box nor the clip there");
    }
    Point<D> normal{};
    normal[plane.source.axis] = 1;
    if (plane.normal != normal || plane.offset != plane.source.coordinate - site_[plane.source.axis]) {
      return Violation("plane ", i, " has not the normal and offset of face ", int{plane.face});
    }
    return absl::OkStatus();
  }

  // Each node is where D independent planes meet, inside the walls: (1); its numbers are right: (3).
  absl::Status CheckNodes() {
    if (cell_.nodes.empty()) {
      return Violation("the cell has no nodes");
    }
    MakeExactPlanes();
    exact_.resize(cell_.nodes.size());
    for (size_t i = 0; i < cell_.nodes.size(); ++i) {
      const CellNode<D>& node = cell_.nodes[i];
      std::array<const ExactPlane<D>*, D> planes;
      for (int k = 0; k < D; ++k) {
        if (node.planes[k] >= cell_.planes.size()) {
          return Violation("node ", i, " is on plane ", node.planes[k], " of ", cell_.planes.size());
        }
        planes[k] = &planes_[node.planes[k]];
      }
      if (!Meet<D>(planes, exact_[i])) {
        return Violation("the planes of node ", i, " do not meet in one point");
      }
      for (int k = 0; k < D; ++k) {
        exact_[i].x[k] = Rounded(exact_[i].numerator[k], exact_[i].denominator, exponent_ - 1);
        // 2 (wall - site) as integers, for the low and the high wall.
        if (exact_[i].numerator[k] < walls_low_[k] * exact_[i].denominator ||
            exact_[i].numerator[k] > walls_high_[k] * exact_[i].denominator) {
          return Violation("node ", i, " is beyond the walls on axis ", k);
        }
      }
      exact_[i].reach = std::sqrt(NormSq<D>(exact_[i].x));
      WELLSPACE_RETURN_IF_ERROR(CheckNumbers(i));
    }
    return absl::OkStatus();
  }

  absl::Status CheckNumbers(size_t i) const {
    const CellNode<D>& node = cell_.nodes[i];
    const ExactNode<D>& exact = exact_[i];
    // The error of rounding the exact node itself.
    const double rounding = 16 * kUnit * exact.reach;
    const double off = std::sqrt(DistanceSq<D>(node.x, exact.x));
    if (!(off <= node.slack + rounding)) {
      return Violation("node ", i, " is ", off, " from where its planes meet; its slack is ", node.slack);
    }
    if (!(std::abs(std::sqrt(node.radius_sq) - exact.reach) <= node.slack + rounding)) {
      return Violation("node ", i, " has radius_sq ", node.radius_sq, "; exact is ", exact.reach * exact.reach);
    }
    if (!(node.reach >= exact.reach - rounding)) {
      return Violation("node ", i, " has reach ", node.reach, ", less than its distance ", exact.reach);
    }
    return absl::OkStatus();
  }

  // Puts the site, the walls and the planes on the coarsest grid of a power of two that holds them all.
  void MakeExactPlanes() {
    exponent_ = std::numeric_limits<int>::max();
    const auto include = [&](const Point<D>& p) {
      for (const double x : p) {
        exponent_ = std::min(exponent_, LastBit(x));
      }
    };
    include(site_);
    include(walls_.bounds.low);
    include(walls_.bounds.high);
    for (const Plane<D>& plane : cell_.planes) {
      if (plane.kind == PlaneKind::kBisector) {
        include(plane.source.generator);
      }
    }
    exponent_ = exponent_ == std::numeric_limits<int>::max() ? 0 : exponent_;
    for (int i = 0; i < D; ++i) {
      grid_site_[i] = ToInteger(site_[i], exponent_);
      walls_low_[i] = 2 * (ToInteger(walls_.bounds.low[i], exponent_) - grid_site_[i]);
      walls_high_[i] = 2 * (ToInteger(walls_.bounds.high[i], exponent_) - grid_site_[i]);
    }
    planes_.resize(cell_.planes.size());
    for (size_t j = 0; j < planes_.size(); ++j) {
      const Plane<D>& plane = cell_.planes[j];
      planes_[j].normal.fill(0);
      if (plane.kind == PlaneKind::kBisector) {
        for (int i = 0; i < D; ++i) {
          planes_[j].normal[i] = ToInteger(plane.source.generator[i], exponent_) - grid_site_[i];
        }
        planes_[j].offset = Product<D>(planes_[j].normal, planes_[j].normal);
      } else {
        const int axis = plane.face / 2;
        const bool is_high = plane.face % 2 == 1;
        planes_[j].normal[axis] = is_high ? 1 : -1;
        planes_[j].offset = is_high ? walls_high_[axis] : Integer(-walls_low_[axis]);
      }
    }
  }

  // Beyond each facet of a node's normal cone lies that of a neighbour: (2).
  absl::Status CheckEdges() const {
    for (size_t i = 0; i < cell_.nodes.size(); ++i) {
      const CellNode<D>& node = cell_.nodes[i];
      for (int k = 0; k < D; ++k) {
        const uint16_t j = node.neighbours[k];
        if (j >= cell_.nodes.size() || j == i) {
          return Violation("node ", i, " has the neighbour ", j, " of ", cell_.nodes.size());
        }
        const CellNode<D>& other = cell_.nodes[j];
        // The neighbour's planes are the node's but for number k, and one more.
        int own = -1;
        int shared = 0;
        for (int l = 0; l < D; ++l) {
          const auto at = std::find(node.planes.begin(), node.planes.end(), other.planes[l]);
          if (at == node.planes.end()) {
            own = l;
          } else if (at - node.planes.begin() != k) {
            ++shared;
          }
        }
        if (shared != D - 1 || own < 0 || other.neighbours[own] != i) {
          return Violation("nodes ", i, " and ", j, " are not the two ends of one edge");
        }
        if (!(Product<D>(planes_[other.planes[own]].normal, exact_[i].columns[k]) < 0)) {
          return Violation("the edge from node ", i, " leads away from plane ", other.planes[own], " of its other end ",
                           j);
        }
      }
    }
    return absl::OkStatus();
  }

  // A direction inside the normal cone of the first node is in no other's: (2).
  absl::Status CheckConesCoverOnce() const {
    IntegerVector<D> direction = planes_[cell_.nodes[0].planes[0]].normal;
    for (int k = 1; k < D; ++k) {
      for (int i = 0; i < D; ++i) {
        direction[i] += planes_[cell_.nodes[0].planes[k]].normal[i];
      }
    }
    for (size_t i = 1; i < exact_.size(); ++i) {
      const auto& columns = exact_[i].columns;
      if (std::none_of(columns.begin(), columns.end(), [&](const auto& c) { return Product<D>(direction, c) < 0; })) {
        return Violation("nodes 0 and ", i, " are both extreme in one direction: the graph is not that of a polytope");
      }
    }
    return absl::OkStatus();
  }

  // No node's open ball through v holds a vertex: (1).
  absl::Status CheckBalls() const {
    double farthest = 0;
    for (const ExactNode<D>& node : exact_) {
      farthest = std::max(farthest, node.reach);
    }
    const double near_sq = 4 * (1 + 0x1p-40) * farthest * farthest;
    for (uint32_t u = 0; u < structure_.vertex_count(); ++u) {
      if (VertexId{u} == v_) {
        continue;
      }
      const Point<D>& position = structure_.point(VertexId{u});
      const Point<D> w = Difference<D>(position, site_);
      const double length_sq = NormSq<D>(w);
      if (length_sq > near_sq) {
        continue;
      }
      for (size_t i = 0; i < exact_.size(); ++i) {
        if (IsInBall(exact_[i], position, w, length_sq)) {
          return Violation("vertex ", u, " is in the ball about node ", i, " through vertex ", Index(v_));
        }
      }
    }
    return absl::OkStatus();
  }

  // Whether w . x > |w|^2 / 2 for the exact w and x. In doubles x has relative errors of 8 units a coordinate, w of
  // one; products and sums add D each: below 2^-48 (|w| |x| + |w|^2) for D <= 6. Underflow adds less than 2^-1000.
  bool IsInBall(const ExactNode<D>& node, const Point<D>& position, const Point<D>& w, double length_sq) const {
    const double excess = Dot<D>(w, node.x) - 0.5 * length_sq;
    const double error = 0x1p-48 * (std::sqrt(length_sq) * node.reach + length_sq) + 0x1p-1000;
    if (std::abs(excess) > error) {
      return excess > 0;
    }
    // On a grid that holds the vertex too, finer by 2^shift.
    int exponent = exponent_;
    for (const double x : position) {
      exponent = std::min(exponent, LastBit(x));
    }
    const int shift = exponent_ - exponent;
    IntegerVector<D> exact_w;
    for (int i = 0; i < D; ++i) {
      exact_w[i] = ToInteger(position[i], exponent) - Integer(grid_site_[i] << shift);
    }
    return Integer(Product<D>(exact_w, node.numerator) << shift) > Product<D>(exact_w, exact_w) * node.denominator;
  }

  const QueryStructure<D>& structure_;
  const VertexId v_;
  const Point<D> site_;
  const Walls<D> walls_;
  const CellView<D> cell_;

  int exponent_ = 0;  // all that follows is in units of 2^exponent_, relative to the site
  IntegerVector<D> grid_site_;
  IntegerVector<D> walls_low_;  // twice their distances, as y = 2 x
  IntegerVector<D> walls_high_;
  std::vector<ExactPlane<D>> planes_;
  std::vector<ExactNode<D>> exact_;
};

template <int D>
absl::Status CheckIsVertex(const QueryStructure<D>& structure, VertexId v) {
  if (Index(v) >= structure.vertex_count()) {
    return absl::InvalidArgumentError(
        absl::StrCat("vertex ", Index(v), " of a structure of ", structure.vertex_count(), " vertices"));
  }
  return absl::OkStatus();
}

}  // namespace

template <int D>
absl::Status CertifyCell(const QueryStructure<D>& structure, VertexId v, double radius, const CellView<D>& cell) {
  WELLSPACE_RETURN_IF_ERROR(CheckIsVertex<D>(structure, v));
  if (!(radius > 0) || std::isinf(radius)) {
    return absl::InvalidArgumentError(absl::StrCat("radius ", radius, "; it must be positive and finite"));
  }
  const Point<D>& site = structure.point(v);
  Walls<D> walls;
  for (int face = 0; face < 2 * D; ++face) {
    const bool is_high = face % 2 == 1;
    const double of_box = structure.box().FaceCoordinate(face);
    const double of_clip = is_high ? site[face / 2] + radius : site[face / 2] - radius;
    const bool is_clip = is_high ? of_clip < of_box : of_clip > of_box;
    walls.kinds[face] = is_clip ? PlaneKind::kClip : PlaneKind::kFace;
    (is_high ? walls.bounds.high : walls.bounds.low)[face / 2] = is_clip ? of_clip : of_box;
  }
  return Certifier<D>(structure, v, walls, cell).Run();
}

template <int D>
absl::Status CertifyWholeCell(const QueryStructure<D>& structure, VertexId v, const CellView<D>& cell) {
  WELLSPACE_RETURN_IF_ERROR(CheckIsVertex<D>(structure, v));
  Walls<D> walls{structure.box(), {}};
  walls.kinds.fill(PlaneKind::kClip);
  const double side = structure.box().LongestSide();
  for (int i = 0; i < D; ++i) {
    walls.bounds.low[i] -= side;
    walls.bounds.high[i] += side;
  }
  return Certifier<D>(structure, v, walls, cell).Run();
}

#define WELLSPACE_INSTANTIATE(D)                                                                        \
  template absl::Status CertifyCell<D>(const QueryStructure<D>&, VertexId, double, const CellView<D>&); \
  template absl::Status CertifyWholeCell<D>(const QueryStructure<D>&, VertexId, const CellView<D>&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
