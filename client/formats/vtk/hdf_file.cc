#include "client/formats/vtk/hdf_file.h"

#include <cerrno>

#include "absl/strings/str_cat.h"
#include "client/formats/io/file_error.h"

namespace wellspace::formats {
namespace {

constexpr unsigned kDeflateLevel = 4;

}  // namespace

// Bytes that could not be written because the disk was full stay in the state of the library. A try to write it at the
// end of the process would crash, so there is to be none: all files are closed.
std::mutex& Hdf5Mutex() {
  static std::mutex mutex;
  [[maybe_unused]] static const herr_t no_atexit = H5dont_atexit();
  return mutex;
}

template <>
hid_t HdfTypeOf<double>() {
  return H5T_IEEE_F64LE;
}
template <>
hid_t HdfTypeOf<int64_t>() {
  return H5T_STD_I64LE;
}
template <>
hid_t HdfTypeOf<int32_t>() {
  return H5T_STD_I32LE;
}
template <>
hid_t HdfTypeOf<uint8_t>() {
  return H5T_STD_U8LE;
}

HdfFile::HdfFile(std::string path, std::stop_token stop) : path_(std::move(path)), stop_(std::move(stop)) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are returned, not printed
  errno = 0;
  file_ = Handle(H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
  Check(file_ >= 0);
}

Handle HdfFile::AddGroup(hid_t parent, const char* name) {
  Handle group(H5Gcreate2(parent, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  Check(group >= 0);
  return group;
}

void HdfFile::AddAttribute(hid_t object, const char* name, std::span<const int64_t> values) {
  const hsize_t count = values.size();
  const Handle space(H5Screate_simple(1, &count, nullptr), H5Sclose);
  const Handle attribute(H5Acreate2(object, name, H5T_STD_I64LE, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  Check(H5Awrite(attribute, H5T_STD_I64LE, values.data()) >= 0);
}

void HdfFile::AddAttribute(hid_t object, const char* name, std::string_view text) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  Check(H5Tset_size(type, text.size()) >= 0 && H5Tset_strpad(type, H5T_STR_NULLPAD) >= 0);
  const Handle one(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name, type, one, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  Check(H5Awrite(attribute, type, text.data()) >= 0);
}

void HdfFile::BeginArrayOf(hid_t type, hid_t group, const char* name, uint64_t rows, uint64_t columns) {
  EndArray();
  const hsize_t shape[] = {rows, columns};
  const int rank = columns == 1 ? 1 : 2;
  const Handle space(H5Screate_simple(rank, shape, nullptr), H5Sclose);
  const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  Check(H5Pset_obj_track_times(properties, false) >= 0);  // the same mesh is the same file, whenever it is written
  if (rows > 0) {
    const hsize_t chunk[] = {std::min<hsize_t>(rows, kRowsPerChunk), columns};
    Check(H5Pset_chunk(properties, rank, chunk) >= 0 && H5Pset_shuffle(properties) >= 0 &&
          H5Pset_deflate(properties, kDeflateLevel) >= 0);
  }
  array_ = Handle(H5Dcreate2(group, name, type, space, H5P_DEFAULT, properties, H5P_DEFAULT), H5Dclose);
  Check(array_ >= 0);
  columns_ = columns;
  row_ = 0;
}

void HdfFile::AddOf(hid_t type, const void* values, uint64_t count) {
  if (status_.ok() && stop_.stop_requested()) {
    status_ = absl::CancelledError(absl::StrCat("cancelled while writing ", path_));
  }
  if (!status_.ok() || count == 0) {
    return;
  }
  const hsize_t start[] = {row_, 0};
  const hsize_t counts[] = {count / columns_, columns_};
  const int rank = columns_ == 1 ? 1 : 2;
  const Handle memory(H5Screate_simple(rank, counts, nullptr), H5Sclose);
  const Handle space(H5Dget_space(array_), H5Sclose);
  errno = 0;
  Check(H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, counts, nullptr) >= 0 &&
        H5Dwrite(array_, type, memory, space, H5P_DEFAULT, values) >= 0);
  row_ += counts[0];
}

absl::Status HdfFile::Finish() {
  EndArray();
  errno = 0;
  Check(file_.Close());
  return status_;
}

void HdfFile::EndArray() {
  errno = 0;
  Check(array_.Close());
}

void HdfFile::Check(bool ok) {
  if (!ok && status_.ok()) {
    const std::string message = absl::StrCat("cannot write ", path_);
    status_ =
        errno != 0 ? WriteError(errno, message) : absl::InternalError(absl::StrCat(message, ": HDF5 says no more"));
  }
}

}  // namespace wellspace::formats
