// Points that are added to a mesh that has been made: which vertices they become.
#ifndef WELLSPACE_CORE_MESHERS_POINT_ADDER_H_
#define WELLSPACE_CORE_MESHERS_POINT_ADDER_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/ids.h"
#include "core/base/run_context.h"
#include "core/geometry/periodic_box.h"
#include "core/geometry/point.h"
#include "core/input/frame.h"
#include "core/input/near_points.h"
#include "core/input/sorted_cloud.h"
#include "core/input/vertex_numbering.h"
#include "core/meshers/point_placer.h"
#include "core/refine/plane/plane_place.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// Parameters of adding points, beside the structure.
struct AdderOptions {
  double merge_distance = 0;  // points no farther than this from a vertex become that one
  // By vertex, whether it is given: set for those that points become; null: that is not asked for.
  std::vector<bool>* is_given = nullptr;
  // The axes along which the box is periodic, if all of it is meshed: a vertex on such a side is added with its images.
  std::span<const int> periodic_axes{};
  // The placer of a domain in the plane, of the same merge distance; null: all of the box is meshed.
  PointPlacer* placer = nullptr;
};

// Adds vertices at points, unless there is a vertex already, or one so near that the two are merged. In a domain of the
// plane they lie on its segments, or in faces that are meshed.
//
// Thread safety: thread-compatible.
template <int D>
class PointAdder {
 public:
  // `vertex_added` is called with each vertex that is added, once the structure has it: the refinement has to know.
  //
  // REQUIRES:   all that is handed in outlives this.
  PointAdder(const Frame<D>& frame, QueryStructure<D>& structure, std::function<void(VertexId)> vertex_added,
             VertexNumbering<D>& numbering, const AdderOptions& options)
      : frame_(frame),
        structure_(structure),
        vertex_added_(std::move(vertex_added)),
        numbering_(numbering),
        merge_distance_(options.merge_distance),
        is_given_(options.is_given),
        placer_(options.placer),
        periodic_(BoxOfImages(frame, options)) {}

  // Mesher::AddPointsNear.
  absl::StatusOr<std::vector<uint32_t>> AddPoints(std::span<const double> points, std::span<const uint32_t> near,
                                                  const RunContext& context);

  // Mesher::AddVertex.
  absl::StatusOr<uint32_t> AddVertex(uint32_t near, std::span<const double> point);

 private:
  // The result of merging the points that are added.
  struct Merged {
    std::vector<VertexId> vertex_of;  // by input: the vertex that it becomes, kNoVertex for the others
    MergedPoints others;              // `inputs` are numbers among all, `place_of` is by those that are others
  };

  static PeriodicBox<D> BoxOfImages(const Frame<D>& frame, const AdderOptions& options) {
    if constexpr (D == 2) {
      if (options.placer != nullptr) {
        return options.placer->images();
      }
    }
    return PeriodicBox<D>(frame.box, options.periodic_axes);
  }

  // Where the search for input `index` begins.
  VertexId Start(std::span<const uint32_t> near, size_t index) const {
    return near.empty() ? kNoVertex : numbering_.VertexOf(near[index]);
  }

  absl::Status CheckNear(std::span<const uint32_t> near, size_t points) const;
  absl::StatusOr<std::vector<PlanePlace>> FindPlaces(std::span<const double> points, std::span<const uint32_t> near,
                                                     const RunContext& context);
  absl::StatusOr<Merged> Merge(std::span<const double> points, std::span<const uint32_t> near,
                               const RunContext& context);
  VertexId FindMerged(const Point<D>& p, VertexId near, uint64_t& merged);
  absl::StatusOr<std::vector<VertexId>> FindAll(const SortedCloud<D>& cloud, const std::vector<bool>& is_image,
                                                std::span<const uint32_t> near, const RunContext& context);
  absl::StatusOr<VertexId> Find(const Point<D>& p, size_t index, VertexId near);
  VertexId Add(VertexId near, const Point<D>& p, std::span<const double> points, size_t index,
               const std::vector<PlanePlace>& places);
  void AddImage(const Point<D>& p, size_t index, const std::vector<PlanePlace>& places);
  void NoteGiven(VertexId v);

  const Frame<D>& frame_;
  QueryStructure<D>& structure_;
  const std::function<void(VertexId)> vertex_added_;
  VertexNumbering<D>& numbering_;
  const double merge_distance_;
  std::vector<bool>* const is_given_;
  PointPlacer* const placer_;
  const PeriodicBox<D> periodic_;
  Workspace<D> workspace_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_POINT_ADDER_H_
