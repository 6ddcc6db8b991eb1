// Meshes that are brought up to date: by the changes where the server knows them, as a whole where it does not.
#include <memory>
#include <optional>
#include <utility>

#include "client/error_details.h"
#include "client/grpc/convert.h"
#include "client/grpc/delta_receiver.h"
#include "client/grpc/grpc_connection.h"
#include "client/grpc/mesh_receiver.h"
#include "core/base/status_macros.h"

namespace wellspace::client {
namespace {

constexpr char kNotKept[] = "ERROR_REASON_DELTA_NOT_KEPT";

// One update, in as many streams as it takes.
class Update {
 public:
  Update(const std::string& session, Mesh& mesh, const OnChunks& on_chunks)
      : session_(session), mesh_(mesh), on_chunks_(on_chunks), is_whole_(mesh.revision == 0) {}

  // One attempt: a stream, or two where differences are of no use.
  absl::Status Run(v1::SessionService::Stub& stub, Attempt& attempt) {
    if (!is_whole_) {
      const absl::Status status = Stream(stub, attempt);
      if (status.ok() || !is_whole_ || attempt.is_final()) {
        return status;
      }
    }
    return Stream(stub, attempt);
  }

 private:
  v1::DownloadMeshRequest NextRequest() const {
    v1::DownloadMeshRequest request;
    request.set_name(session_);
    request.set_with_boundary(true);
    if (is_whole_) {
      if (whole_.has_metadata()) {
        request.set_revision(whole_.header().revision);
      }
      request.set_next_chunk(whole_.next_chunk());
    } else {
      request.set_since_revision(mesh_.revision);
      if (deltas_.revision() != 0) {
        request.set_revision(deltas_.revision());
      }
      request.set_next_chunk(deltas_.next_part());
    }
    return request;
  }

  absl::Status Take(const v1::DownloadMeshResponse& response) {
    if (response.has_metadata()) {
      // A server that is too old for differences sends all.
      is_whole_ = is_whole_ || !response.metadata().has_delta();
      return is_whole_ ? whole_.SetMetadata(response.metadata()) : deltas_.SetMetadata(response.metadata());
    }
    if (response.has_chunk()) {
      return whole_.AddChunk(response.chunk());
    }
    return response.has_delta() ? deltas_.AddPart(response.delta()) : absl::OkStatus();
  }

  void Tell() const {
    if (on_chunks_ != nullptr) {
      is_whole_ ? on_chunks_(whole_.next_chunk(), whole_.header().chunk_count)
                : on_chunks_(deltas_.next_part(), deltas_.part_count());
    }
  }

  // The status for the attempt whose stream has ended with `status`. Differences that are of no use make the
  // update one of the whole mesh.
  absl::Status EndOf(absl::Status status, const absl::Status& damage, bool was_whole, Attempt& attempt) {
    if (was_whole || (is_whole_ && damage.ok() && whole_.has_metadata())) {
      if (!damage.ok()) {
        return attempt.Final(damage);
      }
      if (!status.ok() && !whole_.has_all_chunks()) {
        return status;
      }
      WELLSPACE_RETURN_IF_ERROR(attempt.Final(whole_.Finish()));
      mesh_ = std::move(collector_.mesh());
      return attempt.Final(absl::OkStatus());
    }
    if (!damage.ok()) {
      is_whole_ = true;
      return damage;
    }
    if (status.ok() && !deltas_.IsWhole()) {
      return attempt.Final(absl::DataLossError("the server's answer is damaged: parts of a difference are missing"));
    }
    is_whole_ = ReasonOf(status) == kNotKept;
    return status;
  }

  absl::Status Stream(v1::SessionService::Stub& stub, Attempt& attempt) {
    const bool was_whole = is_whole_;
    whole_.Continue();
    deltas_.Continue();
    CallContext context(attempt);
    const std::unique_ptr<grpc::ClientReader<v1::DownloadMeshResponse>> stream =
        stub.DownloadMesh(context.get(), NextRequest());
    absl::Status damage;
    v1::DownloadMeshResponse response;
    while (damage.ok() && stream->Read(&response)) {
      damage = Take(response);
      if (damage.ok()) {
        if (!response.has_metadata()) {
          attempt.NoteProgress();
        }
        Tell();
      }
    }
    if (!damage.ok()) {
      context.Cancel();
    }
    absl::Status status = FromGrpcStatus(stream->Finish());
    return EndOf(std::move(status), damage, was_whole, attempt);
  }

  const std::string& session_;
  Mesh& mesh_;
  const OnChunks& on_chunks_;
  bool is_whole_;  // the whole mesh is downloaded
  MeshCollector collector_;
  MeshReceiver whole_{collector_, {.dimension = std::nullopt, .input_points = std::nullopt}};
  DeltaReceiver deltas_{mesh_};
};

}  // namespace

absl::Status GrpcConnection::UpdateMesh(const std::string& session, Mesh& mesh, const OnChunks& on_chunks,
                                        const CallOptions& call) {
  Update update(session, mesh, on_chunks);
  return RunOn(session, call,
               [&](const Server& server, Attempt& attempt) { return update.Run(*server.sessions, attempt); });
}

}  // namespace wellspace::client
