#include "client/formats/labels.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

namespace wellspace::formats {
namespace {

constexpr size_t kMaxLabelBytes = 80;  // Abaqus takes no more

}  // namespace

std::string Labels::Take(std::string_view name, std::string_view kind, int32_t number) {
  std::string label =
      name.empty() ? absl::StrCat(absl::string_view(kind.data(), kind.size()), "_", number) : std::string(name);
  for (char& c : label) {
    if (!absl::ascii_isalnum(c) && c != '_' && c != '-' && c != '.') {
      c = '_';
    }
  }
  if (!absl::ascii_isalpha(label[0]) && label[0] != '_') {
    label = absl::StrCat("_", label);
  }
  label.resize(std::min(label.size(), kMaxLabelBytes));
  // Others may have become the same: then the number tells them apart, and if that is taken, underscores.
  std::string suffix;
  while (!taken_.insert(absl::AsciiStrToLower(absl::StrCat(label.substr(0, kMaxLabelBytes - suffix.size()), suffix)))
              .second) {
    suffix = suffix.empty() ? absl::StrCat("_", number) : absl::StrCat("_", suffix);
    suffix.resize(std::min(suffix.size(), kMaxLabelBytes - 1));
  }
  label = absl::StrCat(label.substr(0, kMaxLabelBytes - suffix.size()), suffix);
  if (!name.empty()) {
    changes_.Add(name, label);
  }
  return label;
}

std::string Labels::ChangesNote() const {
  return changes_.Note(absl::StrCat("names are labels of letters, digits, _, - and ., of at most ", kMaxLabelBytes,
                                    " characters, and no two alike but for the case"));
}

}  // namespace wellspace::formats
