// The nodes of a cell in space once it has been cut: where they are in doubles, and which is beside which.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/base/sort_few.h"
#include "core/cell/float_errors.h"
#include "core/cell/meeting_point.h"
#include "core/cell/polyhedron.h"

namespace wellspace::core {

void Polyhedron::Place() {
  if (!is_placed_) {
    PlaceWanted([](size_t) { return true; });
    FindNeighbours();
    is_placed_ = true;
  }
}

bool Polyhedron::PlaceUnlessKeeps(double ratio) {
  if (KeepsRatio(ratio)) {
    return true;
  }
  if (is_placed_) {
    return false;
  }
  PlaceWanted([this, ratio_sq = SurelyKeptRatioSq(ratio)](size_t i) {
    const Group& group = groups_[i / kGroupSize];
    const size_t lane = i % kGroupSize;
    const float x = group.x[0][lane];
    const float y = group.x[1][lane];
    const float z = group.x[2][lane];
    return !(x * x + (y * y + z * z) + kUnderflow <= ratio_sq * group.edge_sq[lane]);
  });
  return false;
}

// Fills nodes_, and places those that is_wanted(node) holds of by their planes, bisectors by vertex, then walls by
// face: so they do not depend on the order of the cuts.
template <typename IsWanted>
WELLSPACE_INLINE void Polyhedron::PlaceWantedWith(IsWanted is_wanted) {
  nodes_.resize(count_);
  placed_reach_ = 0;
  for (size_t first = 0; first < count_; first += kPlacedAtOnce) {
    // Lanes beyond the last node get that one.
    std::array<uint32_t, kPlacedAtOnce> nodes;
    bool is_any_wanted = false;
    for (size_t lane = 0; lane < kPlacedAtOnce; ++lane) {
      nodes[lane] = static_cast<uint32_t>(std::min(first + lane, count_ - 1));
      SortPlanes(nodes[lane]);
      is_any_wanted |= is_wanted(nodes[lane]);
    }
    uint32_t good = 0;
    if (is_any_wanted) {
      good = PlaceTogether(nodes);
    }
    for (size_t lane = 0; lane < kPlacedAtOnce; ++lane) {
      CellNode<3>& node = nodes_[nodes[lane]];
      if (!is_wanted(nodes[lane])) {
        KeepRoughPosition(nodes[lane]);
      } else if ((good >> lane & 1) == 0) [[unlikely]] {
        PlaceNode<3>(site_, planes_, node);
      }
      placed_reach_ = std::max(placed_reach_, node.reach);
    }
  }
}

template <typename IsWanted>
WELLSPACE_AVX2 void Polyhedron::PlaceWantedAvx2(IsWanted is_wanted) {
  PlaceWantedWith(is_wanted);
}

template <typename IsWanted>
void Polyhedron::PlaceWanted(IsWanted is_wanted) {
  if (unit_ == VectorUnit::kAvx2) {
    PlaceWantedAvx2(is_wanted);
  } else {
    PlaceWantedWith(is_wanted);
  }
}

// Sets the planes of a node of nodes_, in the order of PlaneOrderKey.
WELLSPACE_INLINE void Polyhedron::SortPlanes(size_t i) {
  const std::array<uint16_t, 3>& planes = triangles_[i].planes;
  std::array<uint64_t, 3> keys;
  for (int k = 0; k < 3; ++k) {
    keys[k] = PlaneOrderKey<3>(planes_, planes[k]);
  }
  SortFew(keys);
  nodes_[i].planes = {static_cast<uint16_t>(keys[0]), static_cast<uint16_t>(keys[1]), static_cast<uint16_t>(keys[2])};
}

// Places nodes as PlaceByPlanes does, but for those that are on walls alone or need exact arithmetic; a bit for each
// that is placed.
WELLSPACE_INLINE uint32_t Polyhedron::PlaceTogether(const std::array<uint32_t, kPlacedAtOnce>& nodes) {
  using Four = Wide<kPlacedAtOnce>::Lanes;
  SpacePlanes<kPlacedAtOnce> four{};
  for (int k = 0; k < 3; ++k) {
    std::array<uint16_t, kPlacedAtOnce> planes;
    for (size_t lane = 0; lane < kPlacedAtOnce; ++lane) {
      planes[lane] = nodes_[nodes[lane]].planes[k];
      four.length[k][lane] = planes_[planes[lane]].length;
      four.distance[k][lane] = planes_[planes[lane]].distance;
    }
    Four columns[4];
    TakeColumns(planes, columns);
    for (int axis = 0; axis < 3; ++axis) {
      four.normal[k][axis] = columns[axis];
    }
    four.offset[k] = columns[3];
  }
  SpacePlacements<kPlacedAtOnce> placed;
  MeetInSpace<kPlacedAtOnce>(four, placed);
  const Four slack = placed.error + kProductError * placed.radius;
  const Four reach = placed.radius + slack;
  const Four most_error = kPlacedError * placed.radius;
  uint32_t good = 0;
  for (size_t lane = 0; lane < kPlacedAtOnce; ++lane) {
    CellNode<3>& node = nodes_[nodes[lane]];
    node.x = {placed.x[0][lane], placed.x[1][lane], placed.x[2][lane]};
    node.radius_sq = placed.radius_sq[lane];
    node.slack = slack[lane];
    node.reach = reach[lane];
    const bool is_good = std::isfinite(placed.error[lane]) & (placed.error[lane] <= most_error[lane]);
    good |= (is_good & (planes_[node.planes[0]].kind == PlaneKind::kBisector) ? 1u : 0u) << lane;
  }
  return good;
}

// Leaves a node where it was while the cell was cut, in floats.
WELLSPACE_INLINE void Polyhedron::KeepRoughPosition(size_t i) {
  CellNode<3>& node = nodes_[i];
  node.x = PositionOf(i);
  for (double& coordinate : node.x) {
    coordinate *= unit_length_;
  }
  node.radius_sq = NormSq<3>(node.x);
  const double radius = std::sqrt(node.radius_sq);
  node.slack = kDistanceError<3> * radius;
  node.reach = radius + node.slack;
}

// Sets the neighbours of all nodes_: of two beside each other one has the edge between them the other way round.
void Polyhedron::FindNeighbours() {
  if (plane_count_ > kWordBits) {
    FindNeighboursAmongMany();
    return;
  }
  node_from_to_.resize(kWordBits * kWordBits);
  const auto node_from_to = [this](uint32_t from, uint32_t to) __attribute__((always_inline))->uint16_t& {
    return node_from_to_[from * kWordBits + to];
  };
  for (uint32_t i = 0; i < count_; ++i) {
    const std::array<uint16_t, 3>& planes = triangles_[i].planes;
    for (int k = 0; k < 3; ++k) {
      node_from_to(planes[k], planes[(k + 1) % 3]) = static_cast<uint16_t>(i);
    }
  }
  for (uint32_t i = 0; i < count_; ++i) {
    const std::array<uint16_t, 3>& planes = triangles_[i].planes;
    CellNode<3>& node = nodes_[i];
    for (int k = 0; k < 3; ++k) {
      // Beyond the edge that leaves planes[k].
      const uint16_t beyond = node_from_to(planes[(k + 2) % 3], planes[(k + 1) % 3]);
      const int place = (node.planes[1] == planes[k] ? 1 : 0) + (node.planes[2] == planes[k] ? 2 : 0);
      node.neighbours[place] = beyond;
    }
  }
}

[[gnu::noinline]] void Polyhedron::FindNeighboursAmongMany() {
  sorted_edges_.clear();
  for (uint32_t i = 0; i < count_; ++i) {
    for (uint32_t k = 0; k < 3; ++k) {
      const auto [low, high] = PlanesBut(nodes_[i].planes, k);
      sorted_edges_.push_back({low, high, 3 * i + k});
    }
  }
  std::sort(sorted_edges_.begin(), sorted_edges_.end());
  for (size_t e = 0; e + 1 < sorted_edges_.size(); e += 2) {
    JoinNodes(sorted_edges_[e][2], sorted_edges_[e + 1][2]);
  }
}

// The edge that leaves plane k runs along the other two.
std::array<uint32_t, 2> Polyhedron::PlanesBut(const std::array<uint16_t, 3>& planes, uint32_t k) {
  const uint32_t a = planes[k == 0 ? 1 : 0];
  const uint32_t b = planes[k == 2 ? 1 : 2];
  return {std::min(a, b), std::max(a, b)};
}

// Each is three times a node and the place of the plane that an edge leaves there.
void Polyhedron::JoinNodes(uint32_t a, uint32_t b) {
  nodes_[a / 3].neighbours[a % 3] = static_cast<uint16_t>(b / 3);
  nodes_[b / 3].neighbours[b % 3] = static_cast<uint16_t>(a / 3);
}

}  // namespace wellspace::core
