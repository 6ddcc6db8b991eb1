// numpy's .npz: a mesh as two arrays, or three with weights.
#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud.h"
#include "client/formats/line_reader.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/npy.h"
#include "client/formats/npz.h"
#include "client/formats/zip_file.h"

namespace wellspace::formats {
namespace {

absl::StatusOr<NpyReader> OpenArray(ZipReader& archive, const std::string& file, const std::string& member,
                                    size_t dimensions = 2) {
  const absl::StatusOr<uint64_t> size = archive.Begin(member);
  if (!size.ok()) {
    return size.status();
  }
  return NpyReader::Open(
      absl::StrCat(file, ": ", member), [&archive](char* buffer, size_t bytes) { return archive.Read(buffer, bytes); },
      *size, dimensions);
}

}  // namespace

absl::StatusOr<Mesh> ReadNpz(const std::string& path) {
  absl::StatusOr<InputFile> file = InputFile::Open(path);
  if (!file.ok()) {
    return file.status();
  }
  const std::string name = file->name();
  const absl::StatusOr<std::unique_ptr<ZipReader>> archive = ZipReader::Open(*std::move(file));
  if (!archive.ok()) {
    return archive.status();
  }
  absl::StatusOr<NpyReader> points = OpenArray(**archive, name, kNpzPoints);
  if (!points.ok()) {
    return points.status();
  }
  const uint64_t vertices = points->rows();
  const uint64_t columns = points->columns();
  if (columns < kMinDimension || columns > kMaxDimension || vertices > std::numeric_limits<uint32_t>::max()) {
    return absl::InvalidArgumentError(absl::StrCat(
        name, ": ", kNpzPoints, ": expected fewer than 2^32 rows and ", kMinDimension, " to ", kMaxDimension,
        " columns, a row for each point, got ", vertices, " rows and ", columns, " columns"));
  }
  Mesh mesh{.dimension = static_cast<int>(columns), .points = {}, .simplices = {}};
  if (absl::Status status = points->ReadNumbers(mesh.points); !status.ok()) {
    return status;
  }
  if ((*archive)->Has(kNpzWeights)) {
    absl::StatusOr<NpyReader> weights = OpenArray(**archive, name, kNpzWeights, 1);
    if (!weights.ok()) {
      return weights.status();
    }
    if (weights->rows() != vertices) {
      return absl::InvalidArgumentError(absl::StrCat(name, ": ", kNpzWeights, ": expected ", vertices,
                                                     " weights, one for each point, got ", weights->rows()));
    }
    if (absl::Status status = weights->ReadNumbers(mesh.weights); !status.ok()) {
      return status;
    }
  }
  absl::StatusOr<NpyReader> simplices = OpenArray(**archive, name, kNpzSimplices);
  if (!simplices.ok()) {
    return simplices.status();
  }
  if (simplices->columns() != columns + 1) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": ", kNpzSimplices, ": expected ", columns + 1,
                                                   " columns for simplices of points with ", columns,
                                                   " coordinates, got ", simplices->columns()));
  }
  if (absl::Status status = simplices->ReadIndices(vertices, mesh.simplices); !status.ok()) {
    return status;
  }
  return mesh;
}

}  // namespace wellspace::formats
