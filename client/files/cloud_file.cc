#include "client/files/cloud_file.h"

#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/formats/numpy/npy_rows.h"
#include "core/base/status_macros.h"

namespace wellspace::client {
namespace {

class WholeCloud final : public CloudFile {
 public:
  explicit WholeCloud(formats::PointCloud cloud) : cloud_(std::move(cloud)), source_(cloud_.dimension, cloud_.points) {}

  int dimension() const override { return source_.dimension(); }
  absl::Status Seek(uint64_t first) override { return source_.Seek(first); }
  absl::StatusOr<uint64_t> Read(std::span<double> rows) override { return source_.Read(rows); }
  uint64_t size() const override { return cloud_.size(); }
  std::string Origin(uint64_t point) const override { return cloud_.Origin(point); }
  const std::vector<std::string>& notes() const override { return cloud_.notes; }
  uint64_t skipped() const override { return cloud_.skipped; }

 private:
  const formats::PointCloud cloud_;
  SpanSource source_;
};

class NpyCloud final : public CloudFile {
 public:
  explicit NpyCloud(formats::NpyRows rows) : rows_(std::move(rows)) {}

  int dimension() const override { return rows_.columns(); }
  absl::Status Seek(uint64_t first) override {
    next_ = first;
    return absl::OkStatus();
  }
  absl::StatusOr<uint64_t> Read(std::span<double> rows) override {
    const absl::StatusOr<uint64_t> read = rows_.Read(next_, rows);
    next_ += read.value_or(0);
    return read;
  }
  uint64_t size() const override { return rows_.rows(); }
  std::string Origin(uint64_t point) const override { return absl::StrCat(rows_.name(), "[", point, "]"); }
  const std::vector<std::string>& notes() const override { return notes_; }
  uint64_t skipped() const override { return 0; }

 private:
  formats::NpyRows rows_;
  uint64_t next_ = 0;
  const std::vector<std::string> notes_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<CloudFile>> CloudFile::Open(const std::string& path,
                                                           const formats::CloudOptions& options) {
  const bool is_npy = options.format == "npy" || (options.format.empty() && absl::EndsWithIgnoreCase(path, ".npy"));
  if (is_npy && options.columns.empty() && !options.skip_invalid) {
    absl::StatusOr<formats::NpyRows> rows = formats::NpyRows::Open(path);
    if (rows.ok() && (options.dimension == 0 || rows->columns() == options.dimension)) {
      return std::make_unique<NpyCloud>(*std::move(rows));
    }
    // As a whole it may do, or there is a better message.
  }
  WELLSPACE_ASSIGN_OR_RETURN(formats::PointCloud cloud, formats::ReadCloud(path, options));
  return std::make_unique<WholeCloud>(std::move(cloud));
}

}  // namespace wellspace::client
