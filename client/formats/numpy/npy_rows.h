// A cloud in a .npy file, read in pieces from anywhere.
#ifndef WELLSPACE_CLIENT_FORMATS_NUMPY_NPY_ROWS_H_
#define WELLSPACE_CLIENT_FORMATS_NUMPY_NPY_ROWS_H_

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"

namespace wellspace::formats {

// Thread safety: thread-compatible.
class NpyRows {
 public:
  // Reads the header of the array of points in `path`.
  //
  // Errors:     of opening and reading; INVALID_ARGUMENT "FILE: …" unless it is a regular file with one array in C
  //             order, of 2 to 6 columns of type Float64 or Float32. Other arrays may still be read by
  //             ReadCloud, as a whole.
  static absl::StatusOr<NpyRows> Open(const std::string& path);

  uint64_t rows() const { return rows_; }
  int columns() const { return columns_; }
  const std::string& name() const { return file_.name(); }

  // Fills `values` with whole rows from row `first` on, as many as there are, and returns how many. Memory: a piece of
  // the file.
  //
  // REQUIRES:   values.size() is a multiple of columns().
  // Errors:     of reading; INVALID_ARGUMENT when the file has become shorter.
  absl::StatusOr<uint64_t> Read(uint64_t first, std::span<double> values);

 private:
  NpyRows(InputFile file, uint64_t rows, int columns, size_t value_bytes, uint64_t offset)
      : file_(std::move(file)), rows_(rows), columns_(columns), value_bytes_(value_bytes), offset_(offset) {}

  // Exactly `size` bytes.
  absl::Status ReadBytes(uint64_t offset, char* bytes, size_t size) const;

  InputFile file_;
  uint64_t rows_;
  int columns_;
  size_t value_bytes_;  // 8 or 4
  uint64_t offset_;     // of the first value
  std::vector<float> narrow_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_NUMPY_NPY_ROWS_H_
