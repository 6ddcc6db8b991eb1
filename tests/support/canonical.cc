#include "tests/support/canonical.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <numeric>

namespace wellspace::test {

CanonicalMesh Canonical(const core::Mesh& mesh) {
  const auto d = static_cast<size_t>(mesh.dimension);
  std::vector<std::vector<double>> points;
  for (size_t at = 0; at < mesh.points.size(); at += d) {
    points.emplace_back(mesh.points.begin() + static_cast<std::ptrdiff_t>(at),
                        mesh.points.begin() + static_cast<std::ptrdiff_t>(at + d));
  }
  std::vector<uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return points[a] < points[b]; });
  CanonicalMesh out;
  std::vector<uint32_t> place(points.size());
  for (uint32_t i = 0; i < order.size(); ++i) {
    place[order[i]] = i;
    out.points.push_back(points[order[i]]);
  }
  for (size_t at = 0; at < mesh.simplices.size(); at += d + 1) {
    std::vector<uint32_t> simplex;
    for (size_t k = 0; k <= d; ++k) {
      simplex.push_back(place[mesh.simplices[at + k]]);
    }
    std::sort(simplex.begin(), simplex.end());
    out.simplices.push_back(std::move(simplex));
  }
  std::sort(out.simplices.begin(), out.simplices.end());
  return out;
}

uint64_t Hash(const CanonicalMesh& mesh) {
  uint64_t hash = 0xcbf29ce484222325;
  const auto add = [&hash](uint64_t value) {
    for (int byte = 0; byte < 8; ++byte) {
      hash = (hash ^ ((value >> (8 * byte)) & 0xff)) * 0x100000001b3;
    }
  };
  for (const std::vector<double>& point : mesh.points) {
    for (const double x : point) {
      add(std::bit_cast<uint64_t>(x));
    }
  }
  for (const std::vector<uint32_t>& simplex : mesh.simplices) {
    for (const uint32_t vertex : simplex) {
      add(vertex);
    }
  }
  return hash;
}

}  // namespace wellspace::test
