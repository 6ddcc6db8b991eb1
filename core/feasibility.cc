#include "core/feasibility.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/estimate/least_vertices.h"
#include "core/estimate/mesh_size.h"

namespace wellspace::core {
namespace {

// Sides of a scaled box, and all lengths in it that doubles can tell apart, are within 2^120 of 1. Sizes, and boxes of
// sizes, farther out mean the same as these, and squares of them are neither 0 nor infinite.
constexpr double kFarBeyond = 0x1p400;

// No circumradius in a box is so many times an edge that doubles can tell from a point: a larger rho asks for no more.
constexpr double kMostRho = 0x1p60;

// What is said to fit is by a model that may be off by so much; above 3-D it is not calibrated.
template <int D>
constexpr double kModelError = D <= 3 ? 1.3 : 3;

// Vertices that a mesh has for each point and corner anyway, roughly.
constexpr double kVerticesPerPoint = 2.5;

// What is left beside that for the demands; where the points take nearly all, nothing is promised.
template <int D>
double VerticesLeft(uint64_t most, uint64_t vertices) {
  const auto budget = static_cast<double>(most);
  return std::max(budget - kVerticesPerPoint * static_cast<double>(vertices), budget / 4) / kModelError<D>;
}

double ScaledSize(double size, double scale) { return std::clamp(size * scale, 1 / kFarBeyond, kFarBeyond); }

// `x` with two digits, rounded up, as what is at least needed.
std::string RoundedUp(double x) {
  const double unit = std::pow(10, std::floor(std::log10(x)) - 1);
  return absl::StrFormat("%.2g", std::ceil(x / unit) * unit);
}

// What so many vertices take, evenly spread.
template <int D>
double MegabytesFor(double vertices) {
  const Leaves leaves{vertices / 4, vertices / 4};
  return BytesOf<D>(leaves, vertices, kSimplicesPerVertex<D> * vertices) / 1e6;
}

absl::Status WithPayload(absl::Status status) {
  status.SetPayload(absl::string_view(kDemandsTooFine.data(), kDemandsTooFine.size()), absl::Cord());
  return status;
}

// A number for a message, which may be past what doubles have.
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

// The size that asks for most.
template <int D>
std::string FinestSize(const MeshParameters& parameters, const SizeField<D>& sizes) {
  const auto finest = std::min_element(sizes.regions.begin(), sizes.regions.end(), [](const auto& a, const auto& b) {
    return a.max_circumradius < b.max_circumradius;
  });
  if (finest == sizes.regions.end() || finest->max_circumradius >= sizes.max_circumradius) {
    return absl::StrFormat("max_circumradius: %g", parameters.max_circumradius);
  }
  const auto index = static_cast<size_t>(finest - sizes.regions.begin());
  return absl::StrFormat("size_boxes[%d].max_circumradius: %g", index, parameters.size_boxes[index].max_circumradius);
}

// Refuses boxes of sizes that no simplex in them could keep, whose edges the arithmetic tells apart.
template <int D>
absl::Status CheckLeastSize(const Domain<D>& domain, const MeshParameters& parameters, const SizeField<D>& sizes) {
  const Box<D>& box = domain.scaled_box;
  for (size_t i = 0; i < sizes.regions.size(); ++i) {
    const auto& [region, size] = sizes.regions[i];
    if (2 * size < domain.MinEdge() && DistanceSq<D>(region, box) == 0) {
      return WithPayload(absl::ResourceExhaustedError(absl::StrFormat(
          "size_boxes[%d].max_circumradius: %g is too fine for the arithmetic of doubles in this domain; the smallest "
          "size that fits is about %s",
          i, parameters.size_boxes[i].max_circumradius, RoundedUp(8 * domain.MinEdge() / domain.scale))));
    }
  }
  return absl::OkStatus();
}

}  // namespace

template <int D>
MeshCriteria<D> CriteriaIn(const Domain<D>& domain, const MeshParameters& parameters) {
  MeshCriteria<D> criteria;
  criteria.criterion = parameters.criterion;
  criteria.rho = parameters.rho == 0 ? DefaultRho(D) : std::min(parameters.rho, kMostRho);
  if (parameters.max_circumradius != 0) {
    criteria.sizes.max_circumradius = ScaledSize(parameters.max_circumradius, domain.scale);
  }
  for (const SizeBox& size : parameters.size_boxes) {
    Box<D> box;
    for (int i = 0; i < D; ++i) {
      box.low[i] = std::clamp(size.low[i] * domain.scale + 0.0, -kFarBeyond, kFarBeyond);
      box.high[i] = std::clamp(size.high[i] * domain.scale + 0.0, -kFarBeyond, kFarBeyond);
    }
    criteria.sizes.regions.push_back({box, ScaledSize(size.max_circumradius, domain.scale)});
  }
  return criteria;
}

template <int D>
absl::Status CheckShapeFeasible(const Domain<D>& domain, const MeshParameters& parameters, uint64_t vertices) {
  const Box<D>& box = domain.scaled_box;
  const uint64_t most = VertexBudget(parameters);
  const double least = LeastVerticesForShape<D>(box, CriteriaIn<D>(domain, parameters).rho);
  if (least <= static_cast<double>(most)) {
    return absl::OkStatus();
  }
  int thin = 0;
  for (int i = 1; i < D; ++i) {
    thin = box.high[i] - box.low[i] < box.high[thin] - box.low[thin] ? i : thin;
  }
  const double side = SmallestSideFor<D>(box, VerticesLeft<D>(most, vertices));
  return TooFine<D>(absl::StrFormat("domain: a box that is only %g thick along axis %d, and %g long,",
                                    box.ShortestSide() / domain.scale, thin, box.LongestSide() / domain.scale),
                    TypicalVerticesForShape<D>(box), least, most,
                    absl::StrCat("the smallest thickness that fits is about ", RoundedUp(side / domain.scale),
                                 ": give a larger domain or margin"));
}

template <int D>
absl::Status CheckFeasible(const Domain<D>& domain, const MeshParameters& parameters, uint64_t vertices) {
  WELLSPACE_RETURN_IF_ERROR(CheckShapeFeasible<D>(domain, parameters, vertices));
  const Box<D>& box = domain.scaled_box;
  const uint64_t most = VertexBudget(parameters);
  const SizeField<D> sizes = CriteriaIn<D>(domain, parameters).sizes;
  WELLSPACE_RETURN_IF_ERROR(CheckLeastSize<D>(domain, parameters, sizes));
  const double least = LeastVerticesForSizes<D>(box, sizes);
  if (least <= static_cast<double>(most)) {
    return absl::OkStatus();
  }
  const double size = SmallestSizeFor<D>(box, sizes, VerticesLeft<D>(most, vertices));
  return TooFine<D>(FinestSize<D>(parameters, sizes), TypicalVerticesForSizes<D>(box, sizes), least, most,
                    absl::StrCat("the smallest size that fits is about ", RoundedUp(size / domain.scale)));
}

#define WELLSPACE_INSTANTIATE(D)                                                                  \
  template MeshCriteria<D> CriteriaIn<D>(const Domain<D>&, const MeshParameters&);                \
  template absl::Status CheckShapeFeasible<D>(const Domain<D>&, const MeshParameters&, uint64_t); \
  template absl::Status CheckFeasible<D>(const Domain<D>&, const MeshParameters&, uint64_t);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
