#include "client/formats/numpy/npy_rows.h"

#include <algorithm>
#include <bit>
#include <optional>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"
#include "client/formats/numpy/npy.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {

static_assert(std::endian::native == std::endian::little, "values are taken as they are in the file");

absl::StatusOr<NpyRows> NpyRows::Open(const std::string& path) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  const auto error = [&file](const auto&... parts) {
    return absl::InvalidArgumentError(absl::StrCat(file.name(), ": ", parts...));
  };
  const std::optional<uint64_t> size = file.size();
  if (!size.has_value()) {
    return error("expected a regular file");
  }
  const absl::StatusOr<NpyReader> array = NpyReader::Open(
      file.name(), [&file](char* buffer, size_t bytes) { return file.Read(buffer, bytes); }, size);
  if (!array.ok()) {
    return array.status();
  }
  const NpyHeader& header = array->header();
  if (header.fortran_order) {
    return error("expected an array in C order, got one in Fortran order");
  }
  if (header.type != "<f8" && header.type != "<f4") {
    return error("expected numbers of type \"<f8\" or \"<f4\", got ", Quote(header.type));
  }
  if (array->columns() < kMinDimension || array->columns() > kMaxDimension) {
    return error("expected ", kMinDimension, " to ", kMaxDimension, " coordinates, got an array of ", array->rows(),
                 " rows and ", array->columns(), " columns");
  }
  const size_t value_bytes = header.type == "<f8" ? sizeof(double) : sizeof(float);
  const uint64_t left = *size - array->values_offset();
  if (array->rows() > left / (array->columns() * value_bytes) ||
      array->rows() * array->columns() * value_bytes != left) {
    return error("expected values for ", array->rows(), " rows and ", array->columns(), " columns of type ",
                 Quote(header.type), ", got ", left, " bytes");
  }
  const uint64_t rows = array->rows();
  const int columns = static_cast<int>(array->columns());
  return NpyRows(std::move(file), rows, columns, value_bytes, array->values_offset());
}

absl::Status NpyRows::ReadBytes(uint64_t offset, char* bytes, size_t size) const {
  for (size_t taken = 0; taken < size;) {
    WELLSPACE_ASSIGN_OR_RETURN(const size_t got, file_.ReadAt(offset + taken, bytes + taken, size - taken));
    if (got == 0) {
      return absl::InvalidArgumentError(absl::StrCat(name(), ": the file has become shorter while it was read"));
    }
    taken += got;
  }
  return absl::OkStatus();
}

absl::StatusOr<uint64_t> NpyRows::Read(uint64_t first, std::span<double> values) {
  const uint64_t rows = std::min<uint64_t>(values.size() / columns_, rows_ - std::min(first, rows_));
  const size_t count = rows * columns_;
  const uint64_t offset = offset_ + first * columns_ * value_bytes_;
  if (value_bytes_ == sizeof(double)) {
    WELLSPACE_RETURN_IF_ERROR(ReadBytes(offset, reinterpret_cast<char*>(values.data()), count * sizeof(double)));
    return rows;
  }
  narrow_.resize(count);
  WELLSPACE_RETURN_IF_ERROR(ReadBytes(offset, reinterpret_cast<char*>(narrow_.data()), count * sizeof(float)));
  std::copy(narrow_.begin(), narrow_.end(), values.begin());
  return rows;
}

}  // namespace wellspace::formats
