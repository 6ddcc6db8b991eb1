// The format of SU2: https://su2code.github.io/docs_v7/Mesh-File.
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/io/number.h"
#include "client/formats/io/output_file.h"
#include "client/formats/labels.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/vtk/vtk_cells.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class Su2Writer final : public MeshWriter {
 public:
  Su2Writer(OutputFile output, const MeshShape& shape) : shape_(shape), output_(std::move(output)) {
    output_.Write(absl::StrCat("% The first ", shape_.input_vertices, " points are input points.\nNDIME= ",
                               shape_.dimension, "\nNPOIN= ", shape_.vertex_count, "\n"));
  }

  absl::Status AddPoints(std::span<const double> points) override {
    for (; !points.empty() && output_.status().ok(); points = points.subspan(shape_.dimension)) {
      line_.clear();
      for (const double x : points.first(shape_.dimension)) {
        AppendNumber(x, line_);
        line_ += ' ';
      }
      AppendNumber(vertices_++, line_);
      line_ += '\n';
      output_.Write(line_);
    }
    return output_.status();
  }

  absl::Status AddWeights(std::span<const double>) override {
    return absl::InternalError("a mesh without weights got some");
  }

  // A zone of SU2 is a mesh of its own: there is no place for regions.
  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override {
    simplex_regions_ += regions.size();
    return output_.status();
  }

  absl::Status AddSimplices(std::span<const uint32_t> simplices) override {
    BeginSimplices();
    const size_t corners = shape_.dimension + 1;
    for (; !simplices.empty() && output_.status().ok(); simplices = simplices.subspan(corners)) {
      WriteCell(VtkCellType(shape_, 0), simplices.first(corners), simplices_++);
    }
    return output_.status();
  }

  absl::Status AddFacets(std::span<const uint32_t> facets) override {
    BeginMarkers();
    const size_t corners = shape_.dimension;
    for (; !facets.empty() && output_.status().ok(); facets = facets.subspan(corners)) {
      const BoundaryPart& part = walk_.Next();
      if (walk_.is_first()) {
        output_.Write(absl::StrCat("MARKER_TAG= ", labels_.Take(part.name, "boundary", part.tag),
                                   "\nMARKER_ELEMS= ", part.facets, "\n"));
        facets_of_part_ = 0;
      }
      WriteCell(VtkCellType(shape_, shape_.simplex_count), facets.first(corners), facets_of_part_++);
      ++facets_;
    }
    return output_.status();
  }

  absl::Status Commit() override {
    BeginSimplices();
    BeginMarkers();
    WELLSPACE_RETURN_IF_ERROR(output_.status());
    WELLSPACE_RETURN_IF_ERROR(CheckComplete(shape_, {.vertices = vertices_,
                                                     .weights = 0,
                                                     .simplex_regions = simplex_regions_,
                                                     .simplices = simplices_,
                                                     .facets = facets_}));
    AddNote(labels_.ChangesNote());
    return output_.Commit();
  }

 private:
  void BeginSimplices() {
    if (!std::exchange(has_simplices_, true)) {
      output_.Write(absl::StrCat("NELEM= ", shape_.simplex_count, "\n"));
    }
  }

  // Parts without facets are left out: SU2 wants an element of every marker.
  void BeginMarkers() {
    if (!std::exchange(has_markers_, true)) {
      int markers = 0;
      for (const BoundaryPart& part : shape_.boundary) {
        markers += part.facets > 0 ? 1 : 0;
      }
      output_.Write(absl::StrCat("NMARK= ", markers, "\n"));
    }
  }

  void WriteCell(uint8_t type, std::span<const uint32_t> corners, uint64_t number) {
    line_.clear();
    AppendNumber(uint64_t{type}, line_);
    for (const uint32_t corner : corners) {
      line_ += ' ';
      AppendNumber(uint64_t{corner}, line_);
    }
    line_ += ' ';
    AppendNumber(number, line_);
    line_ += '\n';
    output_.Write(line_);
  }

  const MeshShape shape_;
  OutputFile output_;
  PartWalk walk_{shape_.boundary};
  Labels labels_;
  bool has_simplices_ = false;  // the section
  bool has_markers_ = false;    // the section
  uint64_t vertices_ = 0;
  uint64_t simplex_regions_ = 0;
  uint64_t simplices_ = 0;
  uint64_t facets_ = 0;
  uint64_t facets_of_part_ = 0;  // of them
  std::string line_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateSu2(const std::string& path, const MeshShape& shape,
                                                      std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(path, std::move(stop)));
  return std::make_unique<Su2Writer>(std::move(output), shape);
}

}  // namespace wellspace::formats
