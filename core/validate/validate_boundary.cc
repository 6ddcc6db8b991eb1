#include "core/validate/validate_boundary.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/geometry/box.h"
#include "core/geometry/exact_measure.h"
#include "core/simplex/boundary.h"

namespace wellspace::core {
namespace {

template <typename... Args>
absl::Status Violation(const absl::FormatSpec<Args...>& format, const Args&... args) {
  return absl::FailedPreconditionError(absl::StrFormat(format, args...));
}

template <int D>
class BoundaryChecker {
 public:
  BoundaryChecker(const MeshView& mesh, const BoundaryView& boundary) : mesh_(mesh), boundary_(boundary) {
    box_.low = box_.high = PointAt<D>(mesh.points, 0);
    for (size_t v = 1; v < mesh.points.size() / D; ++v) {
      const Point<D> p = PointAt<D>(mesh.points, v);
      box_.Include({p, p});
    }
    for (int face = 0; face < 2 * D; ++face) {
      for (const auto& [tag, name] : boundary.names) {
        if (name == FaceName(face)) {
          tag_of_[face] = tag;
        }
      }
    }
  }

  absl::Status Check() {
    WELLSPACE_RETURN_IF_ERROR(SortGiven());
    FindExpected();
    size_t next = 0;
    for (const Given& given : given_) {
      if (next < expected_.size() && expected_[next].vertices < given.vertices) {
        return Missing(expected_[next]);
      }
      if (next > 0 && expected_[next - 1].vertices == given.vertices) {
        return Violation("boundary facet %d (%s) is there twice", given.number, TextOf(given.number));
      }
      if (next == expected_.size() || expected_[next].vertices != given.vertices) {
        return Violation("boundary facet %d (%s) is no facet of one simplex on a face of the box", given.number,
                         TextOf(given.number));
      }
      WELLSPACE_RETURN_IF_ERROR(CheckTag(given, expected_[next]));
      ++next;
    }
    return next == expected_.size() ? absl::OkStatus() : Missing(expected_[next]);
  }

 private:
  using Vertices = std::array<uint32_t, D>;  // ascending

  struct Given {
    Vertices vertices;
    size_t number;

    bool operator<(const Given& other) const {
      return vertices != other.vertices ? vertices < other.vertices : number < other.number;
    }
  };

  struct Expected {
    Vertices vertices;
    size_t simplex;
    int apex;  // the place in the simplex of the vertex opposite to the facet
    int face;

    bool operator<(const Expected& other) const { return vertices < other.vertices; }
  };

  absl::Status SortGiven() {
    const size_t vertices = mesh_.points.size() / D;
    for (size_t i = 0; i < boundary_.tags.size(); ++i) {
      Given given{.vertices = {}, .number = i};
      std::copy_n(boundary_.facets.begin() + static_cast<std::ptrdiff_t>(i * D), D, given.vertices.begin());
      std::sort(given.vertices.begin(), given.vertices.end());
      if (given.vertices.back() >= vertices) {
        return Violation("boundary facet %d (%s) has vertex %d, but there are %d vertices", i, TextOf(i),
                         given.vertices.back(), vertices);
      }
      given_.push_back(given);
    }
    std::sort(given_.begin(), given_.end());
    return absl::OkStatus();
  }

  void FindExpected() {
    std::vector<FaceMask> faces(mesh_.points.size() / D);
    for (size_t v = 0; v < faces.size(); ++v) {
      faces[v] = box_.FacesOf(PointAt<D>(mesh_.points, v));
    }
    for (size_t s = 0; s < mesh_.simplices.size() / (D + 1); ++s) {
      for (int apex = 0; apex <= D; ++apex) {
        Expected facet{.vertices = {}, .simplex = s, .apex = apex, .face = -1};
        unsigned shared = ~0u;
        for (int k = 0, at = 0; k <= D; ++k) {
          if (k != apex) {
            facet.vertices[at++] = mesh_.simplices[s * (D + 1) + k];
            shared &= faces[mesh_.simplices[s * (D + 1) + k]];
          }
        }
        for (int face = 0; face < 2 * D && shared != 0; ++face) {
          if ((shared >> face & 1) != 0) {
            facet.face = face;
          }
        }
        if (facet.face >= 0) {
          std::sort(facet.vertices.begin(), facet.vertices.end());
          expected_.push_back(facet);
        }
      }
    }
    std::sort(expected_.begin(), expected_.end());
  }

  absl::Status Missing(const Expected& facet) const {
    return Violation("facet (%s) of simplex %d lies on %s, but is no boundary facet",
                     absl::StrJoin(facet.vertices, " "), facet.simplex, FaceName(facet.face));
  }

  absl::Status CheckTag(const Given& given, const Expected& facet) const {
    const int32_t tag = boundary_.tags[given.number];
    if (tag == kNoTag) {
      return Violation("boundary facet %d (%s) has the tag 0, which stands for none", given.number,
                       TextOf(given.number));
    }
    for (int face = 0; face < 2 * D; ++face) {
      if (tag_of_[face].has_value() && (face == facet.face) != (tag == *tag_of_[face])) {
        return Violation("boundary facet %d (%s) lies on %s, but has the tag %d; that of %s is %d", given.number,
                         TextOf(given.number), FaceName(facet.face), tag, FaceName(face), *tag_of_[face]);
      }
    }
    if (!tag_of_[facet.face].has_value()) {
      return absl::OkStatus();
    }
    Simplex<D> simplex;
    simplex[0] = PointAt<D>(mesh_.points, mesh_.simplices[facet.simplex * (D + 1) + facet.apex]);
    for (int k = 0; k < D; ++k) {
      simplex[k + 1] = PointAt<D>(mesh_.points, boundary_.facets[given.number * D + k]);
    }
    return Orientation<D>(simplex).sign == Sign::kPositive
               ? absl::OkStatus()
               : Violation("boundary facet %d (%s) on %s is oriented inward; exchange two of its vertices",
                           given.number, TextOf(given.number), FaceName(facet.face));
  }

  std::string TextOf(size_t facet) const { return absl::StrJoin(boundary_.facets.subspan(facet * D, D), " "); }

  const MeshView& mesh_;
  const BoundaryView& boundary_;
  Box<D> box_;
  std::array<std::optional<int32_t>, 2 * D> tag_of_;  // by face; none: no tag has its name
  std::vector<Given> given_;                          // ascending
  std::vector<Expected> expected_;                    // ascending
};

}  // namespace

absl::Status ValidateBoundary(const MeshView& mesh, const BoundaryView& boundary) {
  const size_t d = static_cast<size_t>(mesh.dimension);
  if (mesh.dimension < kMinDimension || mesh.dimension > kMaxDimension || mesh.points.size() < d ||
      mesh.points.size() % d != 0 || mesh.simplices.size() % (d + 1) != 0) {
    return absl::InvalidArgumentError("boundary: the mesh has no whole rows of points and simplices");
  }
  if (boundary.facets.size() != boundary.tags.size() * d) {
    return absl::InvalidArgumentError(
        absl::StrFormat("boundary: %d indices of vertices and %d tags; expected %d indices for each tag",
                        boundary.facets.size(), boundary.tags.size(), d));
  }
#define WELLSPACE_CHECK(D)                             \
  if (mesh.dimension == D) {                           \
    return BoundaryChecker<D>(mesh, boundary).Check(); \
  }
  WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_CHECK)
#undef WELLSPACE_CHECK
  return absl::InternalError("a dimension without a checker");
}

}  // namespace wellspace::core
