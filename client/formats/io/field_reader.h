// Text files in which line ends are blanks like others.
#ifndef WELLSPACE_CLIENT_FORMATS_IO_FIELD_READER_H_
#define WELLSPACE_CLIENT_FORMATS_IO_FIELD_READER_H_

#include <cstdint>
#include <string_view>

#include "absl/status/status.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"

namespace wellspace::formats {

// The fields of a file, one after the other, across its lines. '#' starts a comment.
//
// Thread safety: thread-compatible.
class FieldReader {
 public:
  // REQUIRES:   `reader` outlives this.
  explicit FieldReader(LineReader& reader) : reader_(reader) {}

  // The next field, valid until the next call. False at the end of the file and on an error of the reader.
  bool Next(std::string_view& field);
  // The next field as a number, or as a whole number of at most `limit`; `what` is its name for messages.
  //
  // Errors:     of the reader; INVALID_ARGUMENT at the line.
  absl::Status NextNumber(std::string_view what, double& value);
  // The same; NaN for a field that is not finite or a word for nothing, if that `may_be_invalid`.
  absl::Status NextCoordinate(std::string_view what, bool may_be_invalid, double& value);
  absl::Status NextWhole(std::string_view what, uint64_t limit, uint64_t& value);
  // Drops the fields that are left of the line.
  void DropLine() { fields_ = FieldSplitter("", ' '); }
  // Skips one field.
  absl::Status Skip(std::string_view what);

 private:
  absl::Status NextOf(std::string_view what, std::string_view& field);

  LineReader& reader_;
  FieldSplitter fields_{"", ' '};
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_IO_FIELD_READER_H_
