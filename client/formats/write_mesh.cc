#include "client/formats/write_mesh.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/formats/cloud.h"
#include "client/formats/io/file_error.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/mesh_rows.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/registry.h"
#include "client/formats/tetgen/tetgen.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// What a format has a place for beside points, simplices and facets.
enum PlaceFor : uint32_t {
  kForWeights = 1,
  kForAttributes = 2,
  kForRegions = 4,
  kForParts = 8,
  kForRidges = 16,
  kForSecondOrder = 32,
  kForPairs = 64,
};

struct WriterKind {
  CreateWriter create;
  uint32_t places = 0;
  int max_dimension = 3;
  // Why it cannot go to a pipe or a device; null: it can.
  const char* needs_file = nullptr;
  // All files that a mesh of this name may be; null: that one.
  std::vector<std::string> (*files)(const std::string& path) = nullptr;

  bool HasPlace(PlaceFor place) const { return (places & place) != 0; }
};

constexpr uint32_t kForDataOfVtk = kForWeights | kForAttributes | kForRegions | kForSecondOrder;
constexpr uint32_t kForDataOfTetgen = kForWeights | kForRegions | kForSecondOrder;
constexpr uint32_t kForDataOfMsh = kForDataOfTetgen | kForPairs;

std::span<const Format<WriterKind>> Writers() {
  static const std::vector<Format<WriterKind>> writers = {
      {.name = "vtu", .extensions = {".vtu"}, .handler = {.create = CreateVtu, .places = kForDataOfVtk | kForParts}},
      {.name = "vtkhdf",
       .extensions = {".vtkhdf", ".hdf"},
       .handler = {.create = CreateVtkHdf,
                   .places = kForDataOfVtk,
                   .needs_file = "vtkhdf is a file of HDF5, completed from its start"}},
      {.name = "npz",
       .extensions = {".npz"},
       .handler = {.create = CreateNpz,
                   .places = kForDataOfVtk | kForParts | kForRidges | kForPairs,
                   .max_dimension = kMaxDimension,
                   .needs_file = "npz is a zip archive, completed from its start"}},
      {.name = "msh41", .extensions = {".msh"}, .handler = {.create = CreateMsh41, .places = kForDataOfMsh}},
      {.name = "msh22", .extensions = {}, .handler = {.create = CreateMsh22, .places = kForDataOfMsh}},
      {.name = "medit",
       .extensions = {".mesh"},
       .handler = {.create = CreateMedit, .places = kForRegions | kForRidges}},
      {.name = "node",
       .extensions = {".node", ".ele"},
       .handler = {.create = CreateNodeAndEle,
                   .places = kForDataOfTetgen,
                   .max_dimension = kMaxDimension,
                   .needs_file = "node is a pair of files",
                   .files = TetgenFilesOf}},
      {.name = "vtk", .extensions = {".vtk"}, .handler = {.create = CreateVtk, .places = kForDataOfVtk}},
      {.name = "xdmf",
       .extensions = {".xdmf"},
       .handler = {.create = CreateXdmf,
                   .places = kForDataOfVtk,
                   .needs_file = "xdmf has its arrays in a file of HDF5 beside it",
                   .files = XdmfFilesOf}},
      {.name = "su2", .extensions = {".su2"}, .handler = {.create = CreateSu2}},
      {.name = "abaqus",
       .extensions = {".inp"},
       .handler = {.create = CreateAbaqus, .places = kForRegions | kForSecondOrder}},
      {.name = "adcirc",
       .extensions = {".14", ".grd", ".gr3"},
       .handler = {.create = CreateAdcirc, .places = kForAttributes, .max_dimension = 2}},
      {.name = "2dm",
       .extensions = {".2dm"},
       .handler = {.create = Create2dm, .places = kForAttributes | kForRegions, .max_dimension = 2}},
  };
  return writers;
}

// The names of the formats that have a place for something, such as weights.
std::string FormatsWith(PlaceFor place) {
  std::vector<std::string> names;
  for (const Format<WriterKind>& writer : Writers()) {
    if (writer.handler.HasPlace(place)) {
      names.push_back(writer.name);
    }
  }
  return absl::StrJoin(names, ", ");
}

std::string Joined(const std::vector<std::string>& names) {
  constexpr size_t kShown = 5;
  return absl::StrCat(absl::StrJoin(names.begin(), names.begin() + std::min(names.size(), kShown), ", "),
                      names.size() > kShown ? ", ..." : "");
}

// Notes on the arrays that `kind` has no place for. A mesh without a word of regions is "domain" of the id 1.
std::vector<std::string> LossesOf(const WriterKind& kind, const MeshShape& shape) {
  std::vector<std::string> notes;
  if (!kind.HasPlace(kForAttributes) && !shape.attributes.empty()) {
    notes.push_back(absl::StrCat("the format has no place for attributes of vertices, which are left out: ",
                                 Joined(shape.attributes)));
  }
  const bool tells_regions =
      shape.regions.size() > 1 || (shape.regions.size() == 1 && shape.regions[0] != Region{.id = 1, .name = "domain"});
  if (!kind.HasPlace(kForRegions) && tells_regions) {
    std::vector<std::string> names;
    for (const Region& region : shape.regions) {
      names.push_back(region.name.empty() ? absl::StrCat(region.id) : region.name);
    }
    notes.push_back(absl::StrCat("the format has no place for regions, which are left out: ", Joined(names)));
  }
  if (!shape.periodic_axes.empty() && !kind.HasPlace(kForPairs)) {
    notes.push_back(absl::StrCat(
        "the format has no place for the pairs of vertices across periodic axes, which are left out; those have one: ",
        FormatsWith(kForPairs)));
  }
  return notes;
}

absl::Status CheckOrder(const WriterKind& writer, const std::string& name, const std::string& path, int dimension) {
  if (!writer.HasPlace(kForSecondOrder)) {
    return absl::InvalidArgumentError(absl::StrCat("cannot write ", path, ": ", name,
                                                   " has no elements of second order that its readers take; expected "
                                                   "one of ",
                                                   FormatsWith(kForSecondOrder), ", or order 1"));
  }
  return dimension <= 3
             ? absl::OkStatus()
             : absl::InvalidArgumentError(absl::StrCat(
                   "cannot write ", path, ": elements of second order are triangles and tetrahedra, and this mesh is ",
                   dimension, "-D; expected order 1"));
}

// `dimension` is that of the mesh, or 0 when it is not known.
absl::StatusOr<WriterKind> FindWriter(const std::string& path, const std::string& format, int dimension,
                                      bool has_weights, MeshOrder order = MeshOrder::kFirst) {
  const bool is_stream = path == kStandardStream;
  const auto row = FindFormat(Writers(), path, format.empty() && is_stream ? "vtu" : format);
  if (!row.ok()) {
    return row.status();
  }
  const WriterKind& writer = (*row)->handler;
  if (is_stream && writer.needs_file != nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat(writer.needs_file, " and cannot go to standard output; expected vtu, or a file"));
  }
  if (dimension > writer.max_dimension) {
    return absl::InvalidArgumentError(absl::StrCat("cannot write ", path, ": ", (*row)->name, " holds meshes up to ",
                                                   writer.max_dimension, "-D, and this one is ", dimension,
                                                   "-D; expected npz, a file of numpy"));
  }
  if (has_weights && !writer.HasPlace(kForWeights)) {
    return absl::InvalidArgumentError(absl::StrCat("cannot write ", path, ": ", (*row)->name,
                                                   " has no place for the weights of a mesh; expected one of ",
                                                   FormatsWith(kForWeights)));
  }
  if (order == MeshOrder::kSecond) {
    WELLSPACE_RETURN_IF_ERROR(CheckOrder(writer, (*row)->name, path, dimension));
  }
  return writer;
}

}  // namespace

std::string PartFileOf(const std::string& path, const std::string& extension, uint32_t part) {
  return absl::StrCat(path.substr(0, path.size() - ExtensionOf(path).size()), "_", part, extension);
}

std::vector<std::string> MeshFormats() { return FormatNames(Writers()); }

std::string ExtensionOfMesh(const std::string& format) {
  constexpr std::string_view kFamily = "msh";
  std::string_view of_family;
  for (const Format<WriterKind>& writer : Writers()) {
    if (writer.name.starts_with(kFamily) && !writer.extensions.empty()) {
      of_family = writer.extensions[0];  // that of another version, which the extension stands for
    }
    if (writer.name == format) {
      return writer.extensions.empty() ? std::string(of_family) : writer.extensions[0];
    }
  }
  return "";
}

bool HasPlaceForAttributes(const std::string& path, const std::string& format) {
  const absl::StatusOr<WriterKind> writer = FindWriter(path, format, /*dimension=*/0, /*has_weights=*/false);
  return writer.ok() && writer->HasPlace(kForAttributes);
}

bool HasPlaceForPairs(const std::string& path, const std::string& format) {
  const absl::StatusOr<WriterKind> writer = FindWriter(path, format, /*dimension=*/0, /*has_weights=*/false);
  return writer.ok() && writer->HasPlace(kForPairs);
}

std::vector<std::string> FilesOfMeshWritten(const std::string& path, const std::string& format) {
  const absl::StatusOr<WriterKind> writer = FindWriter(path, format, /*dimension=*/0, /*has_weights=*/false);
  return writer.ok() && writer->files != nullptr ? writer->files(path) : std::vector<std::string>{path};
}

absl::Status CheckMeshOutput(const std::string& path, const std::string& format, int dimension, bool may_have_weights,
                             MeshOrder order) {
  WELLSPACE_ASSIGN_OR_RETURN(const WriterKind writer, FindWriter(path, format, dimension, may_have_weights, order));
  if (path == kStandardStream) {
    return absl::OkStatus();
  }
  const size_t slash = path.find_last_of('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  struct stat attributes;
  const bool exists = stat(path.c_str(), &attributes) == 0;
  if (exists && S_ISDIR(attributes.st_mode)) {
    return absl::InvalidArgumentError(absl::StrCat("cannot write ", path, ": it is a folder; expected a file"));
  }
  const bool is_device = exists && !S_ISREG(attributes.st_mode);
  if (is_device && writer.needs_file != nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot write ", path, ": ", writer.needs_file, "; expected the name of a regular file"));
  }
  if (access(is_device ? path.c_str() : folder.c_str(), W_OK) != 0) {
    return OpenOrReadError(errno, absl::StrCat("cannot write ", path));
  }
  return absl::OkStatus();
}

absl::Status CheckComplete(const MeshShape& shape, const RowCounts& rows) {
  if (rows.vertices != shape.vertex_count || rows.simplices != shape.simplex_count) {
    return absl::InternalError(absl::StrCat("a mesh of ", shape.vertex_count, " vertices and ", shape.simplex_count,
                                            " simplices got ", rows.vertices, " and ", rows.simplices));
  }
  if (const uint64_t expected = shape.has_weights ? shape.vertex_count : 0; rows.weights != expected) {
    return absl::InternalError(absl::StrCat("a mesh of ", expected, " weights got ", rows.weights));
  }
  if (const uint64_t expected = shape.has_simplex_regions ? shape.simplex_count : 0; rows.simplex_regions != expected) {
    return absl::InternalError(
        absl::StrCat("a mesh of ", expected, " regions of simplices got ", rows.simplex_regions));
  }
  if (const uint64_t expected = shape.attributes.size() * shape.vertex_count; rows.attribute_values != expected) {
    return absl::InternalError(
        absl::StrCat("a mesh of ", expected, " values of attributes got ", rows.attribute_values));
  }
  if (rows.facets != shape.facet_count()) {
    return absl::InternalError(absl::StrCat("a mesh of ", shape.facet_count(), " boundary facets got ", rows.facets));
  }
  if (rows.ridges != shape.ridge_count) {
    return absl::InternalError(absl::StrCat("a mesh of ", shape.ridge_count, " ridges got ", rows.ridges));
  }
  return absl::OkStatus();
}

namespace {

// What the format of `writer` has a place for.
MeshShape HeldShape(const WriterKind& writer, const MeshShape& shape) {
  MeshShape held = shape;
  if (!writer.HasPlace(kForAttributes)) {
    held.attributes.clear();
  }
  if (!writer.HasPlace(kForRidges)) {
    held.ridge_count = 0;
  }
  if (!writer.HasPlace(kForPairs)) {
    held.periodic_axes.clear();
  }
  return held;
}

// Pairs are of a box with so many axes.
absl::Status CheckAxes(const std::string& path, const MeshShape& shape) {
  for (size_t i = 0; i < shape.periodic_axes.size(); ++i) {
    const int axis = shape.periodic_axes[i];
    if (axis < 0 || axis >= std::min(shape.dimension, 3) || (i > 0 && axis <= shape.periodic_axes[i - 1])) {
      return absl::InvalidArgumentError(absl::StrCat(
          "cannot write ", path, ": periodic axes ", absl::StrJoin(shape.periodic_axes, ", "), " of a mesh in ",
          shape.dimension, "-D; expected axes from 0 to ", std::min(shape.dimension, 3) - 1, ", ascending"));
    }
  }
  return shape.periodic_axes.empty() || shape.low.size() == static_cast<size_t>(shape.dimension)
             ? absl::OkStatus()
             : absl::InvalidArgumentError(
                   absl::StrCat("cannot write ", path, ": a mesh without a box is not periodic"));
}

absl::StatusOr<WriterKind> FindWriterFor(const std::string& path, const std::string& format, const MeshShape& shape) {
  WELLSPACE_RETURN_IF_ERROR(CheckAxes(path, shape));
  WELLSPACE_ASSIGN_OR_RETURN(const WriterKind writer,
                             FindWriter(path, format, shape.dimension, shape.has_weights, shape.order));
  if (shape.part != nullptr && !writer.HasPlace(kForParts)) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot write ", path, ": the format has no place for the numbers of a part; expected one of ",
                     FormatsWith(kForParts)));
  }
  if (shape.part != nullptr && shape.order == MeshOrder::kSecond) {
    return absl::InvalidArgumentError(
        absl::StrCat("cannot write ", path, ": parts of a mesh have elements of first order; expected order 1"));
  }
  return writer;
}

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateMesh(const std::string& path, const std::string& format,
                                                       const MeshShape& shape, std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(const WriterKind writer, FindWriterFor(path, format, shape));
  const MeshShape held = HeldShape(writer, shape);
  std::unique_ptr<MeshWriter> created;
  if (shape.order == MeshOrder::kSecond) {
    created = CreateSecondOrder(path, held, writer.create, std::move(stop));
  } else {
    WELLSPACE_ASSIGN_OR_RETURN(created, writer.create(path, held, std::move(stop)));
  }
  for (std::string& note : LossesOf(writer, shape)) {
    created->AddNote(std::move(note));
  }
  return created;
}

absl::Status WriteMesh(const std::string& path, const std::string& format, const MeshView& mesh, std::stop_token stop,
                       std::vector<std::string>* notes) {
  std::vector<std::string> of_writer;
  if (mesh.order == MeshOrder::kSecond) {
    const MeshShape shape = mesh.Shape();
    WELLSPACE_ASSIGN_OR_RETURN(const WriterKind writer, FindWriterFor(path, format, shape));
    MeshView held = mesh;
    held.attributes = writer.HasPlace(kForAttributes) ? mesh.attributes : std::span<const Attribute>();
    held.ridges = writer.HasPlace(kForRidges) ? mesh.ridges : std::span<const uint32_t>();
    of_writer = LossesOf(writer, shape);
    WELLSPACE_RETURN_IF_ERROR(WriteSecondOrder(held, HeldShape(writer, shape), path, writer.create, stop, of_writer));
  } else {
    WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<MeshWriter> writer,
                               CreateMesh(path, format, mesh.Shape(), std::move(stop)));
    WELLSPACE_RETURN_IF_ERROR(WriteRows(mesh, *writer));
    of_writer = writer->notes();
  }
  if (notes != nullptr) {
    notes->insert(notes->end(), of_writer.begin(), of_writer.end());
  }
  return absl::OkStatus();
}

}  // namespace wellspace::formats
