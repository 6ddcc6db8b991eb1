// The error of the system for a file, as a status.
#ifndef WELLSPACE_CLIENT_FORMATS_IO_FILE_ERROR_H_
#define WELLSPACE_CLIENT_FORMATS_IO_FILE_ERROR_H_

#include <string_view>

#include "absl/status/status.h"

namespace wellspace::formats {

// absl::ErrnoToStatus speaks of calls: it makes FAILED_PRECONDITION of a broken pipe and UNAVAILABLE of a descriptor
// that would block, which callers here know as states of sessions and of servers. The functions below say what the file
// is to the caller.
//
// Messages are "`what`: " and the system's text of `error`, an errno.

// A file could not be opened, or read: NOT_FOUND, PERMISSION_DENIED; RESOURCE_EXHAUSTED for want of descriptors, memory
// or disk; otherwise INVALID_ARGUMENT.
absl::Status OpenOrReadError(int error, std::string_view what);

// Bytes could not be written, or a finished file not be given its name: RESOURCE_EXHAUSTED, whatever the reason.
absl::Status WriteError(int error, std::string_view what);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_IO_FILE_ERROR_H_
