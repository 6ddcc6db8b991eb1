// Stanford's PLY: its header, and the rows of its elements. Private to the readers of such files.
#ifndef WELLSPACE_CLIENT_FORMATS_PLY_ROWS_H_
#define WELLSPACE_CLIENT_FORMATS_PLY_ROWS_H_

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"

namespace wellspace::formats {

enum class PlyScalar : uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

struct PlyProperty {
  std::optional<PlyScalar> list_count;  // the type of the number of values, if it is a list
  PlyScalar type;
  std::string name;
  bool is_wanted = true;  // whether rows give it: of lists at first not
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

// The value of a property in a row.
struct PlyValue {
  size_t property = 0;  // of the element
  // Of a scalar in ascii the text, not yet looked at, in binary the number.
  std::string_view text = {};
  double number = 0;
  std::span<const double> list = {};
};

// Thread safety: thread-compatible.
class PlyRows {
 public:
  // REQUIRES:   `reader` is at the start of the file, and outlives this.
  explicit PlyRows(LineReader& reader) : reader_(reader) {}

  // Reads all up to the first row.
  //
  // Errors:     of reading; INVALID_ARGUMENT at the line.
  absl::Status ReadHeader();
  bool is_ascii() const { return is_ascii_; }
  std::vector<PlyElement>& elements() { return elements_; }
  // The element of this name; null without one.
  PlyElement* Find(std::string_view name);

  // Refuses elements, up to `last`, without any property. Every row of the others takes bytes: nothing is repeated more
  // often than the file is long.
  absl::Status CheckUpTo(const PlyElement& last) const;

  // Takes a value of a row. An error of its is a message without a location.
  using Take = absl::FunctionRef<absl::Status(const PlyValue&)>;
  // Reads row `row` of `element`, and hands its values that are wanted to `take`, in their order.
  //
  // REQUIRES:   all rows before have been read or skipped.
  // Memory:     that of a list that is wanted, as its values come.
  // Errors:     of reading; INVALID_ARGUMENT at the line or the byte.
  absl::Status ReadRow(const PlyElement& element, uint64_t row, Take take);
  absl::Status SkipRow(const PlyElement& element, uint64_t row);

 private:
  bool NextFields(std::vector<std::string_view>& fields);
  absl::Status ReadFormat(const std::vector<std::string_view>& fields);
  absl::Status ReadElement(const std::vector<std::string_view>& fields);
  absl::Status ReadProperty(const std::vector<std::string_view>& fields);
  absl::Status ReadLine(const PlyElement& element, uint64_t row, Take take);
  absl::Status ReadList(FieldSplitter& fields, std::string_view field, size_t index, bool is_wanted);
  absl::Status ReadBinary(const PlyElement& element, uint64_t row, Take take);
  absl::Status ReadBinaryList(const PlyElement& element, uint64_t row, const PlyProperty& property, uint64_t count);
  bool TakeScalar(PlyScalar type, double& value);
  bool Skip(uint64_t bytes);
  absl::Status BinaryError(const PlyElement& element, uint64_t row, uint64_t offset, const std::string& message) const;
  absl::Status EndError(const PlyElement& element, uint64_t row) const;

  LineReader& reader_;
  bool is_ascii_ = true;
  bool is_big_endian_ = false;
  std::vector<PlyElement> elements_;
  std::vector<double> list_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_PLY_ROWS_H_
