#include "server/services/queries/query_service.h"

#include <memory>

#include "server/services/queries/add_vertices_call.h"
#include "server/services/queries/locate_call.h"
#include "server/services/queries/query_call.h"
#include "server/services/queries/transfer_values_call.h"
#include "server/services/queries/vertex_query.h"

namespace wellspace::server {

grpc::ServerWriteReactor<grpc::ByteBuffer>* QueryService::ApproximateNearestNeighbors(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  return QueryCall::Begin(std::make_shared<QueryCall>(environment_, context, &ParseNearestNeighbors, *request));
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* QueryService::ClippedVoronoiCells(grpc::CallbackServerContext* context,
                                                                              const grpc::ByteBuffer* request) {
  return QueryCall::Begin(std::make_shared<QueryCall>(environment_, context, &ParseClippedCells, *request));
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* QueryService::VoronoiCells(grpc::CallbackServerContext* context,
                                                                       const grpc::ByteBuffer* request) {
  return QueryCall::Begin(std::make_shared<QueryCall>(environment_, context, &ParseCells, *request));
}

grpc::ServerUnaryReactor* QueryService::Locate(grpc::CallbackServerContext* context, const v1::LocateRequest* request,
                                               v1::LocateResponse* response) {
  return LocateCall::Begin(std::make_shared<LocateCall>(environment_, context, request, response));
}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* QueryService::TransferValues(
    grpc::CallbackServerContext* context) {
  return TransferValuesCall::Begin(std::make_shared<TransferValuesCall>(environment_, context));
}

grpc::ServerUnaryReactor* QueryService::AddVertices(grpc::CallbackServerContext* context,
                                                    const v1::AddVerticesRequest* request,
                                                    v1::AddVerticesResponse* response) {
  return AddVerticesCall::Serve(environment_, context, request, response);
}

}  // namespace wellspace::server
