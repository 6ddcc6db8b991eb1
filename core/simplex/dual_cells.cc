#include "core/simplex/dual_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/geometry/point.h"
#include "core/simplex/quality.h"

namespace wellspace::core {
namespace {

// Rows that one thread looks at before the next look at the context.
constexpr size_t kRowsTogether = 1 << 12;

size_t BlocksOf(size_t rows) { return (rows + kRowsTogether - 1) / kRowsTogether; }

template <int D>
constexpr int kEdges = D*(D + 1) / 2;  // of a simplex

// The number of the edge between two corners of a simplex.
constexpr int EdgeOf(int i, int j) {
  const int low = i < j ? i : j;
  const int high = i < j ? j : i;
  return high * (high - 1) / 2 + low;
}

Point<3> Cross(const Point<3>& a, const Point<3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

template <int D>
double DoubleArea(const Point<D>& a, const Point<D>& b) {
  if constexpr (D == 2) {
    return std::abs(a[0] * b[1] - a[1] * b[0]);
  } else {
    return std::sqrt(NormSq<3>(Cross(a, b)));
  }
}

// In the triangle p, q, r: how far its circumcentre is from the edge p, q; negative beyond it, as seen from r. It is
// half the edge times the cotangent of the angle at r.
template <int D>
double Foot(const Point<D>& p, const Point<D>& q, const Point<D>& r) {
  const Point<D> a = Difference<D>(p, r);
  const Point<D> b = Difference<D>(q, r);
  return 0.5 * std::sqrt(DistanceSq<D>(p, q)) * Dot<D>(a, b) / DoubleArea<D>(a, b);
}

// The part in the simplex of the facet that is dual to each edge; parts beyond a face are negative.
std::array<double, kEdges<2>> PartsOf(const Simplex<2>& corners) {
  std::array<double, kEdges<2>> parts;
  parts[EdgeOf(0, 1)] = Foot<2>(corners[0], corners[1], corners[2]);
  parts[EdgeOf(0, 2)] = Foot<2>(corners[0], corners[2], corners[1]);
  parts[EdgeOf(1, 2)] = Foot<2>(corners[1], corners[2], corners[0]);
  return parts;
}

// Here a part is made of two right triangles: of the edge's middle, the circumcentre, and that of a face at the edge.
// All heights are of one circumcentre: whichever point it is, they make up the volume of the simplex.
std::array<double, kEdges<3>> PartsOf(const Simplex<3>& corners) {
  // Positively oriented as seen from the other corner, which is number `face`.
  constexpr int kFaces[4][3] = {{1, 3, 2}, {0, 2, 3}, {0, 3, 1}, {0, 1, 2}};
  std::array<double, kEdges<3>> parts{};
  const Point<3> center = CircumcentreOffset<3>(corners);
  for (const auto& face : kFaces) {
    const Point<3>& p = corners[face[0]];
    const Point<3> normal = Cross(Difference<3>(corners[face[1]], p), Difference<3>(corners[face[2]], p));
    const Point<3> away = Difference<3>(center, Difference<3>(p, corners[0]));
    const double height = Dot<3>(away, normal) / std::sqrt(NormSq<3>(normal));
    for (int k = 0; k < 3; ++k) {
      const int i = face[k];
      const int j = face[(k + 1) % 3];
      parts[EdgeOf(i, j)] += 0.5 * height * Foot<3>(corners[i], corners[j], corners[face[(k + 2) % 3]]);
    }
  }
  return parts;
}

// For each corner of a facet of the boundary, its part of the facet.
std::array<double, 2> SharesOf(const std::array<Point<2>, 2>& facet) {
  const double half = 0.5 * std::sqrt(DistanceSq<2>(facet[0], facet[1]));
  return {half, half};
}

std::array<double, 3> SharesOf(const std::array<Point<3>, 3>& facet) {
  std::array<double, 3> shares{};
  for (int k = 0; k < 3; ++k) {
    const Point<3>& p = facet[k];
    const Point<3>& q = facet[(k + 1) % 3];
    const double cone = 0.25 * std::sqrt(DistanceSq<3>(p, q)) * Foot<3>(p, q, facet[(k + 2) % 3]);
    shares[k] += cone;
    shares[(k + 1) % 3] += cone;
  }
  return shares;
}

// A part of the facet between a vertex and one with a greater number.
struct Part {
  uint32_t neighbour;
  uint32_t simplex;
  double area;
};

template <int D>
class DualFinder {
 public:
  explicit DualFinder(const DelaunayMesh& mesh)
      : points_(mesh.points),
        simplices_(mesh.simplices),
        facets_(mesh.facets),
        vertices_(mesh.points.size() / D),
        count_(mesh.simplices.size() / (D + 1)) {}

  absl::StatusOr<DualCells> Find(int threads, const RunContext& context) {
    ThreadTeam team(threads);
    DualCells cells;
    WELLSPACE_RETURN_IF_ERROR(FindParts(team, context));
    FindSimplicesAtVertices();
    WELLSPACE_RETURN_IF_ERROR(AddParts(team, context, cells));
    WELLSPACE_RETURN_IF_ERROR(FindVolumes(context, cells));
    WELLSPACE_RETURN_IF_ERROR(FindFacetAreas(team, context, cells));
    return cells;
  }

 private:
  // Row `index` of `rows`, or an error that names the first vertex which is not there.
  template <size_t N>
  absl::StatusOr<std::array<Point<D>, N>> PointsOf(std::span<const uint32_t> rows, size_t index,
                                                   const char* kind) const {
    std::array<Point<D>, N> points;
    for (size_t k = 0; k < N; ++k) {
      const uint32_t vertex = rows[index * N + k];
      if (vertex >= vertices_) {
        return absl::InvalidArgumentError(
            absl::StrCat(kind, " ", index, " has vertex ", vertex, "; the mesh has ", vertices_));
      }
      points[k] = PointAt<D>(points_, vertex);
    }
    return points;
  }

  absl::Status FindParts(ThreadTeam& team, const RunContext& context) {
    parts_.resize(count_ * kEdges<D>);
    return team.TryForEach(BlocksOf(count_), [&](size_t block) -> absl::Status {
      const size_t end = std::min(count_, (block + 1) * kRowsTogether);
      for (size_t s = block * kRowsTogether; s < end; ++s) {
        const absl::StatusOr<Simplex<D>> corners = PointsOf<D + 1>(simplices_, s, "simplex");
        if (!corners.ok()) return corners.status();
        const std::array<double, kEdges<D>> parts = PartsOf(*corners);
        if (!std::all_of(parts.begin(), parts.end(), [](double part) { return std::isfinite(part); })) {
          return absl::InvalidArgumentError(absl::StrCat("simplex ", s, " is flat"));
        }
        std::copy(parts.begin(), parts.end(), parts_.begin() + static_cast<ptrdiff_t>(s * kEdges<D>));
      }
      return context.Check();
    });
  }

  // By vertex, each one's ascending.
  void FindSimplicesAtVertices() {
    first_.assign(vertices_ + 1, 0);
    for (const uint32_t vertex : simplices_) {
      ++first_[vertex + 1];
    }
    for (size_t v = 0; v < vertices_; ++v) {
      first_[v + 1] += first_[v];
    }
    HugeVector<uint64_t> next(first_.begin(), first_.end());
    at_vertices_.resize(simplices_.size());
    for (size_t at = 0; at < simplices_.size(); ++at) {
      at_vertices_[next[simplices_[at]]++] = static_cast<uint32_t>(at / (D + 1));
    }
  }

  // The parts of the facets between `vertex` and those with greater numbers, in an order that is always the same.
  void CollectParts(uint32_t vertex, std::vector<Part>& found) const {
    found.clear();
    for (uint64_t at = first_[vertex]; at < first_[vertex + 1]; ++at) {
      const uint32_t s = at_vertices_[at];
      const uint32_t* corners = &simplices_[size_t{s} * (D + 1)];
      const int i = static_cast<int>(std::find(corners, corners + D + 1, vertex) - corners);
      for (int j = 0; j <= D; ++j) {
        if (corners[j] > vertex) {
          found.push_back({corners[j], s, parts_[size_t{s} * kEdges<D> + EdgeOf(i, j)]});
        }
      }
    }
    std::sort(found.begin(), found.end(), [](const Part& a, const Part& b) {
      return std::tie(a.neighbour, a.simplex) < std::tie(b.neighbour, b.simplex);
    });
  }

  absl::Status AddParts(ThreadTeam& team, const RunContext& context, DualCells& cells) {
    struct Block {
      std::vector<uint32_t> edges;
      std::vector<double> areas;
    };
    std::vector<Block> blocks(BlocksOf(vertices_));
    WELLSPACE_RETURN_IF_ERROR(team.TryForEach(blocks.size(), [&](size_t block) {
      auto& [edges, areas] = blocks[block];
      std::vector<Part> found;
      const size_t end = std::min(vertices_, (block + 1) * kRowsTogether);
      for (size_t v = block * kRowsTogether; v < end; ++v) {
        CollectParts(static_cast<uint32_t>(v), found);
        for (size_t k = 0; k < found.size(); ++k) {
          if (k == 0 || found[k].neighbour != found[k - 1].neighbour) {
            edges.insert(edges.end(), {static_cast<uint32_t>(v), found[k].neighbour});
            areas.push_back(0);
          }
          areas.back() += found[k].area;
        }
      }
      return context.Check();
    }));
    for (const Block& block : blocks) {
      cells.edges.insert(cells.edges.end(), block.edges.begin(), block.edges.end());
      cells.areas.insert(cells.areas.end(), block.areas.begin(), block.areas.end());
    }
    return absl::OkStatus();
  }

  // A cell is made of the cones from its vertex over its facets, of half an edge's length each.
  absl::Status FindVolumes(const RunContext& context, DualCells& cells) const {
    cells.volumes.assign(vertices_, 0);
    cells.lengths.resize(cells.areas.size());
    for (size_t e = 0; e < cells.areas.size(); ++e) {
      if (e % kStepsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      const uint32_t* ends = &cells.edges[2 * e];
      cells.lengths[e] = std::sqrt(DistanceSq<D>(PointAt<D>(points_, ends[0]), PointAt<D>(points_, ends[1])));
      const double cone = cells.areas[e] * cells.lengths[e] / (2 * D);
      cells.volumes[ends[0]] += cone;
      cells.volumes[ends[1]] += cone;
    }
    return absl::OkStatus();
  }

  absl::Status FindFacetAreas(ThreadTeam& team, const RunContext& context, DualCells& cells) const {
    const size_t facets = facets_.size() / D;
    cells.facet_areas.resize(facets_.size());
    return team.TryForEach(BlocksOf(facets), [&](size_t block) -> absl::Status {
      const size_t end = std::min(facets, (block + 1) * kRowsTogether);
      for (size_t f = block * kRowsTogether; f < end; ++f) {
        const absl::StatusOr<std::array<Point<D>, D>> corners = PointsOf<D>(facets_, f, "facet");
        if (!corners.ok()) return corners.status();
        const std::array<double, D> shares = SharesOf(*corners);
        std::copy(shares.begin(), shares.end(), cells.facet_areas.begin() + static_cast<ptrdiff_t>(f * D));
      }
      return context.Check();
    });
  }

  const std::span<const double> points_;
  const std::span<const uint32_t> simplices_;
  const std::span<const uint32_t> facets_;
  const size_t vertices_;
  const size_t count_;                // of simplices
  HugeVector<double> parts_;          // count_ x kEdges: of the facet of each edge
  HugeVector<uint64_t> first_;        // vertices_ + 1: where those of a vertex begin in at_vertices_
  HugeVector<uint32_t> at_vertices_;  // simplices
};

}  // namespace

absl::StatusOr<DualCells> FindDualCells(const DelaunayMesh& mesh, int threads, const RunContext& context) {
  const int d = mesh.dimension;
  if (d != 2 && d != 3) {
    return absl::InvalidArgumentError(absl::StrCat("dual cells are for 2-D and 3-D; the mesh is in ", d, "-D"));
  }
  if (!mesh.weights.empty()) {
    return absl::InvalidArgumentError(
        "the mesh is a regular triangulation, whose dual are no Voronoi cells; mesh without pump_weights");
  }
  if (mesh.points.size() % d != 0 || mesh.simplices.size() % (d + 1) != 0 || mesh.facets.size() % d != 0) {
    return absl::InvalidArgumentError(absl::StrCat("points, simplices and facets of a mesh in ", d, "-D have rows of ",
                                                   d, ", ", d + 1, " and ", d, "; there are ", mesh.points.size(), ", ",
                                                   mesh.simplices.size(), " and ", mesh.facets.size(), " numbers"));
  }
  return d == 2 ? DualFinder<2>(mesh).Find(threads, context) : DualFinder<3>(mesh).Find(threads, context);
}

}  // namespace wellspace::core
