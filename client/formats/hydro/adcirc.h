// ADCIRC's grids, fort.14; SCHISM's are the same: nodes with depths, triangles, strings of nodes along the boundary.
// Private to this folder and to the readers of domains.
#ifndef WELLSPACE_CLIENT_FORMATS_HYDRO_ADCIRC_H_
#define WELLSPACE_CLIENT_FORMATS_HYDRO_ADCIRC_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/io/line_reader.h"

namespace wellspace::formats {

// Types of boundaries with a normal flow, IBTYPE, that say nothing but which side of the grid they bound.
inline constexpr int32_t kAdcircMainland = 20;
inline constexpr int32_t kAdcircIsland = 21;

// The data of points of these formats beside their places.
inline constexpr char kDepth[] = "depth";          // downwards, of ADCIRC
inline constexpr char kElevation[] = "elevation";  // upwards, of .2dm

// Nodes along a boundary, one after the other.
struct AdcircBoundary {
  bool is_open = false;           // to the sea
  int32_t type = 0;               // IBTYPE, or IBTYPEE of an open one
  std::string comment;            // behind its numbers
  std::vector<uint32_t> nodes{};  // from 0
  std::vector<uint64_t> lines{};  // where each of them stands
};

struct AdcircGrid {
  std::vector<double> points;  // nodes x 2
  std::vector<double> depths;  // of nodes
  std::vector<uint32_t> triangles{};
  std::vector<AdcircBoundary> boundaries{};
  uint64_t barriers = 0;  // boundaries with a second row of nodes, which is not read
};

// The part of a grid that is read: its nodes, whatever follows; its boundaries, whatever the elements are; all.
enum class AdcircPart { kNodes, kBoundaries, kAll };

// Reads a grid. `skips_invalid`: coordinates may be not finite.
//
// Memory:     for the rows that there are, whatever the file announces.
// Errors:     of the reader; INVALID_ARGUMENT at a line.
absl::Status ReadAdcircGrid(LineReader& reader, AdcircPart part, bool skips_invalid, AdcircGrid& grid);

// The boundary closed, if it is an island's that is not.
std::vector<uint32_t> ClosedNodes(const AdcircBoundary& boundary);

// "island 21", "land 20", "open": the name of a boundary that has no other; and the type that such a name says, or
// `other`.
std::string AdcircName(const AdcircBoundary& boundary);
int32_t AdcircTypeOf(const std::string& name, int32_t other);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_HYDRO_ADCIRC_H_
