#include "core/simplex/flat_tetrahedra.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/base/check_at.h"
#include "core/base/sort_few.h"
#include "core/base/status_macros.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/largest_coordinate.h"
#include "core/geometry/point.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {
namespace {

using Row = std::array<uint32_t, 4>;
using Diagonal = std::array<uint32_t, 2>;

class Flips {
 public:
  // REQUIRES:   all references outlive this.
  Flips(std::span<const double> points, HugeVector<uint32_t>& simplices, HugeVector<uint32_t>& solids,
        const RunContext& context)
      : points_(points), simplices_(simplices), solids_(solids), context_(context) {}

  absl::StatusOr<uint64_t> Run() {
    WELLSPACE_ASSIGN_OR_RETURN(largest_, LargestCoordinate(points_, context_));
    std::vector<uint32_t> flat;
    for (uint32_t s = 0; s < solids_.size(); ++s) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(s, context_));
      if (IsFlat(RowOf(s))) {
        flat.push_back(s);
      }
    }
    if (flat.empty()) {
      return 0;
    }
    WELLSPACE_RETURN_IF_ERROR(FindAround(flat));
    SortByPlaces(flat);
    is_gone_.assign(solids_.size(), false);
    // A flip may leave three tetrahedra around a diagonal that had more.
    for (size_t before = flat.size() + 1; flat.size() < before;) {
      before = flat.size();
      std::vector<uint32_t> left;
      for (const uint32_t s : flat) {
        WELLSPACE_RETURN_IF_ERROR(CheckAt(looked_at_++, context_));
        if (!Flip(s)) {
          left.push_back(s);
        }
      }
      flat = std::move(left);
    }
    DropGone();
    return flat.size();
  }

 private:
  Point<3> At(uint32_t v) const { return PointAt<3>(points_, v); }
  Row RowOf(uint32_t s) const {
    Row row;
    std::copy_n(simplices_.begin() + static_cast<std::ptrdiff_t>(4 * size_t{s}), 4, row.begin());
    return row;
  }
  void SetRow(uint32_t s, const Row& row) {
    std::copy(row.begin(), row.end(), simplices_.begin() + static_cast<std::ptrdiff_t>(4 * size_t{s}));
  }

  // By the altitude on the largest face.
  bool IsFlat(const Row& row) const {
    const Point<3> a = At(row[0]);
    std::array<Point<3>, 3> edges;
    double longest_sq = 0;
    for (size_t k = 0; k < 3; ++k) {
      edges[k] = Difference<3>(At(row[k + 1]), a);
      longest_sq = std::max(longest_sq, NormSq<3>(edges[k]));
    }
    const Point<3> across = Cross(edges[0], edges[1]);
    double area_sq = std::max(NormSq<3>(across), NormSq<3>(Cross(edges[1], edges[2])));
    area_sq = std::max({area_sq, NormSq<3>(Cross(edges[2], edges[0])),
                        NormSq<3>(Cross(Difference<3>(edges[1], edges[0]), Difference<3>(edges[2], edges[0])))});
    for (size_t k = 0; k < 3; ++k) {
      longest_sq = std::max(longest_sq, DistanceSq<3>(edges[k], edges[(k + 1) % 3]));
    }
    const double most = std::min(kFlatAltitude * largest_, kFlatShare * std::sqrt(longest_sq));
    return std::abs(Dot<3>(across, edges[2])) <= most * std::sqrt(area_sq);
  }

  // Finds the tetrahedra at each vertex of a flat one.
  absl::Status FindAround(const std::vector<uint32_t>& flat) {
    for (const uint32_t s : flat) {
      for (const uint32_t v : RowOf(s)) {
        around_[v];
      }
    }
    uint64_t entries = 0;
    WELLSPACE_RETURN_IF_ERROR(ForEachAtFlat([&](uint32_t, std::vector<uint32_t>&) { ++entries; }));
    constexpr uint64_t kBytesOfVertex = 64;
    WELLSPACE_RETURN_IF_ERROR(context_.AllowMemory((simplices_.size() + solids_.size()) * sizeof(uint32_t) +
                                                   2 * entries * sizeof(uint32_t) + around_.size() * kBytesOfVertex));
    return ForEachAtFlat([](uint32_t s, std::vector<uint32_t>& list) { list.push_back(s); });
  }

  // Calls f(tetrahedron, list of one of its vertices) where that is a vertex of a flat one.
  template <typename F>
  absl::Status ForEachAtFlat(const F& f) {
    for (uint32_t s = 0; s < solids_.size(); ++s) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(s, context_));
      ForEachList(RowOf(s), [&](std::vector<uint32_t>& list) { f(s, list); });
    }
    return absl::OkStatus();
  }

  std::array<Point<3>, 4> PlacesOf(uint32_t s) const {
    std::array<Point<3>, 4> places;
    const Row row = RowOf(s);
    std::transform(row.begin(), row.end(), places.begin(), [&](uint32_t v) { return At(v); });
    std::sort(places.begin(), places.end());
    return places;
  }
  void SortByPlaces(std::vector<uint32_t>& flat) const {
    std::sort(flat.begin(), flat.end(), [&](uint32_t a, uint32_t b) { return PlacesOf(a) < PlacesOf(b); });
  }

  // The two diagonals of four points on a plane, which cross each other; the one with the lesser end first. None: one
  // of the points is between the others.
  std::optional<std::array<Diagonal, 2>> DiagonalsOf(const Row& row) const {
    constexpr std::array<std::array<size_t, 4>, 3> kPairs = {{{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}}};
    for (const auto& [a, b, c, d] : kPairs) {
      if (AreOnBothSides(row[a], row[b], row[c], row[d]) && AreOnBothSides(row[c], row[d], row[a], row[b])) {
        std::array<Diagonal, 2> both = {Diagonal{row[a], row[b]}, Diagonal{row[c], row[d]}};
        const auto least = [&](const Diagonal& of) { return std::min(At(of[0]), At(of[1])); };
        if (least(both[1]) < least(both[0])) {
          std::swap(both[0], both[1]);
        }
        return both;
      }
    }
    return std::nullopt;
  }
  // Whether c and d, on a plane with the line through a and b, are on both sides of it.
  bool AreOnBothSides(uint32_t a, uint32_t b, uint32_t c, uint32_t d) const {
    const Point<3> along = Difference<3>(At(b), At(a));
    return Dot<3>(Cross(along, Difference<3>(At(c), At(a))), Cross(along, Difference<3>(At(d), At(a)))) < 0;
  }

  // Takes the flat tetrahedron `s` out, if that can be.
  bool Flip(uint32_t s) {
    if (is_gone_[s] || !IsFlat(RowOf(s))) {
      return true;  // by the flip of another one
    }
    const auto diagonals = DiagonalsOf(RowOf(s));
    return diagonals.has_value() &&
           std::any_of(diagonals->begin(), diagonals->end(), [&](const Diagonal& edge) { return Flip(edge); });
  }

  // Has two tetrahedra take the place of the three around an edge, if there are three in one solid.
  bool Flip(const Diagonal& edge) {
    std::vector<uint32_t> three;
    std::set_intersection(around_[edge[0]].begin(), around_[edge[0]].end(), around_[edge[1]].begin(),
                          around_[edge[1]].end(), std::back_inserter(three));
    if (three.size() != 3 || solids_[three[0]] != solids_[three[1]] || solids_[three[0]] != solids_[three[2]]) {
      return false;
    }
    std::vector<uint32_t> others;  // each twice where the three are all around
    for (const uint32_t s : three) {
      for (const uint32_t v : RowOf(s)) {
        if (v != edge[0] && v != edge[1]) {
          others.push_back(v);
        }
      }
    }
    std::sort(others.begin(), others.end());
    if (others[0] != others[1] || others[2] != others[3] || others[4] != others[5] || others[1] == others[2] ||
        others[3] == others[4]) {
      return false;
    }
    std::array<Row, 2> made;
    for (size_t end = 0; end < 2; ++end) {
      std::optional<Row> row = Positive({edge[end], others[0], others[2], others[4]});
      if (!row.has_value() || IsFlat(*row)) {
        return false;
      }
      made[end] = *row;
    }
    if (AreOnOneSide(edge, {others[0], others[2], others[4]})) {
      return false;
    }
    for (const uint32_t s : three) {
      ForEachList(RowOf(s), [&](std::vector<uint32_t>& list) { std::erase(list, s); });
    }
    for (size_t end = 0; end < 2; ++end) {
      SetRow(three[end], made[end]);
      ForEachList(made[end], [&](std::vector<uint32_t>& list) {
        list.insert(std::lower_bound(list.begin(), list.end(), three[end]), three[end]);
      });
    }
    is_gone_[three[2]] = true;
    return true;
  }

  template <typename F>
  void ForEachList(const Row& row, const F& f) {
    for (const uint32_t v : row) {
      if (const auto found = around_.find(v); found != around_.end()) {
        f(found->second);
      }
    }
  }

  // Whether the ends of an edge are on one side of a triangle: the two tetrahedra would overlap.
  bool AreOnOneSide(const Diagonal& edge, const std::array<uint32_t, 3>& triangle) const {
    const auto sign_of = [&](uint32_t v) {
      return Orientation<3>({At(triangle[0]), At(triangle[1]), At(triangle[2]), At(v)}).sign;
    };
    return sign_of(edge[0]) == sign_of(edge[1]);
  }

  // The same corners, the lowest first, positively oriented; none if they are on a plane, exactly.
  std::optional<Row> Positive(Row row) const {
    SortFew(row);
    const Sign sign = Orientation<3>({At(row[0]), At(row[1]), At(row[2]), At(row[3])}).sign;
    if (sign == Sign::kZero) {
      return std::nullopt;
    }
    if (sign == Sign::kNegative) {
      std::swap(row[2], row[3]);
    }
    return row;
  }

  void DropGone() {
    uint32_t kept = 0;
    for (uint32_t s = 0; s < is_gone_.size(); ++s) {
      if (!is_gone_[s]) {
        SetRow(kept, RowOf(s));
        solids_[kept++] = solids_[s];
      }
    }
    simplices_.resize(4 * size_t{kept});
    solids_.resize(kept);
  }

  const std::span<const double> points_;
  HugeVector<uint32_t>& simplices_;
  HugeVector<uint32_t>& solids_;
  const RunContext& context_;
  absl::flat_hash_map<uint32_t, std::vector<uint32_t>> around_;  // by vertex of a flat one: tetrahedra, ascending
  std::vector<bool> is_gone_;                                    // by tetrahedron
  double largest_ = 0;                                           // LargestCoordinate
  size_t looked_at_ = 0;
};

}  // namespace

absl::StatusOr<uint64_t> FlipFlatTetrahedra(std::span<const double> points, HugeVector<uint32_t>& simplices,
                                            HugeVector<uint32_t>& solids, const RunContext& context) {
  return Flips(points, simplices, solids, context).Run();
}

}  // namespace wellspace::core
