#include "core/sliver/worst_shapes.h"

#include <algorithm>
#include <cmath>

#include "core/base/status_macros.h"
#include "core/simplex/quality.h"
#include "core/sliver/tetrahedron.h"

namespace wellspace::core {
namespace {

// Two ways to compute the quality of a tetrahedron differ by less.
constexpr double kTolerance = 1e-9;

}  // namespace

void WorstShapes::Measures::Add(const Measures& other) {
  cosine = std::max(cosine, other.cosine);
  ratio_sq = std::max(ratio_sq, other.ratio_sq);
}

auto WorstShapes::MeasuresOf(const Simplex<3>& corners) -> Measures {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const TetrahedronMeasure measure = MeasureTetrahedron(corners);
  const double ratio_sq = measure.radius_sq / measure.edge_sq;
  // One that has no measure may be anything.
  return std::isnan(measure.cosine) || std::isnan(ratio_sq) ? Measures{kInfinity, kInfinity}
                                                            : Measures{measure.cosine, ratio_sq};
}

void WorstShapes::Clear(uint32_t limit) {
  blocks_.assign((size_t{limit} + kBlock - 1) / kBlock, {});
  groups_.assign((blocks_.size() + kGroup - 1) / kGroup, {});
}

void WorstShapes::Add(const Triangulation<3>& triangulation, SimplexId s) {
  const Measures measures = MeasuresOf(triangulation.Corners(s));
  blocks_[Index(s) / kBlock].Add(measures);
  groups_[Index(s) / (kBlock * kGroup)].Add(measures);
}

uint64_t WorstShapes::Update(const Triangulation<3>& triangulation, std::span<const uint32_t> changed) {
  blocks_.resize((size_t{triangulation.simplex_limit()} + kBlock - 1) / kBlock);
  groups_.resize((blocks_.size() + kGroup - 1) / kGroup);
  uint64_t measured = 0;
  for (size_t k = 0; k < changed.size(); ++k) {
    const size_t block = changed[k] / kBlock;
    if (k > 0 && changed[k - 1] / kBlock == block) {
      continue;
    }
    blocks_[block] = {};
    const uint32_t end = std::min<uint32_t>(triangulation.simplex_limit(), (block + 1) * kBlock);
    for (uint32_t i = block * kBlock; i < end; ++i) {
      if (triangulation.IsIn(SimplexId{i})) {
        blocks_[block].Add(MeasuresOf(triangulation.Corners(SimplexId{i})));
        ++measured;
      }
    }
  }
  for (size_t k = 0; k < changed.size(); ++k) {
    const size_t group = changed[k] / (kBlock * kGroup);
    if (k == 0 || changed[k - 1] / (kBlock * kGroup) != group) {
      SumUp(group);
    }
  }
  return measured;
}

void WorstShapes::SumUp(size_t group) {
  groups_[group] = {};
  const size_t end = std::min(blocks_.size(), (group + 1) * kGroup);
  for (size_t block = group * kGroup; block < end; ++block) {
    groups_[group].Add(blocks_[block]);
  }
}

auto WorstShapes::Find(const Triangulation<3>& triangulation, const RunContext& context) const
    -> absl::StatusOr<Worst> {
  // The largest that are finite: where one is not, more are looked at than need be.
  Measures largest;
  for (const Measures& group : groups_) {
    largest.cosine = std::isfinite(group.cosine) ? std::max(largest.cosine, group.cosine) : largest.cosine;
    largest.ratio_sq = std::isfinite(group.ratio_sq) ? std::max(largest.ratio_sq, group.ratio_sq) : largest.ratio_sq;
  }
  const auto may_be_worst = [&](const Measures& measures) {
    return measures.cosine >= largest.cosine - kTolerance || measures.ratio_sq >= largest.ratio_sq * (1 - kTolerance);
  };
  Worst worst;
  for (size_t block = 0; block < blocks_.size(); ++block) {
    if (block % kGroup == 0 && !may_be_worst(groups_[block / kGroup])) {
      block += kGroup - 1;
      continue;
    }
    if (!may_be_worst(blocks_[block])) {
      continue;
    }
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const uint32_t end = std::min<uint32_t>(triangulation.simplex_limit(), (block + 1) * kBlock);
    for (uint32_t i = block * kBlock; i < end; ++i) {
      if (!triangulation.IsIn(SimplexId{i})) {
        continue;
      }
      const Simplex<3> corners = triangulation.Corners(SimplexId{i});
      if (may_be_worst(MeasuresOf(corners))) {
        worst.max_radius_edge = std::max(worst.max_radius_edge, RadiusEdgeRatio<3>(corners));
        worst.min_angle_deg = std::min(worst.min_angle_deg, Angles<3>(corners).min_deg);
      }
    }
  }
  return worst;
}

}  // namespace wellspace::core
