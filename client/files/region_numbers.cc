#include "client/files/region_numbers.h"

#include <cmath>
#include <cstddef>
#include <limits>
#include <set>

#include "absl/strings/str_cat.h"
#include "client/formats/io/number.h"

namespace wellspace::client {
namespace {

bool IsRegionNumber(double attribute) {
  return attribute == std::floor(attribute) && std::abs(attribute) <= std::numeric_limits<int32_t>::max();
}

}  // namespace

std::map<double, int32_t> NumberAttributes(const std::string& name, std::span<const double> attributes,
                                           std::vector<std::string>& notes) {
  std::map<double, int32_t> numbers;
  std::set<double> others;
  for (const double attribute : attributes) {
    if (IsRegionNumber(attribute)) {
      numbers[attribute] = static_cast<int32_t>(attribute);
    } else {
      others.insert(attribute);
    }
  }
  constexpr size_t kNamed = 10;
  std::string named;
  int32_t next = 1;
  size_t count = 0;
  for (const double attribute : others) {
    while (numbers.contains(next)) {
      ++next;
    }
    numbers[attribute] = next;
    if (count++ < kNamed) {
      absl::StrAppend(&named, count == 1 ? "" : ", ");
      formats::AppendNumber(attribute, named);
      absl::StrAppend(&named, " region ", next);
    }
  }
  if (count > 0) {
    notes.push_back(absl::StrCat(name, ": attributes that are no whole numbers of 32 bits become regions by ",
                                 "numbers of their own: ", named, count > kNamed ? ", ..." : ""));
  }
  return numbers;
}

std::string UnusedSeedNote(const std::string& origin, bool is_hole, const std::string& place, uint64_t count) {
  const uint64_t others = count - 1;
  return absl::StrCat(origin, ": the ", is_hole ? "hole" : "region", " at (", place,
                      ") lies outside of what is meshed, and means nothing",
                      others == 0 ? ""
                                  : absl::StrCat("; and so ", others == 1 ? "does " : "do ", others,
                                                 others == 1 ? " other" : " others"));
}

}  // namespace wellspace::client
