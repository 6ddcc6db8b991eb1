#include "client/files/feature_arrays.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "client/formats/io/input_file.h"
#include "client/formats/io/zip_file.h"
#include "client/formats/numpy/npy.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kNoBound = std::numeric_limits<double>::infinity();

class FeatureArraysTest : public testing::Test {
 protected:
  // An array of the file that was written last.
  template <typename T>
  std::vector<T> Read(const std::string& member, size_t dimensions,
                      absl::Status (formats::NpyReader::*read)(std::vector<T>& values)) {
    absl::StatusOr<formats::InputFile> file = formats::InputFile::Open(folder_.Path("a.npz"));
    EXPECT_TRUE(file.ok()) << file.status();
    const auto archive = formats::ZipReader::Open(*std::move(file));
    EXPECT_TRUE(archive.ok()) << archive.status();
    const absl::StatusOr<uint64_t> size = (*archive)->Begin(member);
    EXPECT_TRUE(size.ok()) << size.status();
    auto array = formats::NpyReader::Open(
        member, [&](char* buffer, size_t bytes) { return (*archive)->Read(buffer, bytes); }, *size, dimensions);
    EXPECT_TRUE(array.ok()) << array.status();
    std::vector<T> values;
    EXPECT_TRUE(((*array).*read)(values).ok());
    return values;
  }
  std::vector<double> Numbers(const std::string& member, size_t dimensions = 1) {
    return Read<double>(member, dimensions, &formats::NpyReader::ReadNumbers);
  }
  std::vector<std::string> Texts(const std::string& member) {
    return Read<std::string>(member, 1, &formats::NpyReader::ReadTexts);
  }
  bool Has(const std::string& member) { return folder_.Read("a.npz").find(member) != std::string::npos; }

  TemporaryFolder folder_;
};

TEST_F(FeatureArraysTest, OfADomain) {
  formats::PointCloud points;
  points.dimension = 2;
  points.points = {0, 0, 1, 0, 0, 1};
  Features features;
  features.ends = {0, 1, 1, 2, 2, 0};
  features.markers = {5, 0, 6};
  features.groups = {1, 1, 0};
  features.faces = FaceRule::kUnion;
  features.seeds = {{.x = 0.5, .y = 0.25, .is_hole = true},
                    {.x = 0.25, .y = 0.5, .region = -7, .max_area = 0.125},
                    {.x = 0.1, .y = 0.1, .region = 3, .first_segment = 1, .segment_count = 2}};
  features.names = {.markers = {{5, "inlet"}, {6, "Küste"}}, .regions = {{3, "sea"}}};
  ASSERT_TRUE(WriteFeatureArrays(folder_.Path("a.npz"), points, features, {}).ok());
  EXPECT_EQ(Numbers("points.npy", 2), points.points);
  EXPECT_THAT(Numbers("segments.npy", 2), ElementsAre(0, 1, 1, 2, 2, 0));
  EXPECT_THAT(Numbers("markers.npy"), ElementsAre(5, 0, 6));
  EXPECT_THAT(Numbers("groups.npy"), ElementsAre(1, 1, 0));
  EXPECT_THAT(Texts("faces.npy"), ElementsAre("union"));
  EXPECT_THAT(Numbers("holes.npy", 2), ElementsAre(0.5, 0.25));
  EXPECT_THAT(Numbers("seeds.npy", 2), ElementsAre(0.25, 0.5, -7, 0.125));
  EXPECT_THAT(Numbers("polygons.npy", 2), ElementsAre(1, 2, 3, kNoBound));
  EXPECT_THAT(Texts("marker_names.npy"), ElementsAre("inlet", "Küste"));
  EXPECT_THAT(Numbers("named_markers.npy"), ElementsAre(5, 6));
  EXPECT_THAT(Texts("region_names.npy"), ElementsAre("sea"));
  EXPECT_THAT(Numbers("named_regions.npy"), ElementsAre(3));
  EXPECT_FALSE(Has("is_open.npy"));
}

TEST_F(FeatureArraysTest, OfASurface) {
  formats::PointCloud points;
  points.dimension = 3;
  points.points = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  SurfaceFeatures features;
  features.corners = {0, 1, 2};
  features.solids = SolidRule::kHoles;
  features.weld = 0.5;
  features.seeds = {{.x = 1, .y = 2, .z = 3, .is_hole = true}, {.x = 4, .y = 5, .z = 6, .region = 8, .max_volume = {}}};
  ASSERT_TRUE(WriteFeatureArrays(folder_.Path("a.npz"), points, features, {}).ok());
  EXPECT_THAT(Numbers("triangles.npy", 2), ElementsAre(0, 1, 2));
  EXPECT_THAT(Texts("solids.npy"), ElementsAre("holes"));
  EXPECT_THAT(Numbers("weld.npy"), ElementsAre(0.5));
  EXPECT_THAT(Numbers("holes.npy", 2), ElementsAre(1, 2, 3));
  EXPECT_THAT(Numbers("seeds.npy", 2), ElementsAre(4, 5, 6, 8, kNoBound));
  EXPECT_FALSE(Has("markers.npy"));
  EXPECT_FALSE(Has("marker_names.npy"));
}

TEST_F(FeatureArraysTest, WhatCannotBeWrittenIsNotThere) {
  formats::PointCloud points;
  points.dimension = 2;
  std::stop_source source;
  source.request_stop();
  points.points.assign(1 << 20, 0.1);
  EXPECT_EQ(WriteFeatureArrays(folder_.Path("a.npz"), points, Features(), source.get_token()).code(),
            absl::StatusCode::kCancelled);
  EXPECT_EQ(folder_.FileCount(), 0);
  EXPECT_THAT(std::string(WriteFeatureArrays("/dev/null", points, Features(), {}).message()),
              HasSubstr("npz is a zip archive, which needs a regular file"));
}

}  // namespace
}  // namespace wellspace::client
