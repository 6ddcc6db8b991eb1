#include "client/viewer/page.h"

#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/formats/vtk/vtk_array.h"

// The page as it was built, in this program: wellspace_embed.
extern "C" const char wellspace_viewer_page_begin[];
extern "C" const char wellspace_viewer_page_end[];

namespace wellspace::viewer {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are written as they are in memory");

constexpr double kFarthest = 1e150;
constexpr size_t kPieceBytes = size_t{3} << 18;  // of base64's groups of three

struct Field {
  std::string name;
  std::span<const double> values;
};

// Numbers of the vertices that the page can colour by; of simplices it has simplex_attributes.
std::vector<Field> FieldsOf(const formats::MeshView& mesh) {
  std::vector<Field> fields;
  bool has_weights = !mesh.weights.empty();
  for (const formats::Attribute& attribute : mesh.attributes) {
    fields.push_back({attribute.name, attribute.values});
    has_weights &= attribute.name != "weights";
  }
  if (has_weights) {
    fields.push_back({"weights", mesh.weights});
  }
  return fields;
}

bool HasSimplexRegions(const formats::MeshView& mesh) {
  return mesh.regions.size() > 1 && !mesh.simplex_regions.empty();
}

std::string HeaderOf(const formats::MeshView& mesh, const std::vector<Field>& fields, const PageOptions& options) {
  nlohmann::json header = {{"format", 1},
                           {"name", options.name},
                           {"dimension", mesh.dimension},
                           {"up", options.up},
                           {"vertices", mesh.vertex_count()},
                           {"simplices", mesh.simplex_count()},
                           {"has_simplex_regions", HasSimplexRegions(mesh)},
                           {"boundary", nlohmann::json::array()},
                           {"regions", nlohmann::json::array()},
                           {"fields", nlohmann::json::array()},
                           {"simplex_fields", nlohmann::json::array()}};
  for (const formats::BoundaryPart& part : mesh.boundary) {
    header["boundary"].push_back({{"tag", part.tag}, {"name", part.name}, {"facets", part.facets}});
  }
  for (const formats::Region& region : mesh.regions) {
    header["regions"].push_back({{"id", region.id}, {"name", region.name}});
  }
  for (const Field& field : fields) {
    header["fields"].push_back(field.name);
  }
  for (const formats::Attribute& attribute : mesh.simplex_attributes) {
    header["simplex_fields"].push_back(attribute.name);
  }
  // ASCII, and nothing that could end the element.
  const std::string text =
      header.dump(/*indent=*/-1, ' ', /*ensure_ascii=*/true, nlohmann::json::error_handler_t::replace);
  return absl::StrReplaceAll(text, {{"<", "\\u003c"}});
}

template <typename T>
void WriteArray(const std::string& id, std::span<const T> values, formats::OutputFile& file) {
  file.Write(absl::StrCat("<script type=\"application/octet-stream\" id=\"mesh-", id, "\">"));
  const std::string_view bytes(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  std::string text;
  for (size_t from = 0; from < bytes.size() && file.status().ok(); from += kPieceBytes) {
    text.clear();
    formats::AppendBase64(bytes.substr(from, kPieceBytes), text);
    file.Write(text);
  }
  file.Write("</script>\n");
}

std::vector<uint32_t> RegionIndices(const formats::MeshView& mesh) {
  std::unordered_map<int32_t, uint32_t> indices;
  for (const formats::Region& region : mesh.regions) {
    indices.emplace(region.id, indices.size());
  }
  std::vector<uint32_t> result;
  result.reserve(mesh.simplex_regions.size());
  for (const int32_t region : mesh.simplex_regions) {
    result.push_back(indices.at(region));
  }
  return result;
}

}  // namespace

std::string_view EmptyPage() {
  return {wellspace_viewer_page_begin, static_cast<size_t>(wellspace_viewer_page_end - wellspace_viewer_page_begin)};
}

absl::Status CheckMesh(const formats::MeshView& mesh) {
  if (mesh.dimension != 2 && mesh.dimension != 3) {
    return absl::InvalidArgumentError(
        absl::StrCat("only 2-D and 3-D meshes can be shown, and this one is ", mesh.dimension, "-D"));
  }
  if (mesh.simplex_count() == 0) {
    return absl::InvalidArgumentError("the mesh has no simplices; expected at least one to show");
  }
  for (const auto& [what, bytes] : {std::pair("vertices", mesh.points.size_bytes()),
                                    std::pair(formats::SimplexName(mesh.dimension), mesh.simplices.size_bytes()),
                                    std::pair("facets", mesh.facets.size_bytes())}) {
    if (bytes > kMaxArrayBytes) {
      return absl::ResourceExhaustedError(absl::StrCat("the ", what, " take ", bytes, " bytes; expected at most ",
                                                       kMaxArrayBytes, ", which is what a browser can read"));
    }
  }
  for (size_t i = 0; i < mesh.points.size(); ++i) {
    if (!(std::abs(mesh.points[i]) <= kFarthest)) {
      return absl::InvalidArgumentError(absl::StrCat("expected coordinates of magnitude at most ", kFarthest, ", got ",
                                                     mesh.points[i], " of vertex ", i / mesh.dimension));
    }
  }
  return absl::OkStatus();
}

void WritePage(const formats::MeshView& mesh, const PageOptions& options, formats::OutputFile& file) {
  const std::string_view page = EmptyPage();
  const size_t mark = page.find(kMeshMark);
  const std::vector<Field> fields = FieldsOf(mesh);
  file.Write(page.substr(0, mark));
  file.Write(
      absl::StrCat("<script type=\"application/json\" id=\"mesh\">", HeaderOf(mesh, fields, options), "</script>\n"));
  WriteArray("points", mesh.points, file);
  WriteArray("simplices", mesh.simplices, file);
  WriteArray("facets", mesh.facets, file);
  if (HasSimplexRegions(mesh)) {
    WriteArray<uint32_t>("regions", RegionIndices(mesh), file);
  }
  for (size_t i = 0; i < fields.size(); ++i) {
    WriteArray(absl::StrCat("field", i), fields[i].values, file);
  }
  for (size_t i = 0; i < mesh.simplex_attributes.size(); ++i) {
    WriteArray<double>(absl::StrCat("simplex-field", i), mesh.simplex_attributes[i].values, file);
  }
  file.Write(page.substr(mark + kMeshMark.size()));
}

}  // namespace wellspace::viewer
