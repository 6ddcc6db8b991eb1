// Results of the core in measured programs: errors end the process, and meshes have fingerprints.
#ifndef WELLSPACE_BENCH_DRIVERS_RESULTS_H_
#define WELLSPACE_BENCH_DRIVERS_RESULTS_H_

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace wellspace::bench {

// Ends the process with a message unless `status` is OK.
inline void ExitUnless(const absl::Status& status) {
  if (!status.ok()) {
    std::cerr << "wellspace: " << status << '\n';
    std::exit(1);
  }
}

// The value, unless it is an error.
template <typename T>
T OrExit(absl::StatusOr<T> result) {
  ExitUnless(result.status());
  return *std::move(result);
}

inline constexpr uint64_t kFirstHash = 0xcbf29ce484222325;

// FNV-1a of the words of `values`, after `hash`.
template <typename Values>
uint64_t Hash(const Values& values, uint64_t hash) {
  for (const auto value : values) {
    uint64_t word = 0;
    std::memcpy(&word, &value, sizeof(value));
    hash = (hash ^ word) * 0x100000001b3;
  }
  return hash;
}

}  // namespace wellspace::bench

#endif  // WELLSPACE_BENCH_DRIVERS_RESULTS_H_
