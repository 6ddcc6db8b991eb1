// The repair of slivers, tetrahedra that are too flat: vertices move a little, and where that is not enough some are
// added.
#ifndef WELLSPACE_CORE_SLIVER_REPAIR_H_
#define WELLSPACE_CORE_SLIVER_REPAIR_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/refine/criteria.h"
#include "core/simplex/quality.h"
#include "core/sliver/ball_draws.h"
#include "core/sliver/known_cosines.h"
#include "core/sliver/left_sliver.h"
#include "core/sliver/tetrahedron.h"
#include "core/sliver/triangulation.h"
#include "core/sliver/vertex_carrier.h"

namespace wellspace::core {

struct RepairCriteria {
  MeshCriteria<3> criteria;  // that the mesh keeps, and has to go on keeping
  double min_dihedral = 0;   // degrees: a tetrahedron with a smaller dihedral angle is a sliver
  double min_edge = 0;       // no shorter edge is made
  uint64_t max_vertices = 0;
};

struct RepairReport {
  // The work that is spent, however hard slivers are. Default parameters take a twentieth of it.
  static constexpr uint64_t kMostOperations = 20'000;
  static constexpr uint64_t kFreeSlivers = 2'000;

  std::optional<double> min_angle_deg;  // of the meshed tetrahedra, before; for a carrier that does not mesh all
  uint64_t slivers = 0;                 // found
  uint64_t slivers_left = 0;            // that could not be repaired
  uint64_t moves = 0;                   // of vertices; one may move more than once
  uint64_t added = 0;                   // vertices
  uint64_t operations = 0;              // tetrahedra that were measured, or that a vertex was tested against
  uint64_t measured = 0;                // tetrahedra, to find the first slivers
  // Once Run has succeeded: slivers_left by SliverReason, and at most kMostNamedSlivers of them, flattest first.
  std::array<uint64_t, kSliverReasons> left_by{};
  std::vector<LeftSliver> flattest_left;
};

// Is told of every step, once the triangulation has taken it; of a star that has changed at some later time, but before
// Run returns.
class RepairObserver {
 public:
  virtual ~RepairObserver() = default;
  virtual void VertexMoved(VertexId v) = 0;
  // `near` is a neighbour of the new vertex.
  virtual void VertexAdded(VertexId v, VertexId near) = 0;
  // The simplices of `v` are others than when this was called before.
  virtual void StarChanged(VertexId v) = 0;
  // Memory held beside the triangulation. Unit: bytes.
  virtual uint64_t MemoryBytes() const = 0;
};

// Repairs the slivers of a Delaunay triangulation that keeps `criteria`, as far as it is meshed. The carrier says where
// vertices may go.
//
// Thread safety: thread-compatible.
// Invariants: after every step (1) the triangulation is that of Delaunay and keeps the criteria; (2) vertices that are
// fixed are where they were, others on their tracks; (3) of the meshed simplices that a step replaces and makes, the
// flattest is made better; (4) the carrier has accepted the step.
template <VertexCarrier Carrier>
class Repairer {
 public:
  // Shapes:     is_fixed: by vertex; true where it must not move. One entry is added for each vertex added.
  //             cosines: of the triangulation, as the last run left them, and told of what has come since.
  Repairer(Triangulation<3>& triangulation, Carrier& carrier, std::vector<bool>& is_fixed,
           const RepairCriteria& criteria, KnownCosines& cosines, RepairObserver& observer);

  // Repairs the slivers, and the new ones that this makes. Up to `threads` threads look for the first ones; one
  // thread repairs.
  //
  // Guarantees: (1) deterministic, and the same on any number of threads; (2) report().operations is at most
  //             RepairReport::kMostOperations times the slivers found and kFreeSlivers more, and once more the most for
  //             one sliver; (3) the report says of each sliver that is left why.
  // Complexity: O(1) expected for each sliver, and a measure of each simplex whose cosine is not known.
  // Errors:     RESOURCE_EXHAUSTED (max_vertices, memory of the context), CANCELLED, DEADLINE_EXCEEDED; the invariants
  //             hold all the same.
  // Source:     moves: Tournois, Srinivasan and Alliez 2009, with sampled in the place of followed gradients.
  absl::Status Run(int threads, RunContext& context);

  const RepairReport& report() const { return report_; }

 private:
  using Track = typename Carrier::Track;

  // A sliver by its number, and its vertices, for numbers are used again; and vertices move.
  struct Sliver {
    SimplexId simplex;
    std::array<VertexId, 4> vertices;
  };
  // Places that are tried between two looks at the context.
  static constexpr int kTriesPerCheck = 64;
  // How hard to try.
  struct Effort {
    int samples = 0;
    bool may_move_neighbours = false;
    bool may_insert = false;
    bool may_insert_poor = false;  // where the new vertex has slivers, though better ones
  };

  // A vertex that is to move.
  struct Mover {
    Point<3> from{};
    size_t star_size = 0;  // its simplices
    Track track{};         // that it stays on
    double reach = 0;      // how far it may go beside its way
    bool is_own = false;   // a vertex of the sliver
    Point<3> way{};        // to the circumcentre of the sliver, if it is none
    double flattest = 0;   // the largest cosine of the simplices that the move replaces
  };

  static Effort EffortOf(int pass, size_t left);
  absl::Status RunPasses(int threads, RunContext& context);
  absl::Status FindSlivers(int threads, const RunContext& context);
  bool HasWork() const {
    return report_.operations < RepairReport::kMostOperations * (report_.slivers + RepairReport::kFreeSlivers);
  }
  void ExplainLeft();
  SliverReason ReasonOf(const Sliver& sliver);
  Point<3> DrawInBall(const TetrahedronMeasure& measure, bool is_centre);
  bool IsThere(const Sliver& sliver) const;
  bool MayMove(VertexId v) const { return !is_fixed_[Index(v)] && carrier_.MayMove(v); }
  double CosineOf(SimplexId s) const { return cosines_.Of(s); }
  std::optional<double> Judge(const Simplex<3>& corners, const std::array<VertexId, 4>& vertices, VertexId moved,
                              double limit) const;
  bool IsAdmissible(const TetrahedronMeasure& measure, const std::array<VertexId, 4>& vertices, VertexId moved) const;
  bool HasShape(const TetrahedronMeasure& measure, double rho) const;
  std::optional<double> NewNearestSq(const Point<3>& p, VertexId moved) const;
  std::optional<double> TryFacet(const Cavity::Facet& facet, const Point<3>& p, VertexId v, double limit) const;
  bool FailsAtSuspect(const Point<3>& p, VertexId v, double limit);
  std::optional<double> TryAt(SimplexId from, const Point<3>& p, VertexId v, double limit);
  VertexId NeighbourIn(SimplexId s, VertexId v) const {
    const auto& vertices = triangulation_.item(s).vertices;
    return vertices[vertices[0] == v ? 1 : 0];
  }
  // Notes the smallest angle of the meshed tetrahedra, once all are measured; that of a mesh of all is known.
  void NoteSmallestAngle() {
    if constexpr (!Carrier::kMeshesAll) {
      const auto flattest = std::max_element(cosines_.all().begin(), cosines_.all().end());
      if (flattest != cosines_.all().end() && *flattest > kUncountedCosine) {
        const SimplexId s{static_cast<uint32_t>(flattest - cosines_.all().begin())};
        report_.min_angle_deg = Angles<3>(triangulation_.Corners(s)).min_deg;
      }
    }
  }
  // Whether place k may be tried: false if the run has been cancelled meanwhile, which RunPasses then says.
  bool MayTry(int k) const { return k % kTriesPerCheck != 0 || k == 0 || context_->Check().ok(); }
  bool Accepts(VertexId v, const Point<3>& p) {
    return carrier_.Accepts(triangulation_, {.vertex = v, .to = p, .cavity = cavity_, .hole = hole_});
  }
  void Note(std::span<const SimplexId> created);
  void ReportStars();

  bool MoveVertices(const Sliver& sliver, const Effort& effort);
  std::optional<Mover> StartOf(VertexId v, const Sliver& sliver);
  void OpenHole(VertexId v, size_t star_size);
  std::optional<Point<3>> DrawPlaceFor(const Mover& mover);
  std::vector<SimplexId>::const_iterator FirstInHole(const Point<3>& p) const;
  std::optional<double> TryInHole(VertexId v, const Point<3>& p, double limit);
  bool Move(VertexId v, const Sliver& sliver, int samples);
  absl::Status Insert(const Sliver& sliver, const Effort& effort);

  Triangulation<3>& triangulation_;
  Carrier& carrier_;
  std::vector<bool>& is_fixed_;
  const RepairCriteria criteria_;
  KnownCosines& cosines_;
  RepairObserver& observer_;
  const RunContext* context_ = nullptr;  // valid while it runs
  double flat_cosine_ = 0;               // above it an angle is too small
  RepairReport report_;
  HugeVector<double> nearest_sq_;  // at most the squared distance to the nearest neighbour; for well-spaced only
  HugeVector<Sliver> next_;        // to be looked at
  BallDraws draws_;

  // Scratch.
  Cavity cavity_;
  std::vector<Cavity::Facet> suspects_;  // for which TryAt has failed since Move or Insert began, the latest first
  std::vector<SimplexId> star_;
  std::vector<SimplexId> hole_;
  std::vector<double> hole_cosine_;  // by simplex of the hole
  std::vector<SimplexId> created_;
  std::vector<VertexId> changed_;  // vertices of new simplices, that have not been told of
  std::vector<bool> is_changed_;   // by vertex
  double edge_limit_sq_ = 0;       // of TryAt, under well-spaced: NewNearestSq once that is known, before no limit
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_REPAIR_H_
