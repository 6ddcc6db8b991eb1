// Point clouds for tests: the clouds of bench/make_clouds.py, number by number, and degenerate ones.
#ifndef WELLSPACE_TESTS_SUPPORT_CLOUDS_H_
#define WELLSPACE_TESTS_SUPPORT_CLOUDS_H_

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace wellspace::test {

// The generator of bench/make_clouds.py: every machine draws the same numbers.
class SplitMix64 {
 public:
  explicit SplitMix64(uint64_t seed) : state_(seed) {}

  uint64_t Next();
  double Unit();   // uniform in [0, 1), a multiple of 2^-53
  double Gauss();  // standard normal
  uint64_t Below(uint64_t bound) { return Next() % bound; }

 private:
  uint64_t state_;
};

// `fixed`, or the number in the environment variable WELLSPACE_SEED. Tests print it in a SCOPED_TRACE.
uint64_t Seed(uint64_t fixed);

inline constexpr std::array<std::string_view, 9> kReferenceKinds = {"uniform", "inner", "sphere", "clusters", "skew",
                                                                    "moment",  "grid",  "lines",  "annuli"};

// none, one: no point, one. collinear: on a line parallel to an axis; diagonal: on a diagonal of the box, evenly.
// coplanar: in x_last = 1/2 (2-D: as collinear); slanted: where the coordinates sum up to a constant, on a lattice.
// duplicates: each point four times. cospherical: exactly on one circle or sphere. boundary: on faces, edges and
// corners of the box and inside. rounded: to 8 bits. log-uniform: distances to the centre spread evenly over nine
// decades.
inline constexpr std::array<std::string_view, 11> kDegenerateKinds = {
    "none",       "one",         "collinear", "diagonal", "coplanar",   "slanted",
    "duplicates", "cospherical", "boundary",  "rounded",  "log-uniform"};

// Both lists in one.
std::vector<std::string_view> AllKinds();

// As many of them as a dimension has time for: all up to 4-D; in 5-D a cell takes 10 times as long, in 6-D 100 times.
std::vector<std::string_view> SomeKinds(int dimension);

// A name for a test about such a cloud: letters, digits and underscores.
std::string CloudName(std::string_view kind, int dimension);

// A cloud in the unit box of about n points (grid, one, none, slanted: as many as fit), row-major.
//
// REQUIRES:   kind is one of the above; dimension is 2 to 6.
std::vector<double> MakeCloud(std::string_view kind, int dimension, size_t n);

// The same points in another order.
std::vector<double> Shuffled(const std::vector<double>& cloud, int dimension, uint64_t seed);

// The corners of the unit box.
std::vector<double> UnitLow(int dimension);
std::vector<double> UnitHigh(int dimension);

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_CLOUDS_H_
