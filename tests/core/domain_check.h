// The checks of a domain's mesh, for domains made by hand.
#ifndef WELLSPACE_TESTS_CORE_DOMAIN_CHECK_H_
#define WELLSPACE_TESTS_CORE_DOMAIN_CHECK_H_

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/mesh/mesh.h"
#include "core/validate/validate_domain.h"
#include "tests/core/domain_input.h"

namespace wellspace::test {

// A mesh of a domain, in which faults may be planted.
struct DomainMesh {
  std::vector<double> points;
  std::vector<uint32_t> simplices;
  std::vector<uint32_t> facets;
  std::vector<int32_t> tags;
  std::map<int32_t, std::string> tag_names;
  std::vector<int32_t> regions;
  std::map<int32_t, std::string> region_names;

  explicit DomainMesh(const core::Mesh& mesh)
      : points(mesh.points.begin(), mesh.points.end()),
        simplices(mesh.simplices.begin(), mesh.simplices.end()),
        facets(mesh.facets.begin(), mesh.facets.end()),
        regions(mesh.simplex_regions.begin(), mesh.simplex_regions.end()) {
    for (const core::BoundaryPart& part : mesh.boundary) {
      tags.insert(tags.end(), part.facets, part.tag);
      tag_names.emplace(part.tag, part.name);
    }
    for (const core::Region& region : mesh.regions) {
      region_names.emplace(region.id, region.name);
    }
    if (regions.empty()) {
      regions.assign(mesh.simplex_count(), mesh.regions.at(0).id);
    }
  }

  core::MeshView View() const { return {2, points, simplices}; }
  core::DomainParts Parts() const {
    return {.boundary = {.facets = facets, .tags = tags, .names = tag_names},
            .regions = regions,
            .region_names = region_names};
  }

  core::Point<2> CentreOf(size_t t) const {
    core::Point<2> centre{};
    for (int k = 0; k < 3; ++k) {
      for (int axis = 0; axis < 2; ++axis) {
        centre[axis] += points[2 * size_t{simplices[3 * t + k]} + axis] / 3;
      }
    }
    return centre;
  }

  // Takes out the triangles for which is_out(their centre) holds, and the facets that have none on either side left.
  template <typename IsOut>
  void TakeOut(const IsOut& is_out) {
    size_t kept = 0;
    for (size_t t = 0; t < regions.size(); ++t) {
      if (!is_out(CentreOf(t))) {
        std::copy_n(simplices.begin() + 3 * static_cast<std::ptrdiff_t>(t), 3,
                    simplices.begin() + 3 * static_cast<std::ptrdiff_t>(kept));
        regions[kept++] = regions[t];
      }
    }
    simplices.resize(3 * kept);
    regions.resize(kept);
    std::map<std::pair<uint32_t, uint32_t>, bool> has_left;
    for (size_t t = 0; t < kept; ++t) {
      for (int k = 0; k < 3; ++k) {
        has_left[{simplices[3 * t + k], simplices[3 * t + (k + 1) % 3]}] = true;
      }
    }
    kept = 0;
    for (size_t f = 0; f < tags.size(); ++f) {
      std::pair<uint32_t, uint32_t> ends = {facets[2 * f], facets[2 * f + 1]};
      if (!has_left.contains(ends)) {
        std::swap(ends.first, ends.second);
      }
      if (has_left.contains(ends)) {
        facets[2 * kept] = ends.first;
        facets[2 * kept + 1] = ends.second;
        tags[kept++] = tags[f];
      }
    }
    facets.resize(2 * kept);
    tags.resize(kept);
    DropUnused();
  }

 private:
  // Numbers anew the vertices that triangles have.
  void DropUnused() {
    std::map<uint32_t, uint32_t> number;
    std::vector<double> kept;
    for (const uint32_t v : std::set<uint32_t>(simplices.begin(), simplices.end())) {
      number.emplace(v, static_cast<uint32_t>(number.size()));
      kept.insert(kept.end(), {points[2 * size_t{v}], points[2 * size_t{v} + 1]});
    }
    points = std::move(kept);
    for (std::vector<uint32_t>* const numbers : {&simplices, &facets}) {
      for (uint32_t& v : *numbers) {
        v = number.at(v);
      }
    }
  }
};

// Checks the mesh by itself, and against its domain.
inline absl::Status CheckAgainst(const DomainInput& input, const DomainMesh& mesh, double rho = 0) {
  const core::RunContext context;
  if (absl::Status status = core::ValidateDomainMesh(mesh.View(), mesh.facets, rho, context).status(); !status.ok()) {
    return status;
  }
  double size = 0;
  for (const double x : input.points) {
    size = std::max(size, std::abs(x));
  }
  core::DomainView domain{.points = input.points, .features = input.features()};
  if (!input.parameters.domain_low.empty()) {
    domain.box = {core::PointAt<2>(input.parameters.domain_low, 0), core::PointAt<2>(input.parameters.domain_high, 0)};
  }
  domain.merge_distance = input.parameters.merge_distance;
  return core::ValidateConformity(mesh.View(), mesh.Parts(), domain, std::max(0x1p-40 * size, 2 * input.snap_distance),
                                  context);
}

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_CORE_DOMAIN_CHECK_H_
