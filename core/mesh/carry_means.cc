#include "core/mesh/carry_means.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/geometry/largest_coordinate.h"
#include "core/mesh/kept_parts.h"
#include "core/mesh/view_rows.h"
#include "core/simplex/determinant.h"
#include "core/simplex/overlap.h"

namespace wellspace::core {
namespace {

constexpr size_t kSimplicesOfABlock = size_t{1} << 8;
constexpr size_t kSimplicesBetweenChecks = size_t{1} << 4;
constexpr size_t kPartsBetweenChecks = size_t{1} << 10;  // each has up to 64 components
constexpr size_t kBlocksOfAThread = 16;                  // of a round

// A simplex of which the other mesh has all but this part is taken for covered: that much is rounding, of flat ones.
constexpr double kUncovered = 1e-6;

// An overlap that is a smaller part of both simplices is rounding.
constexpr double kLeastPart = 1e-14;

// A simplex of the new mesh, and the part of an old one that it has.
struct Part {
  uint32_t simplex;
  double part;
};

// Parts of a block beyond which its memory is not kept for the next round.
constexpr size_t kMostPartsKept = size_t{1} << 14;

// The parts of some old simplices, one after the other.
struct PartsOfBlock {
  std::vector<Part> parts;
  std::vector<size_t> ends;  // by simplex
};

// One transfer: its parts, in their order.
template <int D>
class MeanTransfer {
 public:
  MeanTransfer(const Field& field, const MeshView& from, const MeshView& onto, const CarryRun& run)
      : field_(field), from_(from), onto_(onto), run_(run) {}

  absl::StatusOr<CarriedField> Run() {
    WELLSPACE_RETURN_IF_ERROR(run_.context.AllowMemory(run_.held_bytes + Bytes()));
    WELLSPACE_RETURN_IF_ERROR(Prepare());
    WELLSPACE_RETURN_IF_ERROR(Distribute());
    return Finish();
  }

 private:
  size_t from_count() const { return from_.simplices.size() / (D + 1); }
  size_t onto_count() const { return onto_.simplices.size() / (D + 1); }

  uint64_t Bytes() const;
  // Twins, and volumes in a unit in which all are within the range of doubles.
  absl::Status Prepare();
  double VolumeOf(const Simplex<D>& corners) const;
  // Hands the mass of each old simplex out to the new ones.
  absl::Status Distribute();
  // The parts of the old simplices from `begin` to `end`.
  absl::Status FillBlock(size_t begin, size_t end, PartsOfBlock* block);
  // The parts of the old simplex `s` that new ones have, behind those in `parts`; of a covered one they add up to 1.
  absl::Status FindParts(size_t s, std::vector<Part>* parts);
  // Asks for the memory of so many more parts of this round, beyond those that are counted in Bytes.
  absl::Status AllowParts(uint64_t more);
  absl::Status HandOut(size_t s, std::span<const Part> parts);
  // Makes values of the masses.
  absl::StatusOr<CarriedField> Finish();
  // Values for new simplices that no old one overlaps: those of the old ones nearest to their centroids.
  absl::Status FillOutside(const std::vector<uint32_t>& outside, CarriedField* carried) const;

  const Field& field_;
  const MeshView& from_;
  const MeshView& onto_;
  const CarryRun& run_;

  double scale_ = 1;
  Twins twins_;
  ChangedSimplices<D> changed_;      // of the new simplices
  HugeVector<double> volumes_;       // of the new simplices
  HugeVector<double> covered_;       // of the new simplices: the volume that old ones have
  HugeVector<double> masses_;        // new simplices x components
  HugeVector<double> low_, high_;    // of the values that the masses are made of
  std::atomic<uint64_t> parts_ = 0;  // of the round
};

template <int D>
uint64_t MeanTransfer<D>::Bytes() const {
  const uint64_t onto = onto_count();
  return TwinBytes(from_count(), onto, onto_.points.size() / D) + onto * sizeof(double) * (2 + 4 * field_.components) +
         // Of a round, mostly. Where old simplices overlap many new ones, AllowParts asks for more.
         2 * onto * sizeof(Part) + ChangedSimplices<D>::BytesFor(onto, onto_.points.size() / D);
}

template <int D>
double MeanTransfer<D>::VolumeOf(const Simplex<D>& corners) const {
  Simplex<D> differences;
  Differences<D>(corners, corners[0], scale_, &differences);
  return std::max(0.0, CornerVolume<D>(differences, 0));
}

template <int D>
absl::Status MeanTransfer<D>::Prepare() {
  WELLSPACE_ASSIGN_OR_RETURN(twins_, TwinSearch<D>(from_, onto_, run_.context).Run());
  WELLSPACE_ASSIGN_OR_RETURN(const double largest_before, LargestCoordinate(from_.points, run_.context));
  WELLSPACE_ASSIGN_OR_RETURN(const double largest, LargestCoordinate(onto_.points, run_.context));
  scale_ = ScaleOf(std::max(largest_before, largest));
  WELLSPACE_RETURN_IF_ERROR(changed_.Find(
      onto_, [&](size_t t) { return twins_.of_onto[t] == kNoSimplex; }, run_.context));
  volumes_.resize(onto_count());
  for (size_t t = 0; t < onto_count(); ++t) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(t, run_.context));
    volumes_[t] = VolumeOf(CornersOf<D>(onto_, t));
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const size_t numbers = onto_count() * field_.components;
  WELLSPACE_RETURN_IF_ERROR(Fill(covered_, onto_count(), 0, run_.context));
  WELLSPACE_RETURN_IF_ERROR(Fill(masses_, numbers, 0, run_.context));
  WELLSPACE_RETURN_IF_ERROR(Fill(low_, numbers, kInfinity, run_.context));
  return Fill(high_, numbers, -kInfinity, run_.context);
}

template <int D>
absl::Status MeanTransfer<D>::Distribute() {
  ThreadTeam team(run_.threads);
  std::vector<PartsOfBlock> blocks(team.threads() * kBlocksOfAThread);
  for (size_t begin = 0; begin < from_count(); begin += blocks.size() * kSimplicesOfABlock) {
    const auto first_of = [&](size_t block) { return std::min(from_count(), begin + block * kSimplicesOfABlock); };
    WELLSPACE_RETURN_IF_ERROR(team.TryForEach(
        blocks.size(), [&](size_t block) { return FillBlock(first_of(block), first_of(block + 1), &blocks[block]); }));
    parts_ = 0;
    // In their order, so that sums are the same on any number of threads.
    for (size_t block = 0; block < blocks.size(); ++block) {
      size_t part = 0;
      for (size_t s = first_of(block); s < first_of(block + 1); ++s) {
        const size_t end = blocks[block].ends[s - first_of(block)];
        WELLSPACE_RETURN_IF_ERROR(HandOut(s, std::span(blocks[block].parts).subspan(part, end - part)));
        part = end;
      }
      if (blocks[block].parts.capacity() > kMostPartsKept) {
        blocks[block].parts = {};
      }
    }
  }
  return absl::OkStatus();
}

template <int D>
absl::Status MeanTransfer<D>::AllowParts(uint64_t more) {
  const uint64_t parts = parts_ += more;
  // Vectors grow by doubling, and hold the parts before then.
  const uint64_t bytes = 3 * parts * sizeof(Part);
  const uint64_t counted = 2 * onto_count() * sizeof(Part);
  return bytes <= counted ? absl::OkStatus() : run_.context.AllowMemory(run_.held_bytes + Bytes() + bytes - counted);
}

template <int D>
absl::Status MeanTransfer<D>::FillBlock(size_t begin, size_t end, PartsOfBlock* block) {
  block->parts.clear();
  block->ends.clear();
  for (size_t s = begin; s < end; ++s) {
    if (s % kSimplicesBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(run_.context.Check());
    }
    if (!twins_.has_twin[s]) {
      WELLSPACE_RETURN_IF_ERROR(FindParts(s, &block->parts));
    }
    block->ends.push_back(block->parts.size());
  }
  return absl::OkStatus();
}

template <int D>
absl::Status MeanTransfer<D>::FindParts(size_t s, std::vector<Part>* parts) {
  const Simplex<D> corners = CornersOf<D>(from_, s);
  const double volume = VolumeOf(corners);
  if (!(volume > 0)) {
    return absl::OkStatus();
  }
  Box<D> box{corners[0], corners[0]};
  for (const Point<D>& corner : corners) {
    box.Include(Box<D>{corner, corner});
  }
  const size_t first = parts->size();
  double sum = 0;
  absl::Status status;
  changed_.locator.ForEachNear(box, [&](uint32_t k) {
    if (!status.ok() || run_.context.IsCancelled()) {  // one may overlap all new ones
      return;
    }
    const uint32_t t = changed_.numbers[k];
    const Simplex<D> other = CornersOf<D>(onto_, t);
    // The smaller one is cut: its corners are near its own, so that its heights are exact.
    const double part =
        volumes_[t] < volume ? PartInside<D>(other, corners) * (volumes_[t] / volume) : PartInside<D>(corners, other);
    if (part > kLeastPart || part * volume > kLeastPart * volumes_[t]) {
      parts->push_back({t, part});
      sum += part;
      if (parts->size() % kPartsBetweenChecks == 0) {
        status = AllowParts(kPartsBetweenChecks);
      }
    }
  });
  WELLSPACE_RETURN_IF_ERROR(status);
  if (sum >= 1 - kUncovered) {
    for (size_t k = first; k < parts->size(); ++k) {
      (*parts)[k].part /= sum;
    }
  }
  return run_.context.Check();
}

template <int D>
absl::Status MeanTransfer<D>::HandOut(size_t s, std::span<const Part> parts) {
  const double volume = parts.empty() ? 0 : VolumeOf(CornersOf<D>(from_, s));
  for (size_t k = 0; k < parts.size(); ++k) {
    if (k % kPartsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(run_.context.Check());
    }
    const Part& part = parts[k];
    const double share = part.part * volume;
    covered_[part.simplex] += share;
    for (size_t c = 0; c < field_.components; ++c) {
      const size_t at = part.simplex * field_.components + c;
      const double value = field_.values[s * field_.components + c];
      masses_[at] += share * value;
      low_[at] = std::min(low_[at], value);
      high_[at] = std::max(high_[at], value);
    }
  }
  return absl::OkStatus();
}

template <int D>
absl::StatusOr<CarriedField> MeanTransfer<D>::Finish() {
  CarriedField carried;
  WELLSPACE_RETURN_IF_ERROR(Fill(carried.values, masses_.size(), 0, run_.context));
  std::vector<uint32_t> outside;
  for (size_t t = 0; t < onto_count(); ++t) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(t, run_.context));
    const bool has_twin = twins_.of_onto[t] != kNoSimplex;
    if (!has_twin && !(covered_[t] > 0)) {
      outside.push_back(static_cast<uint32_t>(t));
      continue;
    }
    // Of one that reaches beyond the old mesh, the mean over the part within it.
    const bool is_covered = volumes_[t] > 0 && covered_[t] >= (1 - kUncovered) * volumes_[t];
    const double divisor = is_covered ? volumes_[t] : covered_[t];
    for (size_t at = t * field_.components; at < (t + 1) * field_.components; ++at) {
      carried.values[at] = has_twin
                               ? field_.values[twins_.of_onto[t] * field_.components + (at - t * field_.components)]
                               : std::clamp(masses_[at] / divisor, low_[at], high_[at]);
    }
  }
  carried.outside_count = outside.size();
  WELLSPACE_RETURN_IF_ERROR(FillOutside(outside, &carried));
  return carried;
}

template <int D>
absl::Status MeanTransfer<D>::FillOutside(const std::vector<uint32_t>& outside, CarriedField* carried) const {
  if (outside.empty()) {
    return absl::OkStatus();
  }
  WELLSPACE_RETURN_IF_ERROR(run_.context.AllowMemory(run_.held_bytes + Bytes() + Locator<D>::BytesFor(from_count())));
  WELLSPACE_ASSIGN_OR_RETURN(const Locator<D> locator, Locator<D>::Create(from_.points, from_.simplices, run_.context));
  for (size_t k = 0; k < outside.size(); ++k) {
    if (k % kSimplicesBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(run_.context.Check());
    }
    const Point<D> centroid = CentroidOf<D>(CornersOf<D>(onto_, outside[k]));
    double distance = 0;
    const PlaceInSimplex<D> place = locator.Locate(centroid);
    const uint32_t simplex = place.simplex != kNoSimplex ? place.simplex : locator.Nearest(centroid, &distance).simplex;
    std::copy_n(&field_.values[simplex * field_.components], field_.components,
                &carried->values[outside[k] * field_.components]);
  }
  return absl::OkStatus();
}

}  // namespace

template <int D>
absl::StatusOr<CarriedField> CarryMeans(const Field& field, const MeshView& from, const MeshView& onto,
                                        const CarryRun& run) {
  return MeanTransfer<D>(field, from, onto, run).Run();
}

template absl::StatusOr<CarriedField> CarryMeans<2>(const Field&, const MeshView&, const MeshView&, const CarryRun&);
template absl::StatusOr<CarriedField> CarryMeans<3>(const Field&, const MeshView&, const MeshView&, const CarryRun&);

}  // namespace wellspace::core
