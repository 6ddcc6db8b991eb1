// Lengths that may be a share of the cloud, or of the surface, they are about.
#ifndef WELLSPACE_CLIENT_CLI_LENGTH_H_
#define WELLSPACE_CLIENT_CLI_LENGTH_H_

#include <CLI/CLI.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace wellspace::cli {

// A length: a number in the unit of the points, or a share of a length of their bounding box.
struct Length {
  enum class Whole { kLongestSide, kDiagonal };

  double value = 0;
  bool is_share = false;
  Whole whole = Whole::kLongestSide;

  // Shapes:     points: n x dimension, row-major.
  // Complexity: O(1); O(n) of a share.
  double Of(std::span<const double> points, int dimension) const;

  // "0.01" or "0.5%".
  //
  // Errors:     INVALID_ARGUMENT, a message without the option.
  static absl::StatusOr<Length> Parse(std::string_view text, Whole whole = Whole::kLongestSide);
};

// Whether AddLength takes `text`.
bool IsLengthOrNone(std::string_view text);

// A length, or "none": as if the option were not given.
CLI::Option* AddLength(CLI::App& command, const std::string& name, std::optional<Length>& value,
                       const std::string& description, Length::Whole whole = Length::Whole::kLongestSide);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_LENGTH_H_
