#include "client/render/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <string>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/simplex/quality.h"

namespace wellspace::render {
namespace {

using core::Difference;
using core::Dot;
using core::Point;
using core::Simplex;

constexpr double kBestDihedralAngle = 70.528779365509308;  // of a regular tetrahedron. Unit: degrees

template <int D>
Point<D> PointOf(const formats::MeshView& mesh, uint32_t vertex) {
  Point<D> point;
  std::copy_n(mesh.points.begin() + uint64_t{vertex} * D, D, point.begin());
  return point;
}

template <int D>
Simplex<D> SimplexOf(const formats::MeshView& mesh, uint64_t simplex) {
  Simplex<D> corners;
  for (int i = 0; i <= D; ++i) {
    corners[i] = PointOf<D>(mesh, mesh.simplices[simplex * (D + 1) + i]);
  }
  return corners;
}

Point<3> Cross(const Point<3>& a, const Point<3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Point<3> Normalized(const Point<3>& a) {
  const double norm = std::hypot(a[0], a[1], a[2]);
  return {a[0] / norm, a[1] / norm, a[2] / norm};
}

Point<3> Combine(double a, const Point<3>& x, double b, const Point<3>& y, double c, const Point<3>& z) {
  Point<3> out;
  for (int i = 0; i < 3; ++i) {
    out[i] = a * x[i] + b * y[i] + c * z[i];
  }
  return out;
}

// The box of the picture, from corners in double precision.
struct Extent {
  Point<2> low = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  Point<2> high = {-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};

  void Add(const Point<2>& point) {
    for (int axis = 0; axis < 2; ++axis) {
      low[axis] = std::min(low[axis], point[axis]);
      high[axis] = std::max(high[axis], point[axis]);
    }
  }
};

PicturePoint PictureOf(const Point<2>& point, const Extent& extent) {
  return {static_cast<float>(point[0] - extent.low[0]), static_cast<float>(point[1] - extent.low[1])};
}

Facet MakeFacet(const std::array<Point<2>, 3>& corners, const Extent& extent, double share, double shade) {
  Facet facet;
  for (int i = 0; i < 3; ++i) {
    facet.corners[i] = PictureOf(corners[i], extent);
  }
  facet.share = static_cast<float>(share);
  facet.shade = static_cast<float>(shade);
  return facet;
}

absl::Status SetSize(const Extent& extent, Scene& scene) {
  scene.width = extent.high[0] - extent.low[0];
  scene.height = extent.high[1] - extent.low[1];
  const double longest = std::max(scene.width, scene.height);
  // Facets are stored as floats.
  constexpr double kLongest = 1e37;
  constexpr double kShortest = 1e-30;
  if (!(longest <= kLongest && longest >= kShortest)) {
    return absl::InvalidArgumentError(
        absl::StrCat("expected a mesh whose extent is between ", kShortest, " and ", kLongest, ", got ", longest));
  }
  return absl::OkStatus();
}

// The category of each facet that is drawn, where colours mean regions or parts of the boundary.
class Categories {
 public:
  // REQUIRES:   `mesh` outlives this.
  Categories(const formats::MeshView& mesh, Colouring colouring) : mesh_(mesh), colouring_(colouring) {
    for (uint32_t i = 0; colouring == Colouring::kRegion && i < mesh.regions.size(); ++i) {
      region_of_[mesh.regions[i].id] = i;
    }
    if (colouring != Colouring::kBoundary) {
      return;
    }
    size_t facet = 0;
    for (uint32_t part = 0; part < mesh.boundary.size(); ++part) {
      for (uint64_t i = 0; i < mesh.boundary[part].facets && 3 * facet + 2 < mesh.facets.size(); ++i, ++facet) {
        tagged_.push_back(
            {Sorted({mesh.facets[3 * facet], mesh.facets[3 * facet + 1], mesh.facets[3 * facet + 2]}), part});
      }
    }
    std::sort(tagged_.begin(), tagged_.end());
  }

  uint32_t OfSimplex(uint64_t simplex) const {
    if (region_of_.empty() || mesh_.simplex_regions.empty()) {
      return 0;
    }
    const auto found = region_of_.find(mesh_.simplex_regions[simplex]);
    return found == region_of_.end() ? 0 : found->second;
  }

  // Of a facet of that simplex in 3-D.
  uint32_t OfFacet(uint64_t simplex, const std::array<uint32_t, 3>& vertices) const {
    if (colouring_ != Colouring::kBoundary) {
      return OfSimplex(simplex);
    }
    const std::array<uint32_t, 3> key = Sorted(vertices);
    const auto found = std::lower_bound(tagged_.begin(), tagged_.end(), std::pair(key, uint32_t{0}));
    return found == tagged_.end() || found->first != key ? static_cast<uint32_t>(mesh_.boundary.size()) : found->second;
  }

  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (uint32_t i = 0; i < region_of_.size(); ++i) {
      const formats::Region& region = mesh_.regions[i];
      names.push_back(region.name.empty() ? absl::StrCat("region ", region.id) : region.name);
    }
    if (colouring_ == Colouring::kBoundary) {
      for (const formats::BoundaryPart& part : mesh_.boundary) {
        names.push_back(part.name.empty() ? absl::StrCat("tag ", part.tag) : part.name);
      }
      names.emplace_back("no tag");
    }
    return names;
  }

 private:
  static std::array<uint32_t, 3> Sorted(std::array<uint32_t, 3> vertices) {
    std::sort(vertices.begin(), vertices.end());
    return vertices;
  }

  const formats::MeshView& mesh_;
  const Colouring colouring_;
  std::map<int32_t, uint32_t> region_of_;                             // index by id
  std::vector<std::pair<std::array<uint32_t, 3>, uint32_t>> tagged_;  // facets and their parts, sorted
};

// The values of a field at vertices, or of simplices, as colours tell them apart.
class FieldValues {
 public:
  // REQUIRES:   `field` outlives this; it has a number for each vertex, or for each simplex.
  FieldValues(const formats::Attribute& field, bool is_of_simplices)
      : field_(field), is_of_simplices_(is_of_simplices) {
    for (const double value : field.values) {
      if (std::isfinite(value)) {
        low_ = std::min(low_, value);
        high_ = std::max(high_, value);
      }
    }
  }

  bool HasAny() const { return low_ <= high_; }

  // Of these vertices of a simplex, the share of the way from the lowest to the highest value: differences of doubles
  // may be beyond floats.
  double ShareAt(uint64_t simplex, std::span<const uint32_t> vertices) const {
    if (is_of_simplices_) {
      return ShareOf(simplex);
    }
    double sum = 0;
    for (const uint32_t vertex : vertices) {
      sum += ShareOf(vertex);
    }
    return sum / static_cast<double>(vertices.size());
  }

  const std::string& name() const { return field_.name; }
  double low() const { return low_; }
  double high() const { return high_; }

 private:
  double ShareOf(uint64_t number) const {
    const double value = field_.values[number];
    return !std::isfinite(value) ? std::numeric_limits<double>::quiet_NaN()
           : low_ == high_       ? 0.5
                                 : (value / 2 - low_ / 2) / (high_ / 2 - low_ / 2);
  }

  const formats::Attribute& field_;
  const bool is_of_simplices_;
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = -std::numeric_limits<double>::infinity();
};

// Begins a scene of values, which are those of `field` or, if it is null, angles.
Scene SceneOf(const FieldValues* field, double best_angle_deg, const char* angles) {
  return field == nullptr
             ? Scene{.high = best_angle_deg, .legend = angles}
             : Scene{.low = field->low(), .high = field->high(), .is_angle = false, .legend = field->name()};
}

// Which of the three vertices have dots.
std::array<bool, 3> DotsAt(const std::vector<bool>& dots, std::span<const uint32_t> vertices) {
  return dots.empty() ? std::array<bool, 3>{}
                      : std::array<bool, 3>{dots[vertices[0]], dots[vertices[1]], dots[vertices[2]]};
}

absl::StatusOr<Scene> MakePlaneScene(const formats::MeshView& mesh, const std::vector<bool>& dots,
                                     const Categories& categories, const FieldValues* field) {
  Extent extent;
  for (const uint32_t vertex : mesh.simplices) {
    extent.Add(PointOf<2>(mesh, vertex));
  }
  constexpr double kBestAngle = 60;
  Scene scene = SceneOf(field, kBestAngle, "smallest angle");
  WELLSPACE_RETURN_IF_ERROR(SetSize(extent, scene));
  scene.facets.reserve(mesh.simplex_count());
  for (uint64_t simplex = 0; simplex < mesh.simplex_count(); ++simplex) {
    const Simplex<2> corners = SimplexOf<2>(mesh, simplex);
    const std::span<const uint32_t> vertices = mesh.simplices.subspan(3 * simplex, 3);
    const double share =
        field == nullptr ? core::Angles<2>(corners).min_deg / kBestAngle : field->ShareAt(simplex, vertices);
    scene.facets.push_back(MakeFacet({corners[0], corners[1], corners[2]}, extent, share, 1));
    scene.facets.back().category = categories.OfSimplex(simplex);
    scene.facets.back().has_dot = DotsAt(dots, vertices);
  }
  for (size_t i = 0; i + 1 < mesh.facets.size(); i += 2) {
    scene.boundary.push_back(
        {PictureOf(PointOf<2>(mesh, mesh.facets[i]), extent), PictureOf(PointOf<2>(mesh, mesh.facets[i + 1]), extent)});
  }
  return scene;
}

// Directions of the picture in space: to the right, upwards, and towards the spectator.
struct Camera {
  Point<3> right;
  Point<3> up;
  Point<3> towards;

  Point<2> Project(const Point<3>& point) const { return {Dot<3>(point, right), Dot<3>(point, up)}; }
};

// Looks at the cut from its front, a little from the side and from above.
Camera MakeCamera(const Point<3>& normal, int up_axis) {
  Point<3> up{};
  up[up_axis] = 1;
  if (std::abs(Dot<3>(up, normal)) > 0.9) {
    up = {};
    up[(up_axis + 2) % 3] = 1;
  }
  const Point<3> side = Normalized(Cross(up, normal));
  const Point<3> above = Cross(normal, side);
  Camera camera;
  camera.towards = Normalized(Combine(1.0, normal, 0.55, side, 0.4, above));
  camera.right = Normalized(Cross(up, camera.towards));
  camera.up = Cross(camera.towards, camera.right);
  return camera;
}

// Looks from where `towards` points to.
absl::StatusOr<Camera> CameraAt(const std::array<double, 3>& towards, int up_axis) {
  const double norm = std::hypot(towards[0], towards[1], towards[2]);
  if (!(norm > 0 && std::isfinite(norm))) {
    return absl::InvalidArgumentError("expected a camera whose direction has a length, got one of length " +
                                      std::to_string(norm));
  }
  Camera camera;
  camera.towards = Normalized(towards);
  Point<3> up{};
  up[up_axis] = 1;
  if (std::abs(Dot<3>(up, camera.towards)) > 0.999) {
    up = {};
    up[(up_axis + 1) % 3] = 1;  // from above: the next axis points upwards
  }
  camera.right = Normalized(Cross(up, camera.towards));
  camera.up = Cross(camera.towards, camera.right);
  return camera;
}

absl::StatusOr<Plane> CutOf(const formats::MeshView& mesh, const std::optional<Plane>& wanted) {
  if (wanted.has_value()) {
    const Point<3> normal = wanted->normal;
    const double norm = std::hypot(normal[0], normal[1], normal[2]);
    if (!(norm > 0 && std::isfinite(norm))) {
      return absl::InvalidArgumentError("expected a plane whose normal has a direction, got one of length " +
                                        std::to_string(norm));
    }
    return Plane{.normal = Normalized(normal), .offset = wanted->offset / norm};
  }
  const Point<3> first = PointOf<3>(mesh, mesh.simplices[0]);
  double low = first[0];
  double high = first[0];
  for (uint64_t vertex = 0; vertex < mesh.vertex_count(); ++vertex) {
    low = std::min(low, mesh.points[3 * vertex]);
    high = std::max(high, mesh.points[3 * vertex]);
  }
  return Plane{.normal = {1, 0, 0}, .offset = low + (high - low) / 2};
}

std::vector<uint64_t> SimplicesBehind(const formats::MeshView& mesh, const Plane& plane) {
  std::vector<uint64_t> kept;
  for (uint64_t simplex = 0; simplex < mesh.simplex_count(); ++simplex) {
    double sum = 0;
    for (const Point<3>& corner : SimplexOf<3>(mesh, simplex)) {
      sum += Dot<3>(corner, plane.normal) / 4;
    }
    if (sum <= plane.offset) {
      kept.push_back(simplex);
    }
  }
  return kept;
}

// A facet of a tetrahedron: the one opposite to `corner`.
struct FacetOf {
  uint32_t middle_vertex;  // of the three, in order of their indices
  uint32_t last_vertex;
  uint32_t kept;  // index of the tetrahedron among those that are kept
  uint32_t corner;

  bool SameFacet(const FacetOf& other) const {
    return middle_vertex == other.middle_vertex && last_vertex == other.last_vertex;
  }
};

// The facets that belong to one of the `kept` tetrahedra only. Sorted by their first vertex by counting, then each few
// by the others: the facets of big meshes are too many for one sort.
std::vector<FacetOf> ExposedFacets(const formats::MeshView& mesh, const std::vector<uint64_t>& kept) {
  std::vector<uint64_t> begin(mesh.vertex_count() + 1);
  std::vector<FacetOf> facets(4 * kept.size());
  // First counts the facets of each first vertex, then puts each in its place, from the end of its range downwards.
  for (const bool placing : {false, true}) {
    for (uint32_t k = 0; k < kept.size(); ++k) {
      for (uint32_t corner = 0; corner < 4; ++corner) {
        std::array<uint32_t, 3> vertices;
        for (uint32_t i = 0; i < 3; ++i) {
          vertices[i] = mesh.simplices[4 * kept[k] + (corner + 1 + i) % 4];
        }
        std::sort(vertices.begin(), vertices.end());
        if (placing) {
          facets[--begin[vertices[0]]] = {vertices[1], vertices[2], k, corner};
        } else {
          ++begin[vertices[0]];
        }
      }
    }
    if (!placing) {
      std::partial_sum(begin.begin(), begin.end(), begin.begin());
    }
  }
  std::vector<FacetOf> exposed;
  for (uint64_t vertex = 0; vertex < mesh.vertex_count(); ++vertex) {
    const auto first = facets.begin() + begin[vertex];
    const auto last = facets.begin() + begin[vertex + 1];
    std::sort(first, last, [](const FacetOf& a, const FacetOf& b) {
      return std::tie(a.middle_vertex, a.last_vertex) < std::tie(b.middle_vertex, b.last_vertex);
    });
    for (auto facet = first; facet != last;) {
      const auto next = std::find_if(facet, last, [&](const FacetOf& other) { return !other.SameFacet(*facet); });
      if (next - facet == 1) {
        exposed.push_back(*facet);
      }
      facet = next;
    }
  }
  return exposed;
}

// An exposed facet that the spectator sees, before it is painted.
struct VisibleFacet {
  std::array<Point<2>, 3> corners;
  double depth;
  double share;
  double shade;
  uint32_t category = 0;
  std::array<bool, 3> has_dot{};
};

// None when the facet looks away.
std::optional<VisibleFacet> MakeVisible(const Simplex<3>& simplex, int corner, const Camera& camera) {
  const Point<3>& a = simplex[(corner + 1) % 4];
  const Point<3>& b = simplex[(corner + 2) % 4];
  const Point<3>& c = simplex[(corner + 3) % 4];
  Point<3> normal = Cross(Difference<3>(b, a), Difference<3>(c, a));
  if (Dot<3>(normal, Difference<3>(simplex[corner], a)) > 0) {
    normal = {-normal[0], -normal[1], -normal[2]};
  }
  if (!(Dot<3>(normal, camera.towards) > 0)) {
    return std::nullopt;
  }
  normal = Normalized(normal);
  const Point<3> light = Normalized(Combine(1.0, camera.towards, -0.45, camera.right, 0.7, camera.up));
  VisibleFacet facet;
  facet.corners = {camera.Project(a), camera.Project(b), camera.Project(c)};
  facet.shade = 0.7 + 0.35 * std::max(0.0, Dot<3>(normal, light));
  facet.share = core::Angles<3>(simplex).min_deg / kBestDihedralAngle;
  const double to_centre = Dot<3>(core::CircumcentreOffset<3>(simplex), camera.towards);
  facet.depth = Dot<3>(simplex[0], camera.towards) + (std::isfinite(to_centre) ? to_centre : 0);
  return facet;
}

absl::StatusOr<Scene> MakeCutScene(const formats::MeshView& mesh, const View& view, const Categories& categories,
                                   const FieldValues* field) {
  WELLSPACE_ASSIGN_OR_RETURN(Plane plane, CutOf(mesh, view.plane));
  if (view.only_boundary) {
    plane.offset = std::numeric_limits<double>::infinity();
  }
  const std::vector<uint64_t> kept = SimplicesBehind(mesh, plane);
  if (kept.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("the plane cuts off all of the ", mesh.simplex_count(),
                     " tetrahedra; expected one with some behind it, which is where its normal does not point"));
  }
  Camera camera = MakeCamera(plane.normal, view.up);
  if (view.camera.has_value()) {
    WELLSPACE_ASSIGN_OR_RETURN(camera, CameraAt(*view.camera, view.up));
  }
  std::vector<VisibleFacet> visible;
  Extent extent;
  for (const FacetOf& exposed : ExposedFacets(mesh, kept)) {
    std::optional<VisibleFacet> facet =
        MakeVisible(SimplexOf<3>(mesh, kept[exposed.kept]), static_cast<int>(exposed.corner), camera);
    if (facet.has_value()) {
      const uint64_t simplex = kept[exposed.kept];
      const auto corner_at = [&](uint32_t i) { return mesh.simplices[4 * simplex + (exposed.corner + i) % 4]; };
      const std::array<uint32_t, 3> corners = {corner_at(1), corner_at(2), corner_at(3)};
      facet->category = categories.OfFacet(simplex, corners);
      facet->has_dot = DotsAt(view.dots, corners);
      if (field != nullptr) {
        facet->share = field->ShareAt(simplex, corners);
      }
      visible.push_back(*facet);
      for (const Point<2>& corner : facet->corners) {
        extent.Add(corner);
      }
    }
  }
  std::stable_sort(visible.begin(), visible.end(),
                   [](const VisibleFacet& a, const VisibleFacet& b) { return a.depth < b.depth; });
  Scene scene = SceneOf(field, kBestDihedralAngle, "smallest dihedral angle");
  WELLSPACE_RETURN_IF_ERROR(SetSize(extent, scene));
  scene.facets.reserve(visible.size());
  for (const VisibleFacet& facet : visible) {
    scene.facets.push_back(MakeFacet(facet.corners, extent, facet.share, facet.shade));
    scene.facets.back().category = facet.category;
    scene.facets.back().has_dot = facet.has_dot;
  }
  return scene;
}

absl::Status CheckDots(const formats::MeshView& mesh, const View& view) {
  return view.dots.empty() || view.dots.size() == mesh.vertex_count()
             ? absl::OkStatus()
             : absl::InvalidArgumentError(absl::StrCat("expected to be told of ", mesh.vertex_count(),
                                                       " vertices whether they have a dot, got ", view.dots.size()));
}

}  // namespace

absl::StatusOr<Scene> MakeScene(const formats::MeshView& mesh, const View& view) {
  if (mesh.dimension > 3) {
    return absl::InvalidArgumentError(
        absl::StrCat("only 2-D and 3-D meshes can be drawn, and this one is ", mesh.dimension, "-D"));
  }
  if (mesh.simplex_count() == 0) {
    return absl::InvalidArgumentError("the mesh has no simplices; expected at least one to draw");
  }
  for (const double coordinate : mesh.points) {
    if (!(std::abs(coordinate) <= 1e150)) {
      return absl::InvalidArgumentError(
          absl::StrCat("expected coordinates of magnitude at most 1e150, got ", coordinate));
    }
  }
  if (mesh.dimension == 2 && view.plane.has_value()) {
    return absl::InvalidArgumentError("a plane cuts 3-D meshes only, and this one is 2-D");
  }
  if (mesh.dimension == 2 && (view.camera.has_value() || view.only_boundary)) {
    return absl::InvalidArgumentError("a camera, and the boundary alone, are of 3-D meshes, and this one is 2-D");
  }
  if (view.only_boundary && view.plane.has_value()) {
    return absl::InvalidArgumentError("a plane cuts the mesh, of which the boundary alone was asked for");
  }
  WELLSPACE_RETURN_IF_ERROR(CheckDots(mesh, view));
  const Colouring colouring =
      view.colouring.value_or(view.only_boundary && mesh.boundary.size() > 1 ? Colouring::kBoundary
                              : mesh.regions.size() > 1                      ? Colouring::kRegion
                                                                             : Colouring::kAngle);
  if (colouring == Colouring::kRegion && mesh.regions.empty()) {
    return absl::InvalidArgumentError("the file tells of no regions; expected a mesh with some, or colours by angle");
  }
  if (colouring == Colouring::kBoundary && (mesh.dimension == 2 || mesh.boundary.empty())) {
    return absl::InvalidArgumentError(
        "colours of the boundary are for 3-D meshes with one; expected such a mesh, or colours by region or angle");
  }
  const Categories categories(mesh, colouring);
  std::optional<FieldValues> field;
  if (colouring == Colouring::kField) {
    const uint64_t count = view.is_field_of_simplices ? mesh.simplex_count() : mesh.vertex_count();
    if (view.field->values.size() != count) {
      return absl::InvalidArgumentError(absl::StrCat("expected a value of ", view.field->name, " for each of the ",
                                                     count, view.is_field_of_simplices ? " simplices" : " vertices",
                                                     ", got ", view.field->values.size()));
    }
    field.emplace(*view.field, view.is_field_of_simplices);
    if (!field->HasAny()) {
      return absl::InvalidArgumentError(absl::StrCat("no ", view.is_field_of_simplices ? "simplex" : "vertex",
                                                     " has a finite value of ", view.field->name, "; expected some"));
    }
  }
  const FieldValues* const values = field.has_value() ? &*field : nullptr;
  WELLSPACE_ASSIGN_OR_RETURN(Scene scene, mesh.dimension == 2 ? MakePlaneScene(mesh, view.dots, categories, values)
                                                              : MakeCutScene(mesh, view, categories, values));
  scene.categories = categories.Names();
  if (colouring == Colouring::kBoundary) {
    const auto untagged = static_cast<uint32_t>(mesh.boundary.size());
    const bool has_any = std::any_of(scene.facets.begin(), scene.facets.end(),
                                     [&](const Facet& facet) { return facet.category == untagged; });
    scene.categories.resize(untagged + (has_any ? 1 : 0));
  }
  return scene;
}

}  // namespace wellspace::render
