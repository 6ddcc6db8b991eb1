// Helpers of the tests of the store: folders that go away, records and meshes to write down, and their text.
#ifndef WELLSPACE_TESTS_SERVER_STORE_STORE_SUPPORT_H_
#define WELLSPACE_TESTS_SERVER_STORE_STORE_SUPPORT_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/mesh/mesh.h"
#include "grpcpp/support/byte_buffer.h"
#include "server/sessions/session_state.h"
#include "server/store/file_system.h"
#include "server/store/session_log.h"

namespace wellspace::server {

// A folder for one test.
class TestFolder {
 public:
  TestFolder();
  ~TestFolder();
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// No mesh, but arrays as a mesh has them, each number another.
struct MeshShape {
  int dimension = 3;
  uint32_t vertices = 10;
  uint32_t simplices = 20;
  bool has_weights = false;
  bool has_moved = false;
  bool has_regions = false;
  uint32_t salt = 0;  // other numbers
};
core::Mesh MakeMesh(const MeshShape& shape);

std::string BytesOf(const grpc::ByteBuffer& buffer);

// All that a download of the mesh brings, or the error.
absl::StatusOr<std::string> DownloadOf(const MeshSnapshot& mesh, bool with_boundary);

// Commits `change` as the owner that has opened `log`; a session that is not there yet is created.
absl::Status CommitTo(SessionLog& log, SessionChange change, Survives survives = Survives::kPowerLoss);

// "sessions/" and the number, in hexadecimal.
std::string SessionName(uint64_t number);
store::v1::SessionRecord MakeState(uint64_t number, uint64_t revision = 0);
store::v1::StepRecord MakePointsStep(uint64_t first, const std::vector<double>& coordinates, int dimension);
store::v1::AnswerRecord MakeAnswer(const std::string& tenant, const std::string& request_id,
                                   const std::string& response);

// All of it, so that two are the same if and only if their texts are.
std::string TextOf(const StoredSessions& stored);
std::string TextOf(const SessionState& state);

// Whatever of the file is there.
std::string BytesOfFile(const std::string& path);
void WriteFile(const std::string& path, const std::string& bytes);
void FlipBit(const std::string& path, uint64_t byte, int bit);

// The name of its reason without ERROR_REASON_, or of its code.
std::string ReasonOf(const absl::Status& status);

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_STORE_STORE_SUPPORT_H_
