// The messages of gRPC's own log, as lines of our log.
#ifndef WELLSPACE_SERVER_LOG_GRPC_LOG_H_
#define WELLSPACE_SERVER_LOG_GRPC_LOG_H_

#include <memory>

#include "spdlog/logger.h"

namespace wellspace::server {

// While it lives, gRPC writes nothing to standard error by itself, where its lines would not be JSON and a pipe that
// nothing reads would stop its threads.
//
// Its lines have event=grpc, file and message; which of them come is for GRPC_VERBOSITY to say, as without this class.
// Of a handshake of TLS that failed there is one line event=handshake_failed instead, always, with the reason and, if
// gRPC tells it, the peer.
//
// Thread safety: one at a time in the process; gRPC's threads may log before, meanwhile and later.
class GrpcLog {
 public:
  explicit GrpcLog(std::shared_ptr<spdlog::logger> log);
  ~GrpcLog();
  GrpcLog(const GrpcLog&) = delete;
  GrpcLog& operator=(const GrpcLog&) = delete;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_LOG_GRPC_LOG_H_
