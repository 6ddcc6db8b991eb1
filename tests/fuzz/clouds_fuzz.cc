// Every reader of clouds, on any text.
//
// Input: a character that chooses among kChoices, '0' the first, '1' the second and so on; the file.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/formats/io/number.h"
#include "client/formats/numpy/npy_rows.h"
#include "client/formats/read_cloud.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/scratch_folder.h"

namespace wellspace::fuzz {
namespace {

using formats::CloudOptions;
using formats::PointCloud;

// A format, the dimension that is asked for, the columns, and whether invalid points are to be skipped.
struct Choice {
  const char* format;
  int dimension;
  std::string_view columns = "";  // a character each
  bool skip_invalid = false;
  bool keep_attributes = false;
};
constexpr std::array kChoices = {
    Choice{"csv", 0},
    Choice{"xyz", 0},
    Choice{"node", 0},
    Choice{"csv", 2},
    Choice{"xyz", 2},
    Choice{"node", 2},
    Choice{"csv", 3},
    Choice{"xyz", 3},
    Choice{"node", 3},
    Choice{"npy", 0},
    Choice{"npy", 2},
    Choice{"npy", 5},
    Choice{"csv", 4},
    Choice{"xyz", 4},
    Choice{"node", 4},
    Choice{"xyz", 6},
    Choice{"ply", 0},
    Choice{"obj", 0},
    Choice{"off", 0},
    Choice{"ply", 3},
    Choice{"obj", 2},
    Choice{"off", 4},
    // From 'F' on.
    Choice{"asc", 0},
    Choice{"pts", 0},
    Choice{"pts", 3},
    Choice{"csv", 0, "", true},
    Choice{"xyz", 3, "", true},
    Choice{"node", 0, "", true},
    Choice{"npy", 0, "", true},
    Choice{"ply", 0, "", true},
    Choice{"obj", 0, "", true},
    Choice{"off", 0, "", true},
    Choice{"csv", 0, "xy"},
    Choice{"csv", 2, "31"},
    Choice{"xyz", 0, "432"},
    Choice{"pts", 0, "21", true},
    Choice{"node", 2, "xz"},
    Choice{"npy", 0, "21"},
    Choice{"ply", 0, "yx", true},
    Choice{"obj", 2, "13"},
    Choice{"off", 0, "zyx"},
    // From 'Y' on.
    Choice{"stl", 0},
    Choice{"pcd", 0},
    Choice{"las", 0},
    Choice{"vtk", 0},
    Choice{"vtp", 0},
    Choice{"vtu", 0},
    // From '_' on.
    Choice{"stl", 0, "zx", true},
    Choice{"pcd", 0, "", true, true},
    Choice{"las", 2, "xy", true, true},
    Choice{"vtk", 0, "", true, true},
    Choice{"vtp", 0, "", true, true},
    Choice{"vtu", 3, "", false, true},
    Choice{"csv", 0, "", true, true},
    Choice{"ply", 0, "", true, true},
    // From 'g' on.
    Choice{"msh", 0},
    Choice{"medit", 0},
    Choice{"npz", 0},
    Choice{"msh", 2, "", true},
    Choice{"medit", 0, "yx", true},
    Choice{"npz", 0, "21", true},
    Choice{"adcirc", 0, "", true, true},
    Choice{"2dm", 0, "", true, true},
    Choice{"vti", 0, "", true, true},
    Choice{"vtr", 0, "", true, true},
    Choice{"pvtu", 0, "", true, true},
};

void RequireCloud(const PointCloud& cloud, const CloudOptions& options) {
  Require(cloud.dimension >= formats::kMinDimension && cloud.dimension <= formats::kMaxDimension,
          "the dimension is one of those that there are");
  Require(options.dimension == 0 || cloud.dimension == options.dimension, "the dimension is the one asked for");
  Require(cloud.points.size() == cloud.size() * cloud.dimension, "every point has all its coordinates");
  for (const double x : cloud.points) {
    Require(std::isfinite(x), "coordinates are finite");
  }
  Require(
      options.columns.empty() || cloud.size() == 0 || options.columns.size() == static_cast<size_t>(cloud.dimension),
      "the columns are those asked for");
  Require(cloud.skipped == 0 || options.skip_invalid, "points are skipped only if that was asked for");
  for (const std::string& note : cloud.notes) {
    RequireClearMessage(note);
  }
  for (const formats::Attribute& attribute : cloud.attributes) {
    Require(options.keep_attributes, "attributes are kept only if that was asked for");
    Require(attribute.values.size() == cloud.size(), "every point has all attributes");
  }
  constexpr std::array<std::string_view, 17> kMayBeBinary = {"npy",    "ply", "stl", "pcd", "las",   "vtk",
                                                             "vtp",    "vts", "vtu", "msh", "medit", "npz",
                                                             "adcirc", "2dm", "vti", "vtr", "pvtu"};
  if (cloud.lines.size() == 0 &&
      std::find(kMayBeBinary.begin(), kMayBeBinary.end(), options.format) != kMayBeBinary.end()) {
    Require(cloud.rows.size() == cloud.size() || (cloud.rows.size() == 0 && cloud.skipped == 0),
            "every point has a row if some are skipped");
    return;
  }
  Require(options.format != "npy", "an array has no lines");
  Require(cloud.lines.size() == cloud.size(), "every point has a line");
  uint64_t line = 0;
  for (uint64_t point = 0; point < cloud.size(); ++point) {
    Require(cloud.lines.LineOf(point) > line, "every point has a line of its own, in order");
    line = cloud.lines.LineOf(point);
    Require(cloud.Origin(point) == cloud.name + ":" + std::to_string(line), "the origin of a point is its line");
  }
}

// NpyRows, on the file that ReadCloud read as `cloud`: the same points, or a clear refusal.
void RequireRows(const std::string& path, const absl::StatusOr<PointCloud>& cloud) {
  absl::StatusOr<formats::NpyRows> rows = formats::NpyRows::Open(path);
  if (!rows.ok()) {
    Require(rows.status().code() == absl::StatusCode::kInvalidArgument,
            "a bad file is an INVALID_ARGUMENT:", rows.status().ToString());
    RequireClearMessage({rows.status().message().data(), rows.status().message().size()});
    return;
  }
  std::vector<double> points;
  std::vector<double> piece(3 * rows->columns());
  for (uint64_t row = 0; row <= rows->rows(); row += 3) {
    const absl::StatusOr<uint64_t> read = rows->Read(row, piece);
    Require(read.ok() && *read == std::min<uint64_t>(3, rows->rows() - row),
            "rows can be read:", read.status().ToString());
    points.insert(points.end(), piece.begin(), piece.begin() + *read * rows->columns());
  }
  Require(points.size() == rows->rows() * rows->columns(), "every row comes once");
  if (cloud.ok()) {
    Require(cloud->points == points && cloud->dimension == rows->columns(), "rows are the points of the cloud");
  }
}

std::string ToCsv(const PointCloud& cloud) {
  std::string text;
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    formats::AppendNumber(cloud.points[i], text);
    text += (i + 1) % cloud.dimension == 0 ? '\n' : ',';
  }
  return text;
}

}  // namespace
}  // namespace wellspace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace wellspace;
  fuzz::ByteReader bytes(data, size);
  const fuzz::Choice& choice = fuzz::kChoices[static_cast<uint8_t>(bytes.Next() - '0') % fuzz::kChoices.size()];
  formats::CloudOptions options = {.format = choice.format, .dimension = choice.dimension};
  options.skip_invalid = choice.skip_invalid;
  options.keep_attributes = choice.keep_attributes;
  for (const char column : choice.columns) {
    options.columns.emplace_back(1, column);
  }
  const fuzz::ScratchFolder& folder = fuzz::ScratchFolder::Get();
  const std::string path = folder.Write("cloud", bytes.TakeText());
  const auto cloud = formats::ReadCloud(path, options);
  if (options.format == "npy" && options.columns.empty() && (!cloud.ok() || cloud->skipped == 0)) {
    fuzz::RequireRows(path, cloud);
  }
  if (!cloud.ok()) {
    const bool is_of_piece = options.format == "pvtu" && !absl::IsInternal(cloud.status());  // it cannot be opened
    fuzz::Require(cloud.status().code() == absl::StatusCode::kInvalidArgument || is_of_piece,
                  "a bad file is an INVALID_ARGUMENT:", cloud.status().ToString());
    fuzz::RequireClearMessage({cloud.status().message().data(), cloud.status().message().size()});
    return 0;
  }
  fuzz::RequireCloud(*cloud, options);
  const auto again = formats::ReadCloud(folder.Write("again.csv", fuzz::ToCsv(*cloud)),
                                        {.format = "csv", .dimension = cloud->dimension});
  fuzz::Require(again.ok(), "a cloud can be written and read again:", again.status().ToString());
  const auto are_same_bits = [](double a, double b) {
    return std::bit_cast<uint64_t>(a) == std::bit_cast<uint64_t>(b);
  };
  fuzz::Require(
      std::equal(again->points.begin(), again->points.end(), cloud->points.begin(), cloud->points.end(), are_same_bits),
      "a cloud reads back to the bit");
  return 0;
}
