// The common part of the meshers of all kinds of domains: every call of core/meshers/mesher.h, once.
#ifndef WELLSPACE_CORE_MESHERS_MESHER_OF_H_
#define WELLSPACE_CORE_MESHERS_MESHER_OF_H_

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/estimate/estimate.h"
#include "core/features/part_names.h"
#include "core/geometry/box.h"
#include "core/input/frame.h"
#include "core/input/input.h"
#include "core/input/scaled_samples.h"
#include "core/input/sorted_cloud.h"
#include "core/input/vertex_numbering.h"
#include "core/mesh/mesh_delta.h"
#include "core/meshers/feasibility.h"
#include "core/meshers/mesher.h"
#include "core/meshers/mesher_figures.h"
#include "core/meshers/point_adder.h"
#include "core/refine/criteria.h"
#include "core/refine/plane/planar_domain.h"
#include "core/refine/refine.h"
#include "core/simplex/row_edits.h"
#include "core/simplex/simplices.h"
#include "core/tree/segment_lists.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// The mesher of a domain. `Domain` is that of the refinement: BoxDomain<D> (core/refine/box_domain.h), PlaneDomain or
// SpaceDomain. BoxMesher, PlaneMesher and SpaceMesher have private functions for the making, the memory and the demands
// of their domain, and for its results beside vertices and simplices: in groups, by the calls that ask them.
//
// Thread safety: as Mesher.
template <typename Domain>
class MesherOf : public Mesher {
 public:
  static constexpr int D = Domain::kDimension;

  // The work of Create, for parameters that are valid for this input, and of this dimension.
  absl::Status Initialize(const MeshParameters& parameters, const Input& input, RunContext& context);

  int dimension() const final { return D; }
  uint64_t vertex_count() const final { return structure_.vertex_count(); }
  uint64_t memory_bytes() const final;
  absl::Status CheckFeasible(const MeshParameters& parameters) const final;
  absl::Status Refine(const MeshParameters& parameters, RunContext& context) final;
  absl::StatusOr<std::vector<uint32_t>> AddPointsNear(std::span<const double> points, std::span<const uint32_t> near,
                                                      RunContext& context) final;
  absl::StatusOr<uint32_t> AddVertex(uint32_t near, std::span<const double> point) final;
  absl::StatusOr<std::vector<double>> NearestNeighborDistances(std::span<const uint32_t> vertices) const final;
  absl::StatusOr<std::vector<Cell>> ClippedCells(std::span<const uint32_t> vertices, double beta) const final;
  absl::StatusOr<Mesh> Extract(int threads, RunContext& context) final;
  absl::Status Update(Mesh& mesh, int threads, RunContext& context, std::optional<MovedRows>* simplices) final;
  absl::StatusOr<MeshEstimate> Estimate(const MeshParameters& parameters, const RunContext& context) const final {
    return EstimateFor(parameters, /*is_to_reserve=*/false, context);
  }
  absl::StatusOr<MeshEstimate> EstimateToReserve(const MeshParameters& parameters,
                                                 const RunContext& context) const final {
    return EstimateFor(parameters, /*is_to_reserve=*/true, context);
  }

 protected:
  // Simplices, with their weights and faces.
  struct Made {
    Simplices simplices;
    HugeVector<double> weights = {};  // by output index, in the structure's unit; empty where all are zero
    HugeVector<uint32_t> faces = {};  // by simplex: the face that it lies in; empty where there are none
  };

  // The changes of a mesh since it was made.
  struct Changes {
    SimplexChanges simplices;
    HugeVector<double> points = {};  // of the vertices that have been added
    bool has_labels = false;         // whether the mesh has inputs, origins and boundary; else they are made anew
  };

  // Builds the tree over the points of `cloud`, which has the rest then, and `segments`; refuses points that are too
  // close. `what` names the points, for the error that there are more than `parameters` allow vertices.
  //
  // Errors:     RESOURCE_EXHAUSTED; those of QueryStructure::Initialize and CheckSeparation.
  absl::Status BuildTree(const MeshParameters& parameters, const char* what, SortedCloud<D>& cloud,
                         std::vector<SegmentLists::Ends> segments, const RunContext& context);

  MeshCriteria<D> CriteriaOf(const MeshParameters& parameters) const {
    return CriteriaIn<D>(frame_, parameters, samples_);
  }

  Frame<D> frame_;
  Box<D> meshed_box_;         // of the meshed part, not scaled
  ScaledSamples<D> samples_;  // of the last parameters
  QueryStructure<D> structure_;
  std::optional<Refinement<Domain>> refinement_;
  VertexNumbering<D> numbering_;
  MesherFigures figures_;
  PartNames names_;  // of the input

 private:
  // Building.

  // Refuses spans of other lengths than each other's. Points are whole ones, and not too many.
  virtual absl::Status CheckInput(const Input& /*input*/) const { return absl::OkStatus(); }
  // Memory of building, beside the tree of the points. Unit: bytes.
  virtual uint64_t BuildingBytes(const MeshParameters& parameters, const Input& input) const = 0;
  // Cleans and sorts the points, builds the tree (BuildTree), numbers the vertices, and takes the samples: leaves
  // frame_, meshed_box_, structure_, numbering_ and samples_ as they are to be.
  virtual absl::Status Build(const MeshParameters& parameters, const Input& input, RunContext& context) = 0;
  // The domain that is refined, once it is built.
  virtual Domain ToRefine() = 0;
  // How points are added; see PointAdder.
  virtual AdderOptions Adding() = 0;
  // Refuses points, where none can be added.
  virtual absl::Status CheckAdding() const { return absl::OkStatus(); }

  // Asking.

  // Memory held beside the structure, the refinement, the numbers and the samples. Unit: bytes.
  virtual uint64_t OtherBytes() const = 0;
  // Refuses demands that the domain can never meet, whatever is allowed.
  virtual absl::Status CheckDemands(const MeshParameters& /*parameters*/) const { return absl::OkStatus(); }
  virtual absl::Status CheckFeasibleHere(const MeshParameters& parameters) const = 0;
  // `parameters` with the sizes that the domain itself asks for beside the samples that are given.
  //
  // Errors:     RESOURCE_EXHAUSTED where these can never be met; CANCELLED, DEADLINE_EXCEEDED; those of the lender.
  virtual absl::StatusOr<MeshParameters> WithSizesOfDomain(const MeshParameters& parameters,
                                                           const RunContext& /*context*/) const {
    return parameters;
  }
  virtual const PlanarDomain* planar() const { return nullptr; }
  virtual absl::Status AddToEstimate(const MeshParameters& /*parameters*/, const MeshCriteria<D>& /*criteria*/,
                                     const RunContext& /*context*/, MeshEstimate& /*estimate*/) const {
    return absl::OkStatus();
  }

  // Refining.

  // Takes the demands on the domain beside criteria.
  virtual void TakeDemands(const MeshParameters& /*parameters*/) {}
  // The effort with which a first refinement predicts its vertices; none: it ends too soon to be worth that, or the
  // vertices cannot be told.
  virtual std::optional<EstimateEffort> PredictionEffort(const MeshCriteria<D>& criteria) const;
  // Adds the place, as far as it is known, to the error with which a run has ended.
  virtual absl::Status Explain(absl::Status status) const { return status; }
  // Forgets the results of the last refinement that are kept for the mesh: the next mesh will be another one.
  virtual void ForgetMade() {}
  // Checks the outcome of a run of the refinement: false if vertices had to be added, so that it has to go on.
  virtual absl::StatusOr<bool> Conform(const MeshParameters& /*parameters*/, RunContext& /*context*/) { return true; }
  // Makes the refined mesh better, as far as that is asked for.
  virtual absl::Status Improve(const MeshParameters& /*parameters*/, RunContext& /*context*/) {
    return absl::OkStatus();
  }
  // Notes that vertex `first` and those after it have been added.
  virtual void NoteAddedFrom(uint32_t /*first*/) {}

  // Extracting.

  // Numbers the vertices there are for the mesh.
  virtual void ExtendNumbers() { numbering_.Extend(structure_.vertex_count()); }
  // The changes that bring the simplices of `mesh`, the last, up to date; none where it has to be made anew. Once they
  // are found, they are made.
  virtual absl::StatusOr<std::optional<Changes>> FindChanges(const Mesh& /*mesh*/, int /*threads*/,
                                                             RunContext& /*context*/) {
    return std::nullopt;
  }
  // Whether MakeSimplices does another stage's work, whose time is counted there.
  virtual bool MakesByStage() const { return false; }
  virtual absl::StatusOr<Made> MakeSimplices(int threads, RunContext& context) = 0;
  // Sets origins, boundary and regions of a mesh, of whose simplices `faces` are known.
  virtual absl::Status Describe(Mesh& mesh, std::span<const uint32_t> faces, int threads,
                                const RunContext& context) = 0;
  // Notes that a mesh has been made of all vertices, and lists in it the vertices that have moved since the last one.
  virtual void NoteMade(Mesh& /*mesh*/) {}
  // Of a mesh whose simplices have been brought up to date, and to which vertices from number `old_vertices` on have
  // been added: moves those that have moved since the last one, and lists them; then brings labels up to date.
  virtual void MovePoints(Mesh& /*mesh*/) {}
  virtual void UpdateLabels(const SimplexChanges& /*changes*/, uint64_t /*old_vertices*/, Mesh& /*mesh*/) {}
  // Sets the statistics of this kind of domain and of its inputs, and adds to the cost of simplices.
  virtual void AddStatistics(const Mesh& mesh, MeshStatistics& statistics, QueryCounters& stars) const = 0;

  absl::StatusOr<MeshEstimate> EstimateFor(const MeshParameters& given, bool is_to_reserve,
                                           const RunContext& context) const;
  // The part that goes by the tree.
  absl::StatusOr<MeshEstimate> EstimateOfTree(const MeshCriteria<D>& criteria, bool is_to_reserve,
                                              const RunContext& context) const;
  absl::StatusOr<uint64_t> PredictVertices(const MeshCriteria<D>& criteria, const RunContext& context) const;
  void NoteAdded(uint32_t count_before);
  void UpdateQuality(const SimplexChanges& changes, Mesh& mesh) const;
  void Finish(Mesh& mesh);

  bool is_refined_ = false;
  std::optional<PointAdder<D>> adder_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_MESHER_OF_H_
