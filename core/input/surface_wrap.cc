#include "core/input/surface_wrap.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_format.h"
#include "core/base/cancellable_sort.h"
#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/features/union_find.h"
#include "core/features/winding_numbers.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"
#include "core/input/triangle_pieces.h"

namespace wellspace::core {
namespace {

// Nodes and cells of the grid have three coordinates of 21 bits, which one number holds.
using GridKey = uint64_t;
constexpr int kBits = 21;
constexpr GridKey KeyOf(uint64_t x, uint64_t y, uint64_t z) { return x | y << kBits | z << (2 * kBits); }
constexpr GridKey kAlong[3] = {KeyOf(1, 0, 0), KeyOf(0, 1, 0), KeyOf(0, 0, 1)};
constexpr uint64_t CoordinateOf(GridKey key, int axis) { return key >> (axis * kBits) & ((1u << kBits) - 1); }

// Cells of room around the surface, whose outer nodes count as outside whatever their winding numbers.
constexpr uint64_t kRoom = 3;
// The lowest corner of the box is at these shares of a cell: sides of parts that lie along the axes meet no nodes.
constexpr Point<3> kOffset = {0.382, 0.618, 0.276};

// A corner of the surface is no nearer to a node of the grid than this share of the edge that it is on.
constexpr double kLeastShare = 0.1;
// Halvings of an edge on which no triangle is met.
constexpr int kHalvings = 10;

constexpr size_t kCellsTogether = 1 << 15;
constexpr size_t kCellsBetweenChecks = 32;
constexpr double kMostAdded = 4;          // times kMostWrapCells: of needles, and at gaps
constexpr double kPartsOfCell = 1 << 20;  // of the square of a cell, in which areas are counted
constexpr uint64_t kBytesOfCell = 700;    // nodes, corners and triangles of a cell at the surface, in their tables

// The tetrahedra of a cell: paths from its lowest node to its highest one, along the axes in every order.
constexpr std::array<std::array<int, 3>, 6> kPaths = {
    {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
constexpr std::array<bool, 6> kIsOdd = {false, true, true, false, false, true};

class Wrapper {
 public:
  Wrapper(const SurfaceComplex& complex, const Box<3>& box, double cell, double unit, uint64_t held,
          const RunContext& context)
      : complex_(complex), box_(box), cell_(cell), unit_(unit), held_(held), context_(context) {}

  absl::StatusOr<SurfaceWrap> Wrap() {
    WELLSPACE_RETURN_IF_ERROR(CheckCells());
    held_ += WindingNumbers::Bytes(complex_.triangles.size());
    WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory(held_));
    WELLSPACE_RETURN_IF_ERROR(winding_.Build(complex_, context_));
    WELLSPACE_RETURN_IF_ERROR(FindSide());
    WELLSPACE_RETURN_IF_ERROR(FindMetCells());
    for (size_t i = 0; i < cells_.size(); ++i) {  // which grows
      if (i % kCellsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
      }
      WELLSPACE_RETURN_IF_ERROR(WrapCell(cells_[i]));
    }
    if (out_.triangles.empty()) {
      return absl::InvalidArgumentError(absl::StrFormat(
          "triangles: at no node of a grid with cells of %.3g is the winding number above 1/2: they bound nothing, or "
          "only what is thinner; expected triangles that surround a solid, most of them going one way, or a finer "
          "resolution",
          cell_ * unit_));
    }
    WELLSPACE_RETURN_IF_ERROR(DropParts());
    WELLSPACE_RETURN_IF_ERROR(FindLostArea());
    return std::move(out_);
  }

 private:
  absl::Status TooManyCells(double factor) const {
    return absl::InvalidArgumentError(absl::StrFormat(
        "resolution: cells of %g are more than the %.3g at the surface that are made; expected at least %.3g",
        cell_ * unit_, kMostWrapCells, 1.01 * factor * cell_ * unit_));
  }

  // Refuses cells that are too many, or too small for the grid.
  absl::Status CheckCells() const {
    double cells = 0;  // at the surface, at least
    for (uint32_t t = 0; t < complex_.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      cells += AreaOf(complex_.InOrderAt(t)) / (cell_ * cell_);
    }
    const double along = box_.LongestSide() / cell_ + 2 * kRoom + 2;
    constexpr double kMostAlong = (1 << kBits) - 1;
    return cells <= kMostWrapCells && along <= kMostAlong
               ? absl::OkStatus()
               : TooManyCells(std::max(std::sqrt(cells / kMostWrapCells), along / kMostAlong));
  }

  // Finds by which sign the triangles go around what they bound.
  absl::Status FindSide() {
    double volume = 0;
    for (uint32_t t = 0; t < complex_.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      const Triangle triangle = complex_.TriangleAt(t);
      const Point<3> a = Difference<3>(triangle[0], box_.low);
      volume += Dot<3>(a, Cross(Difference<3>(triangle[1], box_.low), Difference<3>(triangle[2], box_.low)));
    }
    side_ = volume < 0 ? -1 : 1;
    return absl::OkStatus();
  }

  Point<3> NodeAt(GridKey node) const {
    Point<3> at;
    for (int axis = 0; axis < 3; ++axis) {
      at[axis] = box_.low[axis] + cell_ * (static_cast<double>(CoordinateOf(node, axis)) - kRoom - kOffset[axis]);
    }
    return at;
  }
  bool IsInsideAt(const Point<3>& p) const { return side_ * winding_.At(p) > 0.5; }
  // Whether a node has a winding number above 1/2.
  bool IsSurrounded(GridKey node) {
    const auto [at, is_new] = is_surrounded_.try_emplace(node, false);
    if (is_new) {
      bool is_in_room = false;
      for (int axis = 0; axis < 3; ++axis) {
        const uint64_t x = CoordinateOf(node, axis);
        is_in_room = is_in_room || x < kRoom || x > CellAt(axis, box_.high[axis]) + 1;
      }
      at->second = !is_in_room && IsInsideAt(NodeAt(node));
    }
    return at->second;
  }
  // Whether most of a node and its six neighbours are surrounded: specks and threads go, sheets and edges stay.
  bool IsInside(GridKey node) {
    if (const auto known = is_inside_.find(node); known != is_inside_.end()) {
      return known->second;
    }
    int count = IsSurrounded(node) ? 1 : 0;
    for (const GridKey step : kAlong) {
      count += (IsSurrounded(node + step) ? 1 : 0) + (IsSurrounded(node - step) ? 1 : 0);
    }
    return is_inside_[node] = count >= 4;
  }

  absl::Status AddCell(GridKey cell) {
    if (!is_cell_.insert(cell).second) {
      return absl::OkStatus();
    }
    if (cells_.size() >= kMostAdded * kMostWrapCells) {
      return TooManyCells(2);
    }
    if (cells_.size() % kCellsTogether == 0) {
      WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory(held_ + (cells_.size() + kCellsTogether) * kBytesOfCell));
    }
    cells_.push_back(cell);
    return absl::OkStatus();
  }

  // Calls visit(piece) for pieces of all given triangles, none of them longer than a cell.
  template <typename Visit>
  absl::Status ForEachSmallPiece(const Visit& visit) const {
    const auto visit_small = [&](const Triangle& piece, const LongestEdge& longest) -> absl::StatusOr<bool> {
      if (longest.length_sq > cell_ * cell_) {
        return true;
      }
      WELLSPACE_RETURN_IF_ERROR(visit(piece));
      return false;
    };
    for (uint32_t t = 0; t < complex_.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      WELLSPACE_RETURN_IF_ERROR(ForEachPiece(complex_.InOrderAt(t), context_, visit_small));
    }
    return absl::OkStatus();
  }

  // Adds the cells that triangles meet, and some beside them.
  absl::Status FindMetCells() {
    WELLSPACE_RETURN_IF_ERROR(
        ForEachSmallPiece([this](const Triangle& piece) { return AddCellsOf(BoxOfTriangle(piece)); }));
    return CancellableSort(cells_, std::less<GridKey>(), context_);
  }
  absl::Status AddCellsOf(const Box<3>& box) {
    std::array<std::array<uint64_t, 2>, 3> range;
    for (int axis = 0; axis < 3; ++axis) {
      range[axis] = {CellAt(axis, box.low[axis]), CellAt(axis, box.high[axis])};
    }
    for (uint64_t z = range[2][0]; z <= range[2][1]; ++z) {
      for (uint64_t y = range[1][0]; y <= range[1][1]; ++y) {
        for (uint64_t x = range[0][0]; x <= range[0][1]; ++x) {
          WELLSPACE_RETURN_IF_ERROR(AddCell(KeyOf(x, y, z)));
        }
      }
    }
    return absl::OkStatus();
  }
  uint64_t CellAt(int axis, double x) const {
    return kRoom + static_cast<uint64_t>(std::max(0.0, std::floor((x - box_.low[axis]) / cell_ + kOffset[axis])));
  }

  // Puts triangles into a cell, and adds neighbours into which they go on.
  absl::Status WrapCell(GridKey cell) {
    std::array<bool, 8> is_inside;
    int count = 0;
    for (int i = 0; i < 8; ++i) {
      is_inside[i] = IsInside(cell + KeyOf(i & 1, i >> 1 & 1, i >> 2));
      count += is_inside[i] ? 1 : 0;
    }
    if (count == 0 || count == 8) {
      return absl::OkStatus();
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (const int high : {0, 1}) {
        int inside = 0;
        for (int i = 0; i < 8; ++i) {
          inside += (i >> axis & 1) == high && is_inside[i] ? 1 : 0;
        }
        if (inside > 0 && inside < 4) {
          WELLSPACE_RETURN_IF_ERROR(AddCell(high == 1 ? cell + kAlong[axis] : cell - kAlong[axis]));
        }
      }
    }
    for (size_t i = 0; i < kPaths.size(); ++i) {
      const std::array<int, 3>& path = kPaths[i];
      int at = 0;
      std::array<int, 4> corners = {0, 0, 0, 0};
      for (size_t k = 0; k < 3; ++k) {
        at |= 1 << path[k];
        corners[k + 1] = at;
      }
      WrapTetrahedron(cell, corners, kIsOdd[i], is_inside);
    }
    return absl::OkStatus();
  }

  // `corners`: of the cell, along one of its paths; `is_odd`: an odd one, whose tetrahedra are turned the other way.
  void WrapTetrahedron(GridKey cell, const std::array<int, 4>& corners, bool is_odd,
                       const std::array<bool, 8>& is_inside) {
    std::array<int, 4> order{};  // those inside first
    int ins = 0;
    for (const bool wanted : {true, false}) {
      for (int i = 0, k = wanted ? 0 : ins; i < 4; ++i) {
        if (is_inside[corners[i]] == wanted) {
          order[k++] = i;
          ins += wanted ? 1 : 0;
        }
      }
    }
    bool turns = is_odd;
    for (int i = 0; i < 4; ++i) {
      for (int k = i + 1; k < 4; ++k) {
        turns ^= order[i] > order[k];
      }
    }
    const auto on = [&](int i, int k) {
      const auto [low, high] = std::minmax(order[i], order[k]);
      return CornerOn(cell, corners[low], corners[high]);
    };
    if (ins == 1) {
      AddTriangle({on(0, 1), on(0, 2), on(0, 3)}, turns);
    } else if (ins == 3) {
      AddTriangle({on(0, 3), on(1, 3), on(2, 3)}, turns);
    } else if (ins == 2) {
      const std::array<uint32_t, 4> ring = {on(0, 2), on(0, 3), on(1, 3), on(1, 2)};
      AddTriangle({ring[0], ring[1], ring[2]}, turns);
      AddTriangle({ring[0], ring[2], ring[3]}, turns);
    }
  }

  void AddTriangle(std::array<uint32_t, 3> corners, bool turns) {
    if (turns) {
      std::swap(corners[1], corners[2]);
    }
    out_.triangles.push_back(corners);
  }

  static GridKey NodeOf(GridKey cell, int corner) { return cell + KeyOf(corner & 1, corner >> 1 & 1, corner >> 2); }

  // The corner of the surface on the edge between corners `low` and `high` of a cell, of which one is inside.
  uint32_t CornerOn(GridKey cell, int low, int high) {
    const GridKey node = NodeOf(cell, low);
    const int direction = high - low;  // bits of axes: low has none of them
    const auto [at, is_new] = corners_[direction - 1].try_emplace(node, static_cast<uint32_t>(out_.points.size()));
    if (is_new) {
      out_.points.push_back(PlaceOn(node, NodeOf(cell, high)));
    }
    return at->second;
  }

  Point<3> PlaceOn(GridKey from, GridKey to) {
    const Point<3> a = NodeAt(from);
    const Point<3> b = NodeAt(to);
    const bool is_inside = IsInside(from);
    if (IsSurrounded(from) != is_inside || IsSurrounded(to) == is_inside) {
      return Between(a, b, 0.5);
    }
    winding_.FindCrossings(a, b, crossings_);
    double low = 0;
    double high = 1;
    if (crossings_.size() == 1) {
      low = high = crossings_.front();
    } else {
      // The first crossing behind which the other kind of points begins.
      for (size_t i = 0; i < crossings_.size(); ++i) {
        const double next = i + 1 < crossings_.size() ? crossings_[i + 1] : 1;
        if (IsInsideAt(Between(a, b, 0.5 * (crossings_[i] + next))) != is_inside) {
          low = high = crossings_[i];
          break;
        }
      }
    }
    for (int i = 0; i < kHalvings && low < high; ++i) {
      const double middle = 0.5 * (low + high);
      (IsInsideAt(Between(a, b, middle)) == is_inside ? low : high) = middle;
    }
    return Between(a, b, std::clamp(0.5 * (low + high), kLeastShare, 1 - kLeastShare));
  }

  // Drops the parts that are smaller than a few cells, unless all are.
  absl::Status DropParts() {
    UnionFind parts(out_.points.size());
    for (size_t t = 0; t < out_.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      parts.Join(out_.triangles[t][0], out_.triangles[t][1]);
      parts.Join(out_.triangles[t][0], out_.triangles[t][2]);
    }
    absl::flat_hash_map<uint32_t, Box<3>> boxes;
    for (uint32_t v = 0; v < out_.points.size(); ++v) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(v, context_));
      const Box<3> own{out_.points[v], out_.points[v]};
      boxes.try_emplace(parts.Find(v), own).first->second.Include(own);
    }
    const auto is_small = [&](const Box<3>& box) { return box.LongestSide() < kLeastPart * cell_; };
    if (std::all_of(boxes.begin(), boxes.end(), [&](const auto& part) { return is_small(part.second); })) {
      return absl::OkStatus();
    }
    std::erase_if(out_.triangles, [&](const auto& corners) { return is_small(boxes.at(parts.Find(corners[0]))); });
    return absl::OkStatus();
  }

  GridKey CellOf(const Point<3>& p) const { return KeyOf(CellAt(0, p[0]), CellAt(1, p[1]), CellAt(2, p[2])); }

  // Whether one of the cells is the cell or touches it.
  static bool HasNear(const absl::flat_hash_set<GridKey>& cells, GridKey cell) {
    for (GridKey z : {cell - kAlong[2], cell, cell + kAlong[2]}) {
      for (GridKey y : {z - kAlong[1], z, z + kAlong[1]}) {
        for (GridKey x : {y - kAlong[0], y, y + kAlong[0]}) {
          if (cells.contains(x)) {
            return true;
          }
        }
      }
    }
    return false;
  }

  // Adds up the pieces of given triangles which no part of the surface is near, and which are not inside of it.
  absl::Status FindLostArea() {
    absl::flat_hash_set<GridKey> cells;  // of the surface
    for (size_t t = 0; t < out_.triangles.size(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      const auto [a, b, c] = out_.triangles[t];
      cells.insert(CellOf(MiddleOf({out_.points[a], out_.points[b], out_.points[c]})));
    }
    uint64_t parts = 0;  // whole numbers: their sum is the same in any order
    WELLSPACE_RETURN_IF_ERROR(ForEachSmallPiece([&](const Triangle& piece) {
      const GridKey cell = CellOf(MiddleOf(piece));
      if (!IsInside(cell) && !HasNear(cells, cell)) {
        parts += static_cast<uint64_t>(AreaOf(piece) / (cell_ * cell_) * kPartsOfCell);
      }
      return absl::OkStatus();
    }));
    out_.lost_area = static_cast<double>(parts) / kPartsOfCell * cell_ * cell_;
    return absl::OkStatus();
  }

  const SurfaceComplex& complex_;
  const Box<3>& box_;
  const double cell_;
  const double unit_;
  uint64_t held_;
  const RunContext& context_;
  WindingNumbers winding_;
  double side_ = 1;
  absl::flat_hash_map<GridKey, bool> is_surrounded_;
  absl::flat_hash_map<GridKey, bool> is_inside_;
  absl::flat_hash_set<GridKey> is_cell_;
  std::vector<GridKey> cells_;
  std::array<absl::flat_hash_map<GridKey, uint32_t>, 7> corners_;  // by direction, less one, and lower node
  std::vector<double> crossings_;
  SurfaceWrap out_;
};

}  // namespace

absl::StatusOr<SurfaceWrap> WrapSurface(const SurfaceComplex& complex, const Box<3>& box, double cell, double unit,
                                        uint64_t held, const RunContext& context) {
  return Wrapper(complex, box, cell, unit, held, context).Wrap();
}

}  // namespace wellspace::core
