// INRIA's MEDIT, in ascii.
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/io/number.h"
#include "client/formats/io/output_file.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/names.h"
#include "client/formats/regions.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class MeditWriter final : public MeshWriter {
 public:
  MeditWriter(OutputFile output, const MeshShape& shape) : shape_(shape), output_(std::move(output)) {
    output_.Write(absl::StrCat("MeshVersionFormatted 2\nDimension ", shape_.dimension, "\nVertices\n",
                               shape_.vertex_count, "\n"));
  }

  absl::Status AddPoints(std::span<const double> points) override {
    for (; !points.empty() && output_.status().ok(); points = points.subspan(shape_.dimension)) {
      line_.clear();
      for (const double x : points.first(shape_.dimension)) {
        AppendNumber(x, line_);
        line_ += ' ';
      }
      line_ += vertices_++ < shape_.input_vertices ? "1\n" : "0\n";
      output_.Write(line_);
    }
    return output_.status();
  }

  absl::Status AddWeights(std::span<const double>) override {
    return absl::InternalError("a mesh without weights got some");
  }

  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override {
    regions_.Add(regions);
    return output_.status();
  }

  absl::Status AddSimplices(std::span<const uint32_t> simplices) override {
    BeginSimplices();
    const size_t corners = shape_.dimension + 1;
    WELLSPACE_RETURN_IF_ERROR(regions_.CheckNext(shape_.has_simplex_regions ? simplices.size() / corners : 0));
    const int32_t only_region = shape_.regions.empty() ? 1 : shape_.regions[0].id;
    for (; !simplices.empty() && output_.status().ok(); simplices = simplices.subspan(corners)) {
      line_.clear();
      for (const uint32_t corner : simplices.first(corners)) {
        AppendNumber(uint64_t{corner} + 1, line_);
        line_ += ' ';
      }
      absl::StrAppend(&line_, shape_.has_simplex_regions ? regions_.Next() : only_region, "\n");
      output_.Write(line_);
      ++simplices_;
    }
    return output_.status();
  }

  absl::Status AddFacets(std::span<const uint32_t> facets) override {
    BeginFacets();
    for (; !facets.empty() && output_.status().ok(); facets = facets.subspan(shape_.dimension)) {
      line_.clear();
      for (const uint32_t corner : facets.first(shape_.dimension)) {
        AppendNumber(uint64_t{corner} + 1, line_);
        line_ += ' ';
      }
      absl::StrAppend(&line_, walk_.Next().tag, "\n");
      output_.Write(line_);
      ++facets_;
    }
    return output_.status();
  }

  // Edges, and that all of them are ridges: Mmg keeps those.
  absl::Status AddRidges(std::span<const uint32_t> ridges) override {
    if (!shape_.boundary.empty()) {
      BeginFacets();
    }
    if (!std::exchange(has_ridges_, true)) {
      output_.Write(absl::StrCat("Edges\n", shape_.ridge_count, "\n"));
    }
    for (; !ridges.empty() && output_.status().ok(); ridges = ridges.subspan(2)) {
      output_.Write(absl::StrCat(uint64_t{ridges[0]} + 1, " ", uint64_t{ridges[1]} + 1, " 0\n"));
      ++ridges_;
    }
    return output_.status();
  }

  absl::Status Commit() override {
    BeginSimplices();
    if (!shape_.boundary.empty()) {
      BeginFacets();
    }
    if (ridges_ > 0) {
      output_.Write(absl::StrCat("Ridges\n", ridges_, "\n"));
      for (uint64_t ridge = 1; ridge <= ridges_ && output_.status().ok(); ++ridge) {
        output_.Write(absl::StrCat(ridge, "\n"));
      }
    }
    // Behind the end: not every reader knows comments.
    const NameLines names(shape_);
    AddNote(names.ChangesNote());
    output_.Write(absl::StrCat("End\n", names.Text("# ")));
    WELLSPACE_RETURN_IF_ERROR(output_.status());
    WELLSPACE_RETURN_IF_ERROR(CheckComplete(shape_, {.vertices = vertices_,
                                                     .weights = 0,
                                                     .simplex_regions = regions_.count(),
                                                     .simplices = simplices_,
                                                     .facets = facets_,
                                                     .ridges = ridges_}));
    return output_.Commit();
  }

 private:
  void BeginSimplices() {
    if (!std::exchange(has_simplices_, true)) {
      output_.Write(absl::StrCat(shape_.dimension == 2 ? "Triangles\n" : "Tetrahedra\n", shape_.simplex_count, "\n"));
    }
  }

  void BeginFacets() {
    if (!std::exchange(has_facets_, true)) {
      output_.Write(absl::StrCat(shape_.dimension == 2 ? "Edges\n" : "Triangles\n", shape_.facet_count(), "\n"));
    }
  }

  const MeshShape shape_;
  OutputFile output_;
  PartWalk walk_{shape_.boundary};
  RegionQueue regions_;
  bool has_simplices_ = false;  // the section
  bool has_facets_ = false;     // the section
  bool has_ridges_ = false;     // the section of their edges
  uint64_t vertices_ = 0;
  uint64_t simplices_ = 0;
  uint64_t facets_ = 0;
  uint64_t ridges_ = 0;
  std::string line_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateMedit(const std::string& path, const MeshShape& shape,
                                                        std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(path, std::move(stop)));
  return std::make_unique<MeditWriter>(std::move(output), shape);
}

}  // namespace wellspace::formats
