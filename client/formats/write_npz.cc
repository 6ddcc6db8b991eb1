// numpy's .npz: a mesh as two arrays.
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/npy.h"
#include "client/formats/npz.h"
#include "client/formats/output_file.h"
#include "client/formats/zip_file.h"

namespace wellspace::formats {
namespace {

template <typename T>
void WriteArray(const char* member, const char* type, std::span<const T> values, uint64_t columns, ZipWriter& archive) {
  const std::string preamble = NpyPreamble(type, values.size() / columns, columns);
  archive.Begin(member, preamble.size() + values.size_bytes());
  archive.Write(preamble);
  archive.Write({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
}

}  // namespace

absl::Status WriteNpz(const std::string& path, const MeshView& mesh, std::stop_token stop) {
  absl::StatusOr<OutputFile> output = OutputFile::Create(path, std::move(stop));
  if (!output.ok()) {
    return output.status();
  }
  if (!output->IsSeekable()) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot write ", path, ": npz is a zip archive, which needs a regular file"));
  }
  ZipWriter archive(*output);
  WriteArray(kNpzPoints, "<f8", mesh.points, mesh.dimension, archive);
  WriteArray(kNpzSimplices, "<u4", mesh.simplices, mesh.dimension + 1, archive);
  if (absl::Status status = archive.Finish(); !status.ok()) {
    return status;
  }
  return output->Commit();
}

}  // namespace wellspace::formats
