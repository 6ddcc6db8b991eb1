// The source of the points of an upload.
#ifndef WELLSPACE_CLIENT_POINT_SOURCE_H_
#define WELLSPACE_CLIENT_POINT_SOURCE_H_

#include <cstdint>
#include <span>

#include "absl/status/statusor.h"

namespace wellspace::client {

// A cloud that is read piece by piece, and again from any point on when a connection broke. It need not fit into
// memory.
//
// Thread safety: called from one thread at a time.
class PointSource {
 public:
  PointSource() = default;
  virtual ~PointSource() = default;
  PointSource(const PointSource&) = delete;
  PointSource& operator=(const PointSource&) = delete;

  // Of the points; at least 1, always the same.
  virtual int dimension() const = 0;

  // The next Read starts at point `first`, or at the end when there are fewer. Called before the first Read.
  virtual absl::Status Seek(uint64_t first) = 0;

  // Fills `rows` from its start with the next points, and returns how many those are: 0 at the end only.
  // REQUIRES:   rows.size() is a positive multiple of dimension().
  virtual absl::StatusOr<uint64_t> Read(std::span<double> rows) = 0;
};

// Points in memory: n x dimension, row-major. REQUIRES: they outlive this.
class SpanSource final : public PointSource {
 public:
  SpanSource(int dimension, std::span<const double> points) : dimension_(dimension), points_(points) {}

  int dimension() const override { return dimension_; }
  absl::Status Seek(uint64_t first) override;
  absl::StatusOr<uint64_t> Read(std::span<double> rows) override;

 private:
  const int dimension_;
  const std::span<const double> points_;
  uint64_t next_ = 0;  // number, not point
};

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_POINT_SOURCE_H_
