// The input file of Abaqus, which CalculiX reads as well. Of a number both read 20 characters and no more.
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
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
#include "client/formats/orientation.h"
#include "client/formats/regions.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kAbaqusNumberWidth = 20;

// The corners of the faces that Abaqus calls S1, S2, ... of a triangle (CPS3, CPS6) and a tetrahedron (C3D4, C3D10).
constexpr uint8_t kAbaqusTriangleFaces[][2] = {{0, 1}, {1, 2}, {2, 0}};
constexpr uint8_t kAbaqusTetrahedronFaces[][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};

// A facet by its vertices in ascending order; in 2-D the last one is none.
using FacetKey = std::array<uint32_t, 3>;
constexpr FacetKey kAbaqusNoFacet = {~uint32_t{0}, ~uint32_t{0}, ~uint32_t{0}};

FacetKey KeyOf(std::span<const uint32_t> simplex, std::span<const uint8_t> face) {
  FacetKey key = kAbaqusNoFacet;
  for (size_t i = 0; i < face.size(); ++i) {
    key[i] = simplex[face[i]];
  }
  std::sort(key.begin(), key.end());
  return key;
}

// Numbers separated by commas, as many in a line as Abaqus takes.
class NumberLines {
 public:
  explicit NumberLines(OutputFile& output) : output_(output) {}
  ~NumberLines() { End(); }

  void Add(uint64_t number) {
    line_ += line_.empty() ? "" : ", ";
    AppendNumber(number, line_);
    if (++numbers_ == kNumbersOfLine) {
      End();
    }
  }

 private:
  static constexpr int kNumbersOfLine = 16;

  void End() {
    if (numbers_ > 0) {
      line_ += '\n';
      output_.Write(line_);
    }
    line_.clear();
    numbers_ = 0;
  }

  OutputFile& output_;
  std::string line_;
  int numbers_ = 0;
};

class AbaqusWriter final : public MeshWriter {
 public:
  AbaqusWriter(OutputFile output, const MeshShape& shape, std::string path)
      : shape_(shape), output_(std::move(output)), path_(std::move(path)) {
    output_.Write(absl::StrCat("*HEADING\n", shape_.vertex_count, " nodes, ", shape_.simplex_count, " ",
                               SimplexName(shape_.dimension), "\n*NODE\n"));
  }

  absl::Status AddPoints(std::span<const double> points) override {
    for (; !points.empty() && output_.status().ok(); points = points.subspan(shape_.dimension)) {
      line_.clear();
      AppendNumber(++vertices_, line_);
      bool is_rounded = false;
      for (const double x : points.first(shape_.dimension)) {
        line_ += ", ";
        is_rounded |= AppendNumberWithin(x, kAbaqusNumberWidth, line_) != x;
      }
      line_ += '\n';
      output_.Write(line_);
      points_.insert(points_.end(), points.begin(), points.begin() + shape_.dimension);
      is_rounded_.push_back(is_rounded);
      rounded_vertices_ += is_rounded ? 1 : 0;
    }
    return output_.status();
  }

  absl::Status AddWeights(std::span<const double>) override {
    return absl::InternalError("a mesh without weights got some");
  }

  absl::Status AddVertexTags(std::span<const int32_t> tags) override {
    for (const int32_t tag : tags) {
      is_tagged_.push_back(tag != 0);
    }
    return output_.status();
  }

  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override {
    regions_.Add(regions);
    return output_.status();
  }

  absl::Status AddSimplices(std::span<const uint32_t> simplices) override {
    BeginSimplices();
    const size_t corners = shape_.dimension + 1;
    const size_t nodes = shape_.simplex_nodes();
    for (; !simplices.empty() && output_.status().ok(); simplices = simplices.subspan(nodes)) {
      line_.clear();
      AppendNumber(++simplices_, line_);
      for (const uint32_t node : simplices.first(nodes)) {
        line_ += ", ";
        AppendNumber(uint64_t{node} + 1, line_);
      }
      line_ += '\n';
      output_.Write(line_);
      WELLSPACE_RETURN_IF_ERROR(CheckOrientation(simplices.first(corners)));
      KeepIfAtBoundary(simplices.first(corners));
    }
    return output_.status();
  }

  absl::Status AddFacets(std::span<const uint32_t> facets) override {
    facets_.insert(facets_.end(), facets.begin(), facets.end());
    return output_.status();
  }

  absl::Status Commit() override {
    BeginSimplices();
    WELLSPACE_RETURN_IF_ERROR(output_.status());
    WELLSPACE_RETURN_IF_ERROR(CheckComplete(shape_, {.vertices = vertices_,
                                                     .weights = 0,
                                                     .simplex_regions = regions_.count(),
                                                     .simplices = simplices_,
                                                     .facets = facets_.size() / shape_.facet_nodes()}));
    if (shape_.input_vertices > 0) {
      output_.Write(absl::StrCat("*NSET, NSET=", set_labels_.Take("input", "", 0), ", GENERATE\n1, ",
                                 shape_.input_vertices, ", 1\n"));
    }
    if (shape_.has_simplex_regions) {
      WriteRegions();
    }
    WriteBoundary();
    if (rounded_vertices_ > 0) {
      AddNote(absl::StrCat("Abaqus and CalculiX read ", kAbaqusNumberWidth, " characters of a number: coordinates of ",
                           rounded_vertices_, rounded_vertices_ == 1 ? " vertex are" : " vertices are",
                           " rounded to them, by less than 1e-13 of themselves; every element keeps its orientation"));
    }
    AddNote(region_labels_.ChangesNote());
    AddNote(set_labels_.ChangesNote());
    return output_.Commit();
  }

 private:
  // The face of a simplex that a facet is; element 0: none.
  struct Side {
    uint64_t element = 0;  // from 1 on
    int face = 0;          // from 1 on
  };

  void BeginSimplices() {
    if (std::exchange(has_simplices_, true)) {
      return;
    }
    const bool is_first = shape_.order == MeshOrder::kFirst;
    output_.Write(absl::StrCat("*ELEMENT, TYPE=",
                               shape_.dimension == 2 ? (is_first ? "CPS3" : "CPS6") : (is_first ? "C3D4" : "C3D10")));
    if (!shape_.has_simplex_regions) {
      const Region region = shape_.regions.empty() ? Region{.id = 1, .name = "domain"} : shape_.regions[0];
      output_.Write(absl::StrCat(", ELSET=", region_labels_.Take(region.name, "region", region.id)));
    }
    output_.Write("\n");
  }

  // Rounding must not turn an element over, or make it flat.
  absl::Status CheckOrientation(std::span<const uint32_t> simplex) {
    bool is_rounded = false;
    for (const uint32_t corner : simplex) {
      is_rounded |= corner < is_rounded_.size() && is_rounded_[corner];
    }
    if (!is_rounded) {
      return absl::OkStatus();
    }
    std::vector<double> exact;
    std::vector<double> rounded;
    std::string digits;
    for (const uint32_t corner : simplex) {
      for (int axis = 0; axis < shape_.dimension; ++axis) {
        exact.push_back(points_[size_t{corner} * shape_.dimension + axis]);
        digits.clear();
        rounded.push_back(AppendNumberWithin(exact.back(), kAbaqusNumberWidth, digits));
      }
    }
    return OrientationSign(exact) == OrientationSign(rounded)
               ? absl::OkStatus()
               : absl::InvalidArgumentError(absl::StrCat(
                     "cannot write ", path_, ": Abaqus and CalculiX read ", kAbaqusNumberWidth,
                     " characters of a number, and element ", simplices_,
                     " would lose its orientation by them, so close are its vertices; expected msh41, vtu or npz"));
  }

  // Facets come later. Only a simplex with as many tagged vertices as a facet has can have one.
  void KeepIfAtBoundary(std::span<const uint32_t> simplex) {
    if (shape_.boundary.empty()) {
      return;
    }
    int tagged = 0;
    for (const uint32_t corner : simplex) {
      tagged += corner >= is_tagged_.size() || is_tagged_[corner] ? 1 : 0;
    }
    if (tagged >= shape_.dimension) {
      kept_.insert(kept_.end(), simplex.begin(), simplex.end());
      kept_numbers_.push_back(simplices_);
    }
  }

  std::span<const uint8_t> FaceOf(int face) const {
    return shape_.dimension == 2 ? std::span<const uint8_t>(kAbaqusTriangleFaces[face])
                                 : std::span<const uint8_t>(kAbaqusTetrahedronFaces[face]);
  }

  // Of every facet its side; of one between two simplices that of the first.
  std::vector<Side> FindSides() const {
    const size_t corners = shape_.dimension;
    const size_t nodes = shape_.facet_nodes();
    std::vector<std::pair<FacetKey, size_t>> keys;
    for (size_t i = 0; i * nodes < facets_.size(); ++i) {
      FacetKey key = kAbaqusNoFacet;
      std::copy_n(facets_.begin() + i * nodes, corners, key.begin());
      std::sort(key.begin(), key.end());
      keys.emplace_back(key, i);
    }
    std::sort(keys.begin(), keys.end());
    std::vector<Side> sides(keys.size());
    for (size_t i = 0; i < kept_numbers_.size(); ++i) {
      const auto simplex = std::span(kept_).subspan(i * (corners + 1), corners + 1);
      for (int face = 0; face <= shape_.dimension; ++face) {
        const FacetKey key = KeyOf(simplex, FaceOf(face));
        for (auto at = std::lower_bound(keys.begin(), keys.end(), std::pair(key, size_t{0}));
             at != keys.end() && at->first == key; ++at) {
          if (Side& side = sides[at->second]; side.element == 0) {
            side = {.element = kept_numbers_[i], .face = face + 1};
          }
        }
      }
    }
    return sides;
  }

  void WriteRegions() {
    std::map<int32_t, std::vector<std::pair<uint64_t, uint64_t>>> runs;  // the first number and the one after the last
    for (uint64_t number = 1; number <= simplices_; ++number) {
      auto& of_region = runs[regions_.Next()];
      if (of_region.empty() || of_region.back().second != number) {
        of_region.emplace_back(number, number);
      }
      ++of_region.back().second;
    }
    for (const Region& region : shape_.regions) {
      if (!runs.contains(region.id)) {
        continue;
      }
      output_.Write(absl::StrCat("*ELSET, ELSET=", region_labels_.Take(region.name, "region", region.id), "\n"));
      NumberLines lines(output_);
      for (const auto& [first, end] : runs[region.id]) {
        for (uint64_t number = first; number < end; ++number) {
          lines.Add(number);
        }
      }
    }
  }

  // Of every part its vertices, for fixed boundaries, and its faces, for loads and contact.
  void WriteBoundary() {
    const std::vector<Side> sides = FindSides();
    size_t facet = 0;
    for (const BoundaryPart& part : shape_.boundary) {
      const size_t end = facet + part.facets;
      if (part.facets == 0) {
        continue;
      }
      const std::string label = set_labels_.Take(part.name, "boundary", part.tag);
      std::vector<uint32_t> vertices(facets_.begin() + facet * shape_.facet_nodes(),
                                     facets_.begin() + end * shape_.facet_nodes());
      std::sort(vertices.begin(), vertices.end());
      vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
      output_.Write(absl::StrCat("*NSET, NSET=", label, "\n"));
      {
        NumberLines lines(output_);
        for (const uint32_t vertex : vertices) {
          lines.Add(uint64_t{vertex} + 1);
        }
      }
      output_.Write(absl::StrCat("*SURFACE, NAME=", label, ", TYPE=ELEMENT\n"));
      for (; facet < end && output_.status().ok(); ++facet) {
        if (sides[facet].element != 0) {
          output_.Write(absl::StrCat(sides[facet].element, ", S", sides[facet].face, "\n"));
        }
      }
    }
  }

  const MeshShape shape_;
  OutputFile output_;
  const std::string path_;
  std::vector<double> points_;    // all
  std::vector<bool> is_rounded_;  // of vertices: whether a coordinate is
  uint64_t rounded_vertices_ = 0;
  RegionQueue regions_;
  Labels region_labels_;
  Labels set_labels_;
  bool has_simplices_ = false;          // the section
  std::vector<bool> is_tagged_;         // of vertices; empty: not known
  std::vector<uint32_t> facets_;        // all
  std::vector<uint32_t> kept_;          // simplices that may have a facet
  std::vector<uint64_t> kept_numbers_;  // of them, from 1 on
  uint64_t vertices_ = 0;
  uint64_t simplices_ = 0;
  std::string line_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateAbaqus(const std::string& path, const MeshShape& shape,
                                                         std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(path, std::move(stop)));
  return std::make_unique<AbaqusWriter>(std::move(output), shape, path);
}

}  // namespace wellspace::formats
