// Numbers and lines of an MSH file, be they in ascii or in binary. Private to read_msh.cc.
#ifndef WELLSPACE_CLIENT_FORMATS_MSH_MSH_NUMBERS_H_
#define WELLSPACE_CLIENT_FORMATS_MSH_MSH_NUMBERS_H_

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/formats/io/field_reader.h"
#include "client/formats/io/line_reader.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {

// The greatest `limit` of a number that may be any.
inline constexpr uint64_t kAnyNumber = std::numeric_limits<uint64_t>::max();

// Reads the lines of a file and, between them, numbers: in ascii as fields, on however many lines, until SetBinary.
//
// Errors:     INVALID_ARGUMENT that names the file, the line or the byte, `what` was expected and what there is.
class MshNumbers {
 public:
  // REQUIRES:   `reader` outlives this.
  explicit MshNumbers(LineReader& reader) : reader_(reader), fields_(reader) {}

  // In binary of version 2.2 counts of sections are lines of text, and all whole numbers have 4 bytes.
  void SetBinary(bool is_2_2) {
    is_binary_ = true;
    is_narrow_ = is_2_2;
  }
  bool is_binary() const { return is_binary_; }

  // The next line that is not blank.
  bool NextLine(std::string_view& line) {
    while (reader_.Next(line)) {
      line = TrimBlanks(line);
      if (!line.empty()) {
        return true;
      }
    }
    return false;
  }

  // Has numbers come from the lines after the one that was read last.
  void DropLine() { fields_.DropLine(); }

  // Reads the next line, which has to be `expected`, or all lines up to `end`.
  absl::Status ExpectLine(const char* expected) {
    std::string_view line;
    if (!NextLine(line)) {
      return reader_.EndError(absl::StrCat("the file ends; expected ", Quote(expected)));
    }
    return line == expected ? absl::OkStatus()
                            : reader_.Error(absl::StrCat("expected ", Quote(expected), ", got ", Quote(line)));
  }

  absl::Status SkipTo(const std::string& end) {
    std::string_view line;
    while (NextLine(line)) {
      if (line == end) {
        return absl::OkStatus();
      }
    }
    return reader_.EndError(absl::StrCat("the file ends; expected ", Quote(end)));
  }

  // An error at the place that was read last.
  absl::Status ValueError(const std::string& message) const {
    return is_binary_ ? absl::InvalidArgumentError(
                            absl::StrCat(reader_.name(), ": before byte ", reader_.offset(), ": ", message))
                      : reader_.Error(message);
  }

  // Numbers of at most `limit` as the file has them: counts and numbers of nodes in 8 bytes; dimensions, types and
  // numbers of entities in 4. Then coordinates, and numbers that may be negative.
  absl::Status Size(const char* what, uint64_t limit, uint64_t& value) {
    return is_narrow_   ? Int(what, limit, value)
           : is_binary_ ? TakeWord<int64_t>(what, limit, value)
                        : fields_.NextWhole(what, limit, value);
  }
  // The count at the start of a section of version 2.2, which is text in binary, too.
  absl::Status Count(const char* what, uint64_t limit, uint64_t& value) {
    if (!is_narrow_) {
      return fields_.NextWhole(what, limit, value);
    }
    std::string_view line;
    if (!NextLine(line)) {
      return reader_.EndError(absl::StrCat("the file ends; expected ", what));
    }
    return ParseUnsigned(line, limit, value)
               ? absl::OkStatus()
               : reader_.Error(
                     absl::StrCat("expected ", what, ", a whole number of at most ", limit, ", got ", Quote(line)));
  }
  absl::Status Int(const char* what, uint64_t limit, uint64_t& value) {
    return is_binary_ ? TakeWord<int32_t>(what, limit, value) : fields_.NextWhole(what, limit, value);
  }
  absl::Status Number(const char* what, double& value) { return Coordinate(what, /*may_be_invalid=*/false, value); }
  // The same; not finite, if that `may_be_invalid`.
  absl::Status Coordinate(const char* what, bool may_be_invalid, double& value) {
    if (!is_binary_) {
      return fields_.NextCoordinate(what, may_be_invalid, value);
    }
    WELLSPACE_RETURN_IF_ERROR(TakeBytes(what, value));
    return may_be_invalid || std::isfinite(value)
               ? absl::OkStatus()
               : ValueError(absl::StrCat(what, ": expected a finite number, got ", value));
  }
  absl::Status SignedInt(const char* what, int32_t& value) {
    if (is_binary_) {
      return TakeBytes(what, value);
    }
    std::string_view field;
    return fields_.Next(field) && absl::SimpleAtoi(absl::string_view(field.data(), field.size()), &value)
               ? absl::OkStatus()
               : reader_.EndError(absl::StrCat("expected ", what, ", got ", Quote(field)));
  }

  // Reads over a value that means nothing.
  absl::Status SkipNumber() {
    if (!is_binary_) {
      return fields_.Skip("a value");
    }
    char bytes[sizeof(double)];
    return reader_.Take(bytes, sizeof(bytes)) == sizeof(bytes) ? absl::OkStatus()
                                                               : reader_.EndError("the file ends inside data");
  }
  // Reads over a field of ascii.
  absl::Status SkipField(const char* what) { return fields_.Skip(what); }

 private:
  template <typename T>
  absl::Status TakeBytes(const char* what, T& value) {
    if (reader_.Take(reinterpret_cast<char*>(&value), sizeof(value)) == sizeof(value)) {
      return absl::OkStatus();
    }
    return reader_.status().ok() ? ValueError(absl::StrCat("the file ends; expected ", what)) : reader_.status();
  }

  // One number in binary; `limit` is the greatest that is accepted.
  template <typename Word>
  absl::Status TakeWord(const char* what, uint64_t limit, uint64_t& value) {
    Word word{};
    WELLSPACE_RETURN_IF_ERROR(TakeBytes(what, word));
    if (word < 0 || static_cast<uint64_t>(word) > limit) {
      return ValueError(absl::StrCat("expected ", what, ", a whole number of at most ", limit, ", got ", word));
    }
    value = static_cast<uint64_t>(word);
    return absl::OkStatus();
  }

  LineReader& reader_;
  FieldReader fields_;
  bool is_binary_ = false;
  bool is_narrow_ = false;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MSH_MSH_NUMBERS_H_
