// The mesher of a domain in the plane: points, segments and faces.
#ifndef WELLSPACE_CORE_DOMAIN_MESHER_H_
#define WELLSPACE_CORE_DOMAIN_MESHER_H_

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/domain.h"
#include "core/domain_cloud.h"
#include "core/feasibility.h"
#include "core/features/features.h"
#include "core/geometry/box.h"
#include "core/mesher.h"
#include "core/mesher_figures.h"
#include "core/point_adder.h"
#include "core/point_placer.h"
#include "core/refine/plane/planar_domain.h"
#include "core/refine/plane/plane_domain.h"
#include "core/refine/refine.h"
#include "core/scaled_samples.h"
#include "core/simplex/domain_simplices.h"
#include "core/vertex_numbering.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// Mesher::Create for features. Points of the graph have the numbers in the mesh that they have there, among those that
// are meshed; vertices that are inserted or added have the same number inside as outside.
//
// Thread safety: as Mesher.
class DomainMesher final : public Mesher {
 public:
  // What Mesher::CreateInDomain does.
  absl::Status Initialize(const MeshParameters& parameters, std::span<const double> points, const Features& features,
                          RunContext& context);

  int dimension() const override { return 2; }
  uint64_t vertex_count() const override { return structure_.vertex_count(); }
  uint64_t memory_bytes() const override;
  absl::Status CheckFeasible(const MeshParameters& parameters) const override;
  absl::Status Refine(const MeshParameters& parameters, RunContext& context) override;
  absl::StatusOr<std::vector<uint32_t>> AddPointsNear(std::span<const double> points, std::span<const uint32_t> near,
                                                      RunContext& context) override;
  absl::StatusOr<uint32_t> AddVertex(uint32_t near, std::span<const double> point) override;
  absl::StatusOr<std::vector<double>> NearestNeighborDistances(std::span<const uint32_t> vertices) const override;
  absl::StatusOr<std::vector<Cell>> ClippedCells(std::span<const uint32_t> vertices, double beta) const override;
  absl::StatusOr<Mesh> Extract(int threads, RunContext& context) override;
  absl::Status Update(Mesh& mesh, int threads, RunContext& context) override;
  absl::StatusOr<MeshEstimate> Estimate(const MeshParameters& parameters, const RunContext& context) const override;

 private:
  // A subsegment: the part of a segment between two vertices that follow each other on it.
  struct Subsegment {
    uint32_t segment;
    VertexId from;
    VertexId to;
  };

  // What the last refinement has made.
  struct Made {
    PlanarDomain::Chains chains;
    DomainSimplices triangles;  // none once a mesh has taken them

    bool AreTrianglesTaken() const { return triangles.faces.empty(); }
  };

  absl::Status NumberPoints(const DomainCloud& made, std::span<const double> points, const RunContext& context);
  bool IsEncroached(const Subsegment& subsegment, Workspace<2>& workspace) const;
  absl::StatusOr<std::vector<Subsegment>> EncroachedSubsegments(const PlanarDomain::Chains& chains, int threads,
                                                                const RunContext& context) const;
  absl::Status Split(std::span<const Subsegment> subsegments, const MeshParameters& parameters,
                     const RunContext& context);
  absl::Status MakeConforming(const MeshParameters& parameters, RunContext& context);
  absl::StatusOr<std::vector<Subsegment>> MakeTriangles(PlanarDomain::Chains chains, int threads, RunContext& context);
  void NoteAddedFrom(uint32_t first);
  absl::Status SetOrigins(Mesh& mesh, const RunContext& context) const;
  absl::Status SetBoundary(Mesh& mesh, const RunContext& context) const;
  absl::Status SetRegions(Mesh& mesh, std::span<const uint32_t> faces_of, const RunContext& context) const;
  absl::StatusOr<uint64_t> CountExempt(const Mesh& mesh, const RunContext& context) const;
  void SetStatistics(Mesh& mesh, uint64_t exempt) const;

  Domain<2> domain_;
  Box<2> mesh_box_;           // of what is meshed, not scaled
  ScaledSamples<2> samples_;  // of the last parameters
  LargestArea least_area_;    // of the largest areas in faces that are meshed
  QueryStructure<2> structure_;
  std::unique_ptr<PlanarDomain> planar_;
  std::optional<Refinement<PlaneDomain>> refinement_;
  Workspace<2> workspace_;
  VertexNumbering<2> numbering_;
  std::optional<PointPlacer> placer_;
  std::optional<PointAdder<2>> adder_;
  uint64_t dropped_points_ = 0;
  std::optional<Made> made_;  // unless vertices have been added since
  double rho_ = 0;            // of the last refinement
  MesherFigures figures_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_DOMAIN_MESHER_H_
