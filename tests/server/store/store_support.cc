#include "tests/server/store/store_support.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "google/rpc/error_details.pb.h"
#include "grpcpp/support/slice.h"
#include "proto/checksum.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {

TestFolder::TestFolder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "wellspace_store_XXXXXX").string();
  path_ = ::mkdtemp(pattern.data());
}

TestFolder::~TestFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

core::Mesh MakeMesh(const MeshShape& shape) {
  core::Mesh mesh;
  const auto dimension = static_cast<uint32_t>(shape.dimension);
  mesh.dimension = shape.dimension;
  mesh.domain_low.assign(dimension, 0.25);
  mesh.domain_high.assign(dimension, 1.75 + shape.salt);
  for (uint32_t i = 0; i < shape.vertices * dimension; ++i) {
    mesh.points.push_back(i / 7.0 + shape.salt);
  }
  for (uint32_t i = 0; i < shape.simplices * (dimension + 1); ++i) {
    mesh.simplices.push_back((i * 7 + shape.salt) % std::max(shape.vertices, 1u));
  }
  for (uint32_t v = 0; v < shape.vertices; ++v) {
    mesh.vertex_origins.push_back(v % 2 == 0 ? v / 2 : core::kSteinerOrigin);
    mesh.vertex_tags.push_back(static_cast<int32_t>((v + shape.salt) % 3));
    if (v % 2 == 0) {
      mesh.input_vertex.push_back(v);
    }
    if (shape.has_weights) {
      mesh.weights.push_back(v / 16.0);
    }
    if (shape.has_moved && (v % 3 == 1 || v > shape.vertices / 2)) {
      mesh.moved_vertices.push_back(v);
    }
    for (uint32_t i = 0; i < dimension; ++i) {
      mesh.facets.push_back((v + i) % shape.vertices);
    }
  }
  mesh.boundary = {{.tag = 1, .name = "xmin", .facets = shape.vertices}};
  mesh.regions = {{.id = 1, .name = "domain"}};
  if (shape.has_regions) {
    mesh.regions.push_back({.id = 7, .name = "region_7"});
    for (uint32_t i = 0; i < shape.simplices; ++i) {
      mesh.simplex_regions.push_back(i % 2 == 0 ? 1 : 7);
    }
  }
  mesh.statistics.vertices = mesh.vertex_count();
  mesh.statistics.simplices = mesh.simplex_count();
  mesh.statistics.max_radius_edge = 1.5 + shape.salt;
  mesh.statistics.min_angle_deg = 17.25;
  mesh.statistics.cuts = 42;
  return mesh;
}

std::string BytesOf(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  if (!buffer.Dump(&slices).ok()) {
    return "no bytes";
  }
  std::string bytes;
  for (const grpc::Slice& slice : slices) {
    bytes.append(slice.begin(), slice.end());
  }
  return bytes;
}

absl::StatusOr<std::string> DownloadOf(const MeshSnapshot& mesh, bool with_boundary) {
  WELLSPACE_ASSIGN_OR_RETURN(const v1::MeshMetadata metadata, mesh.Metadata(with_boundary));
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t count, mesh.ChunkCount(with_boundary));
  std::string all = metadata.SerializeAsString();
  for (uint64_t index = 0; index < count; ++index) {
    WELLSPACE_ASSIGN_OR_RETURN(const grpc::ByteBuffer chunk, mesh.SerializeChunk(index, 2, with_boundary));
    all += BytesOf(chunk);
  }
  return all;
}

absl::Status CommitTo(SessionLog& log, SessionChange change, Survives survives) {
  change.epoch = log.records().epoch();
  WELLSPACE_ASSIGN_OR_RETURN(const auto there, log.records().ReadRecord(change.session));
  change.is_creation = change.state.has_value() && !there.has_value();
  return log.Commit(change, survives);
}

std::string SessionName(uint64_t number) { return absl::StrCat("sessions/", absl::Hex(number, absl::kZeroPad8)); }

store::v1::SessionRecord MakeState(uint64_t number, uint64_t revision) {
  store::v1::SessionRecord state;
  state.set_name(SessionName(number));
  state.set_tenant(absl::StrCat("tenant ", number % 3));
  state.set_create_time_ns(static_cast<int64_t>(1'700'000'000'000'000'000 + number));
  state.mutable_parameters()->set_dimension(3);
  (*state.mutable_labels())["number"] = absl::StrCat(number);
  state.set_ttl_ns(3'600'000'000'000);
  state.set_revision(revision);
  state.set_next_operation(1000);
  return state;
}

store::v1::StepRecord MakePointsStep(uint64_t first, const std::vector<double>& coordinates, int dimension) {
  store::v1::StepRecord step;
  step.mutable_points()->set_first(first);
  step.mutable_points()->set_count(coordinates.size() / dimension);
  step.mutable_points()->set_crc32c(Crc32c(coordinates.data(), coordinates.size() * sizeof(double)));
  return step;
}

store::v1::AnswerRecord MakeAnswer(const std::string& tenant, const std::string& request_id,
                                   const std::string& response) {
  store::v1::AnswerRecord answer;
  answer.set_tenant(tenant);
  answer.set_request_id(request_id);
  answer.set_content("hash of " + response);
  answer.set_response(response);
  answer.set_time_ns(1'700'000'000'000'000'000);
  return answer;
}

std::string TextOf(const StoredSessions& stored) {
  std::string text;
  for (const StoredSession& session : stored.sessions) {
    absl::StrAppend(&text, "session ", session.state.ShortDebugString(), "\n");
    for (const store::v1::StepRecord& step : session.steps) {
      absl::StrAppend(&text, "  step ", step.ShortDebugString(), "\n");
    }
    for (const store::v1::OperationRecord& operation : session.operations) {
      absl::StrAppend(&text, "  operation ", operation.ShortDebugString(), "\n");
    }
  }
  std::vector<std::string> answers;
  for (const store::v1::AnswerRecord& answer : stored.answers) {
    answers.push_back(absl::StrCat("answer ", answer.ShortDebugString(), "\n"));
  }
  std::ranges::sort(answers);
  for (const std::string& answer : answers) {
    text += answer;
  }
  return text;
}

std::string TextOf(const SessionState& state) {
  std::string text = absl::StrCat(state.record.DebugString(), "sizes at ", state.sizes_revision, " structure ",
                                  state.structure_version, "\n", state.is_deleted ? "deleted\n" : "");
  for (const SessionStep& step : state.steps.all()) {
    absl::StrAppend(&text, "step ", step.uploads_end, " ", step.end, " sizes ", step.sizes.number, " ",
                    step.sizes.count, " ",
                    step.refined_with == nullptr ? "" : ParametersToProto(*step.refined_with).DebugString(), "\n");
  }
  for (const std::shared_ptr<const store::v1::OperationRecord>& operation : state.operations) {
    absl::StrAppend(&text, operation->DebugString());
  }
  return text;
}

std::string BytesOfFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

void WriteFile(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

void FlipBit(const std::string& path, uint64_t byte, int bit) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekg(static_cast<std::streamoff>(byte));
  const auto flipped = static_cast<char>(file.get() ^ (1 << bit));
  file.seekp(static_cast<std::streamoff>(byte));
  file.put(flipped);
}

std::string ReasonOf(const absl::Status& status) {
  if (status.ok()) {
    return "OK";
  }
  const google::rpc::Status message = StatusToProto(status);
  google::rpc::ErrorInfo info;
  for (const google::protobuf::Any& detail : message.details()) {
    if (detail.UnpackTo(&info)) {
      return info.reason().substr(std::string("ERROR_REASON_").size());
    }
  }
  return absl::StatusCodeToString(status.code());
}

}  // namespace wellspace::server
