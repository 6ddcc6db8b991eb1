// Points from disk to a server.
#ifndef WELLSPACE_CLIENT_FILES_CLOUD_FILE_H_
#define WELLSPACE_CLIENT_FILES_CLOUD_FILE_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/read_cloud.h"
#include "client/point_source.h"

namespace wellspace::client {

// The points of a file. A regular .npy file of little-endian floating-point numbers in C order, of which all columns
// and rows are taken, is read while it is sent, and need not fit into memory; others are read as a whole.
//
// Thread safety: thread-compatible.
class CloudFile : public PointSource {
 public:
  // Errors:     as of formats::ReadCloud. Coordinates of a .npy file that is read while it is sent are left to the
  //             server to check.
  static absl::StatusOr<std::unique_ptr<CloudFile>> Open(const std::string& path,
                                                         const formats::CloudOptions& options = {});

  // Number of points.
  virtual uint64_t size() const = 0;

  // Notes on how the file was read, and how many points were left out; see formats::PointCloud.
  virtual const std::vector<std::string>& notes() const = 0;
  virtual uint64_t skipped() const = 0;

  // Where point `point` was read; see formats::PointCloud. REQUIRES: point < size().
  virtual std::string Origin(uint64_t point) const = 0;
};

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_FILES_CLOUD_FILE_H_
