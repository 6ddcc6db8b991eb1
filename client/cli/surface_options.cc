#include "client/cli/surface_options.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/options.h"
#include "client/cli/part_name_options.h"
#include "client/cli/remote_command.h"
#include "client/error_details.h"
#include "client/files/region_numbers.h"
#include "client/files/surface_features.h"
#include "client/formats/io/input_file.h"
#include "client/formats/surface/join_surfaces.h"
#include "client/formats/surface/read_surface.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

constexpr char kEvenOdd[] = "even-odd";
constexpr char kHoles[] = "holes";
constexpr char kWinding[] = "winding";
constexpr char kBox[] = "box";

}  // namespace

void SurfaceOptions::AddTo(CLI::App& command, const std::string& what) {
  CLI::Option* const triangles = command.add_flag(
      "--triangles", has_triangles_,
      absl::StrCat(what,
                   " is a surface in 3-D: faces of .obj, .ply and .off are its triangles. Files of .stl, .smesh and "
                   "3-D .poly always have a surface"));
  command.add_flag("--as-points", as_points_, absl::StrCat(what, " is a cloud: of .stl, its corners"))
      ->excludes(triangles);
  command
      .add_option(
          "--solids", solids_,
          "Which solids, into which triangles cut space, are meant: even-odd, those that an odd number of "
          "triangles separates from outside; holes, all bounded ones but holes, so that materials may share "
          "facets; winding, the places that triangles go around, which need not bound anything: holes are closed, "
          "overlaps united, and creases rounded off by --resolution; box, all of --box, which sheets that reach its "
          "sides or go beyond them cut; default: box with --box, holes for .smesh, .poly and several files, otherwise "
          "even-odd")
      ->check(CLI::IsMember({kEvenOdd, kHoles, kWinding, kBox}));
  AddNumbers(command, "--box", box_,
             "With --solids box: the box that is meshed, low corner then high corner. Triangles are cut at its sides, "
             "and what is beyond is left out; the sides are parts of the boundary");
  AddLength(command, "--resolution", resolution_,
            "With --solids winding: side of the cells in which what is meshed is looked for: a length, or with % a "
            "share of the diagonal; default 0.5%",
            Length::Whole::kDiagonal);
  command
      .add_option("--crease-angle", crease_angle_,
                  "Edges with more than this angle between the normals of their triangles are creases; 180: none; "
                  "default 30")
      ->type_name("DEGREES")
      ->check(CLI::Range(0.0, 180.0));
  AddLength(command, "--weld", weld_,
            "Corners no farther than this from each other become one: a length, or with % a share of the diagonal; "
            "default: 0.0001% for .stl, otherwise 0",
            Length::Whole::kDiagonal);
  command.add_flag(
      "--keep-points", keeps_points_,
      "Corners of triangles are vertices of the mesh, with their numbers and coordinates; for surfaces that "
      "are good meshes: long triangles take far more vertices then");
}

void SurfaceOptions::AddMoreTo(CLI::App& command, const std::string& what) {
  command
      .add_option("MORE", more_,
                  absl::StrCat("Further files of the surface of ", what,
                               ", whose triangles are parts of the boundary of their own; --solids holes by default"))
      ->type_name("FILE");
}

std::string SurfaceOptions::FilesFrom(const std::string& path) const {
  return absl::StrCat(path, more_.empty() ? "" : " ", absl::StrJoin(more_, " "));
}

void SurfaceOptions::AddFilesTo(formats::FilePlan& files) const {
  for (const std::string& path : more_) {
    files.Reads("MORE", path);
  }
}

void SurfaceOptions::AddMeshingTo(CLI::App& command, const std::string& what) {
  AddTo(command, what);
  command
      .add_option("--seeds", seeds_path_,
                  "Of a surface: a table of lines x,y,z,region[,max-volume], each a point in a solid; its tetrahedra "
                  "are of this region, a number, and no larger; the region hole: it is not meshed")
      ->type_name("FILE");
}

bool SurfaceOptions::IsSurface(const std::string& path, const formats::CloudOptions& options, Poly poly) const {
  if (as_points_) {
    return false;
  }
  if (has_triangles_ || options.format == "smesh") {
    return true;
  }
  if (options.format == "poly") {
    return poly == Poly::kIsSurface || formats::IsSurfacePath(path);
  }
  const bool asks_for_points = !options.columns.empty() || options.skip_invalid;
  return !asks_for_points && (options.format.empty() ? formats::IsSurfacePath(path) : options.format == "stl");
}

absl::Status SurfaceOptions::CheckOther(const std::string& what) const {
  if (!more_.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(more_.front(), ": ", what,
                                                   " is read as a mesh or as points, and is one file; several make up "
                                                   "a surface: give .stl, .smesh or 3-D .poly, or --triangles"));
  }
  const char* const option = !solids_.empty()            ? "--solids"
                             : crease_angle_.has_value() ? "--crease-angle"
                             : weld_.has_value()         ? "--weld"
                             : resolution_.has_value()   ? "--resolution"
                             : !box_.empty()             ? "--box"
                             : keeps_points_             ? "--keep-points"
                             : !seeds_path_.empty()      ? "--seeds"
                                                         : nullptr;
  return option == nullptr ? absl::OkStatus()
                           : absl::InvalidArgumentError(absl::StrCat(
                                 option, ": ", what,
                                 " is read as a mesh or as points; give a .stl, .smesh or 3-D .poly, or --triangles"));
}

absl::StatusOr<formats::Surface> SurfaceOptions::Read(const std::string& path,
                                                      const formats::CloudOptions& options) const {
  const char* const option = !options.columns.empty() ? "--columns" : options.skip_invalid ? "--skip-invalid" : nullptr;
  if (option != nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat(option, ": ", path,
                     " is a surface, all of whose points are needed; leave it out, or give "
                     "--as-points"));
  }
  if (!box_.empty() && box_.size() != 6) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--box: there are ", box_.size(), " numbers; expected 6, the low corner and then the high one: x,y,z,x,y,z"));
  }
  if (box_.empty() && solids_ == kBox) {
    return absl::InvalidArgumentError("--solids box: needs --box, its low corner and then its high one");
  }
  if (!box_.empty() && !solids_.empty() && solids_ != kBox) {
    return absl::InvalidArgumentError(
        absl::StrCat("--box: not with --solids ", solids_, "; leave it out, or give --solids box"));
  }
  std::vector<formats::Surface> surfaces;
  uint64_t points = 0;
  std::vector<std::string> paths = {path};
  paths.insert(paths.end(), more_.begin(), more_.end());
  for (const std::string& one : paths) {
    WELLSPACE_ASSIGN_OR_RETURN(formats::Surface surface, formats::ReadSurface(one, options.format));
    points += surface.point_count();
    if (points >= client::kNoVertex) {
      return absl::InvalidArgumentError(
          absl::StrCat(one, ": with the files before there are ", points, " points; fewer than 2^32 - 1 have numbers"));
    }
    surfaces.push_back(std::move(surface));
  }
  return formats::JoinSurfaces(std::move(surfaces));
}

core::SurfaceFeatures SurfaceOptions::FeaturesOf(const formats::Surface& surface) const {
  core::SurfaceFeatures features;
  features.corners = surface.corners;
  features.markers = surface.markers;
  const bool holes = solids_.empty() ? surface.solids == formats::Surface::SolidRule::kHoles : solids_ == kHoles;
  const bool box = solids_.empty() ? !box_.empty() : solids_ == kBox;
  features.solids = box                   ? core::SolidRule::kBox
                    : solids_ == kWinding ? core::SolidRule::kWinding
                    : holes               ? core::SolidRule::kHoles
                                          : core::SolidRule::kEvenOdd;
  if (!box_.empty()) {
    features.box = core::Box<3>{{box_[0], box_[1], box_[2]}, {box_[3], box_[4], box_[5]}};
  }
  features.resolution = resolution_.has_value() ? resolution_->Of(surface.points, 3) : 0;
  features.crease_angle = crease_angle_.value_or(features.crease_angle);
  features.weld = weld_.has_value() ? weld_->Of(surface.points, 3) : client::DefaultWeld(surface);
  features.keeps_points = keeps_points_;
  return features;
}

absl::StatusOr<formats::PointCloud> SurfaceOptions::ReadInput(const std::string& path,
                                                              const formats::CloudOptions& options) {
  WELLSPACE_ASSIGN_OR_RETURN(formats::Surface surface, Read(path, options));
  if (!seeds_path_.empty()) {
    WELLSPACE_ASSIGN_OR_RETURN(seeds_, formats::ReadSolidSeeds(seeds_path_));
  }
  path_ = path;
  surface_ = std::move(surface);
  const core::SurfaceFeatures rules = FeaturesOf(*surface_);
  client::SurfaceFeatures features = client::FeaturesOf(*surface_, seeds_.seeds, surface_->notes);
  features.solids = rules.solids == core::SolidRule::kBox       ? client::SolidRule::kBox
                    : rules.solids == core::SolidRule::kHoles   ? client::SolidRule::kHoles
                    : rules.solids == core::SolidRule::kWinding ? client::SolidRule::kWinding
                                                                : client::SolidRule::kEvenOdd;
  if (rules.box.has_value()) {
    const auto& [low, high] = *rules.box;
    features.box = {low[0], low[1], low[2], high[0], high[1], high[2]};
  }
  if (rules.resolution > 0) {
    features.resolution = rules.resolution;
  }
  features.crease_angle = rules.crease_angle;
  features.weld = rules.weld;
  features.keeps_points = rules.keeps_points;
  AddPartNames(PartNames(), features.names.markers);
  features.names = Joined(std::move(features.names), names_);
  features_ = std::make_shared<const client::SurfaceFeatures>(std::move(features));
  formats::PointCloud cloud;
  cloud.name = surface_->name;
  cloud.dimension = 3;
  cloud.points = surface_->points;
  cloud.notes = surface_->notes;
  return cloud;
}

const formats::Surface::Seed& SurfaceOptions::SeedAt(uint64_t seed) const {
  const uint64_t of_surface = surface_->seeds.size();
  return seed < of_surface ? surface_->seeds[seed] : seeds_.seeds[seed - of_surface];
}

std::string SurfaceOptions::SeedOrigin(uint64_t seed) const {
  const uint64_t of_surface = surface_->seeds.size();
  return seed < of_surface ? surface_->SeedOrigin(seed) : seeds_.Origin(seed - of_surface);
}

std::map<int32_t, std::string> SurfaceOptions::PartNames() const {
  std::map<int32_t, std::string> names;
  if (surface_.has_value()) {
    for (const formats::Surface::Part& part : surface_->parts) {
      names.emplace(part.marker, part.name);
    }
  }
  return names;
}

absl::Status SurfaceOptions::WithOrigins(const absl::Status& status, const Before& before) const {
  absl::Status told = WithPlaces(status, "triangles[", before.features.triangles, surface_->triangle_count(),
                                 [&](uint64_t i) { return surface_->TriangleOrigin(i); });
  told = WithPlaces(told, "seeds[", before.features.seeds, features_->seeds.size(),
                    [&](uint64_t i) { return SeedOrigin(i); });
  // A fault of the surface, of which the error names the first place.
  return client::BlamedField(status) == "triangles.corners" && path_ != formats::kStandardStream
             ? client::WithMessage(told, absl::StrCat(told.message(), "; `wellspace info ", FilesFrom(path_),
                                                      has_triangles_ ? " --triangles" : "", "` tells all faults"))
             : told;
}

std::vector<std::string> SurfaceOptions::NotesOf(const std::optional<client::SurfaceStatistics>& statistics) const {
  if (!statistics.has_value() || statistics->unused_seeds == 0 ||
      statistics->first_unused_seed >= features_->seeds.size()) {
    return {};
  }
  const formats::Surface::Seed& seed = SeedAt(statistics->first_unused_seed);
  return {client::UnusedSeedNote(SeedOrigin(statistics->first_unused_seed), seed.is_hole,
                                 absl::StrCat(seed.x, ", ", seed.y, ", ", seed.z), statistics->unused_seeds)};
}

}  // namespace wellspace::cli
