// Numbers in text, to the bit and back; and the messages for text that is none.
#ifndef WELLSPACE_CLIENT_FORMATS_IO_NUMBER_H_
#define WELLSPACE_CLIENT_FORMATS_IO_NUMBER_H_

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace wellspace::formats {

// The largest number of points, vertices or simplices that a file may announce.
inline constexpr uint64_t kMaxCount = std::numeric_limits<uint32_t>::max();

// `text` in quotes, unprintable bytes escaped, cut off when long.
std::string Quote(std::string_view text);

// INVALID_ARGUMENT "NAME:LINE: MESSAGE".
absl::Status LineError(std::string_view name, uint64_t line, std::string_view message);

// True when the whole of `text` is a number in the sense of ParseFinite, or the name of one that is not finite.
bool IsNumber(std::string_view text);

// Reads the whole of `text` as a decimal number, correctly rounded. A leading plus sign is accepted; what lies nearer
// to zero than to the smallest double is zero.
//
// Errors:     INVALID_ARGUMENT, a message without a location: not a number, NaN or infinity by name, or beyond the
//             range of double.
absl::Status ParseFinite(std::string_view text, double& value);

// Whether `text` is a whole number, without a point and an exponent, that `value`, which it was read as, is not.
bool IsRoundedWhole(std::string_view text, double value);

// Reads the whole of `text` as an unsigned decimal number of at most `limit`.
bool ParseUnsigned(std::string_view text, uint64_t limit, uint64_t& value);

// Appends the shortest text that reads back as the same bits. REQUIRES: value is finite.
void AppendNumber(double value, std::string& text);
void AppendNumber(uint64_t value, std::string& text);

// Appends a text of at most `width` characters that reads back as the same bits or, if there is none, as a number as
// near as so many characters allow; returns the number that it reads back as.
//
// Guarantees: finite, also where rounding up would leave the range of double.
// REQUIRES:   value is finite; width >= 12.
double AppendNumberWithin(double value, size_t width, std::string& text);

// Splits one line into fields, without copying.
//
// With separator ' ' a field ends at any run of blanks and tabs; with another one, a field is the text between two
// separators, without the blanks around it, and may be empty. One pair of double quotes around it is dropped; between
// the quotes, separators are characters like others. A tab as separator is no blank.
class FieldSplitter {
 public:
  FieldSplitter(std::string_view line, char separator);
  // False when no field is left.
  bool Next(std::string_view& field);

 private:
  size_t EndOfQuotes() const;

  std::string_view rest_;
  char separator_;
  bool more_;
};

// `text` without the blanks and tabs around it.
std::string_view TrimBlanks(std::string_view text);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_IO_NUMBER_H_
