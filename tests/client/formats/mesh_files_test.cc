// Meshes in VTU, NPZ and .node are read back to the bit; faults leave no file behind.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <random>

#include "client/formats/io/output_file.h"
#include "client/formats/io/zip_file.h"
#include "client/formats/numpy/npy.h"
#include "client/formats/read_cloud.h"
#include "client/formats/read_mesh.h"
#include "client/formats/write_mesh.h"
#include "tests/client/formats/random_mesh.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

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
    EXPECT_TRUE(read->weights.empty());
  }
}

TEST_P(RoundTripTest, KeepsEveryBitOfWeights) {
  const auto& [name, dimension] = GetParam();
  for (const uint64_t vertices : {uint64_t{3}, uint64_t{23000}}) {
    Mesh mesh = RandomMesh(dimension, vertices, 2 * vertices);
    mesh.weights.assign(mesh.points.begin(), mesh.points.begin() + static_cast<ptrdiff_t>(vertices));
    ASSERT_TRUE(WriteMesh(folder_.Path(name), "", mesh.View()).ok());
    const absl::StatusOr<Mesh> read = ReadMesh(folder_.Path(name));
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(Bits(read->points), Bits(mesh.points));
    EXPECT_EQ(Bits(read->weights), Bits(mesh.weights));
    EXPECT_EQ(read->simplices, mesh.simplices);
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, RoundTripTest,
                         testing::Combine(testing::Values("mesh.vtu", "mesh.npz", "mesh.node", "mesh.1.ele"),
                                          testing::Values(2, 3)));
INSTANTIATE_TEST_SUITE_P(FormatsOfHigherDimensions, RoundTripTest,
                         testing::Combine(testing::Values("mesh.npz", "mesh.node"), testing::Values(4, 5, 6)));

// Whole and in pieces.
TEST_P(RoundTripTest, PiecesMakeTheSameFile) {
  const auto& [name, dimension] = GetParam();
  Mesh mesh = RandomMesh(dimension, 30000, 60000);
  mesh.weights.assign(30000, 0.1);
  ASSERT_TRUE(WriteMesh(folder_.Path(name), "", mesh.View()).ok());
  const std::string whole = folder_.Read(name);
  const absl::StatusOr<std::unique_ptr<MeshWriter>> writer = CreateMesh(folder_.Path(name), "", mesh.View().Shape());
  ASSERT_TRUE(writer.ok()) << writer.status();
  const auto pieces = [](const auto& values, size_t row, const auto& add) {
    const size_t piece = 777 * row;
    for (size_t begin = 0; begin < values.size(); begin += piece) {
      ASSERT_TRUE(add(std::span(values).subspan(begin, std::min(piece, values.size() - begin))).ok());
    }
  };
  pieces(mesh.points, dimension, [&writer](std::span<const double> part) { return (*writer)->AddPoints(part); });
  pieces(mesh.weights, 1, [&writer](std::span<const double> part) { return (*writer)->AddWeights(part); });
  pieces(mesh.simplices, dimension + 1,
         [&writer](std::span<const uint32_t> part) { return (*writer)->AddSimplices(part); });
  EXPECT_EQ(folder_.Read(name), whole);  // the old one, until the new one is complete
  ASSERT_TRUE((*writer)->Commit().ok());
  EXPECT_EQ(folder_.Read(name), whole);
}

TEST_F(MeshFilesTest, MissingRowsAreAnErrorAndNoFile) {
  const Mesh mesh = RandomMesh(3, 10, 10);
  for (const char* name : {"mesh.vtu", "mesh.npz", "mesh.node"}) {
    const absl::StatusOr<std::unique_ptr<MeshWriter>> writer = CreateMesh(folder_.Path(name), "", mesh.View().Shape());
    ASSERT_TRUE(writer.ok()) << writer.status();
    ASSERT_TRUE((*writer)->AddPoints(mesh.points).ok());
    ASSERT_TRUE((*writer)->AddSimplices(std::span(mesh.simplices).first(4)).ok());
    EXPECT_EQ((*writer)->Commit().code(), absl::StatusCode::kInternal) << name;
  }
  EXPECT_EQ(folder_.FileCount(), 0);
}

TEST_F(MeshFilesTest, MissingWeightsAreAnErrorAndNoFile) {
  Mesh mesh = RandomMesh(3, 10, 10);
  mesh.weights.assign(10, 0.25);
  for (const char* name : {"mesh.vtu", "mesh.npz", "mesh.node"}) {
    const absl::StatusOr<std::unique_ptr<MeshWriter>> writer = CreateMesh(folder_.Path(name), "", mesh.View().Shape());
    ASSERT_TRUE(writer.ok()) << writer.status();
    ASSERT_TRUE((*writer)->AddPoints(mesh.points).ok());
    ASSERT_TRUE((*writer)->AddWeights(std::span(mesh.weights).first(9)).ok());
    (*writer)->AddSimplices(mesh.simplices).IgnoreError();  // some notice it here
    EXPECT_EQ((*writer)->Commit().code(), absl::StatusCode::kInternal) << name;
  }
  EXPECT_EQ(folder_.FileCount(), 0);
}

// An attribute is a weight only where the header says so.
TEST_F(MeshFilesTest, WeightsOfANode) {
  folder_.Write("mesh.ele", "1 3 0\n0 0 1 2\n");
  const auto read = [this](const std::string& header, const std::string& last) {
    return ReadMesh(folder_.Write("mesh.node", header + "\n0 0 0 1\n1 1 0 0.25\n2 0 1" + last + "\n"));
  };
  EXPECT_TRUE(read("3 2 1 0", " 2")->weights.empty());
  EXPECT_TRUE(read("# weights\n# heat\n3 2 1 0", " 2")->weights.empty());
  EXPECT_THAT(read("# weights\n3 2 1 0", " 2")->weights, ElementsAre(1, 0.25, 2));
  EXPECT_THAT(read("# weights\n# of points\n\n# weights \n3 2 1 1", " 2 1")->weights, ElementsAre(1, 0.25, 2));
  EXPECT_THAT(std::string(read("# weights\n3 2 1 0", "").status().message()),
              HasSubstr("mesh.node:5: expected a weight after the coordinates"));
  EXPECT_THAT(std::string(read("# weights\n3 2 1 0", " nan").status().message()), HasSubstr("mesh.node:5: weight: "));
}

// A mesh of 200 MB goes to disk with a tenth of that in memory.
TEST_F(MeshFilesTest, StreamsAreWrittenInBoundedMemory) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers keep memory that was given back";
#endif
  constexpr uint64_t kVertices = 8 << 20;
  const std::vector<double> points(3 << 12, 0.25);
  const std::vector<uint32_t> simplices(4 << 12, 7);
  const auto peak_kib = [] {
    rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
  };
  const long before = peak_kib();
  for (const char* name : {"mesh.vtu", "mesh.npz", "mesh.msh"}) {
    const absl::StatusOr<std::unique_ptr<MeshWriter>> writer =
        CreateMesh(folder_.Path(name), "",
                   {.dimension = 3, .vertex_count = kVertices, .simplex_count = 1 << 14, .input_vertices = 1});
    ASSERT_TRUE(writer.ok()) << writer.status();
    for (uint64_t i = 0; i < kVertices; i += 1 << 12) {
      ASSERT_TRUE((*writer)->AddPoints(points).ok());
    }
    for (int i = 0; i < 4; ++i) {
      ASSERT_TRUE((*writer)->AddSimplices(simplices).ok());
    }
    ASSERT_TRUE((*writer)->Commit().ok());
  }
  EXPECT_LT(peak_kib() - before, 20'000);
}

TEST_F(MeshFilesTest, VtuRefusesMoreThanThreeDimensionsAndNamesNpz) {
  const Mesh mesh = RandomMesh(4, 10, 10);
  const std::string path = folder_.Path("mesh.vtu");
  for (const absl::Status& status : {WriteMesh(path, "", mesh.View()), CheckMeshOutput(path, "", 4)}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()),
                HasSubstr("mesh.vtu: vtu holds meshes up to 3-D, and this one is 4-D; expected npz"));
  }
  EXPECT_EQ(folder_.FileCount(), 0);
  EXPECT_TRUE(CheckMeshOutput(path, "", 3).ok());
  EXPECT_TRUE(CheckMeshOutput(path, "npz", 6).ok());
}

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
  EXPECT_EQ(CheckMeshOutput("-", "npz").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(CheckMeshOutput("/dev/null", "npz").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(CheckMeshOutput(folder_.Path("mesh.stl"), "").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(CheckMeshOutput(folder_.Path(""), "vtu").code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(CheckMeshOutput(folder_.Path("none/mesh.vtu"), "").code(), absl::StatusCode::kNotFound);
}

TEST_F(MeshFilesTest, CancelledWriteLeavesTheOldFileAndNoOther) {
  const Mesh mesh = RandomMesh(3, 50000, 50000);
  std::stop_source source;
  source.request_stop();
  for (const char* name : {"mesh.vtu", "mesh.npz", "mesh.node"}) {
    folder_.Write(name, "old");
    EXPECT_EQ(WriteMesh(folder_.Path(name), "", mesh.View(), source.get_token()).code(), absl::StatusCode::kCancelled);
    EXPECT_EQ(folder_.Read(name), "old");
  }
  EXPECT_EQ(folder_.FileCount(), 3);
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
  EXPECT_THAT(message("byte_order=", "compressor=\"vtkZstdDataCompressor\" byte_order="),
              HasSubstr("mesh.vtu:3: expected compressor vtkZLibDataCompressor, vtkLZ4DataCompressor, "
                        "vtkLZMADataCompressor or none, got \"vtkZstdDataCompressor\""));
  EXPECT_THAT(message("byte_order=", "header_type=\"Int8\" byte_order="),
              HasSubstr("mesh.vtu:3: expected header_type"));
  EXPECT_THAT(message("NumberOfPoints=\"3\"", "NumberOfPoints=\"-3\""),
              HasSubstr("mesh.vtu:4: expected NumberOfPoints"));
  EXPECT_THAT(message("NumberOfPoints=\"3\"", "NumberOfPoints=\"4000000000\""),
              HasSubstr("expected 12000000000 coordinates for 4000000000 points, got 9"));
  EXPECT_THAT(message("NumberOfCells='1'", "NumberOfCells='2'"), HasSubstr("for each of 2 cells, got 1 types"));
  EXPECT_THAT(message("NumberOfComponents=\"3\"", "NumberOfComponents=\"2\""),
              HasSubstr("mesh.vtu:6: expected NumberOfComponents 3"));
  EXPECT_THAT(
      message("format=\"ascii\">\n", "format=\"appended\" offset=\"0\">\n"),
      HasSubstr("mesh.vtu:6: expected the offset of an array in <AppendedData>, which is not there, got \"0\""));
  EXPECT_THAT(message("format=\"ascii\">\n", "format=\"hdf\">\n"),
              HasSubstr("mesh.vtu:6: expected format \"ascii\", \"binary\" or \"appended\", got \"hdf\""));
  EXPECT_THAT(message("1.5", "one"), HasSubstr("expected a number, got \"one\""));
  EXPECT_THAT(message("1.5", "inf"), HasSubstr("expected a finite number, got \"inf\""));
  EXPECT_THAT(message("1.5 0\n", "1.5 0.5\n"), HasSubstr("point 2: expected z = 0"));
  EXPECT_THAT(message("0 1 2<", "0 1 3<"), HasSubstr("cell 0: expected vertices from 0 to below 3, got 3"));
  EXPECT_THAT(message("0 1 2<", "0 1 -2<"), HasSubstr("mesh.vtu:12: expected a whole number, got \"-2\""));
  EXPECT_THAT(message("0 1 2<", "0 1 2 0<"), HasSubstr("expected 3 vertices for 1 triangles, got 4"));
  EXPECT_THAT(message(">5<", ">9<"),
              HasSubstr("cell 0: expected only triangles (5) or only tetrahedra (10), got type 9"));
  EXPECT_THAT(message(">5<", ">10<"), HasSubstr("expected 4 vertices for 1 tetrahedra, got 3"));
  EXPECT_THAT(message(">3<", ">4<"), HasSubstr("cell 0: expected offset 3, got 4"));
  EXPECT_THAT(message("heat\" format=\"ascii\">1 2 3", "weights\" format=\"ascii\">1 2"),
              HasSubstr("expected a weight for each of 3 points, got 2"));
  EXPECT_THAT(message("</Cells>", "</Cell>"),
              HasSubstr("mesh.vtu:15: expected the end of \"Cells\", got that of \"Cell\""));
  EXPECT_THAT(message("</Piece>", "</Piece><Piece NumberOfPoints=\"1\" NumberOfCells=\"0\"/>"),
              HasSubstr("expected 12 coordinates for 4 points, got 9"));
  EXPECT_THAT(message("<Cells>", "<Piece NumberOfPoints=\"1\" NumberOfCells=\"0\"/><Cells>"),
              HasSubstr("got one inside of another"));
  EXPECT_THAT(message("<Cells>", "<AppendedData encoding=\"raw\"/><Cells>"),
              HasSubstr("expected <AppendedData> right inside <VTKFile>"));
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

// An array as a .npy has it.
std::string NpyText(const std::string& type, uint64_t rows, uint64_t columns, std::string_view values) {
  return NpyPreamble(type, rows, columns).append(values);
}

std::string BytesOf(const auto& values) {
  return std::string(reinterpret_cast<const char*>(std::data(values)), std::size(values) * sizeof(values[0]));
}

class NpzTest : public MeshFilesTest {
 protected:
  // The path of an archive with these members.
  std::string WriteArchive(const std::vector<std::pair<std::string, std::string>>& members) {
    absl::StatusOr<OutputFile> output = OutputFile::Create(folder_.Path("mesh.npz"));
    EXPECT_TRUE(output.ok()) << output.status();
    ZipWriter archive(*output);
    for (const auto& [name, content] : members) {
      archive.Begin(name, content.size());
      archive.Write(content);
    }
    EXPECT_TRUE(archive.Finish().ok());
    EXPECT_TRUE(output->Commit().ok());
    return folder_.Path("mesh.npz");
  }

  // The message of the refusal of an archive of the two arrays, after the folder's name.
  std::string Refusal(const std::string& points, const std::string& simplices) {
    const absl::StatusOr<Mesh> mesh =
        ReadMesh(WriteArchive({{"points.npy", points}, {"other.npy", "?"}, {"simplices.npy", simplices}}));
    EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument) << mesh.status();
    return std::string(mesh.status().message()).substr(folder_.Path("").size());
  }

  const std::string points_ = NpyText("<f8", 3, 2, BytesOf(std::array{0.0, 0.0, 1.0, 0.0, 0.0, 1.5}));
  const std::string simplices_ = NpyText("<u4", 1, 3, BytesOf(std::array<uint32_t, 3>{0, 1, 2}));
};

TEST_F(NpzTest, TakesWholeNumbersOfEitherSizeAndSign) {
  const auto read = [this](const std::string& type, const std::string& values) {
    const absl::StatusOr<Mesh> mesh =
        ReadMesh(WriteArchive({{"simplices.npy", NpyText(type, 1, 3, values)}, {"points.npy", points_}}));
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return mesh.ok() ? mesh->simplices : std::vector<uint32_t>();
  };
  EXPECT_THAT(read("<u4", BytesOf(std::array<uint32_t, 3>{0, 1, 2})), ElementsAre(0, 1, 2));
  EXPECT_THAT(read("<i4", BytesOf(std::array<int32_t, 3>{2, 1, 0})), ElementsAre(2, 1, 0));
  EXPECT_THAT(read("<u8", BytesOf(std::array<uint64_t, 3>{1, 0, 2})), ElementsAre(1, 0, 2));
  EXPECT_THAT(read("<i8", BytesOf(std::array<int64_t, 3>{1, 2, 0})), ElementsAre(1, 2, 0));
  EXPECT_THAT(read("|u1", BytesOf(std::array<uint8_t, 3>{1, 2, 0})), ElementsAre(1, 2, 0));
  EXPECT_THAT(read(">i2", std::string("\0\2\0\0\0\1", 6)), ElementsAre(2, 0, 1));
  EXPECT_THAT(read(">u4", std::string("\0\0\0\2\0\0\0\0\0\0\0\1", 12)), ElementsAre(2, 0, 1));
}

TEST_F(NpzTest, Errors) {
  EXPECT_THAT(ReadBad("mesh.npz", ""), HasSubstr("mesh.npz: expected a zip archive"));
  EXPECT_THAT(ReadBad("mesh.npz", points_), HasSubstr("mesh.npz: expected a zip archive"));
  const absl::Status missing = ReadMesh(WriteArchive({{"points.npy", points_}})).status();
  EXPECT_EQ(missing.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(missing.message()), HasSubstr("mesh.npz: expected a member \"simplices.npy\""));
  const auto indices = [](const std::string& type, const auto& values) {
    return NpyText(type, 1, std::size(values), BytesOf(values));
  };
  EXPECT_EQ(Refusal(points_, indices("<u4", std::array<uint32_t, 3>{0, 1, 3})),
            "mesh.npz: simplices.npy: expected indices from 0 to below the number of points, got 3 at [0, 2]");
  EXPECT_THAT(Refusal(points_, indices("<i4", std::array<int32_t, 3>{0, -1, 2})), HasSubstr("got -1 at [0, 1]"));
  EXPECT_THAT(Refusal(points_, indices("<i8", std::array<int64_t, 3>{-1, 1, 2})), HasSubstr("got -1 at [0, 0]"));
  EXPECT_THAT(Refusal(points_, indices("<u8", std::array<uint64_t, 3>{1ull << 32, 1, 2})),
              HasSubstr("got 4294967296 at [0, 0]"));
  EXPECT_EQ(Refusal(points_, indices("<u4", std::array<uint32_t, 4>{0, 1, 2, 0})),
            "mesh.npz: simplices.npy: expected 3 columns for simplices of points with 2 coordinates, got 4");
  EXPECT_THAT(Refusal(points_, indices("<f8", std::array<double, 3>{0, 1, 2})),
              HasSubstr("simplices.npy: expected whole numbers of type i1, i2, i4, i8, u1, u2, u4 or u8"));
  EXPECT_THAT(Refusal(NpyText(">f2", 3, 2, std::string(12, '\0')), simplices_),
              HasSubstr("points.npy: expected numbers of type f4, f8, i1, i2, i4, i8, u1, u2, u4 or u8, got \">f2\""));
  EXPECT_THAT(Refusal(NpyText("<f8", 3, 7, std::string(168, '\0')), simplices_),
              HasSubstr("points.npy: expected fewer than 2^32 rows and 2 to 6 columns"));
  EXPECT_THAT(Refusal(points_ + "x", simplices_), HasSubstr("points.npy: expected 48 bytes of values"));
  EXPECT_THAT(Refusal(points_.substr(0, 100), simplices_), HasSubstr("points.npy: the array ends after 100 bytes"));
  EXPECT_THAT(Refusal("", simplices_), HasSubstr("points.npy: the array ends after 0 bytes, inside its header"));
  const auto weights_refusal = [this](const std::string& weights) {
    const absl::StatusOr<Mesh> mesh =
        ReadMesh(WriteArchive({{"points.npy", points_}, {"weights.npy", weights}, {"simplices.npy", simplices_}}));
    return std::string(mesh.status().message());
  };
  const std::array pair = {0.5, 0.25};
  EXPECT_THAT(weights_refusal(NpyPreamble("<f8", 2, std::nullopt).append(BytesOf(pair))),
              HasSubstr("mesh.npz: weights.npy: expected 3 weights, one for each point, got 2"));
  EXPECT_THAT(weights_refusal(NpyText("<f8", 1, 2, BytesOf(pair))),
              HasSubstr("weights.npy: expected an array of 1 dimension, got one of 2"));
  // The counts of a header are not believed.
  EXPECT_THAT(Refusal(NpyText("<f8", uint64_t{1} << 31, 2, "none"), simplices_), HasSubstr("got 4"));
}

// The fields of zip64 are chosen by the size that is announced: here they are there without gigabytes.
TEST_F(NpzTest, MembersAnnouncedAsHuge) {
  absl::StatusOr<OutputFile> output = OutputFile::Create(folder_.Path("mesh.npz"));
  ASSERT_TRUE(output.ok()) << output.status();
  ZipWriter archive(*output);
  for (const auto& [name, content] : {std::pair("points.npy", points_), std::pair("simplices.npy", simplices_)}) {
    archive.Begin(name, uint64_t{1} << 33);
    archive.Write(content);
  }
  ASSERT_TRUE(archive.Finish().ok());
  ASSERT_TRUE(output->Commit().ok());
  const absl::StatusOr<Mesh> mesh = ReadMesh(folder_.Path("mesh.npz"));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(mesh->simplices, ElementsAre(0, 1, 2));
}

TEST_F(NpzTest, NeedsARegularFile) {
  const std::string path = folder_.Path("pipe.npz");
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  const int keep_open = open(path.c_str(), O_RDWR);
  const absl::Status read = ReadMesh(path).status();
  EXPECT_THAT(std::string(read.message()), HasSubstr("pipe.npz: expected a regular file"));
  const absl::Status written = WriteMesh(path, "", RandomMesh(2, 10, 10).View());
  EXPECT_THAT(std::string(written.message()), HasSubstr("needs a regular file"));
  close(keep_open);
}

TEST_F(NpzTest, TheSameMeshGivesTheSameBytes) {
  const Mesh mesh = RandomMesh(4, 1000, 3000);
  ASSERT_TRUE(WriteMesh(folder_.Path("a.npz"), "", mesh.View()).ok());
  ASSERT_TRUE(WriteMesh(folder_.Path("b.npz"), "", mesh.View()).ok());
  EXPECT_EQ(folder_.Read("a.npz"), folder_.Read("b.npz"));
}

// The checksums and sizes of the archive leave no damage unseen that reaches the arrays.
TEST_F(NpzTest, DamagedNpzIsNoTrouble) {
  const Mesh mesh = RandomMesh(3, 20, 20);
  ASSERT_TRUE(WriteMesh(folder_.Path("good.npz"), "", mesh.View()).ok());
  const std::string good = folder_.Read("good.npz");
  int refused = 0;
  const auto try_to_read = [&](const std::string& damaged) {
    const absl::StatusOr<Mesh> read = ReadMesh(folder_.Write("damaged.npz", damaged));
    if (read.ok()) {
      EXPECT_EQ(Bits(read->points), Bits(mesh.points));
      EXPECT_EQ(read->simplices, mesh.simplices);
    } else {
      EXPECT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument) << read.status();
      ++refused;
    }
  };
  for (size_t size = 0; size < good.size(); size += 7) {
    try_to_read(good.substr(0, size));
  }
  for (size_t i = 0; i < good.size(); i += 3) {
    std::string damaged = good;
    damaged[i] = static_cast<char>(damaged[i] ^ 1 << i % 8);
    try_to_read(damaged);
  }
  EXPECT_GT(refused, 300);
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
