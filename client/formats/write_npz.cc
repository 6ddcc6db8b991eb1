// numpy's .npz: a mesh as two arrays, or three with weights.
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/npy.h"
#include "client/formats/npz.h"
#include "client/formats/output_file.h"
#include "client/formats/zip_file.h"

namespace wellspace::formats {
namespace {

class NpzWriter final : public MeshWriter {
 public:
  NpzWriter(OutputFile output, const MeshShape& shape) : shape_(shape), output_(std::move(output)), archive_(output_) {
    Begin(kNpzPoints, "<f8", shape_.vertex_count, shape_.dimension, sizeof(double));
  }

  absl::Status AddPoints(std::span<const double> points) override {
    Write(points);
    vertices_ += points.size() / shape_.dimension;
    return archive_.status();
  }

  absl::Status AddWeights(std::span<const double> weights) override {
    BeginWeights();
    Write(weights);
    weights_ += weights.size();
    return archive_.status();
  }

  absl::Status AddSimplices(std::span<const uint32_t> simplices) override {
    BeginSimplices();
    Write(simplices);
    simplices_ += simplices.size() / (shape_.dimension + 1);
    return archive_.status();
  }

  absl::Status Commit() override {
    BeginSimplices();
    if (absl::Status status = archive_.Finish(); !status.ok()) {
      return status;
    }
    if (absl::Status status = CheckComplete(shape_, vertices_, weights_, simplices_); !status.ok()) {
      return status;
    }
    return output_.Commit();
  }

 private:
  void Begin(const char* member, const char* type, uint64_t rows, std::optional<uint64_t> columns, size_t value_bytes) {
    const std::string preamble = NpyPreamble(type, rows, columns);
    archive_.Begin(member, preamble.size() + rows * columns.value_or(1) * value_bytes);
    archive_.Write(preamble);
  }

  void BeginWeights() {
    if (!std::exchange(has_weights_, true)) {
      Begin(kNpzWeights, "<f8", shape_.vertex_count, std::nullopt, sizeof(double));
    }
  }

  void BeginSimplices() {
    if (!std::exchange(has_simplices_, true)) {
      Begin(kNpzSimplices, "<u4", shape_.simplex_count, shape_.dimension + 1, sizeof(uint32_t));
    }
  }

  template <typename T>
  void Write(std::span<const T> values) {
    archive_.Write({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
  }

  const MeshShape shape_;
  OutputFile output_;
  ZipWriter archive_;
  bool has_weights_ = false;    // the member
  bool has_simplices_ = false;  // the member
  uint64_t vertices_ = 0;
  uint64_t weights_ = 0;
  uint64_t simplices_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateNpz(const std::string& path, const MeshShape& shape,
                                                      std::stop_token stop) {
  absl::StatusOr<OutputFile> output = OutputFile::Create(path, std::move(stop));
  if (!output.ok()) {
    return output.status();
  }
  if (!output->IsSeekable()) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot write ", path, ": npz is a zip archive, which needs a regular file"));
  }
  return std::make_unique<NpzWriter>(*std::move(output), shape);
}

}  // namespace wellspace::formats
