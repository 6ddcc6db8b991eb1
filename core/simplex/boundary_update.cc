#include "core/simplex/boundary_update.h"

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "core/base/dimensions.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/simplex/boundary_facets.h"

namespace wellspace::core {
namespace {

// See UpdateBoxBoundary.
template <int D>
class BoundaryUpdate {
 public:
  BoundaryUpdate(const BoxMesh& mesh, std::span<const RowEdit> edits, BoxBoundary& boundary)
      : mesh_(mesh), edits_(edits), box_{PointAt<D>(mesh.low, 0), PointAt<D>(mesh.high, 0)}, boundary_(boundary) {}

  void MarkVertices(uint64_t old_vertices, std::span<const uint32_t> moved) {
    boundary_.vertex_tags.resize(mesh_.points.size() / D);
    for (uint64_t v = old_vertices; v < boundary_.vertex_tags.size(); ++v) {
      boundary_.vertex_tags[v] = TagOf(FacesOf(v));
    }
    for (const uint32_t v : moved) {
      boundary_.vertex_tags[v] = TagOf(FacesOf(v));
    }
  }

  void UpdateFacets() {
    FindAdded();
    HugeVector<uint32_t> facets;
    HugeVector<uint32_t> simplices;
    bool has_changed = false;
    size_t begin = 0;
    for (int face = 0; face < 2 * D; ++face) {
      const size_t end = begin + boundary_.parts[face].facets;
      has_changed = Renumber(begin, end) || has_changed || !added_[face].empty();
      begin = end;
    }
    if (!has_changed) {
      return;
    }
    begin = 0;
    for (int face = 0; face < 2 * D; ++face) {
      const size_t end = begin + boundary_.parts[face].facets;
      const size_t before = simplices.size();
      Merge(begin, end, added_[face], facets, simplices);
      boundary_.parts[face].facets = simplices.size() - before;
      begin = end;
    }
    boundary_.facets = std::move(facets);
    boundary_.simplices = std::move(simplices);
  }

 private:
  static constexpr uint32_t kDropped = 0xffff'ffff;

  FaceMask FacesOf(uint64_t v) const { return box_.FacesOf(PointAt<D>(mesh_.points, v)); }

  void FindAdded() {
    std::vector<FoundFacet> found;
    uint64_t row = 0;   // of the mesh
    uint64_t from = 0;  // of the mesh before
    for (const RowEdit& edit : edits_) {
      row += edit.at - from;
      from = edit.at + edit.dropped;
      for (const uint64_t end = row + edit.added; row < end; ++row) {
        std::array<FaceMask, D + 1> faces;
        int inner = 0;
        for (int k = 0; k <= D; ++k) {
          faces[k] = FacesOf(mesh_.simplices[row * (D + 1) + k]);
          inner += faces[k] == 0 ? 1 : 0;
        }
        if (inner <= 1) {
          AddFacets<D>(row, faces, found);
        }
      }
    }
    for (const FoundFacet& facet : found) {
      added_[facet.face].push_back(facet);
    }
  }

  // Has the facets `begin` to `end`, those of one part, name the new rows of their simplices, or kDropped. Returns
  // whether any is dropped.
  bool Renumber(size_t begin, size_t end) {
    auto edit = edits_.begin();
    uint64_t more = 0;  // modulo 2^64: by how much rows have moved before `edit`
    bool is_any_dropped = false;
    for (size_t i = begin; i < end; ++i) {
      uint32_t& row = boundary_.simplices[i];
      for (; edit != edits_.end() && edit->at + edit->dropped <= row; ++edit) {
        more += edit->added - edit->dropped;
      }
      const bool is_dropped = edit != edits_.end() && edit->at <= row;
      is_any_dropped = is_any_dropped || is_dropped;
      row = is_dropped ? kDropped : static_cast<uint32_t>(row + more);
    }
    return is_any_dropped;
  }

  // Appends the facets `begin` to `end` that are not dropped, and those that are added, in the order of simplices.
  void Merge(size_t begin, size_t end, std::span<const FoundFacet> added, HugeVector<uint32_t>& facets,
             HugeVector<uint32_t>& simplices) const {
    auto next = added.begin();
    const auto put_added_before = [&](uint64_t row) {
      for (; next != added.end() && next->simplex < row; ++next) {
        facets.resize(facets.size() + D);
        PutFacet<D>(mesh_.simplices, *next, &facets[facets.size() - D]);
        simplices.push_back(static_cast<uint32_t>(next->simplex));
      }
    };
    for (size_t i = begin; i < end; ++i) {
      if (const uint32_t row = boundary_.simplices[i]; row != kDropped) {
        put_added_before(row);
        const auto facet = boundary_.facets.begin() + static_cast<std::ptrdiff_t>(i * D);
        facets.insert(facets.end(), facet, facet + D);
        simplices.push_back(row);
      }
    }
    put_added_before(kDropped);
  }

  const BoxMesh& mesh_;
  const std::span<const RowEdit> edits_;
  const Box<D> box_;
  BoxBoundary& boundary_;
  std::array<std::vector<FoundFacet>, 2 * D> added_;  // by face, in the order of simplices
};

}  // namespace

void UpdateBoxBoundary(const BoxMesh& mesh, std::span<const RowEdit> edits, uint64_t old_vertices,
                       std::span<const uint32_t> moved, BoxBoundary& boundary) {
#define WELLSPACE_UPDATE(D)                          \
  if (mesh.low.size() == D) {                        \
    BoundaryUpdate<D> update(mesh, edits, boundary); \
    update.MarkVertices(old_vertices, moved);        \
    update.UpdateFacets();                           \
  }
  WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_UPDATE)
#undef WELLSPACE_UPDATE
}

}  // namespace wellspace::core
