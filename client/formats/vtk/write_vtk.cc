// VTK's legacy format, in binary: https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html, version
// 3.0, which is read by all of them.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/io/output_file.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/names.h"
#include "client/formats/regions.h"
#include "client/formats/vtk/vtk_cells.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr uint64_t kVtkMaxInt = std::numeric_limits<int32_t>::max();

// The format is big-endian whatever the machine.
template <typename T>
void AppendBigEndian(T value, std::string& bytes) {
  char word[sizeof(T)];
  std::memcpy(word, &value, sizeof(T));
  std::reverse(word, word + sizeof(T));
  bytes.append(word, sizeof(T));
}

bool IsPlainInVtkWord(char c) { return c > ' ' && c < '\x7f' && c != '"' && c != '#'; }

// Names as words: VTK has other bytes than those of printable ASCII by their numbers, "My%20name", and reads words of
// at most 255 bytes. No two are the same.
std::vector<std::string> VtkNames(const std::vector<std::string>& names, NameChanges& changes) {
  constexpr size_t kMaxWordBytes = 255;
  std::vector<std::string> words;
  std::set<std::string> taken;
  for (const std::string& name : names) {
    std::string held = name;
    std::string word = PercentEncoded(held, IsPlainInVtkWord);
    while (word.size() > kMaxWordBytes) {
      held = CutName(held, held.size() - 1);
      word = PercentEncoded(held, IsPlainInVtkWord);
    }
    for (int number = 2; !taken.insert(word).second; ++number) {
      held = absl::StrCat(std::string(CutName(held, std::min<size_t>(held.size(), 60))), "_", number);
      word = PercentEncoded(held, IsPlainInVtkWord);
    }
    changes.Add(name, held);
    words.push_back(word);
  }
  return words;
}

class VtkWriter final : public MeshWriter {
 public:
  VtkWriter(OutputFile output, const MeshShape& shape) : shape_(shape), output_(std::move(output)) {
    output_.Write(absl::StrCat("# vtk DataFile Version 3.0\n", shape_.vertex_count, " vertices, ", shape_.simplex_count,
                               " ", SimplexName(shape_.dimension), "\nBINARY\nDATASET UNSTRUCTURED_GRID\n"));
    const NameLines names(shape_);
    AddNote(names.ChangesNote());
    if (const std::string text = names.Text(""); !text.empty()) {
      output_.Write(absl::StrCat("FIELD FieldData 1\n", kVtkNames, " 1 ", text.size(), " unsigned_char\n", text, "\n"));
    }
    output_.Write(absl::StrCat("POINTS ", shape_.vertex_count, " double\n"));
  }

  absl::Status AddPoints(std::span<const double> points) override {
    for (; !points.empty() && output_.status().ok(); points = points.subspan(shape_.dimension)) {
      row_.clear();
      for (int axis = 0; axis < 3; ++axis) {
        AppendBigEndian(axis < shape_.dimension ? points[axis] : 0.0, row_);
      }
      output_.Write(row_);
      ++vertices_;
    }
    return output_.status();
  }

  // Data of points stand behind the cells: they are kept until then.
  absl::Status AddWeights(std::span<const double> weights) override {
    Keep<double>(weights, "weights", "double");
    weights_ += weights.size();
    return output_.status();
  }

  absl::Status AddVertexOrigins(std::span<const uint32_t> origins) override {
    for (const uint32_t origin : origins) {
      const int64_t value = SignedOrigin(origin);
      if (value > static_cast<int64_t>(kVtkMaxInt)) {
        return absl::InvalidArgumentError(absl::StrCat("legacy .vtk numbers input points up to ", kVtkMaxInt,
                                                       ", and got ", value, "; expected vtu or npz"));
      }
      const auto narrow = static_cast<int32_t>(value);
      Keep<int32_t>({&narrow, 1}, kVtkOrigin, "int");
    }
    return output_.status();
  }

  absl::Status AddVertexTags(std::span<const int32_t> tags) override {
    Keep<int32_t>(tags, kVtkBoundary, "int");
    return output_.status();
  }

  absl::Status AddAttribute(size_t index, std::span<const double> values) override {
    Keep<double>(values, attribute_words_[index], "double");
    attribute_values_ += values.size();
    return output_.status();
  }

  absl::Status AddSimplexRegions(std::span<const int32_t> regions) override {
    regions_.Add(regions);
    return output_.status();
  }

  absl::Status AddSimplices(std::span<const uint32_t> simplices) override {
    AddCells(simplices, shape_.simplex_nodes());
    simplices_ += simplices.size() / shape_.simplex_nodes();
    return output_.status();
  }

  absl::Status AddFacets(std::span<const uint32_t> facets) override {
    AddCells(facets, shape_.facet_nodes());
    facets_ += facets.size() / shape_.facet_nodes();
    return output_.status();
  }

  absl::Status Commit() override {
    BeginCells();
    WELLSPACE_RETURN_IF_ERROR(output_.status());
    WELLSPACE_RETURN_IF_ERROR(CheckComplete(shape_, {.vertices = vertices_,
                                                     .weights = weights_,
                                                     .simplex_regions = regions_.count(),
                                                     .simplices = simplices_,
                                                     .facets = facets_,
                                                     .attribute_values = attribute_values_}));
    const uint64_t cells = VtkCellCount(shape_);
    output_.Write(absl::StrCat("\nCELL_TYPES ", cells, "\n"));
    WriteEach(cells, [this](uint64_t cell) -> int32_t { return VtkCellType(shape_, cell); });
    WriteCellData();
    WritePointData();
    AddNote(changes_.Note("VTK reads words of at most 255 bytes as names of attributes"));
    return output_.Commit();
  }

 private:
  // Data of all points, as the file has them.
  struct Field {
    std::string name;
    std::string type;
    std::string bytes;
  };

  template <typename T>
  void Keep(std::span<const T> values, const std::string& name, const char* type) {
    if (point_data_.empty() || point_data_.back().name != name) {
      point_data_.push_back({name, type, {}});
    }
    for (const T value : values) {
      AppendBigEndian(value, point_data_.back().bytes);
    }
  }

  void BeginCells() {
    if (!std::exchange(has_cells_, true)) {
      const uint64_t cells = VtkCellCount(shape_);
      output_.Write(absl::StrCat("\nCELLS ", cells, " ", cells + VtkOffset(shape_, cells), "\n"));
    }
  }

  // Every cell is the number of its nodes, then these.
  void AddCells(std::span<const uint32_t> vertices, size_t nodes) {
    BeginCells();
    for (; !vertices.empty() && output_.status().ok(); vertices = vertices.subspan(nodes)) {
      row_.clear();
      AppendBigEndian(static_cast<int32_t>(nodes), row_);
      for (const uint32_t vertex : vertices.first(nodes)) {
        AppendBigEndian(static_cast<int32_t>(vertex), row_);
      }
      output_.Write(row_);
    }
  }

  // `value_of` each number below `count`, which are asked for in this order, and the end of the array.
  template <typename ValueOf>
  void WriteEach(uint64_t count, ValueOf value_of) {
    for (uint64_t i = 0; i < count && output_.status().ok(); ++i) {
      row_.clear();
      AppendBigEndian(value_of(i), row_);
      output_.Write(row_);
    }
    output_.Write("\n");
  }

  void WriteCellData() {
    if (!HasCellData(shape_)) {
      return;
    }
    const uint64_t cells = VtkCellCount(shape_);
    const int32_t only_region = shape_.regions.empty() ? 0 : shape_.regions[0].id;
    output_.Write(absl::StrCat("CELL_DATA ", cells, "\nFIELD FieldData ", shape_.boundary.empty() ? 1 : 2, "\n",
                               kVtkRegion, " 1 ", cells, " int\n"));
    WriteEach(cells, [&](uint64_t cell) -> int32_t {
      return cell >= shape_.simplex_count ? 0 : shape_.has_simplex_regions ? regions_.Next() : only_region;
    });
    if (!shape_.boundary.empty()) {
      output_.Write(absl::StrCat(kVtkBoundary, " 1 ", cells, " int\n"));
      PartWalk walk(shape_.boundary);
      WriteEach(cells, [&](uint64_t cell) -> int32_t { return cell < shape_.simplex_count ? 0 : walk.Next().tag; });
    }
  }

  void WritePointData() {
    output_.Write(absl::StrCat("POINT_DATA ", shape_.vertex_count, "\nFIELD FieldData ", 1 + point_data_.size(),
                               "\ninput 1 ", shape_.vertex_count, " unsigned_char\n"));
    WriteEach(shape_.vertex_count,
              [this](uint64_t vertex) -> uint8_t { return vertex < shape_.input_vertices ? 1 : 0; });
    for (const Field& field : point_data_) {
      output_.Write(absl::StrCat(field.name, " 1 ", shape_.vertex_count, " ", field.type, "\n"));
      output_.Write(field.bytes);
      output_.Write("\n");
    }
  }

  const MeshShape shape_;
  OutputFile output_;
  RegionQueue regions_;
  NameChanges changes_;
  const std::vector<std::string> attribute_words_ = VtkNames(shape_.attributes, changes_);
  std::vector<Field> point_data_;
  bool has_cells_ = false;  // the section
  uint64_t vertices_ = 0;
  uint64_t weights_ = 0;
  uint64_t simplices_ = 0;
  uint64_t facets_ = 0;
  uint64_t attribute_values_ = 0;
  std::string row_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateVtk(const std::string& path, const MeshShape& shape,
                                                      std::stop_token stop) {
  if (shape.vertex_count > kVtkMaxInt) {
    return absl::InvalidArgumentError(absl::StrCat("cannot write ", path, ": legacy .vtk numbers at most ", kVtkMaxInt,
                                                   " vertices, and this mesh has ", shape.vertex_count,
                                                   "; expected vtu or npz"));
  }
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(path, std::move(stop)));
  return std::make_unique<VtkWriter>(std::move(output), shape);
}

}  // namespace wellspace::formats
