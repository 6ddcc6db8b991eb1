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

std::string ProgressLine(const client::Progress& progress) {
  constexpr int kBarColumns = 30;
  const double fraction = std::clamp(progress.fraction, 0.0, 1.0);
  const int filled = static_cast<int>(fraction * kBarColumns);
  std::string line = absl::StrFormat("%-10.12s [%s%s] %3d%%  %s vertices", progress.phase, std::string(filled, '#'),
                                     std::string(kBarColumns - filled, '-'), static_cast<int>(fraction * 100),
                                     WithThousands(progress.vertices));
  return line.substr(0, 79);
}

ProgressBar::ProgressBar(bool wanted) : enabled_(wanted && isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() { Clear(); }

void ProgressBar::Update(const client::Progress& progress) {
  if (enabled_) {
    std::cerr << "\r" << ProgressLine(progress) << "\x1b[K" << std::flush;
    drawn_ = true;
  }
}

void ProgressBar::Clear() {
  if (drawn_) {
    std::cerr << "\r\x1b[K" << std::flush;
    drawn_ = false;
  }
}

}  // namespace wellspace::cli
