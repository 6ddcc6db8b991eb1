#include "core/input/vertex_numbering.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/geometry/point.h"

namespace wellspace::core {

absl::Status CheckVertices(std::span<const uint32_t> vertices, uint64_t count) {
  for (size_t i = 0; i < vertices.size(); ++i) {
    if (vertices[i] >= count) {
      return absl::OutOfRangeError(
          absl::StrCat("vertices[", i, "]: ", vertices[i], " is no vertex; there are ", count));
    }
  }
  return absl::OkStatus();
}

template <int D>
void VertexNumbering<D>::Begin(PointNames names, std::span<const double> points, std::span<const uint32_t> stayed,
                               const Images& images) {
  output_index_ = std::move(names.of_sorted);
  input_vertex_ = std::move(names.of_input);
  distinct_count_ = output_index_.size();
  distinct_inputs_ = distinct_count_;
  first_image_ = distinct_count_;
  if (images.count > 0) {
    NumberImages(input_vertex_.size() - images.count, images.corners);
  }
  for (const uint32_t input : stayed) {
    NoteNegativeZeros(points, input, input_vertex_[input]);
  }
  for (uint32_t i = 0, named = 0; stayed.empty() && i < input_vertex_.size(); ++i) {
    if (input_vertex_[i] == named) {  // and no duplicate of an earlier one
      NoteNegativeZeros(points, i, named++);
    }
  }
}

// Forgets the inputs from `given` on, and puts the numbers of their points behind those of the corners.
template <int D>
void VertexNumbering<D>::NumberImages(size_t given, uint32_t corners) {
  input_vertex_.resize(given);
  const auto last = std::max_element(input_vertex_.begin(), input_vertex_.end());
  distinct_inputs_ = uint64_t{*last} + 1;
  for (uint32_t& number : output_index_) {
    number += number >= distinct_inputs_ ? corners : 0;
  }
  for (uint32_t i = 0; i < corners; ++i) {
    output_index_.push_back(static_cast<uint32_t>(distinct_inputs_) + i);
  }
  distinct_count_ = output_index_.size();
  first_image_ = distinct_inputs_ + corners;
}

template <int D>
void VertexNumbering<D>::AddInputVertex(VertexId v, std::span<const double> points, size_t index) {
  ++distinct_inputs_;
  NoteNegativeZeros(points, index, OutputIndex(v));
}

template <int D>
VertexId VertexNumbering<D>::VertexOf(uint32_t output_index) const {
  if (has_left_out_) {
    return vertex_at_[output_index];
  }
  if (output_index >= distinct_count_) {
    return VertexId{output_index};
  }
  std::call_once(has_vertex_at_, [this] {
    vertex_at_.resize(distinct_count_);
    for (uint32_t i = 0; i < distinct_count_; ++i) {
      vertex_at_[output_index_[i]] = VertexId{i};
    }
  });
  return vertex_at_[output_index];
}

template <int D>
void VertexNumbering<D>::Extend(uint32_t vertex_count) {
  const auto old = static_cast<std::ptrdiff_t>(output_index_.size());
  output_index_.resize(vertex_count);
  std::iota(output_index_.begin() + old, output_index_.end(), static_cast<uint32_t>(old));
}

template <int D>
uint32_t VertexNumbering<D>::ExtendBut(const std::vector<bool>& is_left_out) {
  has_left_out_ = true;
  output_index_.resize(is_left_out.size());
  // The distinct points are sorted, and have their own order among themselves.
  std::vector<uint32_t> order(distinct_count_);
  std::iota(order.begin(), order.end(), uint32_t{0});
  std::sort(order.begin(), order.end(), [this](uint32_t a, uint32_t b) { return output_index_[a] < output_index_[b]; });
  uint32_t next = 0;
  for (const bool left_out : {false, true}) {
    for (uint32_t i = 0; i < is_left_out.size(); ++i) {
      const uint32_t v = i < distinct_count_ ? order[i] : i;
      if (is_left_out[v] == left_out) {
        output_index_[v] = next++;
      }
    }
  }
  vertex_at_.resize(is_left_out.size());
  for (uint32_t v = 0; v < is_left_out.size(); ++v) {
    vertex_at_[output_index_[v]] = VertexId{v};
  }
  return static_cast<uint32_t>(std::count(is_left_out.begin(), is_left_out.end(), false));
}

template <int D>
absl::StatusOr<HugeVector<double>> VertexNumbering<D>::PointsFrom(const QueryStructure<D>& structure,
                                                                  const Frame<D>& frame, uint64_t first,
                                                                  const RunContext& context) const {
  const uint32_t count = structure.vertex_count();
  const auto place_of = [&](uint32_t v) { return (OutputIndex(VertexId{v}) - first) * D; };
  HugeVector<double> out((count - first) * D);
  for (auto i = static_cast<uint32_t>(first); i < count; ++i) {
    if (i % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    if (count - i > kPointsAhead) {
      __builtin_prefetch(&out[place_of(i + kPointsAhead)], 1);
    }
    const Point<D> p = frame.Unscaled(structure.point(VertexId{i}));
    std::copy(p.begin(), p.end(), &out[place_of(i)]);
  }
  for (const size_t at : negative_zeros_) {
    // A point that was led onto a side of the box, or merged, is elsewhere.
    if (at >= first * D && out[at - first * D] == 0) {
      out[at - first * D] = -0.0;
    }
  }
  return out;
}

template <int D>
void VertexNumbering<D>::NoteNegativeZeros(std::span<const double> points, size_t index, uint32_t vertex) {
  for (int k = 0; k < D; ++k) {
    const double x = points[index * D + k];
    if (x == 0 && std::signbit(x)) {
      negative_zeros_.push_back(size_t{vertex} * D + k);
    }
  }
}

#define WELLSPACE_INSTANTIATE(D) template class VertexNumbering<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
