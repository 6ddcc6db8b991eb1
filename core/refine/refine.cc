#include "core/refine/refine.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/refine/assessment.h"
#include "core/refine/schedule.h"
#include "core/refine/steiner_point.h"

namespace wellspace::core {
namespace {

// The ratio of one bucket's edges to those of the one before. The paper has 2; finer buckets make smaller meshes for
// more work.
constexpr double kBucketRatio = 1.4142135623730951;
// A cell is clipped at this times the longest edge of its bucket.
constexpr double kClipFactor = 4;
// The cell of a vertex just added is clipped at this times its empty radius: enough to see that most are good already,
// and no farther out than the region that bottom-up work has graded.
constexpr double kNewClipFactor = 1.5;

// Vertices looked at between two reports of progress.
constexpr uint64_t kReportInterval = 256;

template <int D>
class Refiner {
 public:
  Refiner(const RefinementParameters& parameters, QueryStructure<D>& structure, RunContext& context,
          const RefinementObserver<D>& observer)
      : parameters_(parameters),
        off_center_factor_(OffCenterFactor<D>(parameters.rho)),
        structure_(structure),
        context_(context),
        observer_(observer),
        schedule_(parameters.min_edge, kBucketRatio) {}

  absl::Status Run() {
    WELLSPACE_RETURN_IF_ERROR(ScheduleAll());
    VertexId v{};
    int bucket = 0;
    uint64_t improved = 0;
    while (schedule_.Pop(v, bucket)) {
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
      WELLSPACE_RETURN_IF_ERROR(Improve(v, bucket));
      if (++improved % kReportInterval == 0) {
        context_.SetBucket(bucket);
        context_.SetPhaseFraction(1 - static_cast<double>(schedule_.size()) / structure_.vertex_count());
      }
    }
    return absl::OkStatus();
  }

  void AddCounters(QueryCounters& counters) const {
    counters.Add(own_.counters);
    counters.Add(new_.counters);
  }

 private:
  absl::Status ScheduleAll() {
    radius_sq_.assign(structure_.vertex_count(), Assessment::kNone);
    Workspace<D> workspace;
    for (uint32_t i = 0; i < structure_.vertex_count(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
      const VertexId v{i};
      double length = std::sqrt(structure_.ApproximateNearestNeighbor(v, workspace).distance_sq);
      for (int face = 0; face < 2 * D; ++face) {
        if (((structure_.faces(v) >> face) & 1) == 0) {
          length = std::min(length, structure_.box().DistanceToFace(structure_.point(v), face));
        }
      }
      schedule_.Add(v, length);
    }
    return absl::OkStatus();
  }

  // Inserts Steiner points until nothing that bucket `bucket` may ask for is wrong with the cell of `v`.
  absl::Status Improve(VertexId v, int bucket) {
    const double edge_limit = schedule_.UpperLength(bucket);
    const double clip = kClipFactor * edge_limit;
    structure_.ClippedVoronoi(v, clip, own_);
    while (true) {
      const Assessment found = Assess<D>(own_.cell, structure_.faces(v), parameters_.rho, edge_limit * edge_limit);
      SteinerPoint<D> point;
      if (found.bad_node >= 0) {
        point = OffCenter<D>(own_.cell, found.bad_node, found.bad_plane, parameters_.rho, off_center_factor_);
      } else if (found.encroached_face >= 0) {
        point = EncroachmentPoint<D>(own_.cell, found.encroached_face);
      } else {
        Settle(v, found, clip, bucket + 1);
        return absl::OkStatus();
      }
      WELLSPACE_RETURN_IF_ERROR(Insert(v, SnapToBoundary<D>(structure_.box(), point)));
    }
  }

  // Declares a vertex that needs nothing now done, or puts it where it will be looked at again: not before bucket
  // `earliest`.
  void Settle(VertexId v, const Assessment& found, double clip, int earliest) {
    if (found.IsGood()) {
      radius_sq_[Index(v)] = found.radius_sq;
      return;
    }
    radius_sq_[Index(v)] = Assessment::kNone;
    double next = std::sqrt(found.next_edge_sq);
    if (found.is_clipped) {
      // Beyond the clip only edges longer than this can be bad, or ones that share a node with a shorter edge.
      next = std::min(next, clip / parameters_.rho);
    }
    schedule_.AddToBucket(v, std::max(schedule_.BucketOf(next), earliest));
  }

  absl::Status Insert(VertexId v, const SteinerPoint<D>& point) {
    if (structure_.vertex_count() >= parameters_.max_vertices) {
      return absl::ResourceExhaustedError(
          absl::StrCat("the mesh needs more than max_vertices = ", parameters_.max_vertices,
                       " vertices; raise max_vertices or rho"));
    }
    const double radius = std::sqrt(point.empty_radius_sq);
    if (!(radius >= parameters_.min_edge)) {
      return absl::ResourceExhaustedError(absl::StrCat("refinement came to an edge of length ", radius,
                                                       ", below the smallest that double arithmetic serves here, ",
                                                       parameters_.min_edge, "; raise rho = ", parameters_.rho));
    }
    const VertexId x = structure_.AddVertex(v, point.position);
    radius_sq_.push_back(Assessment::kNone);
    context_.SetVertices(structure_.vertex_count());
    own_.cell.Cut(x, point.position);
    LookAtNew(x, v, radius);
    if (observer_) {
      observer_(structure_);
    }
    return absl::OkStatus();
  }

  // Computes the cell of the new vertex `x`, and schedules it and its neighbours, but for `v`, where there may be
  // something to do.
  void LookAtNew(VertexId x, VertexId v, double radius) {
    const int bucket = schedule_.BucketOf(radius);
    const double edge_limit = schedule_.UpperLength(bucket);
    const double clip = kNewClipFactor * radius;
    structure_.ClippedVoronoi(x, clip, new_);
    const Assessment found = Assess<D>(new_.cell, structure_.faces(x), parameters_.rho, edge_limit * edge_limit);
    if (found.bad_node >= 0) {
      schedule_.Add(x, std::sqrt(2 * new_.cell.plane(found.bad_plane).offset));
    } else if (found.encroached_face >= 0) {
      schedule_.Add(x, radius);
    } else {
      Settle(x, found, clip, bucket);
    }
    for (const CellNode<D>& node : new_.cell.nodes()) {
      for (const uint16_t index : node.planes) {
        const Plane<D>& plane = new_.cell.plane(index);
        if (plane.kind != PlaneKind::kBisector || plane.vertex == v) {
          continue;
        }
        double& radius_sq = radius_sq_[Index(plane.vertex)];
        if (radius_sq > parameters_.rho * parameters_.rho * 2 * plane.offset) {
          radius_sq = Assessment::kNone;
          schedule_.Add(plane.vertex, plane.length);
        }
      }
    }
  }

  const RefinementParameters parameters_;
  const double off_center_factor_;
  QueryStructure<D>& structure_;
  RunContext& context_;
  const RefinementObserver<D>& observer_;
  Schedule schedule_;
  std::vector<double> radius_sq_;  // R(v)^2 where v is done, else infinite
  Workspace<D> own_;               // the cell that is improved
  Workspace<D> new_;               // the cell of the vertex just added
};

}  // namespace

template <int D>
absl::Status Refine(const RefinementParameters& parameters, QueryStructure<D>& structure, RunContext& context,
                    QueryCounters& counters, const RefinementObserver<D>& observer) {
  Refiner<D> refiner(parameters, structure, context, observer);
  absl::Status status = refiner.Run();
  refiner.AddCounters(counters);
  return status;
}

template absl::Status Refine<2>(const RefinementParameters&, QueryStructure<2>&, RunContext&, QueryCounters&,
                                const RefinementObserver<2>&);
template absl::Status Refine<3>(const RefinementParameters&, QueryStructure<3>&, RunContext&, QueryCounters&,
                                const RefinementObserver<3>&);

}  // namespace wellspace::core
