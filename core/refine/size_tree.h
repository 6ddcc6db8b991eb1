// Places with a size each, and which of them asks for the smallest size somewhere else.
#ifndef WELLSPACE_CORE_REFINE_SIZE_TREE_H_
#define WELLSPACE_CORE_REFINE_SIZE_TREE_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// A place, a point or a box, and the size that is asked for there.
template <typename Shape>
struct SizedPlace {
  Shape place{};
  double size = 0;

  bool operator==(const SizedPlace&) const = default;
};

// A k-d tree over places with sizes: each node knows the box around its places, and the least of their sizes.
//
// Thread safety: immutable.
// Invariants: (1) a node comes before its children, the first of which follows it; (2) leaves hold 1 to kLeafCapacity
//             places, side by side, in the order of the nodes.
template <int D, typename Shape>
class SizeTree {
 public:
  using Place = SizedPlace<Shape>;

  static constexpr size_t kLeafCapacity = 8;

  SizeTree() = default;
  // Complexity: O(n log n).
  explicit SizeTree(std::vector<Place> places);

  // Places in the order of the leaves.
  const std::vector<Place>& places() const { return places_; }

  // The most memory of a tree of `count` places.
  static uint64_t BytesFor(uint64_t count) { return count * (sizeof(Place) + sizeof(Node)); }

  // The least of `most` and value(size, squared distance from `at`, a point or a box, to the place) over all places.
  // That of a node is a bound from below: rounding never turns two numbers round. So this is the least to the bit,
  // whatever the order of the places.
  //
  // `*hint`, if there is one, is the number of any place, from which the search begins; then it is that of the place
  // which asks for least, if that is below `most`. It is of use where the next `at` is near.
  //
  // REQUIRES:   `value` falls neither with the size nor with the distance, as it is computed.
  // Complexity: O(log n) for most fields; O(n) where many places ask for about as much.
  template <typename At, typename Value>
  double Least(const At& at, double most, const Value& value, uint32_t* hint = nullptr) const;

 private:
  struct Node {
    Box<D> box;  // holds its places
    double least = 0;
    uint32_t second = 0;  // the second child; 0: a leaf
    uint32_t begin = 0;   // of a leaf
    uint32_t end = 0;
  };

  // A balanced tree over 2^32 places has no more levels.
  static constexpr size_t kMostLevels = 35;

  uint32_t Build(size_t begin, size_t end);

  std::vector<Place> places_;
  std::vector<Node> nodes_;
};

template <int D>
double GapSq(const Point<D>& a, const Point<D>& b) {
  return DistanceSq<D>(a, b);
}
template <int D>
double GapSq(const Point<D>& a, const Box<D>& b) {
  return DistanceSq<D>(a, b);
}
template <int D>
double GapSq(const Box<D>& a, const Point<D>& b) {
  return DistanceSq<D>(b, a);
}
template <int D>
double GapSq(const Box<D>& a, const Box<D>& b) {
  return DistanceSq<D>(a, b);
}

template <int D, typename Shape>
template <typename At, typename Value>
double SizeTree<D, Shape>::Least(const At& at, double most, const Value& value, uint32_t* hint) const {
  if (nodes_.empty()) {
    return most;
  }
  uint32_t found = hint == nullptr ? 0 : *hint;
  const auto bound = [&](uint32_t node) { return value(nodes_[node].least, GapSq<D>(at, nodes_[node].box)); };
  const auto value_of = [&](uint32_t k) { return value(places_[k].size, GapSq<D>(at, places_[k].place)); };
  most = std::min(most, value_of(found));
  struct Later {
    double bound;
    uint32_t node;
  };
  std::array<Later, kMostLevels> later;  // entries to be looked at, if they still may have less
  size_t count = 0;
  uint32_t i = 0;
  while (true) {
    const Node& node = nodes_[i];
    if (node.second != 0) {
      // The child that may have less first. Few branches, which could not be predicted.
      const double first_bound = bound(i + 1);
      const double second_bound = bound(node.second);
      const bool second_is_near = second_bound < first_bound;
      const double far_bound = second_is_near ? first_bound : second_bound;
      later[count] = {far_bound, second_is_near ? i + 1 : node.second};
      count += far_bound < most ? 1 : 0;
      if ((second_is_near ? second_bound : first_bound) < most) {
        i = second_is_near ? node.second : i + 1;
        continue;
      }
    } else {
      for (uint32_t k = node.begin; k < node.end; ++k) {
        const double own = value_of(k);
        found = own < most ? k : found;
        most = std::min(most, own);
      }
    }
    while (count > 0 && !(later[count - 1].bound < most)) {
      --count;
    }
    if (count == 0) {
      break;
    }
    i = later[--count].node;
  }
  if (hint != nullptr) {
    *hint = found;
  }
  return most;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SIZE_TREE_H_
