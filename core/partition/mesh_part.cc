#include "core/partition/mesh_part.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/partition/facets_of.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kNoOwner = std::numeric_limits<uint32_t>::max();

// Calls visit(i) for i below `count`, with a look at the context now and then.
template <typename Visit>
absl::Status ForEach(uint64_t count, const RunContext& context, const Visit& visit) {
  for (uint64_t i = 0; i < count; ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
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

// Simplices by their numbers.
struct Corners {
  explicit Corners(const PartitionedMesh& mesh) : simplices(mesh.simplices), size(mesh.dimension + 1) {}
  std::span<const uint32_t> of(uint64_t simplex) const { return simplices.subspan(simplex * size, size); }

  const std::span<const uint32_t> simplices;
  const size_t size;
};

// Marks the vertices of the simplices of a layer.
absl::Status MarkVertices(const Corners& corners, uint16_t layer, const RunContext& context, PartSelection& selection) {
  return ForEach(selection.layer_of.size(), context, [&](uint64_t s) {
    if (selection.layer_of[s] == layer) {
      for (const uint32_t v : corners.of(s)) {
        selection.has_vertex[v] = 1;
      }
    }
  });
}

// Marks the simplices that have a marked vertex, as `layer`, and says how many there are.
absl::StatusOr<uint64_t> MarkLayer(const Corners& corners, uint16_t layer, const RunContext& context,
                                   PartSelection& selection) {
  uint64_t count = 0;
  WELLSPACE_RETURN_IF_ERROR(ForEach(selection.layer_of.size(), context, [&](uint64_t s) {
    const std::span<const uint32_t> row = corners.of(s);
    if (selection.layer_of[s] == kNoLayer &&
        std::any_of(row.begin(), row.end(), [&](uint32_t v) { return selection.has_vertex[v] != 0; })) {
      selection.layer_of[s] = layer;
      ++count;
    }
  }));
  return count;
}

// The part while it is put together.
class PartTaker {
 public:
  PartTaker(const PartitionedMesh& mesh, const PartOwners& owners, const PartSelection& selection,
            const RunContext& context)
      : mesh_(mesh), owners_(owners), selection_(selection), context_(context), corners_(mesh) {}

  absl::StatusOr<MeshPart> Take() {
    WELLSPACE_RETURN_IF_ERROR(TakeSimplices());
    WELLSPACE_RETURN_IF_ERROR(NumberVertices());
    WELLSPACE_RETURN_IF_ERROR(TakeFacets());
    return std::move(taken_);
  }

 private:
  absl::Status TakeSimplices() {
    taken_.simplices.reserve(selection_.simplices);
    for (uint32_t layer = 0; layer <= selection_.layers; ++layer) {
      WELLSPACE_RETURN_IF_ERROR(ForEach(selection_.layer_of.size(), context_, [&](uint64_t s) {
        if (selection_.layer_of[s] == layer) {
          taken_.simplices.push_back(static_cast<uint32_t>(s));
        }
      }));
    }
    taken_.own_simplices = selection_.own_simplices;
    return absl::OkStatus();
  }

  absl::Status NumberVertices() {
    number_of_.assign(mesh_.vertex_count, 0);
    taken_.vertices.reserve(selection_.vertices);
    taken_.own_vertices = selection_.own_vertices;
    for (const bool own : {true, false}) {
      WELLSPACE_RETURN_IF_ERROR(ForEach(mesh_.vertex_count, context_, [&](uint64_t v) {
        const bool is_own = owners_.of_vertices[v] == selection_.part;
        if (is_own == own && (is_own || selection_.has_vertex[v] != 0)) {
          number_of_[v] = static_cast<uint32_t>(taken_.vertices.size());
          taken_.vertices.push_back(static_cast<uint32_t>(v));
        }
      }));
    }
    taken_.simplex_corners.reserve(taken_.simplices.size() * corners_.size);
    return ForEach(taken_.simplices.size(), context_, [&](uint64_t i) {
      for (const uint32_t v : corners_.of(taken_.simplices[i])) {
        taken_.simplex_corners.push_back(number_of_[v]);
      }
    });
  }

  absl::Status TakeFacets() {
    const size_t corners = mesh_.dimension;
    taken_.facets.reserve(selection_.facets);
    taken_.facet_corners.reserve(selection_.facets * corners);
    return ForEach(mesh_.facets.size() / corners, context_, [&](uint64_t f) {
      if (owners_.of_facets[f] == selection_.part) {
        taken_.facets.push_back(static_cast<uint32_t>(f));
        for (const uint32_t v : mesh_.facets.subspan(f * corners, corners)) {
          taken_.facet_corners.push_back(number_of_[v]);
        }
      }
    });
  }

  const PartitionedMesh& mesh_;
  const PartOwners& owners_;
  const PartSelection& selection_;
  const RunContext& context_;
  const Corners corners_;
  MeshPart taken_;
  HugeVector<uint32_t> number_of_;
};

}  // namespace

absl::StatusOr<PartOwners> FindOwners(const PartitionedMesh& mesh, const RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(context.ReserveMemory(
      PartOwnersBytes(mesh.vertex_count, mesh.simplices.size(), mesh.facets.size() / mesh.dimension)));
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

absl::StatusOr<PartSelection> SelectPart(const PartitionedMesh& mesh, const PartOwners& owners, uint32_t part,
                                         uint32_t ghost_layers, const RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(context.ReserveMemory(PartSelectionBytes(mesh)));
  const Corners corners(mesh);
  PartSelection selection;
  selection.part = part;
  selection.layer_of.assign(mesh.part_of.size(), kNoLayer);
  selection.has_vertex.assign(mesh.vertex_count, 0);
  WELLSPACE_RETURN_IF_ERROR(ForEach(mesh.part_of.size(), context, [&](uint64_t s) {
    if (mesh.part_of[s] == part) {
      selection.layer_of[s] = 0;
      ++selection.own_simplices;
    }
  }));
  selection.simplices = selection.own_simplices;
  WELLSPACE_RETURN_IF_ERROR(MarkVertices(corners, 0, context, selection));
  for (uint32_t layer = 1; layer <= ghost_layers; ++layer) {
    WELLSPACE_ASSIGN_OR_RETURN(const uint64_t added, MarkLayer(corners, layer, context, selection));
    if (added == 0) {
      break;  // all are there
    }
    selection.layers = layer;
    selection.simplices += added;
    WELLSPACE_RETURN_IF_ERROR(MarkVertices(corners, layer, context, selection));
  }
  WELLSPACE_RETURN_IF_ERROR(ForEach(mesh.vertex_count, context, [&](uint64_t v) {
    const bool is_own = owners.of_vertices[v] == part;
    selection.own_vertices += is_own ? 1 : 0;
    selection.vertices += is_own || selection.has_vertex[v] != 0 ? 1 : 0;
  }));
  WELLSPACE_RETURN_IF_ERROR(ForEach(owners.of_facets.size(), context,
                                    [&](uint64_t f) { selection.facets += owners.of_facets[f] == part ? 1 : 0; }));
  return selection;
}

absl::StatusOr<MeshPart> TakePart(const PartitionedMesh& mesh, const PartOwners& owners, const PartSelection& selection,
                                  const RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(context.ReserveMemory(MeshPartBytes(mesh, selection)));
  return PartTaker(mesh, owners, selection, context).Take();
}

absl::StatusOr<MeshPart> TakePart(const PartitionedMesh& mesh, const PartOwners& owners, uint32_t part,
                                  uint32_t ghost_layers, const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(const PartSelection selection, SelectPart(mesh, owners, part, ghost_layers, context));
  return TakePart(mesh, owners, selection, context);
}

std::vector<uint64_t> CountInRuns(std::span<const uint64_t> lengths, std::span<const uint32_t> numbers) {
  std::vector<uint64_t> counts;
  uint64_t end = 0;
  auto at = numbers.begin();
  for (const uint64_t length : lengths) {
    end += length;
    const auto begin = std::exchange(at, std::lower_bound(at, numbers.end(), end));
    counts.push_back(at - begin);
  }
  return counts;
}

uint64_t PartOwnersBytes(uint64_t vertices, uint64_t corners_of_simplices, uint64_t facets) {
  // The parts that vertices are counted by are fewer than simplices, and an array of them is nothing.
  return 8 * vertices + 4 * facets + FacetsOfEachVertexBytes(vertices, corners_of_simplices + facets);
}

uint64_t PartSelectionBytes(const PartitionedMesh& mesh) {
  return sizeof(uint16_t) * mesh.part_of.size() + mesh.vertex_count;
}

uint64_t MeshPartBytes(const PartitionedMesh& mesh, const PartSelection& selection) {
  const uint64_t corners = mesh.dimension + 1;
  return PartSelectionBytes(mesh) +
         sizeof(uint32_t) * (mesh.vertex_count + selection.vertices + selection.simplices * (1 + corners) +
                             selection.facets * corners);
}

}  // namespace wellspace::core
