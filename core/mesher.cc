#include "core/mesher.h"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/geometry/box.h"
#include "core/refine/refine.h"
#include "core/simplex/simplices.h"
#include "core/tree/morton.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {
namespace {

// Vertices nearer than this many steps of the Morton grid are refused as input: coordinates of Steiner points around
// them would be too coarse to keep rho. The refinement gives up on shorter edges than its own bound.
constexpr double kMinInputSteps = 64;
constexpr double kMinEdgeSteps = 4;

// The longest side of a domain is scaled to about 1 when it is beyond these powers of two, so that no product of
// lengths overflows.
constexpr int kMaxScaleExponent = 60;

// Leaves that the tree may have for each vertex of the budget; around isolated close pairs balance costs up to about two.
constexpr uint64_t kLeavesPerVertex = 8;

// Larger ones leave no room for sums and products.
constexpr double kMaxCoordinate = 0x1p1000;

// Cheap steps between two looks at the context.
constexpr size_t kCheckInterval = size_t{1} << 16;

uint64_t PeakMemoryBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<uint64_t>(usage.ru_maxrss) * 1024;
}

std::string FormatCoordinates(std::span<const double> p) {
  return absl::StrCat(
      "(", absl::StrJoin(p, ", ", [](std::string* out, double x) { absl::StrAppendFormat(out, "%.17g", x); }), ")");
}

template <int D>
Point<D> PointAt(std::span<const double> points, size_t index) {
  Point<D> p;
  std::copy_n(points.begin() + static_cast<std::ptrdiff_t>(index * D), D, p.begin());
  return p;
}

template <int D>
absl::Status CheckFinite(std::span<const double> points) {
  for (size_t i = 0; i < points.size(); ++i) {
    if (!std::isfinite(points[i])) {
      return absl::InvalidArgumentError(absl::StrCat("points[", i / D, "]: coordinate ", i % D, " is ", points[i],
                                                     "; coordinates must be finite numbers"));
    }
  }
  return absl::OkStatus();
}

template <int D>
absl::StatusOr<Box<D>> DomainOf(const MeshParameters& parameters, std::span<const double> points) {
  Box<D> box;
  if (!parameters.domain_low.empty()) {
    std::copy_n(parameters.domain_low.begin(), D, box.low.begin());
    std::copy_n(parameters.domain_high.begin(), D, box.high.begin());
    return box;
  }
  if (points.empty()) {
    return absl::InvalidArgumentError(
        "points: there are none and no domain is given; give a domain or at least one point");
  }
  box.low = box.high = PointAt<D>(points, 0);
  for (size_t i = 0; i < points.size(); ++i) {
    box.low[i % D] = std::min(box.low[i % D], points[i]);
    box.high[i % D] = std::max(box.high[i % D], points[i]);
  }
  double side = box.LongestSide();
  if (side == 0) {
    side = 1;  // one point, once or more often: any size serves
  }
  const double grow = parameters.margin * side;
  for (int i = 0; i < D; ++i) {
    box.low[i] -= grow;
    box.high[i] += grow;
  }
  return box;
}

template <int D>
absl::Status CheckDomain(const Box<D>& box) {
  double magnitude = 0;
  for (int i = 0; i < D; ++i) {
    if (!(std::abs(box.low[i]) <= kMaxCoordinate && std::abs(box.high[i]) <= kMaxCoordinate)) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "domain: along axis %d it goes from %g to %g; coordinates must be at most 2^1000; scale the points down", i,
          box.low[i], box.high[i]));
    }
    magnitude = std::max({magnitude, std::abs(box.low[i]), std::abs(box.high[i])});
  }
  for (int i = 0; i < D; ++i) {
    // The negation also catches a margin of zero around points in a plane.
    if (!(box.high[i] - box.low[i] > 0x1p-40 * magnitude) || box.high[i] - box.low[i] < 0x1p-900) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "domain: its extent along axis %d, from %.17g to %.17g, is too small; it must be at least 2^-40 of the "
          "largest coordinate, %g; give a larger domain or margin, or move the points nearer to the origin",
          i, box.low[i], box.high[i], magnitude));
    }
  }
  return absl::OkStatus();
}

// The distinct points of a cloud in the order that the query structure wants, scaled by a power of two.
template <int D>
struct SortedCloud {
  double scale = 1;
  Box<D> box;
  double grid_step = 0;
  std::vector<Point<D>> points;        // distinct, in Morton order
  std::vector<uint32_t> first_input;   // by sorted point: the first input equal to it
  std::vector<uint32_t> input_vertex;  // by input: its rank among the distinct points in the order of first appearance
  std::vector<uint32_t> output_index;  // by sorted point: the same rank
};

// The end of the errors that refuse points which are too close together.
template <int D>
std::string TooCloseRemedy(const SortedCloud<D>& cloud) {
  return absl::StrFormat(
      "too close for the arithmetic of doubles in this domain (at least %g is needed); merge them, or give a smaller "
      "domain nearer to "
      "the origin",
      kMinInputSteps * cloud.grid_step / cloud.scale);
}

template <int D>
absl::StatusOr<SortedCloud<D>> SortCloud(const Box<D>& box, std::span<const double> points, const RunContext& context) {
  SortedCloud<D> cloud;
  const int exponent = std::ilogb(box.LongestSide());
  cloud.scale = std::abs(exponent) <= kMaxScaleExponent ? 1.0 : std::ldexp(1.0, -exponent);
  const auto scaled = [&](Point<D> p) {
    for (double& x : p) {
      x = x * cloud.scale + 0.0;  // no negative zero: equal points have equal bits
    }
    return p;
  };
  cloud.box = Box<D>{scaled(box.low), scaled(box.high)};
  const MortonGrid<D> grid(cloud.box);
  cloud.grid_step = grid.quantum();

  struct Entry {
    GridPoint<D> cube;
    uint32_t input;
  };
  const auto point_of = [&](const Entry& entry) { return scaled(PointAt<D>(points, entry.input)); };
  const size_t count = points.size() / D;
  std::vector<Entry> entries(count);
  for (size_t i = 0; i < count; ++i) {
    if (i % kCheckInterval == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Point<D> p = PointAt<D>(points, i);
    if (!box.Contains(p)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "points[", i, "] = ", FormatCoordinates(p), " lies outside the domain ", FormatCoordinates(box.low), " to ",
          FormatCoordinates(box.high), "; enlarge the domain or drop the point"));
    }
    const Point<D> scaled_p = scaled(p);
    for (int k = 0; k < D; ++k) {
      if (scaled_p[k] / cloud.scale != p[k]) {
        return absl::InvalidArgumentError(absl::StrFormat(
            "points[%d]: coordinate %d is %g, too small for the arithmetic of doubles beside a domain of "
            "side %g; make it 0, or give a smaller domain",
            i, k, p[k], box.LongestSide()));
      }
    }
    entries[i] = {grid.CubeOf(scaled_p), static_cast<uint32_t>(i)};
  }
  // Points of one cube are equal, or too close to be served.
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(
      entries,
      [](const Entry& a, const Entry& b) {
        return a.cube != b.cube ? MortonLess<D>(a.cube, b.cube) : a.input < b.input;
      },
      context));

  cloud.points.reserve(count);
  cloud.input_vertex.assign(count, 0);
  for (size_t i = 0; i < count; ++i) {
    if (i % kCheckInterval == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Point<D> p = point_of(entries[i]);
    if (i == 0 || entries[i].cube != entries[i - 1].cube) {
      cloud.points.push_back(p);
      cloud.first_input.push_back(entries[i].input);
    } else if (p != cloud.points.back()) {
      const uint32_t first = cloud.first_input.back();
      const uint32_t second = entries[i].input;
      return absl::InvalidArgumentError(absl::StrFormat(
          "points[%d] = %s is only %g from points[%d], %s", second, FormatCoordinates(PointAt<D>(points, second)),
          std::sqrt(DistanceSq<D>(p, cloud.points.back())) / cloud.scale, first, TooCloseRemedy(cloud)));
    }
    // For now the sorted rank; below that by first appearance.
    cloud.input_vertex[entries[i].input] = static_cast<uint32_t>(cloud.points.size() - 1);
  }
  cloud.output_index.assign(cloud.points.size(), 0);
  uint32_t next = 0;
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t sorted = cloud.input_vertex[i];
    if (cloud.first_input[sorted] == i) {
      cloud.output_index[sorted] = next++;
    }
  }
  for (uint32_t& vertex : cloud.input_vertex) {
    vertex = cloud.output_index[vertex];
  }
  return cloud;
}

// Refuses points nearer to each other, or to a face of the box that they do not lie on, than the arithmetic serves.
template <int D>
absl::Status CheckSeparation(const SortedCloud<D>& cloud, const QueryStructure<D>& structure,
                             std::span<const double> points, const RunContext& context) {
  const double least = kMinInputSteps * cloud.grid_step;
  Workspace<D> workspace;
  for (uint32_t i = 0; i < cloud.points.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const VertexId v{i};
    const size_t input = cloud.first_input[i];
    const auto [nearest, nearest_sq] = structure.ApproximateNearestNeighbor(v, workspace);
    if (nearest_sq < least * least) {
      const bool is_input = Index(nearest) < cloud.points.size();
      return absl::InvalidArgumentError(absl::StrFormat(
          "points[%d] = %s is only %g from %s, %s", input, FormatCoordinates(PointAt<D>(points, input)),
          std::sqrt(nearest_sq) / cloud.scale,
          is_input ? absl::StrCat("points[", cloud.first_input[Index(nearest)], "]") : "a corner of the domain",
          TooCloseRemedy(cloud)));
    }
    for (int face = 0; face < 2 * D; ++face) {
      const double distance = cloud.box.DistanceToFace(structure.point(v), face);
      if (distance > 0 && distance < least) {
        return absl::InvalidArgumentError(
            absl::StrFormat("points[%d] = %s is only %g from the %s face of axis %d of the domain, too close for the "
                            "arithmetic of doubles (on it, or "
                            "at least %g away, is needed); move the domain's face",
                            input, FormatCoordinates(PointAt<D>(points, input)), distance / cloud.scale,
                            face % 2 == 0 ? "low" : "high", face / 2, least / cloud.scale));
      }
    }
  }
  return absl::OkStatus();
}

template <int D>
absl::StatusOr<Mesh> MeshPointsIn(const MeshParameters& parameters, std::span<const double> points,
                                  RunContext& context) {
  context.EnterPhase(Phase::kTree);
  WELLSPACE_RETURN_IF_ERROR(CheckFinite<D>(points));
  WELLSPACE_ASSIGN_OR_RETURN(const Box<D> box, DomainOf<D>(parameters, points));
  WELLSPACE_RETURN_IF_ERROR(CheckDomain<D>(box));
  WELLSPACE_ASSIGN_OR_RETURN(SortedCloud<D> cloud, SortCloud<D>(box, points, context));

  const uint64_t max_vertices =
      std::min(parameters.max_vertices == 0 ? kDefaultMaxVertices : parameters.max_vertices, kMaxVertices);
  const size_t input_count = cloud.points.size();
  if (input_count + (size_t{1} << D) > max_vertices) {
    return absl::ResourceExhaustedError(absl::StrCat("the ", input_count,
                                                     " distinct points and the domain's corners are more than ",
                                                     "max_vertices = ", max_vertices, " vertices; raise max_vertices"));
  }
  QueryStructure<D> structure;
  WELLSPACE_RETURN_IF_ERROR(
      structure.Initialize(cloud.box, cloud.points, kLeavesPerVertex * max_vertices + (1u << D), context));
  WELLSPACE_RETURN_IF_ERROR(CheckSeparation<D>(cloud, structure, points, context));
  context.SetVertices(structure.vertex_count());
  context.SetEstimatedVertices(input_count + structure.tree().leaf_count());

  context.EnterPhase(Phase::kRefinement);
  RefinementParameters refinement;
  refinement.rho = parameters.rho == 0 ? DefaultRho(D) : parameters.rho;
  refinement.max_vertices = max_vertices;
  refinement.min_edge = kMinEdgeSteps * cloud.grid_step;
  QueryCounters cells;
  WELLSPACE_RETURN_IF_ERROR(Refine<D>(refinement, structure, context, cells));

  context.EnterPhase(Phase::kSimplices);
  std::vector<uint32_t> output_index = std::move(cloud.output_index);
  output_index.resize(structure.vertex_count());
  std::iota(output_index.begin() + static_cast<std::ptrdiff_t>(input_count), output_index.end(),
            static_cast<uint32_t>(input_count));
  WELLSPACE_ASSIGN_OR_RETURN(Simplices simplices,
                             ComputeSimplices<D>(structure, output_index, parameters.threads, context));

  Mesh mesh;
  mesh.dimension = D;
  mesh.domain_low.assign(box.low.begin(), box.low.end());
  mesh.domain_high.assign(box.high.begin(), box.high.end());
  mesh.points.resize(size_t{structure.vertex_count()} * D);
  for (uint32_t i = 0; i < structure.vertex_count(); ++i) {
    if (i % kCheckInterval == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    Point<D> p;
    if (i < input_count) {
      p = PointAt<D>(points, cloud.first_input[i]);
    } else {
      p = structure.point(VertexId{i});
      for (double& x : p) {
        x /= cloud.scale;
      }
    }
    std::copy_n(p.begin(), D, mesh.points.begin() + static_cast<std::ptrdiff_t>(size_t{output_index[i]} * D));
  }
  mesh.simplices = std::move(simplices.indices);
  mesh.input_vertex = std::move(cloud.input_vertex);
  context.EnterPhase(Phase::kDone);

  MeshStatistics& statistics = mesh.statistics;
  statistics.input_points = points.size() / D;
  statistics.duplicates = statistics.input_points - input_count;
  statistics.vertices = mesh.vertex_count();
  statistics.simplices = mesh.simplex_count();
  statistics.max_radius_edge = simplices.max_radius_edge;
  statistics.min_angle_deg = simplices.min_angle_deg;
  statistics.tree_seconds = absl::ToDoubleSeconds(context.TimeIn(Phase::kTree));
  statistics.refinement_seconds = absl::ToDoubleSeconds(context.TimeIn(Phase::kRefinement));
  statistics.simplices_seconds = absl::ToDoubleSeconds(context.TimeIn(Phase::kSimplices));
  statistics.total_seconds = statistics.tree_seconds + statistics.refinement_seconds + statistics.simplices_seconds;
  statistics.peak_memory_bytes = PeakMemoryBytes();
  statistics.tree_leaves = structure.tree().leaf_count();
  statistics.cells_computed = cells.queries;
  statistics.leaves_visited = cells.leaves;
  statistics.vertices_visited = cells.vertices;
  statistics.cuts = cells.cuts;
  statistics.max_leaves_visited = cells.max_leaves;
  statistics.stars_computed = simplices.counters.queries;
  statistics.star_leaves_visited = simplices.counters.leaves;
  statistics.star_vertices_visited = simplices.counters.vertices;
  statistics.star_cuts = simplices.counters.cuts;
  statistics.max_star_leaves_visited = simplices.counters.max_leaves;
  statistics.exact_predicates = cells.decisions.exact + simplices.counters.decisions.exact;
  statistics.perturbed_predicates = cells.decisions.perturbed + simplices.counters.decisions.perturbed;
  return mesh;
}

}  // namespace

double DefaultRho(int dimension) { return dimension == 2 ? std::sqrt(2.0) : 2.0; }

double MinimumRho(int dimension) { return dimension == 2 ? 0.9 : 1.1; }

absl::Status ValidateParameters(const MeshParameters& parameters) {
  const int dimension = parameters.dimension;
  if (dimension < kMinDimension || dimension > kMaxDimension) {
    return absl::InvalidArgumentError(
        absl::StrCat("dimension: ", dimension, " is not supported; ", kMinDimension, " to ", kMaxDimension, " are"));
  }
  if (parameters.rho != 0 && !(parameters.rho >= MinimumRho(dimension) && std::isfinite(parameters.rho))) {
    return absl::InvalidArgumentError(absl::StrCat("rho: ", parameters.rho, " is not allowed in ", dimension,
                                                   "-D; refinement ends for ", MinimumRho(dimension),
                                                   " or more, and the default is ", DefaultRho(dimension)));
  }
  if (parameters.domain_low.size() != parameters.domain_high.size() ||
      (!parameters.domain_low.empty() && parameters.domain_low.size() != static_cast<size_t>(dimension))) {
    return absl::InvalidArgumentError(absl::StrCat("domain: ", parameters.domain_low.size(), " low and ",
                                                   parameters.domain_high.size(), " high coordinates; ", dimension,
                                                   " of each are needed, or none"));
  }
  for (size_t i = 0; i < parameters.domain_low.size(); ++i) {
    const double low = parameters.domain_low[i];
    const double high = parameters.domain_high[i];
    if (!std::isfinite(low) || !std::isfinite(high) || !(low < high)) {
      return absl::InvalidArgumentError(
          absl::StrCat("domain: along axis ", i, " it goes from ", low, " to ", high,
                       "; finite numbers are needed, the low one less than the high one"));
    }
  }
  if (!(parameters.margin >= 0 && parameters.margin <= 1e6)) {
    return absl::InvalidArgumentError(
        absl::StrCat("margin: ", parameters.margin, " is not allowed; 0 to 1e6 times the longest side is"));
  }
  if (parameters.threads < 1 || parameters.threads > 1024) {
    return absl::InvalidArgumentError(absl::StrCat("threads: ", parameters.threads, " is not allowed; 1 to 1024 is"));
  }
  return absl::OkStatus();
}

absl::StatusOr<Mesh> MeshPoints(const MeshParameters& parameters, std::span<const double> points, RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(ValidateParameters(parameters));
  if (points.size() % parameters.dimension != 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        "points: ", points.size(), " coordinates are not a multiple of the dimension, ", parameters.dimension));
  }
  if (points.size() / parameters.dimension > kMaxVertices) {
    return absl::InvalidArgumentError(absl::StrCat("points: ", points.size() / parameters.dimension,
                                                   " are more than vertices can be numbered; at most ", kMaxVertices,
                                                   " are accepted"));
  }
  return parameters.dimension == 2 ? MeshPointsIn<2>(parameters, points, context)
                                   : MeshPointsIn<3>(parameters, points, context);
}

}  // namespace wellspace::core
