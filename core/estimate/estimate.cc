#include "core/estimate/estimate.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/estimate/calibration.h"
#include "core/estimate/domain_surroundings.h"
#include "core/estimate/least_vertices.h"
#include "core/estimate/mesh_size.h"
#include "core/estimate/nearest_points.h"

namespace wellspace::core {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// How much of lfs^-D counts, by q, the distance to the nearest vertex over the distance from that vertex to its own
// nearest feature: nothing as close to a vertex as its neighbours are, everything from a few times as far on. The ends
// of the ramp as log2 q.
template <int D>
constexpr std::array<double, 2> kRamp = D == 2 ? std::array{-0.5, 1.0} : std::array{-0.05, 1.45};

// Sizes below this part of the longest side count as this: no coordinates could tell such edges apart, and integrals
// over so few halvings stay finite, whatever is asked for.
constexpr double kLeastSize = 0x1p-60;

// Of meshes of even clouds, from this rho on: vertices for each point, and for each of n^((D-1)/D) points near the box;
// vertices in a leaf; room for clouds that are not even. Meshes of more memory are worth a look at the leaves.
constexpr double kTypicalVertices = 1.5;
template <int D>
constexpr double kTypicalOnBoundary = D == 2 ? 4 : 3;
template <int D>
constexpr double kTypicalRho = D == 2 ? std::numbers::sqrt2 : 2;
constexpr double kTypicalInLeaf = 12;
constexpr double kTypicalRoom = 1.2;
constexpr double kMostTypicalBytes = 32e6;

// More vertices than any leaf is predicted to take.
constexpr double kMostInLeaf = 0x1p400;

// Numbers in [0, 1) that depend on nothing but how many were drawn; a linear congruence of Knuth.
class Draws {
 public:
  double Next() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(state_ >> 11) * 0x1p-53;
  }

 private:
  uint64_t state_ = 1;
};

// ---- The integrals over leaves; docs/design/estimate.md has the model

// The share of a leaf in the mesh.
struct Share {
  Terms terms{};
  double sizes = 0;  // vertices for the sake of sizes, over those of the terms
};

template <int D>
class Integrator {
 public:
  Integrator(const QueryStructure<D>& structure, const MeshCriteria<D>& criteria, const PlanarDomain* domain)
      : box_(structure.box()),
        sizes_(ServedSizes(criteria.sizes, box_)),
        vertices_per_term_(VerticesPerTerm<D>(criteria)) {
    if constexpr (D == 2) {
      if (domain != nullptr) {
        domain_.emplace(structure.tree(), *domain);
      }
    }
  }

  absl::Status Prepare(const QueryStructure<D>& structure, const RunContext& context) {
    // The corners of the box count as its boundary, not as points; corners that were not given come last.
    std::span<const Point<D>> points = structure.points();
    std::vector<uint32_t> corners;
    for (uint32_t i = 0; i < structure.vertex_count(); ++i) {
      if ((i & 0xfff) == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      const FaceMask faces = structure.faces(VertexId{i});
      if (faces == 0) {
        continue;
      }
      ++on_boundary_;
      if (std::popcount(faces) == D) {
        corners.push_back(i);
      }
    }
    for (; !corners.empty() && corners.back() == points.size() - 1; corners.pop_back()) {
      points = points.first(points.size() - 1);
    }
    WELLSPACE_RETURN_IF_ERROR(points_.Build(points, std::move(corners), context));
    const double shortest_side = box_.ShortestSide();
    for (int corner = 0; corner < (1 << D); ++corner) {
      Point<D> p;
      for (int i = 0; i < D; ++i) {
        p[i] = box_.FaceCoordinate(FaceIndex(i, ((corner >> i) & 1) != 0));
      }
      corner_spacing_[corner] = std::min(shortest_side, std::sqrt(points_.Nearest(p).first_sq));
    }
    return domain_.has_value() ? domain_->Prepare(context) : absl::OkStatus();
  }

  // After `full_looks` looks, one child of each cell stands for all of them: few leaves need so many, but sizes much
  // smaller than a leaf may ask for any number.
  absl::StatusOr<Share> IntegrateLeaf(const LeafTree<D>& tree, NodeId id, uint64_t full_looks,
                                      const RunContext& context) {
    const Box<D> leaf = tree.BoxOf(id);
    if (domain_.has_value()) {
      WELLSPACE_RETURN_IF_ERROR(domain_->MoveTo(id, context));
    }
    looks_ = 0;
    full_looks_ = full_looks;
    share_ = {};
    Integrate(leaf.low, leaf.high[0] - leaf.low[0], 1.0, context);
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    return share_;
  }

  // The vertices that the terms stand for.
  Terms VerticesOf(const Terms& terms) const {
    Terms result;
    std::transform(terms.begin(), terms.end(), vertices_per_term_.begin(), result.begin(), std::multiplies<>());
    return result;
  }
  uint64_t on_boundary() const { return on_boundary_; }
  // Places looked at in the last leaf.
  uint64_t looks() const { return looks_; }
  uint64_t segments_compared() const { return domain_.has_value() ? domain_->compared() : 0; }

 private:
  static SizeField<D> ServedSizes(SizeField<D> sizes, const Box<D>& box) {
    sizes.RaiseTo(kLeastSize * box.LongestSide());
    return sizes;
  }

  // The features around a place.
  struct Surroundings {
    double lfs = 0;
    double opposite = 0;      // distance to the farther of the two nearest opposite faces
    double nearest = 0;       // distance to the nearest vertex, a point or a corner of the box
    double spacing = 0;       // of that vertex: to its nearest feature
    FaceMask faces = 0;       // of that vertex
    double second_point = 0;  // distance to the second nearest point
    Term term = kPoints;      // the term that decides lfs
    uint32_t face = 0;        // of the domain, if there is one
  };

  Surroundings LookAt(const Point<D>& x) {
    ++looks_;
    const NearestTwo two = points_.Nearest(x, last_);
    last_ = two;
    Surroundings result;
    result.nearest = std::sqrt(two.first_sq);
    result.second_point = std::sqrt(two.second_sq);
    if constexpr (D == 2) {
      if (domain_.has_value()) {
        AddSegments(x, two, result);
        return result;
      }
    }
    AddBox(x, two, result);
    return result;
  }

  // The surroundings of `x` among the segments of a domain; its box does not count.
  void AddSegments(const Point<2>& x, const NearestTwo& two, Surroundings& result) {
    const DomainSurroundings::Found found = domain_->LookAt(x, VertexId{two.first});
    result.opposite = found.two_segments;
    result.face = found.face;
    SetLfs(std::max(result.nearest, found.with_point), result);
    result.spacing = SpacingOf(two.first);
  }

  static void SetLfs(double with_face, Surroundings& result) {
    result.lfs = std::min({result.second_point, with_face, result.opposite});
    result.term = result.lfs == result.opposite ? kOpposite : result.lfs < result.second_point ? kNearFace : kPoints;
  }

  // The surroundings of `x` among the faces and corners of the box.
  void AddBox(const Point<D>& x, const NearestTwo& two, Surroundings& result) {
    const bool has_point = two.first_sq < kInfinity;
    result.faces = has_point ? box_.FacesOf(points_[two.first]) : FaceMask{0};
    double face = kInfinity;
    double corner_sq = 0;
    int corner = 0;
    result.opposite = kInfinity;
    for (int i = 0; i < D; ++i) {
      const double low = x[i] - box_.low[i];
      const double high = box_.high[i] - x[i];
      // A face is no second feature to a point that lies on it.
      face = std::min(face, ((result.faces >> FaceIndex(i, false)) & 1) != 0 ? kInfinity : low);
      face = std::min(face, ((result.faces >> FaceIndex(i, true)) & 1) != 0 ? kInfinity : high);
      result.opposite = std::min(result.opposite, std::max(low, high));
      corner_sq += std::min(low, high) * std::min(low, high);
      corner |= high < low ? 1 << i : 0;
    }
    SetLfs(std::max(result.nearest, face), result);
    if (corner_sq < two.first_sq) {
      result.nearest = std::sqrt(corner_sq);
      result.spacing = corner_spacing_[corner];
      result.faces = CornerFaces<D>(corner);
    } else {
      result.spacing = SpacingOf(two.first);
    }
  }

  // Distance from a point to its nearest feature.
  double SpacingOf(uint32_t point) {
    const auto [known, is_new] = spacing_.try_emplace(point);
    double& spacing = known->second;
    if (is_new) {
      const Point<D>& p = points_[point];
      const FaceMask faces = box_.FacesOf(p);
      double corner_sq = 0;
      spacing = std::sqrt(points_.Nearest(p, point).first_sq);
      if (domain_.has_value()) {
        return spacing;
      }
      for (int face = 0; face < 2 * D; ++face) {
        if (((faces >> face) & 1) == 0) {
          spacing = std::min(spacing, box_.DistanceToFace(p, face));
        }
      }
      for (int i = 0; i < D; ++i) {
        const double nearer = std::min(p[i] - box_.low[i], box_.high[i] - p[i]);
        corner_sq += nearer * nearer;
      }
      spacing = std::min(spacing, std::sqrt(corner_sq));
    }
    return spacing;
  }

  // The square of the size that is asked for at a place, be it by the largest area in its face.
  double SizeSqAt(const Point<D>& x, const Surroundings& at) const {
    const double size_sq = sizes_.IsUnbounded() ? kInfinity : sizes_.AtSq(x);
    if (!domain_.has_value()) {
      return size_sq;
    }
    const double least = kLeastSize * box_.LongestSide();  // as of sizes
    return std::min(size_sq, std::max(least * least, kRadiusSqOfArea * domain_->face(at.face).max_area));
  }

  // The bounds of h over a cell.
  std::pair<double, double> SizesIn(const Box<D>& cell) const {
    double diagonal_sq = 0;
    Point<D> center;
    for (int i = 0; i < D; ++i) {
      const double side = cell.high[i] - cell.low[i];
      center[i] = cell.low[i] + 0.5 * side;
      diagonal_sq += side * side;
    }
    const double around = 0.5 * std::sqrt(diagonal_sq) * sizes_.growth().Most();
    return {sizes_.LeastIn(cell), std::min(std::sqrt(sizes_.AtSq(center)) + around, sizes_.max_circumradius())};
  }

  // Adds `weight` times the integrals over the part of a cube that lies in the box, unless the run is cancelled.
  void Integrate(const Point<D>& low, double side, double weight, const RunContext& context) {
    if (context.IsCancelled()) {
      return;
    }
    Box<D> cell;
    Point<D> center;
    double volume = weight;
    for (int i = 0; i < D; ++i) {
      cell.low[i] = std::max(low[i], box_.low[i]);
      cell.high[i] = std::min(low[i] + side, box_.high[i]);
      if (cell.low[i] >= cell.high[i]) {
        return;
      }
      center[i] = 0.5 * (cell.low[i] + cell.high[i]);
      volume *= cell.high[i] - cell.low[i];
    }
    if (IsSimple(cell, LookAt(center), side)) {
      AddCell(cell, volume);
      return;
    }
    const double half = 0.5 * side;
    const auto child_low = [&](int child) {
      Point<D> result = low;
      for (int i = 0; i < D; ++i) {
        result[i] += ((child >> i) & 1) != 0 ? half : 0.0;
      }
      return result;
    };
    if (looks_ < full_looks_) {
      for (int child = 0; child < (1 << D); ++child) {
        Integrate(child_low(child), half, weight, context);
      }
    } else {
      const int child = std::min(static_cast<int>(draws_.Next() * (1 << D)), (1 << D) - 1);
      Integrate(child_low(child), half, weight * (1 << D), context);
    }
  }

  // Whether one place in the cell tells enough of all of it. lfs is 1-Lipschitz, so it is known up to a factor where it
  // is not below the side.
  bool IsSimple(const Box<D>& cell, const Surroundings& center, double side) const {
    if (center.lfs < side) {
      return false;
    }
    if (sizes_.IsUnbounded()) {
      return true;
    }
    const auto [least, largest] = SizesIn(cell);
    return largest <= 2 * least || least >= 2 * center.lfs;
  }

  // A place drawn from the cell, rather than its centre, makes the sum unbiased, on grids too.
  void AddCell(const Box<D>& cell, double volume) {
    Point<D> x;
    for (int i = 0; i < D; ++i) {
      x[i] = cell.low[i] + draws_.Next() * (cell.high[i] - cell.low[i]);
    }
    const Surroundings at = LookAt(x);
    if (domain_.has_value() && !domain_->face(at.face).is_meshed) {
      return;
    }
    const double density = std::pow(at.lfs, -D);
    const double graded = density * Grading(at.nearest / at.spacing);
    share_.terms[at.term] += volume * graded;
    if (const double size_sq = SizeSqAt(x, at); size_sq < kInfinity) {
      const double wanted = kVerticesPerSize<D> * std::pow(size_sq, -0.5 * D);
      const double there = density / BallVolume<D>() + graded * vertices_per_term_[at.term];
      share_.sizes += volume * std::max(0.0, wanted - there);
    }
    for (int face = 0; face < 2 * D && !domain_.has_value(); ++face) {
      const int i = face / 2;
      const double coordinate = box_.FaceCoordinate(face);
      if (coordinate == (face % 2 == 0 ? cell.low[i] : cell.high[i])) {
        Point<D> y = x;
        y[i] = coordinate;
        AddFace(y, face, volume / (cell.high[i] - cell.low[i]), at.lfs);
      }
    }
  }

  void AddFace(const Point<D>& y, int face, double area, double lfs_near) {
    const Surroundings at = LookAt(y);
    double opposite = kInfinity;
    for (int i = 0; i < D; ++i) {
      if (i != face / 2) {
        opposite = std::min(opposite, std::max(y[i] - box_.low[i], box_.high[i] - y[i]));
      }
    }
    const bool is_encroached = ((at.faces >> face) & 1) == 0;
    if (is_encroached || at.second_point < opposite) {
      // Two points near the face and each other may be much nearer than the cell is large.
      const double distance = std::min(std::max(at.second_point, 0.25 * lfs_near), opposite);
      share_.terms[is_encroached ? kEncroached : kOnFace] += area * std::pow(distance, -(D - 1));
    }
  }

  static double Grading(double q) {
    return q > 0 ? std::clamp((std::log2(q) - kRamp<D>[0]) / (kRamp<D>[1] - kRamp<D>[0]), 0.0, 1.0) : 0.0;
  }

  const Box<D> box_;
  const SizeField<D> sizes_;
  const Terms vertices_per_term_;
  std::optional<DomainSurroundings> domain_;       // none: the box
  NearestPoints<D> points_;                        // the input but the corners of the box
  absl::flat_hash_map<uint32_t, double> spacing_;  // by point, where it has been asked for
  std::array<double, 1 << D> corner_spacing_{};
  uint64_t on_boundary_ = 0;  // vertices
  Draws draws_;
  uint64_t looks_ = 0;
  uint64_t full_looks_ = 0;
  Share share_;
  NearestTwo last_;  // of the place looked at last
};

// ---- Sampling

// The leaves made of one that holds `vertices` in the end, `at_first` before refinement: it is split for as long as its
// parts are too full. How many there will be is known to about a quarter. Vertices keep apart, so that leaves of less
// than one hold one at most.
template <int D>
Leaves LeavesOf(double vertices, double at_first) {
  constexpr double kCapacity = LeafTree<D>::kLeafCapacity;
  constexpr double kChildren = LeafTree<D>::kChildren;
  vertices = std::min(vertices, kMostInLeaf);
  double parts = 1;
  for (; vertices >= 1.25 * kCapacity; at_first = 0) {
    vertices /= kChildren;
    parts *= kChildren;
  }
  Leaves result{1.0, at_first > 0 ? 1.0 : std::min(1.0, vertices)};
  if (const double split = 2 * (vertices / kCapacity - 0.75); split > 0) {
    result.all = std::lerp(result.all, kChildren, split);
    result.filled = std::lerp(result.filled, kChildren * std::min(1.0, vertices / kChildren), split);
  }
  return {parts * result.all, parts * result.filled};
}

// The sums over all leaves, and the standard error of the vertices.
struct Sample {
  Share sum;
  Leaves leaves;
  double error = 0;
};

// A stratum of a sample: leaves that are alike, of which some are drawn without replacement, and sums over these.
struct Stratum {
  std::vector<NodeId> leaves;  // the first `taken` have been looked at
  size_t taken = 0;
  Share sum;
  Leaves become;
  double vertices = 0;
  double vertices_sq = 0;

  double Factor() const { return taken == 0 ? 0.0 : static_cast<double>(leaves.size()) / static_cast<double>(taken); }
  // The variance of the estimate of all their vertices. REQUIRES: some have been looked at.
  double VarianceOfSum() const {
    const auto count = static_cast<double>(leaves.size());
    const auto k = static_cast<double>(taken);
    const double mean = vertices / k;
    return count * count * std::max(0.0, vertices_sq / k - mean * mean) * (1 - k / count) / k;
  }
};

void Add(Share& sum, const Share& share, double factor = 1) {
  for (int k = 0; k < kTerms; ++k) {
    sum.terms[k] += factor * share.terms[k];
  }
  sum.sizes += factor * share.sizes;
}

// Leaves looked at between two looks at the error, at most.
constexpr size_t kLeavesTogether = 64;

// After so many places, in all leaves, few are looked at in each further one: seconds have passed.
constexpr uint64_t kMostLooks = uint64_t{1} << 21;
constexpr uint64_t kFewLooks = 64;

// Draws leaves without replacement: from those with vertices and those without, as there may be few of the former and
// nearly all new vertices in them.
template <int D>
absl::StatusOr<Sample> SampleLeaves(const QueryStructure<D>& structure, Integrator<D>& integrator,
                                    const EstimateEffort& effort, const RunContext& context) {
  std::array<Stratum, 2> strata;
  structure.tree().ForEachLeaf([&](NodeId leaf) {
    const auto* const inside = structure.tree().VerticesIn(leaf);
    strata[inside != nullptr && inside->count > 0 ? 1 : 0].leaves.push_back(leaf);
  });
  const uint64_t full_looks =
      std::max(effort.looks_per_leaf, effort.looks / (strata[0].leaves.size() + strata[1].leaves.size()));
  const size_t least = std::max<size_t>(effort.least_leaves, 1);
  uint64_t looks = 0;
  Draws draws;
  Sample sample;
  while (true) {
    double variance = 0;
    double total = structure.vertex_count();
    Stratum* widest = nullptr;
    double widest_variance = 0;
    for (Stratum& stratum : strata) {
      const bool is_whole = stratum.taken == stratum.leaves.size();
      const double own = is_whole ? 0 : stratum.taken < least ? kInfinity : stratum.VarianceOfSum();
      variance += own;
      total += stratum.Factor() * stratum.vertices;
      if (own > widest_variance) {
        widest = &stratum;
        widest_variance = own;
      }
    }
    sample.error = std::sqrt(variance);
    if (widest == nullptr || sample.error <= effort.sampling_error * total) {
      break;
    }
    const size_t end = std::min(widest->leaves.size(), widest->taken + std::min(least, kLeavesTogether));
    for (; widest->taken < end; ++widest->taken) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
      const size_t rest = widest->leaves.size() - widest->taken;
      NodeId& leaf = widest->leaves[widest->taken];
      std::swap(leaf,
                widest->leaves[widest->taken +
                               std::min(rest - 1, static_cast<size_t>(draws.Next() * static_cast<double>(rest)))]);
      WELLSPACE_ASSIGN_OR_RETURN(
          const Share share,
          integrator.IntegrateLeaf(structure.tree(), leaf,
                                   looks > kMostLooks ? std::min(kFewLooks, full_looks) : full_looks, context));
      looks += integrator.looks();
      Add(widest->sum, share);
      const double vertices = Sum(integrator.VerticesOf(share.terms)) + share.sizes;
      const auto* const inside = structure.tree().VerticesIn(leaf);
      const double at_first = inside == nullptr ? 0.0 : inside->count;
      const Leaves become = LeavesOf<D>(at_first + vertices, at_first);
      widest->become.all += become.all;
      widest->become.filled += become.filled;
      widest->vertices += vertices;
      widest->vertices_sq += vertices * vertices;
    }
  }
  for (const Stratum& stratum : strata) {
    Add(sample.sum, stratum.sum, stratum.Factor());
    sample.leaves.all += stratum.Factor() * stratum.become.all;
    sample.leaves.filled += stratum.Factor() * stratum.become.filled;
  }
  return sample;
}

}  // namespace

template <int D>
absl::StatusOr<SizeEstimate> EstimateSize(const QueryStructure<D>& structure, const MeshCriteria<D>& criteria,
                                          const RunContext& context, const EstimateEffort& effort,
                                          const PlanarDomain* domain) {
  Integrator<D> integrator(structure, criteria, domain);
  WELLSPACE_RETURN_IF_ERROR(integrator.Prepare(structure, context));
  WELLSPACE_ASSIGN_OR_RETURN(const Sample sample, SampleLeaves<D>(structure, integrator, effort, context));

  const Terms added = integrator.VerticesOf(sample.sum.terms);
  // Near a face, every second vertex lies on it; in a flat or long box all do.
  const double on_boundary = static_cast<double>(integrator.on_boundary()) + 0.5 * added[kNearFace] + added[kOpposite] +
                             added[kEncroached] + added[kOnFace];
  SizeEstimate estimate;
  estimate.vertices = structure.vertex_count() + Sum(added) + sample.sum.sizes;
  estimate.simplices = SimplicesOf<D>(estimate.vertices, on_boundary);
  estimate.bytes = BytesOf<D>(sample.leaves, estimate.vertices, estimate.simplices);
  if (domain != nullptr) {
    estimate.bytes += DomainBytesOf(estimate.vertices, domain->segment_count());
  }
  estimate.sampling_error = sample.error / estimate.vertices;
  estimate.segments_compared = integrator.segments_compared();
  return estimate;
}

template <int D>
std::optional<SizeEstimate> TypicalSize(const QueryStructure<D>& structure, const MeshCriteria<D>& criteria) {
  if (D > 3 || criteria.criterion != Criterion::kRadiusEdge || criteria.rho < kTypicalRho<D> ||
      !criteria.sizes.regions().empty() || !criteria.sizes.samples().empty()) {
    return std::nullopt;
  }
  const auto count = static_cast<double>(structure.vertex_count());
  SizeEstimate size;
  size.vertices = kTypicalVertices * count + kTypicalOnBoundary<D> * std::pow(count, (D - 1.0) / D) +
                  TypicalVerticesForShape<D>(structure.box());
  if (!criteria.sizes.IsUnbounded()) {
    size.vertices += TypicalVerticesForSizes<D>(structure.box(), criteria.sizes);
  }
  size.simplices = kSimplicesPerVertex<D> * size.vertices;
  const double room = kTypicalRoom * size.vertices;
  const double leaves = std::max<double>(structure.tree().leaf_count(), room / kTypicalInLeaf);
  size.bytes = BytesOf<D>({leaves, leaves}, room, kSimplicesPerVertex<D> * room);
  return size.bytes <= kMostTypicalBytes ? std::optional(size) : std::nullopt;
}

#define WELLSPACE_INSTANTIATE(D)                                                                          \
  template std::optional<SizeEstimate> TypicalSize<D>(const QueryStructure<D>&, const MeshCriteria<D>&);  \
  template absl::StatusOr<SizeEstimate> EstimateSize<D>(const QueryStructure<D>&, const MeshCriteria<D>&, \
                                                        const RunContext&, const EstimateEffort&,         \
                                                        const PlanarDomain*);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
