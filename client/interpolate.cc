#include "client/interpolate.h"

#include <limits>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace wellspace::client {

absl::StatusOr<std::vector<double>> Interpolate(const Located& located, std::span<const double> values,
                                                const VertexValues& kind) {
  if (kind.revision.has_value() && *kind.revision != located.revision) {
    return absl::FailedPreconditionError(absl::StrCat("the values are of the mesh of revision ", *kind.revision,
                                                      ", and the points were located in that of revision ",
                                                      located.revision, "; locate them anew"));
  }
  if (kind.width == 0 || values.size() % kind.width != 0 || values.size() / kind.width != located.vertex_count) {
    return absl::InvalidArgumentError(absl::StrCat("there are ", values.size(), " values; expected ", kind.width,
                                                   " for each of the ", located.vertex_count,
                                                   " vertices of the mesh that the points were located in"));
  }
  const size_t count = located.simplices.size();
  const size_t corners = count == 0 ? 0 : located.vertices.size() / count;
  std::vector<double> found(count * kind.width, 0);
  for (size_t i = 0; i < count; ++i) {
    for (size_t k = 0; k < kind.width; ++k) {
      double& sum = found[i * kind.width + k];
      if (located.simplices[i] == kNoSimplex) {
        sum = std::numeric_limits<double>::quiet_NaN();
        continue;
      }
      for (size_t corner = i * corners; corner < (i + 1) * corners; ++corner) {
        sum += located.coordinates[corner] * values[located.vertices[corner] * kind.width + k];
      }
    }
  }
  return found;
}

}  // namespace wellspace::client
