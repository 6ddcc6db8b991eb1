#include "client/formats/io/field_reader.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "client/formats/coordinate.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {

bool FieldReader::Next(std::string_view& field) {
  while (!fields_.Next(field)) {
    std::string_view line;
    if (!reader_.NextContent(line)) {
      return false;
    }
    fields_ = FieldSplitter(line, ' ');
  }
  return true;
}

absl::Status FieldReader::NextOf(std::string_view what, std::string_view& field) {
  if (Next(field)) {
    return absl::OkStatus();
  }
  return reader_.EndError(absl::StrCat("the file ends; expected ", std::string(what)));
}

absl::Status FieldReader::NextNumber(std::string_view what, double& value) {
  std::string_view field;
  WELLSPACE_RETURN_IF_ERROR(NextOf(what, field));
  const absl::Status status = ParseFinite(field, value);
  return status.ok() ? status : reader_.Error(absl::StrCat(std::string(what), ": ", status.message()));
}

absl::Status FieldReader::NextCoordinate(std::string_view what, bool may_be_invalid, double& value) {
  if (!may_be_invalid) {
    return NextNumber(what, value);
  }
  std::string_view field;
  WELLSPACE_RETURN_IF_ERROR(NextOf(what, field));
  const absl::Status status = TakeCoordinate(field, may_be_invalid, value);
  return status.ok() ? status : reader_.Error(absl::StrCat(std::string(what), ": ", status.message()));
}

absl::Status FieldReader::NextWhole(std::string_view what, uint64_t limit, uint64_t& value) {
  std::string_view field;
  WELLSPACE_RETURN_IF_ERROR(NextOf(what, field));
  if (!ParseUnsigned(field, limit, value)) {
    return reader_.Error(
        absl::StrCat("expected ", std::string(what), ", a whole number of at most ", limit, ", got ", Quote(field)));
  }
  return absl::OkStatus();
}

absl::Status FieldReader::Skip(std::string_view what) {
  std::string_view field;
  return NextOf(what, field);
}

}  // namespace wellspace::formats
