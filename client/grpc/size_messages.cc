#include "client/grpc/size_messages.h"

#include <algorithm>
#include <cstddef>

#include "client/grpc/grpc_connection.h"

namespace wellspace::client {

size_t FillSizes(const SizeSamples& samples, int dimension, size_t first, v1::SizeSamples& chunk) {
  const size_t row = std::max(1, dimension);
  const size_t count = samples.sizes.size();
  chunk.Clear();
  chunk.set_measure(samples.measure == SizeMeasure::kEdgeLength ? v1::SIZE_MEASURE_EDGE_LENGTH
                                                                : v1::SIZE_MEASURE_CIRCUMRADIUS);
  if (samples.points.size() != count * row) {
    chunk.mutable_points()->Assign(samples.points.begin(), samples.points.end());
    chunk.mutable_sizes()->Assign(samples.sizes.begin(), samples.sizes.end());
    return count;
  }
  const size_t end = std::min(count, first + RowsOfARequest(row + 1));
  chunk.mutable_points()->Assign(samples.points.begin() + static_cast<std::ptrdiff_t>(first * row),
                                 samples.points.begin() + static_cast<std::ptrdiff_t>(end * row));
  chunk.mutable_sizes()->Assign(samples.sizes.begin() + static_cast<std::ptrdiff_t>(first),
                                samples.sizes.begin() + static_cast<std::ptrdiff_t>(end));
  return end;
}

}  // namespace wellspace::client
