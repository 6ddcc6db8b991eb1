// The minors of a matrix, by a dynamic programme over subsets of its rows.
#ifndef WELLSPACE_CORE_GEOMETRY_MINORS_H_
#define WELLSPACE_CORE_GEOMETRY_MINORS_H_

#include <array>
#include <bit>
#include <cstdint>

namespace wellspace::core {

constexpr int Binomial(int n, int k) { return k == 0 ? 1 : Binomial(n - 1, k - 1) * n / k; }

// How the minor of K rows and the first K columns follows from minors of K - 1: expansion by the last of its columns.
// Subsets of K of the N rows, as bit masks, count in ascending order.
template <int N, int K>
struct Expansion {
  struct Term {
    uint8_t row;   // of the factor
    uint8_t rest;  // the number of the subset without that row
  };
  static constexpr int kSubsets = Binomial(N, K);
  std::array<std::array<Term, K>, kSubsets> terms{};  // term t has the sign (-1)^(t + K - 1)
};

template <int N, int K>
constexpr Expansion<N, K> MakeExpansion() {
  std::array<uint8_t, 1 << N> number{};  // among the subsets of as many rows
  std::array<uint8_t, N + 1> count{};
  for (unsigned mask = 0; mask < (1u << N); ++mask) {
    number[mask] = count[static_cast<size_t>(std::popcount(mask))]++;
  }
  Expansion<N, K> expansion;
  for (unsigned mask = 0; mask < (1u << N); ++mask) {
    if (std::popcount(mask) == K) {
      for (int row = 0, t = 0; row < N; ++row) {
        if (((mask >> row) & 1) != 0) {
          expansion.terms[number[mask]][static_cast<size_t>(t++)] = {static_cast<uint8_t>(row),
                                                                     number[mask & ~(1u << row)]};
        }
      }
    }
  }
  return expansion;
}

template <int N, int K>
inline constexpr Expansion<N, K> kExpansion = MakeExpansion<N, K>();

// The minors of every K of the N rows of `entries` and their first K columns, in the order of Expansion.
//
// Ring has the types Entry and Minor<K>, in which a minor of K rows fits, ToMinor(entry) -> Minor<1>, and
// AddProduct(sum, entry, negate, minor): sum += or -= entry * minor for a Minor<K> and a Minor<K - 1>.
//
// Complexity: sum of k C(N, k) for k <= K products; N 2^(N-1) in all for K = N, where expansion without remembering
//             takes e N!.
// Source:     Laplace's expansion, each minor computed once.
template <typename Ring, int K, size_t N, size_t Columns>
std::array<typename Ring::template Minor<K>, Binomial(N, K)> MinorsOf(
    const std::array<std::array<typename Ring::Entry, Columns>, N>& entries) {
  static_assert(K <= Columns && K <= N);
  std::array<typename Ring::template Minor<K>, Binomial(N, K)> minors{};
  if constexpr (K == 1) {
    for (size_t row = 0; row < N; ++row) {
      minors[row] = Ring::ToMinor(entries[row][0]);
    }
  } else {
    const auto smaller = MinorsOf<Ring, K - 1, N, Columns>(entries);
    constexpr const auto& kTerms = kExpansion<N, K>.terms;
    for (size_t subset = 0; subset < kTerms.size(); ++subset) {
      for (size_t t = 0; t < K; ++t) {
        const auto [row, rest] = kTerms[subset][t];
        Ring::AddProduct(minors[subset], entries[row][K - 1], (t + K - 1) % 2 == 1, smaller[rest]);
      }
    }
  }
  return minors;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_MINORS_H_
