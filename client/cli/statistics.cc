#include "client/cli/statistics.h"

#include <array>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/cli/progress_bar.h"
#include "client/formats/mesh.h"
#include "client/json/statistics.h"

namespace wellspace::cli {
namespace {

// ", 12 segments, 3 crossings split": how many rows there are, and the other counts but those that are 0.
std::string CountsText(uint64_t rows, const char* what,
                       std::initializer_list<std::pair<uint64_t, const char*>> others) {
  std::string text = absl::StrCat(", ", WithThousands(rows), " ", what);
  for (const auto& [count, name] : others) {
    if (count > 0) {
      absl::StrAppend(&text, ", ", WithThousands(count), " ", name);
    }
  }
  return text;
}

// The changes of a surface, and its parts that are not meshed.
std::string SurfaceText(const client::SurfaceStatistics& surface) {
  return CountsText(surface.triangles, "triangles",
                    {{surface.welded_points, "points welded"},
                     {surface.dropped_triangles, "triangles dropped"},
                     {surface.cut_triangles, "triangles cut at sides of the box"},
                     {surface.outside_triangles, "triangles outside of the box"},
                     {surface.unmeshed_points, "points outside"},
                     {surface.unused_seeds, "holes and regions outside"}});
}

// "; facets at most 0.001 from the surface".
std::string DeviationText(const client::SurfaceStatistics& surface) {
  std::string text;
  if (surface.deviation_of_facets > 0 || surface.deviation_of_surface > 0) {
    absl::StrAppendFormat(&text, "; facets at most %.3g from the surface, and it from them at most %.3g",
                          surface.deviation_of_facets, surface.deviation_of_surface);
  }
  if (surface.tube_simplices > 0) {
    absl::StrAppendFormat(&text, "; %s tetrahedra at creases below 75 degrees, the others have %.4g at least",
                          WithThousands(surface.tube_simplices), surface.min_angle_outside_deg);
  }
  if (surface.lost_area > 0) {
    absl::StrAppendFormat(
        &text, "; parts thinner than the resolution, or turned inside out, are lost: triangles of an area of %.3g",
        surface.lost_area);
  }
  if (surface.lost_ridges > 0) {
    absl::StrAppend(&text, "; ", WithThousands(surface.lost_ridges), " parts of creases are lost");
  }
  return text;
}

// The changes of a domain, and its parts that are not meshed.
std::string DomainText(const client::DomainStatistics& domain) {
  return CountsText(domain.segments, "segments",
                    {{domain.crossings, "crossings split"},
                     {domain.touching_points, "points on segments"},
                     {domain.near_points, "points that segments were led through"},
                     {domain.dropped_segments, "segments dropped"},
                     {domain.unmeshed_points, "points outside"},
                     {domain.unused_seeds, "holes and regions outside"}});
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

std::string Summary(const client::MeshHeader& mesh) {
  const client::MeshStatistics& statistics = mesh.statistics;
  const auto total = statistics.seconds.find("total");
  return absl::StrCat(
      WithThousands(statistics.input_points), " points",
      statistics.duplicates == 0 ? "" : absl::StrCat(" (", WithThousands(statistics.duplicates), " duplicates)"),
      statistics.merged_points == 0 ? "" : absl::StrCat(" (", WithThousands(statistics.merged_points), " merged)"),
      statistics.domain.has_value() ? DomainText(*statistics.domain) : "",
      statistics.surface.has_value() ? SurfaceText(*statistics.surface) : "", " -> ",
      WithThousands(statistics.vertices), " vertices, ", WithThousands(statistics.simplices), " ",
      formats::SimplexName(mesh.dimension),
      absl::StrFormat("; radius-edge at most %.4f, %s at least %.2f\u00b0", statistics.max_radius_edge,
                      mesh.dimension == 2 ? "angles" : "dihedral angles", statistics.min_angle_deg),
      statistics.surface.has_value() ? DeviationText(*statistics.surface) : "",
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
                    absl::StrFormat(": %.3g\u00b0, by ", left.min_dihedral_deg), client::ReasonName(left.reason));
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
  // A value that would be printed as 1024 goes on to the next unit.
  while (value >= 1023.5 && unit + 1 < kUnits.size()) {
    value /= 1024;
    ++unit;
  }
  return absl::StrFormat("%.*f %s", value < 9.95 ? 1 : 0, value, kUnits[unit]);
}

}  // namespace wellspace::cli
