#include "tests/support/clouds.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <string>

namespace wellspace::test {
namespace {

using Cloud = std::vector<double>;

constexpr int kMaxDimension = 6;
using Coordinates = std::array<double, kMaxDimension>;

// A direction drawn from the normal distribution, and its length.
double DrawDirection(SplitMix64& random, int d, Coordinates& g) {
  double sum = 0;
  for (int k = 0; k < d; ++k) {
    g[k] = random.Gauss();
  }
  for (int k = 0; k < d; ++k) {
    sum += g[k] * g[k];
  }
  return std::sqrt(sum);
}

// ---- The kinds of bench/make_clouds.py, expression by expression
// ----------------------------------------------------------------

Cloud Uniform(SplitMix64& random, int d, size_t n) {
  Cloud out(n * d);
  std::generate(out.begin(), out.end(), [&] { return random.Unit(); });
  return out;
}

Cloud Inner(SplitMix64& random, int d, size_t n) {
  Cloud out(n * d);
  std::generate(out.begin(), out.end(), [&] { return 0.25 + 0.5 * random.Unit(); });
  return out;
}

Cloud Sphere(SplitMix64& random, int d, size_t n) {
  Cloud out;
  Coordinates g;
  while (out.size() < n * d) {
    const double length = DrawDirection(random, d, g);
    for (int k = 0; k < d && length > 0; ++k) {
      out.push_back(0.5 + 0.35 * g[k] / length);
    }
  }
  return out;
}

Cloud Clusters(SplitMix64& random, int d, size_t n) {
  std::array<Coordinates, 6> centres;
  for (auto& centre : centres) {
    for (int k = 0; k < d; ++k) {
      centre[k] = 0.3 + 0.4 * random.Unit();
    }
  }
  Cloud out;
  while (out.size() < n * d) {
    const int c = static_cast<int>(out.size() / d % 6);
    Coordinates p;
    for (int k = 0; k < d; ++k) {
      p[k] = centres[c][k] + 0.5 * std::pow(10.0, -1 - c) * random.Gauss();
    }
    if (std::all_of(p.begin(), p.begin() + d, [](double x) { return 0 < x && x < 1; })) {
      out.insert(out.end(), p.begin(), p.begin() + d);
    }
  }
  return out;
}

Cloud Skew(SplitMix64& random, int d, size_t n) {
  Cloud out(n * d, 0.5);
  for (size_t i = 0; i < n; ++i) {
    double* p = &out[i * d];
    const double t = 0.2 + 0.6 * (static_cast<double>(i / 2) + 0.1 * random.Unit()) / (static_cast<double>(n) / 2);
    const bool odd = i % 2 == 1;
    p[odd || d == 2 ? 0 : 1] = t;
    p[d - 1] = odd ? 0.3 : 0.7;
  }
  return out;
}

Cloud Moment(SplitMix64&, int d, size_t n) {
  Cloud out;
  for (size_t i = 0; i < n; ++i) {
    for (int k = 0; k < d; ++k) {
      out.push_back(0.1 + 0.8 * std::pow((static_cast<double>(i) + 0.5) / static_cast<double>(n), k + 1));
    }
  }
  return out;
}

Cloud Grid(SplitMix64&, int d, size_t n) {
  const auto side = static_cast<size_t>(std::lround(std::pow(static_cast<double>(n), 1.0 / d)));
  const double spacing = 0.5 / static_cast<double>(std::bit_ceil(side));  // exact
  size_t count = 1;
  for (int k = 0; k < d; ++k) {
    count *= side;
  }
  Cloud out(count * d);
  for (size_t i = 0; i < count; ++i) {
    size_t rest = i;
    for (int k = d - 1; k >= 0; --k) {
      out[i * d + k] = 0.25 + static_cast<double>(rest % side) * spacing;
      rest /= side;
    }
  }
  return out;
}

Cloud Lines(SplitMix64& random, int d, size_t n) {
  std::array<std::array<Coordinates, 2>, 5> segments;
  for (auto& segment : segments) {
    for (auto& end : segment) {
      for (int k = 0; k < d; ++k) {
        end[k] = 0.1 + 0.8 * random.Unit();
      }
    }
  }
  Cloud out;
  for (size_t i = 0; i < n; ++i) {
    const auto& [a, b] = segments[i % 5];
    const double t = random.Unit();
    for (int k = 0; k < d; ++k) {
      out.push_back(a[k] + t * (b[k] - a[k]) + 1e-6 * (random.Unit() - 0.5));
    }
  }
  return out;
}

Cloud Annuli(SplitMix64& random, int d, size_t n) {
  Cloud out;
  Coordinates g;
  for (size_t i = 0; i < n; ++i) {
    const double radius = 0.45 * std::pow(0.5, static_cast<double>(i % 12));
    const double length = DrawDirection(random, d, g);
    for (int k = 0; k < d; ++k) {
      out.push_back(0.5 + radius * g[k] / length);
    }
  }
  return out;
}

// ---- Degenerate kinds
// -----------------------------------------------------------------------------------------------------------

Cloud None(SplitMix64&, int, size_t) { return {}; }

Cloud One(SplitMix64&, int d, size_t) {
  constexpr Coordinates kPoint = {0.3, 0.6, 0.7, 0.4, 0.45, 0.55};
  return {kPoint.begin(), kPoint.begin() + d};
}

Cloud Collinear(SplitMix64& random, int d, size_t n) {
  Cloud out(n * d, 0.5);
  for (size_t i = 0; i < n; ++i) {
    out[i * d] = random.Unit();
  }
  return out;
}

Cloud Diagonal(SplitMix64&, int d, size_t n) {
  const double spacing = 0.5 / static_cast<double>(std::bit_ceil(n));
  Cloud out;
  for (size_t i = 0; i < n; ++i) {
    out.insert(out.end(), d, 0.25 + static_cast<double>(i) * spacing);
  }
  return out;
}

Cloud Coplanar(SplitMix64& random, int d, size_t n) {
  Cloud out = Uniform(random, d, n);
  for (size_t i = 0; i < n; ++i) {
    out[i * d + d - 1] = 0.5;
  }
  return out;
}

// Calls visit(x) for every x of `count` whole numbers >= 0 with a sum below `limit`, the last one counting fastest.
template <typename Visit>
void ForEachBelow(int count, int64_t limit, const Visit& visit, std::vector<int64_t> x = {}) {
  if (count == 0) {
    visit(x);
    return;
  }
  for (int64_t i = 0; i < limit; ++i) {
    x.push_back(i);
    ForEachBelow(count - 1, limit - i, visit, x);
    x.pop_back();
  }
}

Cloud Slanted(SplitMix64&, int d, size_t n) {
  // There are about side^(d - 1) / (d - 1)! points.
  double factorial = 1;
  for (int k = 2; k < d; ++k) {
    factorial *= k;
  }
  const auto side = static_cast<int64_t>(std::pow(static_cast<double>(n) * factorial, 1.0 / (d - 1)));
  const double spacing = 0.5 / static_cast<double>(std::bit_ceil(static_cast<uint64_t>(side)));
  Cloud out;
  ForEachBelow(d - 1, side, [&](const std::vector<int64_t>& x) {
    int64_t rest = side - 1;
    for (const int64_t i : x) {
      out.push_back(0.25 + spacing * static_cast<double>(i));
      rest -= i;
    }
    out.push_back(0.25 + spacing * static_cast<double>(rest));
  });
  return out;
}

Cloud Duplicates(SplitMix64& random, int d, size_t n) {
  const size_t distinct = (n + 3) / 4;
  const Cloud once = Uniform(random, d, distinct);
  Cloud out;
  for (size_t i = 0; i < n; ++i) {
    const auto p = once.begin() + static_cast<std::ptrdiff_t>(i % distinct * d);
    out.insert(out.end(), p, p + d);
  }
  return out;
}

using LatticePoint = std::array<int64_t, kMaxDimension>;

// Appends the lattice points p with p_0^2 + ... + p_axis^2 = rest, whatever the coordinates beyond.
void AppendLatticeSphere(int axis, int64_t radius, int64_t rest, LatticePoint p, std::vector<LatticePoint>& found) {
  if (axis > 0) {
    for (p[axis] = -radius; p[axis] <= radius; ++p[axis]) {
      AppendLatticeSphere(axis - 1, radius, rest - p[axis] * p[axis], p, found);
    }
    return;
  }
  p[0] = std::lround(std::sqrt(static_cast<double>(std::max<int64_t>(rest, 0))));
  if (p[0] * p[0] == rest) {
    found.push_back(p);
    if (p[0] != 0) {
      p[0] = -p[0];
      found.push_back(p);
    }
  }
}

// Lattice points at exactly one distance from the centre of the box; 32045 = 5 * 13 * 17 * 29 makes 324 of them in the
// plane.
Cloud Cospherical(SplitMix64& random, int d, size_t n) {
  constexpr std::array<int64_t, 5> kRadius = {32045, 325, 25, 9, 5};
  constexpr std::array kUnit = {0x1p-17, 0x1p-10, 0x1p-6, 0x1p-5, 0x1p-4};
  const int64_t radius = kRadius[d - 2];
  const double unit = kUnit[d - 2];
  std::vector<LatticePoint> found;
  AppendLatticeSphere(d - 1, radius, radius * radius, {}, found);
  for (size_t i = found.size(); i > 1; --i) {
    std::swap(found[i - 1], found[random.Below(i)]);
  }
  found.resize(std::min(n, found.size()));
  Cloud out;
  for (const auto& p : found) {
    for (int k = 0; k < d; ++k) {
      out.push_back(0.5 + unit * static_cast<double>(p[k]));
    }
  }
  return out;
}

Cloud Boundary(SplitMix64& random, int d, size_t n) {
  Cloud out;
  // Above 3-D in an order in which the first few are of many sorts already.
  const size_t step = d <= 3 ? 1 : 97;
  for (size_t i = 0; i < n; ++i) {
    for (size_t k = 0, rest = step * i; k < static_cast<size_t>(d); ++k, rest /= 3) {
      out.push_back(rest % 3 == 0 ? 0.0 : rest % 3 == 1 ? 1.0 : random.Unit());
    }
  }
  return out;
}

Cloud Rounded(SplitMix64& random, int d, size_t n) {
  Cloud out(n * d);
  std::generate(out.begin(), out.end(), [&] { return std::floor(256 * random.Unit()) / 256; });
  return out;
}

Cloud LogUniform(SplitMix64& random, int d, size_t n) {
  Cloud out;
  Coordinates g;
  for (size_t i = 0; i < n; ++i) {
    const double radius = 0.4 * std::pow(10.0, -9 * (static_cast<double>(i) + random.Unit()) / static_cast<double>(n));
    const double length = DrawDirection(random, d, g);
    for (int k = 0; k < d; ++k) {
      out.push_back(0.5 + radius * g[k] / length);
    }
  }
  return out;
}

using Generator = Cloud (*)(SplitMix64&, int, size_t);

const std::map<std::string_view, Generator>& Generators() {
  static const auto* const generators = new std::map<std::string_view, Generator>{{"uniform", Uniform},
                                                                                  {"inner", Inner},
                                                                                  {"sphere", Sphere},
                                                                                  {"clusters", Clusters},
                                                                                  {"skew", Skew},
                                                                                  {"moment", Moment},
                                                                                  {"grid", Grid},
                                                                                  {"lines", Lines},
                                                                                  {"annuli", Annuli},
                                                                                  {"none", None},
                                                                                  {"one", One},
                                                                                  {"collinear", Collinear},
                                                                                  {"diagonal", Diagonal},
                                                                                  {"coplanar", Coplanar},
                                                                                  {"slanted", Slanted},
                                                                                  {"duplicates", Duplicates},
                                                                                  {"cospherical", Cospherical},
                                                                                  {"boundary", Boundary},
                                                                                  {"rounded", Rounded},
                                                                                  {"log-uniform", LogUniform}};
  return *generators;
}

}  // namespace

uint64_t SplitMix64::Next() {
  state_ += 0x9E3779B97F4A7C15;
  uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
  return z ^ (z >> 31);
}

double SplitMix64::Unit() { return static_cast<double>(Next() >> 11) / 9007199254740992.0; }

double SplitMix64::Gauss() {
  const double radius = std::sqrt(-2 * std::log(1 - Unit()));
  return radius * std::cos(2 * std::numbers::pi * Unit());
}

uint64_t Seed(uint64_t fixed) {
  const char* const text = std::getenv("WELLSPACE_SEED");
  return text == nullptr ? fixed : std::stoull(text);
}

std::vector<std::string_view> AllKinds() {
  std::vector<std::string_view> kinds(kReferenceKinds.begin(), kReferenceKinds.end());
  kinds.insert(kinds.end(), kDegenerateKinds.begin(), kDegenerateKinds.end());
  return kinds;
}

std::vector<std::string_view> SomeKinds(int dimension) {
  if (dimension <= 4) {
    return AllKinds();
  }
  if (dimension == 5) {
    return {"uniform", "grid", "diagonal", "cospherical", "boundary", "log-uniform"};
  }
  return {"cospherical", "boundary"};
}

std::string CloudName(std::string_view kind, int dimension) {
  std::string name(kind);
  std::replace(name.begin(), name.end(), '-', '_');
  return name + "_" + std::to_string(dimension);
}

std::vector<double> MakeCloud(std::string_view kind, int dimension, size_t n) {
  uint64_t letters = 0;
  for (const char c : kind) {
    letters += static_cast<unsigned char>(c);
  }
  SplitMix64 random(letters * 1000003 + static_cast<uint64_t>(dimension) * 101 + n);
  return Generators().at(kind)(random, dimension, n);
}

std::vector<double> Shuffled(const std::vector<double>& cloud, int dimension, uint64_t seed) {
  SplitMix64 random(seed);
  std::vector<double> out = cloud;
  const size_t d = static_cast<size_t>(dimension);
  for (size_t i = out.size() / d; i > 1; --i) {
    const size_t j = random.Below(i);
    for (size_t k = 0; k < d; ++k) {
      std::swap(out[(i - 1) * d + k], out[j * d + k]);
    }
  }
  return out;
}

std::vector<double> UnitLow(int dimension) { return std::vector<double>(dimension, 0.0); }
std::vector<double> UnitHigh(int dimension) { return std::vector<double>(dimension, 1.0); }

}  // namespace wellspace::test
