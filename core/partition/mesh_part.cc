#include "core/partition/mesh_part.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/partition/facets_of.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kNoOwner = std::numeric_limits<uint32_t>::max();

// Calls visit(i) for i below `count`, with a look at the context now and then.
template <typename Visit>
absl::Status ForEach(uint64_t count, const RunContext& context, const Visit& visit) {
  for (uint64_t i = 0; i < count; ++i) {
    if (i % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    visit(i);
  }
  return absl::OkStatus();
}

// The number of each vertex in the order of owners.
absl::StatusOr<HugeVector<uint32_t>> RowsOf(const HugeVector<uint32_t>& owners, const RunContext& context) {
  const uint64_t parts = owners.empty() ? 0 : uint64_t{*std::max_element(owners.begin(), owners.end())} + 1;
  std::vector<uint32_t> next(parts + 1, 0);
  WELLSPACE_RETURN_IF_ERROR(ForEach(owners.size(), context, [&](uint64_t v) { ++next[owners[v] + 1]; }));
  for (uint64_t part = 0; part < parts; ++part) {
    next[part + 1] += next[part];
  }
  HugeVector<uint32_t> rows(owners.size());
  WELLSPACE_RETURN_IF_ERROR(ForEach(owners.size(), context, [&](uint64_t v) { rows[v] = next[owners[v]]++; }));
  return rows;
}

// The part while it is put together.
class PartTaker {
 public:
  PartTaker(const PartitionedMesh& mesh, const PartOwners& owners, uint32_t part, const RunContext& context)
      : mesh_(mesh), owners_(owners), part_(part), context_(context), corners_(mesh.dimension + 1) {}

  absl::StatusOr<MeshPart> Take(uint32_t ghost_layers) {
    WELLSPACE_RETURN_IF_ERROR(TakeSimplices(ghost_layers));
    WELLSPACE_RETURN_IF_ERROR(NumberVertices());
    WELLSPACE_RETURN_IF_ERROR(TakeFacets());
    return std::move(taken_);
  }

 private:
  uint64_t simplex_count() const { return mesh_.part_of.size(); }
  std::span<const uint32_t> CornersOf(uint64_t s) const { return mesh_.simplices.subspan(s * corners_, corners_); }

  // Marks the vertices of the simplices from `begin` on.
  absl::Status MarkVertices(size_t begin) {
    return ForEach(taken_.simplices.size() - begin, context_, [&](uint64_t i) {
      for (const uint32_t v : CornersOf(taken_.simplices[begin + i])) {
        has_vertex_[v] = 1;
      }
    });
  }

  absl::Status TakeSimplices(uint32_t ghost_layers) {
    HugeVector<uint8_t> has_simplex(simplex_count(), 0);
    has_vertex_.assign(mesh_.vertex_count, 0);
    const auto take = [&](uint64_t s) {
      has_simplex[s] = 1;
      taken_.simplices.push_back(static_cast<uint32_t>(s));
    };
    WELLSPACE_RETURN_IF_ERROR(ForEach(simplex_count(), context_, [&](uint64_t s) {
      if (mesh_.part_of[s] == part_) {
        take(s);
      }
    }));
    taken_.own_simplices = taken_.simplices.size();
    WELLSPACE_RETURN_IF_ERROR(MarkVertices(0));
    for (uint32_t layer = 0; layer < ghost_layers; ++layer) {
      const size_t begin = taken_.simplices.size();
      WELLSPACE_RETURN_IF_ERROR(ForEach(simplex_count(), context_, [&](uint64_t s) {
        const std::span<const uint32_t> row = CornersOf(s);
        if (has_simplex[s] == 0 &&
            std::any_of(row.begin(), row.end(), [&](uint32_t v) { return has_vertex_[v] != 0; })) {
          take(s);
        }
      }));
      if (taken_.simplices.size() == begin) {
        break;  // all are there
      }
      WELLSPACE_RETURN_IF_ERROR(MarkVertices(begin));
    }
    return absl::OkStatus();
  }

  absl::Status NumberVertices() {
    HugeVector<uint32_t> number_of(mesh_.vertex_count, 0);
    for (const bool own : {true, false}) {
      WELLSPACE_RETURN_IF_ERROR(ForEach(mesh_.vertex_count, context_, [&](uint64_t v) {
        const bool is_own = owners_.of_vertices[v] == part_;
        if (is_own == own && (is_own || has_vertex_[v] != 0)) {
          number_of[v] = static_cast<uint32_t>(taken_.vertices.size());
          taken_.vertices.push_back(static_cast<uint32_t>(v));
        }
      }));
      taken_.own_vertices = own ? taken_.vertices.size() : taken_.own_vertices;
    }
    taken_.simplex_corners.reserve(taken_.simplices.size() * corners_);
    WELLSPACE_RETURN_IF_ERROR(ForEach(taken_.simplices.size(), context_, [&](uint64_t i) {
      for (const uint32_t v : CornersOf(taken_.simplices[i])) {
        taken_.simplex_corners.push_back(number_of[v]);
      }
    }));
    number_of_ = std::move(number_of);
    return absl::OkStatus();
  }

  absl::Status TakeFacets() {
    const size_t corners = mesh_.dimension;
    return ForEach(mesh_.facets.size() / corners, context_, [&](uint64_t f) {
      if (owners_.of_facets[f] == part_) {
        taken_.facets.push_back(static_cast<uint32_t>(f));
        for (const uint32_t v : mesh_.facets.subspan(f * corners, corners)) {
          taken_.facet_corners.push_back(number_of_[v]);
        }
      }
    });
  }

  const PartitionedMesh& mesh_;
  const PartOwners& owners_;
  const uint32_t part_;
  const RunContext& context_;
  const size_t corners_;
  MeshPart taken_;
  HugeVector<uint8_t> has_vertex_;
  HugeVector<uint32_t> number_of_;
};

}  // namespace

absl::StatusOr<PartOwners> FindOwners(const PartitionedMesh& mesh, const RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(context.ReserveMemory(PartOwnersBytes(mesh)));
  const size_t corners = mesh.dimension + 1;
  const uint64_t simplex_count = mesh.part_of.size();
  PartOwners owners;
  owners.of_vertices.assign(mesh.vertex_count, kNoOwner);
  WELLSPACE_RETURN_IF_ERROR(ForEach(simplex_count, context, [&](uint64_t s) {
    for (const uint32_t v : mesh.simplices.subspan(s * corners, corners)) {
      owners.of_vertices[v] = std::min(owners.of_vertices[v], mesh.part_of[s]);
    }
  }));
  std::replace(owners.of_vertices.begin(), owners.of_vertices.end(), kNoOwner, 0u);
  WELLSPACE_ASSIGN_OR_RETURN(owners.rows, RowsOf(owners.of_vertices, context));
  owners.of_facets.assign(mesh.facets.size() / mesh.dimension, kNoOwner);
  if (owners.of_facets.empty()) {
    return owners;
  }
  WELLSPACE_RETURN_IF_ERROR(
      ForFacetsOfEachVertex({mesh.dimension, mesh.simplices, mesh.facets}, mesh.vertex_count, context,
                            [&](std::span<const FacetOfRow> facets) -> absl::Status {
                              uint32_t lowest = kNoOwner;  // part of the simplices of the facet at i
                              for (size_t i = 0; i < facets.size(); ++i) {
                                lowest = i > 0 && facets[i].vertices == facets[i - 1].vertices ? lowest : kNoOwner;
                                if (facets[i].row < simplex_count) {
                                  lowest = std::min(lowest, mesh.part_of[facets[i].row]);
                                  continue;
                                }
                                if (lowest == kNoOwner) {
                                  return absl::InvalidArgumentError(absl::StrCat(
                                      "facets[", facets[i].row - simplex_count, "] is no facet of a simplex"));
                                }
                                owners.of_facets[facets[i].row - simplex_count] = lowest;
                              }
                              return absl::OkStatus();
                            }));
  return owners;
}

absl::StatusOr<MeshPart> TakePart(const PartitionedMesh& mesh, const PartOwners& owners, uint32_t part,
                                  uint32_t ghost_layers, const RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(context.ReserveMemory(MeshPartBytes(mesh)));
  return PartTaker(mesh, owners, part, context).Take(ghost_layers);
}

uint64_t PartOwnersBytes(const PartitionedMesh& mesh) {
  const uint64_t facets = mesh.facets.size() / mesh.dimension;
  return 8 * mesh.vertex_count + 4 * facets +
         FacetsOfEachVertexBytes(mesh.vertex_count, mesh.simplices.size() + facets);
}

uint64_t MeshPartBytes(const PartitionedMesh& mesh) {
  // Every simplex and vertex may be in the part; lists grow by doubling.
  return 9 * mesh.vertex_count + mesh.part_of.size() +
         2 * 4 * (mesh.vertex_count + mesh.part_of.size() + mesh.simplices.size() + 2 * mesh.facets.size());
}

}  // namespace wellspace::core
