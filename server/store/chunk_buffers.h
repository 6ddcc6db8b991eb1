// Buffers for chunks that are read from files.
#ifndef WELLSPACE_SERVER_STORE_CHUNK_BUFFERS_H_
#define WELLSPACE_SERVER_STORE_CHUNK_BUFFERS_H_

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "grpcpp/support/slice.h"

namespace wellspace::server {

// Keeps a few buffers for the next chunks: new memory of 1 MiB costs 256 faults of pages, as much time as the reading.
//
// Thread safety: thread-safe.
class ChunkBuffers : public std::enable_shared_from_this<ChunkBuffers> {
 public:
  // Memory of `size` bytes. It comes back when its slice ends.
  struct Buffer {
    std::unique_ptr<char[]> bytes;
    uint64_t size = 0;
  };
  Buffer Take(uint64_t size);

  // A slice of the first `size` bytes.
  grpc::Slice MakeSlice(Buffer buffer, uint64_t size);

 private:
  struct Held;

  void GiveBack(Buffer buffer);

  std::mutex mutex_;
  std::vector<Buffer> free_;  // guarded by mutex_
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_CHUNK_BUFFERS_H_
