#include "client/formats/io/file_error.h"

#include <cerrno>
#include <string>
#include <system_error>

namespace wellspace::formats {
namespace {

std::string Text(int error, std::string_view what) {
  return std::string(what) + ": " + std::generic_category().message(error);
}

absl::StatusCode OpenOrReadCode(int error) {
  switch (error) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return absl::StatusCode::kNotFound;
    case EACCES:
    case EPERM:
    case EROFS:
      return absl::StatusCode::kPermissionDenied;
    case ENOSPC:
    case EDQUOT:
    case EMFILE:
    case ENFILE:
    case ENOMEM:
      return absl::StatusCode::kResourceExhausted;
    default:
      return absl::StatusCode::kInvalidArgument;
  }
}

}  // namespace

absl::Status OpenOrReadError(int error, std::string_view what) {
  return absl::Status(OpenOrReadCode(error), Text(error, what));
}

absl::Status WriteError(int error, std::string_view what) { return absl::ResourceExhaustedError(Text(error, what)); }

}  // namespace wellspace::formats
