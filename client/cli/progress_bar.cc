#include "client/cli/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <iostream>

#include "absl/strings/str_format.h"

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

std::string ProgressLine(const std::string& phase, double fraction, const std::string& amount) {
  constexpr int kBarColumns = 30;
  const double part = fraction > 0 ? std::min(fraction, 1.0) : 0;  // also for NaN
  const int filled = static_cast<int>(part * kBarColumns);
  std::string line = absl::StrFormat("%-10.12s [%s%s] %3d%%  %s", phase, std::string(filled, '#'),
                                     std::string(kBarColumns - filled, '-'), static_cast<int>(part * 100), amount);
  return line.substr(0, 79);
}

std::string ProgressLine(const client::Progress& progress) {
  return ProgressLine(progress.phase, progress.fraction, WithThousands(progress.vertices) + " vertices");
}

ProgressBar::ProgressBar(bool wanted) : enabled_(wanted && isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() { Clear(); }

void ProgressBar::Update(const client::Progress& progress) { Draw(ProgressLine(progress)); }

void ProgressBar::Update(const std::string& phase, double fraction, const std::string& amount) {
  Draw(ProgressLine(phase, fraction, amount));
}

void ProgressBar::Draw(const std::string& line) {
  if (enabled_ && line != drawn_) {
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
