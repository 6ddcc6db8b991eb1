// Every reader of surfaces, on any bytes, and the preparation of surfaces; and small complexes on a grid, where
// nearly everything is degenerate.
//
// Input: a character that chooses among kFormats, '0' the first, '1' the second and so on, and then the file; with a
// .node file beside it that file first, after a length of two bytes, low one first. After 'x' comes a complex: a byte
// each for the solids, the weld and the number of points; a byte for each coordinate; then three bytes for the corners
// of each triangle and one for its marker. After 'w' comes one whose solids are by winding: with a byte for the
// resolution, and none for the solids. After 'k' comes one of which the points are kept, and which is meshed.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "client/formats/surface/read_surface.h"
#include "core/input/surface_report.h"
#include "core/meshers/mesher.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/scratch_folder.h"

namespace wellspace::fuzz {
namespace {

using formats::Surface;

constexpr std::array kFormats = {"stl", "obj", "ply", "off", "smesh", "poly", "smesh"};
constexpr size_t kWithNode = 6;
constexpr size_t kMostPoints = 25;
constexpr size_t kMostTriangles = 40;

void RequireSurface(const Surface& surface) {
  Require(surface.points.size() % 3 == 0 && surface.corners.size() % 3 == 0, "rows have three numbers");
  Require(surface.triangle_count() > 0, "a surface has a triangle");
  for (const double x : surface.points) {
    Require(std::isfinite(x), "coordinates are finite");
  }
  for (const uint32_t corner : surface.corners) {
    Require(corner < surface.point_count(), "corners are points");
  }
  Require(surface.markers.size() == surface.triangle_count(), "every triangle has a marker");
  for (uint64_t t = 0; t < surface.triangle_count(); ++t) {
    RequireClearMessage(surface.TriangleOrigin(t));
  }
  bool has_region = false;
  for (uint64_t i = 0; i < surface.seeds.size(); ++i) {
    const Surface::Seed& seed = surface.seeds[i];
    Require(std::isfinite(seed.x) && std::isfinite(seed.y) && std::isfinite(seed.z) && std::isfinite(seed.attribute),
            "seeds are finite");
    Require(seed.max_volume >= 0 && std::isfinite(seed.max_volume), "volumes are finite, and not negative");
    Require(!seed.is_hole || !has_region, "holes come before regions");
    has_region |= !seed.is_hole;
    RequireClearMessage(surface.SeedOrigin(i));
  }
  for (const std::string& note : surface.notes) {
    RequireClearMessage(note);
  }
}

// The findings about a complex have to fit together.
void RequireReport(const core::SurfaceReport& report, const core::SurfaceFeatures& features) {
  const uint64_t given = features.triangle_count();
  const uint64_t dropped = report.flat_triangles + report.equal_triangles;
  Require(report.triangles > 0 && (features.box.has_value() || report.triangles + dropped == given),
          "every triangle is there, or counted");
  Require(report.cut_triangles + report.outside_triangles + dropped <= given, "a triangle is counted once");
  Require(report.patches > 0 && report.patches <= report.triangles, "every patch has a triangle");
  Require(2 * report.flipped_triangles <= report.triangles, "at most half are flipped");
  Require(report.volume.has_value() == report.faults.empty(), "a volume is told where nothing is wrong");
  Require(report.lost_area >= 0 && std::isfinite(report.lost_area), "an area is lost, or none");
  for (const core::SurfaceFault& fault : report.faults) {
    Require(fault.count > 0 && !fault.places.empty() && !fault.accepted.empty(), "a fault has a count and a place");
    for (const core::FaultPlace& place : fault.places) {
      Require(!place.triangles.empty(), "a place has triangles");
      for (const uint32_t triangle : place.triangles) {
        Require(triangle < given, "triangles of a place are given ones");
      }
      Require(std::isfinite(place.at[0]) && std::isfinite(place.at[1]) && std::isfinite(place.at[2]),
              "places are finite");
    }
  }
  double volume = 0;
  for (const double solid : report.solids) {
    Require(solid > 0 || report.area < 1e-100, "solids have a volume");
    volume += solid;
  }
  Require(!report.volume.has_value() || *report.volume <= volume * (1 + 1e-12), "what is meshed is of the solids");
}

// The same whatever the order of the triangles.
void RequireSameBackwards(const std::vector<double>& points, core::SurfaceFeatures features,
                          const core::SurfaceReport& report) {
  std::vector<uint32_t> corners;
  std::vector<int32_t> markers;
  for (size_t t = features.triangle_count(); t > 0; --t) {
    const auto row = features.corners.subspan(3 * (t - 1), 3);
    corners.insert(corners.end(), {row[1], row[2], row[0]});
    if (!features.markers.empty()) {
      markers.push_back(features.markers[t - 1]);
    }
  }
  features.corners = corners;
  features.markers = markers;
  const auto again = core::InspectSurface(points, features, 2, core::RunContext());
  Require(again.ok(), "the order of triangles is no error:", again.status().ToString());
  const auto figures = [](const core::SurfaceReport& r) {
    return std::tuple(r.triangles, r.area, r.volume, r.solids, r.curves, r.corners, r.patches, r.sharpest_angle_deg,
                      r.sharpest_at, r.flipped_triangles, r.components, r.membranes, r.faults.size(), r.lost_area,
                      r.cut_triangles, r.outside_triangles);
  };
  Require(figures(*again) == figures(report), "the order of triangles changes nothing");
}

void Inspect(const std::vector<double>& points, const core::SurfaceFeatures& features) {
  const auto report = core::InspectSurface(points, features, 1, core::RunContext());
  if (!report.ok()) {
    Require(report.status().code() == absl::StatusCode::kInvalidArgument,
            "what cannot be served is an INVALID_ARGUMENT:", report.status().ToString());
    return;
  }
  RequireReport(*report, features);
  Require(features.solids != core::SolidRule::kWinding || report->faults.empty(), "a wrap has no faults");
  RequireSameBackwards(points, features, *report);
}

// Of a mesh that keeps points: all corners of triangles at meshed solids are vertices, with their bits.
void MeshKeeping(const std::vector<double>& points, core::SurfaceFeatures features) {
  constexpr uint64_t kMostVertices = 3000;
  features.keeps_points = true;
  core::MeshParameters parameters;
  parameters.dimension = 3;
  parameters.max_vertices = kMostVertices;
  core::RunContext context;
  const absl::StatusOr<core::Mesh> mesh = core::MeshPoints(parameters, core::Input(points, features), context);
  if (!mesh.ok()) {
    Require(absl::IsInvalidArgument(mesh.status()) || absl::IsResourceExhausted(mesh.status()),
            "what cannot be meshed is refused:", mesh.status().ToString());
    return;
  }
  Require(mesh->input_vertex.size() == points.size() / 3, "each point has its vertex, or none");
  for (size_t i = 0; i < mesh->input_vertex.size(); ++i) {
    const uint32_t v = mesh->input_vertex[i];
    Require(v == core::kNoOutput || std::equal(&points[3 * i], &points[3 * i] + 3, &mesh->points[3 * size_t{v}]),
            "a point that is a vertex keeps its place");
  }
  const auto report = core::InspectSurface(points, features, 1, core::RunContext());
  const bool are_all_at_solids = report.ok() && features.solids == core::SolidRule::kHoles && report->membranes == 0 &&
                                 report->flat_triangles == 0;
  for (const uint32_t corner : features.corners) {
    Require(!are_all_at_solids || mesh->input_vertex[corner] != core::kNoOutput, "corners of triangles are kept");
  }
}

void TryComplex(ByteReader& bytes, uint8_t kind) {
  core::SurfaceFeatures features;
  if (kind == 'w') {
    features.solids = core::SolidRule::kWinding;
    features.resolution = 0.25 * (1 + bytes.Next() % 5);
  } else if (kind == 'b') {
    const double low = bytes.Next() % 2;
    features.solids = core::SolidRule::kBox;
    features.box = core::Box<3>{{low, 1, 1}, {3, 4 - low, 3}};
  } else {
    features.solids = bytes.Next() % 2 == 0 ? core::SolidRule::kEvenOdd : core::SolidRule::kHoles;
  }
  features.weld = bytes.Next() % 3 == 0 ? 1.0 : 0.0;
  const size_t count = 3 + bytes.Next() % kMostPoints;
  std::vector<double> points;
  for (size_t i = 0; i < 3 * count; ++i) {
    points.push_back(bytes.Next() % 5);
  }
  std::vector<uint32_t> corners;
  std::vector<int32_t> markers;
  while (!bytes.empty() && markers.size() < kMostTriangles) {
    for (int k = 0; k < 3; ++k) {
      corners.push_back(static_cast<uint32_t>(bytes.Next() % count));
    }
    markers.push_back(bytes.Next() % 3);
  }
  features.corners = corners;
  features.markers = markers;
  if (kind == 'k') {
    MeshKeeping(points, features);
  } else {
    Inspect(points, features);
  }
}

}  // namespace
}  // namespace wellspace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace wellspace;
  fuzz::ByteReader bytes(data, size);
  const uint8_t choice = bytes.Next();
  if (choice == 'x' || choice == 'w' || choice == 'k' || choice == 'b') {
    fuzz::TryComplex(bytes, choice);
    return 0;
  }
  const size_t format = static_cast<uint8_t>(choice - '0') % fuzz::kFormats.size();
  const fuzz::ScratchFolder& folder = fuzz::ScratchFolder::Get();
  folder.Write("surface.node", format == fuzz::kWithNode ? bytes.TakeBlock() : "");
  const std::string path = folder.Write("surface.any", bytes.TakeText());
  const auto surface = formats::ReadSurface(path, fuzz::kFormats[format]);
  if (!surface.ok()) {
    fuzz::Require(surface.status().code() == absl::StatusCode::kInvalidArgument,
                  "a bad file is an INVALID_ARGUMENT:", surface.status().ToString());
    fuzz::RequireClearMessage({surface.status().message().data(), surface.status().message().size()});
    return 0;
  }
  fuzz::RequireSurface(*surface);
  core::SurfaceFeatures features;
  features.corners = surface->corners;
  features.markers = surface->markers;
  features.solids =
      surface->solids == formats::Surface::SolidRule::kHoles ? core::SolidRule::kHoles : core::SolidRule::kEvenOdd;
  fuzz::Inspect(surface->points, features);
  return 0;
}
