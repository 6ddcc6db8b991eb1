// The part of a triangle that lies in a cell, and the neighbours of the cell to which that part belongs without it.
#ifndef WELLSPACE_CORE_REFINE_SPACE_SURFACE_IN_CELL_H_
#define WELLSPACE_CORE_REFINE_SPACE_SURFACE_IN_CELL_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/ids.h"
#include "core/cell/polytope.h"
#include "core/geometry/point.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {

// The parts of triangles in the trial cell of a new vertex. A point in that cell has as its nearest vertex
// one of the neighbours of the cell: its owner. All is in doubles; bisectors are taken as a little farther away than
// they are, by far more than rounding errors, so that nothing is missed.
//
// Thread safety: thread-compatible.
class SurfaceInCell {
 public:
  // Takes a cell, whose nodes are placed.
  //
  // Complexity: O(nodes log nodes).
  void Take(const Polytope<3>& cell) {
    site_ = cell.site();
    faces_.clear();
    indices_.clear();
    for (const CellNode<3>& node : cell.nodes()) {
      indices_.insert(indices_.end(), node.planes.begin(), node.planes.end());
    }
    std::sort(indices_.begin(), indices_.end());
    indices_.erase(std::unique(indices_.begin(), indices_.end()), indices_.end());
    for (const uint16_t index : indices_) {
      const Plane<3>& plane = cell.plane(index);
      if (plane.kind == PlaneKind::kBisector) {
        faces_.push_back({plane.normal, plane.offset, plane.length, plane.vertex});
      }
    }
  }

  // Appends the owners of the part of the triangle in the cell if they may be three: no point of the triangle in the
  // cell is else as near to three vertices as to any.
  //
  // Complexity: O(faces^2), mostly O(faces).
  void AppendOwnersOfThree(const Triangle& triangle, std::vector<VertexId>& owners) {
    ClipByCell(triangle);
    if (inside_.empty()) {
      return;
    }
    FindNearness();
    const size_t before = owners.size();
    for (size_t face = 0; face < faces_.size(); ++face) {
      if (MayOwn(face)) {
        owners.push_back(faces_[face].vertex);
      }
    }
    if (owners.size() < before + 3) {
      owners.resize(before);
    }
  }

 private:
  static constexpr double kRoom = 1e-6;
  static constexpr double kRounding = 0x1p-40;

  // The bisector to a neighbour: to . x = offset, seen from the site.
  struct Face {
    Point<3> to{};
    double offset = 0;
    double length = 0;  // of `to`
    VertexId vertex = kNoVertex;
  };

  // Leaves in `inside_` the part of the triangle in the cell.
  void ClipByCell(const Triangle& triangle) {
    inside_.clear();
    size_ = 0;
    for (const Point<3>& corner : triangle) {
      for (int axis = 0; axis < 3; ++axis) {
        size_ = std::max({size_, std::abs(corner[axis]), std::abs(site_[axis])});
      }
      inside_.push_back(Difference<3>(corner, site_));
    }
    for (size_t i = 0; i < faces_.size() && !inside_.empty(); ++i) {
      const Face& face = faces_[i];
      Cut(face.to, (1 + kRoom) * face.offset + kRounding * size_ * face.length, inside_);
    }
  }

  // Finds how near each corner of what is inside is to the vertex of each face: half of its squared distance from that,
  // less what is the same for all vertices, negated.
  void FindNearness() {
    nearness_.clear();
    for (const Face& face : faces_) {
      for (const Point<3>& corner : inside_) {
        nearness_.push_back(Dot<3>(face.to, corner) - face.offset);
      }
    }
  }

  // The slack of the bisector between the vertices of two faces.
  double RoomBetween(const Face& face, const Face& other) const {
    return kRoom * (face.offset + other.offset) + kRounding * size_ * (face.length + other.length);
  }

  // Whether all corners, and so all that is inside, are nearer to the vertex of `other`.
  bool IsNearerToOther(size_t face, size_t other) const {
    const size_t corners = inside_.size();
    const double room = RoomBetween(faces_[face], faces_[other]);
    for (size_t k = 0; k < corners; ++k) {
      if (!(nearness_[other * corners + k] - nearness_[face * corners + k] > room)) {
        return false;
      }
    }
    return true;
  }

  // Whether a point of what is inside may be nearer to the vertex of `face` than to those of all others.
  bool MayOwn(size_t face) {
    for (size_t other = 0; other < faces_.size(); ++other) {
      if (other != face && IsNearerToOther(face, other)) {
        return false;
      }
    }
    owned_ = inside_;
    const Face& own = faces_[face];
    for (size_t i = 0; i < faces_.size() && !owned_.empty(); ++i) {
      if (i != face) {
        Cut(Difference<3>(faces_[i].to, own.to), faces_[i].offset - own.offset + RoomBetween(own, faces_[i]), owned_);
      }
    }
    return !owned_.empty();
  }

  // Leaves of a polygon the points p with normal . p <= offset.
  void Cut(const Point<3>& normal, double offset, std::vector<Point<3>>& polygon) {
    beyond_.clear();
    bool is_cut = false;
    for (const Point<3>& p : polygon) {
      beyond_.push_back(Dot<3>(normal, p) - offset);
      is_cut = is_cut || beyond_.back() > 0;
    }
    if (!is_cut) {
      return;
    }
    cut_.clear();
    double last = beyond_.back();
    for (size_t i = 0; i < polygon.size(); ++i) {
      const double own = beyond_[i];
      if ((last > 0) != (own > 0)) {
        cut_.push_back(Between(polygon[i == 0 ? polygon.size() - 1 : i - 1], polygon[i], last / (last - own)));
      }
      if (own <= 0) {
        cut_.push_back(polygon[i]);
      }
      last = own;
    }
    polygon.swap(cut_);
  }

  Point<3> site_{};
  std::vector<Face> faces_;
  std::vector<uint16_t> indices_;
  double size_ = 0;               // of coordinates
  std::vector<Point<3>> inside_;  // corners of the part of the triangle in the cell, seen from the site
  std::vector<Point<3>> owned_;
  std::vector<Point<3>> cut_;
  std::vector<double> beyond_;    // of a polygon that is cut, by corner
  std::vector<double> nearness_;  // by face and corner
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_SURFACE_IN_CELL_H_
