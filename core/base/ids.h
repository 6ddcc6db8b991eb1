// Index types that cannot be mixed up.
#ifndef WELLSPACE_CORE_BASE_IDS_H_
#define WELLSPACE_CORE_BASE_IDS_H_

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

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_IDS_H_
