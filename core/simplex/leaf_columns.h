// The vertices of some leaves in columns, and the leaves around one of them: where the vertices near a site are looked for.
#ifndef WELLSPACE_CORE_SIMPLEX_LEAF_COLUMNS_H_
#define WELLSPACE_CORE_SIMPLEX_LEAF_COLUMNS_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/ids.h"
#include "core/geometry/box.h"
#include "core/simplex/facet_pencil.h"
#include "core/simplex/site_columns.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// Numbers the vertices of the leaves that are asked for from 0, leaf by leaf, with gaps: the place of a vertex. Places that come from
// gaps hold no vertex.
//
// Thread safety: thread-compatible. Reused: no allocation once warm.
// Invariants: (1) the vertices of a leaf have places side by side, in whole groups, which one vector instruction takes; (2) the
// surroundings hold every leaf that comes as near as `margin_` to the home leaf on every axis, if that is not negative.
template <int D>
class LeafColumns {
 public:
  // Forgets all leaves.
  void Reset(const QueryStructure<D>& structure) {
    structure_ = &structure;
    if (slot_of_.size() < structure.tree().node_count()) {
      slot_of_.resize(structure.tree().node_count(), 0);
      is_met_.resize(structure.tree().node_count(), false);
    }
    // Slots count on from block to block, so that what is left of earlier ones is too low to be valid.
    if (first_slot_ > std::numeric_limits<uint32_t>::max() / 2) {
      std::fill(slot_of_.begin(), slot_of_.end(), 0);
      first_slot_ = 1;
    } else {
      first_slot_ += static_cast<uint32_t>(slots_.size());
    }
    slots_.clear();
    groups_.clear();
    ids_.clear();
    home_ = kNoNode;
    double largest = 0;
    for (int i = 0; i < D; ++i) {
      largest = std::max({largest, std::abs(structure.box().low[i]), std::abs(structure.box().high[i])});
    }
    rounding_ = 0x1p-49 * largest;
  }

  // Gives places to the vertices of a leaf that has none yet.
  void AddLeaf(NodeId leaf) { SlotOf(leaf); }

  // More than a rounded coordinate of a leaf, or the rounded difference of two, can be wrong by.
  double rounding() const { return rounding_; }

  // How many places the vertices of a leaf take.
  static uint32_t PlacesOf(uint32_t vertices) { return (vertices + kLanes - 1) / kLanes * kLanes; }
  uint32_t place_count() const { return static_cast<uint32_t>(ids_.size()); }
  VertexId vertex(uint32_t place) const { return ids_[place]; }
  Point<D> point(uint32_t place) const {
    const Group& group = groups_[place / kLanes];
    Point<D> p;
    for (int i = 0; i < D; ++i) {
      p[i] = group.x[i][place % kLanes];
    }
    return p;
  }
  uint32_t PlaceOf(VertexId v) {
    const Slot slot = slots_[SlotOf(structure_->tree().leaf_of(v))];
    uint32_t place = slot.begin * kLanes;
    while (ids_[place] != v) {
      ++place;
    }
    return place;
  }

  // Makes `leaf` the home leaf, with those around it: at least all that come nearer than `margin` to it on every axis, also by rounded
  // coordinates.
  //
  // Returns false if that takes more than `most_leaves`; nothing may be gathered then.
  // Complexity: O(leaves around it, or most_leaves); O(1) if it was the last leaf, with as large a margin, or as small a one in vain.
  bool Surround(NodeId leaf, double margin, size_t most_leaves) {
    const double needed = margin + rounding_;
    if (leaf == home_ && (needed <= margin_ || needed >= too_large_)) {
      return needed <= margin_;
    }
    if (leaf != home_) {
      home_ = leaf;
      too_large_ = std::numeric_limits<double>::infinity();
    }
    const Box<D> cube = structure_->tree().BoxOf(leaf);
    const double wanted = std::max(cube.high[0] - cube.low[0], kSlack * needed);
    if (MeetSurroundings(wanted, most_leaves)) {
      margin_ = wanted;
      return true;
    }
    margin_ = -1;
    too_large_ = needed;
    return false;
  }

  // Puts into `near` the vertices with |w| <= radius but for that at `but`, w the vector from `site` to them; all of them, as the squares as
  // computed say.
  //
  // REQUIRES: `site` in the home leaf, which is surrounded by `radius`.
  // Returns how many leaves have such vertices, or almost.
  //
  // Complexity: O(leaves of the surroundings and their vertices).
  uint32_t Gather(const Point<D>& site, double radius, uint32_t but, SiteColumns<D>& near) const {
    const double radius_sq = radius * radius;
    const double reach_sq = (radius + rounding_) * (radius + rounding_) * (1 + 0x1p-48);
    near.Clear();
    uint32_t opened = 0;
    for (const Pair& leaves : pairs_) {
      const Lanes distance_sq = DistancesSq(leaves, site, Point<D>{});
      for (size_t lane = 0; lane < kLanes; ++lane) {
        if (distance_sq[lane] > reach_sq) {
          continue;
        }
        ++opened;
        near.Reserve((leaves.end[lane] - leaves.begin[lane]) * kLanes);
        for (uint32_t g = leaves.begin[lane]; g < leaves.end[lane]; ++g) {
          Lanes w[D + 1];
          w[D] = Lanes{};
          for (int i = 0; i < D; ++i) {
            w[i] = groups_[g].x[i] - site[i];
            w[D] += w[i] * w[i];
          }
          const Mask is_near = w[D] <= radius_sq;
          if ((is_near[0] | is_near[1]) == 0) {
            continue;
          }
          for (size_t j = 0; j < kLanes; ++j) {
            const auto place = static_cast<uint32_t>(g * kLanes + j);
            std::array<double, D + 1> entry;
            for (int i = 0; i <= D; ++i) {
              entry[i] = w[i][j];
            }
            // No branch, since none could be foretold.
            near.AppendIf((is_near[j] & 1) != 0 && place != but, place, entry);
          }
        }
      }
    }
    near.Finish();
    return opened;
  }

  // Whether all leaves that come to the ball about `site` are among the surroundings; false if nothing is surrounded.
  bool Covers(const Point<D>& site, const FacetBall<D>& ball) const {
    const Box<D> home = structure_->tree().BoxOf(home_);
    const Point<D> centre = ball.Centre();
    const double least = ball.Reach() + 4 * rounding_ - margin_;
    bool is_covered = margin_ >= 0;
    for (int i = 0; i < D; ++i) {
      is_covered &= (centre[i] - (home.low[i] - site[i]) >= least) & ((home.high[i] - site[i]) - centre[i] >= least);
    }
    return is_covered;
  }

  // Calls f(place, power) as ForEachInside does, for those leaves of the surroundings that come to the ball and that
  // may_hold(box) accepts. f may shrink the ball: to one that lies, where may_hold() accepts, in what it was.
  //
  // REQUIRES:   the surroundings cover the ball as it is at first.
  // Returns how many leaves were looked at.
  // Complexity: O(leaves of the surroundings, and vertices of those looked at).
  template <typename MayHold, typename F>
  uint32_t ForEachInsideSurroundings(const Point<D>& site, const FacetBall<D>& ball, MayHold may_hold, F f) {
    uint32_t looked_at = 0;
    for (const Pair& leaves : pairs_) {
      const Lanes distance_sq = DistancesSq(leaves, site, ball.Centre());
      const double reach = ball.Reach() + 2 * rounding_;  // of the same ball as the distances
      for (size_t lane = 0; lane < kLanes; ++lane) {
        if (distance_sq[lane] > reach * reach) {
          continue;
        }
        Box<D> box;
        for (int i = 0; i < D; ++i) {
          box.low[i] = leaves.low[i][lane];
          box.high[i] = leaves.high[i][lane];
        }
        if (may_hold(box)) {
          ++looked_at;
          ForEachInside(Slot{leaves.begin[lane], leaves.end[lane]}, site, ball, f);
        }
      }
    }
    return looked_at;
  }

  // Calls look(leaf) outward from `from`, for it and for every leaf that facets join to it through leaves which meets(box of a leaf) accepts;
  // each once. What meets() accepts may become less with every call of look(): leaves that it no longer accepts are left out.
  //
  // Complexity: O(leaves looked at and their neighbours), whatever meets() says.
  template <typename Meets, typename Look>
  void LookOutward(NodeId from, Meets meets, Look look) {
    const LeafTree<D>& tree = structure_->tree();
    met_.clear();
    Meet(from);
    for (size_t next = 0; next < met_.size(); ++next) {
      const NodeId leaf = met_[next];
      if (next > 0 && !meets(tree.BoxOf(leaf))) {
        continue;
      }
      look(leaf);
      tree.ForEachFaceNeighbour(leaf, [&](NodeId beyond) {
        if (!IsMet(beyond) && meets(tree.BoxOf(beyond))) {
          Meet(beyond);
        }
      });
    }
    ForgetMet();
  }

  // Calls f(place, power) for each vertex of the leaf whose power to the ball about `site`, as computed, is below its doubt; f may change the
  // ball, for the vertices that follow, and says whether it has.
  //
  // Returns the number of vertices in the leaf.
  template <typename F>
  uint32_t ForEachInside(NodeId leaf, const Point<D>& site, const FacetBall<D>& ball, F f) {
    ForEachInside(slots_[SlotOf(leaf)], site, ball, f);
    const auto* bucket = structure_->tree().BucketOf(leaf);
    return bucket == nullptr ? 0 : bucket->count;
  }

  // What it takes in memory, but for what it has for each node of the tree.
  uint64_t MemoryBytes() const {
    return slots_.capacity() * sizeof(Slot) + groups_.capacity() * sizeof(Group) + ids_.capacity() * sizeof(VertexId) +
           pairs_.capacity() * sizeof(Pair) + met_.capacity() * sizeof(NodeId);
  }

 private:
  static constexpr double kSlack = 1.2;  // another vertex of the leaf may ask for a little more

  static constexpr size_t kLanes = 2;
  using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
  using Mask = int64_t __attribute__((vector_size(kLanes * sizeof(double))));

  struct Group {
    Lanes x[D];
  };
  // Of a leaf, its groups.
  struct Slot {
    uint32_t begin;
    uint32_t end;
  };
  struct Pair {
    Lanes low[D];
    Lanes high[D];
    uint32_t begin[kLanes];
    uint32_t end[kLanes];
  };

  // The squared distances of two leaves from `p`, which is relative to `site`.
  static Lanes DistancesSq(const Pair& leaves, const Point<D>& site, const Point<D>& p) {
    Lanes distance_sq{};
    for (int i = 0; i < D; ++i) {
      const Lanes below = leaves.low[i] - site[i] - p[i];
      const Lanes above = p[i] - (leaves.high[i] - site[i]);
      Lanes gap = below > above ? below : above;
      gap = gap > 0 ? gap : Lanes{};
      distance_sq += gap * gap;
    }
    return distance_sq;
  }

  template <typename F>
  void ForEachInside(Slot slot, const Point<D>& site, const FacetBall<D>& ball, F f) const {
    for (uint32_t g = slot.begin; g < slot.end; ++g) {
      for (size_t j = 0; j < kLanes;) {
        Lanes power{};
        Lanes product{};
        for (int i = 0; i < D; ++i) {
          const Lanes w = groups_[g].x[i] - site[i];
          power += w * w;
          product += w * ball.twice_centre[i];
        }
        power -= product;
        for (bool is_changed = false; j < kLanes && !is_changed; ++j) {
          is_changed = power[j] < ball.doubt && f(static_cast<uint32_t>(g * kLanes + j), power[j]);
        }
      }
    }
  }

  uint32_t SlotOf(NodeId leaf) {
    uint32_t& slot = slot_of_[Index(leaf)];
    if (slot >= first_slot_) {
      return slot - first_slot_;
    }
    slot = first_slot_ + static_cast<uint32_t>(slots_.size());
    const auto begin = static_cast<uint32_t>(groups_.size());
    if (const auto* bucket = structure_->tree().BucketOf(leaf); bucket != nullptr) {
      for (uint32_t first = 0; first < bucket->count; first += kLanes) {
        Group& group = groups_.emplace_back();
        for (uint32_t j = 0; j < kLanes; ++j) {
          const bool is_vertex = first + j < bucket->count;
          ids_.push_back(is_vertex ? bucket->ids[first + j] : kNoVertex);
          for (int i = 0; i < D; ++i) {
            // Nothing is near to what is no number.
            group.x[i][j] = is_vertex ? bucket->positions[first + j][i] : std::numeric_limits<double>::quiet_NaN();
          }
        }
      }
    }
    slots_.push_back({begin, static_cast<uint32_t>(groups_.size())});
    return slot - first_slot_;
  }

  // False if there are too many.
  bool MeetSurroundings(double margin, size_t most_leaves) {
    const LeafTree<D>& tree = structure_->tree();
    Box<D> covered = tree.BoxOf(home_);
    for (int i = 0; i < D; ++i) {
      covered.low[i] -= margin;
      covered.high[i] += margin;
    }
    met_.clear();
    pairs_.clear();
    Meet(home_);
    size_t lane = 0;
    for (size_t next = 0; next < met_.size() && met_.size() <= most_leaves; ++next) {
      const NodeId leaf = met_[next];
      const Box<D> cube = tree.BoxOf(leaf);
      const Slot slot = slots_[SlotOf(leaf)];
      if (slot.begin != slot.end) {
        if (lane == 0) {
          Pair& pair = pairs_.emplace_back();
          for (int i = 0; i < D; ++i) {
            pair.low[i] += std::numeric_limits<double>::infinity();
            pair.high[i] -= std::numeric_limits<double>::infinity();
          }
        }
        Pair& pair = pairs_.back();
        for (int i = 0; i < D; ++i) {
          pair.low[i][lane] = cube.low[i];
          pair.high[i][lane] = cube.high[i];
        }
        pair.begin[lane] = slot.begin;
        pair.end[lane] = slot.end;
        lane = (lane + 1) % kLanes;
      }
      tree.ForEachFaceNeighbour(leaf, [&](NodeId beyond) {
        if (IsMet(beyond)) {
          return;
        }
        const Box<D> other = tree.BoxOf(beyond);
        for (int i = 0; i < D; ++i) {
          if (other.low[i] > covered.high[i] || other.high[i] < covered.low[i]) {
            return;
          }
        }
        Meet(beyond);
      });
    }
    ForgetMet();
    return met_.size() <= most_leaves;
  }
  bool IsMet(NodeId leaf) const { return is_met_[Index(leaf)]; }
  void Meet(NodeId leaf) {
    is_met_[Index(leaf)] = true;
    met_.push_back(leaf);
  }
  void ForgetMet() {
    for (const NodeId leaf : met_) {
      is_met_[Index(leaf)] = false;
    }
  }

  const QueryStructure<D>* structure_ = nullptr;
  double rounding_ = 0;
  std::vector<uint32_t> slot_of_;  // by node, valid from first_slot_ on
  uint32_t first_slot_ = 1;
  std::vector<Slot> slots_;
  std::vector<Group> groups_;
  std::vector<VertexId> ids_;  // by place

  NodeId home_ = kNoNode;
  double margin_ = -1;    // of the surroundings
  double too_large_ = 0;  // margins of home_ from this on have too many leaves
  std::vector<Pair> pairs_;
  std::vector<NodeId> met_;
  std::vector<bool> is_met_;  // by node
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_LEAF_COLUMNS_H_
