#include "tests/support/adversarial_clouds.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/tree/morton.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"

namespace wellspace::test {
namespace {

using core::Box;
using core::Point;

template <int D>
using Cloud = std::vector<Point<D>>;

// 10^-first to 10^-last, evenly in the logarithm.
double LogUniform(SplitMix64& random, double first, double last) {
  return std::pow(10.0, -(first + (last - first) * random.Unit()));
}

template <int D>
Point<D> Anywhere(SplitMix64& random) {
  Point<D> p;
  std::generate(p.begin(), p.end(), [&] { return random.Unit(); });
  return p;
}

template <int D>
Point<D> Direction(SplitMix64& random) {
  Point<D> p;
  double norm = 0;
  while (!(norm > 0)) {
    std::generate(p.begin(), p.end(), [&] { return random.Gauss(); });
    norm = std::sqrt(core::NormSq<D>(p));
  }
  for (double& x : p) {
    x /= norm;
  }
  return p;
}

template <int D>
Point<D> Moved(Point<D> p, const Point<D>& direction, double by) {
  for (int k = 0; k < D; ++k) {
    p[k] += by * direction[k];
  }
  return p;
}

template <int D>
Cloud<D> NearFaces(SplitMix64& random, size_t n) {
  Cloud<D> out(n);
  for (Point<D>& p : out) {
    p = Anywhere<D>(random);
    const double gap = LogUniform(random, 1, 12);
    p[random.Below(D)] = random.Below(2) == 0 ? gap : 1 - gap;
  }
  return out;
}

template <int D>
Cloud<D> NearCorners(SplitMix64& random, size_t n) {
  Cloud<D> out(n);
  for (Point<D>& p : out) {
    for (double& x : p) {
      const double gap = LogUniform(random, 0.5, 12);
      x = random.Below(2) == 0 ? gap : 1 - gap;
    }
  }
  return out;
}

template <int D>
Cloud<D> Pairs(SplitMix64& random, size_t n) {
  Cloud<D> out;
  while (out.size() + 1 < n) {
    const Point<D> p = Anywhere<D>(random);
    out.push_back(p);
    out.push_back(Moved<D>(p, Direction<D>(random), LogUniform(random, 1, 12)));
  }
  return out;
}

template <int D>
Cloud<D> Closest(SplitMix64& random, size_t n) {
  const double least = LeastSeparation<D>(UnitBox<D>());
  Cloud<D> out;
  while (out.size() + 1 < n) {
    Point<D> p = Anywhere<D>(random);
    switch (out.size() % 3) {
      case 0: {
        out.push_back(p);
        p[random.Below(D)] += least;
        break;
      }
      case 1:
        p[random.Below(D)] = random.Below(2) == 0 ? least : 1 - least;
        break;
      default:
        for (double& x : p) {
          x = random.Below(2) == 0 ? least : 1 - least;
        }
    }
    out.push_back(p);
  }
  return out;
}

template <int D>
Cloud<D> Diagonals(SplitMix64& random, size_t n) {
  Cloud<D> out(n);
  for (Point<D>& p : out) {
    // A multiple of 2^-30, so that 1 - t is exact.
    const double t = std::ldexp(std::floor(std::ldexp(random.Unit(), 30)), -30);
    const uint64_t flips = random.Below(uint64_t{1} << (D - 1));
    for (int k = 0; k < D; ++k) {
      p[k] = ((flips >> k) & 1) != 0 ? 1 - t : t;
    }
  }
  return out;
}

template <int D>
Cloud<D> Wedge(SplitMix64& random, size_t n) {
  Cloud<D> out(n);
  for (size_t i = 0; i < n; ++i) {
    const double t = random.Unit();
    out[i].fill(0.4);
    out[i][0] = 0.1 + 0.8 * t;
    out[i][1] += i % 2 == 0 ? 0.0 : 8e-4 * t;
  }
  return out;
}

template <int D>
Cloud<D> Sheets(SplitMix64& random, size_t n) {
  Cloud<D> out(n);
  for (size_t i = 0; i < n; ++i) {
    out[i] = Anywhere<D>(random);
    out[i][D - 1] = i % 2 == 0 ? 0.5 : 0.5001;
  }
  return out;
}

template <int D>
Cloud<D> Perturbed(SplitMix64& random, size_t n) {
  Cloud<D> out = ToPoints<D>(MakeCloud("grid", D, n));
  if (out.size() > 1) {
    const double spacing = std::sqrt(core::DistanceSq<D>(out[0], out[1]));
    Point<D>& p = out[random.Below(out.size())];
    p = Moved<D>(p, Direction<D>(random), 1e-9 * spacing);
  }
  return out;
}

template <int D>
Cloud<D> OfKind(std::string_view kind, size_t n, SplitMix64& random);

template <int D>
Cloud<D> OfAllKinds(SplitMix64& random, size_t n) {
  Cloud<D> out;
  const size_t each = n / (kAdversarialKinds.size() - 1) + 2;
  for (const std::string_view kind : kAdversarialKinds) {
    if (kind != "kinds") {
      Cloud<D> some = OfKind<D>(kind, each, random);
      some.resize(std::min(some.size(), each));
      out.insert(out.end(), some.begin(), some.end());
    }
  }
  return out;
}

template <int D>
Cloud<D> OfKind(std::string_view kind, size_t n, SplitMix64& random) {
  using Generator = Cloud<D> (*)(SplitMix64&, size_t);
  constexpr std::array<std::pair<std::string_view, Generator>, 9> kGenerators = {{{"near-faces", NearFaces<D>},
                                                                                  {"near-corners", NearCorners<D>},
                                                                                  {"pairs", Pairs<D>},
                                                                                  {"closest", Closest<D>},
                                                                                  {"diagonals", Diagonals<D>},
                                                                                  {"wedge", Wedge<D>},
                                                                                  {"sheets", Sheets<D>},
                                                                                  {"perturbed", Perturbed<D>},
                                                                                  {"kinds", OfAllKinds<D>}}};
  for (const auto& [name, generator] : kGenerators) {
    if (name == kind) {
      return generator(random, n);
    }
  }
  // The clouds of clouds.h draw other points for another number of them.
  return ToPoints<D>(MakeCloud(kind, D, n + random.Below(4)));
}

}  // namespace

template <int D>
std::vector<Point<D>> AdversarialCloud(std::string_view kind, size_t n, uint64_t seed) {
  uint64_t mixed = seed;
  for (const char c : kind) {
    mixed = mixed * 1000003 + static_cast<unsigned char>(c);
  }
  SplitMix64 random(mixed * 101 + D);
  return OfKind<D>(kind, n, random);
}

template <int D>
double LeastSeparation(const Box<D>& box) {
  return 64 * core::MortonGrid<D>(box).step();
}

template <int D>
Box<D> BoxAround(const std::vector<Point<D>>& points, double margin) {
  if (points.empty()) {
    return UnitBox<D>();
  }
  Box<D> box{points[0], points[0]};
  for (const Point<D>& p : points) {
    for (int k = 0; k < D; ++k) {
      box.low[k] = std::min(box.low[k], p[k]);
      box.high[k] = std::max(box.high[k], p[k]);
    }
  }
  const double longest = box.LongestSide() > 0 ? box.LongestSide() : 1.0;
  for (int k = 0; k < D; ++k) {
    const bool is_flat = box.high[k] - box.low[k] < 0.01 * longest;
    const double by = longest * (is_flat ? std::max(margin, 0.5) : margin);
    box.low[k] -= by;
    box.high[k] += by;
  }
  return box;
}

template <int D>
std::vector<Point<D>> Accepted(const Box<D>& box, const std::vector<Point<D>>& points) {
  const double least = LeastSeparation<D>(box);
  const auto is_clear = [&](const Point<D>& p, const Point<D>& q) {
    return core::DistanceSq<D>(p, q) >= least * least;
  };
  std::vector<Point<D>> out;
  for (const Point<D>& p : points) {
    bool is_apart = box.Contains(p);
    Point<D> corner;  // the nearest
    for (int k = 0; k < D; ++k) {
      const double low = box.DistanceToFace(p, core::FaceIndex(k, false));
      const double high = box.DistanceToFace(p, core::FaceIndex(k, true));
      is_apart = is_apart && (low == 0 || low >= least) && (high == 0 || high >= least);
      corner[k] = low < high ? box.low[k] : box.high[k];
    }
    is_apart = is_apart && (p == corner || is_clear(p, corner));
    if (is_apart && std::all_of(out.begin(), out.end(), [&](const Point<D>& q) { return is_clear(p, q); })) {
      out.push_back(p);
    }
  }
  return MortonSorted<D>(box, std::move(out));
}

#define WELLSPACE_INSTANTIATE(D)                                                          \
  template std::vector<Point<D>> AdversarialCloud<D>(std::string_view, size_t, uint64_t); \
  template double LeastSeparation<D>(const Box<D>&);                                      \
  template Box<D> BoxAround<D>(const std::vector<Point<D>>&, double);                     \
  template std::vector<Point<D>> Accepted<D>(const Box<D>&, const std::vector<Point<D>>&)
WELLSPACE_INSTANTIATE(2);
WELLSPACE_INSTANTIATE(3);
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::test
