// The options that say how a file of triangles is read, and which domain they bound.
#ifndef WELLSPACE_CLIENT_CLI_SURFACE_OPTIONS_H_
#define WELLSPACE_CLIENT_CLI_SURFACE_OPTIONS_H_

#include <CLI/CLI.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/length.h"
#include "client/formats/cloud.h"
#include "client/formats/file_plan.h"
#include "client/formats/read_cloud.h"
#include "client/formats/surface/read_seeds.h"
#include "client/formats/surface/surface.h"
#include "client/types.h"
#include "core/input/surface_report.h"

namespace wellspace::cli {

// A surface in space, in one file or several: --triangles, --as-points, --solids, --box, --crease-angle and
// --weld; where it is meshed --seeds.
//
// Thread safety: thread-compatible.
class SurfaceOptions {
 public:
  // `what` is the file, as the options say it.
  //
  // REQUIRES:   this outlives `command`, here and below.
  void AddTo(CLI::App& command, const std::string& what);
  // Further files, behind `what` on the command line.
  void AddMoreTo(CLI::App& command, const std::string& what);
  // The same, where they come by another option.
  void SetMore(std::vector<std::string> paths) { more_ = std::move(paths); }
  // The same, and --seeds.
  void AddMeshingTo(CLI::App& command, const std::string& what);

  // The statement of a format that may be one of the plane or of space.
  enum class Poly { kIsSurface, kByPath };

  // Whether `path` has a surface: it says so, or --triangles does; and nothing is asked that is about points alone.
  bool IsSurface(const std::string& path, const formats::CloudOptions& options, Poly poly = Poly::kIsSurface) const;

  // All files, of which `path` is the first, as a command line has them.
  std::string FilesFrom(const std::string& path) const;
  // Adds the files behind the first one.
  void AddFilesTo(formats::FilePlan& files) const;

  // Refuses options of surfaces for `what`, which is none.
  absl::Status CheckOther(const std::string& what) const;

  // Reads the surface, by the format that is given; with further files all of them, joined.
  //
  // Errors:     those of formats::ReadSurface; INVALID_ARGUMENT for options of points.
  absl::StatusOr<formats::Surface> Read(const std::string& path, const formats::CloudOptions& options) const;

  // The features of `surface` under these options: without --weld, corners become one within client::DefaultWeld.
  //
  // REQUIRES:   `surface` outlives the result.
  core::SurfaceFeatures FeaturesOf(const formats::Surface& surface) const;

  // Reads the surface, and the seeds, as the input of a mesh: its points alone are returned, and its triangles are
  // kept.
  //
  // Errors:     those of Read, and of formats::ReadSolidSeeds.
  absl::StatusOr<formats::PointCloud> ReadInput(const std::string& path, const formats::CloudOptions& options);

  // Names of parts, over those of the file. To be called before ReadInput.
  void SetNames(client::PartNames names) { names_ = std::move(names); }
  // The surface that ReadInput has read; null before.
  const std::shared_ptr<const client::SurfaceFeatures>& features() const { return features_; }
  // The names of parts of the boundary, by the markers of the triangles that ReadInput has read.
  std::map<int32_t, std::string> PartNames() const;

  // The part that the server has before the one that was read.
  struct Before {
    uint64_t points = 0;
    client::SurfaceOffset features = {};
  };
  // `status`, with the places in their files of the triangles and seeds that it names, and how all faults are told.
  absl::Status WithOrigins(const absl::Status& status, const Before& before) const;
  absl::Status WithOrigins(const absl::Status& status) const { return WithOrigins(status, Before()); }
  // Notes of a mesh of the solids on its seeds, a sentence each: seeds that mean nothing.
  //
  // REQUIRES:   ReadInput is OK.
  std::vector<std::string> NotesOf(const std::optional<client::SurfaceStatistics>& statistics) const;

 private:
  const formats::Surface::Seed& SeedAt(uint64_t seed) const;
  std::string SeedOrigin(uint64_t seed) const;

  std::vector<std::string> more_;
  bool has_triangles_ = false;
  bool as_points_ = false;
  std::string solids_;
  std::optional<double> crease_angle_;
  std::optional<Length> weld_;
  std::optional<Length> resolution_;
  std::vector<double> box_;
  bool keeps_points_ = false;
  client::PartNames names_;
  std::string seeds_path_;
  std::string path_;
  std::optional<formats::Surface> surface_;
  formats::SolidSeeds seeds_;  // of --seeds; they come behind those of the surface
  std::shared_ptr<const client::SurfaceFeatures> features_;
};

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_SURFACE_OPTIONS_H_
