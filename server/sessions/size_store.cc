#include "server/sessions/size_store.h"

#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/wire/errors.h"

namespace wellspace::server {

absl::Status CheckSizes(const v1::SizeSamples& chunk, uint64_t first, int dimension, std::string_view field) {
  const std::string name(field);
  if (chunk.points_size() != chunk.sizes_size() * dimension) {
    return MakeError(
        v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
        absl::StrCat("the chunk of sizes after sample ", first, " has ", chunk.points_size(), " coordinates for ",
                     chunk.sizes_size(), " sizes; expected ", dimension, " for each, as parameters.dimension says"),
        name + ".points");
  }
  if (!v1::SizeMeasure_IsValid(chunk.measure())) {
    return MakeError(
        v1::ERROR_REASON_INVALID_SIZES,
        absl::StrCat("measure: ", static_cast<int>(chunk.measure()), " is not known; ",
                     static_cast<int>(v1::SIZE_MEASURE_CIRCUMRADIUS), " (circumradius) and ",
                     static_cast<int>(v1::SIZE_MEASURE_EDGE_LENGTH), " (edge length) are, and 0 for the default"),
        name + ".measure");
  }
  for (int i = 0; i < chunk.points_size(); ++i) {
    if (!std::isfinite(chunk.points(i))) {
      return MakeError(v1::ERROR_REASON_INVALID_SIZES,
                       absl::StrCat(name, ".points[", first + i / dimension, "]: coordinate ", i % dimension, " is ",
                                    chunk.points(i), "; a finite number is needed"),
                       name + ".points");
    }
  }
  for (int i = 0; i < chunk.sizes_size(); ++i) {
    if (!(chunk.sizes(i) > 0 && std::isfinite(chunk.sizes(i)))) {
      return MakeError(
          v1::ERROR_REASON_INVALID_SIZES,
          absl::StrCat(name, ".sizes[", first + i, "]: ", chunk.sizes(i), " is not allowed; a number above 0 is"),
          name + ".sizes");
    }
  }
  return absl::OkStatus();
}

void SizeStore::Append(const v1::SizeSamples& chunk) {
  samples_.points.insert(samples_.points.end(), chunk.points().begin(), chunk.points().end());
  samples_.sizes.insert(samples_.sizes.end(), chunk.sizes().begin(), chunk.sizes().end());
  samples_.measure = chunk.measure() == v1::SIZE_MEASURE_EDGE_LENGTH ? core::SizeMeasure::kEdgeLength
                                                                     : core::SizeMeasure::kCircumradius;
}

std::shared_ptr<const core::SizeSamples> SizeStore::Take() {
  core::SizeSamples samples = std::exchange(samples_, {});
  return samples.sizes.empty() ? nullptr : std::make_shared<const core::SizeSamples>(std::move(samples));
}

}  // namespace wellspace::server
