#include "server/inputs/number_chunks.h"

#include <malloc.h>

namespace wellspace::server {
namespace {

// Fewer numbers than these are copied behind others: clients may send them one by one, and a chunk has more than that.
constexpr int kFew = 1024;

// The heap keeps the pages of chunks that are freed, and is asked for them after so many bytes: each time it looks
// through all that it has.
constexpr uint64_t kTrimBytes = uint64_t{16} << 20;

}  // namespace

void NumberChunks::Append(google::protobuf::RepeatedField<double>* numbers) {
  const int count = numbers->size();
  if (count == 0) {
    return;  // endless empty chunks must not cost memory
  }
  if (count >= kFew) {
    chunks_.emplace_back().Swap(numbers);
    room_ += chunks_.back().Capacity();
  } else {
    if (chunks_.empty() || chunks_.back().Capacity() - chunks_.back().size() < count) {
      chunks_.emplace_back().Reserve(kFew);
      room_ += chunks_.back().Capacity();
    }
    chunks_.back().MergeFrom(*numbers);
  }
  count_ += count;
}

std::vector<double> NumberChunks::Copy() const {
  std::vector<double> numbers;
  numbers.reserve(count_);
  for (const google::protobuf::RepeatedField<double>& chunk : chunks_) {
    numbers.insert(numbers.end(), chunk.begin(), chunk.end());
  }
  return numbers;
}

std::vector<double> NumberChunks::Flatten(const core::RunContext& context) {
  std::vector<double> numbers;
  numbers.reserve(count_);
  uint64_t freed = 0;
  while (!chunks_.empty() && !context.IsCancelled()) {
    numbers.insert(numbers.end(), chunks_.front().begin(), chunks_.front().end());
    freed += chunks_.front().Capacity() * sizeof(double);
    chunks_.pop_front();
    if (freed >= kTrimBytes) {
      malloc_trim(0);
      freed = 0;
    }
  }
  chunks_.clear();
  count_ = 0;
  room_ = 0;
  return numbers;
}

}  // namespace wellspace::server
