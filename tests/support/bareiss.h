// Exact determinants by elimination, as an oracle for those by expansion.
#ifndef WELLSPACE_TESTS_SUPPORT_BAREISS_H_
#define WELLSPACE_TESTS_SUPPORT_BAREISS_H_

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <utility>

namespace wellspace::test {

// Complexity: O(N^3) operations on integers.
// Source:     E. H. Bareiss, Sylvester's identity and multistep integer-preserving Gaussian elimination, 1968.
template <size_t N>
boost::multiprecision::cpp_int BareissDeterminant(std::array<std::array<boost::multiprecision::cpp_int, N>, N> m) {
  boost::multiprecision::cpp_int previous = 1;
  int sign = 1;
  for (size_t k = 0; k + 1 < N; ++k) {
    size_t pivot = k;
    while (pivot < N && m[pivot][k] == 0) {
      ++pivot;
    }
    if (pivot == N) {
      return 0;
    }
    if (pivot != k) {
      std::swap(m[pivot], m[k]);
      sign = -sign;
    }
    for (size_t i = k + 1; i < N; ++i) {
      for (size_t j = k + 1; j < N; ++j) {
        m[i][j] = (m[i][j] * m[k][k] - m[i][k] * m[k][j]) / previous;
      }
    }
    previous = m[k][k];
  }
  return sign * m[N - 1][N - 1];
}

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_BAREISS_H_
