#include "core/simplex/boundary.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/simplex/boundary_facets.h"

namespace wellspace::core {
namespace {

// Rows that one thread looks at before the next look at the context.
constexpr size_t kRowsTogether = 1 << 16;

size_t BlocksOf(size_t rows) { return (rows + kRowsTogether - 1) / kRowsTogether; }

template <int D>
class BoundaryFinder {
 public:
  explicit BoundaryFinder(const BoxMesh& mesh)
      : points_(mesh.points), simplices_(mesh.simplices), box_{PointAt<D>(mesh.low, 0), PointAt<D>(mesh.high, 0)} {}

  absl::StatusOr<BoxBoundary> Find(int threads, const RunContext& context) {
    ThreadTeam team(threads);
    BoxBoundary boundary;
    WELLSPACE_RETURN_IF_ERROR(MarkVertices(boundary.vertex_tags, team, context));
    WELLSPACE_RETURN_IF_ERROR(FindFacets(team, context));
    Sort(boundary);
    return boundary;
  }

 private:
  absl::Status MarkVertices(HugeVector<int32_t>& tags, ThreadTeam& team, const RunContext& context) {
    const size_t vertices = points_.size() / D;
    faces_.resize(vertices);
    tags.resize(vertices);
    return team.TryForEach(BlocksOf(vertices), [&](size_t block) {
      const size_t end = std::min(vertices, (block + 1) * kRowsTogether);
      for (size_t v = block * kRowsTogether; v < end; ++v) {
        const FaceMask faces = box_.FacesOf(PointAt<D>(points_, v));
        faces_[v] = faces;
        tags[v] = TagOf(faces);
      }
      return context.Check();
    });
  }

  absl::Status FindFacets(ThreadTeam& team, const RunContext& context) {
    const size_t count = simplices_.size() / (D + 1);
    found_.resize(BlocksOf(count));
    return team.TryForEach(found_.size(), [&](size_t block) {
      const size_t end = std::min(count, (block + 1) * kRowsTogether);
      for (size_t s = block * kRowsTogether; s < end; ++s) {
        std::array<FaceMask, D + 1> faces;
        int inner = 0;
        for (int k = 0; k <= D; ++k) {
          faces[k] = faces_[simplices_[s * (D + 1) + k]];
          inner += faces[k] == 0 ? 1 : 0;
        }
        if (inner <= 1) {
          AddFacets<D>(s, faces, found_[block]);
        }
      }
      return context.Check();
    });
  }

  // Puts the facets in the order of their parts.
  void Sort(BoxBoundary& boundary) const {
    std::array<uint64_t, 2 * D> counts{};
    for (const std::vector<FoundFacet>& block : found_) {
      for (const FoundFacet& facet : block) {
        ++counts[facet.face];
      }
    }
    std::array<size_t, 2 * D> next{};  // of each face, in numbers of facets
    size_t count = 0;
    for (int face = 0; face < 2 * D; ++face) {
      next[face] = count;
      count += counts[face];
      boundary.parts.push_back({FaceTag(face), FaceName(face), counts[face]});
    }
    boundary.facets.resize(count * D);
    boundary.simplices.resize(count);
    for (const std::vector<FoundFacet>& block : found_) {
      for (const FoundFacet& facet : block) {
        const size_t at = next[facet.face]++;
        boundary.simplices[at] = static_cast<uint32_t>(facet.simplex);
        PutFacet<D>(simplices_, facet, &boundary.facets[at * D]);
      }
    }
  }

  std::span<const double> points_;
  std::span<const uint32_t> simplices_;
  Box<D> box_;
  HugeVector<FaceMask> faces_;                  // by vertex
  std::vector<std::vector<FoundFacet>> found_;  // by block of simplices
};

}  // namespace

std::string FaceName(int face) {
  constexpr char kAxes[] = "xyzwvu";
  return std::string(1, kAxes[face / 2]) + (face % 2 == 0 ? "min" : "max");
}

Region WholeBox() { return {.id = 1, .name = "domain"}; }

absl::StatusOr<BoxBoundary> FindBoxBoundary(const BoxMesh& mesh, int threads, const RunContext& context) {
#define WELLSPACE_FIND(D)                                  \
  if (mesh.low.size() == D) {                              \
    return BoundaryFinder<D>(mesh).Find(threads, context); \
  }
  WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_FIND)
#undef WELLSPACE_FIND
  return absl::InternalError("a mesh of a dimension that is not supported");
}

}  // namespace wellspace::core
