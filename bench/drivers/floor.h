// The least that any mesher has to do: sort its input, write its output.
#ifndef WELLSPACE_BENCH_DRIVERS_FLOOR_H_
#define WELLSPACE_BENCH_DRIVERS_FLOOR_H_

#include <cstdint>
#include <span>
#include <vector>

namespace wellspace::bench {

struct Keyed {
  uint64_t key = 0;
  uint32_t index = 0;
};

// The places of the points of the unit box on the Z curve, of 64 / dimension bits an axis.
//
// Shapes:     points: n x dimension, row-major, in [0, 1].
std::vector<Keyed> MortonKeys(std::span<const double> points, int dimension);

// Sorts by key, least significant digit first; `scratch` is as long as `keyed`.
//
// Complexity: O(n): eight passes.
void RadixSort(std::vector<Keyed>& keyed, std::vector<Keyed>& scratch);

// The time of a radix sort of the points' keys, which are there already, as is the memory.
double SortSeconds(std::span<const double> points, int dimension);

// The time of copying both arrays to memory that is there already.
double CopySeconds(std::span<const double> points, std::span<const uint32_t> simplices);

}  // namespace wellspace::bench

#endif  // WELLSPACE_BENCH_DRIVERS_FLOOR_H_
