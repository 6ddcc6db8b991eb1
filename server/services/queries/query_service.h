// wellspace.v1.QueryService: asks about vertices of sessions, and adds some.
#ifndef WELLSPACE_SERVER_SERVICES_QUERIES_QUERY_SERVICE_H_
#define WELLSPACE_SERVER_SERVICES_QUERIES_QUERY_SERVICE_H_

#include "server/calls/call_environment.h"
#include "wellspace/v1/queries.grpc.pb.h"

namespace wellspace::server {

// Queries and values are read and written as bytes, which the workers make.
using QueryServiceBase = v1::QueryService::WithRawCallbackMethod_ApproximateNearestNeighbors<
    v1::QueryService::WithRawCallbackMethod_ClippedVoronoiCells<v1::QueryService::WithRawCallbackMethod_VoronoiCells<
        v1::QueryService::WithRawCallbackMethod_TransferValues<v1::QueryService::WithCallbackMethod_Locate<
            v1::QueryService::WithCallbackMethod_AddVertices<v1::QueryService::Service>>>>>>;

// Thread safety: thread-safe.
class QueryService final : public QueryServiceBase {
 public:
  // REQUIRES:   `environment` outlives this.
  explicit QueryService(const CallEnvironment& environment) : environment_(environment) {}

  grpc::ServerWriteReactor<grpc::ByteBuffer>* ApproximateNearestNeighbors(grpc::CallbackServerContext* context,
                                                                          const grpc::ByteBuffer* request) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* ClippedVoronoiCells(grpc::CallbackServerContext* context,
                                                                  const grpc::ByteBuffer* request) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* VoronoiCells(grpc::CallbackServerContext* context,
                                                           const grpc::ByteBuffer* request) override;
  grpc::ServerUnaryReactor* Locate(grpc::CallbackServerContext* context, const v1::LocateRequest* request,
                                   v1::LocateResponse* response) override;
  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* TransferValues(
      grpc::CallbackServerContext* context) override;
  grpc::ServerUnaryReactor* AddVertices(grpc::CallbackServerContext* context, const v1::AddVerticesRequest* request,
                                        v1::AddVerticesResponse* response) override;

 private:
  const CallEnvironment& environment_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SERVICES_QUERIES_QUERY_SERVICE_H_
