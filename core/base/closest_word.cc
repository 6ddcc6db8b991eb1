#include "core/base/closest_word.h"

#include <algorithm>

namespace wellspace::core {

size_t EditDistance(std::string_view a, std::string_view b) {
  // Row i has the distances of the first i characters of `a` from the starts of `b`.
  std::vector<std::vector<size_t>> distance(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) {
    for (size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        distance[i][j] = i + j;
        continue;
      }
      const size_t replaced = distance[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      distance[i][j] = std::min({replaced, distance[i - 1][j] + 1, distance[i][j - 1] + 1});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        distance[i][j] = std::min(distance[i][j], distance[i - 2][j - 2] + 1);
      }
    }
  }
  return distance[a.size()][b.size()];
}

std::string ClosestWord(std::string_view word, const std::vector<std::string>& candidates) {
  constexpr size_t kLongest = 100;  // no word that is meant has more characters
  if (word.empty() || word.size() > kLongest) {
    return {};
  }
  const std::string* closest = nullptr;
  size_t least = std::max<size_t>(1, word.size() / 3) + 1;
  const std::string* longer = nullptr;
  int longer_count = 0;
  for (const std::string& candidate : candidates) {
    if (const size_t distance = EditDistance(word, candidate); distance < least) {
      least = distance;
      closest = &candidate;
    }
    if (candidate.compare(0, word.size(), word.data(), word.size()) == 0) {
      longer = &candidate;
      ++longer_count;
    }
  }
  if (longer_count == 1) {
    return *longer;
  }
  return closest == nullptr ? std::string() : *closest;
}

}  // namespace wellspace::core
