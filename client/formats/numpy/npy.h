// Arrays as numpy stores them: the .npy format, versions 1.0 to 3.0.
//
// "\x93NUMPY", two bytes of version, the length of the header (two bytes little-endian, four from version 2.0 on), the
// header, the values. The header is the text of a Python dict: {'descr': '<f8', 'fortran_order': False, 'shape': (3,
// 2), }.
#ifndef WELLSPACE_CLIENT_FORMATS_NUMPY_NPY_H_
#define WELLSPACE_CLIENT_FORMATS_NUMPY_NPY_H_

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/cloud.h"
#include "client/formats/read_cloud.h"

namespace wellspace::formats {

// Up to `size` bytes, at least one unless none are left.
using ByteSource = std::function<absl::StatusOr<size_t>(char* buffer, size_t size)>;

// The most characters of a text that is read.
inline constexpr uint64_t kMaxNpyCharacters = 1024;

struct NpyHeader {
  std::string type;  // numpy's name of it: byte order, kind, bytes of a value; "<f8"
  bool fortran_order = false;
  std::vector<uint64_t> shape;
};

// The text of a header. It is read strictly: the three keys once each, in any order, literals as numpy writes them.
//
// Errors:     INVALID_ARGUMENT, a message without a location.
absl::StatusOr<NpyHeader> ParseNpyHeader(std::string_view text);

// The header before the values of an array in C order, in version 1.0, padded as numpy does; without columns it has
// one dimension.
std::string NpyPreamble(const std::string& type, uint64_t rows, std::optional<uint64_t> columns);

// Reads one array of rows and columns, or of rows alone, from a source, in bounded memory besides the array.
//
// Thread safety: thread-compatible.
class NpyReader {
 public:
  // Reads magic and header. `name` is that of the array, for messages. The source has `size` bytes, if that is known:
  // counts of the header are not believed beyond it.
  //
  // REQUIRES:   dimensions is 1 or 2.
  // Errors:     of the source; INVALID_ARGUMENT "NAME: …" for anything but an array of so many dimensions.
  static absl::StatusOr<NpyReader> Open(std::string name, ByteSource source, std::optional<uint64_t> size,
                                        size_t dimensions = 2);

  uint64_t rows() const { return header_.shape[0]; }
  uint64_t columns() const { return header_.shape.size() == 1 ? 1 : header_.shape[1]; }
  const NpyHeader& header() const { return header_; }
  // Where in the source the values begin. REQUIRES: none has been read.
  uint64_t values_offset() const { return taken_; }

  // The values, row by row, whichever order the array is stored in; then expects the end of the source. To be called
  // once.
  //
  // Errors:     of the source; INVALID_ARGUMENT "NAME: …" for other types than Float32, Float64 and whole numbers of 8
  //             to 64 bits, signed or not, of either byte order; and for a whole number that no double is equal to.
  absl::Status ReadNumbers(std::vector<double>& values);
  // The same for whole numbers alone, from 0 to below `limit`.
  absl::Status ReadIndices(uint64_t limit, std::vector<uint32_t>& values);
  // The same for texts of type "<U1" and longer, of one dimension; they become UTF-8.
  absl::Status ReadTexts(std::vector<std::string>& values);

 private:
  NpyReader(std::string name, ByteSource source, std::optional<uint64_t> size)
      : name_(std::move(name)), source_(std::move(source)), size_(size) {}

  absl::Status Error(std::string_view message) const;
  // Exactly `size` bytes.
  absl::Status Take(char* buffer, size_t size);
  absl::Status ReadHeader(size_t dimensions);
  absl::Status ExpectEnd();
  // The row and column of the value number `index` in the order of the source.
  std::string PlaceOf(uint64_t index) const;
  // Reads rows() * columns() numbers of type Word; `convert` makes a Value of each, or an error.
  template <typename Word, typename Value, typename Convert>
  absl::Status ReadWords(std::vector<Value>& values, Convert convert);
  template <typename Read>
  std::optional<absl::Status> ForWholeType(const Read& read);

  std::string name_;
  ByteSource source_;
  std::optional<uint64_t> size_;  // bytes of the source
  uint64_t taken_ = 0;            // of them
  NpyHeader header_;
};

// Takes the rows of an array as points.
//
// Errors:     those of NpyReader::ReadNumbers; INVALID_ARGUMENT for other columns than `options` want, and for a
//             coordinate that is not finite and not to be skipped.
absl::Status ReadPointsOfArray(NpyReader& array, const CloudOptions& options, PointCloud& cloud);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_NUMPY_NPY_H_
