#include "core/refine/size_tree.h"

#include <algorithm>

#include "core/base/dimensions.h"

namespace wellspace::core {
namespace {

template <int D>
Box<D> BoxAround(const Point<D>& p) {
  return {p, p};
}
template <int D>
Box<D> BoxAround(const Box<D>& box) {
  return box;
}

// Where a place counts as lying on an axis, up to a factor.
template <int D>
double MiddleOf(const Point<D>& p, int axis) {
  return p[axis];
}
template <int D>
double MiddleOf(const Box<D>& box, int axis) {
  return 0.5 * box.low[axis] + 0.5 * box.high[axis];
}

}  // namespace

template <int D, typename Shape>
SizeTree<D, Shape>::SizeTree(std::vector<Place> places) : places_(std::move(places)) {
  if (!places_.empty()) {
    nodes_.reserve(2 * (2 * places_.size() / kLeafCapacity + 1));
    Build(0, places_.size());
    nodes_.shrink_to_fit();
  }
}

// Builds the node of the places from `begin` to `end`: halves, along the axis on which they reach farthest.
template <int D, typename Shape>
uint32_t SizeTree<D, Shape>::Build(size_t begin, size_t end) {
  const auto number = static_cast<uint32_t>(nodes_.size());
  Node node{.box = BoxAround<D>(places_[begin].place), .least = places_[begin].size};
  for (size_t k = begin + 1; k < end; ++k) {
    node.box.Include(BoxAround<D>(places_[k].place));
    node.least = std::min(node.least, places_[k].size);
  }
  node.begin = static_cast<uint32_t>(begin);
  node.end = static_cast<uint32_t>(end);
  nodes_.push_back(node);
  if (end - begin <= kLeafCapacity) {
    return number;
  }
  int axis = 0;
  for (int i = 1; i < D; ++i) {
    axis = node.box.high[i] - node.box.low[i] > node.box.high[axis] - node.box.low[axis] ? i : axis;
  }
  const size_t middle = begin + (end - begin) / 2;
  const auto first = places_.begin();
  std::nth_element(first + static_cast<std::ptrdiff_t>(begin), first + static_cast<std::ptrdiff_t>(middle),
                   first + static_cast<std::ptrdiff_t>(end), [axis](const Place& a, const Place& b) {
                     return MiddleOf<D>(a.place, axis) < MiddleOf<D>(b.place, axis);
                   });
  Build(begin, middle);
  const uint32_t second = Build(middle, end);
  nodes_[number].second = second;
  return number;
}

#define WELLSPACE_INSTANTIATE(D)        \
  template class SizeTree<D, Point<D>>; \
  template class SizeTree<D, Box<D>>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
