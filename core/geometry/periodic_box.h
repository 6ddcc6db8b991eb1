// A box of which some pairs of opposite faces match: where the images of its points are.
#ifndef WELLSPACE_CORE_GEOMETRY_PERIODIC_BOX_H_
#define WELLSPACE_CORE_GEOMETRY_PERIODIC_BOX_H_

#include <array>
#include <span>

#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// A point on a face across a periodic axis has an image on the opposite face: the point with the other coordinate of
// that axis, and its own, to the bit, of all others. One that is on faces across several such axes has an image for
// each choice of some of them: three on an edge of the box, seven on a corner. The images of an image are the point and
// its other images.
//
// Thread safety: thread-safe.
template <int D>
class PeriodicBox {
 public:
  // None of the axes is periodic.
  PeriodicBox() = default;

  // REQUIRES:   axes from 0 to D - 1.
  PeriodicBox(const Box<D>& box, std::span<const int> axes) : box_(box) {
    for (const int axis : axes) {
      faces_ = static_cast<FaceMask>(faces_ | (3u << FaceIndex(axis, false)));
    }
  }

  bool HasAxes() const { return faces_ != 0; }
  // The faces across periodic axes.
  FaceMask faces() const { return faces_; }

  // Calls f(image) for each image of `p`, which is in the box, in an order that its faces decide.
  //
  // Complexity: O(D) and O(D) for each image.
  template <typename F>
  void ForEachImage(const Point<D>& p, F f) const {
    std::array<int, D> axes;
    int count = 0;
    for (int axis = 0; axis < D; ++axis) {
      const bool is_periodic = (faces_ >> FaceIndex(axis, false) & 1) != 0;
      if (is_periodic && (p[axis] == box_.low[axis] || p[axis] == box_.high[axis])) {
        axes[count++] = axis;
      }
    }
    for (int choice = 1; choice < 1 << count; ++choice) {
      Point<D> image = p;
      for (int i = 0; i < count; ++i) {
        if ((choice >> i & 1) != 0) {
          double& x = image[axes[i]];
          x = x == box_.low[axes[i]] ? box_.high[axes[i]] : box_.low[axes[i]];
        }
      }
      f(image);
    }
  }

 private:
  Box<D> box_{};
  FaceMask faces_ = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_PERIODIC_BOX_H_
