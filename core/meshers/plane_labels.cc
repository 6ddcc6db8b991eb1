#include "core/meshers/plane_labels.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/features/planar_faces.h"
#include "core/features/planar_graph.h"
#include "core/geometry/point.h"
#include "core/simplex/boundary.h"
#include "core/simplex/part_numbers.h"
#include "core/simplex/quality.h"

namespace wellspace::core {
namespace {

// A ratio that exceeds rho by less, relatively, does so by rounding.
constexpr double kRatioTolerance = 1e-9;

// Vertices that one thread looks at between two looks at the context.
constexpr uint32_t kVerticesBetweenChecks = 1 << 14;

// The keys of the parts of a boundary: markers, and sides of the box, which come below all markers.
constexpr int64_t kFirstSide = std::numeric_limits<int64_t>::min();

int64_t PartOf(const GraphSegment& segment) {
  return segment.IsBoxSide() && segment.marker == 0 ? kFirstSide + (segment.source - GraphSegment::kBoxSide)
                                                    : int64_t{segment.marker};
}

std::string PartName(int64_t part) {
  if (part < std::numeric_limits<int32_t>::min()) {
    return FaceName(static_cast<int>(part - kFirstSide));
  }
  return MarkerName(part);
}

}  // namespace

absl::Status SetOrigins(const PlanarDomain& planar, const VertexNumbering<2>& numbering, Mesh& mesh,
                        const RunContext& context) {
  mesh.vertex_origins.assign(mesh.vertex_count(), kSteinerOrigin);
  for (uint32_t p = 0; p < planar.point_count(); ++p) {
    if (p % kVerticesBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const std::span<const HalfEdge> ways = planar.WaysFrom(VertexId{p});
    const auto sides = std::count_if(ways.begin(), ways.end(),
                                     [&](HalfEdge h) { return planar.graph().segments[SegmentOf(h)].IsBoxSide(); });
    if (sides == 2) {
      mesh.vertex_origins[numbering.OutputIndex(VertexId{p})] = kCornerOrigin;
    }
  }
  for (size_t i = mesh.input_vertex.size(); i > 0; --i) {
    if (const uint32_t v = mesh.input_vertex[i - 1]; v != kNoOutput) {
      mesh.vertex_origins[v] = static_cast<uint32_t>(i - 1);
    }
  }
  return context.Check();
}

absl::Status SetBoundary(const PlanarDomain& planar, const PlanarDomain::Chains& chains,
                         const VertexNumbering<2>& numbering, Mesh& mesh, const RunContext& context) {
  const std::vector<GraphSegment>& segments = planar.graph().segments;
  std::set<int64_t> values;
  for (uint32_t s = 0; s < segments.size(); ++s) {
    if (s % kVerticesBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    values.insert(PartOf(segments[s]));
  }
  const std::map<int64_t, int32_t> tags = NumberAboveZero(values);
  std::vector<std::pair<int32_t, uint32_t>> order;  // tags and segments
  order.reserve(segments.size());
  for (uint32_t s = 0; s < segments.size(); ++s) {
    order.emplace_back(tags.at(PartOf(segments[s])), s);
  }
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(order, std::less<>(), context));
  mesh.vertex_tags.assign(mesh.vertex_count(), kNoTag);
  for (const auto& [tag, s] : order) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    if (mesh.boundary.empty() || mesh.boundary.back().tag != tag) {
      mesh.boundary.push_back({tag, PartName(PartOf(segments[s])), 0});
    }
    const bool is_left = planar.faces().IsMeshed(planar.faces().left_face[HalfEdgeOf(s, false)]);
    const std::span<const VertexId> chain = chains.Of(s);
    for (size_t i = 0; i + 1 < chain.size(); ++i) {
      const uint32_t from = numbering.OutputIndex(chain[i]);
      const uint32_t to = numbering.OutputIndex(chain[i + 1]);
      mesh.facets.push_back(is_left ? from : to);
      mesh.facets.push_back(is_left ? to : from);
      ++mesh.boundary.back().facets;
      for (const uint32_t v : {from, to}) {
        mesh.vertex_tags[v] = mesh.vertex_tags[v] == kNoTag ? tag : mesh.vertex_tags[v];
      }
    }
  }
  return absl::OkStatus();
}

absl::Status SetRegions(const PlanarDomain& planar, std::span<const uint32_t> faces_of, Mesh& mesh,
                        const RunContext& context) {
  std::set<int64_t> values;
  for (const Face& face : planar.faces().faces) {
    if (face.is_meshed) {
      values.insert(face.region);
    }
  }
  const std::map<int64_t, int32_t> ids = NumberAboveZero(values);
  std::map<int32_t, int64_t> regions;
  for (const auto& [value, id] : ids) {
    regions[id] = value;
  }
  for (const auto& [id, value] : regions) {
    mesh.regions.push_back({id, RegionName(value)});
  }
  if (regions.size() > 1) {
    mesh.simplex_regions.reserve(mesh.simplex_count());
    for (const uint32_t face : faces_of) {
      if (mesh.simplex_regions.size() % kVerticesBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      mesh.simplex_regions.push_back(ids.at(planar.faces().faces[face].region));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<uint64_t> CountExempt(const Mesh& mesh, double rho, const RunContext& context) {
  uint64_t count = 0;
  if (mesh.statistics.max_radius_edge <= rho) {
    return count;
  }
  for (size_t t = 0; t < mesh.simplices.size(); t += 3) {
    if (t % (3 * kVerticesBetweenChecks) == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const Simplex<2> corners = {PointAt<2>(mesh.points, mesh.simplices[t]),
                                PointAt<2>(mesh.points, mesh.simplices[t + 1]),
                                PointAt<2>(mesh.points, mesh.simplices[t + 2])};
    count += RadiusEdgeRatio<2>(corners) > rho * (1 + kRatioTolerance) ? 1 : 0;
  }
  return count;
}

}  // namespace wellspace::core
