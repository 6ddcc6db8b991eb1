// The checks of meshes in space, on meshes and surfaces on a small grid, where nearly everything is degenerate.
//
// Input: a byte, 'r' for a mesh row by row, else one of a grid.
//   r   a byte each for the number of points, tetrahedra, facets and ridges; a byte for each coordinate, 255 for NaN;
//       for each corner of these rows; for each tag and each region.
//   *   a byte each for the boxes along three axes; a byte for each of their tetrahedra, 0 for none, else its region.
// Then the surface: a byte for its solids, and three bytes for the corners and one for the marker of each triangle.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "core/input/surface_report.h"
#include "core/validate/validate_fidelity.h"
#include "core/validate/validate_solid.h"
#include "tests/fuzz/fuzz.h"
#include "tests/support/solid_meshes.h"

namespace wellspace::fuzz {
namespace {

constexpr size_t kMostRows = 40;
constexpr uint64_t kMostBoxes = 2;
constexpr size_t kMostTriangles = 40;
constexpr uint8_t kNan = 255;

struct FuzzedMesh {
  std::vector<double> points;
  std::vector<uint32_t> simplices;
  std::vector<uint32_t> facets;
  std::vector<uint32_t> ridges;
  std::vector<int32_t> tags;
  std::vector<int32_t> regions;

  core::MeshView View() const { return {.dimension = 3, .points = points, .simplices = simplices}; }
  core::SolidParts Parts() const {
    core::SolidParts parts;
    parts.domain.boundary = {.facets = facets, .tags = tags};
    parts.domain.regions = regions;
    parts.ridges = ridges;
    return parts;
  }
};

FuzzedMesh RowByRow(ByteReader& bytes) {
  FuzzedMesh mesh;
  const size_t points = bytes.Next() % kMostRows;
  const size_t tetrahedra = bytes.Next() % kMostRows;
  const size_t facets = bytes.Next() % kMostRows;
  const size_t ridges = bytes.Next() % kMostRows;
  for (size_t i = 0; i < 3 * points; ++i) {
    const uint8_t byte = bytes.Next();
    mesh.points.push_back(byte == kNan ? std::numeric_limits<double>::quiet_NaN() : byte % 5);
  }
  const auto take = [&](size_t count, std::vector<uint32_t>& rows) {
    for (size_t i = 0; i < count; ++i) {
      rows.push_back(bytes.Next() % static_cast<uint32_t>(points + 1));  // one of them may be missing
    }
  };
  take(4 * tetrahedra, mesh.simplices);
  take(3 * facets, mesh.facets);
  take(2 * ridges, mesh.ridges);
  for (size_t i = 0; i < facets; ++i) {
    mesh.tags.push_back(bytes.Next() % 4);
  }
  for (size_t i = 0; i < tetrahedra; ++i) {
    mesh.regions.push_back(bytes.Next() % 3);
  }
  return mesh;
}

std::vector<double> Steps(uint64_t boxes) {
  std::vector<double> steps;
  for (uint64_t i = 0; i <= boxes; ++i) {
    steps.push_back(static_cast<double>(i));
  }
  return steps;
}

// Vertices that no tetrahedron has are dropped.
FuzzedMesh OfGrid(ByteReader& bytes) {
  const auto next = [&] { return Steps(1 + bytes.Next() % kMostBoxes); };
  const std::vector<double> x = next();
  const std::vector<double> y = next();
  const std::vector<double> z = next();
  const test::Tetrahedra grid = test::GridMesh(x, y, z);
  FuzzedMesh mesh;
  std::vector<uint32_t> number(grid.points.size() / 3, std::numeric_limits<uint32_t>::max());
  for (size_t s = 0; s < grid.simplices.size() / 4; ++s) {
    const int32_t region = bytes.Next() % 3;
    if (region == 0) {
      continue;
    }
    mesh.regions.push_back(region);
    for (size_t k = 4 * s; k < 4 * s + 4; ++k) {
      uint32_t& v = number[grid.simplices[k]];
      if (v == std::numeric_limits<uint32_t>::max()) {
        v = static_cast<uint32_t>(mesh.points.size() / 3);
        const auto at = grid.points.begin() + 3 * static_cast<std::ptrdiff_t>(grid.simplices[k]);
        mesh.points.insert(mesh.points.end(), at, at + 3);
      }
      mesh.simplices.push_back(v);
    }
  }
  const core::MeshView view = mesh.View();
  if (mesh.simplices.empty()) {
    return mesh;
  }
  mesh.facets = *core::FacetsOfRegions(view, mesh.regions, core::RunContext());
  mesh.tags.assign(mesh.facets.size() / 3, 1);
  const absl::Status status = core::ValidateSolidMesh(mesh.View(), mesh.Parts(), 0, core::RunContext()).status();
  Require(status.ok(), "a part of a grid is a mesh:", status.ToString());
  return mesh;
}

void Compare(const FuzzedMesh& mesh, ByteReader& bytes) {
  const std::vector<double> line = Steps(3);
  std::vector<double> points;
  for (const double at_x : line) {
    for (const double at_y : line) {
      for (const double at_z : line) {
        points.insert(points.end(), {at_x, at_y, at_z});
      }
    }
  }
  core::SurfaceView surface{.points = points};
  surface.features.solids = bytes.Next() % 2 == 0 ? core::SolidRule::kEvenOdd : core::SolidRule::kHoles;
  std::vector<uint32_t> corners;
  std::vector<int32_t> markers;
  while (!bytes.empty() && markers.size() < kMostTriangles) {
    for (int k = 0; k < 3; ++k) {
      corners.push_back(bytes.Next() % static_cast<uint32_t>(points.size() / 3));
    }
    markers.push_back(bytes.Next() % 3);
  }
  surface.features.corners = corners;
  surface.features.markers = markers;
  const auto inspected = core::InspectSurface(points, surface.features, 1, core::RunContext());
  if (!inspected.ok() || !inspected->faults.empty()) {
    return;
  }
  const auto report =
      core::CompareWithSurface(mesh.View(), mesh.Parts(), surface, {.tolerance = 0.01}, core::RunContext());
  if (!report.ok()) {
    Require(report.status().code() == absl::StatusCode::kInvalidArgument,
            "what cannot be compared is an INVALID_ARGUMENT:", report.status().ToString());
    return;
  }
  Require(
      report->of_facets.found <= report->of_facets.at_most && report->of_surface.found <= report->of_surface.at_most,
      "what is found is within the bound");
  Require(report->verdict.ok() || absl::IsFailedPrecondition(report->verdict), "a fault is a FAILED_PRECONDITION");
  const double most = std::max(report->of_facets.found, report->of_surface.found);
  Require(!report->verdict.ok() || (most <= 0.0101 && report->worst_volume < 1), "what is far off is no mesh of it");
}

}  // namespace
}  // namespace wellspace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace wellspace;
  fuzz::ByteReader bytes(data, size);
  const fuzz::FuzzedMesh mesh = bytes.Next() == 'r' ? fuzz::RowByRow(bytes) : fuzz::OfGrid(bytes);
  const absl::Status status = core::ValidateSolidMesh(mesh.View(), mesh.Parts(), 2, core::RunContext()).status();
  if (status.ok()) {
    fuzz::Compare(mesh, bytes);
    return 0;
  }
  fuzz::Require(absl::IsFailedPrecondition(status) || absl::IsInvalidArgument(status),
                "a fault is a FAILED_PRECONDITION:", status.ToString());
  return 0;
}
