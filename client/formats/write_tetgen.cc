// TetGen's and Triangle's .node and .ele.
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/number.h"
#include "client/formats/output_file.h"
#include "client/formats/registry.h"

namespace wellspace::formats {
namespace {

class NodeAndEleWriter final : public MeshWriter {
 public:
  NodeAndEleWriter(OutputFile nodes, OutputFile simplices, const MeshShape& shape)
      : shape_(shape), nodes_(std::move(nodes)), simplices_(std::move(simplices)) {
    nodes_.Write(absl::StrCat(shape.has_weights ? absl::StrCat("# ", kWeightsComment, "\n") : "", shape.vertex_count,
                              " ", shape.dimension, shape.has_weights ? " 1 0\n" : " 0 0\n"));
    simplices_.Write(absl::StrCat(shape.simplex_count, " ", shape.dimension + 1, " 0\n"));
  }

  // A weight is on the line of its point: points are kept until their weights come.
  absl::Status AddPoints(std::span<const double> points) override {
    if (!shape_.has_weights) {
      return WriteRows(points, {}, shape_.dimension, vertices_written_, nodes_);
    }
    points_.insert(points_.end(), points.begin(), points.end());
    return nodes_.status();
  }

  absl::Status AddWeights(std::span<const double> weights) override {
    const uint64_t first = vertices_written_ * shape_.dimension;
    const uint64_t count = weights.size() * shape_.dimension;
    if (first + count > points_.size()) {
      return absl::InternalError(absl::StrCat("a mesh got ", vertices_written_ + weights.size(), " weights and ",
                                              points_.size() / shape_.dimension, " points"));
    }
    return WriteRows(std::span<const double>(points_).subspan(first, count), weights, shape_.dimension,
                     vertices_written_, nodes_);
  }

  absl::Status AddSimplices(std::span<const uint32_t> simplices) override {
    return WriteRows(simplices, {}, shape_.dimension + 1, simplices_written_, simplices_);
  }

  absl::Status Commit() override {
    if (absl::Status status =
            CheckComplete(shape_, vertices_written_, shape_.has_weights ? vertices_written_ : 0, simplices_written_);
        !status.ok()) {
      return status;
    }
    // Neither file appears before both are written.
    for (OutputFile* output : {&nodes_, &simplices_}) {
      if (absl::Status status = output->Flush(); !status.ok()) {
        return status;
      }
    }
    if (absl::Status status = nodes_.Commit(); !status.ok()) {
      return status;
    }
    return simplices_.Commit();
  }

 private:
  // Rows with their numbers, from `written` on, each followed by one of `weights`, unless there are none.
  template <typename T>
  absl::Status WriteRows(std::span<const T> values, std::span<const double> weights, int width, uint64_t& written,
                         OutputFile& output) {
    for (; !values.empty() && output.status().ok(); values = values.subspan(width)) {
      line_.clear();
      AppendNumber(written++, line_);
      for (const T value : values.first(width)) {
        line_ += ' ';
        if constexpr (std::is_same_v<T, double>) {
          AppendNumber(value, line_);
        } else {
          AppendNumber(uint64_t{value}, line_);
        }
      }
      if (!weights.empty()) {
        line_ += ' ';
        AppendNumber(weights.front(), line_);
        weights = weights.subspan(1);
      }
      line_ += '\n';
      output.Write(line_);
    }
    return output.status();
  }

  const MeshShape shape_;
  OutputFile nodes_;
  OutputFile simplices_;
  uint64_t vertices_written_ = 0;
  uint64_t simplices_written_ = 0;
  std::vector<double> points_;  // with weights: all
  std::string line_;
};

}  // namespace

std::string WithExtension(const std::string& path, const std::string& extension) {
  return path.substr(0, path.size() - ExtensionOf(path).size()) + extension;
}

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateNodeAndEle(const std::string& path, const MeshShape& shape,
                                                             std::stop_token stop) {
  absl::StatusOr<OutputFile> nodes = OutputFile::Create(WithExtension(path, ".node"), stop);
  if (!nodes.ok()) {
    return nodes.status();
  }
  absl::StatusOr<OutputFile> simplices = OutputFile::Create(WithExtension(path, ".ele"), stop);
  if (!simplices.ok()) {
    return simplices.status();
  }
  return std::make_unique<NodeAndEleWriter>(*std::move(nodes), *std::move(simplices), shape);
}

}  // namespace wellspace::formats
