// Planar domains as text, for tests that read them again.
#ifndef WELLSPACE_TESTS_SUPPORT_PLANAR_DOMAIN_TEXT_H_
#define WELLSPACE_TESTS_SUPPORT_PLANAR_DOMAIN_TEXT_H_

#include <cstdint>
#include <string>
#include <vector>

#include "client/formats/domain/planar_domain.h"
#include "client/formats/io/number.h"

namespace wellspace::test {

// `point` as two numbers with `separator` between them.
inline std::string PointText(const formats::PlanarDomain& domain, uint64_t point, const char* separator) {
  std::string text;
  formats::AppendNumber(domain.points[2 * point], text);
  text += separator;
  formats::AppendNumber(domain.points[2 * point + 1], text);
  return text;
}

// Appends a whole number and the text that follows it.
template <typename Number>
void AppendWhole(Number value, const char* after, std::string& text) {
  text += std::to_string(value);
  text += after;
}

// The points as a .node file, or as the first part of a .poly, with indices from `base`.
inline std::string NodeText(const formats::PlanarDomain& domain, uint64_t base) {
  const bool has_markers = !domain.point_markers.empty();
  std::string text;
  AppendWhole(domain.point_count(), has_markers ? " 2 0 1\n" : " 2 0 0\n", text);
  for (uint64_t i = 0; i < domain.point_count(); ++i) {
    AppendWhole(i + base, " ", text);
    text += PointText(domain, i, " ");
    if (has_markers) {
      text += ' ';
      text += std::to_string(domain.point_markers[i]);
    }
    text += '\n';
  }
  return text;
}

// The parts of a .poly after the points. REQUIRES: the holes are the first of the seeds.
inline std::string PolyTailText(const formats::PlanarDomain& domain, uint64_t base) {
  std::string text;
  AppendWhole(domain.segment_count(), " 1\n", text);
  for (uint64_t i = 0; i < domain.segment_count(); ++i) {
    AppendWhole(i, " ", text);
    AppendWhole(domain.segments[2 * i] + base, " ", text);
    AppendWhole(domain.segments[2 * i + 1] + base, " ", text);
    AppendWhole(domain.markers[i], "\n", text);
  }
  size_t holes = 0;
  while (holes < domain.seeds.size() && domain.seeds[holes].is_hole) {
    ++holes;
  }
  for (const bool is_hole : {true, false}) {
    const size_t first = is_hole ? 0 : holes;
    const size_t end = is_hole ? holes : domain.seeds.size();
    AppendWhole(end - first, "\n", text);
    for (size_t i = first; i < end; ++i) {
      const formats::PlanarDomain::Seed& seed = domain.seeds[i];
      text += std::to_string(i - first);
      const std::vector<double> values = is_hole ? std::vector<double>{seed.x, seed.y}
                                                 : std::vector<double>{seed.x, seed.y, seed.attribute, seed.max_area};
      for (const double value : values) {
        text += ' ';
        formats::AppendNumber(value, text);
      }
      text += '\n';
    }
  }
  return text;
}

// Every segment as a line of its own, in one MultiLineString. REQUIRES: no segment has ends that are equal.
inline std::string GeoJsonText(const formats::PlanarDomain& domain) {
  std::string text = R"({"type": "MultiLineString", "coordinates": [)";
  for (uint64_t i = 0; i < domain.segment_count(); ++i) {
    text += i == 0 ? "\n" : ",\n";
    text += "[[";
    text += PointText(domain, domain.segments[2 * i], ", ");
    text += "], [";
    text += PointText(domain, domain.segments[2 * i + 1], ", ");
    text += "]]";
  }
  text += "]}\n";
  return text;
}

}  // namespace wellspace::test

#endif  // WELLSPACE_TESTS_SUPPORT_PLANAR_DOMAIN_TEXT_H_
