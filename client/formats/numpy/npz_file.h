// Files of numpy's arrays on their way out. Private to client.
#ifndef WELLSPACE_CLIENT_FORMATS_NUMPY_NPZ_FILE_H_
#define WELLSPACE_CLIENT_FORMATS_NUMPY_NPZ_FILE_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/io/output_file.h"
#include "client/formats/io/zip_file.h"
#include "client/formats/names.h"

namespace wellspace::formats {

// The type of numbers as .npy names it.
template <typename T>
constexpr const char* NpyTypeOf();
template <>
constexpr const char* NpyTypeOf<double>() {
  return "<f8";
}
template <>
constexpr const char* NpyTypeOf<int64_t>() {
  return "<i8";
}
template <>
constexpr const char* NpyTypeOf<uint64_t>() {
  return "<u8";
}
template <>
constexpr const char* NpyTypeOf<int32_t>() {
  return "<i4";
}
template <>
constexpr const char* NpyTypeOf<uint32_t>() {
  return "<u4";
}
template <>
constexpr const char* NpyTypeOf<uint8_t>() {
  return "|u1";
}

// An archive in which arrays are written one after the other, deflated.
//
// Thread safety: thread-compatible.
class NpzFile {
 public:
  // Errors:     of OutputFile; INVALID_ARGUMENT for what is no regular file.
  static absl::StatusOr<std::unique_ptr<NpzFile>> Create(const std::string& path, std::stop_token stop);

  // Starts the array `member`, "points.npy", of `rows` rows; `columns`: of so many numbers each, none: it has one
  // dimension.
  template <typename T>
  void Begin(const std::string& member, uint64_t rows, std::optional<uint64_t> columns = std::nullopt) {
    BeginOf(member, NpyTypeOf<T>(), rows, columns, sizeof(T));
  }

  // The next numbers of the array.
  template <typename T>
  void Write(std::span<const T> values) {
    archive_.Write({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
  }

  // A whole array of one dimension.
  template <typename T>
  void WriteArray(const std::string& member, std::span<const T> values) {
    Begin<T>(member, values.size());
    Write(values);
  }

  // An array of texts, in UTF-32; those of more characters than numpy's readers take are cut, which changes() notes.
  void WriteTexts(const std::string& member, std::span<const std::string> texts);

  // The next `count` numbers of the array are `value`.
  void WriteRepeated(int32_t value, uint64_t count);

  const absl::Status& status() const { return archive_.status(); }
  // The note on texts that were cut; empty if none was.
  std::string ChangesNote() const;
  // Gives the file its name. Returns the first error of all so far.
  absl::Status Commit();

 private:
  explicit NpzFile(OutputFile output) : output_(std::move(output)), archive_(output_) {}
  void BeginOf(const std::string& member, const std::string& type, uint64_t rows, std::optional<uint64_t> columns,
               size_t value_bytes);

  OutputFile output_;
  ZipWriter archive_;
  NameChanges changes_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_NUMPY_NPZ_FILE_H_
