// ADCIRC's grid, fort.14: https://adcirc.org, "ADCIRC Grid and Boundary Information File".
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/formats/hydro/adcirc.h"
#include "client/formats/hydro/hydro_writer.h"
#include "client/formats/io/number.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/names.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// Whether the part of this name is an open boundary, where the sea goes on.
bool IsOpen(const std::string& name) {
  const std::string lower = absl::AsciiStrToLower(name);
  return absl::StartsWith(lower, "open") || absl::StartsWith(lower, "ocean");
}

class AdcircWriter final : public HydroWriter {
 public:
  AdcircWriter(OutputFile output, const MeshShape& shape)
      : HydroWriter(std::move(output), shape, {kDepth, kElevation, "-99999"}, Strings::kOutside),
        names_(shape, NameLines::Of::kParts) {}

 private:
  std::string Start() override {
    return absl::StrCat("wellspace\n", shape().simplex_count, " ", shape().vertex_count, "\n");
  }

  void AppendNode(uint64_t number, std::span<const double> point, const std::string& height,
                  std::string& line) override {
    absl::StrAppend(&line, number, " ");
    AppendNumber(point[0], line);
    line += ' ';
    AppendNumber(point[1], line);
    absl::StrAppend(&line, " ", height, "\n");
  }

  void AppendTriangle(uint64_t number, std::span<const uint32_t> nodes, int32_t /*region*/,
                      std::string& line) override {
    absl::StrAppend(&line, number, " 3 ", uint64_t{nodes[0]} + 1, " ", uint64_t{nodes[1]} + 1, " ",
                    uint64_t{nodes[2]} + 1, "\n");
  }

  // "part 7: deep sea", or "part 7" of a part without a name.
  std::string CommentOf(int32_t tag) const {
    const std::string start = absl::StrCat("part ", tag);
    for (const std::string& line : names_.lines()) {
      if (absl::StartsWith(line, start + ":")) {
        return line;
      }
    }
    return start;
  }

  // Around the mesh a ring is counterclockwise, around a hole in it clockwise.
  bool IsIsland(const std::vector<uint32_t>& nodes) const {
    double area = 0;
    const std::span<const double> origin = PointOf(nodes[0]);
    for (size_t i = 1; i < nodes.size(); ++i) {
      const std::span<const double> p = PointOf(nodes[i - 1]);
      const std::span<const double> q = PointOf(nodes[i]);
      area += (p[0] - origin[0]) * (q[1] - origin[1]) - (p[1] - origin[1]) * (q[0] - origin[0]);
    }
    return nodes.front() == nodes.back() && area < 0;
  }

  void End(const std::vector<NodeString>& strings) override {
    for (const bool is_open : {true, false}) {
      uint64_t count = 0;
      uint64_t nodes = 0;
      std::string text;
      for (const NodeString& string : strings) {
        if (IsOpen(string.part->name) != is_open) {
          continue;
        }
        const bool is_island = IsIsland(string.nodes);
        const int32_t type = is_open ? 0 : AdcircTypeOf(string.part->name, is_island ? kAdcircIsland : kAdcircMainland);
        ++count;
        nodes += string.nodes.size();
        absl::StrAppend(&text, string.nodes.size(), " ", type, " = ", CommentOf(string.part->tag), "\n");
        for (const uint32_t node : string.nodes) {
          absl::StrAppend(&text, uint64_t{node} + 1, "\n");
        }
      }
      const char* kind = is_open ? "open" : "land";
      output().Write(absl::StrCat(count, " = Number of ", kind, " boundaries\n", nodes, " = Total number of ", kind,
                                  " boundary nodes\n", text));
    }
    AddNote(names_.ChangesNote());
    for (const BoundaryPart& part : shape().boundary) {
      if (part.facets == 0 && !part.name.empty()) {
        AddNote(absl::StrCat("the format has no place for parts of the boundary without facets: ", Quote(part.name),
                             " is left out"));
      }
    }
  }

  const NameLines names_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateAdcirc(const std::string& path, const MeshShape& shape,
                                                         std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(path, std::move(stop)));
  return std::make_unique<AdcircWriter>(std::move(output), shape);
}

}  // namespace wellspace::formats
