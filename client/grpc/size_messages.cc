#include "client/grpc/size_messages.h"

#include <algorithm>
#include <cstddef>

#include "client/grpc/grpc_connection.h"

namespace wellspace::client {

namespace {

v1::SizeMeasure MeasureToProto(SizeMeasure measure) {
  return measure == SizeMeasure::kEdgeLength ? v1::SIZE_MEASURE_EDGE_LENGTH : v1::SIZE_MEASURE_CIRCUMRADIUS;
}

}  // namespace

size_t FillSizes(const SizeSamples& samples, int dimension, size_t first, v1::SizeSamples& chunk) {
  const size_t row = std::max(1, dimension);
  const size_t count = samples.sizes.size();
  chunk.Clear();
  chunk.set_measure(MeasureToProto(samples.measure));
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

size_t FillSizes(const VertexSizes& sizes, size_t first, v1::VertexSizes& chunk) {
  const size_t end = std::min(sizes.sizes.size(), first + RowsOfARequest(1));
  if (sizes.mesh_revision.has_value()) {
    chunk.set_mesh_revision(*sizes.mesh_revision);
  }
  chunk.set_measure(MeasureToProto(sizes.measure));
  chunk.mutable_sizes()->Assign(sizes.sizes.begin() + static_cast<std::ptrdiff_t>(first),
                                sizes.sizes.begin() + static_cast<std::ptrdiff_t>(end));
  return end;
}

}  // namespace wellspace::client
