// The tetrahedra of a mesh inside a surface, and the solids and numbers of their vertices.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/base/stopwatch.h"
#include "core/meshers/space_mesher.h"
#include "core/simplex/flat_tetrahedra.h"
#include "core/simplex/solid_labels.h"

namespace wellspace::core {

// The simplices of the box.
absl::StatusOr<Simplices> SpaceMesher::AllSimplices(int threads, RunContext& context) {
  if (!is_repaired_) {
    return ComputeSimplices<3>(structure_, refinement_->stars(), numbering_.output_index(), threads, context);
  }
  WELLSPACE_ASSIGN_OR_RETURN(WeightedSimplices repaired,
                             slivers_.ToSimplices(structure_, refinement_->stars(), numbering_.output_index(),
                                                  /*pump=*/false, threads, context));
  return std::move(repaired.simplices);
}

// Makes the tetrahedra in solids that are meshed, and their boundary.
absl::Status SpaceMesher::MakeTetrahedra(int threads, RunContext& context) {
  const Stopwatch stopwatch(figures_.simplices_seconds, slivers_.statistics().seconds);
  ExtendNumbers();
  WELLSPACE_ASSIGN_OR_RETURN(Simplices simplices, AllSimplices(threads, context));
  figures_.star_queries.Add(simplices.counters);
  simplices.counters = {};
  WELLSPACE_ASSIGN_OR_RETURN(std::vector<double> points, ScaledPoints(context));
  WELLSPACE_ASSIGN_OR_RETURN(HugeVector<uint32_t> solids,
                             LabelSimplices(spatial_->index(), points, simplices.indices, threads, context));
  size_t kept = 0;
  for (size_t s = 0; s < solids.size(); ++s) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(s, context));
    if (spatial_->IsMeshed(solids[s])) {
      solids[kept] = solids[s];
      std::copy_n(simplices.indices.begin() + static_cast<std::ptrdiff_t>(4 * s), 4,
                  simplices.indices.begin() + static_cast<std::ptrdiff_t>(4 * kept));
      ++kept;
    }
  }
  solids.resize(kept);
  simplices.indices.resize(4 * kept);
  WELLSPACE_ASSIGN_OR_RETURN(const bool has_changed, MatchPlaces(simplices, solids, context));
  if (has_changed) {
    WELLSPACE_ASSIGN_OR_RETURN(points, ScaledPoints(context));
  }
  // Around acute creases vertices mirror each other, and do not move. Of membranes the labels know nothing: an edge
  // could come to pierce one.
  if (!spatial_->creases().IsEmpty() && spatial_->solids().membranes == 0) {
    WELLSPACE_RETURN_IF_ERROR(FlipFlatTetrahedra(points, simplices.indices, solids, context).status());
  }
  const std::vector<int32_t> regions = Regions();
  WELLSPACE_ASSIGN_OR_RETURN(SolidBoundary boundary, FindSolidBoundary({points, simplices.indices, solids, regions},
                                                                       spatial_->index(), threads, context));
  made_ = MadeOfSolids{std::move(simplices), std::move(solids), std::move(boundary), {}};
  return absl::OkStatus();
}

// A vertex between a facet and the surface is on the other side of the facet than of the surface. Has vertices that
// were added in solids have the side of the tetrahedra around them, and returns whether that changed a number.
absl::StatusOr<bool> SpaceMesher::MatchPlaces(Simplices& simplices, std::span<const uint32_t> solids,
                                              const RunContext& context) {
  constexpr uint32_t kNone = ~uint32_t{0};
  std::vector<uint32_t> solid_of(structure_.vertex_count(), kNone);  // by output index: of a tetrahedron there
  for (size_t i = 0; i < simplices.indices.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
    solid_of[simplices.indices[i]] = solids[i / 4];
  }
  const std::vector<bool>& is_given = repairs_.is_given();
  bool has_changed = false;
  for (uint32_t v = 0; v < solid_of.size(); ++v) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(v, context));
    const SpacePlace& place = spatial_->PlaceOf(VertexId{v});
    const uint32_t solid = solid_of[numbering_.OutputIndex(VertexId{v})];
    if (place.kind == SpacePlace::Kind::kSolid && !(v < is_given.size() && is_given[v]) &&
        spatial_->IsMeshedAt(place) != (solid != kNone)) {
      spatial_->MoveIntoSolid(VertexId{v}, solid == kNone ? 0 : solid);
      has_changed = true;
    }
  }
  if (has_changed) {
    std::vector<VertexId> vertices(solid_of.size());
    for (uint32_t i = 0; i < vertices.size(); ++i) {
      vertices[i] = numbering_.VertexOf(i);
    }
    ExtendNumbers();
    for (size_t i = 0; i < simplices.indices.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
      simplices.indices[i] = numbering_.OutputIndex(vertices[simplices.indices[i]]);
    }
  }
  return has_changed;
}

}  // namespace wellspace::core
