// One part of a partitioned mesh, as files hold it beside a mesh of its own.
#ifndef WELLSPACE_CLIENT_FORMATS_MESH_PART_H_
#define WELLSPACE_CLIENT_FORMATS_MESH_PART_H_

#include <cstdint>
#include <span>
#include <string>

namespace wellspace::formats {

// The numbers of a part, whose vertices and simplices are first those that it owns, then ghosts: copies of others'. A
// part owns all of its facets.
struct PartNumbers {
  uint32_t part = 0;
  uint32_t parts = 1;
  uint64_t own_vertices = 0;
  uint64_t own_simplices = 0;
  uint64_t whole_simplices = 0;               // of the whole mesh; facets are numbered behind them where both are cells
  std::span<const uint32_t> vertex_ids{};     // by vertex: its number in the whole mesh; so the following
  std::span<const uint32_t> vertex_owners{};  // the part that owns it
  std::span<const uint32_t> vertex_rows{};    // its number where part after part is numbered, as solvers have rows
  std::span<const uint32_t> simplex_ids{};    // by simplex
  std::span<const uint32_t> simplex_owners{};
  std::span<const uint32_t> facet_ids{};  // by facet
};

// A mesh and its partition, of which one file holds all.
struct PartitionView {
  uint32_t parts = 1;
  std::span<const uint32_t> part_of{};       // by simplex
  std::span<const uint32_t> facet_owners{};  // by facet: the part that owns it
  // The simplices that are ghosts of a part, part after part; of part p from first_ghost[p] to first_ghost[p + 1].
  std::span<const uint32_t> ghosts{};
  std::span<const uint64_t> first_ghost{};
};

// "mesh_7.vtu" of "mesh.vtu" or "mesh.pvtu": the file of part 7, of `extension`.
std::string PartFileOf(const std::string& path, const std::string& extension, uint32_t part);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MESH_PART_H_
