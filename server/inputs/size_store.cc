#include "server/inputs/size_store.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

constexpr size_t kSamplesOfRecord = size_t{1} << 14;

// Checks sizes and measure of a chunk.
template <typename Chunk>
absl::Status CheckValues(const Chunk& chunk, uint64_t first, const std::string& name) {
  if (!v1::SizeMeasure_IsValid(chunk.measure())) {
    return MakeError(
        v1::ERROR_REASON_INVALID_SIZES,
        absl::StrCat("measure: ", static_cast<int>(chunk.measure()), " is not known; ",
                     static_cast<int>(v1::SIZE_MEASURE_CIRCUMRADIUS), " (circumradius) and ",
                     static_cast<int>(v1::SIZE_MEASURE_EDGE_LENGTH), " (edge length) are, and 0 for the default"),
        name + ".measure");
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

core::SizeMeasure MeasureOf(v1::SizeMeasure measure) {
  return measure == v1::SIZE_MEASURE_EDGE_LENGTH ? core::SizeMeasure::kEdgeLength : core::SizeMeasure::kCircumradius;
}

}  // namespace

absl::Status CheckSizes(const v1::SizeSamples& chunk, uint64_t first, int dimension, std::string_view field) {
  const std::string name(field);
  if (chunk.points_size() != chunk.sizes_size() * dimension) {
    return MakeError(
        v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
        absl::StrCat("the chunk of sizes after sample ", first, " has ", chunk.points_size(), " coordinates for ",
                     chunk.sizes_size(), " sizes; expected ", dimension, " for each, as parameters.dimension says"),
        name + ".points");
  }
  for (int i = 0; i < chunk.points_size(); ++i) {
    if (!std::isfinite(chunk.points(i))) {
      return MakeError(v1::ERROR_REASON_INVALID_SIZES,
                       absl::StrCat(name, ".points[", first + i / dimension, "]: coordinate ", i % dimension, " is ",
                                    chunk.points(i), "; a finite number is needed"),
                       name + ".points");
    }
  }
  return CheckValues(chunk, first, name);
}

absl::Status CheckSizes(const v1::VertexSizes& chunk, uint64_t first, std::string_view field) {
  return CheckValues(chunk, first, std::string(field));
}

StoredSizes RecordsOf(uint64_t number, std::shared_ptr<const core::SizeSamples> samples, int dimension) {
  StoredSizes stored{.number = number, .parts = {}};
  stored.in_turn.count = (samples->sizes.size() + kSamplesOfRecord - 1) / kSamplesOfRecord;
  stored.in_turn.bytes = samples->bytes();
  stored.in_turn.make = [samples = std::move(samples), dimension](size_t record) {
    const size_t begin = record * kSamplesOfRecord;
    const size_t end = std::min(samples->sizes.size(), begin + kSamplesOfRecord);
    store::v1::SizesRecord made;
    v1::SizeSamples& part = *made.mutable_samples();
    const double* points = samples->points.data();
    part.mutable_points()->Assign(points + begin * dimension, points + end * dimension);
    part.mutable_sizes()->Assign(samples->sizes.data() + begin, samples->sizes.data() + end);
    part.set_measure(samples->measure == core::SizeMeasure::kEdgeLength ? v1::SIZE_MEASURE_EDGE_LENGTH
                                                                        : v1::SIZE_MEASURE_CIRCUMRADIUS);
    return made;
  };
  return stored;
}

std::shared_ptr<const core::SizeSamples> SamplesOf(std::vector<store::v1::SizesRecord> records) {
  SizeStore store;
  for (store::v1::SizesRecord& record : records) {
    store.Append(record.mutable_samples());
  }
  return store.Take(core::RunContext());
}

void SizeStore::Append(v1::SizeSamples* chunk) {
  measure_ = MeasureOf(chunk->measure());
  points_.Append(chunk->mutable_points());
  sizes_.Append(chunk->mutable_sizes());
}

void SizeStore::Append(v1::VertexSizes* chunk) {
  measure_ = MeasureOf(chunk->measure());
  sizes_.Append(chunk->mutable_sizes());
}

std::shared_ptr<const core::SizeSamples> SizeStore::Take(const core::RunContext& context) {
  if (sizes_.count() == 0) {
    return nullptr;
  }
  core::SizeSamples samples;
  samples.points = vertices_.empty() ? points_.Flatten(context) : std::exchange(vertices_, {});
  samples.sizes = sizes_.Flatten(context);
  samples.measure = measure_;
  if (context.IsCancelled()) {
    return nullptr;
  }
  return std::make_shared<const core::SizeSamples>(std::move(samples));
}

}  // namespace wellspace::server
