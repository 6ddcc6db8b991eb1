#include "core/validate/validate_periodic.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/geometry/box.h"
#include "core/simplex/boundary.h"

namespace wellspace::core {
namespace {

template <typename... Args>
absl::Status Violation(const absl::FormatSpec<Args...>& format, const Args&... args) {
  return absl::FailedPreconditionError(absl::StrFormat(format, args...));
}

// Compares the two faces across one axis.
class FacePair {
 public:
  FacePair(const MeshView& mesh, int axis)
      : mesh_(mesh), d_(static_cast<size_t>(mesh.dimension)), axis_(static_cast<size_t>(axis)) {}

  absl::Status Check() {
    FindVertices();
    WELLSPACE_RETURN_IF_ERROR(CompareVertices());
    FindFacets();
    return CompareFacets();
  }

 private:
  // The vertices of a facet by their ranks among those of its face, ascending; kOnNone after them.
  using Ranks = std::array<uint32_t, kMaxDimension>;

  struct Face {
    std::vector<uint32_t> vertices;  // by rank
    std::vector<Ranks> facets;       // ascending
  };

  double At(uint32_t v, size_t axis) const { return mesh_.points[v * d_ + axis]; }

  // Whether u comes before v by the other coordinates, the first of these first.
  bool IsBefore(uint32_t u, uint32_t v) const {
    for (size_t k = 0; k < d_; ++k) {
      if (k != axis_ && At(u, k) != At(v, k)) {
        return At(u, k) < At(v, k);
      }
    }
    return false;
  }

  void FindVertices() {
    const size_t count = mesh_.points.size() / d_;
    std::array<double, 2> at = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    for (uint32_t v = 0; v < count; ++v) {
      at[0] = std::min(at[0], At(v, axis_));
      at[1] = std::max(at[1], At(v, axis_));
    }
    rank_.assign(count, kOnNone);
    side_.assign(count, 0);
    for (const int side : {0, 1}) {
      std::vector<uint32_t>& vertices = faces_[side].vertices;
      for (uint32_t v = 0; v < count; ++v) {
        if (At(v, axis_) == at[side]) {
          vertices.push_back(v);
        }
      }
      std::sort(vertices.begin(), vertices.end(), [this](uint32_t u, uint32_t v) { return IsBefore(u, v); });
      for (uint32_t rank = 0; rank < vertices.size(); ++rank) {
        rank_[vertices[rank]] = rank;
        side_[vertices[rank]] = static_cast<uint8_t>(side);
      }
    }
  }

  absl::Status CompareVertices() const {
    const std::vector<uint32_t>& low = faces_[0].vertices;
    const std::vector<uint32_t>& high = faces_[1].vertices;
    for (size_t i = 0; i < std::max(low.size(), high.size()); ++i) {
      if (i == high.size() || (i < low.size() && IsBefore(low[i], high[i]))) {
        return Alone(low[i], 0);
      }
      if (i == low.size() || IsBefore(high[i], low[i])) {
        return Alone(high[i], 1);
      }
    }
    return absl::OkStatus();
  }

  absl::Status Alone(uint32_t v, int side) const {
    return Violation("vertex %d at (%s) on %s has no image on %s", v,
                     absl::StrJoin(mesh_.points.subspan(v * d_, d_), ", ",
                                   [](std::string* out, double x) { absl::StrAppendFormat(out, "%.17g", x); }),
                     NameOf(side), NameOf(1 - side));
  }

  std::string NameOf(int side) const { return FaceName(FaceIndex(static_cast<int>(axis_), side == 1)); }

  void FindFacets() {
    for (size_t s = 0; s < mesh_.simplices.size() / (d_ + 1); ++s) {
      const std::span<const uint32_t> simplex = mesh_.simplices.subspan(s * (d_ + 1), d_ + 1);
      for (const int side : {0, 1}) {
        Ranks ranks;
        ranks.fill(kOnNone);
        size_t on = 0;
        for (const uint32_t v : simplex) {
          if (rank_[v] != kOnNone && side_[v] == side && on < d_) {
            ranks[on++] = rank_[v];
          }
        }
        if (on == d_) {
          std::sort(ranks.begin(), ranks.end());
          faces_[side].facets.push_back(ranks);
        }
      }
    }
    for (Face& face : faces_) {
      std::sort(face.facets.begin(), face.facets.end());
    }
  }

  absl::Status CompareFacets() const {
    const std::vector<Ranks>& low = faces_[0].facets;
    const std::vector<Ranks>& high = faces_[1].facets;
    const auto [in_low, in_high] = std::mismatch(low.begin(), low.end(), high.begin(), high.end());
    if (in_low == low.end() && in_high == high.end()) {
      return absl::OkStatus();
    }
    const int side = in_high == high.end() || (in_low != low.end() && *in_low < *in_high) ? 0 : 1;
    const Ranks& ranks = side == 0 ? *in_low : *in_high;
    std::vector<uint32_t> facet;
    for (size_t k = 0; k < d_; ++k) {
      facet.push_back(faces_[side].vertices[ranks[k]]);
    }
    return Violation("facet (%s) on %s has no image on %s", absl::StrJoin(facet, " "), NameOf(side), NameOf(1 - side));
  }

  static constexpr uint32_t kOnNone = 0xffff'ffff;

  const MeshView& mesh_;
  const size_t d_;
  const size_t axis_;
  std::vector<uint32_t> rank_;  // by vertex: among those of its face; kOnNone: it is on neither
  std::vector<uint8_t> side_;   // by vertex: of which face
  std::array<Face, 2> faces_;   // low, high
};

}  // namespace

absl::Status ValidatePeriodic(const MeshView& mesh, std::span<const int> axes) {
  const auto d = static_cast<size_t>(mesh.dimension);
  if (mesh.dimension < kMinDimension || mesh.dimension > kMaxDimension || mesh.points.size() % d != 0 ||
      mesh.simplices.size() % (d + 1) != 0) {
    return absl::InvalidArgumentError("periodic: the mesh has no whole rows of points and simplices");
  }
  for (size_t i = 0; i < axes.size(); ++i) {
    if (axes[i] < 0 || axes[i] >= mesh.dimension) {
      return absl::InvalidArgumentError(
          absl::StrCat("periodic: ", axes[i], " is no axis of a mesh in ", mesh.dimension, "-D"));
    }
    if (std::find(axes.begin(), axes.begin() + static_cast<std::ptrdiff_t>(i), axes[i]) !=
        axes.begin() + static_cast<std::ptrdiff_t>(i)) {
      return absl::InvalidArgumentError(absl::StrCat("periodic: axis ", axes[i], " is there twice"));
    }
  }
  for (const int axis : axes) {
    WELLSPACE_RETURN_IF_ERROR(FacePair(mesh, axis).Check());
  }
  return absl::OkStatus();
}

}  // namespace wellspace::core
