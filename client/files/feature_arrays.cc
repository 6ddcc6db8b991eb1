#include "client/files/feature_arrays.h"

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "client/formats/numpy/npz_file.h"
#include "client/rule_names.h"
#include "core/base/status_macros.h"

namespace wellspace::client {
namespace {

using formats::NpzFile;

double BoundOf(const std::optional<double>& bound) { return bound.value_or(std::numeric_limits<double>::infinity()); }

template <typename T>
void WriteRows(const char* member, const std::vector<T>& values, uint64_t columns, NpzFile& file) {
  file.Begin<T>(member, values.size() / columns, columns);
  file.Write(std::span<const T>(values));
}

template <typename T>
void WriteIfAny(const char* member, const std::vector<T>& values, NpzFile& file) {
  if (!values.empty()) {
    file.WriteArray(member, std::span<const T>(values));
  }
}

void WriteText(const char* member, const char* text, NpzFile& file) {
  const std::string texts[] = {text};
  file.WriteTexts(member, texts);
}

void WriteNames(const char* member, const char* numbers_member, const std::map<int32_t, std::string>& names,
                NpzFile& file) {
  std::vector<int32_t> numbers;
  std::vector<std::string> texts;
  for (const auto& [number, name] : names) {
    numbers.push_back(number);
    texts.push_back(name);
  }
  if (!numbers.empty()) {
    file.WriteTexts(member, texts);
    file.WriteArray(numbers_member, std::span<const int32_t>(numbers));
  }
}

void WriteNames(const PartNames& names, NpzFile& file) {
  WriteNames("marker_names.npy", "named_markers.npy", names.markers, file);
  WriteNames("region_names.npy", "named_regions.npy", names.regions, file);
}

void WriteSeeds(const std::vector<FaceSeed>& seeds, NpzFile& file) {
  std::vector<double> holes;
  std::vector<double> points;
  std::vector<double> polygons;
  for (const FaceSeed& seed : seeds) {
    const auto region = static_cast<double>(seed.region);
    if (seed.is_hole) {
      holes.insert(holes.end(), {seed.x, seed.y});
    } else if (seed.segment_count > 0) {
      polygons.insert(polygons.end(), {static_cast<double>(seed.first_segment), static_cast<double>(seed.segment_count),
                                       region, BoundOf(seed.max_area)});
    } else {
      points.insert(points.end(), {seed.x, seed.y, region, BoundOf(seed.max_area)});
    }
  }
  WriteRows("holes.npy", holes, 2, file);
  WriteRows("seeds.npy", points, 4, file);
  WriteRows("polygons.npy", polygons, 4, file);
}

void WriteSeeds(const std::vector<SolidSeed>& seeds, NpzFile& file) {
  std::vector<double> holes;
  std::vector<double> points;
  for (const SolidSeed& seed : seeds) {
    if (seed.is_hole) {
      holes.insert(holes.end(), {seed.x, seed.y, seed.z});
    } else {
      points.insert(points.end(), {seed.x, seed.y, seed.z, static_cast<double>(seed.region), BoundOf(seed.max_volume)});
    }
  }
  WriteRows("holes.npy", holes, 3, file);
  WriteRows("seeds.npy", points, 5, file);
}

}  // namespace

absl::Status WriteFeatureArrays(const std::string& path, const formats::PointCloud& points, const Features& features,
                                std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<NpzFile> file, NpzFile::Create(path, std::move(stop)));
  WriteRows("points.npy", points.points, points.dimension, *file);
  WriteRows("segments.npy", features.ends, 2, *file);
  WriteIfAny("markers.npy", features.markers, *file);
  WriteIfAny("is_open.npy", features.is_open, *file);
  WriteIfAny("groups.npy", features.groups, *file);
  WriteText("faces.npy", FaceRuleName(features.faces), *file);
  WriteNames(features.names, *file);
  WriteSeeds(features.seeds, *file);
  return file->Commit();
}

absl::Status WriteFeatureArrays(const std::string& path, const formats::PointCloud& points,
                                const SurfaceFeatures& features, std::stop_token stop) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<NpzFile> file, NpzFile::Create(path, std::move(stop)));
  WriteRows("points.npy", points.points, points.dimension, *file);
  WriteRows("triangles.npy", features.corners, 3, *file);
  WriteIfAny("markers.npy", features.markers, *file);
  WriteText("solids.npy", SolidRuleName(features.solids), *file);
  WriteNames(features.names, *file);
  const double weld[] = {features.weld.value_or(0)};
  file->WriteArray("weld.npy", std::span<const double>(weld));
  WriteSeeds(features.seeds, *file);
  return file->Commit();
}

}  // namespace wellspace::client
