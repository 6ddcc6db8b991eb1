#include "core/input/sorted_cloud.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/cancellable_sort.h"
#include "core/base/dimensions.h"
#include "core/base/memory/prefetch.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"

namespace wellspace::core {
namespace {

// A point that is sorted: half of its prefix on the Z curve, and its number.
struct Entry {
  uint32_t half;
  uint32_t input;
};

// Points that one thread looks at at a time; fewer are sorted by one alone.
constexpr size_t kBlock = kStepsBetweenChecks;

// Parts into which more are shared out before they are sorted, by the highest bits of their halves.
constexpr int kPartBits = 8;
constexpr size_t kParts = size_t{1} << kPartBits;
size_t PartOf(uint32_t half) { return half >> (32 - kPartBits); }

// Sorts by those halves. `scratch` is as long.
absl::Status SortByHalves(std::span<Entry> entries, std::span<Entry> scratch, const RunContext& context) {
  return CancellableRadixSort(
      entries, scratch, [](const Entry& entry) { return entry.half; }, context);
}

// Calls f(begin, count) -> absl::Status for each run of entries that share their half and are several.
template <typename F>
absl::Status ForEachRun(std::span<const Entry> entries, F f, const RunContext& context) {
  size_t runs = 0;
  for (size_t begin = 0, end = 0; begin < entries.size(); begin = end) {
    if (++runs % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    while (end < entries.size() && entries[end].half == entries[begin].half) {
      ++end;
    }
    if (end - begin > 1) {
      WELLSPACE_RETURN_IF_ERROR(f(begin, end - begin));
    }
  }
  return absl::OkStatus();
}

// Sorts the points of a cloud, by several threads.
template <int D>
class CloudSorter {
 public:
  CloudSorter(const Frame<D>& frame, std::span<const double> points, int threads, const RunContext& context,
              std::span<const uint32_t> inputs)
      : frame_(frame),
        grid_(frame.scaled_box, points.size() / D),
        points_(points),
        inputs_(inputs),
        count_(points.size() / D),
        context_(context),
        team_(threads),
        memory_(MakeHugePageBytes(count_ * sizeof(Entry))),
        entries_(reinterpret_cast<Entry*>(memory_.get()), count_) {}

  absl::StatusOr<SortedCloud<D>> Sort() {
    SortedCloud<D> cloud{grid_, {}, {}, {}};
    WELLSPACE_RETURN_IF_ERROR(Resize(cloud.first_input));
    // Until the points are taken their halves are there.
    const std::span<uint32_t> halves = cloud.first_input;
    counts_.assign((count_ + kBlock - 1) / kBlock, {});
    // The corners of the box follow, and as many vertices as are added to most clouds. Unused room of a large array
    // takes no memory; that of a small one, which shares pages, would.
    const size_t room = counts_.size() > 1 ? count_ + count_ / 4 : count_ / 8;
    cloud.points.reserve(count_ + room + (size_t{1} << D));
    absl::Status resized;
    const auto resize = [&] { resized = Resize(cloud.points); };
    const absl::Cleanup end = [this] { team_.Drop(); };  // where something is refused
    counts_.size() > 1 ? team_.BeginCall(resize) : resize();
    const auto find_halves = [&](size_t block) { return FindHalves(block, halves); };
    WELLSPACE_RETURN_IF_ERROR(team_.TryForEach(counts_.size(), find_halves));
    ShareOut(halves);
    team_.End();
    WELLSPACE_RETURN_IF_ERROR(resized);
    parts_.resize(part_begins_.size() - 1);
    const auto take_part = [&](size_t part) {
      const absl::Status status = SortPart(part);
      return status.ok() ? TakePoints(part, cloud) : status;
    };
    WELLSPACE_RETURN_IF_ERROR(team_.TryForEach(parts_.size(), take_part));
    CloseGaps(cloud);
    return cloud;
  }

 private:
  // The result of taking the points of a part.
  struct Part {
    size_t distinct = 0;
    std::vector<typename SortedCloud<D>::Duplicate> duplicates;  // `sorted` counts from the begin of the part
  };

  // The number by which a point is named.
  size_t InputOf(size_t point) const { return inputs_.empty() ? point : inputs_[point]; }
  Point<D> PointOf(const Entry& entry) const { return frame_.Scaled(PointAt<D>(points_, entry.input)); }
  GridPoint<D> CubeOf(const Entry& entry) const { return grid_.CubeOf(PointOf(entry)); }

  // Makes room for all points, block by block, since bringing in the memory takes a while.
  template <typename T>
  absl::Status Resize(HugeVector<T>& items) const {
    items.reserve(count_);
    while (items.size() < count_) {
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
      items.resize(std::min(count_, items.size() + kBlock));
    }
    return absl::OkStatus();
  }

  // Finds the upper halves of the prefixes of a block of points, which are checked.
  absl::Status FindHalves(size_t block, std::span<uint32_t> halves) {
    WELLSPACE_RETURN_IF_ERROR(context_.Check());
    const Box<D>& box = frame_.box;
    const double unscale = 1 / frame_.scale;  // a power of two
    std::array<uint32_t, kParts> counts{};
    for (size_t i = block * kBlock; i < std::min(count_, (block + 1) * kBlock); ++i) {
      const Point<D> p = PointAt<D>(points_, i);
      const Point<D> scaled_p = frame_.Scaled(p);
      if (!IsRepresentable<D>(box, p, scaled_p, unscale)) {
        return PointError<D>(frame_, p, InputOf(i));
      }
      halves[i] = static_cast<uint32_t>(MortonPrefix<D, 32>(grid_.CubeOf(scaled_p), grid_.levels()) >> 32);
      ++counts[PartOf(halves[i])];
    }
    counts_[block] = counts;
    return absl::OkStatus();
  }

  // Makes the entries, those of each part side by side.
  void ShareOut(std::span<const uint32_t> halves) {
    if (counts_.size() == 1) {
      part_begins_ = {0, count_};
      for (size_t i = 0; i < count_; ++i) {
        entries_[i] = {halves[i], static_cast<uint32_t>(i)};
      }
      return;
    }
    size_t place = 0;
    for (size_t part = 0; part < kParts; ++part) {
      part_begins_.push_back(place);
      for (std::array<uint32_t, kParts>& counts : counts_) {
        place += std::exchange(counts[part], static_cast<uint32_t>(place));
      }
    }
    part_begins_.push_back(place);
    team_.ForEach(counts_.size(), [this, halves](size_t block) {
      if (context_.IsCancelled()) {
        return;
      }
      for (size_t i = block * kBlock; i < std::min(count_, (block + 1) * kBlock); ++i) {
        entries_[counts_[block][PartOf(halves[i])]++] = {halves[i], static_cast<uint32_t>(i)};
      }
    });
  }

  std::span<Entry> EntriesOf(size_t part) const {
    return entries_.subspan(part_begins_[part], part_begins_[part + 1] - part_begins_[part]);
  }

  // Sorts a part by the upper halves of the prefixes; those that share it, which are few in most clouds, by the lower,
  // and then by their cubes.
  absl::Status SortPart(size_t part) const {
    WELLSPACE_RETURN_IF_ERROR(context_.Check());
    const std::span<Entry> entries = EntriesOf(part);
    HugeVector<Entry> memory(entries.size());
    const std::span<Entry> scratch = memory;
    WELLSPACE_RETURN_IF_ERROR(SortByHalves(entries, scratch, context_));
    std::vector<std::pair<GridPoint<D>, Entry>> with_cubes;
    const auto sort_run = [&](size_t begin, size_t size) {
      const std::span<Entry> run = entries.subspan(begin, size);
      for (Entry& entry : run) {
        entry.half = static_cast<uint32_t>(MortonPrefix<D>(CubeOf(entry), grid_.levels()));
      }
      WELLSPACE_RETURN_IF_ERROR(SortByHalves(run, scratch.subspan(begin, size), context_));
      const auto sort_alike = [&](size_t from, size_t alike) {
        return SortByCubes(run.subspan(from, alike), with_cubes);
      };
      return ForEachRun(run, sort_alike, context_);
    };
    return ForEachRun(entries, sort_run, context_);
  }

  // Sorts entries by their cubes on the Z curve, those of one cube by number. `with_cubes` is scratch.
  absl::Status SortByCubes(std::span<Entry> entries, std::vector<std::pair<GridPoint<D>, Entry>>& with_cubes) const {
    with_cubes.clear();
    for (const Entry& entry : entries) {
      with_cubes.emplace_back(CubeOf(entry), entry);
    }
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(
        with_cubes,
        [](const auto& a, const auto& b) {
          return a.first != b.first ? MortonLess<D>(a.first, b.first) : a.second.input < b.second.input;
        },
        context_));
    std::transform(with_cubes.begin(), with_cubes.end(), entries.begin(), [](const auto& one) { return one.second; });
    return absl::OkStatus();
  }

  // Takes the distinct points of a part, which is sorted, to where it begins. Points of one cube are equal, or too
  // close to be served.
  absl::Status TakePoints(size_t part, SortedCloud<D>& cloud) {
    const std::span<const Entry> entries = EntriesOf(part);
    const std::span<Point<D>> points = std::span(cloud.points).subspan(part_begins_[part], entries.size());
    const std::span<uint32_t> inputs = std::span(cloud.first_input).subspan(part_begins_[part], entries.size());
    auto& [distinct, duplicates] = parts_[part];
    size_t count = 0;
    for (size_t i = 0; i < entries.size(); ++i) {
      if (i % kStepsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
      }
      if (i + kPointsAhead < entries.size()) {
        PrefetchLine(&points_[size_t{entries[i + kPointsAhead].input} * D]);
      }
      const Point<D> p = PointOf(entries[i]);
      const uint32_t input = entries[i].input;
      const bool may_be_alike = i > 0 && entries[i].half == entries[i - 1].half;
      if (!may_be_alike || CubeOf(entries[i]) != CubeOf(entries[i - 1])) {
        WELLSPACE_RETURN_IF_ERROR(CheckFaces<D>(frame_, p, InputOf(input)));
        points[count] = p;
        inputs[count] = input;
        ++count;
      } else if (p != points[count - 1]) {
        return TooCloseError<D>(frame_, p, InputOf(input), std::sqrt(DistanceSq<D>(p, points[count - 1])),
                                absl::StrCat("points[", InputOf(inputs[count - 1]), "]"));
      } else {
        duplicates.push_back({input, static_cast<uint32_t>(count - 1)});
      }
    }
    distinct = count;
    return absl::OkStatus();
  }

  // Brings the distinct points of all parts together.
  void CloseGaps(SortedCloud<D>& cloud) const {
    size_t to = 0;
    for (size_t part = 0; part < parts_.size(); ++part) {
      const auto& [distinct, duplicates] = parts_[part];
      const size_t from = part_begins_[part];
      if (to != from) {
        std::copy_n(cloud.points.begin() + from, distinct, cloud.points.begin() + to);
        std::copy_n(cloud.first_input.begin() + from, distinct, cloud.first_input.begin() + to);
      }
      for (const auto& [input, sorted] : duplicates) {
        cloud.duplicates.push_back({input, static_cast<uint32_t>(to + sorted)});
      }
      to += distinct;
    }
    cloud.points.resize(to);
    cloud.first_input.resize(to);
  }

  const Frame<D>& frame_;
  const MortonGrid<D> grid_;
  const std::span<const double> points_;
  const std::span<const uint32_t> inputs_;
  const size_t count_;
  const RunContext& context_;
  ThreadTeam team_;
  const HugePageBytes memory_;
  const std::span<Entry> entries_;
  std::vector<std::array<uint32_t, kParts>> counts_;  // by block and part, entries; then where the next is put
  std::vector<size_t> part_begins_;                   // and the end
  std::vector<Part> parts_;
};

}  // namespace

template <int D>
absl::StatusOr<SortedCloud<D>> SortCloud(const Frame<D>& frame, std::span<const double> points, int threads,
                                         const RunContext& context, std::span<const uint32_t> inputs) {
  return CloudSorter<D>(frame, points, threads, context, inputs).Sort();
}

template <int D>
HugeVector<uint32_t> SortedCloud<D>::SortedOfInputs() const {
  HugeVector<uint32_t> sorted(first_input.size() + duplicates.size());
  for (uint32_t i = 0; i < first_input.size(); ++i) {
    sorted[first_input[i]] = i;
  }
  for (const Duplicate& duplicate : duplicates) {
    sorted[duplicate.input] = duplicate.sorted;
  }
  return sorted;
}

template <int D>
absl::StatusOr<PointNames> NamePoints(SortedCloud<D> cloud, const RunContext& context) {
  PointNames names;
  if (cloud.duplicates.empty()) {  // each is named as it was given: nothing has to be looked up
    names.of_input.resize(cloud.first_input.size());
    std::iota(names.of_input.begin(), names.of_input.end(), 0);
    names.of_sorted = std::move(cloud.first_input);
    return names;
  }
  names.of_input = cloud.SortedOfInputs();
  constexpr uint32_t kUnnamed = ~uint32_t{0};
  names.of_sorted.resize(cloud.first_input.size(), kUnnamed);
  uint32_t named = 0;
  for (uint32_t i = 0; i < names.of_input.size(); ++i) {
    if (i % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    uint32_t& name = names.of_sorted[names.of_input[i]];
    if (name == kUnnamed) {
      name = named++;
    }
    names.of_input[i] = name;
  }
  return names;
}

#define WELLSPACE_INSTANTIATE(D)                                                                      \
  template struct SortedCloud<D>;                                                                     \
  template absl::StatusOr<SortedCloud<D>> SortCloud<D>(const Frame<D>&, std::span<const double>, int, \
                                                       const RunContext&, std::span<const uint32_t>); \
  template absl::StatusOr<PointNames> NamePoints<D>(SortedCloud<D>, const RunContext&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
