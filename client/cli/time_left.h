// How much longer work takes, by how far it is.
#ifndef WELLSPACE_CLIENT_CLI_TIME_LEFT_H_
#define WELLSPACE_CLIENT_CLI_TIME_LEFT_H_

#include <optional>
#include <string>

#include "absl/time/time.h"

namespace wellspace::cli {

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

// "12 s", "5 min", "2 h 5 min"; rounded up. Empty above 99 hours, of which nobody knows.
std::string TimeText(absl::Duration time);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_TIME_LEFT_H_
