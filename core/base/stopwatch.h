// A stopwatch, which measures times of work.
#ifndef WELLSPACE_CORE_BASE_STOPWATCH_H_
#define WELLSPACE_CORE_BASE_STOPWATCH_H_

#include "absl/time/clock.h"
#include "absl/time/time.h"

namespace wellspace::core {

// Adds the time that it lives, less the time that another clock has counted meanwhile, to a number of seconds.
//
// Thread safety: thread-compatible.
class Stopwatch {
 public:
  // REQUIRES:   both numbers outlive this.
  Stopwatch(double& seconds, const double& other)
      : seconds_(seconds), other_(other), other_before_(other), start_(absl::Now()) {}
  ~Stopwatch() { seconds_ += absl::ToDoubleSeconds(absl::Now() - start_) - (other_ - other_before_); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& seconds_;
  const double& other_;
  const double other_before_;
  const absl::Time start_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_STOPWATCH_H_
