// wellspace.v1.SessionService: keeps sessions, takes their points and hands out their meshes.
#ifndef WELLSPACE_SERVER_SERVICES_SESSIONS_SESSION_SERVICE_H_
#define WELLSPACE_SERVER_SERVICES_SESSIONS_SESSION_SERVICE_H_

#include "server/calls/call_environment.h"
#include "wellspace/v1/sessions.grpc.pb.h"

namespace wellspace::server {

// Points are read, and meshes written, as bytes: see ParseRequest and SerializeChunk.
//
// Thread safety: thread-safe.
class SessionService final
    : public v1::SessionService::WithRawCallbackMethod_UploadPoints<
          v1::SessionService::WithRawCallbackMethod_AddSegments<
              v1::SessionService::WithRawCallbackMethod_AddTriangles<v1::SessionService::WithRawCallbackMethod_SetSizes<
                  v1::SessionService::WithRawCallbackMethod_DownloadMesh<v1::SessionService::CallbackService>>>>> {
 public:
  // REQUIRES:   `environment` outlives this.
  explicit SessionService(const CallEnvironment& environment) : environment_(environment) {}

  grpc::ServerUnaryReactor* CreateSession(grpc::CallbackServerContext* context, const v1::CreateSessionRequest* request,
                                          v1::CreateSessionResponse* response) override;
  grpc::ServerUnaryReactor* GetSession(grpc::CallbackServerContext* context, const v1::GetSessionRequest* request,
                                       v1::GetSessionResponse* response) override;
  grpc::ServerUnaryReactor* ListSessions(grpc::CallbackServerContext* context, const v1::ListSessionsRequest* request,
                                         v1::ListSessionsResponse* response) override;
  grpc::ServerUnaryReactor* UpdateSession(grpc::CallbackServerContext* context, const v1::UpdateSessionRequest* request,
                                          v1::UpdateSessionResponse* response) override;
  grpc::ServerUnaryReactor* DeleteSession(grpc::CallbackServerContext* context, const v1::DeleteSessionRequest* request,
                                          v1::DeleteSessionResponse* response) override;
  grpc::ServerReadReactor<grpc::ByteBuffer>* UploadPoints(grpc::CallbackServerContext* context,
                                                          grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* RemovePoints(grpc::CallbackServerContext* context, const v1::RemovePointsRequest* request,
                                         v1::RemovePointsResponse* response) override;
  grpc::ServerReadReactor<grpc::ByteBuffer>* AddSegments(grpc::CallbackServerContext* context,
                                                         grpc::ByteBuffer* response) override;
  grpc::ServerReadReactor<grpc::ByteBuffer>* AddTriangles(grpc::CallbackServerContext* context,
                                                          grpc::ByteBuffer* response) override;
  grpc::ServerReadReactor<grpc::ByteBuffer>* SetSizes(grpc::CallbackServerContext* context,
                                                      grpc::ByteBuffer* response) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* DownloadMesh(grpc::CallbackServerContext* context,
                                                           const grpc::ByteBuffer* request) override;

 private:
  const CallEnvironment& environment_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_SESSIONS_SESSION_SERVICE_H_
