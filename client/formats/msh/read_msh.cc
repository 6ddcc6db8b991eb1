// Gmsh's MSH: 2.2 and 4.1, in ascii and in binary.
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/field_reader.h"
#include "client/formats/io/input_file.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/msh/msh.h"
#include "client/formats/msh/msh_nodes.h"
#include "client/formats/msh/msh_numbers.h"
#include "client/formats/point_rows.h"
#include "client/formats/regions.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// How many nodes an element of this type has; 0 if it is none of a simplicial mesh.
int NodesOf(uint64_t type) {
  switch (type) {
    case kMshPoint:
      return 1;
    case kMshLine:
      return 2;
    case kMshTriangle:
      return 3;
    case kMshTetrahedron:
      return 4;
    default:
      return 0;
  }
}

// Reads section after section. Rows of the versions differ in their order alone; MshNumbers knows the encoding of
// numbers.
class MshReader {
 public:
  MshReader(LineReader& reader, const std::string& numbers)
      : reader_(reader),
        file_(reader),
        nodes_(file_),
        numbers_name_(numbers.empty() ? "" : absl::StrCat("\"", numbers, "\"")) {}

  absl::StatusOr<Mesh> Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadSections(/*ends_with_nodes=*/false));
    if (!reader_.status().ok() || !has_nodes_ || !has_elements_) {
      return reader_.EndError(has_nodes_ ? "the file ends; expected \"$Elements\""
                                         : "the file ends; expected \"$Nodes\"");
    }
    return MakeMesh();
  }

  // The nodes alone, whatever the elements are. Later sections are not looked at.
  absl::Status ReadPoints(const CloudOptions& options, PointCloud& cloud) {
    if (options.skip_invalid) {
      nodes_.AllowInvalid();
    }
    WELLSPACE_RETURN_IF_ERROR(ReadSections(/*ends_with_nodes=*/true));
    return has_nodes_ ? AddAllPoints(nodes_.TakePoints(), 3, options, cloud)
                      : reader_.EndError("the file ends; expected \"$Nodes\"");
  }

 private:
  absl::Status ReadSections(bool ends_with_nodes) {
    std::string_view line;
    if (!file_.NextLine(line) || line != "$MeshFormat") {
      return reader_.EndError("expected \"$MeshFormat\" at the start of the file");
    }
    absl::Status status = ReadFormat();
    while (status.ok() && !(ends_with_nodes && has_nodes_) && file_.NextLine(line)) {
      if (line.front() != '$') {
        status = reader_.Error(absl::StrCat("expected the start of a section, such as \"$Nodes\", got ", Quote(line)));
      } else if (line == "$PhysicalNames") {
        status = ReadSection("$EndPhysicalNames", &MshReader::ReadPhysicalNames);
      } else if (line == "$Entities" && !is_2_2_) {
        status = ReadSection("$EndEntities", &MshReader::ReadEntities);
      } else if (line == "$Nodes") {
        status = ReadSection("$EndNodes", &MshReader::ReadNodes);
      } else if (line == "$Elements") {
        status = ReadSection("$EndElements", &MshReader::ReadElements);
      } else if (line == "$NodeData") {
        status = ReadSection("$EndNodeData", &MshReader::ReadNodeData);
      } else {
        status = file_.SkipTo(absl::StrCat("$End", std::string(line.substr(1))));
      }
    }
    return status;
  }

  using Section = absl::Status (MshReader::*)();

  absl::Status ReadFormat() {
    std::string_view line;
    if (!file_.NextLine(line)) {
      return reader_.EndError("the file ends; expected the version");
    }
    FieldSplitter fields(line, ' ');
    std::array<std::string_view, 3> words;
    for (std::string_view& word : words) {
      fields.Next(word);
    }
    is_2_2_ = words[0] == "2.2";
    const bool is_binary = words[1] == "1";
    if ((!is_2_2_ && words[0] != "4.1") || (words[1] != "0" && words[1] != "1") || words[2] != "8") {
      return reader_.Error(
          absl::StrCat("expected version 2.2 or 4.1, in ascii (0 8) or binary (1 8), got ", Quote(line)));
    }
    if (is_binary) {
      file_.SetBinary(is_2_2_);
      uint64_t one = 0;
      WELLSPACE_RETURN_IF_ERROR(file_.Int("the number 1", 0x7fffffff, one));
      if (one != 1) {
        return file_.ValueError(absl::StrCat("expected little-endian numbers, a 1 first, got ", one));
      }
    }
    return file_.ExpectLine("$EndMeshFormat");
  }

  absl::Status ReadSection(const char* end, Section read) {
    file_.DropLine();
    WELLSPACE_RETURN_IF_ERROR((this->*read)());
    return file_.ExpectLine(end);
  }

  // Rows of a dimension, the number of a group and its name in quotes.
  absl::Status ReadPhysicalNames() {
    std::string_view line;
    uint64_t rows = 0;
    if (!file_.NextLine(line) || !ParseUnsigned(line, kMaxCount, rows)) {
      return reader_.EndError("expected the number of physical names");
    }
    for (uint64_t row = 0; row < rows; ++row) {
      if (!file_.NextLine(line)) {
        return reader_.EndError("the file ends; expected a physical name");
      }
      FieldSplitter fields(line, ' ');
      std::string_view dimension;
      std::string_view number;
      int32_t group = 0;
      const size_t open = line.find('"');
      if (!fields.Next(dimension) || !fields.Next(number) ||
          !absl::SimpleAtoi(absl::string_view(number.data(), number.size()), &group) ||
          open == std::string_view::npos || line.back() != '"' || open + 1 == line.size()) {
        return reader_.Error(
            absl::StrCat("expected a dimension, the number of a group and its name in quotes, got ", Quote(line)));
      }
      if (dimension == "1" || dimension == "2" || dimension == "3") {
        names_[dimension.front() - '0'][group] = std::string(line.substr(open + 1, line.size() - open - 2));
      }
    }
    return absl::OkStatus();
  }

  // Of points, curves, surfaces and volumes: numbers, bounding boxes, groups, and their bounds.
  absl::Status ReadEntities() {
    std::array<uint64_t, 4> counts{};
    for (uint64_t& count : counts) {
      WELLSPACE_RETURN_IF_ERROR(file_.Size("the number of entities", kMaxCount, count));
    }
    for (int dimension = 0; dimension < 4; ++dimension) {
      for (uint64_t entity = 0; entity < counts[dimension]; ++entity) {
        WELLSPACE_RETURN_IF_ERROR(ReadEntity(dimension));
      }
    }
    return absl::OkStatus();
  }

  absl::Status ReadEntity(int dimension) {
    uint64_t number = 0;
    absl::Status status = file_.Int("the number of an entity", kMaxCount, number);
    double bound = 0;
    for (int i = 0; status.ok() && i < (dimension == 0 ? 3 : 6); ++i) {
      status = file_.Number("a bound of an entity", bound);
    }
    int32_t group = 0;
    uint64_t count = 0;
    for (const bool are_groups : {true, false}) {
      if (!status.ok() || (dimension == 0 && !are_groups)) {
        break;
      }
      status = file_.Size("a number of groups or entities", kMaxCount, count);
      for (uint64_t i = 0; status.ok() && i < count; ++i) {
        int32_t signed_number = 0;
        status = file_.SignedInt("the number of a group or an entity", signed_number);
        group = are_groups && i == 0 ? signed_number : group;
      }
    }
    if (status.ok() && group != 0 && dimension > 0) {
      groups_[dimension][number] = group;
    }
    return status;
  }

  absl::Status ReadNodes() {
    if (std::exchange(has_nodes_, true)) {
      return reader_.Error("expected one section \"$Nodes\", got another one");
    }
    WELLSPACE_RETURN_IF_ERROR(is_2_2_ ? ReadNodes22() : ReadNodes41());
    return nodes_.Index();
  }

  absl::Status ReadNodes22() {
    uint64_t count = 0;
    absl::Status status = file_.Count("the number of nodes", kMaxCount, count);
    for (uint64_t node = 0; status.ok() && node < count; ++node) {
      status = nodes_.ReadNumber();
      if (status.ok()) {
        status = nodes_.ReadPoint();
      }
    }
    return status;
  }

  // Reads the head of a block: the dimension and number of an entity, the section's third number, and the rows.
  absl::Status ReadBlock(const char* third_name, uint64_t& dimension, uint64_t& entity, uint64_t& third,
                         uint64_t& rows) {
    absl::Status status = file_.Int("the dimension of an entity", 3, dimension);
    if (status.ok()) {
      status = file_.Int("the number of an entity", kMaxCount, entity);
    }
    if (status.ok()) {
      status = file_.Int(third_name, 1000, third);
    }
    return status.ok() ? file_.Size("the rows of a block", kMaxCount, rows) : status;
  }

  // The counts at the start of a section, and the smallest and the largest number.
  absl::Status ReadCounts(uint64_t& blocks, uint64_t& rows) {
    uint64_t ignored = 0;
    absl::Status status = file_.Size("the number of blocks", kMaxCount, blocks);
    if (status.ok()) {
      status = file_.Size("the number of rows", kMaxCount, rows);
    }
    for (const char* what : {"the smallest number", "the largest number"}) {
      if (status.ok()) {
        status = file_.Size(what, kAnyNumber, ignored);
      }
    }
    return status;
  }

  absl::Status ReadNodes41() {
    uint64_t blocks = 0;
    uint64_t count = 0;
    WELLSPACE_RETURN_IF_ERROR(ReadCounts(blocks, count));
    for (uint64_t block = 0; block < blocks; ++block) {
      uint64_t dimension = 0;
      uint64_t entity = 0;
      uint64_t parametric = 0;
      uint64_t rows = 0;
      absl::Status status = ReadBlock("0 or 1, for parameters", dimension, entity, parametric, rows);
      for (uint64_t row = 0; status.ok() && row < rows; ++row) {
        status = nodes_.ReadNumber();
      }
      double parameter = 0;
      for (uint64_t row = 0; status.ok() && row < rows; ++row) {
        status = nodes_.ReadPoint();
        for (uint64_t i = 0; status.ok() && parametric != 0 && i < dimension; ++i) {
          status = file_.Number("a parameter of a node", parameter);
        }
      }
      if (!status.ok()) {
        return status;
      }
    }
    return nodes_.count() == count ? absl::OkStatus()
                                   : file_.ValueError(absl::StrCat(
                                         "expected ", count, " nodes, as the section says, got ", nodes_.count()));
  }

  absl::Status ReadElements() {
    if (!has_nodes_ || std::exchange(has_elements_, true)) {
      return reader_.Error("expected \"$Nodes\" and then one section \"$Elements\"");
    }
    return is_2_2_ ? ReadElements22() : ReadElements41();
  }

  absl::Status ReadElements22() {
    uint64_t count = 0;
    absl::Status status = file_.Count("the number of elements", kMaxCount, count);
    for (uint64_t element = 0; status.ok() && element < count;) {
      uint64_t rows = 1;
      status = file_.is_binary() ? ReadBlock22(count - element, rows) : ReadElement22();
      element += rows;
    }
    return status;
  }

  // Number, type, how many tags, the tags, the nodes.
  absl::Status ReadElement22() {
    uint64_t type = 0;
    uint64_t tags = 0;
    WELLSPACE_RETURN_IF_ERROR(file_.SkipField("the number of an element"));
    WELLSPACE_RETURN_IF_ERROR(file_.Int("the type of an element", 1000, type));
    WELLSPACE_RETURN_IF_ERROR(file_.Int("the number of tags", kMaxCount, tags));
    return ReadTagsAndNodes22(type, tags);
  }

  // Type, how many elements, how many tags each has; then of each its number, the tags, the nodes.
  absl::Status ReadBlock22(uint64_t most, uint64_t& rows) {
    uint64_t type = 0;
    uint64_t tags = 0;
    WELLSPACE_RETURN_IF_ERROR(file_.Int("the type of elements", 1000, type));
    WELLSPACE_RETURN_IF_ERROR(file_.Int("the number of elements of a block", most, rows));
    WELLSPACE_RETURN_IF_ERROR(file_.Int("the number of tags", kMaxCount, tags));
    if (rows == 0) {
      return file_.ValueError("expected at least one element in a block, got 0");
    }
    for (uint64_t row = 0; row < rows; ++row) {
      int32_t number = 0;
      WELLSPACE_RETURN_IF_ERROR(file_.SignedInt("the number of an element", number));
      WELLSPACE_RETURN_IF_ERROR(ReadTagsAndNodes22(type, tags));
    }
    return absl::OkStatus();
  }

  // The first tag is the physical group.
  absl::Status ReadTagsAndNodes22(uint64_t type, uint64_t tags) {
    int32_t group = 0;
    for (uint64_t tag = 0; tag < tags; ++tag) {
      int32_t other = 0;
      WELLSPACE_RETURN_IF_ERROR(tag == 0            ? file_.SignedInt("a tag", group)
                                : file_.is_binary() ? file_.SignedInt("a tag", other)
                                                    : file_.SkipField("a tag"));
    }
    return AddElement(type, group);
  }

  absl::Status ReadElements41() {
    uint64_t blocks = 0;
    uint64_t count = 0;
    uint64_t elements = 0;
    WELLSPACE_RETURN_IF_ERROR(ReadCounts(blocks, count));
    for (uint64_t block = 0; block < blocks; ++block) {
      uint64_t dimension = 0;
      uint64_t entity = 0;
      uint64_t type = 0;
      uint64_t rows = 0;
      uint64_t number = 0;
      absl::Status status = ReadBlock("the type of elements", dimension, entity, type, rows);
      const auto& groups = groups_[std::min<uint64_t>(dimension, 3)];
      const auto found = groups.find(entity);
      const int32_t group = found == groups.end() ? 0 : found->second;
      for (uint64_t row = 0; status.ok() && row < rows; ++row) {
        status = file_.Size("the number of an element", kAnyNumber, number);
        if (status.ok()) {
          status = AddElement(type, group);
        }
      }
      if (!status.ok()) {
        return status;
      }
      elements += rows;
    }
    return elements == count
               ? absl::OkStatus()
               : file_.ValueError(absl::StrCat("expected ", count, " elements, as the section says, got ", elements));
  }

  absl::Status AddElement(uint64_t type, int32_t group) {
    const int nodes = NodesOf(type);
    if (nodes == 0) {
      return file_.ValueError(absl::StrCat(
          "expected elements of type 15 (point), 1 (line), 2 (triangle) or 4 (tetrahedron), got type ", type));
    }
    if (nodes >= 2) {
      element_groups_[nodes - 1].push_back(group);
    }
    for (int i = 0; i < nodes; ++i) {
      uint64_t number = 0;
      uint32_t index = 0;
      absl::Status status = file_.Size("the number of a node", kAnyNumber, number);
      if (status.ok()) {
        status = nodes_.Find(number, index);
      }
      if (!status.ok()) {
        return status;
      }
      if (nodes >= 2) {
        (nodes == 2 ? lines_ : nodes == 3 ? triangles_ : tetrahedra_).push_back(index);
      }
    }
    return absl::OkStatus();
  }

  // Texts (the name first), numbers, whole numbers (step, numbers in a value, values), each after its count and in
  // ascii; then the values.
  absl::Status ReadNodeData() {
    constexpr uint64_t kMaxTags = 1000;
    std::string name;
    std::array<uint64_t, 3> whole{};
    for (int kind = 0; kind < 3; ++kind) {
      std::string_view line;
      uint64_t tags = 0;
      if (!file_.NextLine(line) || !ParseUnsigned(line, kMaxTags, tags)) {
        return reader_.EndError(absl::StrCat("expected the number of tags of data, at most ", kMaxTags));
      }
      for (uint64_t tag = 0; tag < tags; ++tag) {
        if (!reader_.Next(line)) {
          return reader_.EndError("the file ends; expected a tag of data");
        }
        line = TrimBlanks(line);
        if (kind == 0 && tag == 0) {
          name = line;
        } else if (kind == 2 && tag < whole.size() && !ParseUnsigned(line, kMaxCount, whole[tag])) {
          return reader_.Error(absl::StrCat("expected a whole number below 2^32, got ", Quote(line)));
        }
      }
    }
    const auto [step, width, rows] = whole;
    const bool are_weights = name == absl::StrCat("\"", kMshWeights, "\"");
    const bool are_taken =
        has_nodes_ && width == 1 && (are_weights || (!numbers_name_.empty() && name == numbers_name_));
    std::vector<double>& taken = are_weights ? weights_ : of_nodes_;
    const char* what = are_weights ? "weight" : "number";
    if (are_taken && (rows != nodes_.count() || !taken.empty())) {
      return file_.ValueError(absl::StrCat("expected ", nodes_.count(), " ", what, "s, once, got ", rows));
    }
    std::vector<bool> seen(are_taken ? rows : 0);
    taken.resize(are_taken ? rows : taken.size());
    for (uint64_t row = 0; row < rows; ++row) {
      uint64_t number = 0;
      absl::Status status = file_.Int("the number of a node", kMaxCount, number);
      for (uint64_t i = 0; status.ok() && !are_taken && i < width; ++i) {
        status = file_.SkipNumber();
      }
      if (status.ok() && are_taken) {
        uint32_t index = 0;
        status = nodes_.Find(number, index);
        if (status.ok() && seen[index]) {
          status = file_.ValueError(absl::StrCat("expected one ", what, " of every node, got two of node ", number));
        }
        if (status.ok()) {
          seen[index] = true;
          status = file_.Number(are_weights ? "a weight" : "a number", taken[index]);
        }
      }
      if (!status.ok()) {
        return status;
      }
    }
    return absl::OkStatus();
  }

  absl::StatusOr<Mesh> MakeMesh() {
    Mesh mesh;
    mesh.dimension = tetrahedra_.empty() && !triangles_.empty() ? 2 : 3;
    SortFacets(mesh);
    CollectRegions(mesh);
    mesh.simplices = std::move(mesh.dimension == 2 ? triangles_ : tetrahedra_);
    mesh.weights = std::move(weights_);
    mesh.numbers = std::move(of_nodes_);
    if (mesh.dimension == 3) {
      mesh.points = nodes_.TakePoints();
      return mesh;
    }
    const std::vector<double> points = nodes_.TakePoints();
    mesh.points.reserve(points.size() / 3 * 2);
    for (size_t i = 0; i < points.size(); i += 3) {
      if (points[i + 2] != 0) {
        return absl::InvalidArgumentError(absl::StrCat(reader_.name(), ": node ", nodes_.NumberOf(i / 3),
                                                       ": expected z = 0 in a mesh of triangles, got ", points[i + 2]));
      }
      mesh.points.insert(mesh.points.end(), {points[i], points[i + 1]});
    }
    return mesh;
  }

  // Lines beside triangles, or triangles beside tetrahedra, that are of a group.
  void SortFacets(Mesh& mesh) {
    FacetSorter sorter;
    const std::vector<uint32_t>& facets = mesh.dimension == 2 ? lines_ : triangles_;
    const std::vector<int32_t>& groups = element_groups_[mesh.dimension - 1];
    uint64_t ungrouped = 0;
    for (size_t i = 0; i < groups.size(); ++i) {
      sorter.Add(std::span(facets).subspan(i * mesh.dimension, mesh.dimension), groups[i]);
      ungrouped += groups[i] == 0 ? 1 : 0;
    }
    if (ungrouped > 0) {
      mesh.notes.push_back(absl::StrCat(reader_.name(), ": ", ungrouped, mesh.dimension == 2 ? " lines" : " triangles",
                                        " of no physical group are left out: they are no tagged boundary"));
    }
    for (const auto& [group, name] : names_[mesh.dimension - 1]) {
      sorter.Name(group, name);
    }
    sorter.MoveTo(mesh);
  }

  void CollectRegions(Mesh& mesh) const {
    RegionCollector collector;
    for (const int32_t group : element_groups_[mesh.dimension]) {
      collector.Add(group);
    }
    for (const auto& [group, name] : names_[mesh.dimension]) {
      collector.Name(group, name);
    }
    collector.MoveTo(mesh);
  }

  LineReader& reader_;
  MshNumbers file_;
  MshNodes nodes_;
  bool is_2_2_ = false;
  bool has_nodes_ = false;
  bool has_elements_ = false;
  // The first physical group of an entity and the name of a group, each by dimension and number.
  std::array<std::map<uint64_t, int32_t>, 4> groups_;
  std::array<std::map<int32_t, std::string>, 4> names_;
  std::vector<uint32_t> lines_;                         // indices of nodes
  std::array<std::vector<int32_t>, 4> element_groups_;  // of lines, triangles and tetrahedra, by dimension
  std::vector<uint32_t> triangles_;
  std::vector<uint32_t> tetrahedra_;
  std::vector<double> weights_;
  const std::string numbers_name_;  // of data of nodes that are asked for, in quotes; or empty
  std::vector<double> of_nodes_;    // that data
};

}  // namespace

absl::StatusOr<Mesh> ReadMsh(const std::string& path, const MeshNumbers& numbers) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  LineReader reader(std::move(file));
  return MshReader(reader, numbers.of_vertices).Read();
}

absl::Status ReadMshPoints(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  return MshReader(reader, /*numbers=*/"").ReadPoints(options, cloud);
}

}  // namespace wellspace::formats
