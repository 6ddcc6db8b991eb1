// Files of HDF5 on their way out. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_VTK_HDF_FILE_H_
#define WELLSPACE_CLIENT_FORMATS_VTK_HDF_FILE_H_

#include <hdf5.h>

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"

namespace wellspace::formats {

inline constexpr hsize_t kRowsPerChunk = 1 << 15;

// Libraries of HDF5 need not be thread-safe, and keep state for all files of a process.
std::mutex& Hdf5Mutex();

// An object of HDF5, closed at the end of its life. REQUIRES: Hdf5Mutex() is held whenever one ends.
class Handle {
 public:
  Handle() = default;
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~Handle() { Close(); }

  operator hid_t() const { return id_; }
  // Whether that went well; buffered bytes go to the file now.
  bool Close() { return id_ < 0 || close_(std::exchange(id_, -1)) >= 0; }

 private:
  hid_t id_ = -1;
  herr_t (*close_)(hid_t) = nullptr;
};

// The type of a file's numbers: of as many bytes as T, the lowest first.
template <typename T>
hid_t HdfTypeOf();
template <>
hid_t HdfTypeOf<double>();
template <>
hid_t HdfTypeOf<int64_t>();
template <>
hid_t HdfTypeOf<int32_t>();
template <>
hid_t HdfTypeOf<uint8_t>();

// A file in which arrays are written one after the other, in chunks compressed by zlib. Errors are kept, as an
// OutputFile keeps them.
//
// REQUIRES: Hdf5Mutex() is held during all calls, and at the end of its life.
class HdfFile {
 public:
  // The file will be `path`; writing ends with CANCELLED once `stop` asks for it.
  HdfFile(std::string path, std::stop_token stop);

  const absl::Status& status() const { return status_; }

  // The group that holds all others.
  hid_t file() const { return file_; }
  Handle AddGroup(hid_t parent, const char* name);
  void AddAttribute(hid_t object, const char* name, std::span<const int64_t> values);
  void AddAttribute(hid_t object, const char* name, std::string_view text);

  // Ends the array before.
  template <typename T>
  void BeginArray(hid_t group, const char* name, uint64_t rows, uint64_t columns = 1) {
    BeginArrayOf(HdfTypeOf<T>(), group, name, rows, columns);
  }

  // The next rows of the array.
  template <typename T>
  void Add(std::span<const T> values) {
    AddOf(HdfTypeOf<T>(), values.data(), values.size());
  }

  // An array of `rows` values that `value_of` gives by their row.
  template <typename T, typename ValueOf>
  void AddArray(hid_t group, const char* name, uint64_t rows, ValueOf value_of) {
    BeginArray<T>(group, name, rows);
    std::vector<T> block;
    for (uint64_t begin = 0; begin < rows && status_.ok(); begin += kRowsPerChunk) {
      block.clear();
      for (uint64_t row = begin; row < std::min<uint64_t>(rows, begin + kRowsPerChunk); ++row) {
        block.push_back(value_of(row));
      }
      Add<T>(block);
    }
  }

  // Closes the file, and returns the first error of all. REQUIRES: no group is open.
  absl::Status Finish();

 private:
  void BeginArrayOf(hid_t type, hid_t group, const char* name, uint64_t rows, uint64_t columns);
  void AddOf(hid_t type, const void* values, uint64_t count);
  void EndArray();
  // Keeps an error, the system's where there was one. The calls that set errno are those that write.
  void Check(bool ok);

  const std::string path_;
  const std::stop_token stop_;
  absl::Status status_;
  Handle file_;
  Handle array_;  // the one that is being written
  hsize_t columns_ = 1;
  hsize_t row_ = 0;
};

// Calls `use` with blocks of as many rows as a chunk, of `width` values each: their conversion takes little memory.
template <typename T, typename Use>
void ForEachBlock(std::span<const T> values, uint64_t width, Use use) {
  for (; !values.empty(); values = values.subspan(std::min<size_t>(values.size(), kRowsPerChunk * width))) {
    use(values.first(std::min<size_t>(values.size(), kRowsPerChunk * width)));
  }
}

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_VTK_HDF_FILE_H_
