// Sizes in boxes and at points: the size found by the tree is that of a look at all of them, to the bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "core/refine/sizing.h"
#include "tests/support/clouds.h"
#include "tests/support/dimensions.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

template <int D>
using Regions = std::vector<typename SizeField<D>::Region>;
template <int D>
using Samples = std::vector<SizedPlace<Point<D>>>;

// Boxes and samples of very different sizes, some of them equal, in the unit box; and the field that they make.
template <int D>
struct Sizes {
  double everywhere = kInfinity;
  Regions<D> regions;
  Samples<D> samples;
  typename SizeField<D>::Growth growth;

  SizeField<D> Field() const {
    return SizeField<D>(everywhere, regions, std::make_shared<const SampleTree<D>>(samples), growth);
  }

  void Shuffle(test::SplitMix64& random) {
    const auto shuffle = [&random](auto& places) {
      for (size_t i = places.size(); i > 1; --i) {
        std::swap(places[i - 1], places[random.Next() % i]);
      }
    };
    shuffle(regions);
    shuffle(samples);
  }

  // The squares of the sizes asked for at `x`; the least within `reach` of it.
  double AtSq(const Point<D>& x) const {
    double least = everywhere * everywhere;
    for (const auto& [box, size] : regions) {
      least = std::min(least, std::max(size * size, growth.of_regions * growth.of_regions * DistanceSq<D>(x, box)));
    }
    for (const auto& [p, size] : samples) {
      const double bound = size + growth.of_samples * std::sqrt(DistanceSq<D>(x, p));
      least = std::min(least, bound * bound);
    }
    return least;
  }
  double LeastAroundSq(const Point<D>& x, double reach) const {
    double least = everywhere * everywhere;
    for (const auto& [box, size] : regions) {
      const double bound = std::max(size, growth.of_regions * (std::sqrt(DistanceSq<D>(x, box)) - reach));
      least = std::min(least, bound * bound);
    }
    for (const auto& [p, size] : samples) {
      const double bound = size + growth.of_samples * std::max(0.0, std::sqrt(DistanceSq<D>(x, p)) - reach);
      least = std::min(least, bound * bound);
    }
    return least;
  }
};

template <int D>
Point<D> RandomPoint(test::SplitMix64& random) {
  Point<D> p;
  for (double& x : p) {
    // Some lie on planes that many share.
    x = random.Next() % 4 == 0 ? 0.125 * static_cast<double>(random.Next() % 9) : random.Unit();
  }
  return p;
}

template <int D>
Sizes<D> RandomSizes(size_t regions, size_t samples, double growth, test::SplitMix64& random) {
  Sizes<D> sizes;
  sizes.growth = {growth, growth};
  const auto size = [&random] { return std::exp2(-20 * random.Unit()); };
  for (size_t i = 0; i < regions; ++i) {
    Box<D> box{RandomPoint<D>(random), RandomPoint<D>(random)};
    for (int k = 0; k < D; ++k) {
      std::tie(box.low[k], box.high[k]) = std::minmax({box.low[k], box.high[k]});
    }
    sizes.regions.push_back({box, size()});
  }
  for (size_t i = 0; i < samples; ++i) {
    sizes.samples.push_back({RandomPoint<D>(random), size()});
  }
  return sizes;
}

template <typename T>
class SizeFieldTest : public test::SeededTest {
 protected:
  SizeFieldTest() : SeededTest(60) {}
};
TYPED_TEST_SUITE(SizeFieldTest, test::AllDimensions);

TYPED_TEST(SizeFieldTest, IsToTheBitWhatALookAtAllFinds) {
  constexpr int D = TypeParam::kValue;
  test::SplitMix64& random = this->random_;
  for (const auto& [regions, samples] : std::vector<std::pair<size_t, size_t>>{
           {0, 1}, {1, 0}, {8, 8}, {9, 9}, {0, 100}, {100, 0}, {3, 1000}, {500, 500}}) {
    for (const double growth : {1.0, 0.3, 1e-9}) {
      Sizes<D> sizes = RandomSizes<D>(regions, samples, growth, random);
      sizes.everywhere = regions == 3 ? 0.01 : kInfinity;
      const SizeField<D> field = sizes.Field();
      sizes.Shuffle(random);
      const SizeField<D> shuffled = sizes.Field();
      SizeHint hint;
      for (int i = 0; i < 100; ++i) {
        const Point<D> x = RandomPoint<D>(random);
        const double expected = sizes.AtSq(x);
        ASSERT_EQ(field.AtSq(x), expected);
        ASSERT_EQ(shuffled.AtSq(x), expected);
        const double most = expected * (2 * random.Unit());
        ASSERT_EQ(field.AtSq(x, most), std::min(most, expected));
        ASSERT_EQ(field.AtSq(x, kInfinity, &hint), expected) << "with the hint of another place";
        ASSERT_EQ(field.AtSq(x, most, &hint), std::min(most, expected));
        const double reach = random.Unit();
        ASSERT_EQ(field.LeastAroundSq(x, reach), sizes.LeastAroundSq(x, reach));
      }
    }
  }
}

// Lengths so small that squares are 0, so large that they are nearly infinite, and both.
TYPED_TEST(SizeFieldTest, IsExactAtAllExponents) {
  constexpr int D = TypeParam::kValue;
  test::SplitMix64& random = this->random_;
  Sizes<D> sizes;
  sizes.growth = {1, 0.3};
  const auto length = [&random] { return std::ldexp(1 + random.Unit(), static_cast<int>(random.Next() % 800) - 400); };
  const auto point = [&] {
    Point<D> p;
    for (double& x : p) {
      x = random.Next() % 8 == 0 ? 0 : length();
    }
    return p;
  };
  for (int i = 0; i < 300; ++i) {
    sizes.samples.push_back({point(), length()});
    const Point<D> corner = point();
    sizes.regions.push_back({{corner, corner}, length()});
    sizes.regions.back().place.high[0] += length();
  }
  const SizeField<D> field = sizes.Field();
  for (int i = 0; i < 300; ++i) {
    const Point<D> x = point();
    ASSERT_EQ(field.AtSq(x), sizes.AtSq(x));
    ASSERT_TRUE(std::isfinite(field.AtSq(x)));
  }
}

TYPED_TEST(SizeFieldTest, GrowsNoFasterThanItsGradation) {
  constexpr int D = TypeParam::kValue;
  test::SplitMix64& random = this->random_;
  for (const double growth : {1.0, 0.3, 0.01}) {
    const SizeField<D> field = RandomSizes<D>(20, 200, growth, random).Field();
    for (int i = 0; i < 500; ++i) {
      const Point<D> x = RandomPoint<D>(random);
      Point<D> y = RandomPoint<D>(random);
      if (i % 2 == 0) {
        for (int k = 0; k < D; ++k) {
          y[k] = x[k] + 1e-3 * (random.Unit() - 0.5);
        }
      }
      const double difference = std::abs(std::sqrt(field.AtSq(x)) - std::sqrt(field.AtSq(y)));
      ASSERT_LE(difference, growth * Distance<D>(x, y) + 1e-14);
    }
  }
}

// At each sample it is no larger than the size there, and as large if no other sample asks for less.
TYPED_TEST(SizeFieldTest, IsTheLargestBelowItsSamples) {
  constexpr int D = TypeParam::kValue;
  test::SplitMix64& random = this->random_;
  const Sizes<D> sizes = RandomSizes<D>(0, 300, 0.5, random);
  const SizeField<D> field = sizes.Field();
  int kept = 0;
  for (const auto& [p, size] : sizes.samples) {
    const double h = std::sqrt(field.AtSq(p));
    EXPECT_LE(h, size);
    const bool is_least = std::all_of(
        sizes.samples.begin(), sizes.samples.end(),
        [&, &p = p, &size = size](auto& other) { return size <= other.size + 0.5 * Distance<D>(p, other.place); });
    kept += is_least ? 1 : 0;
    EXPECT_TRUE(!is_least || h > size * (1 - 1e-15));
  }
  EXPECT_GT(kept, 0);
}

TYPED_TEST(SizeFieldTest, RaisedNothingIsBelow) {
  constexpr int D = TypeParam::kValue;
  test::SplitMix64& random = this->random_;
  const Sizes<D> sizes = RandomSizes<D>(50, 50, 1, random);
  SizeField<D> raised = sizes.Field();
  raised.RaiseTo(0.25);
  EXPECT_FALSE(raised == sizes.Field());
  EXPECT_TRUE(sizes.Field() == sizes.Field());
  for (int i = 0; i < 100; ++i) {
    const Point<D> x = RandomPoint<D>(random);
    EXPECT_EQ(raised.AtSq(x), std::max(0.0625, sizes.AtSq(x)));
    EXPECT_EQ(raised.AtSq(x, 0.01), 0.01);
    EXPECT_EQ(raised.LeastAroundSq(x, 0.1), std::max(0.0625, sizes.LeastAroundSq(x, 0.1)));
  }
}

TYPED_TEST(SizeFieldTest, TheLeastInABoxIsNotAboveThatAtItsPlaces) {
  constexpr int D = TypeParam::kValue;
  test::SplitMix64& random = this->random_;
  const Sizes<D> sizes = RandomSizes<D>(30, 30, 0.7, random);
  const SizeField<D> field = sizes.Field();
  for (int i = 0; i < 200; ++i) {
    const Box<D> box = CubeAround<D>(RandomPoint<D>(random), 0.1 * random.Unit());
    double seen = kInfinity;
    for (int j = 0; j < 50; ++j) {
      Point<D> x;
      for (int k = 0; k < D; ++k) {
        x[k] = box.low[k] + random.Unit() * (box.high[k] - box.low[k]);
      }
      seen = std::min(seen, std::sqrt(field.AtSq(x)));
    }
    EXPECT_LE(field.LeastIn(box), seen);
    EXPECT_GE(field.LeastIn(box), seen - 0.7 * std::sqrt(D) * (box.high[0] - box.low[0]));
  }
}

// How many bounds a look takes, of places and of nodes, on average over the unit box; sizes vary smoothly.
template <int D>
double BoundsPerLook(size_t samples, uint64_t seed) {
  test::SplitMix64 random(seed);
  std::vector<SizedPlace<Point<D>>> places(samples);
  for (auto& [p, size] : places) {
    std::generate(p.begin(), p.end(), [&random] { return random.Unit(); });
    size = 0.05 + 0.02 * std::sin(6 * p[0]);
  }
  const SampleTree<D> tree(std::move(places));
  constexpr int kLooks = 1000;
  uint64_t bounds = 0;
  for (int i = 0; i < kLooks; ++i) {
    Point<D> x;
    std::generate(x.begin(), x.end(), [&random] { return random.Unit(); });
    tree.Least(x, kInfinity, [&bounds](double size, double gap_sq) {
      ++bounds;
      return size + 0.3 * std::sqrt(gap_sq);
    });
  }
  return static_cast<double>(bounds) / kLooks;
}

TEST(SizeTree, LooksAtFewOfManyPlaces) {
  EXPECT_LT(BoundsPerLook<2>(40'000, 1), 100);
  EXPECT_LT(BoundsPerLook<3>(40'000, 1), 200);
  EXPECT_LT(BoundsPerLook<2>(40'000, 1), 2 * BoundsPerLook<2>(1'000, 1));
  EXPECT_LT(BoundsPerLook<3>(40'000, 1), 2 * BoundsPerLook<3>(1'000, 1));
}

TEST(SizeField, OfNothingIsUnbounded) {
  EXPECT_TRUE(SizeField<2>().IsUnbounded());
  EXPECT_TRUE(SizeField<2>(kInfinity, {}, std::make_shared<const SampleTree<2>>()).IsUnbounded());
  EXPECT_EQ(SizeField<3>().AtSq({1, 2, 3}), kInfinity);
  EXPECT_FALSE(SizeField<2>(1).IsUnbounded());
  EXPECT_FALSE(SizeField<2>(kInfinity, {{{{0, 0}, {1, 1}}, 1}}).IsUnbounded());
}

}  // namespace
}  // namespace wellspace::core
