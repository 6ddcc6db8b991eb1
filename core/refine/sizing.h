// Size fields: the bound on circumradii at each point, from boxes and samples.
#ifndef WELLSPACE_CORE_REFINE_SIZING_H_
#define WELLSPACE_CORE_REFINE_SIZING_H_

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/refine/size_tree.h"

namespace wellspace::core {

// Points with a size each, as a size field keeps them: made once, shared by all copies.
template <int D>
using SampleTree = SizeTree<D, Point<D>>;

// The box and the sample that asked for least at the place that was looked at last.
struct SizeHint {
  uint32_t region = 0;
  uint32_t sample = 0;
};

// The largest circumradius h(x) that a simplex with circumcentre x may have. It is the least of
// - a bound everywhere;
// - max(H, G dist(x, box)) of each box with bound H: as G <= 1, every simplex whose circumball meets the box keeps H;
// - H + G |x - p| of each sample, a point p with size H: together the largest function that is no larger than any H at
//   its p, and grows no faster than G times the distance.
// So h is G-Lipschitz, and 1-Lipschitz like the local feature size.
//
// Thread safety: immutable but for RaiseTo.
// Guarantees: (1) h(x) depends, to the bit, neither on the order of boxes and samples nor on earlier queries.
template <int D>
class SizeField {
 public:
  using Region = SizedPlace<Box<D>>;

  // How fast sizes grow with the distance from boxes, and from samples: above 0, at most 1.
  struct Growth {
    double of_regions = 1;
    double of_samples = 1;

    bool operator==(const Growth&) const = default;

    double Most() const { return std::max(of_regions, of_samples); }
  };

  SizeField() = default;
  // REQUIRES:   sizes above 0, as are squares of them.
  // Complexity: O(regions log regions).
  explicit SizeField(double max_circumradius, std::vector<Region> regions = {},
                     std::shared_ptr<const SampleTree<D>> samples = nullptr, Growth growth = {})
      : max_circumradius_(max_circumradius),
        regions_(regions.empty() ? nullptr : std::make_shared<const SizeTree<D, Box<D>>>(std::move(regions))),
        samples_(samples == nullptr || samples->places().empty() ? nullptr : std::move(samples)),
        growth_(growth) {}

  // Whether the same is asked for in the same order.
  bool operator==(const SizeField& other) const {
    return max_circumradius_ == other.max_circumradius_ && least_ == other.least_ && growth_ == other.growth_ &&
           AreEqual(regions_.get(), other.regions_.get()) && AreEqual(samples_.get(), other.samples_.get());
  }

  double max_circumradius() const { return max_circumradius_; }
  // In any order.
  const std::vector<Region>& regions() const { return PlacesOf(regions_.get()); }
  const std::vector<SizedPlace<Point<D>>>& samples() const { return PlacesOf(samples_.get()); }
  const Growth& growth() const { return growth_; }
  // The argument of RaiseTo; 0 before.
  double least() const { return least_; }
  // The same field without its boxes.
  SizeField OfSamples() const {
    SizeField field(max_circumradius_, {}, samples_, growth_);
    field.least_ = least_;
    return field;
  }

  // The lesser of h(x)^2 and `most`. The less that is, the less has to be looked at.
  //
  // `hint`, if there is one, makes this fast where it was last used near x.
  //
  // Complexity: O(log n) for n boxes or samples, but where many of them ask for about as much.
  double AtSq(const Point<D>& x, double most = std::numeric_limits<double>::infinity(),
              SizeHint* hint = nullptr) const {
    double least = std::min(max_circumradius_ * max_circumradius_, most);
    if (regions_ != nullptr) {
      least = regions_->Least(
          x, least,
          [growth_sq = growth_.of_regions * growth_.of_regions](double size, double gap_sq) {
            return std::max(size * size, growth_sq * gap_sq);
          },
          hint == nullptr ? nullptr : &hint->region);
    }
    if (samples_ != nullptr) {
      least = samples_->Least(
          x, least,
          [growth = growth_.of_samples](double size, double gap_sq) {
            const double bound = size + growth * std::sqrt(gap_sq);
            return bound * bound;
          },
          hint == nullptr ? nullptr : &hint->sample);
    }
    return std::max(least, std::min(least_ * least_, most));
  }

  // The least h(y)^2 with |x y| <= reach.
  //
  // Complexity: as AtSq.
  double LeastAroundSq(const Point<D>& x, double reach) const {
    double least = max_circumradius_ * max_circumradius_;
    if (regions_ != nullptr) {
      least = regions_->Least(x, least, [reach, growth = growth_.of_regions](double size, double gap_sq) {
        const double bound = std::max(size, growth * (std::sqrt(gap_sq) - reach));
        return bound * bound;
      });
    }
    if (samples_ != nullptr) {
      least = samples_->Least(x, least, [reach, growth = growth_.of_samples](double size, double gap_sq) {
        const double bound = size + growth * std::max(0.0, std::sqrt(gap_sq) - reach);
        return bound * bound;
      });
    }
    return std::max(least, least_ * least_);
  }

  // The least h(y) over a box.
  //
  // Complexity: as AtSq.
  double LeastIn(const Box<D>& box) const {
    double least = max_circumradius_;
    if (regions_ != nullptr) {
      least = regions_->Least(box, least, [growth = growth_.of_regions](double size, double gap_sq) {
        return std::max(size, growth * std::sqrt(gap_sq));
      });
    }
    if (samples_ != nullptr) {
      least = samples_->Least(box, least, [growth = growth_.of_samples](double size, double gap_sq) {
        return size + growth * std::sqrt(gap_sq);
      });
    }
    return std::max(least, least_);
  }

  // Has no size be below `least`.
  void RaiseTo(double least) {
    least_ = std::max(least_, least);
    max_circumradius_ = std::max(max_circumradius_, least);
  }

  // Nothing is asked for.
  bool IsUnbounded() const {
    return regions_ == nullptr && samples_ == nullptr && max_circumradius_ == std::numeric_limits<double>::infinity();
  }

 private:
  template <typename Tree>
  static bool AreEqual(const Tree* a, const Tree* b) {
    return a == b || (a != nullptr && b != nullptr && a->places() == b->places());
  }
  template <typename Tree>
  static const std::vector<typename Tree::Place>& PlacesOf(const Tree* tree) {
    static const std::vector<typename Tree::Place> kNone;
    return tree == nullptr ? kNone : tree->places();
  }

  double max_circumradius_ = std::numeric_limits<double>::infinity();
  double least_ = 0;  // sizes below this count as this
  std::shared_ptr<const SizeTree<D, Box<D>>> regions_;
  std::shared_ptr<const SampleTree<D>> samples_;
  Growth growth_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SIZING_H_
