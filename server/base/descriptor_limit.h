// The limit on file descriptors of this process, and their uses.
#ifndef WELLSPACE_SERVER_BASE_DESCRIPTOR_LIMIT_H_
#define WELLSPACE_SERVER_BASE_DESCRIPTOR_LIMIT_H_

#include <cstdint>

namespace wellspace::server {

// Raises the limit to the highest that this process may set. Without privileges the system gives it a low one, and lets
// it have more for the asking.
void RaiseDescriptorLimit();

// The limit as it is now.
uint64_t DescriptorLimit();

// Descriptors of `limit` that no connection takes, so that there are some for files: 24, or a quarter if that is less.
// A server that keeps sessions in files, where every client suffers if a file cannot be opened, has a quarter, and at
// least 256, or half if that is less.
uint64_t SpareDescriptors(uint64_t limit, bool keeps_files);

// Files of points that are written at once, of `limit`: half of what no connection takes. Files that are read, meshes
// that are written, the log and the readers of metrics share the rest.
uint64_t MaxWrittenFiles(uint64_t limit);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_BASE_DESCRIPTOR_LIMIT_H_
