// A line on a terminal that shows how far work is, how fast it is, and how much longer it takes.
#ifndef WELLSPACE_CLIENT_CLI_PROGRESS_BAR_H_
#define WELLSPACE_CLIENT_CLI_PROGRESS_BAR_H_

#include <cstdint>
#include <string>

#include "client/client.h"
#include "client/time_left.h"

namespace wellspace::cli {

// "1,234,567".
std::string WithThousands(uint64_t number);

// Draws on standard error when that is a terminal; otherwise does nothing. The line goes with the object.
//
// Thread safety: thread-compatible.
class ProgressBar {
 public:
  explicit ProgressBar(bool wanted);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void Update(const client::Progress& progress);
  // The same for other work: its name, how much of it is done, in [0, 1], and that in words.
  void Update(const std::string& phase, double fraction, const std::string& amount);
  void Clear();

 private:
  const bool enabled_;
  client::TimeLeft time_left_;
  std::string phase_;      // to which the rate belongs
  client::MeanRate rate_;  // of vertices
  std::string drawn_;      // the line on the terminal; empty: none
};

// The line without colours and control characters, at most 79 columns wide, whatever the fraction is. `left` is the
// text of the time that is left; empty: not known, or no place for it.
std::string ProgressLine(const std::string& phase, double fraction, const std::string& amount,
                         const std::string& left = "");

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_PROGRESS_BAR_H_
