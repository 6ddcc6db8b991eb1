#include "client/cli/surface_info.h"

#include <iostream>
#include <map>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"
#include "client/cli/labelled_lines.h"
#include "client/cli/progress_bar.h"

namespace wellspace::cli {
namespace {

client::Json PartsJson(const formats::Surface& surface) {
  std::map<int32_t, uint64_t> sizes;
  for (const int32_t marker : surface.markers) {
    ++sizes[marker];
  }
  std::map<int32_t, std::string> names;
  for (const formats::Surface::Part& part : surface.parts) {
    names[part.marker] = part.name;
  }
  client::Json parts = client::Json::array();
  for (const auto& [marker, size] : sizes) {
    parts.push_back({{"tag", marker}, {"name", names[marker]}, {"triangles", size}});
  }
  return parts;
}

// "length" of a loop, "distance" of a point, as the kind has it.
client::Json PlaceJson(const formats::Surface& surface, core::SurfaceFault::Kind kind, const core::FaultPlace& place) {
  client::Json json = {{"at", place.at}};
  if (kind == core::SurfaceFault::Kind::kOpenEdges) {
    json["length"] = place.size;
  } else if (kind == core::SurfaceFault::Kind::kNearPoints) {
    json["distance"] = place.size;
  }
  json["triangles"] = client::Json::array();
  for (const uint32_t triangle : place.triangles) {
    json["triangles"].push_back(surface.TriangleOrigin(triangle));
  }
  return json;
}

// Where one of the triangles is that were dropped, or go against others; null without any.
client::Json ExampleJson(const formats::Surface& surface, const core::FaultPlace& place) {
  return place.triangles.empty()
             ? client::Json(nullptr)
             : client::Json{{"at", place.at}, {"triangle", surface.TriangleOrigin(place.triangles.front())}};
}

client::Json FaultsJson(const formats::Surface& surface, const core::SurfaceReport& report) {
  client::Json faults = client::Json::array();
  for (const core::SurfaceFault& fault : report.faults) {
    client::Json json = {{"kind", core::NameOf(fault.kind)}, {"count", fault.count}, {"at_least", fault.has_more}};
    if (fault.kind == core::SurfaceFault::Kind::kOpenEdges) {
      json["loops"] = fault.loops;
    }
    json["places"] = client::Json::array();
    for (const core::FaultPlace& place : fault.places) {
      json["places"].push_back(PlaceJson(surface, fault.kind, place));
    }
    json["accepted"] = fault.accepted;
    faults.push_back(std::move(json));
  }
  return faults;
}

// "2 points", "1 point".
std::string Counted(uint64_t count, const std::string& what) {
  return absl::StrCat(WithThousands(count), " ", what, count == 1 ? "" : "s");
}

std::string Patches(uint64_t count) { return absl::StrCat(WithThousands(count), count == 1 ? " patch" : " patches"); }

void PrintChanges(const client::Json& json) {
  const auto count = [&json](const char* name) { return json[name].get<uint64_t>(); };
  if (count("welded_points") > 0) {
    PrintLine("welded", absl::StrFormat("%s, within %.3g of another one", Counted(count("welded_points"), "point"),
                                        json["weld"].get<double>()));
  }
  // "at (0, 0, 1): part.off:17", and if there are more "such as at …".
  const auto example = [&](const char* kind) {
    const client::Json& place = json[absl::StrCat(kind, "_example")];
    if (place.is_null()) {
      return std::string();
    }
    return absl::StrCat(count(absl::StrCat(kind, "_triangles").c_str()) > 1 ? ", such as at (" : ", at (",
                        Numbers(place["at"]), "): ", place["triangle"].get<std::string>());
  };
  if (count("moved_points") > 0) {
    PrintLine("moved", absl::StrFormat("%s onto sides of the box, within %.3g of it",
                                       Counted(count("moved_points"), "point"), json["weld"].get<double>()));
  }
  if (count("cut_triangles") > 0) {
    PrintLine("cut", absl::StrCat(Counted(count("cut_triangles"), "triangle"), " at the sides of the box"));
  }
  if (count("outside_triangles") > 0) {
    PrintLine("dropped", absl::StrCat(Counted(count("outside_triangles"), "triangle"), " outside of the box"));
  }
  if (count("flat_triangles") > 0) {
    PrintLine("dropped",
              absl::StrCat(Counted(count("flat_triangles"), "triangle"), " without an area", example("flat")));
  }
  if (count("equal_triangles") > 0) {
    PrintLine("dropped",
              absl::StrCat(Counted(count("equal_triangles"), "triangle"), " equal to another one", example("equal")));
  }
  if (const uint64_t flipped = count("flipped_triangles"); flipped > 0) {
    PrintLine("turned over", absl::StrCat(Counted(flipped, "triangle"), " against those around ",
                                          flipped == 1 ? "it" : "them", example("flipped"), "; that changes nothing"));
  }
  if (json["inside_out"].get<bool>()) {
    PrintLine("turned over", "the whole surface: its normals point inwards; that changes nothing");
  }
  if (count("one_sided") > 0) {
    PrintLine("one-sided", absl::StrCat(Counted(count("one_sided"), "part"), ", as a Moebius strip is"));
  }
  if (count("loose_points") > 0) {
    PrintLine("on no triangle", Counted(count("loose_points"), "point"));
  }
}

void PrintFault(const client::Json& fault) {
  const uint64_t count = fault["count"];
  std::string kind = fault["kind"];
  for (char& c : kind) {
    c = c == '_' ? ' ' : c;
  }
  PrintLine("fault",
            absl::StrCat(
                kind, ": ", fault["at_least"].get<bool>() ? "at least " : "", WithThousands(count),
                fault.contains("loops") ? absl::StrCat(" in ", Counted(fault["loops"].get<uint64_t>(), "loop")) : ""));
  for (const client::Json& place : fault["places"]) {
    std::string text = absl::StrCat("at (", Numbers(place["at"]), ")");
    if (place.contains("length")) {
      absl::StrAppend(&text, absl::StrFormat(", a loop %.4g long", place["length"].get<double>()));
    } else if (place.contains("distance")) {
      absl::StrAppend(&text, absl::StrFormat(", %.3g away", place["distance"].get<double>()));
    }
    for (size_t i = 0; i < place["triangles"].size(); ++i) {
      absl::StrAppend(&text, i == 0 ? ": " : ", ", place["triangles"][i].get<std::string>());
    }
    PrintLine("", absl::StrCat("  ", text));
  }
  const uint64_t listed = fault.contains("loops") ? fault["loops"].get<uint64_t>() : count;
  if (listed > fault["places"].size()) {
    PrintLine("", absl::StrCat("  and ", WithThousands(listed - fault["places"].size()), " more"));
  }
  // By which options the tool accepts that.
  const std::string accepted = absl::StrReplaceAll(
      fault["accepted"].get<std::string>(), {{"solids by holes", "solids by holes (--solids holes)"},
                                             {"solids by winding", "solids by winding (--solids winding)"},
                                             {"weld with a longer distance", "weld with a longer distance (--weld)"}});
  PrintLine("", absl::StrCat("  expected ", accepted));
}

}  // namespace

client::Json SurfaceJson(const std::string& path, const formats::Surface& surface,
                         const core::SurfaceFeatures& features, const core::SurfaceReport& report) {
  client::Json json;
  json["file"] = path;
  json["kind"] = "surface";
  json["format"] = surface.format;
  json["dimension"] = 3;
  json["triangles"] = report.triangles;
  json["points"] = report.points;
  json["low"] = report.box.low;
  json["high"] = report.box.high;
  json["parts"] = PartsJson(surface);
  json["cut_polygons"] = surface.cut_polygons;
  json["weld"] = features.weld;
  json["welded_points"] = report.welded_points;
  json["flat_triangles"] = report.flat_triangles;
  json["flat_example"] = ExampleJson(surface, report.flat_at);
  json["equal_triangles"] = report.equal_triangles;
  json["equal_example"] = ExampleJson(surface, report.equal_at);
  json["flipped_triangles"] = report.flipped_triangles;
  json["flipped_example"] = ExampleJson(surface, report.flipped_at);
  json["one_sided"] = report.one_sided;
  json["inside_out"] = report.is_inside_out;
  json["loose_points"] = report.loose_points;
  json["components"] = report.components;
  json["area"] = report.area;
  json["lost_area"] = report.lost_area;
  json["moved_points"] = report.moved_points;
  json["cut_triangles"] = report.cut_triangles;
  json["outside_triangles"] = report.outside_triangles;
  json["volume"] = report.volume.has_value() ? client::Json(*report.volume) : client::Json(nullptr);
  json["solids"] = report.volume.has_value() ? client::Json(report.solids) : client::Json(nullptr);
  json["membranes"] = report.volume.has_value() ? client::Json(report.membranes) : client::Json(nullptr);
  json["curves"] = report.curves;
  json["corners"] = report.corners;
  json["patches"] = report.patches;
  json["sharpest_angle_deg"] =
      report.sharpest_angle_deg.has_value() ? client::Json(*report.sharpest_angle_deg) : client::Json(nullptr);
  json["sharpest_at"] =
      report.sharpest_angle_deg.has_value() ? client::Json(report.sharpest_at) : client::Json(nullptr);
  json["faults"] = FaultsJson(surface, report);
  return json;
}

void PrintSurface(const client::Json& json) {
  PrintLine("file", json["file"]);
  PrintLine("kind", absl::StrCat("surface, ", std::string(json["format"]), ", 3-D"));
  PrintLine("triangles", WithThousands(json["triangles"]));
  PrintLine("points", WithThousands(json["points"]));
  PrintLine("from", Numbers(json["low"]));
  PrintLine("to", Numbers(json["high"]));
  if (json["parts"].size() > 1 || json["parts"][0]["tag"] != 0) {
    for (const client::Json& part : json["parts"]) {
      const std::string name = part["name"];
      PrintLine("part", absl::StrCat(part["tag"].get<int32_t>(), name.empty() ? "" : " ", name, ": ",
                                     Counted(part["triangles"], "triangle")));
    }
  }
  if (const uint64_t polygons = json["cut_polygons"]; polygons > 0) {
    PrintLine("cut", absl::StrCat(Counted(polygons, "polygon"), " into triangles"));
  }
  PrintChanges(json);
  PrintLine("components", WithThousands(json["components"]));
  PrintLine("area", absl::StrFormat("%.9g", json["area"].get<double>()));
  if (json["lost_area"].get<double>() > 0) {
    PrintLine("lost", absl::StrFormat("triangles of an area of %.4g: around parts thinner than the resolution, or that "
                                      "go the other way than most",
                                      json["lost_area"].get<double>()));
  }
  if (!json["volume"].is_null()) {
    const size_t solids = json["solids"].size();
    PrintLine("volume", absl::StrFormat("%.9g%s", json["volume"].get<double>(),
                                        solids > 1 ? absl::StrCat(", of ", Counted(solids, "bounded solid")) : ""));
  }
  if (!json["membranes"].is_null() && json["membranes"] != 0) {
    PrintLine("membranes", Counted(json["membranes"], "triangle"));
  }
  PrintLine("creases", absl::StrCat(Counted(json["curves"], "curve"), ", ", Counted(json["corners"], "corner"), ", ",
                                    Patches(json["patches"])));
  if (!json["sharpest_angle_deg"].is_null()) {
    PrintLine("sharpest angle", absl::StrFormat("%.6g\u00b0 at (%s)", json["sharpest_angle_deg"].get<double>(),
                                                Numbers(json["sharpest_at"])));
  }
  for (const client::Json& fault : json["faults"]) {
    PrintFault(fault);
  }
  if (json["faults"].empty()) {
    PrintLine("faults", "none");
  }
}

}  // namespace wellspace::cli
