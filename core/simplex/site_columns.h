// The vertices near a site in columns: which of them is the apex of a simplex beyond a facet?
#ifndef WELLSPACE_CORE_SIMPLEX_SITE_COLUMNS_H_
#define WELLSPACE_CORE_SIMPLEX_SITE_COLUMNS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include "core/geometry/point.h"
#include "core/simplex/facet_pencil.h"

namespace wellspace::core {

// Vectors from a site to vertices, their squared lengths and the vertices' places.
//
// Thread safety: thread-compatible. Reused: no allocation once warm.
template <int D>
class SiteColumns {
 public:
  static constexpr uint32_t kNone = ~uint32_t{0};

  void Clear() { count_ = 0; }
  // Makes room for so many more.
  void Reserve(size_t more) {
    if (places_.size() < count_ + more + kLanes) {
      for (auto& column : columns_) {
        column.resize(2 * (count_ + more + kLanes));
      }
      places_.resize(2 * (count_ + more + kLanes));
    }
  }
  // Appends (w, |w|^2). REQUIRES: there is room.
  void Append(uint32_t place, const std::array<double, D + 1>& entry) {
    for (int i = 0; i <= D; ++i) {
      columns_[i][count_] = entry[i];
    }
    places_[count_] = place;
    ++count_;
  }
  // To be called after the last one.
  void Finish() {
    Reserve(0);
    for (size_t i = count_; i < count_ + kLanes; ++i) {
      for (auto& column : columns_) {
        column[i] = std::numeric_limits<double>::quiet_NaN();
      }
    }
  }

  size_t size() const { return count_; }
  uint64_t MemoryBytes() const { return places_.capacity() * (sizeof(uint32_t) + (D + 1) * sizeof(double)); }
  uint32_t place(size_t i) const { return places_[i]; }

  // The first vertex that a ball of the pencil meets when its centre moves from far below the facet upwards, as far as rounding lets one
  // tell, of those that are more than `least` above the facet in units of the normal's length; kNone if there is none.
  uint32_t FindLowest(const FacetPencil<D>& pencil, double least) const {
    const Point<D>& normal = pencil.normal();
    const Point<D> twice_foot = pencil.TwiceFoot();
    Lanes lowest = std::numeric_limits<double>::infinity() + Lanes{};
    Lanes at = Lanes{} - 1;
    Lanes index = {0, 1};
    for (size_t i = 0; i < count_; i += kLanes) {
      Lanes height{};
      Lanes power = Load(D, i);
      for (int axis = 0; axis < D; ++axis) {
        const Lanes w = Load(axis, i);
        height += w * normal[axis];
        power -= w * twice_foot[axis];
      }
      const Lanes rise = power / height;
      const Mask is_lower = (rise < lowest) & (height > least);
      lowest = is_lower ? rise : lowest;
      at = is_lower ? index : at;
      index += kLanes;
    }
    const double first = lowest[1] < lowest[0] ? at[1] : at[0];
    return first < 0 ? kNone : static_cast<uint32_t>(first);
  }

  // How many powers to the ball, as computed, are below its doubt.
  size_t CountInside(const FacetBall<D>& ball) const {
    Mask count{};
    for (size_t i = 0; i < count_; i += kLanes) {
      count -= Powers(ball, i) < ball.doubt;
    }
    return static_cast<size_t>(count[0] + count[1]);
  }

  // The power of a vertex to the ball, as computed.
  double PowerOf(size_t i, const FacetBall<D>& ball) const { return Powers(ball, i)[0]; }

 private:
  static constexpr size_t kLanes = 2;
  using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
  using Mask = int64_t __attribute__((vector_size(kLanes * sizeof(double))));

  Lanes Load(int column, size_t i) const {
    Lanes lanes;
    std::memcpy(&lanes, columns_[column].data() + i, sizeof(lanes));
    return lanes;
  }
  Lanes Powers(const FacetBall<D>& ball, size_t i) const {
    Lanes power = Load(D, i);
    for (int axis = 0; axis < D; ++axis) {
      power -= Load(axis, i) * ball.twice_centre[axis];
    }
    return power;
  }
  size_t count_ = 0;
  std::array<std::vector<double>, D + 1> columns_;  // the last one: squared lengths
  std::vector<uint32_t> places_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_SITE_COLUMNS_H_
