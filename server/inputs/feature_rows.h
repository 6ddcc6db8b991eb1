// The common part of segments and triangles: numbers of points, and a marker.
#ifndef WELLSPACE_SERVER_INPUTS_FEATURE_ROWS_H_
#define WELLSPACE_SERVER_INPUTS_FEATURE_ROWS_H_

#include <cstddef>
#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "google/protobuf/repeated_field.h"
#include "server/base/growing_array.h"
#include "server/wire/errors.h"

namespace wellspace::server {

// Rows of K numbers of points, each with a marker, which grow at the end.
//
// Thread safety: thread-compatible.
template <int K>
class FeatureRows {
 public:
  using Points = google::protobuf::RepeatedField<uint32_t>;
  using Markers = google::protobuf::RepeatedField<int32_t>;

  static constexpr uint64_t kBytes = K * sizeof(uint32_t) + sizeof(int32_t);  // of a row

  // Appends all rows but the first `known`. Without markers they are 0. An exception, when memory ends, changes
  // nothing.
  //
  // REQUIRES:   whole rows, and a marker for each or none; known is at most their number.
  void Append(const Points& points, const Markers& markers, uint64_t known) {
    const auto skipped = static_cast<std::ptrdiff_t>(known);
    markers_.MakeRoom(count() + points.size() / K - known);
    points_.Append(points.begin() + K * skipped, points.end());
    if (markers.size() != 0) {
      markers_.Append(markers.begin() + skipped, markers.end());
    }
    markers_.Resize(count());
  }
  // Takes out again all rows behind the first `count`.
  void TakeBack(uint64_t count) {
    points_.Resize(K * count);
    markers_.Resize(count);
  }

  // Whether row `row` is row `i` of these.
  bool IsEqual(uint64_t row, const Points& points, const Markers& markers, int i) const {
    for (int k = 0; k < K; ++k) {
      if (points_[K * row + k] != points[K * i + k]) {
        return false;
      }
    }
    return markers_[row] == (markers.size() == 0 ? 0 : markers[i]);
  }

  uint64_t count() const { return points_.size() / K; }
  std::span<const uint32_t> points() const { return points_; }
  std::span<const int32_t> markers() const { return markers_; }

 private:
  GrowingArray<uint32_t> points_;
  GrowingArray<int32_t> markers_;
};

// The words for rows in messages.
struct RowWords {
  const char* one;           // "segment"
  const char* points;        // of a row: "ends"
  const char* points_field;  // of a request: "segments.ends"
};

// INVALID_CHUNK_SHAPE where a chunk of rows behind the first `first` has `count` of `what` for `rows` rows, neither one
// for each nor none.
inline absl::Status CheckOneForEach(const RowWords& words, uint64_t first, int rows, int count, const char* what,
                                    const char* field) {
  return count == 0 || count == rows
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
                         absl::StrCat("the chunk after ", words.one, " ", first, " has ", count, " ", what, " and ",
                                      rows, " ", words.one, "s; expected one for each, or none"),
                         field);
}

// INVALID_CHUNK_SHAPE where a chunk behind the first `first` rows is no whole number of rows.
template <int K>
absl::Status CheckWholeRows(const RowWords& words, uint64_t first, int points) {
  return points % K == 0 ? absl::OkStatus()
                         : MakeError(v1::ERROR_REASON_INVALID_CHUNK_SHAPE,
                                     absl::StrCat("the chunk after ", words.one, " ", first, " has ", points, " ",
                                                  words.points, "; expected a multiple of ", K),
                                     words.points_field);
}

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_INPUTS_FEATURE_ROWS_H_
