#include "client/formats/io/gzip_inflater.h"

#include <zlib.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kInputBytes = 1 << 16;

// No cloud of distinct points is written in so few bits: beyond this the file is meant to fill the memory, or damaged.
constexpr uint64_t kMaxRatio = 500;
constexpr uint64_t kFreeBytes = uint64_t{64} << 20;

// 15 bits of window; 16 more ask for gzip's header.
constexpr int kWindowBits = 15 + 16;

}  // namespace

struct GzipInflater::Stream {
  z_stream z{};
  std::vector<char> input = std::vector<char>(kInputBytes);
  bool in_member = true;
  bool is_first = true;  // the member
  bool at_end = false;   // of the source
};

GzipInflater::GzipInflater(std::string name) : name_(std::move(name)), stream_(std::make_unique<Stream>()) {
  if (inflateInit2(&stream_->z, kWindowBits) != Z_OK) {
    std::abort();  // only without memory
  }
}

GzipInflater::~GzipInflater() { inflateEnd(&stream_->z); }

absl::Status GzipInflater::Error(std::string_view message) const {
  return absl::InvalidArgumentError(absl::StrCat(name_, ": ", absl::string_view(message.data(), message.size()),
                                                 ", after ", taken_ - stream_->z.avail_in, " compressed bytes and ",
                                                 given_, " that they were"));
}

absl::Status GzipInflater::Refill(const std::function<absl::StatusOr<size_t>(char*, size_t)>& source) {
  WELLSPACE_ASSIGN_OR_RETURN(const size_t got, source(stream_->input.data(), stream_->input.size()));
  taken_ += got;
  stream_->at_end = got == 0;
  stream_->z.next_in = reinterpret_cast<Bytef*>(stream_->input.data());
  stream_->z.avail_in = static_cast<uInt>(got);
  return absl::OkStatus();
}

absl::StatusOr<size_t> GzipInflater::Read(const std::function<absl::StatusOr<size_t>(char*, size_t)>& source,
                                          char* buffer, size_t size) {
  z_stream& z = stream_->z;
  z.next_out = reinterpret_cast<Bytef*>(buffer);
  z.avail_out = static_cast<uInt>(std::min<size_t>(size, std::numeric_limits<uInt>::max()));
  const uInt wanted = z.avail_out;
  while (z.avail_out == wanted) {
    if (z.avail_in == 0 && !stream_->at_end) {
      WELLSPACE_RETURN_IF_ERROR(Refill(source));
    }
    if (!stream_->in_member) {
      // Zeros may follow the last member, as tapes have them; or another member.
      while (z.avail_in > 0 && *z.next_in == 0) {
        ++z.next_in;
        --z.avail_in;
      }
      if (z.avail_in == 0) {
        if (stream_->at_end) {
          return size_t{0};
        }
        continue;
      }
      inflateReset(&z);
      stream_->in_member = true;
      stream_->is_first = false;
    }
    if (z.avail_in == 0) {
      return Error("the data of gzip end early; expected the whole file");
    }
    const int result = inflate(&z, Z_NO_FLUSH);
    if (result == Z_STREAM_END) {
      stream_->in_member = false;
    } else if (result != Z_OK && result != Z_BUF_ERROR) {
      return Error(absl::StrCat(stream_->is_first || z.total_out > 0 ? "the data of gzip are damaged"
                                                                     : "something else follows the data of gzip",
                                " (", z.msg != nullptr ? z.msg : "no reason given", ")"));
    }
  }
  const size_t got = wanted - z.avail_out;
  given_ += got;
  if (given_ > kFreeBytes && given_ / kMaxRatio > taken_) {
    return Error(absl::StrCat("the data of gzip inflate to more than ", kMaxRatio,
                              " times their size; expected those of a cloud, which are never so small"));
  }
  return got;
}

}  // namespace wellspace::formats
