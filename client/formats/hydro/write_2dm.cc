// SMS's .2dm: https://www.xmswiki.com, "SMS:2D Mesh Files *.2dm".
#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/hydro/adcirc.h"
#include "client/formats/hydro/hydro_writer.h"
#include "client/formats/io/number.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/names.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class Writer2dm final : public HydroWriter {
 public:
  Writer2dm(OutputFile output, const MeshShape& shape)
      : HydroWriter(std::move(output), shape, {kElevation, kDepth, "0"}, Strings::kAny) {}

 private:
  std::string Start() override { return "MESH2D\n"; }

  void AppendNode(uint64_t number, std::span<const double> point, const std::string& height,
                  std::string& line) override {
    absl::StrAppend(&line, "ND ", number, " ");
    AppendNumber(point[0], line);
    line += ' ';
    AppendNumber(point[1], line);
    absl::StrAppend(&line, " ", height, "\n");
  }

  void AppendTriangle(uint64_t number, std::span<const uint32_t> nodes, int32_t region, std::string& line) override {
    absl::StrAppend(&line, "E3T ", number, " ", uint64_t{nodes[0]} + 1, " ", uint64_t{nodes[1]} + 1, " ",
                    uint64_t{nodes[2]} + 1, " ", region, "\n");
  }

  // The last node of a string is negative, and the number of the string follows; a card has ten nodes at most.
  void End(const std::vector<NodeString>& strings) override {
    constexpr size_t kNodesOfCard = 10;
    std::string text;
    for (const NodeString& string : strings) {
      for (size_t i = 0; i < string.nodes.size(); ++i) {
        const bool is_last = i + 1 == string.nodes.size();
        absl::StrAppend(&text, i % kNodesOfCard == 0 ? "NS" : "", is_last ? " -" : " ", uint64_t{string.nodes[i]} + 1,
                        is_last ? absl::StrCat(" ", string.part->tag) : "",
                        is_last || (i + 1) % kNodesOfCard == 0 ? "\n" : "");
      }
    }
    const NameLines names(shape());
    AddNote(names.ChangesNote());
    output().Write(absl::StrCat(text, names.Text("# ")));
  }
};

}  // namespace

absl::StatusOr<std::unique_ptr<MeshWriter>> Create2dm(const std::string& path, const MeshShape& shape,
                                                      std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(OutputFile output, OutputFile::Create(path, std::move(stop)));
  return std::make_unique<Writer2dm>(std::move(output), shape);
}

}  // namespace wellspace::formats
