// Uploads and downloads of sessions, which go on where a connection broke off.
#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/error_details.h"
#include "client/grpc/convert.h"
#include "client/grpc/grpc_connection.h"
#include "client/grpc/mesh_receiver.h"
#include "client/grpc/request_writer.h"
#include "client/grpc/size_messages.h"
#include "core/base/status_macros.h"
#include "proto/checksum.h"

namespace wellspace::client {
namespace {

// One upload of a source, in as many streams as it takes.
class Upload {
 public:
  Upload(PointSource& source, std::optional<uint64_t> offset, const OnPoints& on_points, const CallOptions& call)
      : source_(source), offset_(offset), on_points_(on_points), expected_revision_(call.expected_revision) {}

  // One attempt. `session` is as it was found just now.
  absl::Status Run(v1::SessionService::Stub& stub, const v1::Session& session, Attempt& attempt);

  Uploaded result() const { return {response_.committed_points(), response_.revision()}; }

 private:
  using Stream = RequestWriter<v1::UploadPointsRequest>;

  // Reads the first `count` points of the source, or as many as there are, into a checksum. `*count` becomes how many.
  absl::StatusOr<uint32_t> ReadChecked(uint64_t* count);
  // Sends the rest of the source and half-closes; an error is the source's. Stops early when the call has ended.
  absl::Status Send(Stream& stream, v1::UploadPointsRequest& request);

  PointSource& source_;
  std::optional<uint64_t> offset_;
  const OnPoints& on_points_;
  std::optional<uint64_t> expected_revision_;
  uint64_t committed_ = 0;  // as far as is known
  int attempts_ = 0;
  std::vector<double> rows_;
  v1::UploadPointsResponse response_;
};

absl::StatusOr<uint32_t> Upload::ReadChecked(uint64_t* count) {
  WELLSPACE_RETURN_IF_ERROR(source_.Seek(0));
  const int dimension = source_.dimension();
  const uint64_t wanted = std::exchange(*count, 0);
  rows_.resize(RowsOfARequest(dimension) * dimension);
  uint32_t checksum = 0;
  while (*count < wanted) {
    const uint64_t most = std::min<uint64_t>(rows_.size(), (wanted - *count) * dimension);
    WELLSPACE_ASSIGN_OR_RETURN(const uint64_t read, source_.Read(std::span(rows_).first(most)));
    if (read == 0) {
      break;
    }
    checksum = ExtendCrc32c(checksum, rows_.data(), read * dimension * sizeof(double));
    *count += read;
  }
  return checksum;
}

absl::Status Upload::Send(Stream& stream, v1::UploadPointsRequest& request) {
  // The first message may be without points: it says which session it is.
  if (!stream.Write(request)) {
    return absl::OkStatus();
  }
  const int dimension = source_.dimension();
  rows_.resize(RowsOfARequest(dimension) * dimension);
  while (true) {
    WELLSPACE_ASSIGN_OR_RETURN(const uint64_t read, source_.Read(rows_));
    if (read == 0) {
      break;
    }
    request.mutable_points()->mutable_coordinates()->Assign(rows_.begin(), rows_.begin() + read * dimension);
    if (!stream.Write(request)) {
      return absl::OkStatus();
    }
    request.set_point_offset(request.point_offset() + read);
    if (on_points_ != nullptr) {
      on_points_(request.point_offset() - *offset_);
    }
  }
  stream.WritesDone();
  return absl::OkStatus();
}

absl::Status Upload::Run(v1::SessionService::Stub& stub, const v1::Session& session, Attempt& attempt) {
  if (session.parameters().dimension() != source_.dimension()) {
    return attempt.Final(absl::InvalidArgumentError(absl::StrCat("the points are ", source_.dimension(),
                                                                 "-D; expected ", session.parameters().dimension(),
                                                                 "-D, as the session ", session.name(), " is")));
  }
  if (session.committed_points() > committed_) {
    committed_ = session.committed_points();
    attempt.NoteProgress();
  }
  if (!offset_.has_value()) {
    offset_ = session.committed_points();
  }
  // Points from the offset on have to be of this source: the server compares.
  uint64_t first = std::max(*offset_, session.committed_points()) - *offset_;
  const absl::StatusOr<uint32_t> checked = ReadChecked(&first);
  if (!checked.ok()) {
    return attempt.Final(checked.status());
  }
  v1::UploadPointsRequest request;
  if (first > 0) {
    request.set_checked_from(*offset_);
    request.set_checked_crc32c(*checked);
  }
  request.set_name(session.name());
  request.set_point_offset(*offset_ + first);
  // The commits of the attempts before this one have changed the revision.
  const std::optional<uint64_t> expected = std::exchange(expected_revision_, std::nullopt);
  SetExpectedRevision(expected, request);
  CallContext context(attempt);
  Stream stream(
      [&](grpc::CompletionQueue* queue) { return stub.PrepareAsyncUploadPoints(context.get(), &response_, queue); });
  const absl::Status unreadable = Send(stream, request);
  if (!unreadable.ok()) {
    context.Cancel();
  }
  const absl::Status status = FromGrpcStatus(stream.Finish());
  if (!unreadable.ok()) {
    return attempt.Final(unreadable);
  }
  if (status.ok() && response_.committed_points() < request.point_offset()) {
    return attempt.Final(
        absl::DataLossError(absl::StrCat("the server has ", response_.committed_points(),
                                         " points after points up to number ", request.point_offset(), " were sent")));
  }
  if (!OwnerAddressOf(status).empty()) {
    expected_revision_ = expected;  // a server that has not the session commits nothing
  }
  // The server may not have noticed yet that the last attempt broke off.
  if (attempts_++ > 0 && ReasonOf(status) == "ERROR_REASON_SESSION_BUSY") {
    attempt.SetWorthRepeating();
  }
  return status;
}

// Sends `count` sizes for `session` and half-closes. Stops early when the call has ended; its status says why.
void SendSizes(const std::string& session, const std::optional<uint64_t>& expected_revision, size_t count,
               const FillSizesRequest& fill, RequestWriter<v1::SetSizesRequest>& stream) {
  v1::SetSizesRequest request;
  request.set_name(session);
  SetExpectedRevision(expected_revision, request);
  size_t next = 0;
  do {
    next = fill(next, request);
    if (!stream.Write(request)) {
      return;
    }
  } while (next < count);
  stream.WritesDone();
}

}  // namespace

absl::StatusOr<SizesSet> GrpcConnection::SetSizes(const std::string& session, const SizeSamples& samples,
                                                  const CallOptions& call) {
  const size_t count = samples.sizes.size();
  const auto dimension = static_cast<int>(count == 0 ? 0 : samples.points.size() / count);
  return SendAllSizes(session, count, call, [&](size_t first, v1::SetSizesRequest& request) {
    return FillSizes(samples, dimension, first, *request.mutable_samples());
  });
}

absl::StatusOr<SizesSet> GrpcConnection::SetVertexSizes(const std::string& session, const VertexSizes& sizes,
                                                        const CallOptions& call) {
  return SendAllSizes(session, sizes.sizes.size(), call, [&](size_t first, v1::SetSizesRequest& request) {
    return FillSizes(sizes, first, *request.mutable_vertex_sizes());
  });
}

absl::StatusOr<SizesSet> GrpcConnection::SendAllSizes(const std::string& session, size_t count, const CallOptions& call,
                                                      const FillSizesRequest& fill) {
  v1::SetSizesResponse response;
  const absl::Status status = RunOn(session, call, [&](const Server& server, Attempt& attempt) {
    CallContext context(attempt);
    RequestWriter<v1::SetSizesRequest> stream([&](grpc::CompletionQueue* queue) {
      return server.sessions->PrepareAsyncSetSizes(context.get(), &response, queue);
    });
    // Also after one that may have been taken: the same sizes are no change, whatever the revision is then.
    SendSizes(session, call.expected_revision, count, fill, stream);
    return FromGrpcStatus(stream.Finish());
  });
  if (!status.ok()) {
    return status;
  }
  return SizesSet{.size_count = response.size_count(), .revision = response.revision()};
}

absl::StatusOr<Uploaded> GrpcConnection::UploadPoints(const std::string& session, PointSource& source,
                                                      std::optional<uint64_t> offset, const OnPoints& on_points,
                                                      const CallOptions& call) {
  Upload upload(source, offset, on_points, call);
  const absl::Status status = RunOn(session, call, [&](const Server& server, Attempt& attempt) {
    const absl::StatusOr<v1::Session> found = FetchSession(session, server, attempt);
    return found.ok() ? upload.Run(*server.sessions, *found, attempt) : found.status();
  });
  if (!status.ok()) {
    return status;
  }
  return upload.result();
}

absl::Status GrpcConnection::DownloadMesh(const std::string& session, MeshSink& sink, std::optional<uint64_t> revision,
                                          const OnChunks& on_chunks, const CallOptions& call) {
  v1::DownloadMeshRequest request;
  request.set_with_boundary(sink.WantsBoundary());
  MeshReceiver receiver(sink, {});
  return Download(session, revision, request, receiver, on_chunks, call);
}

absl::Status GrpcConnection::DownloadPart(const std::string& session, const PartOptions& part, MeshSink& sink,
                                          std::optional<uint64_t> revision, const OnChunks& on_chunks,
                                          const CallOptions& call) {
  v1::DownloadMeshRequest request;
  request.set_with_boundary(sink.WantsBoundary());
  request.mutable_partition()->set_parts(part.parts);
  request.mutable_partition()->set_part(part.part);
  request.mutable_partition()->set_ghost_layers(part.ghost_layers);
  request.mutable_partition()->set_contiguous(part.contiguous);
  MeshReceiver receiver(sink, {.part = part});
  return Download(session, revision, request, receiver, on_chunks, call);
}

absl::Status GrpcConnection::Download(const std::string& session, std::optional<uint64_t> revision,
                                      v1::DownloadMeshRequest& request, MeshReceiver& receiver,
                                      const OnChunks& on_chunks, const CallOptions& call) {
  request.set_name(session);
  if (revision.has_value()) {
    request.set_revision(*revision);
  }
  return RunOn(session, call, [&](const Server& server, Attempt& attempt) {
    if (receiver.has_metadata()) {
      request.set_revision(receiver.header().revision);
    }
    request.set_next_chunk(receiver.next_chunk());
    receiver.Continue();
    CallContext context(attempt);
    const std::unique_ptr<grpc::ClientReader<v1::DownloadMeshResponse>> stream =
        server.sessions->DownloadMesh(context.get(), request);
    absl::Status damage;
    v1::DownloadMeshResponse response;
    while (damage.ok() && stream->Read(&response)) {
      if (response.has_metadata()) {
        damage = receiver.SetMetadata(response.metadata());
      } else if (response.has_chunk()) {
        damage = receiver.AddChunk(response.chunk());
        attempt.NoteProgress();
      }
      if (damage.ok() && on_chunks != nullptr) {
        on_chunks(receiver.next_chunk(), receiver.header().chunk_count);
      }
    }
    if (!damage.ok()) {
      context.Cancel();
    }
    const absl::Status status = FromGrpcStatus(stream->Finish());
    if (!damage.ok()) {
      return attempt.Final(damage);
    }
    // A connection that breaks after the last chunk costs nothing.
    return status.ok() || receiver.has_all_chunks() ? attempt.Final(receiver.Finish()) : status;
  });
}

}  // namespace wellspace::client
