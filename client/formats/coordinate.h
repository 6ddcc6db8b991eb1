// Coordinates in text, as files of points have them; and guesses about text that is none.
#ifndef WELLSPACE_CLIENT_FORMATS_COORDINATE_H_
#define WELLSPACE_CLIENT_FORMATS_COORDINATE_H_

#include <string_view>

#include "absl/status/status.h"

namespace wellspace::formats {

// The end of a message where a point could be left out.
inline constexpr std::string_view kSkipInvalidHint = "; --skip-invalid leaves such points out";

enum class CoordinateKind {
  kFinite,
  kInvalid,  // NaN, infinite, beyond the range of double; nothing, or a word for nothing, such as NA
  kNone,     // something else
};

// Reads the whole of `text` as ParseFinite does, or with an exponent as Fortran writes it: 1.0D+00, 1.0-100.
CoordinateKind ReadCoordinate(std::string_view text, double& value);

// The same for a number that may be missing: NaN where it is invalid. False for something else.
bool ReadOrNan(std::string_view text, double& value);

// INVALID_ARGUMENT, a message without a location: why `text` is no finite number, and what it might be ("a decimal
// comma?").
// REQUIRES: ReadCoordinate does not find it finite.
absl::Status CoordinateError(std::string_view text);

// ReadCoordinate where no point may be left out.
//
// Errors:     those of CoordinateError, without its hint at --skip-invalid.
absl::Status TakeFinite(std::string_view text, double& value);

// ReadOrNan where a point may be left out, if it `may_be_invalid`; but nothing at all is an error.
//
// Errors:     those of CoordinateError.
absl::Status TakeCoordinate(std::string_view text, bool may_be_invalid, double& value);

// Whether `text` is a word for a value that is missing, such as NA or null.
bool IsMissingWord(std::string_view text);

// Whether `text` may be the name of a column: it has a letter, nothing unprintable, and does not start like a number.
bool IsColumnName(std::string_view text);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_COORDINATE_H_
