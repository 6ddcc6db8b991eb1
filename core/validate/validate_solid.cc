#include "core/validate/validate_solid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/features/union_find.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/largest_coordinate.h"
#include "core/geometry/point.h"
#include "core/geometry/vector_product.h"
#include "core/simplex/boundary.h"
#include "core/simplex/quality.h"
#include "core/validate/empty_spheres.h"
#include "core/validate/facet_edges.h"

namespace wellspace::core {
namespace {

constexpr size_t kStepsBetweenLooks = 1024;
constexpr double kRatioTolerance = 1e-9;
// Facets that make less than this angle leave no room for good tetrahedra. Unit: degrees.
constexpr double kAcute = 75;

absl::Status Violation(const std::string& what) { return absl::FailedPreconditionError(what); }

// A triangle, as a tetrahedron or a facet has it.
struct FaceUse {
  std::array<uint32_t, 3> vertices{};  // ascending
  bool is_facet = false;
  bool is_even = false;  // whether ascending vertices are counterclockwise seen from outside
  uint64_t user = 0;     // the tetrahedron or the facet
};

std::string NameOf(const FaceUse& use) {
  return absl::StrCat("the face of vertices ", absl::StrJoin(use.vertices, ", "));
}

FaceUse UseOf(std::array<uint32_t, 3> corners, bool is_facet, uint64_t user) {
  // Each exchange of neighbours turns it.
  bool is_even = true;
  for (const auto& [i, k] : {std::pair(0, 1), std::pair(1, 2), std::pair(0, 1)}) {
    if (corners[k] < corners[i]) {
      std::swap(corners[k], corners[i]);
      is_even = !is_even;
    }
  }
  return {.vertices = corners, .is_facet = is_facet, .is_even = is_even, .user = user};
}

// The corners of the faces of a tetrahedron, in the order in which the corner across from them, put before them, leaves
// the orientation as it is.
constexpr std::array<std::array<uint32_t, 3>, 4> kFaces = {{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

// The uses of faces by tetrahedra and facets, sorted, so that uses of one face follow each other, tetrahedra first.
absl::StatusOr<std::vector<FaceUse>> FacesOf(std::span<const uint32_t> simplices, std::span<const uint32_t> facets,
                                             const RunContext& context) {
  std::vector<FaceUse> uses;
  uses.reserve(simplices.size() + facets.size() / 3);
  for (size_t s = 0; s < simplices.size() / 4; ++s) {
    if (s % kStepsBetweenLooks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const auto corners = simplices.subspan(4 * s, 4);
    for (const std::array<uint32_t, 3>& face : kFaces) {
      uses.push_back(UseOf({corners[face[0]], corners[face[1]], corners[face[2]]}, false, s));
    }
  }
  for (size_t f = 0; f < facets.size() / 3; ++f) {
    uses.push_back(UseOf({facets[3 * f], facets[3 * f + 1], facets[3 * f + 2]}, true, f));
  }
  const auto before = [](const FaceUse& a, const FaceUse& b) {
    return std::tie(a.vertices, a.is_facet, a.user) < std::tie(b.vertices, b.is_facet, b.user);
  };
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(uses, before, context));
  return uses;
}

class SolidChecker {
 public:
  SolidChecker(const MeshView& mesh, const SolidParts& parts, const RunContext& context)
      : mesh_(mesh), parts_(parts), context_(context), pieces_(static_cast<uint32_t>(mesh.simplices.size() / 4)) {}

  absl::StatusOr<SolidMeshReport> Check(double rho) {
    WELLSPACE_RETURN_IF_ERROR(CheckRows());
    WELLSPACE_RETURN_IF_ERROR(ValidateIndices(mesh_));
    WELLSPACE_RETURN_IF_ERROR(ValidateOrientation(mesh_));
    WELLSPACE_RETURN_IF_ERROR(CheckFacets());
    WELLSPACE_RETURN_IF_ERROR(CheckFaces());
    WELLSPACE_ASSIGN_OR_RETURN(const FacetEdges edges, FacetEdges::Of(facets(), context_));
    WELLSPACE_RETURN_IF_ERROR(CheckRidges(edges));
    WELLSPACE_RETURN_IF_ERROR(CheckSpheres());
    WELLSPACE_RETURN_IF_ERROR(CheckRatios(edges, rho));
    CountEdges(edges);
    WELLSPACE_RETURN_IF_ERROR(Measure());
    return std::move(report_);
  }

 private:
  std::span<const uint32_t> facets() const { return parts_.domain.boundary.facets; }
  std::span<const int32_t> tags() const { return parts_.domain.boundary.tags; }
  size_t TetrahedronCount() const { return mesh_.simplices.size() / 4; }
  int32_t RegionOf(uint64_t tetrahedron) const {
    return parts_.domain.regions.empty() ? 0 : parts_.domain.regions[tetrahedron];
  }
  Point<3> At(uint32_t vertex) const { return PointAt<3>(mesh_.points, vertex); }

  absl::Status Look(size_t step) const { return step % kStepsBetweenLooks == 0 ? context_.Check() : absl::OkStatus(); }

  absl::Status CheckRows() const {
    if (mesh_.dimension != 3 || facets().size() % 3 != 0 || parts_.ridges.size() % 2 != 0) {
      return absl::InvalidArgumentError(absl::StrCat(
          "a domain in space has dimension 3, facets of 3 vertices and ridges of 2; the mesh has dimension ",
          mesh_.dimension, ", ", facets().size(), " numbers in its facets and ", parts_.ridges.size(),
          " in its ridges"));
    }
    if (!tags().empty() && tags().size() != facets().size() / 3) {
      return absl::InvalidArgumentError(
          absl::StrCat(tags().size(), " tags are not one for each of the ", facets().size() / 3, " facets"));
    }
    if (!parts_.domain.regions.empty() && parts_.domain.regions.size() != TetrahedronCount()) {
      return absl::InvalidArgumentError(absl::StrCat(parts_.domain.regions.size(), " regions are not one for each of ",
                                                     "the ", TetrahedronCount(), " tetrahedra"));
    }
    // Uses of faces, sides of facets, boxes around vertices, and the copies of sorting.
    return context_.AllowMemory(2 * sizeof(FaceUse) * (mesh_.simplices.size() + facets().size() / 3) +
                                2 * sizeof(FacetSide) * facets().size() + 100 * (mesh_.points.size() / 3));
  }

  absl::Status CheckFacets() const {
    const size_t vertices = mesh_.points.size() / 3;
    for (size_t i = 0; i < facets().size(); ++i) {
      if (facets()[i] >= vertices) {
        return Violation(
            absl::StrCat("facet ", i / 3, " has vertex ", facets()[i], ", but there are ", vertices, " vertices"));
      }
    }
    for (size_t f = 0; f < tags().size(); ++f) {
      if (tags()[f] == kNoTag) {
        return Violation(absl::StrCat("facet ", f, " has the tag 0, which stands for none"));
      }
    }
    return absl::OkStatus();
  }

  absl::Status CheckFaces() {
    WELLSPACE_ASSIGN_OR_RETURN(const std::vector<FaceUse> uses, FacesOf(mesh_.simplices, facets(), context_));
    for (size_t begin = 0, end = 0; begin < uses.size(); begin = end) {
      WELLSPACE_RETURN_IF_ERROR(Look(begin));
      while (end < uses.size() && uses[end].vertices == uses[begin].vertices) {
        ++end;
      }
      WELLSPACE_RETURN_IF_ERROR(CheckFace(std::span<const FaceUse>(uses).subspan(begin, end - begin)));
    }
    return absl::OkStatus();
  }

  // The uses of one face: tetrahedra first.
  absl::Status CheckFace(std::span<const FaceUse> uses) {
    const auto tetrahedra =
        static_cast<size_t>(std::count_if(uses.begin(), uses.end(), [](const FaceUse& use) { return !use.is_facet; }));
    if (tetrahedra == 0) {
      return Violation(absl::StrCat("facet ", uses[0].user, ": ", NameOf(uses[0]), " is of no tetrahedron"));
    }
    if (tetrahedra > 2 || (tetrahedra == 2 && uses[0].is_even == uses[1].is_even)) {
      return Violation(absl::StrCat("tetrahedra ", uses[0].user, " and ", uses[1].user, ": ", NameOf(uses[0]),
                                    " has two tetrahedra on one side"));
    }
    if (uses.size() > tetrahedra + 1) {
      return Violation(absl::StrCat("facet ", uses[tetrahedra + 1].user, ": ", NameOf(uses[0]), " is there twice"));
    }
    if (uses.size() == tetrahedra) {
      return tetrahedra == 2 ? Join(uses)
                             : Violation(absl::StrCat(NameOf(uses[0]), " is of tetrahedron ", uses[0].user,
                                                      " alone, and no facet"));
    }
    return CheckSide(uses, tetrahedra);
  }

  // Two tetrahedra at a face that is no facet.
  absl::Status Join(std::span<const FaceUse> uses) {
    const std::array<int32_t, 2> regions = {RegionOf(uses[0].user), RegionOf(uses[1].user)};
    if (regions[0] != regions[1]) {
      return Violation(absl::StrCat("tetrahedra ", uses[0].user, " and ", uses[1].user, " have regions ", regions[0],
                                    " and ", regions[1], ", but ", NameOf(uses[0]), " between them is no facet"));
    }
    pieces_.Join(static_cast<uint32_t>(uses[0].user), static_cast<uint32_t>(uses[1].user));
    return absl::OkStatus();
  }

  // Checks which side of a facet is the inner one.
  absl::Status CheckSide(std::span<const FaceUse> uses, size_t tetrahedra) const {
    const FaceUse& facet = uses[tetrahedra];
    if (tetrahedra == 2 && RegionOf(uses[0].user) == RegionOf(uses[1].user)) {
      return absl::OkStatus();  // either of them
    }
    const FaceUse& owner = tetrahedra == 2 && RegionOf(uses[1].user) < RegionOf(uses[0].user) ? uses[1] : uses[0];
    return facet.is_even == owner.is_even
               ? absl::OkStatus()
               : Violation(absl::StrCat("facet ", facet.user, ": ", NameOf(facet), " has tetrahedron ", owner.user,
                                        tetrahedra == 2 ? " of the lower region" : "",
                                        " on its outer side; exchange two of its vertices"));
  }

  absl::Status CheckRidges(const FacetEdges& edges) const {
    std::vector<std::array<uint32_t, 2>> sorted;
    for (size_t r = 0; r < parts_.ridges.size() / 2; ++r) {
      WELLSPACE_RETURN_IF_ERROR(Look(r));
      const auto [low, high] = std::minmax(parts_.ridges[2 * r], parts_.ridges[2 * r + 1]);
      if (!edges.Has({low, high})) {
        return Violation(absl::StrCat("ridge ", r, " of vertices ", low, " and ", high, " is no edge of a facet"));
      }
      sorted.push_back({low, high});
    }
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(sorted, std::less<>(), context_));
    const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
    return twice == sorted.end() ? absl::OkStatus()
                                 : Violation(absl::StrCat("the ridge of vertices ", (*twice)[0], " and ", (*twice)[1],
                                                          " is there twice"));
  }

  // Vertices on edges at which two facets make a small angle, and those that are in a facet with one: of the tubes
  // around these edges.
  std::vector<bool> AcuteVertices(const FacetEdges& edges) const {
    std::vector<bool> is_acute(mesh_.points.size() / 3);
    edges.ForEach([&](std::span<const FacetSide> sides) {
      const Point<3> from = At(sides[0].ends[0]);
      const Point<3> along = Difference<3>(At(sides[0].ends[1]), from);
      const auto across_of = [&](const FacetSide& side) { return Cross(along, Difference<3>(At(side.apex), from)); };
      for (size_t i = 0; i < sides.size(); ++i) {
        for (size_t k = 0; k < i; ++k) {
          if (AngleBetween(across_of(sides[i]), across_of(sides[k])) < kAcute) {
            is_acute[sides[0].ends[0]] = is_acute[sides[0].ends[1]] = true;
          }
        }
      }
    });
    std::vector<bool> is_near = is_acute;
    edges.ForEach([&](std::span<const FacetSide> sides) {
      for (const FacetSide& side : sides) {
        if (is_acute[side.ends[0]] || is_acute[side.ends[1]] || is_acute[side.apex]) {
          is_near[side.ends[0]] = is_near[side.ends[1]] = is_near[side.apex] = true;
        }
      }
    });
    return is_near;
  }

  // Around acute creases vertices mirror each other, four on a circle: one may be inside by what is rounded.
  absl::Status CheckSpheres() const {
    constexpr double kRoundingOfPlace = 0x1p-40;
    constexpr double kRoundingOfRadius = 1e-10;
    WELLSPACE_ASSIGN_OR_RETURN(const double largest, LargestCoordinate(mesh_.points, context_));
    return CheckEmptySpheres<3>(mesh_, "tetrahedron", "circumsphere", context_, [&](double depth, double radius) {
      return depth <= kRoundingOfPlace * largest + kRoundingOfRadius * radius;
    });
  }

  absl::Status CheckRatios(const FacetEdges& edges, double rho) {
    if (rho == 0) {
      return absl::OkStatus();
    }
    const std::vector<bool> is_acute = AcuteVertices(edges);
    for (size_t s = 0; s < TetrahedronCount(); ++s) {
      WELLSPACE_RETURN_IF_ERROR(Look(s));
      const double ratio = RadiusEdgeRatio<3>(CornersOf(s));
      if (ratio <= rho * (1 + kRatioTolerance)) {
        continue;
      }
      const auto corners = mesh_.simplices.subspan(4 * s, 4);
      if (std::none_of(corners.begin(), corners.end(), [&](uint32_t v) { return is_acute[v]; })) {
        return Violation(
            absl::StrFormat("tetrahedron %d: circumradius over shortest edge is %g; at most %g is allowed "
                            "but at acute edges of the boundary",
                            s, ratio, rho));
      }
      ++report_.over_rho;
    }
    return absl::OkStatus();
  }

  void CountEdges(const FacetEdges& edges) {
    edges.ForEach([&](std::span<const FacetSide> sides) {
      report_.open_edges += sides.size() == 1 ? 1 : 0;
      report_.branching_edges += sides.size() > 2 ? 1 : 0;
    });
  }

  absl::Status Measure() {
    for (size_t s = 0; s < TetrahedronCount(); ++s) {
      WELLSPACE_RETURN_IF_ERROR(Look(s));
      const Simplex<3> c = CornersOf(s);
      report_.volumes[RegionOf(s)] +=
          Dot<3>(Difference<3>(c[1], c[0]), Cross(Difference<3>(c[2], c[0]), Difference<3>(c[3], c[0]))) / 6;
      report_.pieces += pieces_.Find(static_cast<uint32_t>(s)) == s ? 1 : 0;
    }
    for (size_t f = 0; f < facets().size() / 3; ++f) {
      const Point<3> a = At(facets()[3 * f]);
      report_.areas[tags().empty() ? 0 : tags()[f]] +=
          std::sqrt(
              NormSq<3>(Cross(Difference<3>(At(facets()[3 * f + 1]), a), Difference<3>(At(facets()[3 * f + 2]), a)))) /
          2;
    }
    return absl::OkStatus();
  }

  Simplex<3> CornersOf(size_t tetrahedron) const {
    Simplex<3> corners;
    for (size_t k = 0; k < 4; ++k) {
      corners[k] = At(mesh_.simplices[4 * tetrahedron + k]);
    }
    return corners;
  }

  const MeshView& mesh_;
  const SolidParts& parts_;
  const RunContext& context_;
  UnionFind pieces_;  // of tetrahedra
  SolidMeshReport report_;
};

}  // namespace

absl::StatusOr<SolidMeshReport> ValidateSolidMesh(const MeshView& mesh, const SolidParts& parts, double rho,
                                                  const RunContext& context) {
  return SolidChecker(mesh, parts, context).Check(rho);
}

absl::StatusOr<std::vector<uint32_t>> FacetsOfRegions(const MeshView& mesh, std::span<const int32_t> regions,
                                                      const RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(2 * sizeof(FaceUse) * mesh.simplices.size()));
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<FaceUse> uses, FacesOf(mesh.simplices, {}, context));
  const auto region_of = [&](const FaceUse& use) { return regions.empty() ? 0 : regions[use.user]; };
  std::vector<uint32_t> facets;
  for (size_t i = 0, next = 0; i < uses.size(); i = next) {
    next = i + 1;
    const FaceUse* owner = &uses[i];
    if (next < uses.size() && uses[next].vertices == uses[i].vertices) {
      const FaceUse& other = uses[next++];
      if (region_of(other) == region_of(uses[i])) {
        continue;
      }
      owner = region_of(other) < region_of(uses[i]) ? &other : owner;
    }
    const std::array<uint32_t, 3>& v = owner->vertices;
    facets.insert(facets.end(), {v[0], owner->is_even ? v[1] : v[2], owner->is_even ? v[2] : v[1]});
  }
  return facets;
}

}  // namespace wellspace::core
