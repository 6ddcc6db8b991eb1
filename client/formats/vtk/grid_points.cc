#include "client/formats/vtk/grid_points.h"

#include <algorithm>
#include <utility>

#include "client/formats/io/number.h"
#include "client/formats/vtk/xml_scanner.h"

namespace wellspace::formats {

std::optional<uint64_t> VtkExtent::PointCount(uint64_t most) const {
  uint64_t points = 1;
  for (int axis = 0; axis < 3; ++axis) {
    if (PointsAlong(axis) == 0) {
      return 0;
    }
    if (PointsAlong(axis) > most / points) {
      return std::nullopt;
    }
    points *= PointsAlong(axis);
  }
  return points;
}

std::optional<std::vector<double>> ParseVtkNumbers(std::string_view text, size_t count) {
  std::vector<double> numbers;
  size_t begin = 0;
  while ((begin = text.find_first_not_of(kXmlSpace, begin)) != std::string_view::npos && numbers.size() <= count) {
    const size_t end = std::min(text.find_first_of(kXmlSpace, begin), text.size());
    if (!ParseFinite(text.substr(begin, end - begin), numbers.emplace_back()).ok()) {
      return std::nullopt;
    }
    begin = end;
  }
  return numbers.size() == count ? std::optional(std::move(numbers)) : std::nullopt;
}

}  // namespace wellspace::formats
