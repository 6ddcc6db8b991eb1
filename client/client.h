// The C++ client library: meshes and sessions of a wellspaced server, near or far.
//
// examples/session.cc is a whole program.
#ifndef WELLSPACE_CLIENT_CLIENT_H_
#define WELLSPACE_CLIENT_CLIENT_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/call_options.h"
#include "client/connect_options.h"
#include "client/error_details.h"
#include "client/mesh_sink.h"
#include "client/point_source.h"
#include "client/types.h"

namespace wellspace::client {

class Connection;

using OnProgress = std::function<void(const Progress&)>;
// `done` of `total` chunks of a download have arrived.
using OnChunks = std::function<void(uint64_t done, uint64_t total)>;
// So many points of an upload are on their way or with the server.
using OnPoints = std::function<void(uint64_t points)>;
// Takes a batch of an answer; an error ends the call with it.
using OnDistances = std::function<absl::Status(std::span<const double>)>;
using OnCells = std::function<absl::Status(const CellBatch&)>;
// The vertices that the next points of an addition have become, and the revision that this has made.
using OnAdded = std::function<void(const AddedVertices&)>;

// A thin face over a Connection, which has the deadlines, repeats calls after a broken connection, and goes on
// with uploads, watches and downloads where they were.
//
// Callbacks may be empty; they are called by the thread that made the call, while it waits.
//
// Errors of all calls: the server's, unchanged; CANCELLED when `call.stop` asks for it; DEADLINE_EXCEEDED when
// `call.timeout` has passed; UNAVAILABLE when the server cannot be reached, after patient attempts; DATA_LOSS when its
// answer contradicts itself; errors of sinks, sources and callbacks. BlamedField and ReasonOf tell more.
//
// Thread safety: thread-safe.
class Client {
 public:
  explicit Client(std::shared_ptr<Connection> connection) : connection_(std::move(connection)) {}

  // Meshes `points` (n x dimension, row-major).
  absl::StatusOr<Mesh> MeshPoints(const MeshOptions& options, std::span<const double> points,
                                  const OnProgress& on_progress = nullptr, const CallOptions& call = {});
  // As above, into a sink, for meshes that need not fit into memory.
  absl::Status MeshPoints(const MeshOptions& options, std::span<const double> points, MeshSink& sink,
                          const OnProgress& on_progress = nullptr, const CallOptions& call = {});

  // Estimates the mesh that MeshPoints would make of the same arguments.
  absl::StatusOr<MeshEstimate> EstimateMesh(const MeshOptions& options, std::span<const double> points,
                                            const CallOptions& call = {});

  absl::StatusOr<ServerInfo> GetServerInfo(const CallOptions& call = {});
  // `service` empty: of the whole server. NOT_FOUND for a service that the server does not know.
  absl::StatusOr<Health> CheckHealth(const std::string& service = "", const CallOptions& call = {});

  // Sessions; see the proto's SessionService. `session` is a name, "sessions/{session}".
  absl::StatusOr<Session> CreateSession(const SessionOptions& options, const CallOptions& call = {});
  absl::StatusOr<Session> GetSession(const std::string& session, const CallOptions& call = {});
  // The sessions that have all of `labels`, a page at a time.
  absl::StatusOr<SessionPage> ListSessions(const Labels& labels = {}, const PageOptions& page = {},
                                           const CallOptions& call = {});
  absl::StatusOr<Session> UpdateSession(const std::string& session, const SessionUpdate& change,
                                        const CallOptions& call = {});
  absl::Status DeleteSession(const std::string& session, const CallOptions& call = {});

  // Adds the points of `source` to a session. `offset` is the number of the session's points before the first of them:
  // points there from it on are not sent again, so that an upload that broke off is simply repeated with the same
  // offset. It has to be of the same source: the server compares a checksum, and FAILED_PRECONDITION (UPLOAD_MISMATCH)
  // ends the call if it is not. Absent: after the points that are there when the call begins. A session takes one
  // upload at a time: FAILED_PRECONDITION (SESSION_BUSY). `call.expected_revision` is that before the call.
  absl::StatusOr<Uploaded> UploadPoints(const std::string& session, PointSource& source,
                                        std::optional<uint64_t> offset = std::nullopt,
                                        const OnPoints& on_points = nullptr, const CallOptions& call = {});

  // Takes the points with these numbers out of a session. The points behind move down, and the next refinement makes
  // the mesh anew of the points left; see the proto. At most some 10^5 numbers, as many as one request has room for.
  absl::StatusOr<PointsLeft> RemovePoints(const std::string& session, std::span<const uint64_t> points,
                                          const CallOptions& call = {});

  // Adds segments and seeds to a session in 2-D, and sets the rules of its faces, before its first refinement:
  // FAILED_PRECONDITION (DOMAIN_FIXED). Ends are numbers of the session's points, which may come later. `offset`: what
  // the session has before the first of these. Where it has some from there on, they have to be the same and are not
  // added again, so that a call that broke off is simply repeated with the same offset. Absent: after those that are
  // there when the call begins. `call.expected_revision` is that before the call.
  absl::StatusOr<AddedSegments> AddSegments(const std::string& session, const Features& features,
                                            const std::optional<FeatureOffset>& offset = std::nullopt,
                                            const CallOptions& call = {});

  // The same of triangles and solids, for a session in 3-D.
  absl::StatusOr<AddedTriangles> AddTriangles(const std::string& session, const SurfaceFeatures& surface,
                                              const std::optional<SurfaceOffset>& offset = std::nullopt,
                                              const CallOptions& call = {});

  // Replaces the sizes at points that the next refinements of a session keep to; without any, it has none from then on.
  // They are taken together, so that a call that broke off is simply repeated.
  absl::StatusOr<SizesSet> SetSizes(const std::string& session, const SizeSamples& samples,
                                    const CallOptions& call = {});
  // As SetSizes, with one size for each vertex of the session's mesh, in their order.
  absl::StatusOr<SizesSet> SetVertexSizes(const std::string& session, const VertexSizes& sizes,
                                          const CallOptions& call = {});

  // Streams the mesh of a session into `sink`: that of `revision`, or the last one. A broken connection costs nothing
  // but time.
  absl::Status DownloadMesh(const std::string& session, MeshSink& sink, std::optional<uint64_t> revision = std::nullopt,
                            const OnChunks& on_chunks = nullptr, const CallOptions& call = {});

  // As DownloadMesh, one part of the mesh, for a solver on many ranks of which each asks for its own. The server cuts
  // the mesh once for all that ask for as many parts; the same mesh and numbers always give the same parts. Ranks that
  // are to have parts of one mesh ask for its `revision`. A MeshCollector has Mesh::part then; what is told of the
  // run, as MeshHeader::statistics, is of the whole mesh.
  absl::Status DownloadPart(const std::string& session, const PartOptions& part, MeshSink& sink,
                            std::optional<uint64_t> revision = std::nullopt, const OnChunks& on_chunks = nullptr,
                            const CallOptions& call = {});

  // Brings `mesh`, which a MeshCollector has got of the session, up to date: the differences since `mesh.revision` are
  // downloaded and applied, and its checksum looked at. Where the server does not have these differences, or `mesh` is
  // not what it was, all is downloaded. Then `mesh` is, to the bit, what DownloadMesh would bring. On an error it is as
  // it was, or as the session had it in between.
  absl::Status UpdateMesh(const std::string& session, Mesh& mesh, const OnChunks& on_chunks = nullptr,
                          const CallOptions& call = {});

  // Operations; see the proto's OperationService. `operation` is a name, "sessions/{session}/operations/{operation}".
  absl::StatusOr<Operation> StartRefinement(const std::string& session, const RefinementOptions& refinement = {},
                                            const CallOptions& call = {});
  absl::StatusOr<Operation> GetOperation(const std::string& operation, const CallOptions& call = {});
  absl::StatusOr<OperationPage> ListOperations(const std::string& session, const PageOptions& page = {},
                                               const CallOptions& call = {});
  absl::StatusOr<Operation> CancelOperation(const std::string& operation, const CallOptions& call = {});
  // Waits until an operation ends, and returns it: its error is in it, not in the call's status. Events up to
  // `after_sequence` are not told again. Giving up the watch leaves the operation alone.
  absl::StatusOr<Operation> WatchOperation(const std::string& operation, const OnProgress& on_progress = nullptr,
                                           std::optional<uint64_t> after_sequence = std::nullopt,
                                           const CallOptions& call = {});

  // Administration; see the proto's AdminService. Ends with PERMISSION_DENIED (ADMIN_ONLY) without an admin's token.
  absl::StatusOr<OwnedOperationPage> ListAllOperations(const OperationFilter& filter = {}, const PageOptions& page = {},
                                                       const CallOptions& call = {});
  absl::StatusOr<Operation> CancelAnyOperation(const std::string& operation, const CallOptions& call = {});
  // Returns the time that running work has from now on.
  absl::StatusOr<absl::Duration> DrainServer(const CallOptions& call = {});
  absl::StatusOr<UsagePage> GetUsage(const UsageFilter& filter = {}, const PageOptions& page = {},
                                     const CallOptions& call = {});

  // The query structure; see the proto's QueryService. Answers come in the order of `vertices`; empty: of all vertices.
  absl::Status ApproximateNearestNeighbors(const std::string& session, std::span<const uint32_t> vertices,
                                           const OnDistances& on_distances, const CallOptions& call = {});
  absl::Status ClippedVoronoiCells(const std::string& session, std::span<const uint32_t> vertices, double beta,
                                   const OnCells& on_cells, const CallOptions& call = {});
  absl::Status VoronoiCells(const std::string& session, std::span<const uint32_t> vertices, const OnCells& on_cells,
                            const CallOptions& call = {});
  // Where `points`, k x dimension, row-major, lie in the session's mesh, in calls of some 10^4 points each, all about
  // the same mesh: the last one, or an earlier one that is kept, see TransferValues. ABORTED (REVISION_MISMATCH) if it
  // is neither.
  absl::StatusOr<Located> Locate(const std::string& session, std::span<const double> points,
                                 const LocateOptions& options = {}, const CallOptions& call = {});
  // Carries the `values` of a field from an earlier mesh of the session to the last one. The server keeps the mesh
  // before the last one that was downloaded last, while its memory allows it. FAILED_PRECONDITION (MESH_NOT_KEPT) if it
  // is another; INVALID_ARGUMENT naming a value that is not finite.
  absl::StatusOr<TransferredValues> TransferValues(const std::string& session, std::span<const double> values,
                                                   const TransferOptions& options, const CallOptions& call = {});
  // Adds vertices at `points`, k x dimension, row-major. `near`: a vertex near each, or empty. They are sent in
  // requests with at most 3 MiB of them, 10^5 points in 3-D: the points of each become vertices all or none, and each
  // makes a revision, of which the last is returned. `call.expected_revision` is that before the call; a change in
  // between is ABORTED. On an error vertices of the requests before stay: `on_added` was told of it, and the
  // message says how many points it is. A repetition of the call is safe: each request carries a request_id, and later
  // a point that is a vertex already is given its number.
  absl::StatusOr<AddedVertices> AddVertices(const std::string& session, std::span<const double> points,
                                            std::span<const uint32_t> near = {}, const OnAdded& on_added = nullptr,
                                            const CallOptions& call = {});

 private:
  std::shared_ptr<Connection> connection_;
};

// Connects to HOST:PORT. Lazy: errors of the connection show in the first call.
//
// Errors:     INVALID_ARGUMENT: the address; options that contradict each other; a file without the contents it should
//             have. FAILED_PRECONDITION: the token would leave this machine in plain text. NOT_FOUND: a file cannot be
//             read.
absl::StatusOr<Client> Connect(const std::string& address, const ConnectOptions& options = {});

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_CLIENT_H_
