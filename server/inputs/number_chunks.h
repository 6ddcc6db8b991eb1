// Numbers as they came, chunk by chunk.
#ifndef WELLSPACE_SERVER_INPUTS_NUMBER_CHUNKS_H_
#define WELLSPACE_SERVER_INPUTS_NUMBER_CHUNKS_H_

#include <cstdint>
#include <deque>
#include <vector>

#include "core/base/run_context.h"
#include "google/protobuf/repeated_field.h"

namespace wellspace::server {

// Coordinates of points, or sizes. Movable.
//
// Thread safety: thread-compatible.
class NumberChunks {
 public:
  // Takes over the contents of `numbers`, without copying but of a few.
  void Append(google::protobuf::RepeatedField<double>* numbers);

  uint64_t count() const { return count_; }
  // Of its numbers, with the room that it keeps for more.
  uint64_t bytes() const { return room_ * sizeof(double) + chunks_.size() * kChunkBytes; }

  // All numbers in order.
  std::vector<double> Copy() const;
  // The same; the chunks are freed as they are copied. Leaves this empty. Of a cancelled run, not all.
  std::vector<double> Flatten(const core::RunContext& context);

 private:
  // Of a chunk without its numbers, as a deque and the heap keep it.
  static constexpr uint64_t kChunkBytes = 64;

  std::deque<google::protobuf::RepeatedField<double>> chunks_;
  uint64_t count_ = 0;
  uint64_t room_ = 0;  // in all chunks, for so many numbers
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_INPUTS_NUMBER_CHUNKS_H_
