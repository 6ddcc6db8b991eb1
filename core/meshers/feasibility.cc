#include "core/meshers/feasibility.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/estimate/domain_shape.h"
#include "core/estimate/least_vertices.h"
#include "core/estimate/mesh_size.h"

namespace wellspace::core {
namespace {

// Sides of a scaled box, and all lengths in it that doubles can tell apart, are within 2^120 of 1. Boxes of sizes that
// reach farther mean the same as these.
constexpr double kFarBeyond = 0x1p400;

// No circumradius in a box is so many times an edge that doubles can tell from a point: a larger rho asks for no more.
constexpr double kMostRho = 0x1p60;

// The largest error, as a factor, of the model by which sizes are said to fit; above 3-D it is not calibrated.
template <int D>
constexpr double kModelError = D <= 3 ? 1.3 : 3;

// Vertices that a mesh has for each point and corner anyway, roughly.
constexpr double kVerticesPerPoint = 2.5;

// The vertices that are left for the demands; where the points take nearly all, nothing is promised.
template <int D>
double VerticesLeft(uint64_t most, uint64_t vertices) {
  const auto budget = static_cast<double>(most);
  return std::max(budget - kVerticesPerPoint * static_cast<double>(vertices), budget / 4) / kModelError<D>;
}

// `x` with two digits, rounded up: for the least that is needed.
std::string RoundedUp(double x) {
  const double unit = std::pow(10, std::floor(std::log10(x)) - 1);
  return absl::StrFormat("%.2g", std::ceil(x / unit) * unit);
}

// The memory of a mesh of so many vertices, evenly spread. Unit: megabytes.
template <int D>
double MegabytesFor(double vertices) {
  const Leaves leaves{vertices / 4, vertices / 4};
  return BytesOf<D>(leaves, vertices, kSimplicesPerVertex<D> * vertices) / 1e6;
}

absl::Status WithPayload(absl::Status status) {
  status.SetPayload(absl::string_view(kDemandsTooFine.data(), kDemandsTooFine.size()), absl::Cord());
  return status;
}

template <int D>
double RhoOf(const MeshParameters& parameters) {
  return parameters.rho == 0 ? DefaultRho(D) : std::min(parameters.rho, kMostRho);
}

// A number for a message, which may be past the range of doubles.
std::string AboutText(double number) {
  return std::isfinite(number) ? absl::StrFormat("%.2g", number) : "1e308 or more";
}

template <int D>
absl::Status TooFine(std::string_view what, double typical, double least, uint64_t most, std::string_view what_fits) {
  const double predicted = std::max(typical, least);
  return WithPayload(absl::ResourceExhaustedError(absl::StrFormat(
      "%s takes about %s vertices and %s MB, and at least %s vertices, more than max_vertices = %d; "
      "%s, or raise max_vertices",
      what, AboutText(predicted), AboutText(MegabytesFor<D>(predicted)), AboutText(least), most, what_fits)));
}

// The boxes of sizes, in their order.
template <int D>
std::vector<typename SizeField<D>::Region> ScaledRegions(const Frame<D>& frame, const MeshParameters& parameters) {
  std::vector<typename SizeField<D>::Region> regions;
  regions.reserve(parameters.size_boxes.size());
  for (const SizeBox& size : parameters.size_boxes) {
    Box<D> box;
    for (int i = 0; i < D; ++i) {
      box.low[i] = std::clamp(size.low[i] * frame.scale + 0.0, -kFarBeyond, kFarBeyond);
      box.high[i] = std::clamp(size.high[i] * frame.scale + 0.0, -kFarBeyond, kFarBeyond);
    }
    regions.push_back({box, ScaledSize(size.max_circumradius, frame.scale)});
  }
  return regions;
}

// The bound everywhere, not scaled, and infinite where there is none.
double BoundEverywhere(const MeshParameters& parameters) {
  double bound = std::numeric_limits<double>::infinity();
  if (parameters.max_circumradius != 0) {
    bound = parameters.max_circumradius;
  }
  if (parameters.edge_length != 0) {
    bound = std::min(bound, CircumradiusOf(parameters.edge_length, parameters.dimension));
  }
  return bound;
}

// The size that asks for most, and how many circumradii its unit is.
struct NamedSize {
  std::string name;
  double unit = 1;
  bool is_area = false;

  // A circumradius in the unit of its parameter.
  double Of(double circumradius) const {
    return is_area ? circumradius * circumradius / kRadiusSqOfArea : circumradius / unit;
  }
};

// `growth`: of sizes from samples, which may lie outside of the domain.
template <int D>
NamedSize FinestSize(const Frame<D>& frame, const MeshParameters& parameters, double growth, const LargestArea& area) {
  const double edge = CircumradiusOf(1, parameters.dimension);
  double finest = BoundEverywhere(parameters);
  NamedSize named{absl::StrFormat("max_circumradius: %g", parameters.max_circumradius)};
  if (finest != parameters.max_circumradius) {
    named = {absl::StrFormat("edge_length: %g", parameters.edge_length), edge};
  }
  if (const double size = std::sqrt(kRadiusSqOfArea * area.area); size < finest) {
    finest = size;
    named = {absl::StrFormat("seeds[%d].max_area: %g", area.seed, area.area), 1, true};
  }
  for (size_t i = 0; i < parameters.size_boxes.size(); ++i) {
    if (const double size = parameters.size_boxes[i].max_circumradius; size < finest) {
      finest = size;
      named = {absl::StrFormat("size_boxes[%d].max_circumradius: %g", i, size)};
    }
  }
  if (const SizeSamples* samples = parameters.size_samples.get(); samples != nullptr && !samples->sizes.empty()) {
    const double unit = samples->measure == SizeMeasure::kEdgeLength ? edge : 1;
    for (size_t i = 0; i < samples->sizes.size(); ++i) {
      if (unit * samples->sizes[i] >= finest) {
        continue;
      }
      const Point<D> p = frame.Scaled(PointAt<D>(samples->points, i));
      const double size =
          unit * samples->sizes[i] + growth * std::sqrt(DistanceSq<D>(p, frame.scaled_box)) / frame.scale;
      if (size < finest) {
        finest = size;
        named = {absl::StrFormat("size_samples.sizes[%d]: %g", i, samples->sizes[i]), unit};
      }
    }
  }
  return named;
}

template <int D>
absl::Status TooFineForDoubles(const Frame<D>& frame, std::string_view what, double least) {
  return WithPayload(absl::ResourceExhaustedError(absl::StrFormat(
      "%s is too fine for the arithmetic of doubles in this domain; the smallest size that fits is about %s", what,
      RoundedUp(8 * least / frame.scale))));
}

// Whether the domain surely has a point in common with `part`.
template <int D>
bool Meets(const Box<D>& box, const Box<D>& part) {
  return DistanceSq<D>(part, box) == 0;
}
template <int D>
bool Meets(const DomainShape& shape, const Box<2>& part) {
  return shape.Meets(part);
}

// The most samples too fine for doubles that are looked for in the domain: if none of these is there, none will be.
constexpr size_t kMostFineSamples = 16;

// Refuses sizes in boxes and at points that no simplex there could keep, whose edges the arithmetic tells apart.
template <int D, typename Shape>
absl::Status CheckLeastSize(const Shape& shape, const Frame<D>& frame, const MeshParameters& parameters,
                            const SizeField<D>& sizes) {
  const std::vector<typename SizeField<D>::Region> regions = ScaledRegions<D>(frame, parameters);
  for (size_t i = 0; i < regions.size(); ++i) {
    const auto& [region, size] = regions[i];
    if (2 * size < frame.MinEdge() && Meets<D>(shape, region)) {
      return TooFineForDoubles<D>(
          frame, absl::StrFormat("size_boxes[%d].max_circumradius: %g", i, parameters.size_boxes[i].max_circumradius),
          frame.MinEdge());
    }
  }
  // A simplex whose circumball has a sample with size H in it has R <= H + G R.
  const double least = frame.MinEdge() * (1 - sizes.growth().of_samples);
  const size_t samples = parameters.size_samples == nullptr ? 0 : parameters.size_samples->sizes.size();
  size_t looked_for = 0;
  for (size_t i = 0; i < samples && looked_for < kMostFineSamples; ++i) {
    const double size = parameters.size_samples->sizes[i];
    const double circumradius =
        parameters.size_samples->measure == SizeMeasure::kEdgeLength ? CircumradiusOf(size, D) : size;
    if (2 * ScaledSize(circumradius, frame.scale) >= least) {
      continue;
    }
    const Point<D> p = frame.Scaled(PointAt<D>(parameters.size_samples->points, i));
    ++looked_for;
    if (Meets<D>(shape, {p, p})) {
      return TooFineForDoubles<D>(frame, absl::StrFormat("size_samples.sizes[%d]: %g", i, size),
                                  least * size / circumradius);
    }
  }
  return absl::OkStatus();
}

template <int D, typename Shape>
absl::Status CheckSizesFeasible(const Shape& shape, const Frame<D>& frame, const MeshParameters& parameters,
                                const ScaledSamples<D>& samples, uint64_t vertices, const LargestArea& area) {
  const uint64_t most = VertexBudget(parameters);
  const SizeField<D> sizes = CriteriaIn<D>(frame, parameters, samples).sizes;
  WELLSPACE_RETURN_IF_ERROR((CheckLeastSize<D>(shape, frame, parameters, sizes)));
  const double least = LeastVerticesForSizes(shape, sizes);
  if (least <= static_cast<double>(most)) {
    return absl::OkStatus();
  }
  const double size = SmallestSizeFor(shape, sizes, VerticesLeft<D>(most, vertices));
  const NamedSize finest = FinestSize<D>(frame, parameters, sizes.growth().of_samples, area);
  return TooFine<D>(finest.name, TypicalVerticesForSizes(shape, sizes), least, most,
                    absl::StrCat("the smallest size that fits is about ", RoundedUp(finest.Of(size / frame.scale))));
}

}  // namespace

template <int D>
MeshCriteria<D> CriteriaIn(const Frame<D>& frame, const MeshParameters& parameters, const ScaledSamples<D>& samples) {
  const double bound = BoundEverywhere(parameters);
  typename SizeField<D>::Growth growth{.of_regions = 1, .of_samples = kDefaultSampleGradation};
  if (parameters.gradation != 0) {
    growth = {.of_regions = parameters.gradation, .of_samples = parameters.gradation};
  }
  return {.criterion = parameters.criterion,
          .rho = RhoOf<D>(parameters),
          .sizes = SizeField<D>(std::isfinite(bound) ? ScaledSize(bound, frame.scale) : bound,
                                ScaledRegions<D>(frame, parameters), samples.Of(frame, parameters), growth)};
}

template <int D>
absl::Status CheckShapeFeasible(const Frame<D>& frame, const MeshParameters& parameters, uint64_t vertices) {
  const Box<D>& box = frame.scaled_box;
  const uint64_t most = VertexBudget(parameters);
  const double least = LeastVerticesForShape<D>(box, RhoOf<D>(parameters));
  if (least <= static_cast<double>(most)) {
    return absl::OkStatus();
  }
  int thin = 0;
  for (int i = 1; i < D; ++i) {
    thin = box.high[i] - box.low[i] < box.high[thin] - box.low[thin] ? i : thin;
  }
  const double side = SmallestSideFor<D>(box, VerticesLeft<D>(most, vertices));
  return TooFine<D>(absl::StrFormat("domain: a box that is only %g thick along axis %d, and %g long,",
                                    box.ShortestSide() / frame.scale, thin, box.LongestSide() / frame.scale),
                    TypicalVerticesForShape<D>(box), least, most,
                    absl::StrCat("the smallest thickness that fits is about ", RoundedUp(side / frame.scale),
                                 ": give a larger domain or margin"));
}

template <int D>
absl::Status CheckFeasible(const Frame<D>& frame, const MeshParameters& parameters, const ScaledSamples<D>& samples,
                           uint64_t vertices) {
  WELLSPACE_RETURN_IF_ERROR(CheckShapeFeasible<D>(frame, parameters, vertices));
  return CheckSizesFeasible<D>(frame.scaled_box, frame, parameters, samples, vertices, LargestArea());
}

absl::Status CheckFeasible(const DomainShape& shape, const Frame<2>& frame, const MeshParameters& parameters,
                           const ScaledSamples<2>& samples, uint64_t vertices, const LargestArea& area) {
  return CheckSizesFeasible<2>(shape, frame, parameters, samples, vertices, area);
}

#define WELLSPACE_INSTANTIATE(D)                                                                           \
  template MeshCriteria<D> CriteriaIn<D>(const Frame<D>&, const MeshParameters&, const ScaledSamples<D>&); \
  template absl::Status CheckShapeFeasible<D>(const Frame<D>&, const MeshParameters&, uint64_t);           \
  template absl::Status CheckFeasible<D>(const Frame<D>&, const MeshParameters&, const ScaledSamples<D>&, uint64_t);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
