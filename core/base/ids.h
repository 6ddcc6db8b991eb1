// Index types that cannot be mixed up.
#ifndef WELLSPACE_CORE_BASE_IDS_H_
#define WELLSPACE_CORE_BASE_IDS_H_

#include <cstddef>
#include <cstdint>
#include <limits>

namespace wellspace::core {

// A vertex of the mesh under construction, in the order of insertion; the input points come first, in Morton order.
enum class VertexId : uint32_t {};
// A node of the 2^D-tree; a leaf where the tree says so.
enum class NodeId : uint32_t {};

inline constexpr VertexId kNoVertex{std::numeric_limits<uint32_t>::max()};
inline constexpr NodeId kNoNode{std::numeric_limits<uint32_t>::max()};

constexpr uint32_t Index(VertexId id) { return static_cast<uint32_t>(id); }
constexpr uint32_t Index(NodeId id) { return static_cast<uint32_t>(id); }

// Vertices side by side: the listed ones, or, if none are, the vertices from `first` on.
struct VertexNames {
  const VertexId* listed = nullptr;
  VertexId first = kNoVertex;

  VertexId operator[](size_t i) const {
    return listed != nullptr ? listed[i] : VertexId{static_cast<uint32_t>(Index(first) + i)};
  }
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_IDS_H_
