// The time that work still takes, by its progress so far and its speed.
#ifndef WELLSPACE_CLIENT_TIME_LEFT_H_
#define WELLSPACE_CLIENT_TIME_LEFT_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/time/time.h"

namespace wellspace::client {

// Thread safety: thread-compatible.
class TimeLeft {
 public:
  // Takes note that `fraction` of the work is done at `now`, and says how much longer the rest takes at the mean speed
  // from the first fraction above 0 on. Nothing before two seconds and two percent of the work, which say too little;
  // nothing of a fraction that is no number, and at the end.
  std::optional<absl::Duration> At(double fraction, absl::Time now);

 private:
  double first_fraction_ = 0;
  absl::Time start_ = absl::InfinitePast();  // no fraction above 0 yet
};

// Thread safety: thread-compatible.
class MeanRate {
 public:
  // Takes note that there are `amount` things at `now`, and says how many came in a second, on average since the first
  // note. Nothing before half a second, or where none came.
  std::optional<double> At(uint64_t amount, absl::Time now);

 private:
  std::optional<uint64_t> first_;
  absl::Time start_;
};

// "12 s", "5 min", "2 h 5 min"; rounded up. Empty above 99 hours.
std::string TimeText(absl::Duration time);

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_TIME_LEFT_H_
