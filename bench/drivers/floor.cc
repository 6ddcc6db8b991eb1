#include "bench/drivers/floor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "bench/drivers/meter.h"

namespace wellspace::bench {
namespace {

constexpr int kDigitBits = 8;
constexpr int kDigits = 1 << kDigitBits;
constexpr int kPasses = 64 / kDigitBits;

}  // namespace

std::vector<Keyed> MortonKeys(std::span<const double> points, int dimension) {
  const int bits = 64 / dimension;
  const double cubes = std::ldexp(1.0, bits);
  std::vector<Keyed> keyed(points.size() / dimension);
  for (size_t i = 0; i < keyed.size(); ++i) {
    uint64_t key = 0;
    for (int axis = 0; axis < dimension; ++axis) {
      const auto place = static_cast<uint64_t>(std::min(points[i * dimension + axis] * cubes, cubes - 1));
      for (int bit = 0; bit < bits; ++bit) {
        key |= ((place >> bit) & 1) << (bit * dimension + axis);
      }
    }
    keyed[i] = {key, static_cast<uint32_t>(i)};
  }
  return keyed;
}

void RadixSort(std::vector<Keyed>& keyed, std::vector<Keyed>& scratch) {
  std::array<std::array<uint32_t, kDigits>, kPasses> next{};
  for (const Keyed& entry : keyed) {
    for (int pass = 0; pass < kPasses; ++pass) {
      ++next[pass][(entry.key >> (pass * kDigitBits)) % kDigits];
    }
  }
  for (auto& place : next) {
    uint32_t before = 0;
    for (uint32_t& count : place) {
      count = std::exchange(before, before + count);
    }
  }
  for (int pass = 0; pass < kPasses; ++pass) {
    for (const Keyed& entry : keyed) {
      scratch[next[pass][(entry.key >> (pass * kDigitBits)) % kDigits]++] = entry;
    }
    keyed.swap(scratch);
  }
}

double SortSeconds(std::span<const double> points, int dimension) {
  std::vector<Keyed> keyed = MortonKeys(points, dimension);
  std::vector<Keyed> scratch(keyed.size());
  const Meter meter;
  RadixSort(keyed, scratch);
  return meter.Seconds();
}

double CopySeconds(std::span<const double> points, std::span<const uint32_t> simplices) {
  std::vector<double> points_copy(points.size());
  std::vector<uint32_t> simplices_copy(simplices.size());
  const Meter meter;
  std::copy(points.begin(), points.end(), points_copy.begin());
  std::copy(simplices.begin(), simplices.end(), simplices_copy.begin());
  // A program could look at them now.
  asm volatile("" : : "r"(points_copy.data()), "r"(simplices_copy.data()) : "memory");
  return meter.Seconds();
}

}  // namespace wellspace::bench
