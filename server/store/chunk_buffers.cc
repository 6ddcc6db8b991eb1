#include "server/store/chunk_buffers.h"

#include <algorithm>
#include <utility>

#include "server/base/options.h"

namespace wellspace::server {
namespace {

constexpr size_t kMostFree = 8;

// Chunks are of this size, nearly all of them.
constexpr uint64_t kBufferBytes = kMaxResponseBytes;

}  // namespace

struct ChunkBuffers::Held {
  std::shared_ptr<ChunkBuffers> buffers;
  Buffer buffer;
};

ChunkBuffers::Buffer ChunkBuffers::Take(uint64_t size) {
  if (size > kBufferBytes / 2 && size <= kBufferBytes) {
    size = kBufferBytes;
    const std::lock_guard lock(mutex_);
    if (!free_.empty()) {
      Buffer buffer = std::move(free_.back());
      free_.pop_back();
      return buffer;
    }
  }
  return {.bytes = std::unique_ptr<char[]>(new char[size]), .size = size};  // as it is: it is read into
}

grpc::Slice ChunkBuffers::MakeSlice(Buffer buffer, uint64_t size) {
  char* bytes = buffer.bytes.get();
  return grpc::Slice(
      bytes, size,
      [](void* data) {
        const std::unique_ptr<Held> held(static_cast<Held*>(data));
        held->buffers->GiveBack(std::move(held->buffer));
      },
      new Held{shared_from_this(), std::move(buffer)});
}

void ChunkBuffers::GiveBack(Buffer buffer) {
  const std::lock_guard lock(mutex_);
  if (buffer.size == kBufferBytes && free_.size() < kMostFree) {
    free_.push_back(std::move(buffer));
  }
}

}  // namespace wellspace::server
