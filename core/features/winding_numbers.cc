#include "core/features/winding_numbers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>

#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {
namespace {

// The depth of a balanced tree over 2^32 triangles is smaller.
constexpr size_t kMostLevels = 64;

// The solid angle of a triangle as seen from `p`, by 4 pi: van Oosterom and Strackee, 1983.
double WindingOf(const Triangle& triangle, const Point<3>& p) {
  const Point<3> a = Difference<3>(triangle[0], p);
  const Point<3> b = Difference<3>(triangle[1], p);
  const Point<3> c = Difference<3>(triangle[2], p);
  const double la = std::sqrt(NormSq<3>(a));
  const double lb = std::sqrt(NormSq<3>(b));
  const double lc = std::sqrt(NormSq<3>(c));
  const double volume = Dot<3>(a, Cross(b, c));
  const double below = la * lb * lc + Dot<3>(a, b) * lc + Dot<3>(b, c) * la + Dot<3>(c, a) * lb;
  return std::atan2(volume, below) / (2 * std::numbers::pi);
}

// The share of the way from `a` to `b` at which a segment meets a triangle; negative if it misses it.
double CrossingOf(const Triangle& triangle, const Point<3>& a, const Point<3>& b) {
  const Point<3> way = Difference<3>(b, a);
  const Point<3> u = Difference<3>(triangle[1], triangle[0]);
  const Point<3> v = Difference<3>(triangle[2], triangle[0]);
  const Point<3> across = Cross(way, v);
  const double determinant = Dot<3>(u, across);
  if (determinant == 0) {
    return -1;
  }
  const Point<3> from = Difference<3>(a, triangle[0]);
  const double along_u = Dot<3>(from, across) / determinant;
  const Point<3> other = Cross(from, u);
  const double along_v = Dot<3>(way, other) / determinant;
  const double share = Dot<3>(v, other) / determinant;
  return along_u >= 0 && along_v >= 0 && along_u + along_v <= 1 && share >= 0 && share <= 1 ? share : -1;
}

}  // namespace

absl::Status WindingNumbers::Build(const SurfaceComplex& complex, const RunContext& context) {
  complex_ = &complex;
  const auto count = static_cast<uint32_t>(complex.triangles.size());
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0);
  middles_.resize(count);
  for (uint32_t t = 0; t < count; ++t) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context));
    middles_[t] = core::MiddleOf(complex.InOrderAt(t));
  }
  nodes_.clear();
  WELLSPACE_RETURN_IF_ERROR(BuildNode(0, count, context));
  middles_ = {};
  return absl::OkStatus();
}

absl::Status WindingNumbers::BuildNode(uint32_t begin, uint32_t end, const RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  const auto number = static_cast<uint32_t>(nodes_.size());
  nodes_.emplace_back();
  nodes_[number].begin = begin;
  nodes_[number].end = end;
  Describe(nodes_[number]);
  if (end - begin <= kLeafCapacity) {
    return absl::OkStatus();
  }
  const Box<3> box = nodes_[number].box;
  int axis = 0;
  for (int k = 1; k < 3; ++k) {
    axis = box.high[k] - box.low[k] > box.high[axis] - box.low[axis] ? k : axis;
  }
  const uint32_t half = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + half, order_.begin() + end, [&](uint32_t a, uint32_t b) {
    return std::tie(middles_[a][axis], a) < std::tie(middles_[b][axis], b);
  });
  WELLSPACE_RETURN_IF_ERROR(BuildNode(begin, half, context));
  nodes_[number].second = static_cast<uint32_t>(nodes_.size());
  return BuildNode(half, end, context);
}

void WindingNumbers::Describe(Node& node) const {
  double area = 0;
  for (uint32_t i = node.begin; i < node.end; ++i) {
    const Triangle triangle = complex_->TriangleAt(order_[i]);
    node.box = i == node.begin ? BoxOfTriangle(triangle) : node.box;
    node.box.Include(BoxOfTriangle(triangle));
    const Point<3> normal = NormalOf(triangle);
    const double own = 0.5 * std::sqrt(NormSq<3>(normal));
    area += own;
    for (int axis = 0; axis < 3; ++axis) {
      node.normal[axis] += 0.5 * normal[axis];
      node.middle[axis] += own * middles_[order_[i]][axis];
    }
  }
  for (double& x : node.middle) {
    x /= area;
  }
  for (uint32_t i = node.begin; i < node.end; ++i) {
    for (const Point<3>& corner : complex_->TriangleAt(order_[i])) {
      node.radius_sq = std::max(node.radius_sq, DistanceSq<3>(node.middle, corner));
    }
  }
}

double WindingNumbers::At(const Point<3>& p) const {
  const double sum = SumAt(p, kFar);
  return std::abs(std::abs(sum) - 0.5) < kUndecided ? SumAt(p, kFarther) : sum;
}

double WindingNumbers::SumAt(const Point<3>& p, double far) const {
  double sum = 0;
  std::array<uint32_t, kMostLevels> later;
  size_t count = 0;
  for (uint32_t i = 0;;) {
    const Node& node = nodes_[i];
    const Point<3> way = Difference<3>(node.middle, p);
    const double distance_sq = NormSq<3>(way);
    if (distance_sq > far * far * node.radius_sq) {
      sum += Dot<3>(node.normal, way) / (4 * std::numbers::pi * distance_sq * std::sqrt(distance_sq));
    } else if (node.second != 0) {
      later[count++] = node.second;
      ++i;
      continue;
    } else {
      for (uint32_t k = node.begin; k < node.end; ++k) {
        sum += WindingOf(complex_->TriangleAt(order_[k]), p);
      }
    }
    if (count == 0) {
      return sum;
    }
    i = later[--count];
  }
}

void WindingNumbers::FindCrossings(const Point<3>& a, const Point<3>& b, std::vector<double>& shares) const {
  shares.clear();
  Box<3> box{a, a};
  box.Include({b, b});
  std::array<uint32_t, kMostLevels> later;
  size_t count = 0;
  for (uint32_t i = 0;;) {
    const Node& node = nodes_[i];
    if (!AreApart(node.box, box)) {
      if (node.second != 0) {
        later[count++] = node.second;
        ++i;
        continue;
      }
      for (uint32_t k = node.begin; k < node.end; ++k) {
        const double share = CrossingOf(complex_->TriangleAt(order_[k]), a, b);
        if (share >= 0) {
          shares.push_back(share);
        }
      }
    }
    if (count == 0) {
      break;
    }
    i = later[--count];
  }
  std::sort(shares.begin(), shares.end());
}

}  // namespace wellspace::core
