#include "core/mesh/mesh_delta.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kNoRow = std::numeric_limits<uint32_t>::max();
constexpr size_t kRowsBetweenChecks = size_t{1} << 14;
// Slots of a table for each of its rows, at least: most rows are then found in the first one or two.
constexpr uint64_t kSlotsPerRow = 2;
// Rows that are compared at once: most of them are the same.
constexpr size_t kRowsOfBlock = 256;

constexpr uint64_t Mixed(uint64_t hash, uint64_t value) {
  hash = (hash ^ value) * 0x9e37'79b9'7f4a'7c15;
  return hash ^ (hash >> 32);
}

uint64_t SlotsFor(uint64_t rows) { return std::bit_ceil(kSlotsPerRow * std::max<uint64_t>(rows, 1)); }

// Finds rows of an array by their numbers.
class RowTable {
 public:
  // For at most `most` rows of `rows`.
  RowTable(std::span<const uint32_t> rows, size_t width, uint64_t most)
      : rows_(rows), width_(width), slots_(SlotsFor(most), kNoRow) {}

  absl::Status Fill(const RunContext& context) {
    for (uint64_t row = 0; row < rows_.size() / width_; ++row) {
      if (row % kRowsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      Add(row);
    }
    return absl::OkStatus();
  }

  void Add(uint64_t row) {
    uint64_t slot = HashOf(&rows_[row * width_]);
    while (slots_[slot] != kNoRow) {
      slot = (slot + 1) & (slots_.size() - 1);
    }
    slots_[slot] = static_cast<uint32_t>(row);
  }

  // The first row that equals `row`, or kNoRow.
  uint32_t Find(const uint32_t* row) const {
    uint64_t slot = HashOf(row);
    while (slots_[slot] != kNoRow && !std::equal(row, row + width_, &rows_[slots_[slot] * width_])) {
      slot = (slot + 1) & (slots_.size() - 1);
    }
    return slots_[slot];
  }

 private:
  uint64_t HashOf(const uint32_t* row) const {
    uint64_t hash = width_;
    for (size_t i = 0; i < width_; ++i) {
      hash = Mixed(hash, row[i]);
    }
    return hash & (slots_.size() - 1);
  }

  const std::span<const uint32_t> rows_;
  const size_t width_;
  HugeVector<uint32_t> slots_;  // numbers of rows; free ones are kNoRow
};

uint64_t BytesIn(const MovedRows& rows) {
  return rows.runs.size() * sizeof(RowRun) + rows.added.size() * sizeof(uint32_t);
}

absl::Status TooLarge(uint64_t max_bytes) {
  return absl::ResourceExhaustedError(absl::StrCat("the difference takes more than ", max_bytes, " bytes"));
}

// Where the rows of `next` come from. Equal rows next to each other make a run, so that most of them are not looked up.
absl::StatusOr<MovedRows> DiffMovedRows(std::span<const uint32_t> base, std::span<const uint32_t> next, size_t width,
                                        uint64_t max_bytes, const RunContext& context) {
  RowTable table(base, width, base.size() / width);
  WELLSPACE_RETURN_IF_ERROR(table.Fill(context));
  MovedRows moved;
  const uint64_t base_rows = base.size() / width;
  uint64_t expected = 0;  // the row of the base behind the last that was kept
  for (uint64_t row = 0; row < next.size() / width; ++row) {
    if (row % kRowsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
      if (BytesIn(moved) > max_bytes) {
        return TooLarge(max_bytes);
      }
    }
    const uint32_t* values = &next[row * width];
    const bool goes_on = expected < base_rows && std::equal(values, values + width, &base[expected * width]);
    const uint64_t found = goes_on ? expected : table.Find(values);
    if (found == kNoRow) {
      if (moved.runs.empty()) {
        moved.runs.push_back({.begin = 0, .kept = 0, .added = 0});
      }
      ++moved.runs.back().added;
      moved.added.insert(moved.added.end(), values, values + width);
      continue;
    }
    if (moved.runs.empty() || moved.runs.back().added > 0 || found != expected) {
      moved.runs.push_back({.begin = found, .kept = 0, .added = 0});
    }
    ++moved.runs.back().kept;
    expected = found + 1;
  }
  return moved;
}

// The runs of `rows`, whose kept ones are in the order of the base, but that new rows which equal one that goes are
// kept: repair takes simplices away, and makes some of them again.
absl::StatusOr<MovedRows> KeepingEqualRows(std::span<const uint32_t> base, const MovedRows& rows, size_t width,
                                           const RunContext& context) {
  uint64_t gone = base.size() / width;
  for (const RowRun& run : rows.runs) {
    gone -= run.kept;
  }
  RowTable table(base, width, gone);
  uint64_t next = 0;
  const auto add_until = [&](uint64_t end) -> absl::Status {
    for (; next < end; ++next) {
      if (next % kRowsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      table.Add(next);
    }
    return absl::OkStatus();
  };
  for (const RowRun& run : rows.runs) {
    WELLSPACE_RETURN_IF_ERROR(add_until(run.begin));
    next = run.begin + run.kept;
  }
  WELLSPACE_RETURN_IF_ERROR(add_until(base.size() / width));
  MovedRows moved;
  const auto keep = [&](uint64_t begin, uint64_t count) {
    const bool goes_on = !moved.runs.empty() && moved.runs.back().added == 0 &&
                         moved.runs.back().begin + moved.runs.back().kept == begin;
    if (goes_on) {
      moved.runs.back().kept += count;
    } else if (count > 0) {
      moved.runs.push_back({.begin = begin, .kept = count, .added = 0});
    }
  };
  const uint32_t* values = rows.added.data();
  for (const RowRun& run : rows.runs) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    keep(run.begin, run.kept);
    for (uint64_t i = 0; i < run.added; ++i, values += width) {
      if (const uint32_t found = table.Find(values); found != kNoRow) {
        keep(found, 1);
        continue;
      }
      if (moved.runs.empty()) {
        moved.runs.push_back({.begin = 0, .kept = 0, .added = 0});
      }
      ++moved.runs.back().added;
      moved.added.insert(moved.added.end(), values, values + width);
    }
  }
  return moved;
}

template <typename T>
bool AreSame(const T* a, const T* b, size_t count) {
  return std::memcmp(a, b, count * sizeof(T)) == 0;  // to the bit: zeros have signs
}

template <typename T>
ChangedRows<T> DiffChangedRows(std::span<const T> base, std::span<const T> next, size_t width) {
  ChangedRows<T> rows{.rows = next.size() / width};
  const size_t common = std::min(base.size(), next.size()) / width;
  for (size_t first = 0; first < common; first += kRowsOfBlock) {
    const size_t end = std::min(first + kRowsOfBlock, common);
    if (AreSame(&base[first * width], &next[first * width], (end - first) * width)) {
      continue;
    }
    for (size_t row = first; row < end; ++row) {
      if (!AreSame(&base[row * width], &next[row * width], width)) {
        rows.changed.push_back(static_cast<uint32_t>(row));
        rows.values.insert(rows.values.end(), &next[row * width], &next[row * width] + width);
      }
    }
  }
  rows.values.insert(rows.values.end(), next.begin() + common * width, next.end());
  return rows;
}

// Calls visit(row, base_row) for each row that the runs keep.
template <typename Visit>
void ForEachKept(const HugeVector<RowRun>& runs, Visit visit) {
  uint64_t row = 0;
  for (const RowRun& run : runs) {
    for (uint64_t i = 0; i < run.kept; ++i) {
      visit(row + i, run.begin + i);
    }
    row += run.kept + run.added;
  }
}

// Calls visit(first, end) for the rows of each run that are new.
template <typename Visit>
void ForEachAdded(const HugeVector<RowRun>& runs, Visit visit) {
  uint64_t row = 0;
  for (const RowRun& run : runs) {
    visit(row + run.kept, row + run.kept + run.added);
    row += run.kept + run.added;
  }
}

ChangedRows<int32_t> DiffRegions(const Mesh& base, const Mesh& next, const HugeVector<RowRun>& runs) {
  ChangedRows<int32_t> rows{.rows = next.simplex_regions.size()};
  if (base.simplex_regions.empty() || next.simplex_regions.empty()) {
    rows.values = next.simplex_regions;
    return rows;
  }
  ForEachKept(runs, [&](uint64_t row, uint64_t base_row) {
    if (next.simplex_regions[row] != base.simplex_regions[base_row]) {
      rows.changed.push_back(static_cast<uint32_t>(row));
      rows.values.push_back(next.simplex_regions[row]);
    }
  });
  ForEachAdded(runs, [&](uint64_t first, uint64_t end) {
    rows.values.insert(rows.values.end(), next.simplex_regions.begin() + first, next.simplex_regions.begin() + end);
  });
  return rows;
}

template <typename T>
uint64_t BytesOf(const HugeVector<T>& values) {
  return values.size() * sizeof(T);
}

template <typename T>
uint64_t BytesOf(const ChangedRows<T>& rows) {
  return BytesOf(rows.changed) + BytesOf(rows.values);
}

}  // namespace

uint64_t MeshDelta::memory_bytes() const {
  return BytesOf(points) + BytesOf(weights) + BytesOf(input_vertex) + BytesOf(vertex_origins) + BytesOf(vertex_tags) +
         BytesIn(kept_simplices) + BytesOf(simplex_regions) + BytesIn(kept_facets) + BytesIn(kept_ridges) +
         BytesOf(moved_vertices);
}

uint64_t DeltaScratchBytes(uint64_t base_simplices) { return SlotsFor(base_simplices) * sizeof(uint32_t); }

absl::StatusOr<MeshDelta> DiffMeshes(const Mesh& base, const Mesh& next, const MovedRows* simplices, uint64_t max_bytes,
                                     const RunContext& context) {
  if (base.dimension != next.dimension || base.dimension < 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("meshes of dimension ", base.dimension, " and ", next.dimension, " have no difference"));
  }
  for (const Mesh* mesh : {&base, &next}) {
    if (std::max({mesh->vertex_count(), mesh->simplex_count(), mesh->facet_count(), uint64_t{mesh->input_vertex.size()},
                  uint64_t{mesh->ridges.size() / 2}}) >= kNoRow) {
      return absl::ResourceExhaustedError("differences are of meshes with less than 2^32 - 1 simplices and vertices");
    }
  }
  const size_t dimension = base.dimension;
  MeshDelta delta;
  delta.dimension = base.dimension;
  delta.base_vertices = base.vertex_count();
  delta.base_simplices = base.simplex_count();
  delta.vertices = next.vertex_count();
  delta.simplices = next.simplex_count();
  delta.points = DiffChangedRows<double>(base.points, next.points, dimension);
  delta.weights = DiffChangedRows<double>(base.weights, next.weights, 1);
  delta.input_vertex = DiffChangedRows<uint32_t>(base.input_vertex, next.input_vertex, 1);
  delta.vertex_origins = DiffChangedRows<uint32_t>(base.vertex_origins, next.vertex_origins, 1);
  delta.vertex_tags = DiffChangedRows<int32_t>(base.vertex_tags, next.vertex_tags, 1);
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  if (simplices != nullptr) {
    WELLSPACE_ASSIGN_OR_RETURN(delta.kept_simplices,
                               KeepingEqualRows(base.simplices, *simplices, dimension + 1, context));
  } else {
    WELLSPACE_ASSIGN_OR_RETURN(delta.kept_simplices,
                               DiffMovedRows(base.simplices, next.simplices, dimension + 1, max_bytes, context));
  }
  delta.simplex_regions = DiffRegions(base, next, delta.kept_simplices.runs);
  WELLSPACE_ASSIGN_OR_RETURN(delta.kept_facets, DiffMovedRows(base.facets, next.facets, dimension, max_bytes, context));
  WELLSPACE_ASSIGN_OR_RETURN(delta.kept_ridges, DiffMovedRows(base.ridges, next.ridges, 2, max_bytes, context));
  delta.domain_low = next.domain_low;
  delta.domain_high = next.domain_high;
  delta.moved_vertices = next.moved_vertices;
  delta.boundary = next.boundary;
  delta.regions = next.regions;
  delta.statistics = next.statistics;
  return delta.memory_bytes() <= max_bytes ? absl::StatusOr<MeshDelta>(std::move(delta)) : TooLarge(max_bytes);
}

}  // namespace wellspace::core
