#include "client/json/statistics.h"

#include <vector>

namespace wellspace::client {
namespace {

Json DuplicateOf(std::span<const uint32_t> input_vertex) {
  Json pairs = Json::array();
  // Points become vertices 0, 1, ... in the order in which they are first met, whether equal to the vertex or merged
  // with it.
  uint32_t distinct = 0;
  for (size_t i = 0; i < input_vertex.size(); ++i) {
    if (input_vertex[i] == distinct) {
      ++distinct;
    } else if (input_vertex[i] != kNoVertex) {
      pairs.push_back({i, input_vertex[i]});
    }
  }
  return pairs;
}

Json DomainJson(const DomainStatistics& domain) {
  return {{"unmeshed_points", domain.unmeshed_points},
          {"segments", domain.segments},
          {"subsegments", domain.subsegments},
          {"dropped_segments", domain.dropped_segments},
          {"touching_points", domain.touching_points},
          {"crossings", domain.crossings},
          {"near_points", domain.near_points},
          {"exempt_simplices", domain.exempt_simplices},
          {"min_input_angle_deg", domain.min_input_angle_deg},
          {"unused_seeds", domain.unused_seeds}};
}

Json SurfaceJson(const SurfaceStatistics& surface) {
  return {{"triangles", surface.triangles},
          {"welded_points", surface.welded_points},
          {"dropped_triangles", surface.dropped_triangles},
          {"flipped_triangles", surface.flipped_triangles},
          {"unmeshed_points", surface.unmeshed_points},
          {"patches", surface.patches},
          {"curves", surface.curves},
          {"corners", surface.corners},
          {"solids", surface.solids},
          {"facets", surface.facets},
          {"ridges", surface.ridges},
          {"lost_ridges", surface.lost_ridges},
          {"exempt_simplices", surface.exempt_simplices},
          {"acute_curves", surface.acute_curves},
          {"tube_simplices", surface.tube_simplices},
          {"min_angle_outside_deg", surface.min_angle_outside_deg},
          {"unused_seeds", surface.unused_seeds},
          {"min_facet_angle_deg", surface.min_facet_angle_deg},
          {"deviation_of_facets", surface.deviation_of_facets},
          {"deviation_of_surface", surface.deviation_of_surface},
          {"lost_area", surface.lost_area},
          {"cut_triangles", surface.cut_triangles},
          {"outside_triangles", surface.outside_triangles},
          {"volumes", surface.volumes}};
}

const char* AngleName(int dimension) { return dimension == 2 ? "min_angle_deg" : "min_dihedral_deg"; }

const char* TriangulationName(Triangulation triangulation) {
  switch (triangulation) {
    case Triangulation::kDelaunay:
      return "delaunay";
    case Triangulation::kRegular:
      return "regular";
    default:
      return "unknown";  // of an older server
  }
}

Json SliversJson(const SliverStatistics& slivers) {
  Json json;
  json["found"] = slivers.found;
  json["left"] = slivers.left;
  json["moves"] = slivers.moves;
  json["added_vertices"] = slivers.added_vertices;
  json["weighted_vertices"] = slivers.weighted_vertices;
  json["min_angle_before_deg"] = slivers.min_angle_before_deg;
  json["operations"] = slivers.operations;
  json["left_by"] = {
      {"demands", slivers.left_by_demands}, {"angle", slivers.left_by_angle}, {"work", slivers.left_by_work}};
  json["flattest_left"] = Json::array();
  for (const LeftSliver& left : slivers.flattest_left) {
    Json& item = json["flattest_left"].emplace_back();
    item["vertices"] = left.vertices;
    item["min_dihedral_deg"] = left.min_dihedral_deg;
    item["reason"] = ReasonName(left.reason);
  }
  return json;
}

}  // namespace

const char* ReasonName(SliverReason reason) {
  switch (reason) {
    case SliverReason::kDemands:
      return "demands";
    case SliverReason::kAngle:
      return "angle";
    case SliverReason::kWork:
      return "work";
    default:
      return "unknown";  // of another server
  }
}

Json StatisticsJson(const MeshHeader& mesh, std::span<const uint32_t> input_vertex,
                    std::span<const uint32_t> moved_vertices) {
  const MeshStatistics& statistics = mesh.statistics;
  Json json;
  json["dimension"] = mesh.dimension;
  json["domain_low"] = mesh.domain_low;
  json["domain_high"] = mesh.domain_high;
  json["input_points"] = statistics.input_points;
  json["duplicates"] = statistics.duplicates;
  json["merged_points"] = statistics.merged_points;
  json["vertices"] = statistics.vertices;
  json["simplices"] = statistics.simplices;
  json["max_radius_edge"] = statistics.max_radius_edge;
  json[AngleName(mesh.dimension)] = statistics.min_angle_deg;
  json["triangulation"] = TriangulationName(statistics.triangulation);
  if (statistics.domain.has_value()) {
    json["domain"] = DomainJson(*statistics.domain);
  }
  if (statistics.surface.has_value()) {
    json["surface"] = SurfaceJson(*statistics.surface);
  }
  json["slivers"] = statistics.slivers.has_value() ? SliversJson(*statistics.slivers) : Json();
  json["seconds"] = statistics.seconds;
  json["peak_memory_bytes"] = statistics.peak_memory_bytes;
  json["counters"] = statistics.counters;
  json["duplicate_of"] = DuplicateOf(input_vertex);
  json["moved_vertices"] = std::vector<uint32_t>(moved_vertices.begin(), moved_vertices.end());
  return json;
}

}  // namespace wellspace::client
