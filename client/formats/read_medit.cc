// INRIA's MEDIT, in ascii.
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/io/field_reader.h"
#include "client/formats/io/input_file.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/regions.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class MeditReader {
 public:
  explicit MeditReader(LineReader& reader) : reader_(reader), fields_(reader) {}

  absl::StatusOr<Mesh> Read() {
    uint64_t version = 0;
    std::string_view word;
    if (!fields_.Next(word) || word != "MeshVersionFormatted") {
      return reader_.EndError("expected \"MeshVersionFormatted\" at the start of the file");
    }
    WELLSPACE_RETURN_IF_ERROR(fields_.NextWhole("the version", kMaxCount, version));
    while (fields_.Next(word)) {
      if (word == "End") {
        break;
      }
      // What follows a word that is not known is skipped up to the next word.
      absl::Status status;
      if (word == "Dimension") {
        status = ReadDimension();
      } else if (word == "Vertices") {
        status = ReadVertices();
      } else if (mesh_.dimension != 0 && word == (mesh_.dimension == 2 ? "Triangles" : "Tetrahedra")) {
        status = ReadSimplices();
      } else if (mesh_.dimension != 0 && word == (mesh_.dimension == 2 ? "Edges" : "Triangles")) {
        status = ReadFacets();
      } else if (word == "Quadrilaterals" || word == "Hexahedra" || word == "Prisms" || word == "Pyramids" ||
                 (mesh_.dimension == 2 && word == "Tetrahedra")) {
        status = reader_.Error(
            absl::StrCat("expected Triangles in 2-D or Tetrahedra in 3-D and no other elements, got ", Quote(word)));
      }
      if (!status.ok()) {
        return status;
      }
    }
    if (!reader_.status().ok()) {
      return reader_.status();
    }
    if (!has_vertices_ || !has_simplices_) {
      return reader_.Error(
          absl::StrCat("the file ends; expected ", has_vertices_ ? "Triangles or Tetrahedra" : "Vertices"));
    }
    facets_.MoveTo(mesh_);
    regions_.MoveTo(mesh_);
    return std::move(mesh_);
  }

 private:
  absl::Status ReadDimension() {
    uint64_t dimension = 0;
    WELLSPACE_RETURN_IF_ERROR(fields_.NextWhole("the dimension", 3, dimension));
    if (dimension < 2 || mesh_.dimension != 0) {
      return reader_.Error("expected one \"Dimension\", 2 or 3");
    }
    mesh_.dimension = static_cast<int>(dimension);
    return absl::OkStatus();
  }

  absl::Status ReadVertices() {
    if (mesh_.dimension == 0 || std::exchange(has_vertices_, true)) {
      return reader_.Error("expected \"Dimension\", and then \"Vertices\" once");
    }
    WELLSPACE_RETURN_IF_ERROR(fields_.NextWhole("the number of vertices", kMaxCount, vertices_));
    constexpr std::array kNames = {"x of a vertex", "y of a vertex", "z of a vertex"};
    for (uint64_t vertex = 0; vertex < vertices_; ++vertex) {
      for (int axis = 0; axis < mesh_.dimension; ++axis) {
        double value = 0;
        WELLSPACE_RETURN_IF_ERROR(fields_.NextNumber(kNames[axis], value));
        mesh_.points.push_back(value);
      }
      WELLSPACE_RETURN_IF_ERROR(fields_.Skip("the reference of a vertex"));
    }
    return absl::OkStatus();
  }

  absl::Status ReadSimplices() {
    if (!has_vertices_ || std::exchange(has_simplices_, true)) {
      return reader_.Error("expected \"Vertices\", and then the simplices once");
    }
    uint64_t count = 0;
    WELLSPACE_RETURN_IF_ERROR(fields_.NextWhole("the number of simplices", kMaxCount, count));
    for (uint64_t simplex = 0; simplex < count; ++simplex) {
      WELLSPACE_RETURN_IF_ERROR(ReadCorners(mesh_.dimension + 1, mesh_.simplices));
      int32_t region = 0;
      WELLSPACE_RETURN_IF_ERROR(ReadReference("the reference of a simplex", region));
      regions_.Add(region);
    }
    return absl::OkStatus();
  }

  // Those with another reference than 0 are the boundary.
  absl::Status ReadFacets() {
    uint64_t count = 0;
    if (!has_vertices_) {
      return reader_.Error("expected \"Vertices\", and then the facets");
    }
    WELLSPACE_RETURN_IF_ERROR(fields_.NextWhole("the number of facets", kMaxCount, count));
    std::vector<uint32_t> corners;
    for (uint64_t facet = 0; facet < count; ++facet) {
      corners.clear();
      WELLSPACE_RETURN_IF_ERROR(ReadCorners(mesh_.dimension, corners));
      int32_t tag = 0;
      WELLSPACE_RETURN_IF_ERROR(ReadReference("the reference of a facet", tag));
      facets_.Add(corners, tag);
    }
    return absl::OkStatus();
  }

  absl::Status ReadReference(const char* what, int32_t& reference) {
    std::string_view field;
    return fields_.Next(field) && absl::SimpleAtoi(absl::string_view(field.data(), field.size()), &reference)
               ? absl::OkStatus()
               : reader_.EndError(absl::StrCat("expected ", what, ", a whole number, got ", Quote(field)));
  }

  absl::Status ReadCorners(int count, std::vector<uint32_t>& corners) {
    for (int corner = 0; corner < count; ++corner) {
      uint64_t vertex = 0;
      WELLSPACE_RETURN_IF_ERROR(fields_.NextWhole("a vertex from 1 on", vertices_, vertex));
      if (vertex == 0) {
        return reader_.Error("expected a vertex from 1 on, got 0");
      }
      corners.push_back(static_cast<uint32_t>(vertex - 1));
    }
    return absl::OkStatus();
  }

  LineReader& reader_;
  FieldReader fields_;
  Mesh mesh_;
  FacetSorter facets_;
  RegionCollector regions_;
  uint64_t vertices_ = 0;
  bool has_vertices_ = false;
  bool has_simplices_ = false;
};

}  // namespace

absl::StatusOr<Mesh> ReadMedit(const std::string& path) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  LineReader reader(std::move(file));
  return MeditReader(reader).Read();
}

}  // namespace wellspace::formats
