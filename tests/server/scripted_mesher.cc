#include "tests/server/scripted_mesher.h"

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

class FakeSessionMesher final : public core::Mesher {
 public:
  // `mesh` null: that of MakeFakeMesh.
  FakeSessionMesher(core::MeshParameters parameters, std::span<const double> points, PhaseScript script,
                    std::shared_ptr<const core::Mesh> mesh = nullptr)
      : parameters_(std::move(parameters)),
        points_(points.begin(), points.end()),
        script_(std::move(script)),
        mesh_(std::move(mesh)) {}

  int dimension() const override { return parameters_.dimension; }
  uint64_t vertex_count() const override {
    return mesh_ != nullptr ? mesh_->vertex_count() : MakeFakeMesh(parameters_, points_).vertex_count();
  }
  uint64_t memory_bytes() const override { return points_.size() * sizeof(double); }
  absl::Status Refine(const core::MeshParameters&, core::RunContext& context) override {
    return Enter(core::Phase::kRefinement, context);
  }
  absl::StatusOr<std::vector<uint32_t>> AddPointsNear(std::span<const double> points, std::span<const uint32_t>,
                                                      core::RunContext& context) override {
    WELLSPACE_RETURN_IF_ERROR(Enter(core::Phase::kTree, context));
    points_.insert(points_.end(), points.begin(), points.end());
    return std::vector<uint32_t>(points.size() / dimension());
  }
  absl::StatusOr<uint32_t> AddVertex(uint32_t near, std::span<const double>) override { return near; }
  absl::StatusOr<std::vector<double>> NearestNeighborDistances(std::span<const uint32_t> vertices) const override {
    return std::vector<double>(vertices.size(), 1.0);
  }
  absl::StatusOr<std::vector<core::Cell>> ClippedCells(std::span<const uint32_t> vertices, double) const override {
    return std::vector<core::Cell>(vertices.size());
  }
  absl::StatusOr<core::Mesh> Extract(int, core::RunContext& context) override {
    WELLSPACE_RETURN_IF_ERROR(Enter(core::Phase::kSimplices, context));
    context.EnterPhase(core::Phase::kDone);
    return mesh_ != nullptr ? *mesh_ : MakeFakeMesh(parameters_, points_);
  }
  absl::Status Update(core::Mesh& mesh, int threads, core::RunContext& context,
                      std::optional<core::MovedRows>* /*simplices*/) override {
    WELLSPACE_ASSIGN_OR_RETURN(mesh, Extract(threads, context));
    return absl::OkStatus();
  }
  absl::StatusOr<core::MeshEstimate> Estimate(const core::MeshParameters&, const core::RunContext&) const override {
    return core::MeshEstimate{};
  }

 private:
  absl::Status Enter(core::Phase phase, core::RunContext& context) {
    context.EnterPhase(phase);
    return script_(phase, context);
  }

  const core::MeshParameters parameters_;
  std::vector<double> points_;
  const PhaseScript script_;
  const std::shared_ptr<const core::Mesh> mesh_;
};

}  // namespace

MesherFactory ScriptedMesher(PhaseScript script) {
  return [script = std::move(script)](const core::MeshParameters& parameters, const core::Input& input,
                                      core::RunContext& context) -> absl::StatusOr<std::unique_ptr<core::Mesher>> {
    context.EnterPhase(core::Phase::kTree);
    WELLSPACE_RETURN_IF_ERROR(script(core::Phase::kTree, context));
    return std::make_unique<FakeSessionMesher>(parameters, input.points, script);
  };
}

MesherFactory FixedMesher(core::Mesh mesh) {
  return [shared = std::make_shared<const core::Mesh>(std::move(mesh))](const core::MeshParameters& parameters,
                                                                        const core::Input& input, core::RunContext&) {
    const auto script = [](core::Phase, core::RunContext& context) { return context.Check(); };
    return absl::StatusOr<std::unique_ptr<core::Mesher>>(
        std::make_unique<FakeSessionMesher>(parameters, input.points, script, shared));
  };
}

PhaseScript EndlessIn(core::Phase phase, std::function<void()> begun) {
  return [phase, begun = std::move(begun)](core::Phase entered, core::RunContext& context) {
    if (entered == phase) {
      begun();
      while (!context.IsCancelled()) {
        std::this_thread::sleep_for(std::chrono::microseconds(100));  // as often as the core looks
      }
    }
    return context.Check();
  };
}

core::Mesh MakeLargeMesh(uint64_t simplex_count) {
  core::Mesh mesh;
  mesh.dimension = 3;
  mesh.domain_low = {0, 0, 0};
  mesh.domain_high = {1, 1, 1};
  mesh.points.resize(simplex_count / 6 * 3);
  for (size_t i = 0; i < mesh.points.size(); ++i) {
    mesh.points[i] = static_cast<double>(i) / static_cast<double>(mesh.points.size());
  }
  mesh.simplices.resize(simplex_count * 4);
  for (size_t i = 0; i < mesh.simplices.size(); ++i) {
    mesh.simplices[i] = static_cast<uint32_t>(i * 2'654'435'761u) % static_cast<uint32_t>(mesh.vertex_count());
  }
  mesh.statistics.vertices = mesh.vertex_count();
  mesh.statistics.simplices = simplex_count;
  return mesh;
}

}  // namespace wellspace::server
