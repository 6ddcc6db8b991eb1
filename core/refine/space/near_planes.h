// On which side of the planes of triangles nearby the nodes of a cell are: a filter for edges that cross no triangle.
#ifndef WELLSPACE_CORE_REFINE_SPACE_NEAR_PLANES_H_
#define WELLSPACE_CORE_REFINE_SPACE_NEAR_PLANES_H_

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"
#include "core/tree/surface_index.h"

namespace wellspace::core {

// The planes of the triangles near a cell. A side is noted only where doubles leave no doubt of it.
//
// Thread safety: thread-compatible.
class NearPlanes {
 public:
  // So many triangles at most are worth their planes where all edges of a cell are looked at, and where few are.
  static constexpr size_t kMostForAll = 256;
  static constexpr size_t kMostForFew = 64;

  // Takes the triangles near `box`, which the node `from` of the index holds. False if they are more than `most`.
  //
  // Complexity: that of FindFewNear.
  bool Take(const SurfaceIndex& index, const Box<3>& box, IndexNode from, size_t most) {
    sides_.clear();
    planes_.clear();
    apart_.clear();
    if (!index.FindFewNear(box, most, triangles_, from)) {
      return false;
    }
    double size = 0;
    for (int axis = 0; axis < 3; ++axis) {
      size = std::max({size, std::abs(box.low[axis]), std::abs(box.high[axis])});
    }
    for (const uint32_t t : triangles_) {
      const Triangle triangle = index.TriangleAt(t);
      const Point<3> normal = NormalOf(triangle);
      double reach = size;
      for (const Point<3>& corner : triangle) {
        for (const double x : corner) {
          reach = std::max(reach, std::abs(x));
        }
      }
      // The normal of a needle is off by more than its own length says: by the product of its sides.
      const double sides = std::sqrt(DistanceSq<3>(triangle[0], triangle[1]) * DistanceSq<3>(triangle[0], triangle[2]));
      const double doubt =
          kRounding * reach * (std::abs(normal[0]) + std::abs(normal[1]) + std::abs(normal[2]) + sides);
      planes_.push_back({normal, triangle[0], doubt});
    }
    words_ = (planes_.size() + kBits - 1) / kBits;
    return true;
  }

  bool IsEmpty() const { return triangles_.empty(); }
  std::span<const uint32_t> triangles() const { return triangles_; }

  // Notes the sides of the next point.
  void Add(const Point<3>& p) {
    for (size_t first = 0; first < planes_.size(); first += kBits) {
      Sides sides;
      const size_t count = std::min(kBits, planes_.size() - first);
      for (size_t i = 0; i < count; ++i) {
        const PlaneOfTriangle& plane = planes_[first + i];
        const double distance = Dot<3>(plane.normal, Difference<3>(p, plane.at));
        sides.above |= uint64_t{distance > plane.doubt} << i;
        sides.below |= uint64_t{distance < -plane.doubt} << i;
      }
      sides_.push_back(sides);
    }
  }

  // The triangles that the segment between two of these points may cross, ascending; valid until the next call.
  std::span<const uint32_t> Between(size_t i, size_t j) {
    between_.clear();
    for (size_t word = 0; word < words_; ++word) {
      AppendAllBut(word, CommonOf(word, i, j));
    }
    return between_;
  }

  // The triangles that the hull of all points may meet, ascending: they are not surely on one side of the plane. Valid
  // until the next call.
  std::span<const uint32_t> AmidAll() {
    between_.clear();
    for (size_t word = 0; word < words_; ++word) {
      Sides all{~uint64_t{0}, ~uint64_t{0}};
      for (size_t at = word; at < sides_.size(); at += words_) {
        all.above &= sides_[at].above;
        all.below &= sides_[at].below;
      }
      AppendAllBut(word, all.above | all.below);
    }
    return between_;
  }

  // The first of the points before point i that no triangle parts from it; i if there is none.
  //
  // REQUIRES:   it is asked for each point in turn.
  size_t FirstBeside(size_t i) {
    for (const size_t j : apart_) {
      size_t word = 0;
      while (word < words_ && CommonOf(word, i, j) == AllOf(word)) {
        ++word;
      }
      if (word == words_) {
        return j;
      }
    }
    apart_.push_back(i);
    return i;
  }

 private:
  static constexpr size_t kBits = 64;
  static constexpr double kRounding = 0x1p-46;

  struct PlaneOfTriangle {
    Point<3> normal{};  // not normalized
    Point<3> at{};
    double doubt = 0;
  };

  // The sides of a point, a bit for each of kBits triangles.
  struct Sides {
    uint64_t above = 0;
    uint64_t below = 0;
  };

  // Of the triangles of a word, those on one side of which both points surely are.
  uint64_t CommonOf(size_t word, size_t i, size_t j) const {
    const Sides& one = sides_[i * words_ + word];
    const Sides& other = sides_[j * words_ + word];
    return (one.above & other.above) | (one.below & other.below);
  }
  // The bits of all triangles of a word.
  uint64_t AllOf(size_t word) const {
    const size_t count = std::min(kBits, planes_.size() - word * kBits);
    return count == kBits ? ~uint64_t{0} : (uint64_t{1} << count) - 1;
  }
  // Appends the triangles of a word but these.
  void AppendAllBut(size_t word, uint64_t these) {
    for (uint64_t left = ~these & AllOf(word); left != 0; left &= left - 1) {
      between_.push_back(triangles_[word * kBits + static_cast<size_t>(std::countr_zero(left))]);
    }
  }

  std::vector<uint32_t> triangles_;
  std::vector<PlaneOfTriangle> planes_;  // by triangle
  size_t words_ = 0;                     // of kBits triangles each
  std::vector<Sides> sides_;             // by point and word
  std::vector<uint32_t> between_;
  std::vector<size_t> apart_;  // points of which each is the first of those beside it
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_NEAR_PLANES_H_
