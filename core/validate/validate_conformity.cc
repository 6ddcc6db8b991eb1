// The check that a mesh is that of its domain.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/segment.h"
#include "core/simplex/boundary.h"
#include "core/validate/domain_pieces.h"
#include "core/validate/face_sweep.h"
#include "core/validate/merged_domain.h"
#include "core/validate/polygon_search.h"
#include "core/validate/validate_domain.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
constexpr size_t kStepsBetweenLooks = 1024;
// By how much an area may be off, relatively: it is a sum of many.
constexpr double kAreaTolerance = 1e-9;

absl::Status Broken(const std::string& what) { return absl::FailedPreconditionError(what); }

std::string PlaceName(const Point<2>& p) { return absl::StrFormat("(%.17g, %.17g)", p[0], p[1]); }

std::array<Point<2>, 3> CornersOfTriangle(const MeshView& mesh, size_t t) {
  return {PointAt<2>(mesh.points, mesh.simplices[3 * t]), PointAt<2>(mesh.points, mesh.simplices[3 * t + 1]),
          PointAt<2>(mesh.points, mesh.simplices[3 * t + 2])};
}

double AreaOf(const std::array<Point<2>, 3>& corners) {
  return 0.5 * Cross(Difference<2>(corners[1], corners[0]), Difference<2>(corners[2], corners[0]));
}

// Triangles that hang together by edges that are no facets.
struct Patches {
  std::vector<uint32_t> of_triangle;
  std::vector<uint32_t> largest;  // of each patch the largest triangle
  std::vector<double> areas;
};

// An edge of a triangle, or a facet.
struct PatchSide {
  static constexpr uint32_t kFacet = kNone;

  uint32_t low;
  uint32_t high;
  uint32_t triangle;  // or kFacet
};

// All of them, those of one edge together, its facet last.
absl::StatusOr<std::vector<PatchSide>> SidesOf(const MeshView& mesh, std::span<const uint32_t> facets,
                                               const RunContext& context) {
  std::vector<PatchSide> sides;
  sides.reserve(mesh.simplices.size() + facets.size() / 2);
  const auto add = [&](uint32_t u, uint32_t v, uint32_t triangle) {
    sides.push_back({std::min(u, v), std::max(u, v), triangle});
  };
  for (uint32_t t = 0; t < mesh.simplices.size() / 3; ++t) {
    for (int k = 0; k < 3; ++k) {
      add(mesh.simplices[3 * size_t{t} + k], mesh.simplices[3 * size_t{t} + (k + 1) % 3], t);
    }
  }
  for (size_t f = 0; f < facets.size(); f += 2) {
    add(facets[f], facets[f + 1], PatchSide::kFacet);
  }
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(
      sides,
      [](const PatchSide& a, const PatchSide& b) {
        return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
      },
      context));
  return sides;
}

absl::StatusOr<Patches> FindPatches(const MeshView& mesh, std::span<const uint32_t> facets, const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<PatchSide> sides, SidesOf(mesh, facets, context));
  const size_t triangles = mesh.simplices.size() / 3;
  std::vector<uint32_t> joined(triangles);
  std::iota(joined.begin(), joined.end(), 0);
  const auto root_of = [&](uint32_t t) {
    while (joined[t] != t) {
      t = joined[t] = joined[joined[t]];
    }
    return t;
  };
  for (size_t i = 0; i + 1 < sides.size(); ++i) {
    const auto is_same = [&](size_t j) {
      return j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high;
    };
    const auto is_facet = [&](size_t j) { return sides[j].triangle == PatchSide::kFacet; };
    if (is_same(i + 1) && !is_facet(i + 1) && !(is_same(i + 2) && is_facet(i + 2))) {
      const uint32_t one = root_of(sides[i].triangle);
      const uint32_t other = root_of(sides[i + 1].triangle);
      joined[std::max(one, other)] = std::min(one, other);
    }
  }
  Patches patches;
  patches.of_triangle.resize(triangles, kNone);
  for (uint32_t t = 0; t < triangles; ++t) {
    const uint32_t root = root_of(t);  // not above t
    if (root == t) {
      patches.of_triangle[t] = static_cast<uint32_t>(patches.largest.size());
      patches.largest.push_back(t);
      patches.areas.push_back(0);
    }
    const uint32_t patch = patches.of_triangle[t] = patches.of_triangle[root];
    const double area = AreaOf(CornersOfTriangle(mesh, t));
    patches.areas[patch] += area;
    if (area > AreaOf(CornersOfTriangle(mesh, patches.largest[patch]))) {
      patches.largest[patch] = t;
    }
  }
  return patches;
}

// The number in a mesh of each marker, or region.
class Numbers {
 public:
  // `names`: of numbers of the mesh; `prefix`: of the name of a value other than 0, whose name is `of_zero`.
  Numbers(const std::map<int32_t, std::string>& names, std::string prefix, std::string of_zero)
      : names_(names), prefix_(std::move(prefix)), of_zero_(std::move(of_zero)) {}

  // A side of the box without a marker, by FaceIndex.
  static constexpr int64_t ValueOfSide(int face) { return std::numeric_limits<int64_t>::min() + face; }

  std::string NameOf(int64_t value) const {
    return value < std::numeric_limits<int32_t>::min() ? FaceName(static_cast<int>(value - ValueOfSide(0)))
           : value == 0                                ? of_zero_
                                                       : absl::StrCat(prefix_, value);
  }

  // Whether `number` may stand for `value`, beside the pairs taken before. A value above 0 keeps its number; where
  // the mesh has a name of the service, it tells.
  bool Take(int64_t value, int32_t number) {
    if (last_ == std::pair(value, number)) {
      return true;
    }
    last_ = {value, number};
    const auto name = names_.find(number);
    if (name != names_.end() && IsOfService(name->second)) {
      if (name->second != NameOf(value)) {
        return false;
      }
    } else if (value > 0 && number != value) {
      return false;
    }
    return number_of_.emplace(value, number).first->second == number &&
           value_of_.emplace(number, value).first->second == value;
  }

 private:
  bool IsOfService(const std::string& name) const {
    if (name == of_zero_) {
      return true;
    }
    for (int face = 0; face < 4; ++face) {
      if (prefix_ == "marker_" && name == FaceName(face)) {
        return true;
      }
    }
    return IsNumberedName(prefix_, name);
  }

  const std::map<int32_t, std::string>& names_;
  const std::string prefix_;
  const std::string of_zero_;
  std::map<int64_t, int32_t> number_of_;
  std::map<int32_t, int64_t> value_of_;
  std::optional<std::pair<int64_t, int32_t>> last_;
};

class ConformityCheck {
 public:
  ConformityCheck(const MeshView& mesh, const DomainParts& parts, const DomainView& domain, double tolerance,
                  const RunContext& context)
      : mesh_(mesh),
        parts_(parts),
        domain_(domain),
        features_(domain.features),
        tolerance_(tolerance),
        context_(context) {}

  absl::Status Run() {
    WELLSPACE_RETURN_IF_ERROR(CheckShapes());
    WELLSPACE_ASSIGN_OR_RETURN(
        points_, PlacesInMesh(domain_.points, features_, mesh_.points, domain_.merge_distance, tolerance_, context_));
    WELLSPACE_RETURN_IF_ERROR(Cut());
    WELLSPACE_ASSIGN_OR_RETURN(patches_, FindPatches(mesh_, parts_.boundary.facets, context_));
    WELLSPACE_RETURN_IF_ERROR(Sweep());
    WELLSPACE_RETURN_IF_ERROR(CheckStretches());
    WELLSPACE_RETURN_IF_ERROR(ApplyRule());
    WELLSPACE_RETURN_IF_ERROR(ApplySeeds());
    WELLSPACE_RETURN_IF_ERROR(CheckFaces());
    WELLSPACE_RETURN_IF_ERROR(CheckPoints());
    WELLSPACE_RETURN_IF_ERROR(CheckTriangles());
    return CheckTags();
  }

 private:
  struct DomainFace {
    uint32_t patch = kNone;
    uint32_t piece = kNone;  // beside it
    bool is_meshed = false;
    uint32_t seed = kNone;  // that says something of it
    double area = 0;
    double perimeter = 0;
  };

  absl::Status CheckShapes() const {
    const size_t facets = parts_.boundary.facets.size() / 2;
    const size_t triangles = mesh_.simplices.size() / 3;
    const bool has_tags = parts_.boundary.tags.empty() || parts_.boundary.tags.size() == facets;
    if (!has_tags || (!parts_.regions.empty() && parts_.regions.size() != triangles)) {
      return absl::InvalidArgumentError(
          absl::StrCat("expected a tag for each of ", facets, " facets and a region for each of ", triangles,
                       " triangles, or none; got ", parts_.boundary.tags.size(), " and ", parts_.regions.size()));
    }
    for (const uint32_t end : features_.ends) {
      if (end >= domain_.points.size() / 2) {
        return absl::InvalidArgumentError("segments: an end is no point");
      }
    }
    if (!features_.groups.empty() && features_.groups.size() != features_.segment_count()) {
      return absl::InvalidArgumentError("segments: there is not one group for each, nor none");
    }
    for (const FaceSeed& seed : features_.seeds) {
      if (uint64_t{seed.first_segment} + seed.segment_count > features_.segment_count()) {
        return absl::InvalidArgumentError("seeds: a polygon has segments that are not there");
      }
    }
    return absl::OkStatus();
  }

  absl::Status Cut() {
    if (mesh_.simplices.empty()) {
      return Broken("the mesh has no triangles, and no domain is without them");
    }
    Box<2> box{PointAt<2>(mesh_.points, 0), PointAt<2>(mesh_.points, 0)};
    const auto include = [&](std::span<const double> points) {
      for (size_t i = 0; i < points.size() / 2; ++i) {
        box.Include({PointAt<2>(points, i), PointAt<2>(points, i)});
      }
    };
    include(mesh_.points);
    include(points_);
    centre_ = {0.5 * box.low[0] + 0.5 * box.high[0], 0.5 * box.low[1] + 0.5 * box.high[1]};
    const double room = box.LongestSide();
    for (const FaceSeed& seed : features_.seeds) {
      for (int axis = 0; axis < 2 && !seed.IsPolygon(); ++axis) {
        box.low[axis] = seed.at[axis] < box.low[axis] ? seed.at[axis] - room : box.low[axis];
        box.high[axis] = seed.at[axis] > box.high[axis] ? seed.at[axis] + room : box.high[axis];
      }
    }
    box = domain_.box.value_or(box);
    segments_ = SegmentsOf(points_, features_, features_.faces == FaceRule::kBox ? &box : nullptr);
    WELLSPACE_ASSIGN_OR_RETURN(made_,
                               CutSegments(mesh_.points, parts_.boundary.facets, segments_, tolerance_, context_));
    return absl::OkStatus();
  }

  // Finds faces, and which of them hold patches, then seeds, then points that are no vertices.
  absl::Status Sweep() {
    for (const uint32_t t : patches_.largest) {
      const auto corners = CornersOfTriangle(mesh_, t);
      places_.push_back(
          {(corners[0][0] + corners[1][0] + corners[2][0]) / 3, (corners[0][1] + corners[1][1] + corners[2][1]) / 3});
    }
    for (const FaceSeed& seed : features_.seeds) {
      places_.push_back(seed.at);
    }
    std::vector<Point<2>> vertices(made_.vertices.begin(),
                                   made_.vertices.begin() + static_cast<std::ptrdiff_t>(mesh_.points.size() / 2));
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(vertices, std::less<>(), context_));
    for (uint32_t i = 0; i < points_.size() / 2; ++i) {
      if (const Point<2> p = PointAt<2>(points_, i); !std::binary_search(vertices.begin(), vertices.end(), p)) {
        places_.push_back(p);
        no_vertices_.push_back(i);
      }
    }
    WELLSPACE_ASSIGN_OR_RETURN(swept_, SweepFaces(made_.vertices, made_.pieces, places_, context_));
    if (!swept_.crossings.empty()) {
      const auto [one, other] = swept_.crossings[0];
      return Broken(absl::StrCat("facets ", one, " and ", other, " cross"));
    }
    faces_.resize(swept_.face_count);
    for (uint32_t p = 0; p < made_.pieces.size(); ++p) {
      const Point<2>& low = made_.vertices[made_.pieces[p].ends[0]];
      const Point<2>& high = made_.vertices[made_.pieces[p].ends[1]];
      const double below = 0.5 * (high[0] - low[0]) * ((low[1] - centre_[1]) + (high[1] - centre_[1]));
      for (const int side : {0, 1}) {
        DomainFace& face = faces_[swept_.beside[p][side]];
        face.piece = std::min(face.piece, p);
        face.area += side == 0 ? below : -below;
        face.perimeter += Distance<2>(low, high);
      }
    }
    return absl::OkStatus();
  }

  // Patches fill faces, one each, and no stretch without facets runs beside one.
  absl::Status CheckStretches() {
    for (uint32_t i = 0; i < patches_.largest.size(); ++i) {
      const uint32_t number = swept_.face_of[i];
      if (number == SweptFaces::kOnPiece) {
        return Broken(absl::StrCat("triangle ", patches_.largest[i], ": a segment runs through it"));
      }
      if (faces_[number].patch != kNone) {
        return Broken(
            absl::StrCat("triangles ", patches_.largest[faces_[number].patch], " and ", patches_.largest[i],
                         ": they are in one face of the domain, and no triangles lead from one to the other"));
      }
      faces_[number].patch = i;
    }
    // Of all wrong pieces, the one of the first segment is named.
    const Piece* wrong = nullptr;
    for (size_t p = parts_.boundary.facets.size() / 2; p < made_.pieces.size(); ++p) {
      const Piece& piece = made_.pieces[p];
      const bool is_beside_triangles = std::any_of(swept_.beside[p].begin(), swept_.beside[p].end(),
                                                   [&](uint32_t face) { return faces_[face].patch != kNone; });
      if (is_beside_triangles && (wrong == nullptr || piece.source < wrong->source)) {
        wrong = &piece;
      }
    }
    if (wrong != nullptr) {
      return Broken(absl::StrCat(segments_.NameOf(wrong->source), ": no facets lead along it from ",
                                 PlaceName(made_.vertices[wrong->ends[0]]), " to ",
                                 PlaceName(made_.vertices[wrong->ends[1]]), ", where triangles are"));
    }
    return absl::OkStatus();
  }

  absl::Status ApplyRule() {
    if (features_.faces == FaceRule::kUnion) {
      return ApplyUnion();
    }
    for (size_t face = 1; face < faces_.size(); ++face) {
      faces_[face].is_meshed = features_.faces != FaceRule::kEvenOdd;
    }
    if (features_.faces != FaceRule::kEvenOdd) {
      return absl::OkStatus();
    }
    // From the unbounded face on, across pieces.
    const std::vector<std::vector<uint32_t>> sides = SidesOfFaces();
    std::vector<bool> is_known(faces_.size());
    std::vector<uint32_t> pending = {0};
    is_known[0] = true;
    while (!pending.empty()) {
      const uint32_t face = pending.back();
      pending.pop_back();
      for (const uint32_t p : sides[face]) {
        const uint32_t beyond = swept_.beside[p][0] == face ? swept_.beside[p][1] : swept_.beside[p][0];
        const bool is_odd = faces_[face].is_meshed != (made_.pieces[p].rings % 2 == 1);
        if (!is_known[beyond]) {
          is_known[beyond] = true;
          faces_[beyond].is_meshed = is_odd;
          pending.push_back(beyond);
        } else if (faces_[beyond].is_meshed != is_odd) {
          return Broken(absl::StrCat("rings are not closed along ", segments_.NameOf(made_.pieces[p].source), " from ",
                                     PlaceName(made_.vertices[made_.pieces[p].ends[0]]), " to ",
                                     PlaceName(made_.vertices[made_.pieces[p].ends[1]])));
        }
      }
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
    }
    return absl::OkStatus();
  }

  // The pieces beside each face.
  std::vector<std::vector<uint32_t>> SidesOfFaces() const {
    std::vector<std::vector<uint32_t>> sides(faces_.size());
    for (uint32_t p = 0; p < made_.pieces.size(); ++p) {
      for (const uint32_t face : swept_.beside[p]) {
        sides[face].push_back(p);
      }
    }
    return sides;
  }

  // Goes over pieces from face to face and back, with the groups that surround the face an odd number of times.
  absl::Status ApplyUnion() {
    struct Stop {
      uint32_t face;
      uint32_t entered_over;  // a piece
      size_t next = 0;        // of its pieces
    };
    const std::vector<std::vector<uint32_t>> sides = SidesOfFaces();
    std::set<uint32_t> around;
    const auto cross = [&](uint32_t piece) {
      for (const uint32_t group : made_.pieces[piece].groups) {
        if (around.erase(group) == 0) {
          around.insert(group);
        }
      }
    };
    std::vector<bool> is_known(faces_.size());
    std::vector<Stop> way = {{0, kNone}};
    is_known[0] = true;
    for (size_t steps = 0; !way.empty(); ++steps) {
      if (steps % kStepsBetweenLooks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
      }
      Stop& here = way.back();
      if (here.next == sides[here.face].size()) {
        if (here.entered_over != kNone) {
          cross(here.entered_over);
        }
        way.pop_back();
        continue;
      }
      const uint32_t piece = sides[here.face][here.next++];
      const uint32_t beyond = swept_.beside[piece][0] == here.face ? swept_.beside[piece][1] : swept_.beside[piece][0];
      if (!is_known[beyond]) {
        is_known[beyond] = true;
        cross(piece);
        faces_[beyond].is_meshed = !around.empty();
        way.push_back({beyond, piece});
      }
    }
    return absl::OkStatus();
  }

  absl::Status ApplySeeds() {
    const size_t patches = patches_.largest.size();
    WELLSPACE_ASSIGN_OR_RETURN(
        const std::vector<uint32_t> polygons,
        FindPolygonsAround(std::span<const Point<2>>(places_).first(patches), points_, features_, context_));
    for (uint32_t i = 0; i < patches; ++i) {
      faces_[swept_.face_of[i]].seed = polygons[i] == kInNoPolygon ? kNone : polygons[i];
    }
    bool has_holes = false;
    for (uint32_t i = 0; i < features_.seeds.size(); ++i) {
      const uint32_t face = swept_.face_of[patches + i];
      if (features_.seeds[i].IsPolygon()) {
        has_holes = has_holes || features_.seeds[i].is_hole;
      } else if (face != SweptFaces::kOnPiece) {
        faces_[face].seed = i;
      }
    }
    for (DomainFace& face : faces_) {
      if (face.seed != kNone && features_.seeds[face.seed].is_hole) {
        face.is_meshed = false;
      } else if (face.patch == kNone && face.seed == kNone && has_holes) {
        face.is_meshed = false;  // it may be in a polygon that is a hole
      }
    }
    return absl::OkStatus();
  }

  std::string WhyNotMeshed(uint32_t number) const {
    const uint32_t seed = faces_[number].seed;
    return seed != kNone && features_.seeds[seed].is_hole
               ? absl::StrCat("it is in the face of seeds[", seed, "], a hole")
           : number == 0                         ? "it is in the unbounded face, which segments do not enclose"
           : features_.faces == FaceRule::kUnion ? "no group has an odd number of rings around it"
                                                 : "an even number of rings surrounds it";
  }

  // Faces that are to be meshed have triangles, and others have none.
  absl::Status CheckFaces() const {
    for (uint32_t number = 0; number < faces_.size(); ++number) {
      const DomainFace& face = faces_[number];
      if (face.patch != kNone && !face.is_meshed) {
        return Broken(absl::StrCat("triangle ", patches_.largest[face.patch], ": ", WhyNotMeshed(number)));
      }
      if (face.patch == kNone && face.is_meshed) {
        const Piece& piece = made_.pieces[face.piece];
        return Broken(absl::StrCat(
            "the face beside ", segments_.NameOf(piece.source), ", from ", PlaceName(made_.vertices[piece.ends[0]]),
            " to ", PlaceName(made_.vertices[piece.ends[1]]), ", is to be meshed, and has no triangles"));
      }
      if (face.patch != kNone) {
        const double area = patches_.areas[face.patch];
        if (std::abs(area - face.area) > kAreaTolerance * std::abs(face.area) + 4 * tolerance_ * face.perimeter) {
          return Broken(absl::StrCat("the face of triangle ", patches_.largest[face.patch], " has an area of ",
                                     face.area, ", and its triangles together ", area));
        }
      }
    }
    return absl::OkStatus();
  }

  absl::Status CheckPoints() const {
    const size_t first = patches_.largest.size() + features_.seeds.size();
    for (size_t i = 0; i < no_vertices_.size(); ++i) {
      const uint32_t face = swept_.face_of[first + i];
      if (face != SweptFaces::kOnPiece && faces_[face].patch != kNone) {
        return Broken(absl::StrCat("points[", no_vertices_[i], "] at ", PlaceName(places_[first + i]),
                                   " lies in a face that is meshed, and is no vertex"));
      }
    }
    return absl::OkStatus();
  }

  // Regions and largest areas.
  absl::Status CheckTriangles() const {
    Numbers ids(parts_.region_names, "region_", "domain");
    std::set<int32_t> regions;
    const size_t triangles = mesh_.simplices.size() / 3;
    for (size_t t = 0; t < triangles; ++t) {
      if (t % kStepsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
      }
      const uint32_t number = faces_[swept_.face_of[patches_.of_triangle[t]]].seed;
      const FaceSeed seed = number == kNone ? FaceSeed() : features_.seeds[number];
      const auto owner = [&] {
        return number == kNone ? "a face without a seed" : absl::StrCat("the face of seeds[", number, "]");
      };
      if (const double area = AreaOf(CornersOfTriangle(mesh_, t)); area > seed.max_area * (1 + kAreaTolerance)) {
        return Broken(absl::StrCat("triangle ", t, ": its area is ", area, "; at most ", seed.max_area,
                                   " is allowed in ", owner()));
      }
      if (!domain_.has_regions) {
        continue;
      }
      if (parts_.regions.empty()) {
        if (regions.insert(seed.region).second && regions.size() > 1) {
          return Broken(absl::StrCat("triangle ", t, ": it is in ", owner(), ", of \"", ids.NameOf(seed.region),
                                     "\", and others are not; the mesh has no regions"));
        }
      } else if (!ids.Take(seed.region, parts_.regions[t])) {
        return Broken(absl::StrCat("triangle ", t, ": its region is ", parts_.regions[t], "; expected that of \"",
                                   ids.NameOf(seed.region), "\", as it is in ", owner()));
      }
    }
    return absl::OkStatus();
  }

  absl::Status CheckTags() const {
    Numbers tags(parts_.boundary.names, "marker_", "unmarked");
    for (size_t f = 0; f < parts_.boundary.tags.size() && domain_.has_markers; ++f) {
      const uint32_t source = made_.pieces[f].source;
      const bool is_side = source >= segments_.given;
      const int64_t marker = is_side ? Numbers::ValueOfSide(static_cast<int>(source - segments_.given))
                             : features_.markers.empty() ? 0
                                                         : features_.markers[source];
      if (!tags.Take(marker, parts_.boundary.tags[f])) {
        return Broken(absl::StrCat("facet ", f, " of vertices ", parts_.boundary.facets[2 * f], " and ",
                                   parts_.boundary.facets[2 * f + 1], ": its tag is ", parts_.boundary.tags[f],
                                   "; expected that of \"", tags.NameOf(marker), "\", as it is on ",
                                   segments_.NameOf(source)));
      }
    }
    return absl::OkStatus();
  }

  const MeshView& mesh_;
  const DomainParts& parts_;
  const DomainView& domain_;
  const Features& features_;
  const double tolerance_;
  const RunContext& context_;
  std::vector<double> points_;  // of the domain, as the mesh has them
  Point<2> centre_{};
  BoundingSegments segments_;
  DomainPieces made_;
  Patches patches_;
  std::vector<Point<2>> places_;       // of patches, seeds, and points that are no vertices
  std::vector<uint32_t> no_vertices_;  // points
  SweptFaces swept_;
  std::vector<DomainFace> faces_;
};

}  // namespace

absl::Status ValidateConformity(const MeshView& mesh, const DomainParts& parts, const DomainView& domain,
                                double tolerance, const RunContext& context) {
  return ConformityCheck(mesh, parts, domain, tolerance, context).Run();
}

}  // namespace wellspace::core
