#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <bit>
#include <limits>
#include <random>

#include "client/formats/read_cloud.h"
#include "client/formats/read_mesh.h"
#include "client/formats/write_mesh.h"
#include "tests/formats/temporary_folder.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// `vertices` points with the bits of all kinds of doubles, and simplices of random vertices.
Mesh RandomMesh(int dimension, uint64_t vertices, uint64_t simplices) {
  std::mt19937_64 random(7);
  Mesh mesh{.dimension = dimension, .points = {}, .simplices = {}};
  mesh.points = {0.0,    -0.0, 0.1, std::numeric_limits<double>::denorm_min(), std::numeric_limits<double>::max(),
                 1.0 / 3};
  while (mesh.points.size() < vertices * dimension) {
    const double value = std::bit_cast<double>(random());
    mesh.points.push_back(std::isfinite(value) ? value : 1e-300);
  }
  while (mesh.simplices.size() < simplices * (dimension + 1)) {
    mesh.simplices.push_back(static_cast<uint32_t>(random() % vertices));
  }
  return mesh;
}

std::vector<uint64_t> Bits(const std::vector<double>& values) {
  std::vector<uint64_t> bits;
  for (const double value : values) {
    bits.push_back(std::bit_cast<uint64_t>(value));
  }
  return bits;
}

class MeshFilesTest : public testing::Test {
 protected:
  // The message of the refusal of a file.
  std::string ReadBad(const std::string& name, std::string_view content) {
    const absl::StatusOr<Mesh> mesh = ReadMesh(folder_.Write(name, content));
    EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument) << mesh.status();
    return std::string(mesh.status().message());
  }

  TemporaryFolder folder_;
};

class RoundTripTest : public MeshFilesTest, public testing::WithParamInterface<std::tuple<std::string, int>> {};

TEST_P(RoundTripTest, KeepsEveryBit) {
  const auto& [name, dimension] = GetParam();
  for (const uint64_t vertices : {uint64_t{3}, uint64_t{1000}, uint64_t{23000}}) {
    const Mesh mesh = RandomMesh(dimension, vertices, 2 * vertices);
    ASSERT_TRUE(WriteMesh(folder_.Path(name), "", mesh.View()).ok());
    const absl::StatusOr<Mesh> read = ReadMesh(folder_.Path(name));
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->dimension, dimension);
    EXPECT_EQ(Bits(read->points), Bits(mesh.points));
    EXPECT_EQ(read->simplices, mesh.simplices);
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, RoundTripTest,
                         testing::Combine(testing::Values("mesh.vtu", "mesh.node", "mesh.1.ele"),
                                          testing::Values(2, 3)));

TEST_F(MeshFilesTest, NodeFileIsAlsoACloud) {
  const Mesh mesh = RandomMesh(3, 100, 10);
  ASSERT_TRUE(WriteMesh(folder_.Path("mesh.ele"), "", mesh.View()).ok());
  const absl::StatusOr<PointCloud> cloud = ReadCloud(folder_.Path("mesh.node"));
  ASSERT_TRUE(cloud.ok()) << cloud.status();
  EXPECT_EQ(Bits(cloud->points), Bits(mesh.points));
}

TEST_F(MeshFilesTest, OutputIsCheckedBeforeAnythingIsComputed) {
  EXPECT_TRUE(CheckMeshOutput(folder_.Path("mesh.vtu"), "").ok());
  EXPECT_TRUE(CheckMeshOutput(folder_.Path("mesh"), "node").ok());
  EXPECT_TRUE(CheckMeshOutput("-", "").ok());
  EXPECT_TRUE(CheckMeshOutput("/dev/null", "vtu").ok());
  EXPECT_EQ(CheckMeshOutput("-", "node").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(CheckMeshOutput(folder_.Path("mesh.stl"), "").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(CheckMeshOutput(folder_.Path(""), "vtu").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(CheckMeshOutput(folder_.Path("none/mesh.vtu"), "").code(), absl::StatusCode::kNotFound);
}

TEST_F(MeshFilesTest, CancelledWriteLeavesTheOldFileAndNoOther) {
  const Mesh mesh = RandomMesh(3, 50000, 50000);
  std::stop_source source;
  source.request_stop();
  for (const char* name : {"mesh.vtu", "mesh.node"}) {
    folder_.Write(name, "old");
    EXPECT_EQ(WriteMesh(folder_.Path(name), "", mesh.View(), source.get_token()).code(), absl::StatusCode::kCancelled);
    EXPECT_EQ(folder_.Read(name), "old");
  }
  EXPECT_EQ(folder_.FileCount(), 2);
}

TEST_F(MeshFilesTest, FailedWriteSaysWhy) {
  const Mesh mesh = RandomMesh(2, 1000, 10);
  const absl::Status full = WriteMesh("/dev/full", "vtu", mesh.View());
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(full.message()), StartsWith("cannot write /dev/full: No space left"));
}

TEST_F(MeshFilesTest, WritesThroughLinksAndWithTheUsualRights) {
  const Mesh mesh = RandomMesh(2, 10, 10);
  std::filesystem::create_symlink(folder_.Write("target.vtu", ""), folder_.Path("link.vtu"));
  ASSERT_TRUE(WriteMesh(folder_.Path("link.vtu"), "", mesh.View()).ok());
  EXPECT_TRUE(std::filesystem::is_symlink(folder_.Path("link.vtu")));
  EXPECT_TRUE(ReadMesh(folder_.Path("target.vtu")).ok());
  const mode_t mask = umask(0);
  umask(mask);
  struct stat attributes;
  ASSERT_EQ(stat(folder_.Path("target.vtu").c_str(), &attributes), 0);
  EXPECT_EQ(attributes.st_mode & 0777, 0666 & ~mask);
}

constexpr char kAscii[] = R"(<?xml version="1.0"?>
<!-- by hand -->
<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
 <UnstructuredGrid><Piece NumberOfPoints="3" NumberOfCells='1'>
  <PointData><DataArray type="Float64" Name="heat" format="ascii">1 2 3</DataArray></PointData>
  <Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">
    0 0 0  1 0 0
    0 1.5 0
    <InformationKey name="L2_NORM_RANGE" location="vtkDataArray" length="2"/>
  </DataArray></Points>
  <Cells>
   <DataArray type="Int32" Name="connectivity" format="ascii">0 1 2</DataArray>
   <DataArray type="Int32" Name="offsets" format="ascii">3</DataArray>
   <DataArray type="UInt8" Name="types" format="ascii">5</DataArray>
  </Cells>
 </Piece></UnstructuredGrid>
</VTKFile>
)";

std::string Replaced(const std::string& from, const std::string& to) {
  std::string text = kAscii;
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST_F(MeshFilesTest, VtuInAscii) {
  const absl::StatusOr<Mesh> mesh = ReadMesh(folder_.Write("mesh.vtu", kAscii));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->dimension, 2);
  EXPECT_THAT(mesh->points, ElementsAre(0, 0, 1, 0, 0, 1.5));
  EXPECT_THAT(mesh->simplices, ElementsAre(0, 1, 2));
}

TEST_F(MeshFilesTest, VtuErrors) {
  const auto message = [this](const std::string& from, const std::string& to) {
    return ReadBad("mesh.vtu", Replaced(from, to));
  };
  EXPECT_THAT(message("UnstructuredGrid\"", "PolyData\""), HasSubstr("mesh.vtu:3: expected <VTKFile type="));
  EXPECT_THAT(message("LittleEndian", "Middle"), HasSubstr("mesh.vtu:3: expected byte_order"));
  EXPECT_THAT(message("byte_order=", "compressor=\"vtkLZ4DataCompressor\" byte_order="),
              HasSubstr("mesh.vtu:3: expected compressor vtkZLibDataCompressor or none, got \"vtkLZ4DataCompressor\""));
  EXPECT_THAT(message("byte_order=", "header_type=\"Int8\" byte_order="),
              HasSubstr("mesh.vtu:3: expected header_type"));
  EXPECT_THAT(message("NumberOfPoints=\"3\"", "NumberOfPoints=\"-3\""),
              HasSubstr("mesh.vtu:4: expected NumberOfPoints"));
  EXPECT_THAT(message("NumberOfPoints=\"3\"", "NumberOfPoints=\"4000000000\""),
              HasSubstr("expected 12000000000 coordinates for 4000000000 points, got 9"));
  EXPECT_THAT(message("NumberOfCells='1'", "NumberOfCells='2'"), HasSubstr("for each of 2 cells, got 1 types"));
  EXPECT_THAT(message("NumberOfComponents=\"3\"", "NumberOfComponents=\"2\""),
              HasSubstr("mesh.vtu:6: expected NumberOfComponents 3"));
  EXPECT_THAT(message("format=\"ascii\">\n", "format=\"appended\" offset=\"0\">\n"),
              HasSubstr("mesh.vtu:6: expected format \"ascii\" or \"binary\", got \"appended\""));
  EXPECT_THAT(message("1.5", "one"), HasSubstr("expected a number, got \"one\""));
  EXPECT_THAT(message("1.5", "inf"), HasSubstr("expected a finite number, got \"inf\""));
  EXPECT_THAT(message("1.5 0\n", "1.5 0.5\n"), HasSubstr("point 2: expected z = 0"));
  EXPECT_THAT(message("0 1 2<", "0 1 3<"), HasSubstr("cell 0: expected vertices from 0 to below 3, got 3"));
  EXPECT_THAT(message("0 1 2<", "0 1 -2<"), HasSubstr("mesh.vtu:12: expected a whole number, got \"-2\""));
  EXPECT_THAT(message("0 1 2<", "0 1 2 0<"), HasSubstr("expected 3 vertices for 1 triangles, got 4"));
  EXPECT_THAT(message(">5<", ">9<"), HasSubstr("got 3"));
  EXPECT_THAT(message(">3<", ">4<"), HasSubstr("cell 0: expected offset 3, got 4"));
  EXPECT_THAT(message("</Cells>", "</Cell>"),
              HasSubstr("mesh.vtu:15: expected the end of \"Cells\", got that of \"Cell\""));
  EXPECT_THAT(message("</Piece>", "</Piece><Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"/>"),
              HasSubstr("expected one <Piece>"));
  EXPECT_THAT(message("</VTKFile>", "<AppendedData/></VTKFile>"), HasSubstr("got appended data"));
  EXPECT_THAT(message("</UnstructuredGrid>\n</VTKFile>\n", "<\x01>"),
              HasSubstr("the file ends inside element \"\\x01\""));
  EXPECT_THAT(ReadBad("mesh.vtu", ""), HasSubstr("expected one <Piece>"));
}

// Every attribute is looked at once, not all that follow it with each of them: that would take hours here.
TEST_F(MeshFilesTest, VtuTagOfAMillionAttributes) {
  std::string tag = "<VTKFile ";
  for (int i = 0; i < 1'000'000; ++i) {
    tag += "a=''";
  }
  EXPECT_THAT(ReadBad("mesh.vtu", tag + ">"), HasSubstr("mesh.vtu:1: expected <VTKFile type="));
}

// Whatever a cut or a flipped byte does to a file, it is read or refused; under a sanitizer this shows more.
TEST_F(MeshFilesTest, DamagedVtuIsNoTrouble) {
  const Mesh mesh = RandomMesh(3, 20, 20);
  ASSERT_TRUE(WriteMesh(folder_.Path("good.vtu"), "", mesh.View()).ok());
  for (const std::string& good : {folder_.Read("good.vtu"), std::string(kAscii)}) {
    const size_t last = good.rfind("</VTKFile>");
    for (size_t size = 0; size < last; size += 7) {
      EXPECT_FALSE(ReadMesh(folder_.Write("cut.vtu", good.substr(0, size))).ok()) << size;
    }
    std::mt19937_64 random(11);
    for (int i = 0; i < 200; ++i) {
      std::string damaged = good;
      damaged[random() % damaged.size()] = static_cast<char>(random());
      const absl::StatusOr<Mesh> read = ReadMesh(folder_.Write("damaged.vtu", damaged));
      if (!read.ok()) {
        EXPECT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument);
      }
    }
  }
}

TEST_F(MeshFilesTest, EleErrors) {
  folder_.Write("mesh.node", "3 2 0 0\n1 0 0\n2 1 0\n3 0 1\n");
  EXPECT_THAT(ReadBad("mesh.ele", ""), HasSubstr("mesh.ele:1: expected a header"));
  EXPECT_THAT(ReadBad("mesh.ele", "1 4 0\n1 1 2 3 3\n"),
              HasSubstr("mesh.ele:1: expected 3 nodes for each of the triangles, got 4"));
  EXPECT_THAT(ReadBad("mesh.ele", "1 3 0\n1 0 1 2\n"),
              HasSubstr("mesh.ele:2: expected a node from 1 to below 4, got \"0\""));
  EXPECT_THAT(ReadBad("mesh.ele", "1 3 0\n1 1 2 4\n"), HasSubstr("got \"4\""));
  EXPECT_THAT(ReadBad("mesh.ele", "1 3 0\n1 1 2\n"), HasSubstr("mesh.ele:2: expected 3 nodes, got 2"));
  EXPECT_THAT(ReadBad("mesh.ele", "1 3 0\n1 1 2 3 4\n"), HasSubstr("mesh.ele:2: expected 3 nodes and 0 attributes"));
  EXPECT_THAT(ReadBad("mesh.ele", "4000000000 3 0\n1 1 2 3\n"), HasSubstr("expected 4000000000 triangles"));
  EXPECT_THAT(ReadBad("mesh.ele", "1 3 0\n1 1 2 3\n2 1 2 3\n"), HasSubstr("mesh.ele:3: expected the end of the file"));
  const absl::StatusOr<Mesh> mesh = ReadMesh(folder_.Write("mesh.ele", "# good\n1 3 1\n0 1 2 3 0.5\n"));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->simplices, ElementsAre(0, 1, 2));
}

}  // namespace
}  // namespace wellspace::formats
