#include "client/cli/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"

namespace wellspace::cli {

std::string WithThousands(uint64_t number) {
  const std::string digits = std::to_string(number);
  std::string text;
  for (size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) {
      text += ',';
    }
    text += digits[i];
  }
  return text;
}

std::string ProgressLine(const std::string& phase, double fraction, const std::string& amount,
                         const std::string& left) {
  constexpr size_t kColumns = 79;
  constexpr int kBarColumns = 16;
  const double part = fraction > 0 ? std::min(fraction, 1.0) : 0;  // also for NaN
  const int filled = static_cast<int>(part * kBarColumns);
  const std::string line =
      absl::StrFormat("%-10.12s [%s%s] %3d%%  %s", phase, std::string(filled, '#'),
                      std::string(kBarColumns - filled, '-'), static_cast<int>(part * 100), amount);
  const std::string with_time = left.empty() ? line : absl::StrCat(line, ", ", left, " left");
  return with_time.size() <= kColumns ? with_time : line.substr(0, kColumns);
}

ProgressBar::ProgressBar(bool wanted) : enabled_(wanted && isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() { Clear(); }

void ProgressBar::Update(const client::Progress& progress) {
  if (phase_ != progress.phase) {
    phase_ = progress.phase;
    rate_ = client::MeanRate();
  }
  const std::optional<double> rate = rate_.At(progress.vertices, absl::Now());
  Update(progress.phase, progress.fraction,
         absl::StrCat(WithThousands(progress.vertices), " vertices",
                      rate.has_value() ? absl::StrCat(", ", WithThousands(std::llround(*rate)), "/s") : ""));
}

void ProgressBar::Update(const std::string& phase, double fraction, const std::string& amount) {
  if (!enabled_) {
    return;
  }
  const std::optional<absl::Duration> left = time_left_.At(fraction, absl::Now());
  const std::string line = ProgressLine(phase, fraction, amount, left ? client::TimeText(*left) : "");
  if (line != drawn_) {
    std::cerr << "\r" << line << "\x1b[K" << std::flush;
    drawn_ = line;
  }
}

void ProgressBar::Clear() {
  if (!drawn_.empty()) {
    std::cerr << "\r\x1b[K" << std::flush;
    drawn_.clear();
  }
}

}  // namespace wellspace::cli
