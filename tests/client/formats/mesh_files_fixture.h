// A fixture for tests of files of meshes: it writes them, reads good and bad ones, and cuts them off.
#ifndef WELLSPACE_TESTS_CLIENT_FORMATS_MESH_FILES_FIXTURE_H_
#define WELLSPACE_TESTS_CLIENT_FORMATS_MESH_FILES_FIXTURE_H_

#include <gtest/gtest.h>

#include <string>

#include "client/formats/read_mesh.h"
#include "client/formats/write_mesh.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::formats {

class MeshFilesFixture : public testing::Test {
 protected:
  void Write(const Mesh& mesh, const std::string& name, const std::string& format = "") {
    const absl::Status written = WriteMesh(folder_.Path(name), format, mesh.View());
    ASSERT_TRUE(written.ok()) << written;
  }

  Mesh ReadGood(const std::string& name) {
    const absl::StatusOr<Mesh> mesh = ReadMesh(folder_.Path(name));
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return mesh.ok() ? *mesh : Mesh{};
  }

  // The message of the refusal of a file.
  std::string ReadBad(const std::string& name) {
    const absl::StatusOr<Mesh> mesh = ReadMesh(folder_.Path(name));
    EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument) << mesh.status();
    return std::string(mesh.status().message());
  }

  // The same of a file in which `to` takes the place of `from`.
  std::string ReadBadWith(const std::string& name, const std::string& from, const std::string& to) {
    std::string text = folder_.Read(name);
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    folder_.Write(name, text.replace(at, from.size(), to));
    return ReadBad(name);
  }

  // A file of `mesh` cut anywhere is refused, or has lost only data behind the mesh.
  void ExpectCutAnywhereIsNoTrouble(const Mesh& mesh, const std::string& name, const std::string& format) {
    Write(mesh, name, format);
    const std::string good = folder_.Read(name);
    for (size_t size = 0; size < good.size(); ++size) {
      folder_.Write(name, good.substr(0, size));
      const absl::StatusOr<Mesh> read = ReadMesh(folder_.Path(name));
      EXPECT_TRUE(read.ok() || absl::IsInvalidArgument(read.status())) << size << read.status();
    }
  }

  TemporaryFolder folder_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_TESTS_CLIENT_FORMATS_MESH_FILES_FIXTURE_H_
