#include "core/voronoi/reference_scan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <unordered_set>

#include "core/base/dimensions.h"

namespace wellspace::core {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A constraint counts as kept when it is broken by no more than this part of the lengths in it.
constexpr double kFeasibility = 0x1p-42;
// A normal whose part outside the span of the active ones is shorter than this counts as inside.
constexpr double kDependence = 0x1p-40;
// The optimum of a relaxed program counts as one of the program itself when it breaks the constraint by no more.
constexpr double kRelaxation = 0x1p-24;
// A lower bound this near to the radius of a ball that is known counts as that radius.
constexpr double kTightness = 0x1p-16;
// Guards against cycling in rounded arithmetic; the bound that is reached by then holds all the same.
constexpr int kMaxPivots = 200;
constexpr int kMaxPieces = 4000;

template <int D>
double Norm(const Point<D>& a) {
  return std::sqrt(NormSq<D>(a));
}

template <int D>
void AddScaled(double factor, const Point<D>& from, Point<D>& to) {
  for (int i = 0; i < D; ++i) {
    to[i] += factor * from[i];
  }
}

// The point of [low, high] nearest to `value`.
double Clamp(double value, double low, double high) { return std::min(std::max(value, low), high); }

// phi(c) = min p (p - 2 c) over p in [low, high].
double LeastPower(double c, double low, double high) {
  const double p = Clamp(c, low, high);
  return p * (p - 2 * c);
}

// The mean of Clamp(t, low, high) over t in [x, y]. As phi' = -2 Clamp, the chord of phi over [x, y] has -2 times it
// for slope.
double MeanClamp(double x, double y, double low, double high) {
  if (!(y > x)) {
    return Clamp(x, low, high);
  }
  const double first = Clamp(x, low, high);
  const double last = Clamp(y, low, high);
  const double below = std::max(0.0, std::min(y, low) - x);
  const double above = std::max(0.0, y - std::max(x, high));
  return (below * low + (last - first) * (0.5 * (first + last)) + above * high) / (below + (last - first) + above);
}

// The part of `normal` outside the span of the active ones, and its coordinates in them: normal = sum_i along[i]
// active_i + outside. Gram and Schmidt twice is as good as reflections.
template <int D>
struct Split {
  std::array<double, D> along{};
  Point<D> outside;
};

template <int D, typename NormalOf>
Split<D> SplitBySpan(int count, NormalOf normal_of, const Point<D>& normal) {
  std::array<Point<D>, D> basis;
  std::array<std::array<double, D>, D> upper{};  // active_j = sum_i upper[i][j] basis_i
  for (int j = 0; j < count; ++j) {
    basis[j] = normal_of(j);
    for (int pass = 0; pass < 2; ++pass) {
      for (int i = 0; i < j; ++i) {
        const double part = Dot<D>(basis[i], basis[j]);
        upper[i][j] += part;
        AddScaled<D>(-part, basis[i], basis[j]);
      }
    }
    upper[j][j] = Norm<D>(basis[j]);
    for (double& x : basis[j]) {
      x /= upper[j][j];
    }
  }
  Split<D> split;
  split.outside = normal;
  for (int pass = 0; pass < 2; ++pass) {
    for (int i = 0; i < count; ++i) {
      const double part = Dot<D>(basis[i], split.outside);
      split.along[i] += part;
      AddScaled<D>(-part, basis[i], split.outside);
    }
  }
  for (int i = count - 1; i >= 0; --i) {
    for (int j = i + 1; j < count; ++j) {
      split.along[i] -= upper[i][j] * split.along[j];
    }
    split.along[i] /= upper[i][i];
  }
  return split;
}

// The weight that is zero first if they move against `along`, or -1; lowers `step` to how far that is.
template <int D>
int FirstToVanish(std::span<const double> weights, const std::array<double, D>& along, double& step) {
  int leaving = -1;
  for (size_t j = 0; j < weights.size(); ++j) {
    if (along[j] > 0 && weights[j] < step * along[j]) {
      step = weights[j] / along[j];
      leaving = static_cast<int>(j);
    }
  }
  return leaving;
}

}  // namespace

template <int D>
EmptyBallProgram<D>::EmptyBallProgram(const Box<D>& centres) : centres_(centres) {}

template <int D>
typename EmptyBallProgram<D>::HalfSpace EmptyBallProgram<D>::Normalised(const Point<D>& normal, double offset) {
  const double length = Norm<D>(normal);
  HalfSpace out{normal, offset / length};
  for (double& x : out.normal) {
    x /= length;
  }
  return out;
}

template <int D>
void EmptyBallProgram<D>::Exclude(const Point<D>& u) {
  Point<D> away;
  for (int i = 0; i < D; ++i) {
    away[i] = -u[i];
  }
  bisectors_.push_back(Normalised(away, -0.5 * NormSq<D>(u)));
}

// With weights >= 0 and w = sum weight_j normal_j, b = sum weight_j offset_j, every c that keeps the constraints has
// w . c >= b, hence |c| >= b / |w|. Normals and offsets come with relative errors of at most D + 6 roundings, each sum
// adds 2 D + 2: 64 units are more than all of them for D <= 6.
template <int D>
double EmptyBallProgram<D>::CertainBound(std::span<const HalfSpace> rows, std::span<const int> active,
                                         std::span<const double> weights) {
  Point<D> w{};
  double b = 0;
  double w_error = 0;
  double b_error = 0;
  for (size_t j = 0; j < active.size(); ++j) {
    const HalfSpace& row = rows[active[j]];
    AddScaled<D>(weights[j], row.normal, w);
    b += weights[j] * row.offset;
    w_error += 64 * kUnit * weights[j];
    b_error += 64 * kUnit * weights[j] * std::abs(row.offset);
  }
  return b > b_error ? (b - b_error) / (Norm<D>(w) + w_error) * (1 - 8 * kUnit) : 0;
}

// Sets rows_ to the constraints of `centres`, bisectors and `meets`; returns the farthest centre's squared distance.
template <int D>
double EmptyBallProgram<D>::SetRows(const Box<D>& centres, const HalfSpace& meets) const {
  rows_.clear();
  double farthest_sq = 0;
  for (int i = 0; i < D; ++i) {
    HalfSpace wall{{}, centres.low[i]};
    wall.normal[i] = 1;
    rows_.push_back(wall);
    wall.normal[i] = -1;
    wall.offset = -centres.high[i];
    rows_.push_back(wall);
    farthest_sq += std::max(centres.low[i] * centres.low[i], centres.high[i] * centres.high[i]);
  }
  rows_.insert(rows_.end(), bisectors_.begin(), bisectors_.end());
  rows_.push_back(meets);
  return farthest_sq;
}

// The row that `c` breaks most, or -1.
template <int D>
int EmptyBallProgram<D>::MostBroken(std::span<const HalfSpace> rows, const Point<D>& c) {
  int broken = -1;
  double most = 0;
  for (size_t j = 0; j < rows.size(); ++j) {
    const double along = Dot<D>(rows[j].normal, c);
    const double excess = rows[j].offset - along - kFeasibility * (std::abs(rows[j].offset) + Norm<D>(c));
    if (excess > most) {
      most = excess;
      broken = static_cast<int>(j);
    }
  }
  return broken;
}

// The point c of least norm that lies in `centres`, in the half-spaces of the bisectors, and in `meets`.
template <int D>
typename EmptyBallProgram<D>::Optimum EmptyBallProgram<D>::Solve(const Box<D>& centres, const HalfSpace& meets) const {
  ++solved_;
  const double farthest_sq = SetRows(centres, meets);
  const std::span<const HalfSpace> rows = rows_;

  // Invariant: c = sum_j weights[j] normal(active[j]) is the point of least norm on the planes `active`, weights >= 0.
  // One more entry than D is needed only by the proof that nothing is left.
  std::array<int, D + 1> active;
  std::array<double, D + 1> weights;
  int count = 0;
  Point<D> c{};
  const auto bound = [&](int n) { return CertainBound(rows, std::span(active).first(n), std::span(weights).first(n)); };
  for (int pivot = 0; pivot < kMaxPivots; ++pivot) {
    const int broken = MostBroken(rows, c);
    if (broken < 0) {
      break;
    }
    const HalfSpace& entering = rows[broken];
    double weight = 0;
    for (bool entered = false; !entered;) {
      const Split<D> split = SplitBySpan<D>(
          count, [&](int j) -> const Point<D>& { return rows[active[j]].normal; }, entering.normal);
      const double outside_sq = NormSq<D>(split.outside);
      // How far the weights can move until one of them is zero, and until the entering constraint is kept.
      double step = kInfinity;
      const int leaving = FirstToVanish<D>(std::span(weights).first(count), split.along, step);
      const double gap = entering.offset - Dot<D>(entering.normal, c);
      const bool is_outside = outside_sq > kDependence * kDependence && count < D;
      if (!is_outside && leaving < 0) {
        // The entering constraint contradicts the active ones: b > 0 for weights with w = 0, up to rounding.
        const double so_far = bound(count);
        std::transform(split.along.begin(), split.along.begin() + count, weights.begin(), std::negate<>());
        active[count] = broken;
        weights[count] = 1;
        const double beyond = bound(count + 1);
        return {beyond * beyond > farthest_sq ? kInfinity : std::max(beyond, so_far), c};
      }
      entered = is_outside && gap <= step * outside_sq;
      if (entered) {
        step = std::max(gap, 0.0) / outside_sq;
      }
      for (int j = 0; j < count; ++j) {
        weights[j] = std::max(0.0, weights[j] - step * split.along[j]);
      }
      weight += step;
      if (!entered) {
        std::copy(active.begin() + leaving + 1, active.begin() + count, active.begin() + leaving);
        std::copy(weights.begin() + leaving + 1, weights.begin() + count, weights.begin() + leaving);
        --count;
      }
      c = {};
      AddScaled<D>(weight, entering.normal, c);
      for (int j = 0; j < count; ++j) {
        AddScaled<D>(weights[j], rows[active[j]].normal, c);
      }
    }
    active[count] = broken;
    weights[count] = weight;
    ++count;
  }
  return {bound(count), c};
}

template <int D>
double EmptyBallProgram<D>::DiameterTo(const Point<D>& p) const {
  const double length_sq = NormSq<D>(p);
  return length_sq == 0 ? 0 : 2 * Solve(centres_, Normalised(p, 0.5 * length_sq)).radius;
}

// The program with the chords over `centres` in the place of the phi_i: sum_i phi_i(x_i) - 2 m_i (c_i - x_i) <= 0 with
// m_i the mean of Clamp.
template <int D>
typename EmptyBallProgram<D>::Optimum EmptyBallProgram<D>::Relax(const Box<D>& centres, const Box<D>& q) const {
  Point<D> mean;
  double offset = 0;
  double rounding = 0;
  for (int i = 0; i < D; ++i) {
    const double x = centres.low[i];
    mean[i] = MeanClamp(x, centres.high[i], q.low[i], q.high[i]);
    const double p = Clamp(x, q.low[i], q.high[i]);
    offset += p * (p - 2 * x) + 2 * mean[i] * x;
    const double largest = std::max(std::abs(q.low[i]), std::abs(q.high[i]));
    rounding += largest * (largest + 4 * std::max(std::abs(x), std::abs(centres.high[i])));
  }
  // Each of p, its product, the mean and its product is off by a few roundings of values that `rounding` bounds.
  offset -= 32 * kUnit * rounding;
  const double length = Norm<D>(mean);
  if (!(length > 0)) {  // then no c can be excluded if offset <= 0, and none kept otherwise
    return {offset > 0 ? kInfinity : 0, {}};
  }
  return Solve(centres, Normalised(mean, 0.5 * offset));
}

// The part of a piece beyond `split` along `axis`, on that side, without centres farther away than `above`.
template <int D>
typename EmptyBallProgram<D>::Piece EmptyBallProgram<D>::PartOf(const Piece& whole, int axis, double split, bool high,
                                                                double above, const Box<D>& q) const {
  Piece piece = {whole.centres, {kInfinity, {}}};
  (high ? piece.centres.low : piece.centres.high)[axis] = split;
  bool is_empty = false;
  for (int k = 0; k < D; ++k) {
    piece.centres.low[k] = std::max(piece.centres.low[k], -above * (1 + 0x1p-40));
    piece.centres.high[k] = std::min(piece.centres.high[k], above * (1 + 0x1p-40));
    is_empty = is_empty || piece.centres.low[k] > piece.centres.high[k];
  }
  if (!is_empty) {
    piece.optimum = Relax(piece.centres, q);
    piece.optimum.radius = std::max(piece.optimum.radius, whole.optimum.radius);
  }
  return piece;
}

template <int D>
double EmptyBallProgram<D>::DiameterTo(const Box<D>& q) const {
  if (q.Contains(Point<D>{})) {
    return 0;
  }
  std::vector<Piece> pieces = {{centres_, Relax(centres_, q)}};
  const auto later = [](const Piece& a, const Piece& b) { return a.optimum.radius > b.optimum.radius; };
  double above = kInfinity;
  for (int i = 0; i < kMaxPieces; ++i) {
    const Piece least = pieces.front();
    const Point<D>& c = least.optimum.c;
    if (least.optimum.radius >= (1 - kTightness) * above) {
      break;
    }
    double power = 0;
    double size = 0;
    int axis = 0;
    double farthest_off = -1;
    for (int k = 0; k < D; ++k) {
      const double x = least.centres.low[k];
      const double y = least.centres.high[k];
      const double p = Clamp(c[k], q.low[k], q.high[k]);
      const double value = p * (p - 2 * c[k]);
      power += value;
      size += std::abs(p) * (std::abs(p) + 2 * std::abs(c[k]));
      const double chord = LeastPower(x, q.low[k], q.high[k]) - 2 * MeanClamp(x, y, q.low[k], q.high[k]) * (c[k] - x);
      if (value - chord > farthest_off) {
        farthest_off = value - chord;
        axis = k;
      }
    }
    if (power <= kRelaxation * size) {
      break;
    }
    // The point of q nearest to c has a ball of its own; centres farther away than that one's need not be looked at.
    Point<D> nearest;
    for (int k = 0; k < D; ++k) {
      nearest[k] = Clamp(c[k], q.low[k], q.high[k]);
    }
    above = std::min(above, 0.5 * DiameterTo(nearest));
    std::pop_heap(pieces.begin(), pieces.end(), later);
    pieces.pop_back();
    const double x = least.centres.low[axis];
    const double y = least.centres.high[axis];
    const double split = Clamp(c[axis], x + 0.125 * (y - x), y - 0.125 * (y - x));
    for (const bool high : {false, true}) {
      pieces.push_back(PartOf(least, axis, split, high, above, q));
      std::push_heap(pieces.begin(), pieces.end(), later);
    }
  }
  return 2 * std::min(pieces.front().optimum.radius, above);
}

namespace {

// A leaf or a vertex that the scan has met and not yet taken.
struct Event {
  double diameter;
  size_t excluded;  // |U| when the diameter was computed
  bool is_leaf;
  uint32_t id;
};

// Of two events as near, vertices come first, then the lower number.
bool IsLater(const Event& a, const Event& b) {
  if (a.diameter != b.diameter) {
    return a.diameter > b.diameter;
  }
  return a.is_leaf != b.is_leaf ? a.is_leaf : a.id > b.id;
}

}  // namespace

template <int D>
ReferenceScan<D> ReferenceClippedVoronoi(const QueryStructure<D>& structure, VertexId v, double radius) {
  const Point<D>& site = structure.point(v);
  const LeafTree<D>& tree = structure.tree();
  std::array<PlaneKind, 2 * D> kinds;
  const Box<D> bounds = ClippedBox<D>(structure.box(), CubeAround<D>(site, radius), kinds);
  const Box<D> centres{Difference<D>(bounds.low, site), Difference<D>(bounds.high, site)};

  ReferenceScan<D> scan;
  scan.cell.Reset(site, bounds, kinds, TieRule::kKeep);
  EmptyBallProgram<D> program(centres);
  const auto diameter_to = [&](bool is_leaf, uint32_t id) {
    if (!is_leaf) {
      return program.DiameterTo(Difference<D>(structure.point(VertexId{id}), site));
    }
    const Box<D> cube = tree.BoxOf(NodeId{id});
    return program.DiameterTo(Box<D>{Difference<D>(cube.low, site), Difference<D>(cube.high, site)});
  };
  std::vector<Event> queue;
  const auto push = [&](bool is_leaf, uint32_t id, double at_least) {
    const double diameter = std::max(at_least, diameter_to(is_leaf, id));
    if (diameter < kInfinity) {
      queue.push_back({diameter, scan.neighbors.size(), is_leaf, id});
      std::push_heap(queue.begin(), queue.end(), IsLater);
    }
  };

  std::unordered_set<uint32_t> met = {Index(tree.leaf_of(v))};
  queue.push_back({0, 0, true, Index(tree.leaf_of(v))});
  while (!queue.empty()) {
    std::pop_heap(queue.begin(), queue.end(), IsLater);
    const Event event = queue.back();
    queue.pop_back();
    if (event.excluded != scan.neighbors.size()) {
      push(event.is_leaf, event.id, event.diameter);
      continue;
    }
    if (!event.is_leaf) {
      const VertexId u{event.id};
      scan.neighbors.push_back(u);
      program.Exclude(Difference<D>(structure.point(u), site));
      scan.cell.Cut(u, structure.point(u));
      continue;
    }
    const NodeId leaf{event.id};
    scan.leaves.push_back({leaf, event.diameter});
    if (const auto* inside = tree.VerticesIn(leaf); inside != nullptr) {
      for (uint32_t i = 0; i < inside->count; ++i) {
        if (inside->ids[i] != v) {
          push(false, Index(inside->ids[i]), 0);
        }
      }
    }
    tree.ForEachFaceNeighbour(leaf, [&](NodeId beyond) {
      if (met.insert(Index(beyond)).second) {
        push(true, Index(beyond), 0);
      }
    });
  }
  scan.programs = program.solved();
  return scan;
}

#define WELLSPACE_INSTANTIATE(D) template class EmptyBallProgram<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

#define WELLSPACE_INSTANTIATE(D) \
  template ReferenceScan<D> ReferenceClippedVoronoi<D>(const QueryStructure<D>&, VertexId, double);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
