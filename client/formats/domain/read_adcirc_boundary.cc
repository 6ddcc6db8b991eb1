// The boundary of a grid of ADCIRC as a domain, to be meshed anew.
#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "client/formats/domain/domain_readers.h"
#include "client/formats/hydro/adcirc.h"
#include "client/formats/io/line_reader.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {

absl::Status ReadAdcircBoundary(InputFile& file, PlanarDomain& domain) {
  LineReader reader(std::move(file));
  AdcircGrid grid;
  WELLSPACE_RETURN_IF_ERROR(ReadAdcircGrid(reader, AdcircPart::kBoundaries, /*skips_invalid=*/false, grid));
  if (grid.boundaries.empty()) {
    return reader.Error(
        "the file ends without boundaries, which a domain is made of; without --segments it has points");
  }
  // Nodes of several boundaries are one point.
  constexpr uint32_t kNone = static_cast<uint32_t>(-1);
  std::vector<uint32_t> points(grid.points.size() / 2, kNone);
  int32_t marker = 0;
  for (const AdcircBoundary& boundary : grid.boundaries) {
    ++marker;
    const std::vector<uint32_t> nodes = ClosedNodes(boundary);
    for (size_t i = 0; i < nodes.size(); ++i) {
      uint32_t& point = points[nodes[i]];
      const uint64_t line = boundary.lines[std::min(i, boundary.lines.size() - 1)];
      if (point == kNone) {
        point = static_cast<uint32_t>(domain.point_count());
        domain.points.push_back(grid.points[2 * size_t{nodes[i]}]);
        domain.points.push_back(grid.points[2 * size_t{nodes[i]} + 1]);
        domain.point_lines.Add(line);
      }
      if (i > 0 && points[nodes[i - 1]] != point) {
        domain.segments.insert(domain.segments.end(), {points[nodes[i - 1]], point});
        domain.segment_lines.Add(line);
        domain.markers.push_back(marker);
      }
    }
  }
  domain.faces = PlanarDomain::FaceRule::kEvenOdd;
  return reader.Finish();
}

}  // namespace wellspace::formats
