// Every reader of meshes, on any text, and the decoder of VTK's binary arrays.
//
// Input: a character from 0 to ; then
//   0  a .vtu file;
//   1  a .node file, '|', the .ele file;
//   2  a byte whose lowest bits say compressed, big-endian, eight-byte header, and whose fifth and sixth say by LZ4 or
//      by xz; the bytes of an array before they were put into base64;
//   3  a .npz file;
//   4  two bytes, the length of the first array of a .npz in little-endian order; that array and the second one, each
//      a .npy;
//   5  a .msh file;
//   6  a .mesh file;
//   7  a .vtk file;
//   8  a .vtp file;
//   9  a byte as of 2, of which the fourth bit says base64; bytes that follow where an array begins in appended data;
//   :  a .14 file;
//   ;  a .2dm file.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "client/formats/cloud.h"
#include "client/formats/io/output_file.h"
#include "client/formats/io/zip_file.h"
#include "client/formats/read_mesh.h"
#include "client/formats/vtk/vtk_array.h"
#include "client/formats/write_mesh.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/scratch_folder.h"

namespace wellspace::fuzz {
namespace {

using formats::Mesh;

void RequireInvalidArgument(const absl::Status& status) {
  Require(status.code() == absl::StatusCode::kInvalidArgument, "bad input is an INVALID_ARGUMENT:", status.ToString());
}

template <typename T>
bool AreSameBits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void RequireMesh(const Mesh& mesh) {
  Require(mesh.dimension >= formats::kMinDimension && mesh.dimension <= formats::kMaxDimension,
          "the dimension is one of those that there are");
  Require(mesh.points.size() % mesh.dimension == 0, "every vertex has all its coordinates");
  Require(mesh.simplices.size() % (mesh.dimension + 1) == 0, "every simplex has all its vertices");
  for (const uint32_t vertex : mesh.simplices) {
    Require(vertex < mesh.View().vertex_count(), "a simplex has vertices of the mesh");
  }
  Require(mesh.simplex_regions.empty() || mesh.simplex_regions.size() == mesh.View().simplex_count(),
          "every simplex has a region, or none has");
  Require(mesh.facets.size() == mesh.View().Shape().facet_count() * mesh.dimension, "every facet is of a part");
  for (const uint32_t vertex : mesh.facets) {
    Require(vertex < mesh.View().vertex_count(), "a facet has vertices of the mesh");
  }
  Require(mesh.ridges.size() % 2 == 0 && (mesh.ridges.empty() || mesh.dimension == 3), "ridges are edges in 3-D");
  for (const uint32_t vertex : mesh.ridges) {
    Require(vertex < mesh.View().vertex_count(), "a ridge has vertices of the mesh");
  }
}

// The simplices in an order of their own: files may have them by their regions.
std::vector<std::vector<uint32_t>> Sorted(const Mesh& mesh) {
  std::vector<std::vector<uint32_t>> rows;
  const size_t corners = mesh.dimension + 1;
  for (size_t i = 0; i < mesh.simplices.size(); i += corners) {
    rows.emplace_back(mesh.simplices.begin() + i, mesh.simplices.begin() + i + corners);
  }
  std::sort(rows.begin(), rows.end());
  return rows;
}

// Reads the mesh of `path`, writes it as `copy` and reads that.
void ReadWriteRead(const std::string& path, const std::string& copy) {
  const absl::StatusOr<Mesh> mesh = formats::ReadMesh(path, formats::SimplexData::kKeep);
  if (!mesh.ok()) {
    RequireInvalidArgument(mesh.status());
    RequireClearMessage({mesh.status().message().data(), mesh.status().message().size()});
    return;
  }
  RequireMesh(*mesh);
  for (const std::string& note : mesh->notes) {
    RequireClearMessage(note);
  }
  for (const formats::Attribute& data : mesh->simplex_attributes) {
    Require(data.values.size() == mesh->View().simplex_count(), "every simplex has a number of each attribute");
  }
  const absl::Status written = formats::WriteMesh(copy, "", mesh->View());
  Require(written.ok(), "a mesh can be written:", written.ToString());
  const absl::StatusOr<Mesh> again = formats::ReadMesh(copy);
  Require(again.ok(), "a mesh can be read again:", again.status().ToString());
  Require(again->dimension == mesh->dimension && AreSameBits(again->points, mesh->points) &&
              (mesh->simplex_regions.empty() ? AreSameBits(again->simplices, mesh->simplices)
                                             : Sorted(*again) == Sorted(*mesh)),
          "a mesh reads back to the bit");
  if (mesh->dimension <= 3) {
    formats::MeshView second = mesh->View();
    second.order = formats::MeshOrder::kSecond;
    const absl::Status status = formats::WriteMesh(ScratchFolder::Get().Path("second.npz"), "", second);
    Require(status.ok(), "a mesh can be written with elements of second order:", status.ToString());
  }
}

void ReadVtu(std::string_view document) {
  const ScratchFolder& folder = ScratchFolder::Get();
  ReadWriteRead(folder.Write("mesh.vtu", document), folder.Path("again.vtu"));
}

void ReadNodeAndEle(std::string_view both) {
  const ScratchFolder& folder = ScratchFolder::Get();
  const size_t split = std::min(both.find('|'), both.size());
  folder.Write("mesh.ele", both.substr(std::min(split + 1, both.size())));
  ReadWriteRead(folder.Write("mesh.node", both.substr(0, split)), folder.Path("again.node"));
}

void ReadNpz(std::string_view archive) {
  const ScratchFolder& folder = ScratchFolder::Get();
  ReadWriteRead(folder.Write("mesh.npz", archive), folder.Path("again.npz"));
}

void ReadMsh(std::string_view content) {
  const ScratchFolder& folder = ScratchFolder::Get();
  ReadWriteRead(folder.Write("mesh.msh", content), folder.Path("again.msh"));
}

void ReadMedit(std::string_view content) {
  const ScratchFolder& folder = ScratchFolder::Get();
  ReadWriteRead(folder.Write("mesh.mesh", content), folder.Path("again.mesh"));
}

void ReadVtk(std::string_view content) {
  const ScratchFolder& folder = ScratchFolder::Get();
  ReadWriteRead(folder.Write("mesh.vtk", content), folder.Path("again.vtk"));
}

void ReadVtp(std::string_view content) {
  const ScratchFolder& folder = ScratchFolder::Get();
  ReadWriteRead(folder.Write("mesh.vtp", content), folder.Path("again.vtu"));
}

void ReadAdcirc(std::string_view content) {
  const ScratchFolder& folder = ScratchFolder::Get();
  ReadWriteRead(folder.Write("mesh.14", content), folder.Path("again.14"));
}

void Read2dm(std::string_view content) {
  const ScratchFolder& folder = ScratchFolder::Get();
  ReadWriteRead(folder.Write("mesh.2dm", content), folder.Path("again.2dm"));
}

// The first bit and, with it, the fifth and sixth.
formats::VtkCompressor CompressorOf(uint8_t flags) {
  using formats::VtkCompressor;
  return (flags & 1) == 0        ? VtkCompressor::kNone
         : (flags >> 4) % 4 == 1 ? VtkCompressor::kLz4
         : (flags >> 4) % 4 == 2 ? VtkCompressor::kLzma
                                 : VtkCompressor::kZlib;
}

void DecodeAppended(uint8_t flags, std::string_view data) {
  const formats::VtkEncoding encoding = {
      .compressor = CompressorOf(flags), .big_endian = (flags & 2) != 0, .header_word_bytes = (flags & 4) != 0 ? 8 : 4};
  if (const auto decoded = formats::DecodeAppendedVtkArray(data, (flags & 8) != 0, encoding); !decoded.ok()) {
    RequireInvalidArgument(decoded.status());
  }
}

// The checksums of an archive keep the fuzzer out: this makes them.
void ReadArrays(std::string_view points, std::string_view simplices) {
  const ScratchFolder& folder = ScratchFolder::Get();
  absl::StatusOr<formats::OutputFile> output = formats::OutputFile::Create(folder.Path("mesh.npz"));
  Require(output.ok(), "a file can be written:", output.status().ToString());
  formats::ZipWriter archive(*output);
  archive.Begin("points.npy", points.size());
  archive.Write(points);
  archive.Begin("simplices.npy", simplices.size());
  archive.Write(simplices);
  Require(archive.Finish().ok() && output->Commit().ok(), "an archive can be written");
  ReadWriteRead(folder.Path("mesh.npz"), folder.Path("again.npz"));
}

void DecodeArray(uint8_t flags, std::string_view array) {
  const formats::VtkEncoding encoding = {
      .compressor = CompressorOf(flags), .big_endian = (flags & 2) != 0, .header_word_bytes = (flags & 4) != 0 ? 8 : 4};
  std::string text;
  formats::AppendBase64(array, text);
  const absl::StatusOr<std::string> bytes = formats::DecodeBase64(text);
  Require(bytes.ok() && *bytes == array, "base64 goes there and back");
  if (const absl::StatusOr<std::string> decoded = formats::DecodeVtkArray(text, encoding); !decoded.ok()) {
    RequireInvalidArgument(decoded.status());
  }
}

}  // namespace
}  // namespace wellspace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  wellspace::fuzz::ByteReader bytes(data, size);
  switch (static_cast<uint8_t>(bytes.Next() - '0') % 12) {
    case 0:
      wellspace::fuzz::ReadVtu(bytes.TakeText());
      break;
    case 1:
      wellspace::fuzz::ReadNodeAndEle(bytes.TakeText());
      break;
    case 2: {
      const uint8_t flags = bytes.Next();
      wellspace::fuzz::DecodeArray(flags, bytes.TakeText());
      break;
    }
    case 3:
      wellspace::fuzz::ReadNpz(bytes.TakeText());
      break;
    case 5:
      wellspace::fuzz::ReadMsh(bytes.TakeText());
      break;
    case 6:
      wellspace::fuzz::ReadMedit(bytes.TakeText());
      break;
    case 7:
      wellspace::fuzz::ReadVtk(bytes.TakeText());
      break;
    case 8:
      wellspace::fuzz::ReadVtp(bytes.TakeText());
      break;
    case 9: {
      const uint8_t flags = bytes.Next();
      wellspace::fuzz::DecodeAppended(flags, bytes.TakeText());
      break;
    }
    case 10:
      wellspace::fuzz::ReadAdcirc(bytes.TakeText());
      break;
    case 11:
      wellspace::fuzz::Read2dm(bytes.TakeText());
      break;
    default: {
      size_t length = bytes.Next();
      length += size_t{256} * bytes.Next();
      const std::string_view arrays = bytes.TakeText();
      length = std::min(length, arrays.size());
      wellspace::fuzz::ReadArrays(arrays.substr(0, length), arrays.substr(length));
    }
  }
  return 0;
}
