// Tables of formats: a row for each, chosen by name or by the extension of a file.
#ifndef WELLSPACE_CLIENT_FORMATS_REGISTRY_H_
#define WELLSPACE_CLIENT_FORMATS_REGISTRY_H_

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/formats/io/number.h"

namespace wellspace::formats {

template <typename Handler>
struct Format {
  std::string name;
  std::vector<std::string> extensions;  // lower case, with the dot
  Handler handler;
};

// The extension of `path` in lower case, with its dot; empty when it has none.
inline std::string ExtensionOf(const std::string& path) {
  const size_t slash = path.find_last_of('/');
  const size_t dot = path.find_last_of('.');
  const bool has_extension = dot != std::string::npos && (slash == std::string::npos || dot > slash);
  return has_extension ? absl::AsciiStrToLower(path.substr(dot)) : std::string();
}

// The row called `name` or, when that is empty, the row of the extension of `path`.
//
// Errors:     INVALID_ARGUMENT with what would be accepted.
template <typename Handler>
absl::StatusOr<const Format<Handler>*> FindFormat(std::span<const Format<Handler>> formats, const std::string& path,
                                                  const std::string& name) {
  const std::string extension = ExtensionOf(path);
  std::vector<std::string> accepted;
  for (const Format<Handler>& format : formats) {
    for (const std::string& candidate : format.extensions) {
      if (name.empty() && candidate == extension) {
        return &format;
      }
    }
    if (format.name == name) {
      return &format;
    }
    if (name.empty()) {
      accepted.insert(accepted.end(), format.extensions.begin(), format.extensions.end());
    } else {
      accepted.push_back(format.name);
    }
  }
  return absl::InvalidArgumentError(
      name.empty() ? absl::StrCat(path, ": no format is known by the extension ", Quote(extension),
                                  "; expected one of ", absl::StrJoin(accepted, ", "), ", or the name of a format")
                   : absl::StrCat(path, ": no format is called ", Quote(name), "; expected one of ",
                                  absl::StrJoin(accepted, ", ")));
}

template <typename Handler>
std::vector<std::string> FormatNames(std::span<const Format<Handler>> formats) {
  std::vector<std::string> names;
  for (const Format<Handler>& format : formats) {
    names.push_back(format.name);
  }
  return names;
}

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_REGISTRY_H_
