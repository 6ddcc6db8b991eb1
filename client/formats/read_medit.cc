// INRIA's MEDIT, in ascii.
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/field_reader.h"
#include "client/formats/io/input_file.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/names.h"
#include "client/formats/point_rows.h"
#include "client/formats/regions.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class MeditReader {
 public:
  explicit MeditReader(LineReader& reader) : reader_(reader), fields_(reader) {
    reader_.OnComment([this](std::string_view comment) { TakeNameLine(comment, &parts_, &regions_); });
  }
  ~MeditReader() { reader_.OnComment(nullptr); }
  MeditReader(const MeditReader&) = delete;
  MeditReader& operator=(const MeditReader&) = delete;

  absl::StatusOr<Mesh> Read() {
    bool has_end = false;
    WELLSPACE_RETURN_IF_ERROR(ReadSections(/*ends_with_vertices=*/false, has_end));
    if (!has_vertices_ || (!triangles_.is_there && !tetrahedra_.is_there)) {
      return reader_.Error(
          absl::StrCat("the file ends; expected ", has_vertices_ ? "Triangles or Tetrahedra" : "Vertices"));
    }
    if (has_end) {
      // We write comments with names there. Whatever it is, a mesh does not need it.
      std::string_view line;
      reader_.NextContent(line);
    }
    return MakeMesh();
  }

  // The vertices alone, whatever the elements are. Later sections are not looked at.
  absl::Status ReadPoints(const CloudOptions& options, PointCloud& cloud) {
    may_be_invalid_ = options.skip_invalid;
    bool has_end = false;
    WELLSPACE_RETURN_IF_ERROR(ReadSections(/*ends_with_vertices=*/true, has_end));
    return has_vertices_ ? AddAllPoints(mesh_.points, mesh_.dimension, options, cloud)
                         : reader_.Error("the file ends; expected Vertices");
  }

 private:
  // Reads up to the end of the file or to the word that ends it.
  absl::Status ReadSections(bool ends_with_vertices, bool& has_end) {
    uint64_t version = 0;
    std::string_view word;
    if (!fields_.Next(word) || word != "MeshVersionFormatted") {
      return reader_.EndError("expected \"MeshVersionFormatted\" at the start of the file");
    }
    WELLSPACE_RETURN_IF_ERROR(fields_.NextWhole("the version", kMaxCount, version));
    while (!has_end && !(ends_with_vertices && has_vertices_) && fields_.Next(word)) {
      // The values of a word that is not known are skipped up to the next word.
      absl::Status status;
      if (word == "End") {
        has_end = true;
      } else if (word == "Dimension") {
        status = ReadDimension();
      } else if (word == "Vertices") {
        status = ReadVertices();
      } else if (word == "Edges") {
        status = ReadElements(edges_, "edges");
      } else if (word == "Ridges") {
        status = ReadRidges();
      } else if (word == "Triangles") {
        status = ReadElements(triangles_, "triangles");
      } else if (word == "Tetrahedra" && mesh_.dimension != 2) {
        status = ReadElements(tetrahedra_, "tetrahedra");
      } else if (word == "Quadrilaterals" || word == "Hexahedra" || word == "Prisms" || word == "Pyramids" ||
                 (mesh_.dimension == 2 && word == "Tetrahedra")) {
        status = reader_.Error(
            absl::StrCat("expected Triangles in 2-D or Tetrahedra in 3-D and no other elements, got ", Quote(word)));
      }
      if (!status.ok()) {
        return status;
      }
    }
    return reader_.status();
  }

  // Elements of one kind, as they are in the file.
  struct Elements {
    int corners;
    bool is_there = false;
    std::vector<uint32_t> vertices{};
    std::vector<int32_t> references{};

    std::span<const uint32_t> At(size_t i) const { return std::span(vertices).subspan(i * corners, corners); }
  };

  // Triangles alone are a mesh in the plane z = 0, whatever "Dimension" says.
  absl::StatusOr<Mesh> MakeMesh() {
    const bool is_flat = mesh_.dimension == 3 && tetrahedra_.vertices.empty() && !triangles_.vertices.empty();
    if (is_flat) {
      WELLSPACE_RETURN_IF_ERROR(Flatten());
    }
    Elements& simplices = mesh_.dimension == 2 ? triangles_ : tetrahedra_;
    const Elements& facets = mesh_.dimension == 2 ? edges_ : triangles_;
    for (size_t i = 0; i < facets.references.size(); ++i) {
      parts_.Add(facets.At(i), facets.references[i]);
    }
    for (const int32_t reference : simplices.references) {
      regions_.Add(reference);
    }
    WELLSPACE_RETURN_IF_ERROR(TakeRidges());
    mesh_.simplices = std::move(simplices.vertices);
    parts_.MoveTo(mesh_);
    regions_.MoveTo(mesh_);
    return std::move(mesh_);
  }

  // In 3-D the edges that are ridges; in the plane edges are facets.
  absl::Status TakeRidges() {
    for (size_t i = 0; i < ridges_.size() && mesh_.dimension == 3; ++i) {
      const uint64_t edge = ridges_[i];
      if (edge == 0 || edge > edges_.references.size()) {
        return absl::InvalidArgumentError(absl::StrCat(reader_.name(), ": Ridges: number ", i + 1,
                                                       " of them: expected an edge from 1 to ",
                                                       edges_.references.size(), ", got ", edge));
      }
      const std::span<const uint32_t> ends = edges_.At(edge - 1);
      mesh_.ridges.insert(mesh_.ridges.end(), ends.begin(), ends.end());
    }
    return absl::OkStatus();
  }

  absl::Status Flatten() {
    std::vector<double> flat;
    flat.reserve(mesh_.points.size() / 3 * 2);
    for (size_t i = 0; i < mesh_.points.size(); i += 3) {
      if (mesh_.points[i + 2] != 0) {
        return absl::InvalidArgumentError(
            absl::StrCat(reader_.name(), ": vertex ", i / 3 + 1,
                         ": expected z = 0 in a mesh of triangles without tetrahedra, got ", mesh_.points[i + 2]));
      }
      flat.insert(flat.end(), {mesh_.points[i], mesh_.points[i + 1]});
    }
    mesh_.points = std::move(flat);
    mesh_.dimension = 2;
    return absl::OkStatus();
  }

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
        WELLSPACE_RETURN_IF_ERROR(fields_.NextCoordinate(kNames[axis], may_be_invalid_, value));
        mesh_.points.push_back(value);
      }
      WELLSPACE_RETURN_IF_ERROR(fields_.Skip("the reference of a vertex"));
    }
    return absl::OkStatus();
  }

  // Vertices and a reference of each. Of edges and triangles there may be several lists.
  absl::Status ReadElements(Elements& elements, const char* what) {
    if (!has_vertices_ || (std::exchange(elements.is_there, true) && elements.corners == mesh_.dimension + 1)) {
      return reader_.Error(absl::StrCat("expected \"Vertices\", and then the ", what,
                                        elements.corners == mesh_.dimension + 1 ? " once" : ""));
    }
    uint64_t count = 0;
    WELLSPACE_RETURN_IF_ERROR(fields_.NextWhole(absl::StrCat("the number of ", what), kMaxCount, count));
    for (uint64_t element = 0; element < count; ++element) {
      WELLSPACE_RETURN_IF_ERROR(ReadCorners(elements.corners, elements.vertices));
      int32_t reference = 0;
      WELLSPACE_RETURN_IF_ERROR(ReadReference(what, reference));
      elements.references.push_back(reference);
    }
    return absl::OkStatus();
  }

  // Numbers of edges, which may come later.
  absl::Status ReadRidges() {
    uint64_t count = 0;
    WELLSPACE_RETURN_IF_ERROR(fields_.NextWhole("the number of ridges", kMaxCount, count));
    for (uint64_t ridge = 0; ridge < count; ++ridge) {
      WELLSPACE_RETURN_IF_ERROR(fields_.NextWhole("the number of an edge", kMaxCount, ridges_.emplace_back()));
    }
    return absl::OkStatus();
  }

  absl::Status ReadReference(const char* what, int32_t& reference) {
    std::string_view field;
    return fields_.Next(field) && absl::SimpleAtoi(absl::string_view(field.data(), field.size()), &reference)
               ? absl::OkStatus()
               : reader_.EndError(absl::StrCat("expected the reference of one of the ", what, ", a whole number, got ",
                                               Quote(field)));
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
  Elements edges_{.corners = 2};
  Elements triangles_{.corners = 3};
  Elements tetrahedra_{.corners = 4};
  std::vector<uint64_t> ridges_;  // of edges_, from 1 on
  FacetSorter parts_;             // of facets with another reference than 0
  RegionCollector regions_;
  uint64_t vertices_ = 0;
  bool has_vertices_ = false;
  bool may_be_invalid_ = false;  // coordinates may be not finite
};

}  // namespace

absl::StatusOr<Mesh> ReadMedit(const std::string& path, const MeshNumbers& /*numbers*/) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  LineReader reader(std::move(file));
  return MeditReader(reader).Read();
}

absl::Status ReadMeditPoints(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  return MeditReader(reader).ReadPoints(options, cloud);
}

}  // namespace wellspace::formats
