// The options that say how a file of triangles is read, and what they bound.
#ifndef WELLSPACE_CLIENT_CLI_SURFACE_OPTIONS_H_
#define WELLSPACE_CLIENT_CLI_SURFACE_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/read_cloud.h"
#include "client/formats/surface/surface.h"
#include "core/surface_report.h"

namespace wellspace::cli {

// A surface in space: --triangles, --as-points, --solids, --crease-angle and --weld.
//
// Thread safety: thread-compatible.
class SurfaceOptions {
 public:
  // `what` is the file, as the options say it.
  //
  // REQUIRES:   this outlives `command`.
  void AddTo(CLI::App& command, const std::string& what);

  // Whether `path` has a surface: it says so, or --triangles does; and nothing is asked that is about points alone.
  bool IsSurface(const std::string& path, const formats::CloudOptions& options) const;

  // Refuses options of surfaces for `what`, which is none.
  absl::Status CheckOther(const std::string& what) const;

  // Reads the surface, by the format that is given.
  //
  // Errors:     those of formats::ReadSurface; INVALID_ARGUMENT for options of points.
  absl::StatusOr<formats::Surface> Read(const std::string& path, const formats::CloudOptions& options) const;

  // What `surface` is bounded by, under these options: without --weld, corners of STL become one within kWeldShare of
  // the diagonal, and no others.
  //
  // REQUIRES:   `surface` outlives the result.
  core::SurfaceFeatures FeaturesOf(const formats::Surface& surface) const;

  static constexpr double kWeldShare = 1e-6;

 private:
  // A length, or a share of the diagonal.
  struct Length {
    double value = 0;
    bool is_share = false;
  };

  bool has_triangles_ = false;
  bool as_points_ = false;
  std::string solids_;
  std::optional<double> crease_angle_;
  std::optional<Length> weld_;
};

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_SURFACE_OPTIONS_H_
