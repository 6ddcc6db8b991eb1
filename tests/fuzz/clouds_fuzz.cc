// Every reader of clouds, on any text.
//
// Input: a digit from 0 to 8, that is the format (csv, xyz, node) + 3 * the dimension that is asked for (any, 2, 3); the file.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "client/formats/number.h"
#include "client/formats/read_cloud.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/scratch_folder.h"

namespace wellspace::fuzz {
namespace {

using formats::CloudOptions;
using formats::PointCloud;

constexpr std::array kFormats = {"csv", "xyz", "node"};
constexpr std::array kDimensions = {0, 2, 3};

void RequireCloud(const PointCloud& cloud, const CloudOptions& options) {
  Require(cloud.dimension == 2 || cloud.dimension == 3, "the dimension is 2 or 3");
  Require(options.dimension == 0 || cloud.dimension == options.dimension, "the dimension is the one asked for");
  Require(cloud.points.size() == cloud.size() * cloud.dimension, "every point has all its coordinates");
  for (const double x : cloud.points) {
    Require(std::isfinite(x), "coordinates are finite");
  }
  uint64_t line = 0;
  for (uint64_t point = 0; point < cloud.size(); ++point) {
    Require(cloud.lines.LineOf(point) > line, "every point has a line of its own, in order");
    line = cloud.lines.LineOf(point);
    Require(cloud.Origin(point) == cloud.name + ":" + std::to_string(line), "the origin of a point is its line");
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
  const size_t choice = static_cast<uint8_t>(bytes.Next() - '0') % 9;
  const formats::CloudOptions options = {.format = fuzz::kFormats[choice % 3],
                                         .dimension = fuzz::kDimensions[choice / 3]};
  const fuzz::ScratchFolder& folder = fuzz::ScratchFolder::Get();
  const auto cloud = formats::ReadCloud(folder.Write("cloud", bytes.TakeText()), options);
  if (!cloud.ok()) {
    fuzz::Require(cloud.status().code() == absl::StatusCode::kInvalidArgument,
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
