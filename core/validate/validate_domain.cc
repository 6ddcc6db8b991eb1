#include "core/validate/validate_domain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/geometry/box_tree.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"
#include "core/geometry/segment.h"
#include "core/simplex/quality.h"
#include "core/validate/empty_spheres.h"
#include "core/validate/facet_fans.h"

namespace wellspace::core {
namespace {

using Edge = std::pair<uint32_t, uint32_t>;

constexpr size_t kStepsBetweenLooks = 1024;
constexpr double kRatioTolerance = 1e-9;
// How far from its circumcentre a triangle is looked around, in circumradii, for the segment that a better vertex would
// have come too near to. That vertex lies within the circumcircle or a little beyond, and so much nearer to the
// segment.
constexpr double kReach = 1 + 0.5 * std::numbers::sqrt2;
// A line of facets goes on where two of them differ in direction by less, by the cosine: places of vertices are
// rounded.
constexpr double kStraight = 1e-9;

absl::Status Violation(const std::string& what) { return absl::FailedPreconditionError(what); }

std::array<uint32_t, 3> CornersOf(const MeshView& mesh, size_t triangle) {
  return {mesh.simplices[3 * triangle], mesh.simplices[3 * triangle + 1], mesh.simplices[3 * triangle + 2]};
}

Simplex<2> PlacesOf(const MeshView& mesh, const std::array<uint32_t, 3>& corners) {
  return {PointAt<2>(mesh.points, corners[0]), PointAt<2>(mesh.points, corners[1]),
          PointAt<2>(mesh.points, corners[2])};
}

std::string NameOf(const Edge& edge) { return absl::StrCat("the edge of vertices ", edge.first, " and ", edge.second); }

// The lines that facets form.
class FacetLines {
 public:
  FacetLines(const MeshView& mesh, std::span<const uint32_t> facets)
      : facets_(facets), fans_(mesh.points, facets), tree_(BoxesOf(mesh, facets)), leads_(facets.size()) {}

  // Whether a line that comes within `reach` of `p` meets another one at less than 60 degrees.
  //
  // Complexity: O(sqrt(facets) + k) for most queries, and O(facets log) for all lines.
  bool HaveSmallAngleNear(const Point<2>& p, double reach) {
    bool have = false;
    tree_.ForEach(WithinReachOf<2>(p, reach), [&](uint32_t f) {
      have = DistanceToSegment(fans_.At(facets_[size_t{2} * f]), fans_.At(facets_[size_t{2} * f + 1]), p) <= reach &&
             (LeadsToSmallAngle(2 * f) || LeadsToSmallAngle(2 * f + 1));
      return !have;
    });
    return have;
  }

 private:
  enum class Leads : uint8_t { kUnknown, kNowhere, kToSmallAngle };

  static std::vector<Box<2>> BoxesOf(const MeshView& mesh, std::span<const uint32_t> facets) {
    std::vector<Box<2>> boxes;
    for (size_t f = 0; f < facets.size(); f += 2) {
      boxes.push_back(BoxOfEnds(PointAt<2>(mesh.points, facets[f]), PointAt<2>(mesh.points, facets[f + 1])));
    }
    return boxes;
  }

  // Follows the line of a facet from the end `facets_[from]` to the other, and onwards.
  bool LeadsToSmallAngle(uint32_t from) {
    std::vector<uint32_t> way;
    Leads found = Leads::kNowhere;
    for (std::optional<uint32_t> at = from; at; at = Next(*at, found)) {
      if (leads_[*at] != Leads::kUnknown) {
        found = leads_[*at];
        break;
      }
      leads_[*at] = Leads::kNowhere;  // for a line that comes back
      way.push_back(*at);
    }
    for (const uint32_t one : way) {
      leads_[one] = found;
    }
    return found == Leads::kToSmallAngle;
  }

  // Where the line goes on after the facet: none at its end, or at a small angle, which is then `found`.
  std::optional<uint32_t> Next(uint32_t from, Leads& found) const {
    const uint32_t to = facets_[from ^ 1];
    const Point<2> back = Difference<2>(fans_.At(facets_[from]), fans_.At(to));
    const auto cosine_of = [&](const FacetFans::Way& way) {
      const Point<2> away = Difference<2>(fans_.At(way.to), fans_.At(to));
      return Dot<2>(back, away) / std::sqrt(NormSq<2>(back) * NormSq<2>(away));
    };
    fans_.ForEachNear(to, back, [&](const FacetFans::Way& way) {
      if (way.to != facets_[from] && cosine_of(way) > 0.5) {
        found = Leads::kToSmallAngle;
      }
    });
    std::optional<uint32_t> next;
    if (found == Leads::kToSmallAngle) {
      return next;
    }
    fans_.ForEachNear(to, {-back[0], -back[1]}, [&](const FacetFans::Way& way) {
      if (way.to != facets_[from] && cosine_of(way) < -1 + kStraight) {
        next = facets_[size_t{2} * way.facet] == to ? 2 * way.facet : 2 * way.facet + 1;
      }
    });
    return next;
  }

  const std::span<const uint32_t> facets_;
  const FacetFans fans_;
  const BoxTree<2> tree_;     // of facets
  std::vector<Leads> leads_;  // by the end that a line comes from
};

// Whether a triangle may break rho, the radius-edge ratio being `ratio`. `is_on_facet`: of vertices.
bool IsExempt(const MeshView& mesh, FacetLines& lines, const std::vector<bool>& is_on_facet, size_t triangle,
              double ratio) {
  const auto corners = CornersOf(mesh, triangle);
  const Simplex<2> places = PlacesOf(mesh, corners);
  int shortest = 0;
  for (int k = 1; k < 3; ++k) {
    if (DistanceSq<2>(places[k], places[(k + 1) % 3]) < DistanceSq<2>(places[shortest], places[(shortest + 1) % 3])) {
      shortest = k;
    }
  }
  if (is_on_facet[corners[shortest]] && is_on_facet[corners[(shortest + 1) % 3]]) {
    return true;
  }
  if (ratio > std::numbers::sqrt2 * (1 + kRatioTolerance)) {
    return false;
  }
  const Point<2> offset = ExactCircumcentreOffset<2>(places);
  return lines.HaveSmallAngleNear({places[0][0] + offset[0], places[0][1] + offset[1]},
                                  kReach * std::sqrt(NormSq<2>(offset)));
}

// An edge, as one triangle or one facet has it.
struct EdgeUse {
  Edge ends;  // ascending
  bool is_backwards = false;
  bool is_facet = false;
  size_t user = 0;

  Edge Directed() const { return is_backwards ? Edge{ends.second, ends.first} : ends; }
};

absl::StatusOr<std::vector<EdgeUse>> EdgesOf(const MeshView& mesh, std::span<const uint32_t> facets,
                                             const RunContext& context) {
  std::vector<EdgeUse> uses;
  uses.reserve(mesh.simplices.size() + facets.size() / 2);
  const auto add = [&](uint32_t u, uint32_t v, bool is_facet, size_t user) {
    uses.push_back({std::minmax(u, v), v < u, is_facet, user});
  };
  for (size_t t = 0; t < mesh.simplices.size() / 3; ++t) {
    const auto corners = CornersOf(mesh, t);
    for (int k = 0; k < 3; ++k) {
      add(corners[k], corners[(k + 1) % 3], false, t);
    }
  }
  for (size_t f = 0; f < facets.size() / 2; ++f) {
    const Edge edge = {facets[2 * f], facets[2 * f + 1]};
    if (edge.first >= mesh.points.size() / 2 || edge.second >= mesh.points.size() / 2) {
      return Violation(absl::StrCat("facet ", f, ": ", NameOf(edge), " names a vertex that there is not"));
    }
    add(edge.first, edge.second, true, f);
  }
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(
      uses,
      [](const EdgeUse& a, const EdgeUse& b) {
        return std::tie(a.ends, a.is_facet, a.is_backwards, a.user) <
               std::tie(b.ends, b.is_facet, b.is_backwards, b.user);
      },
      context));
  return uses;
}

// The entries of one edge: triangles first, by direction, then facets.
absl::Status CheckEdge(std::span<const EdgeUse> uses) {
  std::array<bool, 2> has_triangle = {false, false};  // by direction
  const EdgeUse* facet = nullptr;
  for (const EdgeUse& use : uses) {
    const auto direction = static_cast<size_t>(use.is_backwards);
    if (!use.is_facet) {
      if (std::exchange(has_triangle[direction], true)) {
        return Violation(
            absl::StrCat("triangle ", use.user, ": ", NameOf(use.Directed()), " has two triangles on one side"));
      }
      continue;
    }
    if (!has_triangle[direction]) {
      return Violation(absl::StrCat("facet ", use.user, ": ", NameOf(use.Directed()), " has no triangle on its left"));
    }
    if (std::exchange(facet, &use) != nullptr) {
      return Violation(absl::StrCat("facet ", use.user, ": ", NameOf(use.Directed()), " is there twice"));
    }
  }
  if (facet == nullptr && has_triangle[0] != has_triangle[1]) {
    return Violation(absl::StrCat(NameOf(uses[0].Directed()), " has one triangle, and is no facet"));
  }
  return absl::OkStatus();
}

absl::Status CheckEdges(const MeshView& mesh, std::span<const uint32_t> facets, const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<EdgeUse> uses, EdgesOf(mesh, facets, context));
  for (size_t begin = 0, end = 0; begin < uses.size(); begin = end) {
    while (end < uses.size() && uses[end].ends == uses[begin].ends) {
      ++end;
    }
    WELLSPACE_RETURN_IF_ERROR(CheckEdge(std::span<const EdgeUse>(uses).subspan(begin, end - begin)));
  }
  return context.Check();
}

}  // namespace

absl::StatusOr<DomainReport> ValidateDomainMesh(const MeshView& mesh, std::span<const uint32_t> facets, double rho,
                                                const RunContext& context) {
  if (mesh.dimension != 2 || facets.size() % 2 != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("a domain has dimension 2 and facets of 2 vertices; the mesh has dimension ", mesh.dimension,
                     " and ", facets.size(), " numbers in its facets"));
  }
  WELLSPACE_RETURN_IF_ERROR(ValidateIndices(mesh));
  WELLSPACE_RETURN_IF_ERROR(ValidateOrientation(mesh));
  WELLSPACE_RETURN_IF_ERROR(CheckEdges(mesh, facets, context));
  WELLSPACE_RETURN_IF_ERROR(CheckEmptySpheres<2>(mesh, "triangle", "circumcircle", context));
  DomainReport report;
  if (rho == 0) {
    return report;
  }
  std::vector<bool> is_on_facet(mesh.points.size() / 2);
  for (const uint32_t v : facets) {
    is_on_facet[v] = true;
  }
  FacetLines lines(mesh, facets);
  for (size_t t = 0; t < mesh.simplices.size() / 3; ++t) {
    if (t % kStepsBetweenLooks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const double ratio = RadiusEdgeRatio<2>(PlacesOf(mesh, CornersOf(mesh, t)));
    if (ratio <= rho * (1 + kRatioTolerance)) {
      continue;
    }
    if (!IsExempt(mesh, lines, is_on_facet, t, ratio)) {
      return Violation(absl::StrCat("triangle ", t, ": circumradius over shortest edge is ", ratio, "; at most ", rho,
                                    " is allowed but at small angles of segments"));
    }
    ++report.exempt;
  }
  return report;
}

}  // namespace wellspace::core
