#include "client/cli/statistics.h"

#include <array>
#include <nlohmann/json.hpp>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/cli/progress_bar.h"
#include "client/formats/mesh.h"

namespace wellspace::cli {
namespace {

nlohmann::ordered_json DuplicateOf(std::span<const uint32_t> input_vertex) {
  nlohmann::ordered_json pairs = nlohmann::ordered_json::array();
  // Points become vertices 0, 1, ... in the order in which they are first met, whether equal to the vertex or merged
  // with it.
  uint32_t distinct = 0;
  for (size_t i = 0; i < input_vertex.size(); ++i) {
    if (input_vertex[i] == distinct) {
      ++distinct;
    } else if (input_vertex[i] != client::kNoVertex) {
      pairs.push_back({i, input_vertex[i]});
    }
  }
  return pairs;
}

nlohmann::ordered_json DomainJson(const client::DomainStatistics& domain) {
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

// What was changed of a domain, and what is not meshed of it.
std::string DomainText(const client::DomainStatistics& domain) {
  std::string text = absl::StrCat(", ", WithThousands(domain.segments), " segments");
  const auto add = [&](uint64_t count, const char* what) {
    if (count > 0) {
      absl::StrAppend(&text, ", ", WithThousands(count), " ", what);
    }
  };
  add(domain.crossings, "crossings split");
  add(domain.touching_points, "points on segments");
  add(domain.near_points, "points that segments were led through");
  add(domain.dropped_segments, "segments dropped");
  add(domain.unmeshed_points, "points outside");
  add(domain.unused_seeds, "holes and regions outside");
  return text;
}

const char* AngleName(int dimension) { return dimension == 2 ? "min_angle_deg" : "min_dihedral_deg"; }

const char* TriangulationName(client::Triangulation triangulation) {
  switch (triangulation) {
    case client::Triangulation::kDelaunay:
      return "delaunay";
    case client::Triangulation::kRegular:
      return "regular";
    default:
      return "unknown";  // of an older server
  }
}

const char* ReasonName(client::SliverReason reason) {
  switch (reason) {
    case client::SliverReason::kDemands:
      return "demands";
    case client::SliverReason::kAngle:
      return "angle";
    case client::SliverReason::kWork:
      return "work";
    default:
      return "unknown";  // of another server
  }
}

nlohmann::ordered_json SliversJson(const client::SliverStatistics& slivers) {
  nlohmann::ordered_json json;
  json["found"] = slivers.found;
  json["left"] = slivers.left;
  json["moves"] = slivers.moves;
  json["added_vertices"] = slivers.added_vertices;
  json["weighted_vertices"] = slivers.weighted_vertices;
  json["min_angle_before_deg"] = slivers.min_angle_before_deg;
  json["operations"] = slivers.operations;
  json["left_by"] = {
      {"demands", slivers.left_by_demands}, {"angle", slivers.left_by_angle}, {"work", slivers.left_by_work}};
  json["flattest_left"] = nlohmann::ordered_json::array();
  for (const client::LeftSliver& left : slivers.flattest_left) {
    nlohmann::ordered_json& item = json["flattest_left"].emplace_back();
    item["vertices"] = left.vertices;
    item["min_dihedral_deg"] = left.min_dihedral_deg;
    item["reason"] = ReasonName(left.reason);
  }
  return json;
}

// "; Delaunay, from 0.05° by 3 moves, 1 added vertices".
std::string SliversText(const client::SliverStatistics& slivers) {
  std::string text = absl::StrFormat(
      "; %s, from %.2f\u00b0 by %s moves, %s added vertices", slivers.weighted_vertices == 0 ? "Delaunay" : "regular",
      slivers.min_angle_before_deg, WithThousands(slivers.moves), WithThousands(slivers.added_vertices));
  if (slivers.weighted_vertices != 0) {
    absl::StrAppend(&text, ", ", WithThousands(slivers.weighted_vertices), " weights");
  }
  if (slivers.left != 0) {
    absl::StrAppend(&text, "; ", WithThousands(slivers.left), slivers.left == 1 ? " sliver" : " slivers",
                    " could not be repaired");
  }
  return text;
}

}  // namespace

std::string StatisticsJson(const client::MeshHeader& mesh, std::span<const uint32_t> input_vertex,
                           std::span<const uint32_t> moved_vertices) {
  const client::MeshStatistics& statistics = mesh.statistics;
  nlohmann::ordered_json json;
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
  json["slivers"] = statistics.slivers.has_value() ? SliversJson(*statistics.slivers) : nlohmann::ordered_json();
  json["seconds"] = statistics.seconds;
  json["peak_memory_bytes"] = statistics.peak_memory_bytes;
  json["counters"] = statistics.counters;
  json["duplicate_of"] = DuplicateOf(input_vertex);
  json["moved_vertices"] = std::vector<uint32_t>(moved_vertices.begin(), moved_vertices.end());
  return json.dump(2) + "\n";
}

std::string Summary(const client::MeshHeader& mesh) {
  const client::MeshStatistics& statistics = mesh.statistics;
  const auto total = statistics.seconds.find("total");
  return absl::StrCat(
      WithThousands(statistics.input_points), " points",
      statistics.duplicates == 0 ? "" : absl::StrCat(" (", WithThousands(statistics.duplicates), " duplicates)"),
      statistics.merged_points == 0 ? "" : absl::StrCat(" (", WithThousands(statistics.merged_points), " merged)"),
      statistics.domain.has_value() ? DomainText(*statistics.domain) : "", " -> ", WithThousands(statistics.vertices),
      " vertices, ", WithThousands(statistics.simplices), " ", formats::SimplexName(mesh.dimension),
      absl::StrFormat("; radius-edge at most %.4f, %s at least %.2f\u00b0", statistics.max_radius_edge,
                      mesh.dimension == 2 ? "angles" : "dihedral angles", statistics.min_angle_deg),
      statistics.slivers.has_value() ? SliversText(*statistics.slivers) : "",
      mesh.moved_vertex_count == 0
          ? ""
          : absl::StrCat("; ", WithThousands(mesh.moved_vertex_count), " vertices of the mesh before have moved"),
      total == statistics.seconds.end() ? "" : absl::StrFormat("; %.2f s", total->second));
}

std::string BoundaryWarning(const client::MeshHeader& mesh) {
  return mesh.boundary.empty()
             ? "warning: the server is too old to tell the boundary of a mesh; the file has none (--no-boundary: no "
               "warning)\n"
             : "";
}

std::string SliverWarning(const client::MeshHeader& mesh) {
  if (!mesh.statistics.slivers.has_value() || mesh.statistics.slivers->left == 0) {
    return "";
  }
  const client::SliverStatistics& slivers = *mesh.statistics.slivers;
  std::string text = absl::StrCat("warning: ", WithThousands(slivers.left),
                                  slivers.left == 1 ? " sliver is" : " slivers are", " left below --min-dihedral");
  const char* separator = " (";
  const auto add = [&](uint64_t count, const char* why) {
    if (count != 0) {
      absl::StrAppend(&text, separator, WithThousands(count), " ", why);
      separator = "; ";
    }
  };
  add(slivers.left_by_demands, "where no new vertex keeps --rho and the sizes");
  add(slivers.left_by_angle, "where a new vertex leaves angles as small");
  add(slivers.left_by_work, "given up when the bound on work was reached, which a smaller --rho avoids");
  absl::StrAppend(&text, *separator == ';' ? ")" : "");
  for (const client::LeftSliver& left : slivers.flattest_left) {
    absl::StrAppend(&text, "\n  vertices ", absl::StrJoin(left.vertices, " "),
                    absl::StrFormat(": %.3g\u00b0, by ", left.min_dihedral_deg), ReasonName(left.reason));
  }
  return text + "\n";
}

std::string EstimateJson(const client::MeshEstimate& estimate, int dimension) {
  nlohmann::ordered_json json;
  json["dimension"] = dimension;
  json["vertices"] = estimate.vertices;
  json["simplices"] = estimate.simplices;
  json["memory_bytes"] = estimate.memory_bytes;
  json["tree_leaves"] = estimate.tree_leaves;
  return json.dump(2) + "\n";
}

std::string EstimateText(const client::MeshEstimate& estimate, int dimension) {
  constexpr uint64_t kSaturated = uint64_t{1} << 53;  // stands for more, too
  const auto count = [](uint64_t number) {
    return absl::StrCat(number >= kSaturated ? "at least " : "", WithThousands(number));
  };
  const auto line = [](const char* name, const std::string& value) {
    return absl::StrFormat("%-14s %s\n", name, value);
  };
  return absl::StrCat(
      line("vertices", count(estimate.vertices)), line(formats::SimplexName(dimension), count(estimate.simplices)),
      line("memory",
           absl::StrCat(estimate.memory_bytes >= kSaturated ? "at least " : "", WithBinaryUnit(estimate.memory_bytes))),
      line("tree leaves", WithThousands(estimate.tree_leaves)));
}

std::string WithBinaryUnit(uint64_t bytes) {
  constexpr std::array kUnits = {"B", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"};
  if (bytes < 1024) {
    return absl::StrCat(bytes, " ", kUnits[0]);
  }
  auto value = static_cast<double>(bytes);
  size_t unit = 0;
  // What would be printed as 1024 goes on to the next unit.
  while (value >= 1023.5 && unit + 1 < kUnits.size()) {
    value /= 1024;
    ++unit;
  }
  return absl::StrFormat("%.*f %s", value < 9.95 ? 1 : 0, value, kUnits[unit]);
}

}  // namespace wellspace::cli
