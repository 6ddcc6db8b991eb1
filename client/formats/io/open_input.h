// A file, opened to be read in one of several formats, and compressed or not.
#ifndef WELLSPACE_CLIENT_FORMATS_IO_OPEN_INPUT_H_
#define WELLSPACE_CLIENT_FORMATS_IO_OPEN_INPUT_H_

#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/registry.h"

namespace wellspace::formats {

inline constexpr std::string_view kGzipExtension = ".gz";

// `path` without the extension that says that the file is compressed.
inline std::string WithoutGzip(const std::string& path) {
  return path.substr(0, path.size() - (ExtensionOf(path) == kGzipExtension ? kGzipExtension.size() : 0));
}

// Opens `path`, and inflates it if it is compressed, as its extension may say or its first bytes.
inline absl::StatusOr<InputFile> OpenInflated(const std::string& path) {
  absl::StatusOr<InputFile> file = InputFile::Open(path);
  if (!file.ok()) {
    return file;
  }
  if (absl::Status status = file->InflateGzip(ExtensionOf(path) == kGzipExtension); !status.ok()) {
    return status;
  }
  return file;
}

// The row of the format that `path` has; see FindFormat.
template <typename Handler>
absl::StatusOr<const Format<Handler>*> FindInputFormat(std::span<const Format<Handler>> formats,
                                                       const std::string& path, const std::string& name) {
  auto row = FindFormat(formats, WithoutGzip(path), name);
  if (!row.ok() && name.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(row.status().message(), "; each also compressed, with .gz after it"));
  }
  return row;
}

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_IO_OPEN_INPUT_H_
