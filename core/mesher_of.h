// What the meshers of all kinds of domains have in common: every call of core/mesher.h, once.
#ifndef WELLSPACE_CORE_MESHER_OF_H_
#define WELLSPACE_CORE_MESHER_OF_H_

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/domain.h"
#include "core/feasibility.h"
#include "core/geometry/box.h"
#include "core/input.h"
#include "core/mesher.h"
#include "core/mesher_figures.h"
#include "core/point_adder.h"
#include "core/refine/criteria.h"
#include "core/refine/plane/planar_domain.h"
#include "core/refine/refine.h"
#include "core/scaled_samples.h"
#include "core/simplex/simplices.h"
#include "core/sorted_cloud.h"
#include "core/tree/segment_lists.h"
#include "core/vertex_numbering.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// The mesher of a domain. `Kind` is that of the refinement, BoxDomain<D> or PlaneDomain (core/refine/box_domain.h).
// BoxMesher and PlaneMesher say what their domain is made of, what it takes, and what it gives beside vertices and
// simplices, by the private functions: they stand in groups, by the calls that ask them.
//
// Thread safety: as Mesher.
template <typename Kind>
class MesherOf : public Mesher {
 public:
  static constexpr int D = Kind::kDimension;

  // What Create does, for parameters that are valid for this input, and of this dimension.
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
  absl::Status Update(Mesh& mesh, int threads, RunContext& context) final;
  absl::StatusOr<MeshEstimate> Estimate(const MeshParameters& parameters, const RunContext& context) const final;

 protected:
  // Simplices, and what is known of them beside their corners.
  struct Made {
    Simplices simplices;
    HugeVector<double> weights = {};  // by output index, in the structure's unit; empty where all are zero
    HugeVector<uint32_t> faces = {};  // by simplex: the face that it lies in; empty where there are none
  };

  // Builds the tree over the points of `cloud`, which has the rest then, and `segments`; refuses points that are too
  // close. `what` names the points, for the error that there are more than `parameters` allow vertices.
  //
  // Errors:     RESOURCE_EXHAUSTED; those of QueryStructure::Initialize and CheckSeparation.
  absl::Status BuildTree(const MeshParameters& parameters, const char* what, SortedCloud<D>& cloud,
                         std::vector<SegmentLists::Ends> segments, const RunContext& context);

  MeshCriteria<D> CriteriaOf(const MeshParameters& parameters) const {
    return CriteriaIn<D>(domain_, parameters, samples_);
  }

  Domain<D> domain_;
  Box<D> meshed_box_;         // of what is meshed, not scaled
  ScaledSamples<D> samples_;  // of the last parameters
  QueryStructure<D> structure_;
  std::optional<Refinement<Kind>> refinement_;
  VertexNumbering<D> numbering_;
  MesherFigures figures_;

 private:
  // Building.

  // Refuses spans of other lengths than each other's. Points are whole ones, and not too many.
  virtual absl::Status CheckInput(const Input& /*input*/) const { return absl::OkStatus(); }
  // What building takes beside the tree of the points. Unit: bytes.
  virtual uint64_t BuildingBytes(const MeshParameters& parameters, const Input& input) const = 0;
  // Cleans and sorts the points, builds the tree (BuildTree), numbers the vertices, and takes the samples: leaves
  // domain_, meshed_box_, structure_, numbering_ and samples_ as they are to be.
  virtual absl::Status Build(const MeshParameters& parameters, const Input& input, RunContext& context) = 0;
  // The domain that is refined, once it is built.
  virtual Kind ToRefine() = 0;
  // How points are added; see PointAdder.
  virtual AdderOptions Adding() = 0;

  // Asking.

  // What is held beside the structure, the refinement, the numbers and the samples. Unit: bytes.
  virtual uint64_t OtherBytes() const = 0;
  // Refuses demands that the domain can never meet, whatever is allowed.
  virtual absl::Status CheckDemands(const MeshParameters& /*parameters*/) const { return absl::OkStatus(); }
  virtual absl::Status CheckFeasibleHere(const MeshParameters& parameters) const = 0;
  virtual const PlanarDomain* planar() const { return nullptr; }
  virtual void AddToEstimate(const MeshParameters& /*parameters*/, MeshEstimate& /*estimate*/) const {}

  // Refining.

  // Whether a glance at the tree tells how many vertices there will be.
  virtual bool IsPredictable() const { return true; }
  // Forgets what is kept of the last refinement for the mesh: it will be another one.
  virtual void ForgetMade() {}
  // Looks at what a run of the refinement has left: false if vertices had to be added, so that it has to go on.
  virtual absl::StatusOr<bool> Conform(const MeshParameters& /*parameters*/, RunContext& /*context*/) { return true; }
  // Makes the refined mesh better, as far as that is asked for.
  virtual absl::Status Improve(const MeshParameters& /*parameters*/, RunContext& /*context*/) {
    return absl::OkStatus();
  }
  // Notes that vertex `first` and those after it have been added.
  virtual void NoteAddedFrom(uint32_t /*first*/) {}

  // Extracting.

  // Whether `mesh`, the last, has to be made anew, and cannot be changed where vertices have been added.
  virtual bool MakesAnew(const Mesh& mesh) const = 0;
  // Whether MakeSimplices does another stage's work, whose time is counted there.
  virtual bool MakesByStage() const { return false; }
  virtual absl::StatusOr<Made> MakeSimplices(int threads, RunContext& context) = 0;
  // Sets origins, boundary and regions of a mesh, of whose simplices `faces` are known.
  virtual absl::Status Describe(Mesh& mesh, std::span<const uint32_t> faces, int threads,
                                const RunContext& context) const = 0;
  // Notes that a mesh has been made of all vertices, and what of it has changed but by being added.
  virtual void NoteMade(Mesh& /*mesh*/) {}
  // Sets what statistics say of this kind of domain, of its inputs, and adds to the cost of simplices.
  virtual void AddStatistics(const Mesh& mesh, MeshStatistics& statistics, QueryCounters& stars) const = 0;

  absl::StatusOr<uint64_t> PredictVertices(const MeshCriteria<D>& criteria, const RunContext& context) const;
  void NoteAdded(uint32_t count_before);
  void UpdateQuality(const Simplices& added, bool worst_has_gone, Mesh& mesh) const;
  void Finish(Mesh& mesh);

  bool is_refined_ = false;
  std::optional<PointAdder<D>> adder_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHER_OF_H_
