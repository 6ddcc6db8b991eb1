// The file is read with HDF5 itself; that VTK reads it is another test's business.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/resource.h>

#include <bit>
#include <csignal>
#include <filesystem>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "client/formats/write_mesh.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

template <typename T>
std::vector<T> ReadArray(hid_t file, const std::string& name, hid_t type) {
  const hid_t array = H5Dopen2(file, ("/VTKHDF/" + name).c_str(), H5P_DEFAULT);
  EXPECT_GE(array, 0) << name;
  const hid_t space = H5Dget_space(array);
  std::vector<T> values(H5Sget_simple_extent_npoints(space));
  EXPECT_GE(H5Dread(array, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0) << name;
  H5Sclose(space);
  H5Dclose(array);
  return values;
}

class VtkHdfTest : public testing::Test {
 protected:
  void Open() {
    file_ = H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    ASSERT_GE(file_, 0);
  }
  void TearDown() override {
    if (file_ >= 0) {
      H5Fclose(file_);
    }
  }
  std::vector<int64_t> Integers(const std::string& name) { return ReadArray<int64_t>(file_, name, H5T_NATIVE_INT64); }
  std::vector<double> Reals(const std::string& name) { return ReadArray<double>(file_, name, H5T_NATIVE_DOUBLE); }

  TemporaryFolder folder_;
  const std::string path_ = folder_.Path("mesh.vtkhdf");
  hid_t file_ = -1;
};

TEST_F(VtkHdfTest, HoldsWhatVtkExpects) {
  const std::vector<double> points = {0, 0, 1, 0, 0.1, 1, 1, 1. / 3};
  const std::vector<uint32_t> simplices = {0, 1, 2, 1, 3, 2};
  const std::vector<double> weights = {0, 0.25, 0, 1e-300};
  ASSERT_TRUE(
      WriteMesh(path_, "",
                {.dimension = 2, .points = points, .simplices = simplices, .input_vertices = 3, .weights = weights})
          .ok());
  Open();
  EXPECT_THAT(Reals("Points"), ElementsAre(0, 0, 0, 1, 0, 0, 0.1, 1, 0, 1, 1. / 3, 0));
  EXPECT_THAT(Integers("Connectivity"), ElementsAreArray(simplices));
  EXPECT_THAT(Integers("Offsets"), ElementsAre(0, 3, 6));
  EXPECT_THAT(Integers("Types"), ElementsAre(5, 5));
  EXPECT_THAT(Integers("NumberOfPoints"), ElementsAre(4));
  EXPECT_THAT(Integers("NumberOfCells"), ElementsAre(2));
  EXPECT_THAT(Integers("NumberOfConnectivityIds"), ElementsAre(6));
  EXPECT_THAT(Integers("PointData/input"), ElementsAre(1, 1, 1, 0));
  EXPECT_THAT(Reals("PointData/weights"), ElementsAreArray(weights));
}

TEST_F(VtkHdfTest, RegionsOfSimplicesAndTagsOfFacets) {
  const std::vector<double> points = {0, 0, 1, 0, 0, 1, 1, 1};
  const std::vector<uint32_t> simplices = {0, 1, 2, 1, 3, 2};
  const std::vector<uint32_t> facets = {0, 1, 1, 2};
  const std::vector<BoundaryPart> boundary = {{3, "", 1}, {4, "", 1}};
  const std::vector<int32_t> simplex_regions = {20, 10};
  const std::vector<Region> regions = {{10, ""}, {20, ""}};
  MeshView mesh = {.dimension = 2, .points = points, .simplices = simplices};
  mesh.simplex_regions = simplex_regions;
  mesh.regions = regions;
  ASSERT_TRUE(WriteMesh(path_, "", mesh).ok());
  Open();
  EXPECT_THAT(Integers("CellData/region"), ElementsAre(20, 10));
  H5Fclose(std::exchange(file_, -1));
  mesh.facets = facets;
  mesh.boundary = boundary;
  ASSERT_TRUE(WriteMesh(path_, "", mesh).ok());
  Open();
  EXPECT_THAT(Integers("CellData/region"), ElementsAre(20, 10, 0, 0));
  EXPECT_THAT(Integers("CellData/boundary"), ElementsAre(0, 0, 3, 4));
  EXPECT_THAT(Integers("Connectivity"), ElementsAre(0, 1, 2, 1, 3, 2, 0, 1, 1, 2));
}

TEST_F(VtkHdfTest, PiecesOfAnySizeMakeOneMesh) {
  constexpr uint64_t kVertices = 100'000;  // several chunks
  constexpr uint64_t kSimplices = 70'000;
  std::vector<double> points(kVertices * 3);
  std::vector<uint32_t> simplices(kSimplices * 4);
  for (size_t i = 0; i < points.size(); ++i) {
    points[i] = 1. / (i + 1);
  }
  for (size_t i = 0; i < simplices.size(); ++i) {
    simplices[i] = i * 7919 % kVertices;
  }
  const auto writer = CreateMesh(path_, "", {.dimension = 3, .vertex_count = kVertices, .simplex_count = kSimplices});
  ASSERT_TRUE(writer.ok()) << writer.status();
  constexpr size_t kRows = 12'345;
  for (size_t begin = 0; begin < points.size(); begin += kRows * 3) {
    ASSERT_TRUE(
        (*writer)->AddPoints(std::span(points).subspan(begin, std::min(kRows * 3, points.size() - begin))).ok());
  }
  for (size_t begin = 0; begin < simplices.size(); begin += kRows * 4) {
    ASSERT_TRUE((*writer)
                    ->AddSimplices(std::span(simplices).subspan(begin, std::min(kRows * 4, simplices.size() - begin)))
                    .ok());
  }
  ASSERT_TRUE((*writer)->Commit().ok());
  Open();
  EXPECT_THAT(Reals("Points"), ElementsAreArray(points));
  EXPECT_THAT(Integers("Connectivity"), ElementsAreArray(simplices));
  EXPECT_EQ(Integers("Offsets").back(), static_cast<int64_t>(simplices.size()));
}

TEST_F(VtkHdfTest, AMeshOfNoSimplices) {
  const std::vector<double> points = {1, 2, 3};
  ASSERT_TRUE(WriteMesh(path_, "", {.dimension = 3, .points = points, .simplices = {}}).ok());
  Open();
  EXPECT_THAT(Integers("Connectivity"), IsEmpty());
  EXPECT_THAT(Integers("Offsets"), ElementsAre(0));
}

TEST_F(VtkHdfTest, NothingIsLeftOfAMeshThatIsNotComplete) {
  const std::vector<double> points = {1, 2, 3};
  {
    const auto writer = CreateMesh(path_, "", {.dimension = 3, .vertex_count = 2});
    ASSERT_TRUE(writer.ok()) << writer.status();
    ASSERT_TRUE((*writer)->AddPoints(points).ok());
    EXPECT_EQ((*writer)->Commit().code(), absl::StatusCode::kInternal);
  }
  std::stop_source stop;
  {
    const auto writer = CreateMesh(path_, "", {.dimension = 3, .vertex_count = 1}, stop.get_token());
    ASSERT_TRUE(writer.ok()) << writer.status();
    stop.request_stop();
    EXPECT_EQ((*writer)->AddPoints(points).code(), absl::StatusCode::kCancelled);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_.Path("")));
}

TEST_F(VtkHdfTest, FailedWriteSaysWhy) {
  signal(SIGXFSZ, SIG_IGN);
  rlimit before;
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{.rlim_cur = 1 << 14, .rlim_max = before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  std::vector<double> points(300'000);
  for (size_t i = 0; i < points.size(); ++i) {
    points[i] = std::bit_cast<double>(0x3ff0'0000'0000'0000 | i * 0x1'2345'6789'abcd % (uint64_t{1} << 52));
  }
  const absl::Status status = WriteMesh(path_, "", {.dimension = 3, .points = points, .simplices = {}});
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(std::string(status.message()), HasSubstr("File too large"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.Path("")));
  EXPECT_EQ(WriteMesh(path_, "", {.dimension = 3, .points = points, .simplices = {}}), absl::OkStatus());
  Open();
  EXPECT_THAT(Reals("Points"), ElementsAreArray(points));
}

TEST_F(VtkHdfTest, RefusesWhatItCannotHold) {
  EXPECT_THAT(std::string(CheckMeshOutput(path_, "", 4).message()), HasSubstr("vtkhdf holds meshes up to 3-D"));
  EXPECT_THAT(std::string(CheckMeshOutput("-", "vtkhdf").message()), HasSubstr("cannot go to standard output"));
}

}  // namespace
}  // namespace wellspace::formats
