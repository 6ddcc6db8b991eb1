#include "client/cli/length.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "absl/strings/str_cat.h"
#include "client/formats/io/number.h"

namespace wellspace::cli {

double Length::Of(std::span<const double> points, int dimension) const {
  if (!is_share) {
    return value;
  }
  double side = 0;
  for (int axis = 0; axis < dimension; ++axis) {
    double low = std::numeric_limits<double>::infinity();
    double high = -std::numeric_limits<double>::infinity();
    for (size_t i = axis; i < points.size(); i += dimension) {
      low = std::min(low, points[i]);
      high = std::max(high, points[i]);
    }
    side = std::max(side, high - low);
  }
  return value / 100 * side;
}

absl::StatusOr<Length> Length::Parse(std::string_view text) {
  Length length;
  std::string_view number = formats::TrimBlanks(text);
  length.is_share = !number.empty() && number.back() == '%';
  number.remove_suffix(length.is_share ? 1 : 0);
  const absl::Status status = formats::ParseFinite(formats::TrimBlanks(number), length.value);
  if (!status.ok() || length.value < 0 || (length.is_share && length.value > 100)) {
    return absl::InvalidArgumentError(
        absl::StrCat("expected a length of at least 0, as 0.01, or a share of the longest side of the points' bounding "
                     "box, as 0.1%, got ",
                     formats::Quote(text)));
  }
  return length;
}

CLI::Option* AddLength(CLI::App& command, const std::string& name, std::optional<Length>& value,
                       const std::string& description) {
  const auto parse = [name, &value](const std::string& text) {
    if (text == "none") {
      value.reset();
      return;
    }
    const absl::StatusOr<Length> length = Length::Parse(text);
    if (!length.ok()) {
      throw CLI::ValidationError(name, std::string(length.status().message()));
    }
    value = *length;
  };
  return command.add_option_function<std::string>(name, parse, description)->type_name("LENGTH");
}

}  // namespace wellspace::cli
