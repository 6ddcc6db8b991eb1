#include "core/features/triangle_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/geometry/box.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {
namespace {

constexpr size_t kComparedTogether = 12;
constexpr int kDepthOfParts = 6;
// The rounding of coordinates, and much more; a share of them.
constexpr double kRoom = 0x1p-45;
constexpr int kMostDepth = 400;
// Pairs of a part, after which it is given up.
constexpr size_t kMostOfPart = size_t{1} << 10;
// A cut is good if it leaves this share of the pairs at most.
constexpr double kGoodCut = 0.8;
// Comparisons between two looks at the context.
constexpr size_t kComparedBetweenChecks = size_t{1} << 12;

// Triangles in a part of space.
struct Group {
  std::vector<uint32_t> triangles;
  Box<3> box{};  // all that is looked for is in it
  int depth = 0;
};

// A plane: its points x have Dot(normal, x) = offset.
struct Plane {
  Point<3> normal{};
  double offset = 0;
};

// How many triangles reach to either side of a cut.
struct CutCounts {
  size_t low = 0;
  size_t high = 0;

  double Cost() const {
    const auto l = static_cast<double>(low);
    const auto h = static_cast<double>(high);
    return l * l + h * h;
  }
};

class PairFinder {
 public:
  PairFinder(const SurfaceComplex& complex, double least, const RunContext& context)
      : complex_(complex), least_(least), context_(context) {}

  absl::StatusOr<TrianglePairs> Find(int threads) {
    if (complex_.triangles.empty()) {
      return TrianglePairs();
    }
    WELLSPACE_RETURN_IF_ERROR(MeasureBoxes());
    ThreadTeam team(threads);
    WELLSPACE_ASSIGN_OR_RETURN(std::vector<Group> parts, Parts(team));
    std::vector<TrianglePairs> found(parts.size());
    team.ForEach(parts.size(), [&](size_t i) {
      Search(std::move(parts[i]), found[i]);
      Unite(found[i].pairs);
    });
    WELLSPACE_RETURN_IF_ERROR(context_.Check());
    TrianglePairs all;
    for (const TrianglePairs& of_part : found) {
      all.pairs.insert(all.pairs.end(), of_part.pairs.begin(), of_part.pairs.end());
      all.has_more = all.has_more || of_part.has_more;
      all.compared_pairs += of_part.compared_pairs;
    }
    Unite(all.pairs);
    return all;
  }

 private:
  const Point<3>& At(uint32_t triangle, size_t k) const { return complex_.points[complex_.triangles[triangle][k]]; }

  absl::Status MeasureBoxes() {
    boxes_.reserve(complex_.triangles.size());
    for (uint32_t t = 0; t < complex_.triangles.size(); ++t) {
      if (t % kStepsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
      }
      Box<3> box{At(t, 0), At(t, 0)};
      box.Include({At(t, 1), At(t, 1)});
      box.Include({At(t, 2), At(t, 2)});
      boxes_.push_back(box);
    }
    return absl::OkStatus();
  }

  // Parts that threads may look at at once: they depend on the triangles alone.
  absl::StatusOr<std::vector<Group>> Parts(ThreadTeam& team) const {
    std::vector<Group> parts(1);
    parts[0].triangles.resize(complex_.triangles.size());
    parts[0].box = boxes_[0];
    for (uint32_t t = 0; t < complex_.triangles.size(); ++t) {
      if (t % kStepsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
      }
      parts[0].triangles[t] = t;
      parts[0].box.Include(boxes_[t]);
    }
    for (int depth = 0; depth < kDepthOfParts; ++depth) {
      std::vector<std::array<Group, 2>> next(parts.size());
      team.ForEach(parts.size(), [&](size_t i) {
        if (!Halve(parts[i], next[i])) {
          next[i][0] = std::move(parts[i]);
        }
      });
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
      parts.clear();
      for (std::array<Group, 2>& halves : next) {
        for (Group& half : halves) {
          if (!half.triangles.empty()) {
            parts.push_back(std::move(half));
          }
        }
      }
    }
    return parts;
  }

  // Sorts pairs, and leaves one of each.
  static void Unite(std::vector<TrianglePair>& pairs) {
    const auto names = [](const TrianglePair& pair) { return std::pair(pair.one, pair.other); };
    std::sort(pairs.begin(), pairs.end(),
              [&](const TrianglePair& p, const TrianglePair& q) { return names(p) < names(q); });
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  }

  // Looks at a group, and at the groups that it is cut into; with a stack of its own.
  void Search(Group&& part, TrianglePairs& found) const {
    std::vector<Group> left;
    left.push_back(std::move(part));
    while (!left.empty() && !found.has_more && !context_.IsCancelled()) {
      Group group = std::move(left.back());
      left.pop_back();
      if (group.triangles.size() <= kComparedTogether) {
        Compare(group.triangles, found);
        continue;
      }
      if (MeetsAtACornerAlone(group)) {
        continue;
      }
      std::array<Group, 2> halves;
      if (!Halve(group, halves) && !PeelFan(group, halves, found)) {
        Compare(group.triangles, found);
        continue;
      }
      group = Group();  // its room is needed for its halves
      for (Group& half : halves) {
        if (half.triangles.size() > 1) {
          left.push_back(std::move(half));
        }
      }
    }
  }

  // Compares all with each other.
  void Compare(std::span<const uint32_t> triangles, TrianglePairs& found) const {
    for (size_t i = 0; i < triangles.size(); ++i) {
      if (!CompareWith(triangles[i], triangles.subspan(i + 1), found)) {
        return;
      }
    }
  }

  // Compares one with others; false if that is given up.
  bool CompareWith(uint32_t triangle, std::span<const uint32_t> others, TrianglePairs& found) const {
    for (const uint32_t t : others) {
      if (++found.compared_pairs % kComparedBetweenChecks == 0 && context_.IsCancelled()) {
        return false;
      }
      const uint32_t one = std::min(triangle, t);
      const uint32_t other = std::max(triangle, t);
      if (!AreNear(boxes_[one], boxes_[other])) {
        continue;
      }
      const TriangleContact contact = FindContact(CornersOf(one), CornersOf(other), least_);
      if (contact.kind == TriangleContact::Kind::kNone) {
        continue;
      }
      found.pairs.push_back({one, other, contact});
      if (found.pairs.size() >= 2 * kMostOfPart) {
        Unite(found.pairs);  // groups may share pairs
        if (found.pairs.size() >= kMostOfPart) {
          found.pairs.resize(kMostOfPart);
          found.has_more = true;
          return false;
        }
      }
    }
    return true;
  }

  static bool HasCorner(const std::array<uint32_t, 3>& corners, uint32_t corner) {
    return corners[0] == corner || corners[1] == corner || corners[2] == corner;
  }

  // The corner that most of the triangles have; none when the run is cancelled.
  std::optional<uint32_t> MostCommonCorner(std::span<const uint32_t> triangles) const {
    for (const uint32_t corner : complex_.triangles[triangles[0]]) {
      if (std::all_of(triangles.begin(), triangles.end(),
                      [&](uint32_t t) { return HasCorner(complex_.triangles[t], corner); })) {
        return corner;
      }
    }
    std::vector<uint32_t> corners;
    corners.reserve(3 * triangles.size());
    for (const uint32_t t : triangles) {
      corners.insert(corners.end(), complex_.triangles[t].begin(), complex_.triangles[t].end());
    }
    if (!CancellableSort(corners, std::less<uint32_t>(), context_).ok()) {
      return std::nullopt;
    }
    uint32_t common = corners.front();
    std::ptrdiff_t most = 0;
    for (auto at = corners.begin(); at != corners.end();) {
      const auto next = std::upper_bound(at, corners.end(), *at);
      if (next - at > most) {
        most = next - at;
        common = *at;
      }
      at = next;
    }
    return common;
  }

  // Takes the largest fan out of a group that nothing parts: compares it with the others, and cuts the box of the fan
  // so that its common corner gets the smaller part. The others are a group of their own. False without a large fan.
  bool PeelFan(const Group& group, std::array<Group, 2>& halves, TrianglePairs& found) const {
    if (group.depth >= kMostDepth) {
      return false;
    }
    const std::optional<uint32_t> corner = MostCommonCorner(group.triangles);
    if (!corner.has_value()) {
      return false;
    }
    Group fan{.triangles = {}, .box = group.box, .depth = group.depth + 1};
    std::vector<uint32_t> others;
    for (const uint32_t t : group.triangles) {
      (HasCorner(complex_.triangles[t], *corner) ? fan.triangles : others).push_back(t);
    }
    if (fan.triangles.size() <= kComparedTogether || fan.triangles.size() < others.size()) {
      return false;
    }
    if (!others.empty()) {
      for (const uint32_t t : others) {
        if (!CompareWith(t, fan.triangles, found)) {
          return true;  // given up
        }
      }
      halves[0] = std::move(fan);
      halves[1] = {.triangles = std::move(others), .box = group.box, .depth = group.depth + 1};
      return true;
    }
    return CutTowards(complex_.points[*corner], fan, halves);
  }

  // Cuts off half of the part of the box beyond `corner`, or beyond its own point that is nearest to that, on the side
  // where it reaches farthest; false if nothing is left to cut.
  bool CutTowards(const Point<3>& corner, const Group& fan, std::array<Group, 2>& halves) const {
    Point<3> at;
    for (int axis = 0; axis < 3; ++axis) {
      at[axis] = std::clamp(corner[axis], fan.box.low[axis], fan.box.high[axis]);
    }
    size_t farthest = 0;
    double reach = 0;
    bool is_high = false;
    for (size_t axis = 0; axis < 3; ++axis) {
      const double low = at[axis] - fan.box.low[axis];
      const double high = fan.box.high[axis] - at[axis];
      if (std::max(low, high) > reach) {
        reach = std::max(low, high);
        farthest = axis;
        is_high = high >= low;
      }
    }
    const double cut = at[farthest] + (is_high ? 0.5 : -0.5) * reach;
    if (!(cut > fan.box.low[farthest] && cut < fan.box.high[farthest])) {
      return false;
    }
    Box<3> own = fan.box;
    Box<3> beyond = fan.box;
    (is_high ? own.high : own.low)[farthest] = cut;
    (is_high ? beyond.low : beyond.high)[farthest] = cut;
    for (const auto& [half, box] : {std::pair(&halves[0], own), std::pair(&halves[1], beyond)}) {
      half->box = box;
      half->depth = fan.depth;
      const Box<3> wide = Widened(box);
      for (size_t i = 0; i < fan.triangles.size(); ++i) {
        if (i % kStepsBetweenChecks == 0 && context_.IsCancelled()) {
          return true;
        }
        const uint32_t t = fan.triangles[i];
        if (AreNear(boxes_[t], wide) && !Misses(t, wide)) {
          half->triangles.push_back(t);
        }
      }
    }
    return true;
  }

  bool AreNear(const Box<3>& a, const Box<3>& b) const {
    for (int axis = 0; axis < 3; ++axis) {
      if (a.low[axis] - b.high[axis] > least_ || b.low[axis] - a.high[axis] > least_) {
        return false;
      }
    }
    return true;
  }

  TriangleCorners CornersOf(uint32_t triangle) const {
    return {complex_.triangles[triangle], complex_.TriangleAt(triangle)};
  }

  // Whether all triangles have a corner in common, and no side across from it comes near the box.
  bool MeetsAtACornerAlone(const Group& group) const {
    const Box<3> wide = Widened(group.box);
    for (const uint32_t corner : complex_.triangles[group.triangles[0]]) {
      const bool is_common = std::all_of(group.triangles.begin(), group.triangles.end(),
                                         [&](uint32_t t) { return HasCorner(complex_.triangles[t], corner); });
      if (!is_common) {
        continue;
      }
      const bool is_alone = std::all_of(group.triangles.begin(), group.triangles.end(), [&](uint32_t t) {
        size_t k = 0;
        while (complex_.triangles[t][k] != corner) {
          ++k;
        }
        return SurelyMisses(At(t, (k + 1) % 3), At(t, (k + 2) % 3), wide);
      });
      if (is_alone) {
        return true;
      }
    }
    return false;
  }

  Box<3> Widened(Box<3> box) const {
    for (int axis = 0; axis < 3; ++axis) {
      const double room = RoomAt(box, axis);
      box.low[axis] -= room;
      box.high[axis] += room;
    }
    return box;
  }
  double RoomAt(const Box<3>& box, int axis) const {
    return least_ + kRoom * (std::abs(box.low[axis]) + std::abs(box.high[axis]));
  }

  bool Misses(uint32_t triangle, const Box<3>& box) const {
    return SurelyMissesByPlanes(complex_.TriangleAt(triangle), box);
  }

  // Cuts a group into two that together hold all that it can have; false where no cut is good.
  bool Halve(const Group& group, std::array<Group, 2>& halves) const {
    if (group.triangles.size() <= kComparedTogether || group.depth >= kMostDepth) {
      return false;
    }
    return HalveAcross(group, halves) || HalveAlong(group, halves);
  }

  bool IsGood(const CutCounts& counts, size_t count) const {
    const auto all = static_cast<double>(count);
    return counts.low < count && counts.high < count && counts.Cost() <= kGoodCut * all * all;
  }

  // A box that is cut across an axis.
  struct AxisCut {
    size_t axis = 0;
    double middle = 0;
    double room = 0;
    Box<3> low{};
    Box<3> high{};
    Box<3> wide_low{};  // with room for rounding
    Box<3> wide_high{};
  };
  struct Reach {
    bool is_low = false;
    bool is_high = false;
  };

  // To which sides of a cut a triangle of the box reaches.
  Reach ReachOf(uint32_t t, const AxisCut& cut) const {
    Reach reach{boxes_[t].low[cut.axis] <= cut.middle + cut.room, boxes_[t].high[cut.axis] >= cut.middle - cut.room};
    if (reach.is_low && reach.is_high) {
      reach.is_low = !Misses(t, cut.wide_low);
      reach.is_high = !Misses(t, cut.wide_high);
    }
    return reach;
  }

  // The cuts across each axis, at the mean middle of the parts of the triangles' boxes in that of the group.
  std::array<AxisCut, 3> CutsOf(const Group& group) const {
    // The part of their boxes in that of the group.
    Box<3> tight = group.box;
    Point<3> middle{};
    Box<3> around{group.box.high, group.box.low};
    for (const uint32_t t : group.triangles) {
      for (int axis = 0; axis < 3; ++axis) {
        const double low = std::clamp(boxes_[t].low[axis], group.box.low[axis], group.box.high[axis]);
        const double high = std::clamp(boxes_[t].high[axis], group.box.low[axis], group.box.high[axis]);
        around.low[axis] = std::min(around.low[axis], low);
        around.high[axis] = std::max(around.high[axis], high);
        middle[axis] += 0.5 * (low + high);
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      tight.low[axis] = std::max(tight.low[axis], around.low[axis]);
      tight.high[axis] = std::min(tight.high[axis], around.high[axis]);
      middle[axis] =
          std::clamp(middle[axis] / static_cast<double>(group.triangles.size()), tight.low[axis], tight.high[axis]);
    }
    std::array<AxisCut, 3> cuts;
    for (size_t axis = 0; axis < 3; ++axis) {
      cuts[axis] = {.axis = axis,
                    .middle = middle[axis],
                    .room = RoomAt(group.box, static_cast<int>(axis)),
                    .low = tight,
                    .high = tight};
      cuts[axis].low.high[axis] = middle[axis];
      cuts[axis].high.low[axis] = middle[axis];
      cuts[axis].wide_low = Widened(cuts[axis].low);
      cuts[axis].wide_high = Widened(cuts[axis].high);
    }
    return cuts;
  }

  // Cuts across the axis, at the middle of the triangles, where that parts them best.
  bool HalveAcross(const Group& group, std::array<Group, 2>& halves) const {
    const std::array<AxisCut, 3> cuts = CutsOf(group);
    std::array<CutCounts, 3> counts{};
    for (size_t i = 0; i < group.triangles.size(); ++i) {
      if (i % kStepsBetweenChecks == 0 && context_.IsCancelled()) {
        return false;
      }
      for (size_t axis = 0; axis < 3; ++axis) {
        const Reach reach = ReachOf(group.triangles[i], cuts[axis]);
        counts[axis].low += reach.is_low ? 1 : 0;
        counts[axis].high += reach.is_high ? 1 : 0;
      }
    }
    const auto best = std::min_element(counts.begin(), counts.end(),
                                       [](const CutCounts& a, const CutCounts& b) { return a.Cost() < b.Cost(); });
    if (!IsGood(*best, group.triangles.size())) {
      return false;
    }
    const AxisCut& cut = cuts[static_cast<size_t>(best - counts.begin())];
    halves[0].box = cut.low;
    halves[1].box = cut.high;
    for (size_t i = 0; i < group.triangles.size(); ++i) {
      if (i % kStepsBetweenChecks == 0 && context_.IsCancelled()) {
        break;
      }
      const Reach reach = ReachOf(group.triangles[i], cut);
      if (reach.is_low) {
        halves[0].triangles.push_back(group.triangles[i]);
      }
      if (reach.is_high) {
        halves[1].triangles.push_back(group.triangles[i]);
      }
    }
    return Conclude(group, halves);
  }

  bool Conclude(const Group& group, std::array<Group, 2>& halves) const {
    for (Group& half : halves) {
      half.depth = group.depth + 1;
    }
    if (IsGood({halves[0].triangles.size(), halves[1].triangles.size()}, group.triangles.size())) {
      return true;
    }
    halves = {};
    return false;
  }

  // Cuts by the plane of one of the triangles, or by one along its longest side and across it.
  bool HalveAlong(const Group& group, std::array<Group, 2>& halves) const {
    const uint32_t chosen = group.triangles[group.triangles.size() / 2];
    const Point<3>& a = At(chosen, 0);
    const Point<3> normal = Cross(Difference<3>(At(chosen, 1), a), Difference<3>(At(chosen, 2), a));
    size_t longest = 0;
    const auto side = [&](size_t k) { return Difference<3>(At(chosen, (k + 1) % 3), At(chosen, k)); };
    for (size_t k = 1; k < 3; ++k) {
      longest = NormSq<3>(side(k)) > NormSq<3>(side(longest)) ? k : longest;
    }
    for (const Point<3>& across : {normal, Cross(side(longest), normal)}) {
      if (const std::optional<Plane> plane = PlaneAcross(group, across)) {
        Share(group, *plane, halves);
        if (Conclude(group, halves)) {
          return true;
        }
      }
    }
    return false;
  }

  // The plane with this normal that the middles of as many triangles are below as above.
  std::optional<Plane> PlaneAcross(const Group& group, const Point<3>& normal) const {
    const double length = std::sqrt(NormSq<3>(normal));
    if (!(length > 0 && std::isfinite(length))) {
      return std::nullopt;
    }
    Plane plane;
    for (int axis = 0; axis < 3; ++axis) {
      plane.normal[axis] = normal[axis] / length;
    }
    std::vector<std::pair<double, uint32_t>> places;
    places.reserve(group.triangles.size());
    for (const uint32_t t : group.triangles) {
      const auto [low, high] = ReachAlong(t, plane.normal);
      places.emplace_back(low + high, t);
    }
    const auto middle = places.begin() + static_cast<std::ptrdiff_t>(places.size() / 2);
    std::nth_element(places.begin(), middle, places.end());
    plane.offset = 0.5 * middle->first;
    return plane;
  }

  std::pair<double, double> ReachAlong(uint32_t t, const Point<3>& normal) const {
    const double x = Dot<3>(normal, At(t, 0));
    const double y = Dot<3>(normal, At(t, 1));
    const double z = Dot<3>(normal, At(t, 2));
    return {std::min({x, y, z}), std::max({x, y, z})};
  }

  // Gives each half the triangles that reach to its side of the plane.
  void Share(const Group& group, const Plane& plane, std::array<Group, 2>& halves) const {
    double size = std::abs(plane.offset);
    for (int axis = 0; axis < 3; ++axis) {
      size += std::abs(group.box.low[axis]) + std::abs(group.box.high[axis]);
    }
    for (size_t i = 0; i < group.triangles.size(); ++i) {
      if (i % kStepsBetweenChecks == 0 && context_.IsCancelled()) {
        break;
      }
      const uint32_t t = group.triangles[i];
      const auto [low, high] = ReachAlong(t, plane.normal);
      const double room = least_ + kRoom * (size + std::abs(low) + std::abs(high));
      if (low <= plane.offset + room) {
        halves[0].triangles.push_back(t);
      }
      if (high >= plane.offset - room) {
        halves[1].triangles.push_back(t);
      }
    }
    halves[0].box = group.box;
    halves[1].box = group.box;
  }

  const SurfaceComplex& complex_;
  const double least_;
  const RunContext& context_;
  std::vector<Box<3>> boxes_;  // of triangles
};

}  // namespace

absl::StatusOr<TrianglePairs> FindTrianglePairs(const SurfaceComplex& complex, double least_separation, int threads,
                                                const RunContext& context) {
  return PairFinder(complex, least_separation, context).Find(threads);
}

uint64_t TrianglePairsBytes(uint64_t triangles) {
  // A box each, and their numbers in groups that are halved.
  return triangles * (sizeof(Box<3>) + 5 * sizeof(uint32_t)) +
         (uint64_t{2} << kDepthOfParts) * kMostOfPart * sizeof(TrianglePair);
}

}  // namespace wellspace::core
