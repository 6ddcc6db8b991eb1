#include "core/features/near_segment.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/features/place.h"

namespace wellspace::core {

std::string DescribeNearSegment(std::string_view vertex, const Point<2>& p, double distance, std::string_view segment) {
  return absl::StrFormat("%s at %s is %.3g from %s and not on it", vertex, PlaceText(p), distance, segment);
}

absl::Status NearSegmentError(std::string_view described, double least, double on_segment) {
  const std::string advice = on_segment > 0 ? absl::StrFormat("or onto the segment, within %.3g of it", on_segment)
                                            : "make it an end of the segment, or have the segment led through it by "
                                              "the rule of crossings \"snap\"";
  return absl::InvalidArgumentError(
      absl::StrFormat("%s, too close for the arithmetic of doubles (at least %.3g is needed); move it away, %s",
                      described, least, advice));
}

}  // namespace wellspace::core
