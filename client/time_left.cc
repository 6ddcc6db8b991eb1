#include "client/time_left.h"

#include <cstdint>

#include "absl/strings/str_cat.h"

namespace wellspace::client {

std::optional<absl::Duration> TimeLeft::At(double fraction, absl::Time now) {
  constexpr double kLeastFraction = 0.02;
  constexpr absl::Duration kLeastTime = absl::Seconds(2);
  if (!(fraction > 0 && fraction < 1)) {
    return std::nullopt;
  }
  if (start_ == absl::InfinitePast()) {
    start_ = now;
    first_fraction_ = fraction;
  }
  const double done = fraction - first_fraction_;
  const absl::Duration taken = now - start_;
  if (done < kLeastFraction || taken < kLeastTime) {
    return std::nullopt;
  }
  return taken * ((1 - fraction) / done);
}

std::optional<double> MeanRate::At(uint64_t amount, absl::Time now) {
  constexpr absl::Duration kLeastTime = absl::Milliseconds(500);
  if (!first_.has_value()) {
    first_ = amount;
    start_ = now;
  }
  const absl::Duration taken = now - start_;
  if (taken < kLeastTime || amount <= *first_) {
    return std::nullopt;
  }
  return static_cast<double>(amount - *first_) / absl::ToDoubleSeconds(taken);
}

std::string TimeText(absl::Duration time) {
  const int64_t seconds = absl::ToInt64Seconds(absl::Ceil(time, absl::Seconds(1)));
  const int64_t minutes = (seconds + 59) / 60;
  if (seconds < 60) {
    return absl::StrCat(seconds, " s");
  }
  if (minutes < 60) {
    return absl::StrCat(minutes, " min");
  }
  return minutes < 100 * 60 ? absl::StrCat(minutes / 60, " h ", minutes % 60, " min") : std::string();
}

}  // namespace wellspace::client
