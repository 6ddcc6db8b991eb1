// The numbers of vertices: those of the structure inside, those of the mesh outside.
#ifndef WELLSPACE_CORE_INPUT_VERTEX_NUMBERING_H_
#define WELLSPACE_CORE_INPUT_VERTEX_NUMBERING_H_

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/ids.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/input/frame.h"
#include "core/input/sorted_cloud.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// Refuses numbers that are no vertex of `count`.
//
// Errors:     OUT_OF_RANGE, naming the first.
absl::Status CheckVertices(std::span<const uint32_t> vertices, uint64_t count);

// Translates between the numbers of vertices in the structure, where input points are sorted, and those in the mesh,
// where they come in the order of the input; has the vertex of each input, and where inputs have negative zeros.
//
// Thread safety: thread-compatible: const functions may run at once.
// Invariants: (1) no number ever changes; (2) only the distinct points of Begin have other numbers outside than inside.
template <int D>
class VertexNumbering {
 public:
  // Takes the numbers of the first input, `points`. Of these, `stayed` became vertices as they are; it is empty where
  // no points were merged, and the first of equals did.
  //
  // With `images` the last so many of the points that have names are no inputs but images of inputs; their numbers come
  // after those of the corners of the box, of which `corners` have been added.
  //
  // REQUIRES:   no number has been asked for; images after all inputs.
  // Complexity: O(n).
  struct Images {
    size_t count = 0;
    uint32_t corners = 0;
  };
  void Begin(PointNames names, std::span<const double> points, std::span<const uint32_t> stayed,
             const Images& images = {0, 0});

  // Calls f(v, number) for the vertices that were added for images of Begin.
  template <typename F>
  void ForEachImage(F f) const {
    for (uint32_t number = first_image_; number < distinct_count_; ++number) {
      f(VertexOf(number), number);
    }
  }

  // Tells of vertex `v`, which has been added for input `index` of `points`.
  //
  // Complexity: O(1) amortized.
  void AddInputVertex(VertexId v, std::span<const double> points, size_t index);

  // Tells of the vertices, as the mesh numbers them, that further inputs have become.
  void AppendInputs(std::span<const uint32_t> vertices) {
    input_vertex_.insert(input_vertex_.end(), vertices.begin(), vertices.end());
  }

  // Counts inputs that have become vertices with other coordinates.
  void CountMerged(uint64_t count) { merged_inputs_ += count; }

  // Where vertices are left out: as of the last Extend.
  uint32_t OutputIndex(VertexId v) const {
    return Index(v) < distinct_count_ || (has_left_out_ && Index(v) < output_index_.size()) ? output_index_[Index(v)]
                                                                                            : Index(v);
  }

  // Complexity: O(1); the first call that asks for a distinct point of Begin takes O(n).
  VertexId VertexOf(uint32_t output_index) const;

  // The OutputIndex of each vertex below the count of the last Extend.
  std::span<const uint32_t> output_index() const { return output_index_; }
  void Extend(uint32_t vertex_count);

  // Extend, where vertices of the mesh come first: those for which is_left_out, by vertex, is false. They keep their
  // numbers; the others come after them, and have other numbers each time. Returns how many are in the mesh.
  //
  // REQUIRES:   is_left_out has vertex_count entries; its entry for a vertex never changes; it is false of the
  //             distinct points of Begin that inputs have become, whose numbers are the first.
  // Complexity: O(vertices).
  uint32_t ExtendBut(const std::vector<bool>& is_left_out);

  const HugeVector<uint32_t>& input_vertex() const { return input_vertex_; }  // by input, as the mesh numbers them
  uint64_t distinct_inputs() const { return distinct_inputs_; }               // vertices that were added for inputs
  uint64_t merged_inputs() const { return merged_inputs_; }

  // The coordinates of the vertices from number `first` on, as Mesh::points has them.
  //
  // REQUIRES:   `first` is 0, or at least the number of distinct points of Begin.
  // Complexity: O(vertices).
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::StatusOr<HugeVector<double>> PointsFrom(const QueryStructure<D>& structure, const Frame<D>& frame,
                                                uint64_t first, const RunContext& context) const;

  // With the table of VertexOf, whether it has been made or is being made.
  uint64_t MemoryBytes() const {
    return (output_index_.size() + distinct_count_ + input_vertex_.size()) * sizeof(uint32_t) +
           negative_zeros_.size() * sizeof(size_t);
  }

 private:
  void NoteNegativeZeros(std::span<const double> points, size_t index, uint32_t vertex);

  void NumberImages(size_t given, uint32_t corners);

  uint64_t distinct_count_ = 0;        // distinct points of Begin; where some are images, and the corners of the box
  uint64_t first_image_ = 0;           // number of the first image; distinct_count_ if there is none
  bool has_left_out_ = false;          // numbers are those of ExtendBut
  HugeVector<uint32_t> output_index_;  // by vertex; of the first distinct_count_ at least
  // By output index, of the first distinct_count_; made when one is first asked for.
  mutable HugeVector<VertexId> vertex_at_;
  mutable std::once_flag has_vertex_at_;
  HugeVector<uint32_t> input_vertex_;
  uint64_t distinct_inputs_ = 0;
  uint64_t merged_inputs_ = 0;
  std::vector<size_t> negative_zeros_;  // places in Mesh::points; the structure has no negative zeros
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_VERTEX_NUMBERING_H_
