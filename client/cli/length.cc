#include "client/cli/length.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud.h"
#include "client/formats/io/number.h"

namespace wellspace::cli {
namespace {

constexpr char kNoLength[] = "none";

}  // namespace

double Length::Of(std::span<const double> points, int dimension) const {
  if (!is_share) {
    return value;
  }
  double longest = 0;
  double diagonal = 0;
  for (const double side : formats::BoxSides(points, dimension)) {
    longest = std::max(longest, side);
    diagonal = std::hypot(diagonal, side);
  }
  return value / 100 * (whole == Whole::kDiagonal ? diagonal : longest);
}

absl::StatusOr<Length> Length::Parse(std::string_view text, Whole whole) {
  Length length{.whole = whole};
  std::string_view number = formats::TrimBlanks(text);
  length.is_share = !number.empty() && number.back() == '%';
  number.remove_suffix(length.is_share ? 1 : 0);
  const absl::Status status = formats::ParseFinite(formats::TrimBlanks(number), length.value);
  if (!status.ok() || length.value < 0 || (length.is_share && length.value > 100)) {
    return absl::InvalidArgumentError(absl::StrCat("expected a length of at least 0, as 0.01, or a share of the ",
                                                   whole == Whole::kDiagonal ? "diagonal" : "longest side",
                                                   " of the points' bounding box, as 0.1%, got ",
                                                   formats::Quote(text)));
  }
  return length;
}

bool IsLengthOrNone(std::string_view text) { return text == kNoLength || Length::Parse(text).ok(); }

CLI::Option* AddLength(CLI::App& command, const std::string& name, std::optional<Length>& value,
                       const std::string& description, Length::Whole whole) {
  const auto parse = [name, whole, &value](const std::string& text) {
    if (text == kNoLength) {
      value.reset();
      return;
    }
    const absl::StatusOr<Length> length = Length::Parse(text, whole);
    if (!length.ok()) {
      throw CLI::ValidationError(name, std::string(length.status().message()));
    }
    value = *length;
  };
  return command.add_option_function<std::string>(name, parse, description)->type_name("LENGTH");
}

}  // namespace wellspace::cli
